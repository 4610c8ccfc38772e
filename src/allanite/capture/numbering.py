# SPDX-License-Identifier: BSD-3-Clause
"""Every sample gets its number: where samples are missing the numbers jump, and the reason is kept.

An instrument with a counter tells what is missing. One without is trusted to be even, and after an interruption the
clock of the host says how many samples did not come.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from allanite.instruments import Block, Flag

__all__ = ["Gap", "Numbered", "Numbering"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """Samples that did not come.

    Attributes
    ----------
    counter : int
        Number of the first of them.
    samples : int
    reason : str
    """

    counter: int
    samples: int
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Numbered:
    """Samples with their numbers and times.

    Attributes
    ----------
    counter, monotonic_ns : ndarray of int64, shape (n,)
    values : ndarray of float64, shape (n, n_channels)
    flags : ndarray of uint8, shape (n,)
    gaps : tuple of Gap
        Before and between them.
    """

    counter: NDArray[np.int64]
    monotonic_ns: NDArray[np.int64]
    values: NDArray[np.float64]
    flags: NDArray[np.uint8]
    gaps: tuple[Gap, ...]

    def __len__(self) -> int:
        return len(self.counter)


@dataclass(slots=True)
class Numbering:
    """Numbers the samples of one run, block by block.

    Attributes
    ----------
    rate : float [Hz]
    """

    rate: float
    _next: int = 0
    _last_ns: int | None = None
    _offset: int | None = None  # from the counter of the instrument to that of the run
    _interrupted: str = ""
    _reasons: list[str] = field(default_factory=list)

    def interrupt(self, reason: str) -> None:
        """What comes next does not follow on what came last: the instrument was silent, or was started again."""
        self._interrupted = self._interrupted or reason
        self._offset = None

    def take(self, block: Block, now: int) -> Numbered:
        """Numbers and times of the samples of a block whose last one came `now` [ns]."""
        n = len(block)
        number = self._numbers(block, now)
        gaps = self._gaps(number, block)
        flags = block.flags.copy()
        if n and self._interrupted:
            flags[0] |= Flag.RESYNC
        ago = np.rint((number[-1] - number) * (1e9 / self.rate)).astype(np.int64) if n else number
        if n:
            self._next, self._last_ns, self._interrupted = int(number[-1]) + 1, now, ""
        return Numbered(
            counter=number, monotonic_ns=now - ago, values=block.values, flags=flags, gaps=tuple(gaps)
        )

    def _numbers(self, block: Block, now: int) -> NDArray[np.int64]:
        n = len(block)
        if not n:
            return np.zeros(0, dtype=np.int64)
        if block.counter is not None:
            if self._offset is None:
                first = max(self._by_clock(now) - int(block.counter[-1] - block.counter[0]), self._next)
                self._offset = first - int(block.counter[0])
            return np.asarray(block.counter + self._offset, dtype=np.int64)
        number = self._next + np.arange(n, dtype=np.int64)
        paused = np.flatnonzero(block.flags & Flag.RESYNC)
        at = 0 if self._interrupted else int(paused[0]) if len(paused) else n
        if at < n:  # what follows an interruption ends at the sample that came just now
            late = self._by_clock(now) - int(number[-1])
            number[at:] += max(late, 0)
        return number

    def _by_clock(self, now: int) -> int:
        """Number of a sample that comes now, by the clock of the host."""
        if self._last_ns is None:
            return self._next
        return self._next - 1 + round((now - self._last_ns) * self.rate / 1e9)

    def _gaps(self, number: NDArray[np.int64], block: Block) -> list[Gap]:
        if not len(number):
            return []
        before = np.concatenate([[self._next - 1], number[:-1]])
        found = []
        for i in np.flatnonzero(number - before > 1):
            missing = int(number[i] - before[i] - 1)
            why = self._interrupted if i == 0 and self._interrupted else "; ".join(block.remarks)
            found.append(
                Gap(counter=int(before[i]) + 1, samples=missing, reason=why or "missing in the counter")
            )
        return found
