# SPDX-License-Identifier: BSD-3-Clause
# Specification: Arrow columnar format 1.x, "Encapsulated message format" and "IPC streaming format".
"""The bytes of a segment: an Arrow IPC stream each of whose batches can be verified alone.

A segment is an opening (the schema message, with the header of the run), batches, and the end-of-stream mark. The
metadata of each batch hold one text of fixed length::

    batch=00000017 utc_ns=+1790000000000000000 bytes=0000001216 crc32=5d0c1f3a

``bytes`` is the length of the whole message and ``crc32`` its CRC-32, with its own eight digits as zeros, begun from
that of the opening: it covers data, metadata, row count, every byte, and ties the batch to its run and header. Only
what has passed it is given to Arrow.
"""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import field
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError
from allanite.files.store.batch import Batch
from allanite.files.store.header import TAKEN, Header
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.arrow_numbers import arrow_of, numbers_of
from allanite.plain_files.json_values import parse_plain

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = [
    "END",
    "LONGEST_METADATA",
    "Message",
    "NoBatch",
    "Opening",
    "decoding",
    "encode",
    "find_message",
    "holds_batch",
    "message_at",
    "samples",
    "why_none",
]

#: The end of an Arrow stream.
END: Final = b"\xff\xff\xff\xff\x00\x00\x00\x00"

_FORMAT: Final = 1
_KEY: Final = b"allanite.run"
_MARK: Final = END[:4]
#: Bytes; metadata that claim more are damaged.
LONGEST_METADATA: Final = 1 << 24
_FACTS: Final = re.compile(rb"batch=(\d{8}) utc_ns=([+-]\d{19}) bytes=(\d{10}) crc32=([0-9a-f]{8})")
_NO_CRC: Final = b"crc32=00000000"


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """The beginning of a segment.

    Attributes
    ----------
    run : str
        Random identity of the run: batches of another run do not verify.
    header : Header
    schema : pyarrow.Schema
        Columns, and all of the above as metadata.
    data : bytes
        The schema as the message that it is in the stream.
    crc : int
        CRC-32 from which those of the batches begin.
    """

    run: str
    header: Header
    schema: pa.Schema = field(repr=False)
    data: bytes = field(repr=False)
    crc: int

    @classmethod
    def of(cls, header: Header, run: str) -> Opening:
        """The beginning of every segment with this header."""
        facts = {"format": _FORMAT, "run": run, "header": header.to_json()}
        schema = _schema_of(header).with_metadata({_KEY: json.dumps(facts, ensure_ascii=False)})
        data = schema.serialize().to_pybytes()
        return cls(run=run, header=header, schema=schema, data=data, crc=zlib.crc32(data))

    @classmethod
    def read(cls, data: bytes) -> Opening:
        """The opening at the beginning of a segment.

        Raises
        ------
        FormatError
            It is cut or damaged, not ours, or of a later version. What is not found here (a digit in a setting) is
            found by the CRC of the first batch.
        """
        import pyarrow as pa

        size = _metadata_size(data, 0)
        if size is None:
            raise FormatError("it does not begin with a complete Arrow schema")
        data = data[: 8 + size]
        try:
            schema = pa.ipc.read_schema(pa.py_buffer(data))
            facts = parse_plain(schema.metadata[_KEY])
            version, run, header = facts["format"], str(facts["run"]), Header.from_json(facts["header"])
            # Types as well as names: samples are taken out of the buffers of just these types.
            whole = schema.equals(_schema_of(header), check_metadata=False)
        except (pa.ArrowException, OSError, ValueError, KeyError, TypeError, FormatError) as error:
            raise FormatError(f"its start is damaged ({type(error).__name__})") from None
        if version != _FORMAT:
            raise FormatError(f"it is of format {version}, and this allanite reads {_FORMAT}: update it")
        if not whole:
            raise FormatError("its start is damaged (columns)")
        return cls(run=run, header=header, schema=schema, data=data, crc=zlib.crc32(data))


