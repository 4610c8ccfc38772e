# SPDX-License-Identifier: BSD-3-Clause
"""Binary frames: where they begin and end in a stream of bytes, whether they are whole, what they hold.

Notes
-----
1. A frame is taken when its header, its length and its checksum are right. Where they are not, the search goes on one
   byte behind the false header: a whole frame that follows a partial one is found.
2. One of 256 damaged frames passes a checksum of eight bits, and all of them pass none at all. Such a frame counts
   only when the next one begins where it ends (`confirm`); the frame right before garbage is lost by that.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.acquisition.instruments import Flag
from allanite.acquisition.instruments.serial_imu.checksums import SIZES, checksum
from allanite.acquisition.instruments.serial_imu.description import Description
from allanite.acquisition.instruments.serial_imu.layout import BinaryFrame, Status, StatusBit
from allanite.acquisition.instruments.serial_imu.tally import Tally
from allanite.files.byte_layout import TYPE_SIZES, ByteField
from allanite.recording.records import OVERLOAD

__all__ = ["FrameSplitter", "apply_bits", "flag_numbers", "with_checksum"]

Values = NDArray[np.float64]
Flags = NDArray[np.uint8]


class FrameSplitter:
    """The frames of a stream. One piece is the bytes of one frame."""

    def __init__(self, described: Description) -> None:
        frame = described.frame
        assert frame is not None  # noqa: S101 - the description was checked
        self._frame: BinaryFrame = frame
        self._buffer = bytearray()
        self._columns = [
            _FieldPlace(at, field.type, field.endian or frame.endian)
            for field, at in zip(frame.fields, frame.places, strict=True)
        ]
        self._words = [_FieldPlace(word.at, word.type, word.endian or frame.endian) for word in frame.status]
        counter = frame.counter
        self._counter = (
            None if counter is None else _FieldPlace(counter.at, counter.type, counter.endian or frame.endian)
        )
        length = frame.length
        self._length = (
            None
            if isinstance(length, int)
            else _FieldPlace(length.at, length.type, length.endian or frame.endian)
        )
        self._check = _Check(frame)
        parts = [*self._columns, *self._words, *([self._counter] if self._counter else [])]
        self._needed = max(part.stop for part in parts)
        weak = frame.checksum is None or SIZES[frame.checksum.kind] == 1
        self._confirm = weak if frame.confirm is None else frame.confirm

    # -- bytes to frames ----------------------------------------------------------------------------------

    def take(self, arrived: bytes, tally: Tally) -> list[tuple[bytes, int]]:
        """The frames that are whole now, each with all bytes skipped up to it.

        What may still become a frame is kept, and never grows beyond one frame.
        """
        buffer, header = self._buffer, self._frame.header
        buffer += arrived
        at = 0
        frames: list[tuple[bytes, int]] = []
        while True:
            start = buffer.find(header, at)
            if start < 0:
                start = max(at, len(buffer) - len(header) + 1)
                tally.skipped += start - at
                at = start
                break
            tally.skipped += start - at
            at = start
            length = self._length_at(at)
            if length is None or len(buffer) < at + length + (len(header) if self._confirm else 0):
                break
            frame = bytes(buffer[at : at + length])
            if not self._is_whole(frame, at + length, tally):
                tally.skipped += 1
                at += 1
                continue
            at += length
            if self._is_wanted(frame):
                frames.append((frame, tally.skipped))
            else:
                tally.others += 1
        del buffer[:at]
        return frames

    def cut(self, tally: Tally) -> None:
        """The stream was interrupted: what is there of a frame will not be continued."""
        tally.skipped += len(self._buffer)
        self._buffer.clear()

    @property
    def pending(self) -> int:
        """Bytes that may still become a frame."""
        return len(self._buffer)

    def _length_at(self, at: int) -> int | None:
        """Bytes of the frame that begins at `at`; 0 for one that cannot be, None where that is not known yet."""
        length = self._frame.length
        if isinstance(length, int):
            return length
        assert self._length is not None  # noqa: S101 - for the type checker
        if len(self._buffer) < at + self._length.stop:
            return None
        stated = self._length.number(self._buffer, at) + length.add
        return stated if self._length.stop < stated <= length.longest else 0

    def _is_whole(self, frame: bytes, end: int, tally: Tally) -> bool:
        if not frame:
            return False
        if not self._check.passes(frame):
            tally.failed += 1
            return False
        if self._confirm and not self._buffer.startswith(self._frame.header, end):
            tally.unconfirmed += 1
            return False
        return True

    def _is_wanted(self, frame: bytes) -> bool:
        kind = self._frame.kind
        return len(frame) >= self._needed and (kind is None or frame.startswith(kind.bytes, kind.at))

    # -- frames to samples --------------------------------------------------------------------------------

    def counter_of(self, frame: bytes) -> int:
        """What the counter of a frame says."""
        assert self._counter is not None  # noqa: S101 - for the type checker
        return self._counter.number(frame)

    def decode(self, frames: Sequence[bytes]) -> tuple[Values, Flags]:
        """Samples of some frames.

        Returns
        -------
        values : ndarray, shape (n_frames, n_channels) [unit of each field]
        flags : ndarray of uint8, shape (n_frames,)
        """
        table = np.frombuffer(b"".join(f[: self._needed] for f in frames), dtype=np.uint8)
        table = table.reshape(len(frames), self._needed)
        values = np.empty((len(frames), len(self._columns)))
        flags = np.zeros(len(frames), dtype=np.uint8)
        for i, (column, field) in enumerate(zip(self._columns, self._frame.fields, strict=True)):
            values[:, i] = _measured(column.read(table), field, flags)
        flag_numbers(values, flags)
        names = [field.name for field in self._frame.fields]
        for reader, word in zip(self._words, self._frame.status, strict=True):
            _apply(word, reader.read(table), names, values, flags)
        return values, flags


class _FieldPlace:
    """Where a number stands in a frame."""

    def __init__(self, at: int, kind: str, endian: str) -> None:
        self.start, self.stop = at, at + TYPE_SIZES[kind]
        self._letter, self._size = kind[0], TYPE_SIZES[kind]
        self._little = endian == "little"
        self._order = "little" if self._little else "big"

    def number(self, frame: bytes | bytearray, offset: int = 0) -> int:
        """Of one frame, an unsigned integer."""
        field = frame[offset + self.start : offset + self.stop]
        return int.from_bytes(field, self._order)  # type: ignore[arg-type]

    def read(self, table: NDArray[np.uint8]) -> NDArray[np.generic]:
        """Of many frames, one in each row."""
        fields = table[:, self.start : self.stop]
        if self._size != 3:
            order = "<" if self._little else ">"
            return np.asarray(np.ascontiguousarray(fields).view(f"{order}{self._letter}{self._size}")[:, 0])
        low_first = fields if self._little else fields[:, ::-1]
        wide = np.zeros((len(table), 4), dtype=np.uint8)
        wide[:, 1:] = low_first  # in the upper three bytes, so that the sign comes down with the shift
        signed = self._letter == "i"
        return np.asarray(np.right_shift(wide.view("<i4" if signed else "<u4")[:, 0], 8))


class _Check:
    """The checksum of a frame."""

    def __init__(self, frame: BinaryFrame) -> None:
        self._entry = frame.checksum
        if self._entry is None:
            return
        entry = self._entry
        self._size = SIZES[entry.kind]
        self._order = entry.endian or frame.endian
        self._compute = checksum(
            entry.kind,
            init=entry.init,
            poly=entry.poly,
            reflected=entry.reflected,
            xor_out=entry.xor_out,
            modulus=entry.modulus,
            negated=entry.negated,
        )

    def passes(self, frame: bytes) -> bool:
        """The checksum is that of the frame; a frame too short to have one fails."""
        if self._entry is None:
            return True
        at, start, stop = self._ends(len(frame))
        if at < 0 or at + self._size > len(frame) or not 0 <= start < stop <= len(frame):
            return False
        return self._compute(frame[start:stop]) == int.from_bytes(frame[at : at + self._size], self._order)

    def written(self, frame: bytes) -> bytes:
        """The frame with its checksum in place."""
        if self._entry is None:
            return frame
        at, start, stop = self._ends(len(frame))
        number = self._compute(frame[start:stop]).to_bytes(self._size, self._order)
        return frame[:at] + number + frame[at + self._size :]

    def _ends(self, length: int) -> tuple[int, int, int]:
        entry = self._entry
        assert entry is not None  # noqa: S101 - for the type checker
        at = length - self._size if entry.at is None else entry.at + (length if entry.at < 0 else 0)
        start = entry.start + (length if entry.start < 0 else 0)
        stop = at if entry.stop is None else entry.stop + (length if entry.stop < 0 else 0)
        return at, start, stop


def with_checksum(frame: BinaryFrame, body: bytes) -> bytes:
    """The bytes of a frame with the checksum that they should have."""
    return _Check(frame).written(body)


def _measured(raw: NDArray[np.generic], field: ByteField, flags: Flags) -> Values:
    """Scaled values; raw values that mean something else are NaN and flag their samples."""
    values = raw.astype(np.float64)
    values *= field.scale
    values += field.offset
    for words, flag in ((field.missing, Flag.MISSING), (field.overload, Flag.OVERLOAD)):
        for word in words:
            hit = raw == word
            values[hit] = np.nan
            flags[hit] |= flag
    return values


def flag_numbers(values: Values, flags: Flags) -> None:
    """Numbers that are none, in place: infinities and overload words are overloads, NaN without a flag is missing."""
    over = np.abs(values) >= OVERLOAD
    if over.any():
        values[over] = np.nan
        flags[over.any(axis=1)] |= Flag.OVERLOAD
    nothing = np.isnan(values).any(axis=1) & (flags & (Flag.OVERLOAD | Flag.MISSING) == 0)
    flags[nothing] |= Flag.MISSING


def _apply(word: Status, raw: NDArray[np.generic], names: list[str], values: Values, flags: Flags) -> None:
    apply_bits(word.bits, raw.astype(np.uint64), names, values, flags)


def apply_bits(
    bits: Sequence[StatusBit], words: NDArray[np.uint64], names: list[str], values: Values, flags: Flags
) -> None:
    """What the bits of a status word say, in place: overloaded and missing values become NaN."""
    for bit in bits:
        hit = (words >> np.uint64(bit.bit) & np.uint64(1)) == bit.when
        flags[hit] |= bit.mark
        if bit.mark in (Flag.OVERLOAD, Flag.MISSING):
            which = [names.index(name) for name in bit.fields] or list(range(len(names)))
            values[np.ix_(hit, which)] = np.nan
