# Specification: MCAP, version 0 (mcap.dev/spec), and its profiles for ROS 1 and ROS 2.
# SPDX-License-Identifier: BSD-3-Clause
"""MCAP files, chunk by chunk. One that was not finished is read as far as it goes."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Final
from zlib import crc32

from allanite.errors import FormatError
from allanite.files.readers.rosbag.storage import Batch, Chunked, Connection, Torn, unpacked

__all__ = ["MAGIC", "Mcap"]

MAGIC: Final = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 1, 2, 3, 4, 5, 6
_CHUNK_INDEX, _STATISTICS, _DATA_END = 8, 11, 15
_FORMS: Final = {"ros2msg": "msg", "ros1msg": "msg", "ros2idl": "idl", "omgidl": "idl"}
_FOOTER_BYTES = 9 + 20 + len(MAGIC)
_ONE_BY_ONE = 4096  # messages outside of chunks that are handed over together
_LARGEST = 1 << 31  # a record that is held in memory [bytes]


class _Bytes:
    """Values one after another in a record."""

    def __init__(self, content: bytes) -> None:
        self.content, self.at = content, 0

    def numbers(self, form: str) -> tuple[int, ...]:
        values = struct.unpack_from(f"<{form}", self.content, self.at)
        self.at += struct.calcsize(f"<{form}")
        return values

    def take(self) -> bytes:
        """Bytes behind their number."""
        (length,) = self.numbers("I")
        if length > len(self.content) - self.at:
            raise struct.error("too short")
        self.at += length
        return self.content[self.at - length : self.at]

    def text(self) -> str:
        return self.take().decode("utf-8", "replace")


class Mcap(Chunked):
    """An MCAP file.

    Raises
    ------
    FormatError
        Damage.
    LimitError
        A chunk that is a decompression bomb.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        if self._file.read(len(MAGIC)) != MAGIC:
            raise FormatError(f"{self._name}: no MCAP file")
        self._schemas: dict[int, tuple[str, str, str]] = {}
        self._settle(indexed=self._read_summary())

    # -- records -----------------------------------------------------------------------------------------

    def _records(self, start: int, stop: int, keep: Collection[int]) -> Iterator[tuple[int, bytes]]:
        """Records of the file; of those that are not kept only the kind."""
        at = start
        while at < stop:
            self._file.seek(at)
            head = self._file.read(9)
            if len(head) < 9:
                raise Torn
            op, length = struct.unpack("<BQ", head)
            at += 9 + length
            if at > self._size:
                raise Torn
            if op in keep and length > _LARGEST:
                raise FormatError(f"{self._name}: a record of {length} bytes")
            yield op, self._file.read(length) if op in keep else b""

    def _understand(self, op: int, content: bytes) -> None:
        """Take schemas, channels and counts from a record."""
        record = _Bytes(content)
        try:
            if op == _SCHEMA:
                (key,) = record.numbers("H")
                self._schemas[key] = record.text(), record.text(), record.text()
            elif op == _CHANNEL:
                key, schema = record.numbers("HH")
                kind, language, definition = self._schemas.get(schema, ("", "", ""))
                package, _, word = kind.partition("/")
                self._found.setdefault(
                    key,
                    Connection(
                        key=key,
                        topic=record.text(),
                        kind=f"{package}/msg/{word}" if word and "/" not in word else kind,
                        encoding=record.text(),
                        definition=definition,
                        form=_FORMS.get(language, ""),
                        count=0,
                    ),
                )
            elif op == _STATISTICS:
                record.at = 42
                self._counts.update(dict(struct.iter_unpack("<HQ", record.take())))
            elif op == _CHUNK_INDEX:
                _, _, place, _ = record.numbers("QQQQ")
                held = frozenset(k for k, _ in struct.iter_unpack("<HQ", record.take()))
                self._chunks = [*(self._chunks or []), (place, held)]
        except struct.error:
            raise FormatError(f"{self._name}: a record of kind {op} is damaged") from None

    def _read_summary(self) -> bool:
        """Schemas, channels, counts and places of the chunks; False if the file has no summary that says all that."""
        self._file.seek(max(self._size - _FOOTER_BYTES, 0))
        tail = self._file.read()
        if len(tail) < _FOOTER_BYTES or not tail.endswith(MAGIC) or tail[0] != _FOOTER:
            self.remarks.append("the file is incomplete: it is read as far as it goes")
            return False
        (start,) = struct.unpack_from("<Q", tail, 9)
        end = self._size - _FOOTER_BYTES
        if not len(MAGIC) < start < end:
            return False
        try:
            for op, content in self._records(start, end, (_SCHEMA, _CHANNEL, _STATISTICS, _CHUNK_INDEX)):
                self._understand(op, content)
        except (Torn, FormatError):
            self.remarks.append("the summary of the file is damaged: it is read record by record")
            self._schemas, self._found, self._counts, self._chunks = {}, {}, Counter(), None
            return False
        if not self._found or not self._counts or not all(c.kind for c in self._found.values()):
            self._schemas, self._found, self._counts, self._chunks = {}, {}, Counter(), None
            return False
        return True

    # -- messages ----------------------------------------------------------------------------------------

    def _contents(self, wanted: frozenset[int] | None) -> Iterator[bytes]:
        return self._walk() if wanted is None or self._chunks is None else self._indexed(wanted)

    def _indexed(self, wanted: frozenset[int]) -> Iterator[bytes]:
        for place, held in sorted(self._chunks or [], key=lambda c: c[0]):
            if held and not held & wanted:
                continue
            op = 0
            if len(MAGIC) <= place < self._size:
                try:
                    op, content = next(self._records(place, place + 1, (_CHUNK,)))
                except Torn:
                    op = 0
            if op != _CHUNK:
                raise self._no_chunk(place)
            yield self._unpack(content)

    def _walk(self) -> Iterator[bytes]:
        """Everything that may hold messages, as it stands in the file: chunks unpacked, records gathered."""
        loose: list[bytes] = []
        try:
            for op, content in self._records(
                len(MAGIC), self._size - len(MAGIC), (_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK)
            ):
                if op in (_FOOTER, _DATA_END):
                    break
                if op == _CHUNK:
                    yield self._unpack(content)
                elif op in (_SCHEMA, _CHANNEL):
                    self._understand(op, content)
                elif op == _MESSAGE:
                    loose.append(struct.pack("<BQ", op, len(content)) + content)
                    if len(loose) == _ONE_BY_ONE:
                        yield b"".join(loose)
                        loose = []
        except Torn:
            self._remark_torn()
        if loose:
            yield b"".join(loose)

    def _unpack(self, content: bytes) -> bytes:
        record = _Bytes(content)
        try:
            _, _, size, checksum = record.numbers("QQQI")
            compression = record.text()
            (length,) = record.numbers("Q")
        except struct.error:
            raise FormatError(f"{self._name}: a chunk is damaged") from None
        packed = content[record.at : record.at + length]
        chunk = unpacked(packed, compression, size, self._name)
        if checksum and crc32(chunk) != checksum:
            raise FormatError(f"{self._name}: a chunk does not match its checksum")
        return chunk

    def _messages(self, chunk: bytes, wanted: frozenset[int] | None) -> Batch:
        batch: Batch = {}
        at, head, body = 0, struct.Struct("<BQ").unpack_from, struct.Struct("<HIQ").unpack_from
        try:
            while at < len(chunk):
                op, length = head(chunk, at)
                begin, at = at + 9, at + 9 + length
                if at > len(chunk):
                    raise FormatError(f"{self._name}: a record is longer than its chunk")
                if op != _MESSAGE:
                    if wanted is None and op in (_SCHEMA, _CHANNEL):
                        self._understand(op, chunk[begin:at])
                    continue
                key, _, time = body(chunk, begin)
                if wanted is None or key in wanted:
                    received, messages = batch.setdefault(key, ([], []))
                    received.append(time)
                    if wanted is not None:
                        messages.append(chunk[begin + 22 : at])
        except struct.error:
            raise FormatError(f"{self._name}: a chunk is damaged") from None
        return batch
