# SPDX-License-Identifier: BSD-3-Clause
"""Bytes in, samples out: no port, no clock, no thread.

What comes out does not depend on how the stream was cut into pieces. Garbage is passed over and counted, a jump of the
counter is a jump of the sample's number, and a frame that came twice is given once.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from allanite.acquisition.instruments import Flag
from allanite.acquisition.instruments.serial_imu.description import Description
from allanite.acquisition.instruments.serial_imu.frames import FrameSplitter
from allanite.acquisition.instruments.serial_imu.lines import LineSplitter, ParsedLine
from allanite.acquisition.instruments.serial_imu.sequence import PlacedFrame, Sequence
from allanite.acquisition.instruments.serial_imu.tally import Tally
from allanite.lazy_dataclasses import dataclass

__all__ = ["Framer", "Jump", "Samples"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Jump:
    """A sample before which the counter did not go on by one.

    Attributes
    ----------
    index : int
        Position among the samples that came with it.
    turned : int
        What the counter went forward, in samples less whole turns.
    far : bool
        A clock may tell better than the counter by how much.
    """

    index: int
    turned: int
    far: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Samples:
    """What some bytes held.

    Attributes
    ----------
    values : ndarray, shape (n_samples, n_channels) [unit of each channel]
    flags : ndarray of uint8, shape (n_samples,)
        Bits of `allanite.acquisition.instruments.Flag`.
    counter : ndarray of int64, shape (n_samples,), or None
        Number of the sample since the first one; None where the device has no counter.
    jumps : tuple of Jump
        Where the counter did not go on by one.
    """

    values: NDArray[np.float64]
    flags: NDArray[np.uint8]
    counter: NDArray[np.int64] | None
    jumps: tuple[Jump, ...] = ()

    def __len__(self) -> int:
        return len(self.values)


class _Splitter(Protocol):
    @property
    def pending(self) -> int: ...
    def take(self, arrived: bytes, tally: Tally) -> list[tuple[Any, int]]: ...
    def cut(self, tally: Tally) -> None: ...
    def counter_of(self, piece: Any) -> int: ...
    def decode(self, pieces: Any) -> tuple[NDArray[np.float64], NDArray[np.uint8]]: ...


class Framer:
    """The samples in a stream of bytes.

    Parameters
    ----------
    described : Description
        Description of the device.

    Examples
    --------
    >>> from allanite.acquisition.instruments.serial_imu import Description, Framer
    >>> imu = Description.of({
    ...     "model": "X1", "rate": 100,
    ...     "lines": {"begins": "$G", "columns": [{"name": "gyro_z", "column": 1, "unit": "deg/s"}]},
    ... })
    >>> framer = Framer(imu)
    >>> framer.feed(b"?#$G,0.25\\n$G,0.").values.tolist(), framer.feed(b"50\\n").values.tolist()
    ([[0.25]], [[0.5]])
    """

    def __init__(self, described: Description) -> None:
        self._splitter: _Splitter = (
            FrameSplitter(described) if described.frame is not None else LineSplitter(described)
        )
        counter = described.counter
        # old frames are those of a buffer, which keeps two seconds at most; a slow device is not made to wait longer
        most_old = max(4, round(2 * described.rate))
        self._sequence = None if counter is None else Sequence[Any](counter.turns_at, counter.step, most_old)
        self._drop_equal = described.identical == "drop"
        self._before: object = None
        self._skipped = 0
        self._n_channels = len(described.measured)
        ends = [entry.limits or (-np.inf, np.inf) for entry in described.measured]
        self._least, self._most = np.array(ends, dtype=np.float64).T
        self._tally = Tally()
        self._interrupted = False

    @property
    def tally(self) -> Tally:
        """Dropped bytes by reason, as a copy."""
        return self._tally.copy()

    @property
    def pending(self) -> int:
        """Bytes that may still become a sample."""
        return self._splitter.pending

    @property
    def held(self) -> int:
        """Whole frames whose counter jumped back, and which wait for what follows."""
        return 0 if self._sequence is None else self._sequence.held

    def cut(self) -> None:
        """The stream was interrupted: the half of a frame that is there is dropped, the next sample flagged RESYNC."""
        self._splitter.cut(self._tally)
        if self._sequence is not None:
            self._sequence.cut()
        self._interrupted = self._tally.frames > 0

    def feed(self, arrived: bytes) -> Samples:
        """The samples that are whole now."""
        tally = self._tally
        placed: list[PlacedFrame[Any]] = []
        for piece, skipped in self._splitter.take(arrived, tally):
            placed += self._place(piece, skipped)
        if not placed:
            return Samples(
                values=np.empty((0, self._n_channels)),
                flags=np.empty(0, dtype=np.uint8),
                counter=None if self._sequence is None else np.empty(0, dtype=np.int64),
            )
        values, flags = self._splitter.decode([p.piece for p in placed])
        self._leave_out_impossible(values, flags)
        jumped = [i for i, p in enumerate(placed) if p.jumped]
        flags[jumped] |= Flag.RESYNC
        return Samples(
            values=values,
            flags=flags,
            counter=None if self._sequence is None else np.array([p.number for p in placed], dtype=np.int64),
            jumps=tuple(Jump(index=i, turned=placed[i].turned, far=placed[i].far) for i in jumped),
        )

    def _leave_out_impossible(self, values: NDArray[np.float64], flags: NDArray[np.uint8]) -> None:
        """In place: no sensor gave a value beyond its limits, in whatever way it was written."""
        beyond = (values < self._least) | (values > self._most)
        if beyond.any():
            values[beyond] = np.nan
            rows = beyond.any(axis=1)
            flags[rows] |= Flag.MISSING
            self._tally.impossible += int(rows.sum())

    def _place(self, piece: Any, skipped: int) -> list[PlacedFrame[Any]]:
        """The sample or samples that this frame brings, in their order."""
        if self._sequence is not None:
            placed = self._sequence.admit(self._splitter.counter_of(piece), piece, self._tally)
        else:
            placed = self._next(piece, skipped)
        if placed and self._interrupted:
            placed[0] = replace(placed[0], jumped=True)
            self._interrupted = False
        self._tally.frames += len(placed)
        return placed

    def _next(self, piece: Any, skipped: int) -> list[PlacedFrame[Any]]:
        """Without a counter: what was skipped before a frame is all that tells of a gap."""
        content = piece.text if isinstance(piece, ParsedLine) else piece
        if self._drop_equal and content == self._before:
            self._tally.doubled += 1
            return []
        broken = skipped != self._skipped and self._tally.frames > 0
        self._before, self._skipped = content, skipped
        return [PlacedFrame(piece=piece, number=0, jumped=broken)]