def _schema_of(header: Header) -> pa.Schema:
    """The columns of a segment."""
    import pyarrow as pa

    kinds = {"counter": pa.int64(), "monotonic_ns": pa.int64(), "flags": pa.uint8()}
    columns = [pa.field(name, kinds[name], nullable=False) for name in TAKEN]
    return pa.schema(
        [
            *columns,
            *(
                pa.field(c.name, pa.float64(), nullable=False, metadata={"unit": c.unit})
                for c in header.channels
            ),
        ]
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """A verified batch in the bytes of a segment.

    Attributes
    ----------
    opening : Opening
        Under which it verifies.
    number : int
        Its place in the segment, from 0.
    utc_ns : int [ns]
    data : bytes
    end : int
        Where the next one begins.
    """

    opening: Opening
    number: int
    utc_ns: int
    data: bytes
    end: int

    def batch(self) -> Batch:
        """The samples."""
        import pyarrow as pa

        with decoding():
            message = pa.ipc.read_message(pa.py_buffer(self.data))
            read = pa.ipc.read_record_batch(message, self.opening.schema)
            counter, monotonic_ns, flags, *values = (
                _column(read, i, kind) for i, kind in enumerate(_kinds(self.opening))
            )
        return Batch(
            counter=counter,
            monotonic_ns=monotonic_ns,
            flags=flags,
            values=np.stack(values, axis=1),
            utc_ns=self.utc_ns,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class NoBatch:
    """Why no batch begins at a place.

    Attributes
    ----------
    why : str
        "" where the stream ended in order, or has not gone on yet.
    torn : bool
        The bytes end before the batch does: it may still be being written.
    """

    why: str = ""
    torn: bool = False


def encode(batch: Batch, number: int, opening: Opening) -> bytes:
    """The message of a batch, to be written at once."""
    import pyarrow as pa

    columns = [batch.counter, batch.monotonic_ns, batch.flags, *np.ascontiguousarray(batch.values.T)]
    arrays = [arrow_of(column) for column in columns]
    facts = f"batch={number:08d} utc_ns={batch.utc_ns:+020d} bytes={0:010d} ".encode() + _NO_CRC
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, opening.schema) as writer:
        writer.write_batch(
            pa.RecordBatch.from_arrays(arrays, schema=opening.schema), custom_metadata={_KEY: facts}
        )
    message: bytes = sink.getvalue().to_pybytes()[len(opening.data) : -len(END)]
    message = message.replace(b"bytes=0000000000", b"bytes=%010d" % len(message), 1)
    return message.replace(_NO_CRC, b"crc32=%08x" % zlib.crc32(message, opening.crc), 1)


def message_at(data: bytes, at: int, opening: Opening, offset: int = 0) -> Message | NoBatch:
    """The batch that begins at a place, verified; or why there is none. `offset`: bytes of the file before `data`."""
    left = data[at : at + 8]
    if left in (b"", END):
        return NoBatch()
    if not (left.startswith(_MARK) or _MARK.startswith(left)):
        return NoBatch(why="no batch begins there")
    size = _metadata_size(data, at)
    if size is None:
        torn = len(left) < 8 or 0 < int.from_bytes(left[4:], "little") < LONGEST_METADATA
        return NoBatch(why="the last batch is truncated" if torn else "no batch begins there", torn=torn)
    match = _FACTS.search(data, at + 8, at + 8 + size)
    if match is None:
        return NoBatch(why="the metadata of a batch are damaged")
    number, utc_ns, length = (int(group) for group in match.groups()[:3])
    message = data[at : at + length]
    if len(message) < length:
        return NoBatch(why="the last batch is truncated", torn=True)
    crc = match.start(4) - at
    unsigned = message[:crc] + b"00000000" + message[crc + 8 :]
    if zlib.crc32(unsigned, opening.crc) != int(match[4], 16):
        return NoBatch(why="the checksum of a batch does not match")
    return Message(opening=opening, number=number, utc_ns=utc_ns, data=message, end=offset + at + length)


def why_none(data: bytes, at: int, opening: Opening) -> NoBatch:
    """Why no batch begins at a place; torn only if the bytes may be those of one that was being written."""
    message = message_at(data, at, opening)
    if isinstance(message, Message):
        return NoBatch()
    if message.torn and (_is_whole(data[at:], opening) or find_message(data, at + 8, opening) is not None):
        return NoBatch(why="the length of a batch is damaged")
    return message


def holds_batch(data: bytes) -> bool:
    """Whether there is anything of a batch among these bytes."""
    return _FACTS.search(data) is not None


def _is_whole(rest: bytes, opening: Opening) -> bool:
    """Whether a batch that seems to be cut ends where its bytes end: by its own length, or by its checksum."""
    match = _FACTS.search(rest)
    if match is None:
        return False
    if int(match[3]) <= len(rest):
        return True
    length = match.start(3)
    right = rest[:length] + b"%010d" % len(rest) + rest[length + 10 :]
    unsigned = right[: match.start(4)] + b"00000000" + right[match.start(4) + 8 :]
    return zlib.crc32(unsigned, opening.crc) == int(match[4], 16)


def samples(data: bytes, opening: Opening, utc_ns: int) -> Batch:
    """All samples of batches that are verified as one batch, at the pace of Arrow; there is at least one."""
    import pyarrow as pa

    with decoding():
        table = pa.ipc.open_stream(pa.py_buffer(opening.data + data)).read_all()
        table.validate()  # before anything is copied: Arrow trusts the lengths that a message states
        if any(column.null_count for column in table.columns[: len(TAKEN)]):
            raise ValueError("samples without a place")
        table = table.combine_chunks()
        columns = [
            numbers_of(column).astype(kind, copy=False)
            for column, kind in zip(table.columns, _kinds(opening), strict=True)
        ]
    counter, monotonic_ns, flags = columns[: len(TAKEN)]
    return Batch(
        counter=counter,
        monotonic_ns=monotonic_ns,
        flags=flags,
        values=np.stack(columns[len(TAKEN) :], axis=1),
        utc_ns=utc_ns,
    )


def find_message(data: bytes, at: int, opening: Opening) -> tuple[int, Message] | None:
    """The first batch behind a place that verifies, and where it begins: at a multiple of eight bytes."""
    while (at := data.find(_MARK, at)) >= 0:
        if at % 8 == 0 and isinstance(message := message_at(data, at, opening), Message):
            return at, message
        at += 8 - at % 8
    return None


def _metadata_size(data: bytes, at: int) -> int | None:
    """Length of the metadata of a message that begins at a place; None if they are not there in whole."""
    if data[at : at + 4] != _MARK:
        return None
    size = int.from_bytes(data[at + 4 : at + 8], "little")
    return size if 0 < size < LONGEST_METADATA and at + 8 + size <= len(data) else None


def _kinds(opening: Opening) -> list[type[Any]]:
    """Types of the columns."""
    return [np.int64, np.int64, np.uint8, *[np.float64] * len(opening.header.channels)]


@contextmanager
def decoding() -> Iterator[None]:
    """What Arrow says of a batch whose checksum agrees, and that no recorder has written."""
    import pyarrow as pa

    try:
        yield
    except (pa.ArrowException, OSError, ValueError, TypeError, LookupError) as error:
        raise FormatError(
            f"the checksum of a batch is right, but the batch cannot be decoded ({type(error).__name__}): "
            "allanite has not written this run"
        ) from None


def _column(batch: pa.RecordBatch, i: int, kind: type[Any]) -> NDArray[Any]:
    return np.frombuffer(batch.column(i).buffers()[1], dtype=kind, count=batch.num_rows)
