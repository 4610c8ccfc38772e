# SPDX-License-Identifier: BSD-3-Clause
"""The tally of impulses: single samples, or short bursts, far from a record that is quiet around them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import normal_quantile

__all__ = ["Impulses", "Spikes"]

Samples = NDArray[np.float64]
Index = NDArray[np.int64]

_NONE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Impulses:
    """Samples far from those around them.

    Attributes
    ----------
    position : ndarray of int64, shape (n,)
    deviation : ndarray, shape (n,)
        Distance from the local median, in the channel's unit.
    sigma : ndarray, shape (n,)
        Spread of such distances in the block.
    crowded : int
        Samples, missing ones aside, in blocks with too many candidates to call them impulses.
    """

    position: Index
    deviation: Samples
    sigma: Samples
    crowded: int


class Spikes:
    """Samples far from the median of the 49 around them, alone or in bursts of at most 256.

    Candidates are next to a step of more than 3.5 robust standard deviations of the steps. The decision compares
    the distance from the local median with the spread of such distances in the block. A burst must have a step of
    4.5 deviations in it, and the record beside it must be no livelier than the block: a walk, a level shift or a
    moved sensor makes no impulses.
    """

    __slots__ = ("_crowded", "_deviation", "_factor", "_integrated", "_position", "_sigma")

    REACH = 24
    STEPS, SHARP = 3.5, 4.5
    #: More candidates than this share of a block, or a quarter of it of spikes: no impulses but another
    #: distribution.
    CROWD = 0.02
    #: Samples from the first to the last of a burst, and between bursts.
    BURST, APART = 256, 50
    #: Ratio to the block's spread beyond which the record beside a burst is not quiet.
    LIVELY = 1.5
    #: False alarms per record of Gaussian noise.
    ALARM = 1e-3
    #: The spread is itself estimated, to some 3 %: the Gaussian bound is raised by this.
    MARGIN = 1.1

    def __init__(self, n_samples: int, integrated: bool) -> None:
        self._integrated = integrated
        self._factor = self.factor(n_samples)
        self._position: list[Index] = []
        self._deviation: list[Samples] = []
        self._sigma: list[Samples] = []
        self._crowded = 0

    @classmethod
    def factor(cls, n_samples: int) -> float:
        """Distance in standard deviations beyond which a sample of a record of this length is an impulse."""
        return cls.MARGIN * normal_quantile(1.0 - cls.ALARM / (2.0 * max(n_samples, 2)))

    def add(self, block: Samples, step: Samples, start: int) -> Index:
        """Take the next block (NaN: missing) and its first differences; positions of spikes within the block."""
        size = self._sizes(block, step)
        hits = np.flatnonzero(size > self.STEPS)
        if len(hits) > self.CROWD * len(block) + 8:
            self._crowded += int(np.count_nonzero(~np.isnan(block)))
            return _NONE
        spots = np.unique(np.concatenate([hits - 1, hits]))
        spots = spots[spots >= 0]
        if len(spots) == 0:
            return _NONE
        everywhere = np.linspace(0, len(block) - 1, min(1024, len(block)), dtype=np.int64)
        sigma = _trimmed_sd(self._deviations(block, everywhere))
        far = self._far(block, spots, sigma)
        if len(far):
            spots = np.unique(far[:, None] + np.arange(-12, 13))
            far = self._far(block, spots[(spots >= 0) & (spots < len(block))], sigma)
        if len(far) > 0.25 * self.CROWD * len(block) + 8:
            self._crowded += int(np.count_nonzero(~np.isnan(block)))
            return _NONE
        far = self._isolated(block, far, sigma, size)
        if len(far):
            self._position.append(far + start)
            self._deviation.append(self._deviations(block, far))
            self._sigma.append(np.full(len(far), sigma))
        return far

    def _sizes(self, block: Samples, step: Samples) -> Samples:
        """Steps in robust standard deviations, without sign; empty where they tell nothing."""
        if len(block) < 2 * self.REACH + 1:
            return np.zeros(0)
        part = step[:: max(1, len(step) // 8192)]
        part = part[~np.isnan(part)]
        centre = float(np.median(part)) if len(part) else 0.0
        sd = _trimmed_sd(part - centre)
        if not sd > 0.0:
            return np.zeros(0)
        size = np.subtract(step, centre)
        np.abs(size, out=size)
        return np.divide(size, sd, out=size)

    def _far(self, block: Samples, spots: Index, sigma: float) -> Index:
        return spots[np.abs(self._deviations(block, spots)) > self._factor * sigma]

    def _isolated(self, block: Samples, far: Index, sigma: float, size: Samples) -> Index:
        """Those in short, sharp bursts whose neighbourhood is quiet."""
        bursts = np.split(far, np.flatnonzero(np.diff(far) > self.APART) + 1) if len(far) else []
        short = [b for b in bursts if b[-1] - b[0] < self.BURST]
        sharp = [b for b in short if np.nanmax(size[b[0] : b[-1] + 2]) > self.SHARP]
        kept = [b for b in sharp if self._is_quiet_beside(block, b, sigma)]
        return np.concatenate(kept) if kept else _NONE

    def _is_quiet_beside(self, block: Samples, burst: Index, sigma: float) -> bool:
        first, last = int(burst[0]), int(burst[-1])
        beside = np.concatenate([np.arange(first - 300, first - 30, 4), np.arange(last + 30, last + 300, 4)])
        beside = beside[(beside >= 0) & (beside < len(block))]
        return len(beside) < 20 or _trimmed_sd(self._deviations(block, beside), 0.8) <= self.LIVELY * sigma

    def _deviations(self, block: Samples, spots: Index) -> Samples:
        """Distance of each spot from the median of its window; NaN where a sample is missing."""
        reach = self.REACH
        centre = np.clip(spots, reach, len(block) - reach - 1)
        window = block[centre[:, None] + np.arange(-reach, reach + 1)]
        here: Samples = block[spots]
        if self._integrated:  # take the slope out: an angle is not level
            third = (2 * reach + 1) // 3
            slope = (_median(window[:, -third:]) - _median(window[:, :third])) / (2 * reach + 1 - third)
            window = window - slope[:, None] * np.arange(-reach, reach + 1)
            here = here - slope * (spots - centre)
        return here - _median(window)

    def result(self) -> Impulses:
        """What was found."""
        joined = (np.concatenate(part) if part else np.zeros(0) for part in (self._deviation, self._sigma))
        deviation, sigma = joined
        position = np.concatenate(self._position) if self._position else _NONE
        return Impulses(position=position, deviation=deviation, sigma=sigma, crowded=self._crowded)


def _trimmed_sd(deviation: Samples, share: float = 0.95) -> float:
    """Standard deviation from the smallest deviations; right for a Gaussian, deaf to outliers beyond the share.

    E[x^2; |x| < z]/share = 1 - 2 z phi(z)/share. Coarse samples may leave nothing but zeros; then all count.
    """
    size = np.sort(np.abs(deviation[~np.isnan(deviation)]))
    if len(size) == 0:
        return 0.0
    kept = size[: max(1, int(share * len(size)))]
    z = normal_quantile(0.5 * (1.0 + share))
    density = math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
    variance = float(np.mean(kept * kept)) / (1.0 - 2.0 * z * density / share)
    return math.sqrt(variance if variance > 0.0 else float(np.mean(size * size)))


def _median(rows: Samples) -> Samples:
    """Median of each row without its NaN; NaN where nothing is left."""
    ordered = np.sort(rows, axis=1)  # NaN go last
    count = rows.shape[1] - np.isnan(ordered).sum(axis=1)
    row = np.arange(len(rows))
    median: Samples = 0.5 * (ordered[row, np.maximum(count - 1, 0) // 2] + ordered[row, count // 2])
    return median
