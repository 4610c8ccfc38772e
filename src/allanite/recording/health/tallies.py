# SPDX-License-Identifier: BSD-3-Clause
"""What one pass over a channel counts: each tally takes block after block and needs little memory.

A tally holds facts only. What the facts mean is decided by the detectors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = [
    "DETAILS",
    "BlockDifferences",
    "Energies",
    "EqualRuns",
    "Extreme",
    "Extremes",
    "MissingRuns",
    "PartSums",
    "Runs",
]

Samples = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.int64]

_NONE = np.zeros(0, dtype=np.int64)


# -- runs of True -----------------------------------------------------------------------------------------


class Runs:
    """Runs of True in a stream of masks; a run may cross blocks."""

    __slots__ = ("_since",)

    def __init__(self) -> None:
        self._since: int | None = None

    def add(self, mask: Mask | None, start: int) -> tuple[Index, Index]:
        """Starts and stops of the runs that end in this block; None means all False."""
        if mask is None:
            return self.close(start)
        flips = np.flatnonzero(mask[1:] != mask[:-1]) + (start + 1)
        if mask[0] != (self._since is not None):
            flips = np.concatenate(([start], flips))
        if self._since is not None:
            flips = np.concatenate(([self._since], flips))
        self._since = int(flips[-1]) if len(flips) % 2 else None
        pairs = flips[: len(flips) // 2 * 2].reshape(-1, 2).astype(np.int64)
        return pairs[:, 0], pairs[:, 1]

    def close(self, stop: int) -> tuple[Index, Index]:
        """End a run that is still open at `stop`."""
        if self._since is None:
            return _NONE, _NONE
        since, self._since = self._since, None
        return np.array([since], dtype=np.int64), np.array([stop], dtype=np.int64)


class MissingRuns:
    """Stretches without samples: how many samples, which stretches, and the longest one unbroken by them."""

    __slots__ = ("_keep", "_kept", "_last", "_runs", "count", "longest", "n_runs")

    def __init__(self, keep: int) -> None:
        self._runs, self._kept, self._keep = Runs(), [np.zeros((0, 2), dtype=np.int64)], keep
        self._last = 0
        self.count = self.n_runs = self.longest = 0

    def add(self, mask: Mask | None, start: int) -> None:
        """Take the next mask (True: missing); None means none is."""
        self._take(*self._runs.add(mask, start))

    def close(self, stop: int) -> None:
        """The record ends at `stop`."""
        self._take(*self._runs.close(stop))
        self.longest = max(self.longest, stop - self._last)

    def _take(self, starts: Index, stops: Index) -> None:
        if len(starts) == 0:
            return
        before = np.concatenate(([self._last], stops[:-1]))
        self.longest = max(self.longest, int((starts - before).max()))
        self._last = int(stops[-1])
        self.count += int((stops - starts).sum())
        room = self._keep - min(self.n_runs, self._keep)
        self._kept.append(np.stack([starts, stops], axis=1)[:room])
        self.n_runs += len(starts)

    @property
    def spans(self) -> Index:
        """The first stretches, at most as many as were to be kept, shape (n, 2)."""
        return np.concatenate(self._kept)


# -- means ------------------------------------------------------------------------------------------------


class PartSums:
    """Sums of sixteen equal parts of a stream: its mean, and how far the parts' means lie from one another."""

    __slots__ = ("_at", "_edges", "count", "total")

    PARTS = 16

    def __init__(self, n_samples: int) -> None:
        self._edges = [-(-k * n_samples // self.PARTS) for k in range(self.PARTS + 1)]
        self._at = 0
        #: Sum and number of the samples that are no NaN, part by part.
        self.total, self.count = np.zeros(self.PARTS), np.zeros(self.PARTS, dtype=np.int64)

    def add(self, block: Samples, complete: bool) -> None:
        """Take the next block; `complete` promises that it holds no NaN."""
        start, self._at = self._at, self._at + len(block)
        for k in range(self.PARTS):
            part = block[max(self._edges[k] - start, 0) : max(self._edges[k + 1] - start, 0)]
            there = part if complete else part[~np.isnan(part)]
            self.total[k] += float(there.sum())
            self.count[k] += len(there)

    def means(self) -> Samples:
        """Mean of each part; NaN where less than half of it is there."""
        enough = 2 * self.count >= np.maximum(np.diff(self._edges), 1)
        mean = np.full(self.PARTS, np.nan)
        mean[enough] = self.total[enough] / self.count[enough]
        return mean


# -- extreme values ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Extreme:
    """The outermost levels of one side, outermost first.

    Attributes
    ----------
    values : ndarray, shape (k,), k <= 8
        The outermost value of each level.
    spread : ndarray, shape (k,)
        How far apart the values are that were taken for one: 0.0 where they are equal.
    samples, runs : ndarray of int, shape (k,)
        How many samples stand at this level, and in how many runs of equal samples they come.
    tolerance : float
        Values no further apart than this are one level.
    """

    values: Samples
    spread: Samples
    samples: Index
    runs: Index
    tolerance: float


class Extremes:
    """The eight outermost levels of a stream on one side (+1: largest, -1: smallest).

    Arithmetic on counts leaves several roundings of one count, so values closer than eight roundings, or than a
    millionth of the noise from sample to sample, are one level.
    """

    __slots__ = ("_inner", "_runs", "_samples", "_side", "_tolerance", "_values")

    KEPT = 8

    def __init__(self, side: int) -> None:
        self._side = float(side)
        self._values = self._inner = np.zeros(0)  # ends of each level, times the side: descending
        self._samples = self._runs = _NONE
        self._tolerance = 0.0

    def add(self, block: Samples, fresh: Mask) -> None:
        """Take the next block; `fresh` marks samples that differ from the one before."""
        if self._tolerance == 0.0:
            self._tolerance = _tolerance_of(block[:4096])
        if len(self._values) < self.KEPT:  # a first bar, so that few samples pass it
            self._merge(block[:4096], fresh[:4096])
            block, fresh = block[4096:], fresh[4096:]
        bar = self._inner[-1] - self._tolerance if len(self._values) == self.KEPT else -np.inf
        hits = np.flatnonzero(block >= bar if self._side > 0 else block <= -bar)
        if len(hits):
            self._merge(block[hits], fresh[hits])

    def _merge(self, block: Samples, fresh: Mask) -> None:
        block = block * self._side
        if len(block) > 4096:  # coarse samples: mostly levels that are known already, and few of them
            block, fresh = self._count_known(block, fresh)
        ok = ~np.isnan(block)
        block = block[ok]
        if len(block) == 0:
            return
        values = np.concatenate([self._values, block])
        order = np.argsort(-values)
        values = values[order]
        starts = np.flatnonzero(np.concatenate(([True], values[:-1] - values[1:] > self._tolerance)))
        samples = np.concatenate([self._samples, np.ones(len(block), dtype=np.int64)])[order]
        runs = np.concatenate([self._runs, fresh[ok].astype(np.int64)])[order]
        kept = slice(self.KEPT)
        self._inner = np.minimum.reduceat(np.concatenate([self._inner, block])[order], starts)[kept]
        self._values = values[starts][kept]
        self._samples = np.add.reduceat(samples, starts)[kept]
        self._runs = np.add.reduceat(runs, starts)[kept]

    def _count_known(self, block: Samples, fresh: Mask) -> tuple[Samples, Mask]:
        """Count the samples of the levels already known; what is left of the block."""
        left = np.ones(len(block), dtype=np.bool_)
        for i, (outer, inner) in enumerate(zip(self._values, self._inner, strict=True)):
            same = block == outer if outer == inner else (block <= outer) & (block >= inner)
            self._samples[i] += np.count_nonzero(same)
            self._runs[i] += np.count_nonzero(same & fresh)
            left ^= same
        return (block[left], fresh[left]) if left.any() else (block[:0], fresh[:0])

    def result(self) -> Extreme:
        """What was counted."""
        return Extreme(
            values=self._values * self._side,
            spread=self._values - self._inner,
            samples=self._samples,
            runs=self._runs,
            tolerance=self._tolerance,
        )


def _tolerance_of(values: Samples) -> float:
    """Distance below which values are roundings of one; 0.0 where no noise is seen."""
    steps = np.abs(np.diff(values))
    steps = steps[~np.isnan(steps)]
    if len(steps) == 0:
        return 0.0
    noise = float(np.quantile(steps, 0.9)) / 2.3  # white noise; a stray sample does not move a quantile
    rounding = 8.0 * float(np.spacing(np.nanquantile(np.abs(values), 0.9)))
    return min(max(rounding, 1e-6 * noise), 1e-3 * noise)  # noise of few roundings is noise all the same


# -- equal neighbours -------------------------------------------------------------------------------------


class EqualRuns:
    """Runs of equal consecutive samples: a histogram of their lengths, and the long ones by place."""

    __slots__ = ("_kept", "_runs", "histogram", "shortest")

    LONGEST = 1024  # lengths from here on share one bin
    KEEP = 20_000

    def __init__(self) -> None:
        self._runs = Runs()
        self._kept = [np.zeros((0, 2), dtype=np.int64)]
        #: Runs of length L in bin L, L >= 2.
        self.histogram = np.zeros(self.LONGEST + 1, dtype=np.int64)
        #: Runs of at least this length are all kept.
        self.shortest = 4

    def add(self, equal: Mask, start: int) -> None:
        """Take the next mask (True: equal to the sample before)."""
        self._take(*self._runs.add(equal if equal.any() else None, start))

    def close(self, stop: int) -> None:
        """The record ends at `stop`."""
        self._take(*self._runs.close(stop))

    def _take(self, starts: Index, stops: Index) -> None:
        if len(starts) == 0:
            return
        starts = starts - 1  # the sample that the others equal
        length = stops - starts
        self.histogram += np.bincount(np.minimum(length, self.LONGEST), minlength=self.LONGEST + 1)
        long = length >= self.shortest
        self._kept.append(np.stack([starts[long], stops[long]], axis=1))
        while sum(map(len, self._kept)) > self.KEEP:
            self.shortest *= 2
            every = np.concatenate(self._kept)
            self._kept = [every[every[:, 1] - every[:, 0] >= self.shortest]]

    @property
    def spans(self) -> Index:
        """Runs of at least `shortest` samples, shape (n, 2)."""
        return np.concatenate(self._kept)


# -- energy of differences, scale by scale ----------------------------------------------------------------

#: Differences per window at the least.
DETAILS = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockDifferences:
    """Mean square difference of adjacent block means, window by window.

    Attributes
    ----------
    lag : int
        Samples per block mean.
    window : int
        Samples per window.
    energy : ndarray, shape (n_windows,)
        Mean of the squared differences in each window; NaN where too little is present. Half of its mean is the
        (non-overlapping) Allan variance at this lag.
    """

    lag: int
    window: int
    energy: Samples

    @property
    def details(self) -> int:
        """Differences per window: degrees of freedom of each energy."""
        return self.window // (2 * self.lag)


class Energies:
    """Energy of differences at lags 1, 4, 16, ... in windows: where a record is livelier than elsewhere.

    White noise, flicker and a random walk of the rate all have stationary differences, so drift alone does not
    make a window stand out; a disturbance, a turn or a change of amplitude does.
    """

    __slots__ = ("_energy", "_lags", "_means", "_top", "_windows")

    #: Windows per scale at the most, and at the least.
    MOST, LEAST = 65_536, 16
    #: Lags above this are made from stored means.
    IN_BLOCK = 1024

    def __init__(self, n_samples: int, block: int) -> None:
        largest = n_samples // (2 * DETAILS * self.LEAST)
        self._lags = [4**j for j in range(32) if 4**j <= largest]
        coarse = 1 << max(0, (n_samples // self.MOST - 1).bit_length()) if n_samples > self.MOST else 1
        self._windows = {
            m: min(max(2 * DETAILS * m, coarse), block) for m in self._lags if m <= self.IN_BLOCK
        }
        self._energy: dict[int, list[Samples]] = {m: [] for m in self._windows}
        self._top = max(self._windows, default=0)
        self._means: list[Samples] = []

    def add(self, block: Samples, complete: bool) -> None:
        """Take the next block; `complete` promises that it holds no NaN."""
        means, present = block, None if complete else (~np.isnan(block)).astype(np.float64)
        if present is not None:
            means = np.where(present > 0, block, 0.0)
        lag = 1
        while lag <= self._top:
            shown = means if present is None else np.where(present >= 0.9 * lag, means, np.nan)
            self._energy[lag].append(_energy(shown, self._windows[lag] // (2 * lag)))
            if lag == self._top:
                self._means.append(shown)
            means, present = _mean_of_four(means, present)
            lag *= 4

    def result(self) -> tuple[BlockDifferences, ...]:
        """The scales, smallest lag first."""
        scales = [
            BlockDifferences(lag=m, window=self._windows[m], energy=_joined(self._energy[m]))
            for m in self._windows
        ]
        means, lag = _joined(self._means), self._top
        while lag and lag * 4 in self._lags:
            lag *= 4
            rows = means[: len(means) // 4 * 4].reshape(-1, 4)
            enough = (~np.isnan(rows)).sum(axis=1) >= 3
            means = np.full(len(rows), np.nan)
            means[enough] = np.nanmean(rows[enough], axis=1)
            scales.append(BlockDifferences(lag=lag, window=2 * DETAILS * lag, energy=_energy(means, DETAILS)))
        return tuple(scales)


def _mean_of_four(means: Samples, present: Samples | None) -> tuple[Samples, Samples | None]:
    n = len(means) // 4 * 4
    if present is None:
        return 0.25 * ((means[0:n:4] + means[1:n:4]) + (means[2:n:4] + means[3:n:4])), None
    total = (means * present)[:n].reshape(-1, 4).sum(axis=1)
    count = present[:n].reshape(-1, 4).sum(axis=1)
    return np.divide(total, count, out=np.zeros(len(total)), where=count > 0), count


def _energy(means: Samples, details: int) -> Samples:
    n = len(means) // (2 * details) * 2 * details
    rows = (means[1:n:2] - means[0:n:2]).reshape(-1, details)
    energy: Samples = np.einsum("ij,ij->i", rows, rows) / details
    torn = np.isnan(energy)
    if torn.any():
        rows = rows[torn]
        there = ~np.isnan(rows)
        count = there.sum(axis=1)
        total = np.where(there, rows * rows, 0.0).sum(axis=1)
        energy[torn] = np.where(2 * count >= details, total / np.maximum(count, 1), np.nan)
    return energy


def _joined(parts: list[Samples]) -> Samples:
    return np.concatenate(parts) if parts else np.zeros(0)
