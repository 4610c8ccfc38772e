# SPDX-License-Identifier: BSD-3-Clause
"""Stamps written in steps that are not short against the sample interval, with pauses between them.

Such a stamp bounds the time of its sample on both sides: the stamps of a run without a pause, less the interval times
their number, lie within one step of each other. Where they do not, a pause is between them; the bounds of all samples
of a run tell its place far better than a step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.filled_stamps import Filled
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.sums import sum_of_products

__all__ = ["CoarseStamps", "coarse_interval", "pauses_between", "shared_step", "without_place"]

_Floats = NDArray[np.float64]
_Ints = NDArray[np.int64]

#: Stamps finer than this share of the interval are not coarse.
_COARSE = 0.3
#: A run may be wider than one step by so many intervals: the interval is not exactly known.
_SLACK = 0.3
#: Samples on either side that tell the place of one, and steps of the stamp that they cover.
_SAMPLES, _STEPS = 256, 16
#: Share of the differences over a lag that no pause has made longer, at least.
_CLEAN = 0.5
_ROUNDS = 8
#: Samples of a run that are looked at one by one, and windows that are looked at together, at the most.
_FEW, _AHEAD = 32, 256
_BURST = 16
_HALVINGS = 11
#: Share of the samples that may come before their place.
_EARLY = 0.001
#: Differences that are equal but for the numbers in which they are held, relative to the step.
_NOISE = 2e-3
_ENDLESS = 1e12
_LONGEST = 1e9  # a step of stamps [s]
#: Steps that are told from a step of the stamp, for each one that is not.
_EVEN = 4
#: Share of the samples whose difference is not the usual one, below which rows may have been written twice, or lost.
_FEWEST = 0.015
#: Share of their distance by which steps that an interval leaves out may be apart unevenly, beside one sample.
_UNEVEN = 0.1
#: Distances between them without which chance makes them even.
_ENOUGH = 8


@dataclass(frozen=True, slots=True)
class CoarseStamps:
    """Samples finer than their stamps, or nearly so.

    Attributes
    ----------
    interval, step : float [s]
        From sample to sample; from stamp to stamp.
    """

    interval: float
    step: float

    @property
    def window(self) -> int:
        """Samples on either side that tell the place of one."""
        return max(_SAMPLES, int(_STEPS * self.step / self.interval))


def shared_step(stretches: list[_Floats]) -> float | None:
    """The step of which all differences are multiples [s]; None if there is none."""
    rising = np.concatenate([np.diff(stretch) for stretch in stretches])
    rising = np.unique(rising[rising > 0])
    if not (len(rising) and rising[-1] < _ENDLESS * rising[0]):
        return None
    apart = np.diff(rising)
    apart = apart[apart > _NOISE * rising[0]]
    step = float(min(rising[0], apart.min(initial=np.inf)))
    for most in (4, 64, 1024):  # noise of the floating-point numbers grows with the multiple
        some = rising[rising < (most + 0.5) * step]
        if len(some):
            step = float(some.sum() / np.round(some / step).sum())
    multiples = rising[rising < 1024 * step] / step
    if not step < _LONGEST:
        return None
    return step if np.abs(multiples - np.round(multiples)).max(initial=0.0) < 10 * _NOISE else None


def coarse_interval(stretches: list[_Floats], step: float) -> CoarseStamps | None:
    """The sample interval behind coarse stamps; None if no interval explains them.

    Over any number of samples two stamps of a run differ by one of two multiples of the step; pauses only add to it.
    """
    interval = _by_lags(stretches, step)
    if interval is None or not _COARSE * interval < step or _in_bursts(stretches, interval, step):
        return None
    pauses = [np.flatnonzero(np.diff(s) > 1.5 * max(step, interval)) + 1 for s in stretches]
    guesses = (_slope(stretches, pauses, interval), _longest(stretches, CoarseStamps(interval, step)))
    settled = [_settled(stretches, CoarseStamps(guess, step)) for guess in guesses if guess is not None]
    best = min(settled, key=lambda each: each[1])[0]
    return best if _explains(stretches, best) else None


def _settled(stretches: list[_Floats], coarse: CoarseStamps) -> tuple[CoarseStamps, float]:
    """Least squares over the runs, as long as these grow no shorter; and how many pauses there are then."""
    best, fewest = coarse, np.inf
    for _ in range(_ROUNDS):
        runs = [_BoundedRuns.of(stretch, coarse) for stretch in stretches]
        pauses = sum(len(run.starts) for run in runs)
        if pauses > fewest:
            break
        best, fewest = coarse, pauses
        finer = _slope(stretches, [run.starts[1:] for run in runs], coarse.interval)
        if finer is None or abs(finer / coarse.interval - 1.0) < 1e-12:
            break
        coarse = CoarseStamps(finer, coarse.step)
    return best, fewest


def _explains(stretches: list[_Floats], coarse: CoarseStamps) -> bool:
    """True if the step explains far more differences that are not the usual one than pauses must: it is no chance."""
    usual = 0.5 + np.median(np.round(np.concatenate([np.diff(s) for s in stretches]) / coarse.step))
    explained = pauses = backward = size = 0
    apart: list[_Ints] = []  # samples from one step that is left out to the next, in a run
    for stretch in stretches:
        runs = _BoundedRuns.of(stretch, coarse)
        odd = np.abs(np.diff(stretch) / coarse.step - usual + 0.5) > 0.5
        odd[runs.starts[1:] - 1] = False
        ends = np.append(runs.starts, len(stretch))
        apart += [np.diff(np.flatnonzero(odd[a : b - 1])) for a, b in zip(ends[:-1], ends[1:], strict=True)]
        explained += int(np.count_nonzero(odd))
        pauses += int(np.count_nonzero(runs.steps < 3.0 * max(coarse.interval, coarse.step)))
        backward += int(np.count_nonzero(runs.steps < 0.0))
        size += len(stretch)
    if usual < 1.0:  # a tick holds samples: its stamps rise but once
        return explained > pauses and backward <= _EARLY * size
    if 1.0 < usual < 2.0 and coarse.interval > coarse.step and not _evenly(np.concatenate(apart)):
        return False  # single samples were lost, and the step is the interval
    rare = coarse.interval < coarse.step and explained < _FEWEST * size
    return explained >= _EVEN * (pauses + 1) and backward <= _EARLY * size and not rare


def _evenly(apart: _Ints) -> bool:
    """True if steps are left out evenly, as an interval that is longer than a step does; losses come as they like."""
    return len(apart) >= _ENOUGH and bool(np.ptp(apart) <= 1 + _UNEVEN * apart.mean())


def _longest(stretches: list[_Floats], coarse: CoarseStamps) -> float:
    """The longest interval, up to the one given, at which hardly a sample comes too early.

    Pauses only make samples late.
    """
    low, high = 0.7 * coarse.interval, coarse.interval
    allowed = _EARLY * sum(map(len, stretches))
    trial = high
    for _ in range(_HALVINGS):
        tried = CoarseStamps(trial, coarse.step)
        early = sum(int(np.count_nonzero(_BoundedRuns.of(s, tried).steps < 0)) for s in stretches)
        low, high = (trial, high) if early <= allowed else (low, trial)
        if low == coarse.interval:
            break
        trial = (low + high) / 2
    return low


def _by_lags(stretches: list[_Floats], step: float) -> float | None:
    """The interval by the mean difference over 1, 2, 4... samples, as long as most of these hold no pause."""
    interval, lag = None, 1
    while True:
        apart = [s[lag:] - s[:-lag] for s in stretches if len(s) > 2 * lag]
        differences = np.concatenate(apart) if apart else np.empty(0)
        clean = differences < differences.min(initial=np.inf) + 1.5 * step
        if not len(clean) or clean.mean() < _CLEAN:
            return interval
        mean = float(differences[clean].mean()) / lag
        interval = mean if mean > 0 else interval
        lag *= 2


def _in_bursts(stretches: list[_Floats], interval: float, step: float) -> bool:
    """True if hardly a stretch of a few samples is as short as the interval says."""
    apart = [s[_BURST:] - s[:-_BURST] for s in stretches if len(s) > _BURST]
    return bool(apart) and bool(
        np.quantile(np.concatenate(apart), 0.2) > _BURST * 1.5 * interval + 1.5 * step
    )


def _slope(stretches: list[_Floats], starts: list[_Ints], guess: float) -> float | None:
    """Least squares over the samples that a step of the stamp lets know to one interval, each run by itself."""
    rise = square = 0.0
    for stretch, inner in zip(stretches, starts, strict=True):
        rising = np.diff(stretch) > 0
        rising[inner - 1] = False  # the first of a run tells nothing of its interval
        at, first = np.flatnonzero(rising) + 1, np.append(0, inner)
        count = np.diff(np.searchsorted(at, np.append(first, len(stretch))))
        at, first, count = at[np.repeat(count >= 3, count)], first[count >= 3], count[count >= 3]
        k = at - np.repeat(first, count)
        x = k - np.repeat(np.add.reduceat(k, np.cumsum(count) - count) / count, count) if len(k) else k
        rise += sum_of_products(x, stretch[at] - np.repeat(stretch[first], count) - guess * k)
        square += sum_of_products(x, x)
    return guess + rise / square if square > 0 and guess + rise / square > 0 else None


@dataclass(frozen=True, slots=True)
class _BoundedRuns:
    """Samples between pauses: where each run begins, and between what bounds its place lies."""

    starts: _Ints
    low: _Floats  # of the place of its first samples, less interval times number [s]
    high: _Floats
    low_end: _Floats  # of its last ones
    high_end: _Floats
    astray: int  # samples in runs without a place
    doubtful: _Ints  # of each pause, samples that may as well lie on its other side
    skips: NDArray[np.bool_]  # pauses at which the stamps leave out a step
    coarse: CoarseStamps

    @property
    def unplaced(self) -> int:
        """Samples whose place is open: a pause shorter than a step may be two, in it and in the one beside."""
        placed = self.skips & (self.steps > self.coarse.step)
        beside = np.where(self.skips, 0, round(self.coarse.step / self.coarse.interval))
        return self.astray + int(np.maximum(self.doubtful, beside)[~placed].sum())

    @property
    def steps(self) -> _Floats:
        """How much longer each pause is than an interval [s]."""
        return (self.low + self.high)[1:] / 2 - (self.low_end + self.high_end)[:-1] / 2

    @classmethod
    def of(cls, stamps: _Floats, coarse: CoarseStamps) -> _BoundedRuns:
        level = stamps - coarse.interval * np.arange(len(stamps))
        starts, doubtful = _RunSearch(
            level=level,
            stamps=stamps,
            window=coarse.window,
            width=coarse.step + _SLACK * coarse.interval,
        ).run()
        ends = np.append(starts[1:], len(level))
        high, top = _extremes(level, starts, np.minimum(starts + coarse.window, ends))
        high_end, top_end = _extremes(level, np.maximum(ends - coarse.window, starts), ends)
        low, low_end = top - coarse.step, top_end - coarse.step
        astray = np.minimum(high - low, high_end - low_end) > 2.0 * coarse.interval
        return cls(
            starts=starts,
            low=low,
            high=high,
            low_end=low_end,
            high_end=high_end,
            astray=int((ends - starts)[astray].sum()),
            doubtful=doubtful,
            skips=np.diff(stamps)[starts[1:] - 1] > 1.5 * coarse.step,
            coarse=coarse,
        )


def _extremes(level: _Floats, first: _Ints, last: _Ints) -> tuple[_Floats, _Floats]:
    """Smallest and largest value of each span; none is empty."""
    edges = np.stack([first, last], axis=1).ravel()
    padded = np.append(level, level[-1])  # an edge may be the end
    return np.minimum.reduceat(padded, edges)[::2], np.maximum.reduceat(padded, edges)[::2]


@dataclass(frozen=True, slots=True, kw_only=True)
class _RunSearch:
    """Stamps, and these less interval times number, cut into runs; those of a few samples are looked at one by one."""

    level: _Floats
    stamps: _Floats
    window: int
    width: float

    def run(self) -> tuple[_Ints, _Ints]:
        """Where each run begins, and for each pause how many samples may as well lie on its other side."""
        starts, doubtful, size = [0], [], len(self.level)
        while (last := self._end(starts[-1], size)) < size:
            last, others = self._split(starts[-1], last)
            starts.append(last)
            doubtful.append(others)
        return np.array(starts, dtype=np.int64), np.array(doubtful, dtype=np.int64)

    def _end(self, first: int, stop: int) -> int:
        """The first sample before `stop` that no place of those before it in the window allows; else `stop`."""
        stop, window, width = min(stop, len(self.level)), self.window, self.width
        few = self.level[first : min(first + _FEW, stop)].tolist()
        low = high = few[0]
        for k, value in enumerate(few, first):
            if value > high:
                high = value
            elif value < low:
                low = value
            else:
                continue
            if high - low >= width:
                return k
        level, at, ahead = self.level[:stop], first, 1
        while at < stop:
            part = level[max(at - window, first) : at + window]
            range_ = np.maximum.accumulate(part) - np.minimum.accumulate(part)
            wide = int(np.searchsorted(range_, width))
            if wide < len(part):
                return max(at - window, first) + wide
            at += window * (1 + _narrow(level[at : at + window * (ahead + 1)], window, width))
            ahead = min(2 * ahead, _AHEAD)
        return stop

    def _split(self, first: int, last: int) -> tuple[int, int]:
        """Where the pause is that must be before `last`, and among how many samples.

        It is the longest difference at which both sides fit.
        """
        head = self.level[last : self._end(last, last + self.window)].tolist()
        low, high, back = min(head), max(head), last
        for value in reversed(self.level[max(last - self.window, first + 1) : last].tolist()):
            low, high = value if value < low else low, value if value > high else high
            if high - low >= self.width:
                break
            back -= 1
        apart = np.diff(self.stamps[back - 1 : last + 1])[::-1]
        return last - int(np.argmax(apart)), last - back


def _narrow(level: _Floats, window: int, width: float) -> int:
    """How many whole windows after the first are, with the one before each, not wider than they may be."""
    blocks = level[: len(level) // window * window].reshape(-1, window)
    high, low = blocks.max(axis=1), blocks.min(axis=1)
    wide = np.maximum(high[1:], high[:-1]) - np.minimum(low[1:], low[:-1]) >= width
    return int(np.argmax(wide)) if wide.any() else len(wide)


def pauses_between(stamps: _Floats, coarse: CoarseStamps) -> tuple[_Ints, _Floats]:
    """Differences that hold a pause: which, and how much longer than an interval [s]."""
    runs = _BoundedRuns.of(stamps, coarse)
    return runs.starts[1:] - 1, runs.steps


def without_place(stamps: Filled, coarse: CoarseStamps) -> int:
    """Samples whose place such stamps do not tell to an interval: of a pause within a step, or of a run within one."""
    return sum(_BoundedRuns.of(block, coarse).unplaced for _, _, block in stamps.blocks(0, 0))
