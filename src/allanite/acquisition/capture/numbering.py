# SPDX-License-Identifier: BSD-3-Clause
"""Every sample gets its number: where samples are missing the numbers jump, and the reason is kept.

An instrument with a counter tells what is missing, also after an interruption as long as its counter goes on. One
without is trusted to be even; after an interruption, and where a counter begins anew, the clock of the host says how
many samples did not come, at the rate that the samples before it had.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.acquisition.capture.arrivals import Arrivals
from allanite.acquisition.capture.rate_watch import RateWatch
from allanite.acquisition.instruments import Block, Flag
from allanite.lazy_dataclasses import dataclass

__all__ = ["BlockNumbering", "Gap", "Numbered"]

#: Remarks that are named as the reason of a gap; how many there were more is said.
_NAMED = 3
_UNEXPLAINED = "the sample number jumped, for no reason that the instrument reported"


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """Samples that did not come.

    Attributes
    ----------
    counter : int
        Number of the first of them.
    samples : int
    reason : str
    dropped : int
        Of the samples, those that came and for which the host was too slow.
    uncertainty : float or None
        Standard uncertainty of `samples` where a clock has told it; None where they were counted.
    """

    counter: int
    samples: int
    reason: str
    dropped: int = 0
    uncertainty: float | None = None


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


class BlockNumbering:
    """Numbers the samples of one run, block by block.

    Parameters
    ----------
    rate : float [Hz]
        Nominal.
    """

    def __init__(self, rate: float) -> None:
        self._arrivals = Arrivals(rate)
        self._stated = RateWatch(rate)
        self._next = 0
        self._last_ns: int | None = None
        self._offset: int | None = None  # from the counter of the instrument to that of the run
        self._interrupted = ""
        self._reasons: list[str] = []  # of blocks that brought remarks and no sample
        self._recent: list[str] = []  # of the last block with samples, if no gap has used them

    @property
    def rate(self) -> float:
        """Nominal samples per second."""
        return self._arrivals.rate

    @property
    def contradicted(self) -> float | None:
        """Samples per second by the clock of the host, where these contradict the stated rate [Hz]."""
        return self._stated.contradicted

    def change(self, rate: float) -> None:
        """What comes next comes at another rate."""
        if rate != self.rate:
            self._stated = RateWatch(rate)
        self._arrivals.change(rate)

    def interrupt(self, reason: str) -> None:
        """What comes next need not follow on what came last: the instrument was silent, or was started again."""
        self._interrupted = self._interrupted or reason
        self._restart()

    def take(self, block: Block, now: int) -> Numbered:
        """Numbers and times of the samples of a block whose last one came `now` [ns]."""
        n = len(block)
        number, anew, unsure = self._numbers(block, now)
        gaps = self._gaps(number, block, unsure)
        flags = block.flags.copy()
        if n and (self._interrupted or anew):
            flags[0] |= Flag.RESYNC
        ago = np.rint((number[-1] - number) * (1e9 / self.rate)).astype(np.int64) if n else number
        if n:
            self._next, self._last_ns, self._interrupted = int(number[-1]) + 1, now, ""
            self._reasons.clear()
            self._recent = [] if gaps else list(block.remarks)
            if gaps:
                self._restart()
            self._arrivals.take(int(number[-1]), now)
            self._stated.take(int(number[-1]), now)
        else:
            self._reasons += block.remarks
        return Numbered(
            counter=number, monotonic_ns=now - ago, values=block.values, flags=flags, gaps=tuple(gaps)
        )

    def tail(self, now: int) -> Gap | None:
        """What is missing by the clock where the run ends `now` [ns] in an interruption."""
        if not self._interrupted or self._last_ns is None:
            return None
        passed, unsure = self._passed(now)
        if passed < 1:
            return None
        return Gap(counter=self._next, samples=passed, reason=self._interrupted, uncertainty=unsure)

    def _restart(self) -> None:
        """What comes next is measured by itself."""
        self._arrivals.interrupt()
        self._stated.interrupt()

    def _numbers(self, block: Block, now: int) -> tuple[NDArray[np.int64], bool, float | None]:
        """Whether the counter of the instrument began anew, and how sure a jump is that the clock has told."""
        n = len(block)
        if not n:
            return np.zeros(0, dtype=np.int64), False, None
        if block.counter is not None:
            return self._by_counter(block, block.counter, now)
        number = self._next + np.arange(n, dtype=np.int64)
        paused = np.flatnonzero(block.flags & Flag.RESYNC)
        at = 0 if self._interrupted else int(paused[0]) if len(paused) else n
        if at == n:
            return number, False, None
        passed, unsure = self._passed(now)
        number[at:] += max(
            passed - n, 0
        )  # what follows an interruption ends at the sample that came just now
        return number, False, unsure

    def _by_counter(
        self, block: Block, counter: NDArray[np.int64], now: int
    ) -> tuple[NDArray[np.int64], bool, float | None]:
        first, unsure = int(counter[0]), block.gap_uncertainty
        if self._offset is None:
            self._offset = self._next - first
        anew = first + self._offset < self._next
        if anew:
            passed, unsure = self._passed(now)
            last = self._next - 1 + passed
            self._offset = max(last - int(counter[-1] - first), self._next) - first
        return np.asarray(counter + self._offset, dtype=np.int64), anew, unsure

    def _passed(self, now: int) -> tuple[int, float]:
        """Samples since the last one by the clock of the host, and the standard uncertainty of that number."""
        if self._last_ns is None:
            return 0, 0.0
        samples, unsure = self._arrivals.passed(now - self._last_ns)
        return round(samples), unsure

    def _gaps(self, number: NDArray[np.int64], block: Block, unsure: float | None) -> list[Gap]:
        if not len(number):
            return []
        before = np.concatenate([[self._next - 1], number[:-1]])
        jumps = np.flatnonzero(number - before > 1)
        gaps = []
        for i in jumps:
            missing = int(number[i] - before[i] - 1)
            reasons = [*self._reasons, *block.remarks] if i == 0 else list(block.remarks)
            # A damaged sample at the end of a block leaves its gap before the next one.
            why = (
                (i == 0 and self._interrupted) or _joined(reasons) or _joined(self._recent if i == 0 else [])
            )
            gaps.append(
                Gap(
                    counter=int(before[i]) + 1,
                    samples=missing,
                    reason=why or _UNEXPLAINED,
                    uncertainty=unsure if i == jumps[-1] else None,
                )
            )
        return gaps


def _joined(remarks: list[str]) -> str:
    more = len(remarks) - _NAMED
    return "; ".join(remarks[:_NAMED]) + (f"; and {more} more" if more > 0 else "")
