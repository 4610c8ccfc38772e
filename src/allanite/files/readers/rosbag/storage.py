# SPDX-License-Identifier: BSD-3-Clause
"""What the three containers of ROS have in common: connections, and their messages chunk by chunk."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import IO, Protocol

from allanite.errors import FormatError
from allanite.files.readers.spool import refuse_bomb
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.regular_file import open_regular

__all__ = ["Batch", "Chunked", "Connection", "Storage", "Torn", "unpacked"]

#: Messages of a chunk: key of the connection -> times of reception [ns], and the messages as they stand there.
Batch = dict[int, tuple[list[int], list[bytes]]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Connection:
    """One publisher on one topic.

    Attributes
    ----------
    key : int
        Unique in its storage.
    topic : str
    kind : str
        Type of the messages in the words of ROS 2: sensor_msgs/msg/Imu.
    encoding : str
        "cdr" (ROS 2) or "ros1".
    definition, form : str
        Text that defines the type, and its language: "msg", "idl", or "" where there is none.
    count : int
        Messages that the container lists.
    """

    key: int
    topic: str
    kind: str
    encoding: str
    definition: str
    form: str
    count: int


class Storage(Protocol):
    """A container that was opened."""

    @property
    def connections(self) -> Sequence[Connection]:
        """Who published what in it."""
        ...

    @property
    def remarks(self) -> list[str]:
        """What is to be said of the file, in words; complete when the last batch was read."""
        ...

    def batches(self, keys: Collection[int]) -> Iterator[Batch]:
        """The messages of some connections, in the order of the file, in pieces that fit into memory."""
        ...

    def close(self) -> None:
        """Let go of the file."""
        ...


class Torn(Exception):
    """The file ends in the middle of a record."""


class Chunked(ABC):
    """A container whose messages lie in chunks; none is held but the one that is read.

    Attributes
    ----------
    connections : tuple of Connection
        Who published what.
    remarks : list of str
        What is to be said of the file.
    """

    connections: tuple[Connection, ...]

    def __init__(self, path: Path) -> None:
        self.remarks: list[str] = []
        self._name = path.name
        self._file: IO[bytes] = open_regular(path)
        self._size = self._file.seek(0, 2)
        self._file.seek(0)
        self._found: dict[int, Connection] = {}
        self._counts: Counter[int] = Counter()
        self._chunks: list[tuple[int, frozenset[int]]] | None = (
            None  # place, connections in it (none: not told)
        )

    def _settle(self, *, indexed: bool) -> None:
        """The connections, with the messages of each: counted here, if no index of the file does."""
        for content in () if indexed else self._contents(None):
            for key, (received, _) in self._messages(content, None).items():
                self._counts[key] += len(received)
        self.connections = tuple(replace(c, count=self._counts[c.key]) for c in self._found.values())

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()

    def batches(self, keys: Collection[int]) -> Iterator[Batch]:
        """The messages of some connections, chunk by chunk."""
        wanted = frozenset(keys)
        for content in self._contents(wanted):
            yield self._messages(content, wanted)

    @abstractmethod
    def _contents(self, wanted: frozenset[int] | None) -> Iterator[bytes]:
        """Chunks, unpacked: those that hold what is wanted, or one after another as they stand in the file."""

    @abstractmethod
    def _messages(self, chunk: bytes, wanted: frozenset[int] | None) -> Batch:
        """Messages of the connections that are wanted; of all of them, without their bytes, where that is None."""

    def _no_chunk(self, place: int) -> FormatError:
        return FormatError(f"{self._name}: the index names a chunk at byte {place}, but there is none")

    def _remark_torn(self) -> None:
        remark = f"the file ends at byte {self._size} within a record: the rest is lost"
        if remark not in self.remarks:
            self.remarks.append(remark)


def unpacked(data: bytes, compression: str, size: int, name: str) -> bytes:
    """A chunk, unpacked; its header says to how many bytes.

    Raises
    ------
    FormatError
        Unknown compression, damage, or another size than was promised.
    LimitError
        A decompression bomb.
    """
    if compression in ("", "none"):
        content = data
    elif compression == "bz2":
        import bz2

        refuse_bomb(len(data), size, name)
        try:
            content = bz2.BZ2Decompressor().decompress(data, size + 1)
        except OSError as error:
            raise FormatError(f"{name}: a chunk is damaged ({error})") from None
    elif compression in ("lz4", "zstd"):
        import pyarrow as pa

        refuse_bomb(len(data), size, name)
        try:
            content = pa.decompress(data, size, codec=compression, asbytes=True)
        except (pa.ArrowException, OSError, ValueError) as error:
            raise FormatError(f"{name}: a chunk is damaged ({str(error)[:100]})") from None
    else:
        raise FormatError(f"{name}: chunks packed with {compression[:40]!r}, which is unknown")
    if len(content) != size:
        raise FormatError(f"{name}: a chunk of {len(content)} bytes instead of the declared {size}")
    return content
