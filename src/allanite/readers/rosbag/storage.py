# SPDX-License-Identifier: BSD-3-Clause
"""What the three containers of ROS have in common: connections, and their messages chunk by chunk."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from allanite.errors import FormatError
from allanite.readers.spool import refuse_bomb

__all__ = ["Batch", "Connection", "Storage", "unpacked"]

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
        raise FormatError(f"{name}: chunks packed with {compression[:40]!r}, which is not known")
    if len(content) != size:
        raise FormatError(f"{name}: a chunk of {len(content)} bytes, {size} were promised")
    return content
