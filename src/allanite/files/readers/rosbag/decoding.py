# SPDX-License-Identifier: BSD-3-Clause
"""From serialised messages to numbers: many at once where they all look alike, else one by one.

Messages of equal length are taken apart at fixed offsets from their end. The first and the last hundred of each lot
are compared, to the bit, with the full decoder, which also takes whatever is not laid out so: nested messages, other
byte orders, lengths that vary.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.files.readers.rosbag.storage import Connection
from allanite.files.readers.rosbag.types import ImuPlace, MessageLayout
from allanite.lazy_dataclasses import dataclass
from allanite.recording.channel_names import for_shell

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

__all__ = ["Decoder"]

_CHECKED = 100
_STAMP = 4  # bytes in front of the stamp: seq (ROS 1), or the encapsulation (ROS 2)
_ZSTD = b"\x28\xb5\x2f\xfd"  # a message that was packed by itself: no encapsulation begins so
_LARGEST = 64 << 20

_Rows = tuple[NDArray[np.int64], NDArray[np.float64]]


@dataclass(slots=True)
class Decoder:
    """Decodes the messages of one connection.

    Attributes
    ----------
    absent : tuple of bool
        Fields that the first message marks as not measured (first covariance -1).
    fast : int
        Messages that were taken apart at once.
    """

    connection: Connection
    store: Typestore
    layout: MessageLayout
    place: ImuPlace
    absent: tuple[bool, ...] = ()
    fast: int = 0
    _looked: bool = field(default=False)

    def decode(self, messages: Sequence[bytes], received: Sequence[int]) -> tuple[_Rows, NDArray[np.int64]]:
        """Header stamps [ns], numbers, and times of reception [ns]; a message may hold several samples.

        Raises
        ------
        InputError
            A list in a message holds several instruments, not several samples of one.
        """
        if messages and messages[0][:4] == _ZSTD:
            messages = [_unpacked(m) for m in messages]
        if not self._looked:
            self._look(messages[0])
        times = np.array(received, dtype=np.int64)
        if self.place.path or not self._alike(messages):
            rows, counts = self._one_by_one(messages)
            return rows, np.repeat(times, counts)
        fast = self._at_offsets(messages)
        for part in (slice(0, _CHECKED), slice(-_CHECKED, None)):
            (stamps, numbers), _ = self._one_by_one(messages[part])
            if not np.array_equal(stamps, fast[0][part]) or not np.array_equal(
                numbers, fast[1][part], equal_nan=True
            ):
                return self._one_by_one(messages)[0], times
        self.fast += len(messages)
        return fast, times

    # -- at once -----------------------------------------------------------------------------------------

    def _alike(self, messages: Sequence[bytes]) -> bool:
        length = len(messages[0])
        if length < self.layout.shortest or any(len(m) != length for m in messages):
            return False
        # ROS 1 is always little-endian; the encapsulation of ROS 2 says so (CDR, 00 01).
        return self.connection.encoding == "ros1" or all(m.startswith(b"\x00\x01") for m in messages)

    def _at_offsets(self, messages: Sequence[bytes]) -> _Rows:
        length = len(messages[0])
        table = np.frombuffer(b"".join(messages), dtype=np.uint8).reshape(-1, length)
        stamps = np.ascontiguousarray(table[:, _STAMP : _STAMP + 8]).view("<u4").astype(np.int64)
        width = 24 if self.layout.vector else 8
        numbers = [
            np.ascontiguousarray(table[:, length - end : length - end + width]).view("<f8")
            for _, end in self.layout.fields
        ]
        return stamps[:, 0] * 10**9 + stamps[:, 1], np.concatenate(numbers, axis=1).astype(np.float64)

    # -- one by one --------------------------------------------------------------------------------------

    def _message(self, raw: bytes) -> Any:
        if self.connection.encoding == "ros1":
            return self.store.deserialize_ros1(raw, self.connection.kind)
        return self.store.deserialize_cdr(raw, self.connection.kind)

    def _one_by_one(self, messages: Sequence[bytes]) -> tuple[_Rows, NDArray[np.int64]]:
        stamps: list[int] = []
        numbers: list[tuple[float, ...]] = []
        counts: list[int] = []
        for raw in messages:
            before = len(stamps)
            for message, header in _found(self._message(raw), self.place.path, None):
                stamp = getattr(header, "stamp", None)
                stamps.append(0 if stamp is None else stamp.sec * 10**9 + stamp.nanosec)
                numbers.append(self._numbers(message))
            if len(stamps) - before > 1 and len(set(stamps[before:])) == 1 and stamps[before]:
                one = f"{self.connection.topic}.{self.place.at(0)}"
                raise InputError(
                    f"topic {self.connection.topic}: {self.place} holds {len(stamps) - before} samples "
                    f"with the same time: several instruments? Choose one: --topic {for_shell(one)} "
                    "(topic= in Python)"
                )
            counts.append(len(stamps) - before)
        table = np.array(numbers, dtype=np.float64).reshape(len(numbers), len(self.layout.names))
        return (np.array(stamps, dtype=np.int64), table), np.array(counts, dtype=np.int64)

    def _numbers(self, message: Any) -> tuple[float, ...]:
        if not self.layout.vector:
            return tuple(float(getattr(message, name)) for name, _ in self.layout.fields)
        vectors = [getattr(message, name) for name, _ in self.layout.fields]
        return tuple(value for v in vectors for value in (v.x, v.y, v.z))

    def _look(self, raw: bytes) -> None:
        """Which fields the first message marks as not measured."""
        self._looked = True
        for message, _ in _found(self._message(raw), self.place.path, None):
            marks = [getattr(message, f"{name}_covariance", None) for name, _ in self.layout.fields]
            self.absent = tuple(m is not None and len(m) > 0 and m[0] == -1 for m in marks)
            return


def _found(message: Any, path: Sequence[tuple[str, int | None]], header: Any) -> Iterator[tuple[Any, Any]]:
    """The messages at a place in another one, each with the innermost header on the way."""
    header = getattr(message, "header", None) or header
    if not path:
        yield message, header
        return
    (name, position), *rest = path
    inner = getattr(message, name)
    if position is None:
        yield from _found(inner, rest, header)
    elif position < 0:
        for one in inner:
            yield from _found(one, rest, header)
    elif position < len(inner):
        yield from _found(inner[position], rest, header)


def _unpacked(message: bytes) -> bytes:
    import pyarrow as pa

    with pa.CompressedInputStream(pa.BufferReader(message), "zstd") as stream:
        return bytes(stream.read(_LARGEST))
