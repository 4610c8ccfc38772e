# Specification: ROS bag format 2.0 (wiki.ros.org/Bags/Format/2.0).
# SPDX-License-Identifier: BSD-3-Clause
"""ROS 1 bags, chunk by chunk; no index is needed.

A bag that was not closed (.bag.active) has no index: its chunks are walked from the first one on, twice, once for the
topics and once for the messages.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Final

from allanite.errors import FormatError
from allanite.files.readers.rosbag.storage import Batch, Chunked, Connection, Torn, unpacked
from allanite.lazy_dataclasses import dataclass

__all__ = ["Bag1"]

_MESSAGE, _BAG, _INDEX, _CHUNK, _CHUNK_INFO, _CONNECTION = 2, 3, 4, 5, 6, 7
_LONGEST_HEADER = 1 << 20
_U32: Final = struct.Struct("<I")

Fields = dict[bytes, bytes]


@dataclass(frozen=True, slots=True)
class _HeaderLayout:
    """Header of a message as this writer lays it out, so that the next one is taken apart at once."""

    length: int
    parts: struct.Struct
    words: tuple[bytes, ...]
    time_first: bool

    @classmethod
    def of(cls, header: bytes) -> _HeaderLayout | None:
        """The layout of a header with op, conn and time; None for any other."""
        at = {name: header.find(name + b"=") for name in (b"conn", b"time")}
        if min(at.values()) < 0:
            return None
        (first, _), (second, _) = sorted(((p, n) for n, p in at.items()))
        time_first = at[b"time"] < at[b"conn"]
        widths = (8, 4) if time_first else (4, 8)
        codes = ("Q", "I") if time_first else ("I", "Q")
        a, b = first + 5, second + 5
        c, d = a + widths[0], b + widths[1]
        if b < c or d > len(header):
            return None
        parts = struct.Struct(f"<{a}s{codes[0]}{b - c}s{codes[1]}{len(header) - d}s")
        return cls(len(header), parts, (header[:a], header[c:b], header[d:]), time_first)


class Bag1(Chunked):
    """A ROS 1 bag.

    Raises
    ------
    FormatError
        Another version, an encrypted bag, damage.
    LimitError
        A chunk that is a decompression bomb.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._layout: _HeaderLayout | None = None
        version = self._file.readline(40).strip()
        if version != b"#ROSBAG V2.0":
            raise FormatError(
                f"{self._name}: {version[:20].decode('latin-1')} is not supported, only version 2.0; convert it with "
                "'rosbag fix'"
            )
        try:
            op, fields, _ = self._record()
        except Torn:
            raise FormatError(f"{self._name}: the bag ends within its header") from None
        if op != _BAG:
            raise FormatError(f"{self._name}: the first record is not a bag header")
        if fields.get(b"encryptor"):
            raise FormatError(f"{self._name}: the bag is encrypted")
        self._begin = self._file.tell()
        self._end = self._size
        index = int.from_bytes(fields.get(b"index_pos", b""), "little")
        self._settle(indexed=self._read_index(index))

    # -- records -----------------------------------------------------------------------------------------

    def _take(self, size: int) -> bytes:
        if size > self._size - self._file.tell():
            raise Torn
        return self._file.read(size)

    def _record(self, skip: Collection[int] = ()) -> tuple[int, Fields, bytes]:
        """The next record of the file: what it is, its header, its data (left out for those to be skipped)."""
        length = int.from_bytes(self._take(4), "little")
        if length > _LONGEST_HEADER:
            raise FormatError(f"{self._name}: damaged at byte {self._file.tell() - 4}")
        fields = self._fields(self._take(length))
        op = fields.get(b"op", b"\0")[0]
        size = int.from_bytes(self._take(4), "little")
        if op in skip:
            if size > self._size - self._file.tell():
                raise Torn
            self._file.seek(size, 1)
            return op, fields, b""
        return op, fields, self._take(size)

    def _fields(self, header: bytes) -> Fields:
        fields: Fields = {}
        at = 0
        while at < len(header):
            length = int.from_bytes(header[at : at + 4], "little")
            word, sign, value = header[at + 4 : at + 4 + length].partition(b"=")
            at += 4 + length
            if not sign or at > len(header):
                raise FormatError(f"{self._name}: damaged header of a record")
            fields[word] = value
        return fields

    def _connect(self, fields: Fields, data: bytes) -> None:
        key = int.from_bytes(fields.get(b"conn", b""), "little")
        more = self._fields(data)
        kind = more.get(b"type", b"").decode("utf-8", "replace")
        package, _, word = kind.partition("/")
        self._found.setdefault(
            key,
            Connection(
                key=key,
                topic="/" + fields.get(b"topic", b"").decode("utf-8", "replace").strip("/"),
                kind=f"{package}/msg/{word}" if "/" not in word else kind,
                encoding="ros1",
                definition=more.get(b"message_definition", b"").decode("utf-8", "replace"),
                form="msg",
                count=0,
            ),
        )

    # -- what is in it -----------------------------------------------------------------------------------

    def _read_index(self, place: int) -> bool:
        """Connections and chunks out of the index at the end; False if there is none that can be read."""
        if not self._begin <= place < self._size:
            self.remarks.append("the bag was not closed and has no index: its chunks are read one by one")
            return False
        chunks: list[tuple[int, frozenset[int]]] = []
        self._file.seek(place)
        try:
            while self._file.tell() < self._size:
                op, fields, data = self._record()
                if op == _CONNECTION:
                    self._connect(fields, data)
                elif op == _CHUNK_INFO:
                    pairs = [p for p in struct.iter_unpack("<II", data[: len(data) // 8 * 8]) if p[1]]
                    self._counts.update(dict(pairs))
                    chunks.append(
                        (int.from_bytes(fields[b"chunk_pos"], "little"), frozenset(k for k, _ in pairs))
                    )
        except (Torn, FormatError, KeyError):
            self._found, self._counts = {}, Counter()
            self.remarks.append("the index of the bag is damaged: its chunks are read one by one")
            return False
        self._chunks, self._end = sorted(chunks, key=lambda c: c[0]), place
        return True

    # -- chunks ------------------------------------------------------------------------------------------

    def _contents(self, wanted: frozenset[int] | None) -> Iterator[bytes]:
        if self._chunks is not None and wanted is not None:
            for place, held in self._chunks:
                if held & wanted:
                    self._file.seek(place)
                    try:
                        op, fields, data = self._record()
                    except Torn:
                        op = 0
                    if op != _CHUNK:
                        raise self._no_chunk(place)
                    yield self._unpack(fields, data)
            return
        self._file.seek(self._begin)
        try:
            while self._file.tell() < self._end:
                op, fields, data = self._record(skip=(_INDEX, _CHUNK_INFO))
                if op == _CHUNK:
                    here = self._file.tell()
                    yield self._unpack(fields, data)
                    self._file.seek(here)
                elif op == _CONNECTION:
                    self._connect(fields, data)
        except Torn:
            self._remark_torn()

    def _unpack(self, fields: Fields, data: bytes) -> bytes:
        compression = fields.get(b"compression", b"").decode("latin-1")
        return unpacked(data, compression, int.from_bytes(fields.get(b"size", b""), "little"), self._name)

    def _messages(self, chunk: bytes, wanted: frozenset[int] | None) -> Batch:
        batch: Batch = {}
        at, number, layout = 0, _U32.unpack_from, self._layout
        try:
            while at < len(chunk):
                (length,) = number(chunk, at)
                begin = at + 4
                middle = begin + length
                (size,) = number(chunk, middle)
                at = middle + 4 + size
                if at > len(chunk):
                    raise FormatError(f"{self._name}: a record is longer than its chunk")
                words: tuple[bytes, ...] = ()
                if layout is not None and layout.length == length:
                    first, one, second, two, third = layout.parts.unpack_from(chunk, begin)
                    words = (first, second, third)
                if layout is None or words != layout.words:
                    header = chunk[begin:middle]
                    fields = self._fields(header)
                    op = fields.get(b"op", b"\0")[0]
                    if op == _CONNECTION:
                        self._connect(fields, chunk[middle + 4 : at])
                    if op != _MESSAGE:
                        continue
                    self._layout = layout = _HeaderLayout.of(header)
                    if layout is None:
                        raise FormatError(f"{self._name}: a message without connection or time")
                    _, one, _, two, _ = layout.parts.unpack_from(chunk, begin)
                key, time = (two, one) if layout.time_first else (one, two)
                if wanted is None or key in wanted:
                    received, messages = batch.setdefault(key, ([], []))
                    received.append((time & 0xFFFFFFFF) * 10**9 + (time >> 32))
                    if wanted is not None:
                        messages.append(chunk[middle + 4 : at])
        except struct.error:
            raise FormatError(f"{self._name}: a chunk is damaged") from None
        return batch
