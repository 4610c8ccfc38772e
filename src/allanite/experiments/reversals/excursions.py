# SPDX-License-Identifier: BSD-3-Clause
"""Where a signal leaves its level, and where it says nothing: excursions and dropouts, in bounded memory.

The record is read twice, block by block. The first pass cuts it into windows of 8 s and takes from each the median
and the median absolute deviation, of samples and of cells (means over 1/8 s). Medians do not see a turn, which fills
less than half a window, and a running median over five windows does not see a window that is lost altogether, while a
warm-up drifts freely through both. The second pass marks the cells that stand 8 deviations off that level, by a
sample or by their mean. Each excursion is then followed outwards on the samples themselves until a running mean over
1/4 s is back at the level, so that no sample of a turn stays in a dwell.

Nothing below ten times the Earth's rotation is called an excursion where the unit is known: there lies what is to be
measured, and the slow settling after a turn, which dead time deals with.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import BLOCK, OVERLOAD, Kind, Recording, merge_spans

__all__ = ["PAUSE", "Dropout", "Excursion", "SurveyedSignal", "survey"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Spans = NDArray[np.int64]

#: Cell, window, and the shortest pause that parts two excursions [s].
CELL, WINDOW, PAUSE = 0.125, 8.0, 0.25
#: Deviations above which a cell belongs to an excursion, and down to which the excursion is followed outwards.
HIGH, LOW = 8.0, 4.0
#: Followed down to this share of its peak at least: a scale factor error or a rebound of the hand is not chased.
OF_PEAK = 1e-3
#: Smallest excursion where the unit is known: ten times the Earth's rotation [rad/s].
FLOOR = 10 * 7.292115e-5
#: Local noise counts up to so many times the record's: beyond, it is a disturbance and not noise.
RESTLESS = 4.0
#: The noise of a window is taken from about so many of its samples.
SOME = 128
#: A bell-shaped movement of the least jerk, 16 u^2 (1 - u)^2, spends sqrt(x/2) of its time within the share x of its
#: peak; twice as much is a flat top.
BELL = 2 * math.sqrt(0.5)
#: Farthest that an excursion is followed on each side [s].
REACH = 4.0
#: Samples on each side from which the level of an excursion is taken [s].
AROUND = 4.0
#: More excursions than one in so many seconds are heavy tails, not motion: the threshold is raised.
CROWDED = 2.0
#: A value that repeats for longer is stuck [s], and more often than this by chance in one record of 10 000.
STUCK, ALARM = 1.0, 1e-4


@dataclass(frozen=True, slots=True, kw_only=True)
class Excursion:
    """A stretch in which the signal is away from its level.

    Attributes
    ----------
    start, stop : int [samples]
    area : float [rad, or unit s]
        Integral of the signal less the level around it: the angle.
    path : float [rad, or unit s]
        Integral of the absolute value: equal to abs(area) where the motion went one way.
    peak : float [rad/s, or unit]
        Largest deviation from the level.
    high, low : float [rad/s, or unit]
        Extremes of the signal itself.
    flat_high, flat_low : float [s]
        Time spent at these extremes, within the noise; 0 where a free movement would spend as much.
    missing : float [s]
        Time without samples.
    overload : bool
        Some of that time the instrument was out of range.
    """

    start: int
    stop: int
    area: float
    path: float
    peak: float
    high: float
    low: float
    flat_high: float
    flat_low: float
    missing: float
    overload: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Dropout:
    """A stretch of at least 1/4 s that says nothing and belongs to no excursion: "missing", "overload" or "stuck"."""

    start: int
    stop: int
    kind: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyedSignal:
    """All excursions and dropouts of a signal, in order of time.

    Attributes
    ----------
    channel : str
    rate : float [Hz]
    n_samples : int
    physical : bool
        The signal is an angular rate in rad/s.
    sigma : float [rad/s, or unit]
        Deviation of one sample.
    excursions : tuple of Excursion
    dropouts : tuple of Dropout
    """

    channel: str
    rate: float
    n_samples: int
    physical: bool
    sigma: float
    excursions: tuple[Excursion, ...]
    dropouts: tuple[Dropout, ...]


def survey(recording: Recording, channel: str) -> SurveyedSignal:
    """Find the excursions and dropouts of one channel.

    Raises
    ------
    DataQualityError
        Fewer than eight samples hold a value.
    """
    signal = _Signal(recording, channel)
    grid = _CellGrid.of(recording.rate)
    level = _LevelTrack.of(signal, grid)
    cores = _cores(signal, level)
    silent = merge_spans(np.concatenate([level.missing, level.stuck]))
    spans = _with_missing(_followed(signal, level, cores), level.missing, round(PAUSE * recording.rate))
    limits = np.concatenate([[0], spans.reshape(-1), [recording.n_samples]])
    excursions = tuple(
        _measure(signal, level, int(a), int(b), int(limits[2 * i]), int(limits[2 * i + 3]))
        for i, (a, b) in enumerate(spans)
    )
    return SurveyedSignal(
        channel=channel,
        rate=recording.rate,
        n_samples=recording.n_samples,
        physical=signal.physical,
        sigma=level.sigma,
        excursions=excursions,
        dropouts=tuple(_dropouts(signal, _outside(silent, spans), level.stuck)),
    )


# -- the signal as a rate ---------------------------------------------------------------------------------


class _Signal:
    """A channel as rates: scaled to rad/s where its unit is known, angles differenced."""

    def __init__(self, recording: Recording, name: str) -> None:
        channel = recording[name]
        self.recording, self.name = recording, name
        self.integrated = channel.kind.integrated
        self.physical = channel.kind in (Kind.RATE, Kind.ANGLE)
        self.factor = (channel.scale if self.physical else 1.0) * (recording.rate if self.integrated else 1.0)

    def blocks(self, size: int) -> Iterator[tuple[int, Array]]:
        last = math.nan
        for start, block in self.recording.blocks(self.name, size):
            rates = np.diff(block, prepend=last) if self.integrated else block
            last = float(block[-1]) if len(block) else last
            yield start, rates * self.factor

    def read(self, start: int, stop: int) -> Array:
        a = max(start - 1, 0) if self.integrated else start
        values = self.recording.raw(self.name, a, stop)
        values = np.where(np.abs(values) < OVERLOAD, values, np.nan)
        if self.integrated:
            values = np.diff(values, prepend=np.nan) if start == 0 else np.diff(values)
        return np.asarray(values * self.factor, dtype=np.float64)

    def overloaded(self, start: int, stop: int) -> bool:
        """Some of these samples are overload words (a NaN is not)."""
        values = self.recording.raw(self.name, start, stop)
        return bool((np.abs(values) >= OVERLOAD).any())


# -- first pass: level and noise --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _CellGrid:
    """Samples in a cell, cells in a window, samples read at once (whole windows)."""

    rate: float
    cell: int
    cells: int
    block: int

    @classmethod
    def of(cls, rate: float) -> _CellGrid:
        cell = max(1, round(CELL * rate))
        cells = max(8, round(WINDOW * rate / cell))
        return cls(rate=rate, cell=cell, cells=cells, block=max(1, BLOCK // (cell * cells)) * cell * cells)

    @property
    def window(self) -> int:
        return self.cell * self.cells

    def padded(self, block: Array) -> Array:
        """The block with NaN up to a whole window."""
        short = -len(block) % self.window
        return np.concatenate([block, np.full(short, np.nan)]) if short else block

    def means(self, block: Array) -> Array:
        """Means of the cells of a padded block; NaN where a cell holds nothing."""
        rows = block.reshape(-1, self.cell)
        mean = rows.mean(axis=1)
        holed = np.isnan(mean)
        if holed.any():
            count = self.cell - np.isnan(rows[holed]).sum(axis=1)
            mean[holed] = np.where(count > 0, np.nansum(rows[holed], axis=1) / np.maximum(count, 1), np.nan)
        return np.asarray(mean, dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True)
class _LevelTrack:
    """Level and noise along the record, one value each per window; dropouts on the way."""

    grid: _CellGrid
    centres: Array
    levels: Array
    noise: Array  # deviation of a sample
    calm: Array  # deviation of a cell
    sigma: float
    missing: Spans
    stuck: Spans

    @classmethod
    def of(cls, signal: _Signal, grid: _CellGrid) -> _LevelTrack:
        windows: list[tuple[Array, Array, Array]] = []
        missing, equal = (
            _TrueRuns(max(1, math.ceil(PAUSE * grid.rate))),
            _TrueRuns(max(7, math.floor(STUCK * grid.rate))),
        )
        last, present, repeats, step = math.nan, 0, 0, math.inf
        for start, block in signal.blocks(grid.block):
            gap = np.isnan(block)
            move = np.diff(block, prepend=last)
            last = float(block[-1])
            same = move == 0.0
            missing.feed(start, gap)
            equal.feed(start, same)
            present += len(block) - int(gap.sum())
            repeats += int(same.sum())
            if start == 0 and not same.all():
                step = _step(move)
            windows.append(_windows(grid, grid.padded(block)))
        if present < 8:
            raise DataQualityError(
                f"channel {signal.name!r} has {present} samples: too few to detect turns. Choose another channel, or "
                "look for the fault in the log"
            )
        levels, noise, calm = (np.concatenate(parts) for parts in zip(*windows, strict=True))
        stuck = _beyond_chance(equal.spans(), present, repeats)
        least = 0.5 * step if math.isfinite(step) else 0.0
        return cls._smoothed(grid, levels, noise, calm, least, missing.spans(), stuck)

    @classmethod
    def _smoothed(
        cls,
        grid: _CellGrid,
        levels: Array,
        noise: Array,
        calm: Array,
        least: float,
        missing: Spans,
        stuck: Spans,
    ) -> _LevelTrack:
        there = np.isfinite(levels)
        centres: Array = (np.flatnonzero(there) + 0.5).astype(np.float64) * grid.window
        moving = noise[there] > 0.0
        sigma, quiet = (
            max(float(np.median(x[there][moving])), least) if moving.any() else least for x in (noise, calm)
        )
        return cls(
            grid=grid,
            centres=centres,
            levels=_running_median(levels[there]),
            noise=np.clip(_running_median(noise[there]), sigma, RESTLESS * sigma),
            calm=np.clip(_running_median(calm[there]), quiet, RESTLESS * quiet),
            sigma=sigma,
            missing=missing,
            stuck=stuck,
        )

    def at(self, places: Array) -> tuple[Array, Array, Array]:
        """Level, deviation of a sample and deviation of a cell at places [samples]."""
        level, noise, calm = (
            np.interp(places, self.centres, x) for x in (self.levels, self.noise, self.calm)
        )
        return level, noise, calm


def _windows(grid: _CellGrid, block: Array) -> tuple[Array, Array, Array]:
    """Median, and deviation of samples and of cells about it, of each window of a padded block."""
    samples = block.reshape(-1, grid.window)
    cells = grid.means(block).reshape(-1, grid.cells)
    level = _median(cells)
    some = samples[:, :: max(1, grid.window // SOME)]
    noise = 1.4826 * _median(np.abs(some - level[:, None]))
    calm = 1.4826 * _median(np.abs(cells - level[:, None])) if grid.cell > 1 else noise
    return level, noise, calm


def _median(rows: Array) -> Array:
    """Medians of rows, NaN set aside. NumPy's nanmedian takes a row at a time in Python."""
    ordered = np.sort(rows, axis=1)  # NaN to the end
    count = rows.shape[1] - np.isnan(rows).sum(axis=1)
    index = np.arange(len(rows))
    return np.asarray(
        0.5
        * (
            ordered[index, np.maximum(count - 1, 0) // 2]
            + ordered[index, np.minimum(count // 2, rows.shape[1] - 1)]
        )
    )


def _running_median(values: Array) -> Array:
    """Median over five neighbours; over three and one at the ends, so that a drift is not bent there."""
    n = len(values)
    out = values.copy()
    if n >= 3:
        out[1:-1] = np.median(np.stack([values[:-2], values[1:-1], values[2:]]), axis=0)
    if n >= 5:
        out[2:-2] = np.median(np.stack([values[i : n - 4 + i] for i in range(5)]), axis=0)
    return out


def _step(moves: Array) -> float:
    """The smallest difference between samples: the step of quantised values, next to nothing for others."""
    size = np.abs(moves[np.isfinite(moves) & (moves != 0.0)])
    return float(size.min()) if len(size) else math.inf


def _beyond_chance(spans: Spans, present: int, repeats: int) -> Spans:
    """Runs of equal samples longer than those that chance makes of coarse steps."""
    if len(spans) == 0:
        return spans
    inside = int(np.diff(spans, axis=1).sum())
    share = max(repeats - inside, 0) / max(present - inside, 1)
    if share > 0.5:  # the resolution hides the noise: equal values mean nothing
        return spans[:0]
    share = min(
        1.5 * share + 1.0 / present, 0.75
    )  # a level between two steps repeats more often than on average
    longest = math.log(present / ALARM) / -math.log(share)
    return spans[spans[:, 1] - spans[:, 0] > longest]


@dataclass(slots=True)
class _TrueRuns:
    """Runs of True of at least `least` samples, gathered block by block."""

    least: int
    closed: list[Spans] = field(default_factory=list)
    open: int = -1
    end: int = 0

    def feed(self, start: int, flags: Flags) -> None:
        edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
        runs = edges.reshape(-1, 2) + start
        if self.open >= 0:
            if len(runs) and runs[0, 0] == start:
                runs[0, 0] = self.open
            else:
                runs = np.concatenate([[[self.open, start]], runs])
            self.open = -1
        self.end = start + len(flags)
        if len(runs) and runs[-1, 1] == self.end:
            self.open = int(runs[-1, 0])
            runs = runs[:-1]
        runs = runs[runs[:, 1] - runs[:, 0] >= self.least]
        if len(runs):
            self.closed.append(runs.astype(np.int64))

    def spans(self) -> Spans:
        last = (
            [np.array([[self.open, self.end]], dtype=np.int64)]
            if 0 <= self.open <= self.end - self.least
            else []
        )
        return np.concatenate([np.zeros((0, 2), dtype=np.int64), *self.closed, *last])


# -- second pass: excursions ----------------------------------------------------------------------------------


def _cores(signal: _Signal, level: _LevelTrack) -> Spans:
    """Stretches of cells that stand far off the level; noise with heavy tails raises the threshold."""
    grid = level.grid
    most = max(100.0, signal.recording.duration / CROWDED)
    pause = max(1, round(PAUSE * grid.rate))
    spans: Spans = np.zeros((0, 2), dtype=np.int64)
    for high in (HIGH, 3 * HIGH, 9 * HIGH, 27 * HIGH):
        runs = _TrueRuns(1)
        for start, block in signal.blocks(grid.block):
            runs.feed(start // grid.cell, _hot(signal, level, start, grid.padded(block), high))
        spans = runs.spans() * grid.cell
        spans = merge_spans(spans + np.array([0, pause])) - np.array([0, pause])
        if len(spans) <= most:
            break
    return np.minimum(spans, signal.recording.n_samples)


def _hot(signal: _Signal, level: _LevelTrack, start: int, block: Array, high: float) -> Flags:
    """Cells of a padded block that stand off the level by a sample or by their mean."""
    cell = level.grid.cell
    places = start + (np.arange(len(block) // cell, dtype=np.float64) + 0.5) * cell
    base, noise, calm = level.at(places)
    floor = FLOOR if signal.physical else 0.0
    rows = np.abs(block.reshape(-1, cell) - base[:, None])
    means = np.abs(level.grid.means(block) - base)
    hot = (rows > np.maximum(high * noise, floor)[:, None]).any(axis=1)
    return np.asarray(hot | (means > np.maximum(high * calm, floor)))


def _followed(signal: _Signal, level: _LevelTrack, cores: Spans) -> Spans:
    """Each core with its flanks, down to the noise."""
    n, rate = signal.recording.n_samples, level.grid.rate
    reach, width = math.ceil(REACH * rate), max(1, round(PAUSE * rate))
    out = cores.copy()
    for i, (a, b) in enumerate(cores):
        first, last = max(int(a) - reach, 0), min(int(b) + reach, n)
        values = signal.read(first, last)
        base, _, calm = level.at(np.array([0.5 * (a + b)]))
        off = np.abs(values - base[0])
        peak = float(np.nanmax(off[a - first : b - first], initial=0.0))
        smooth = np.abs(_running_mean(values - base[0], width))
        noise = float(calm[0]) * math.sqrt(min(1.0, level.grid.cell / width))
        low = max(LOW * noise, OF_PEAK * peak, FLOOR if signal.physical else 0.0)
        away = smooth > low
        out[i, 0] = first + _edge(away[: a - first + 1][::-1], a - first, width)
        out[i, 1] = last - _edge(away[b - first - 1 :], last - b, width)
    return merge_spans(out)


def _edge(away: Flags, room: int, width: int) -> int:
    """How much of the room outside a core is left when the flank is taken.

    `away` runs outwards from the last sample of the core: the signal is back where `width` running means in a row
    are at the level.
    """
    back = np.concatenate([[0], np.cumsum(~away)])
    done = (
        np.flatnonzero(back[width:] - back[:-width] == width) if len(back) > width else np.zeros(0, dtype=int)
    )
    taken = int(done[0]) + (width if int(done[0]) else 0) // 2 if len(done) else room
    return room - min(taken, room)


def _running_mean(values: Array, width: int) -> Array:
    """Mean over `width` samples about each, of those that are there; zero where none is."""
    there = ~np.isnan(values)
    kernel = np.ones(width)
    count = np.convolve(there.astype(np.float64), kernel, mode="same")
    total = np.convolve(np.where(there, values, 0.0), kernel, mode="same")
    return np.asarray(total[: len(values)] / np.maximum(count[: len(values)], 1.0))


def _with_missing(excursions: Spans, missing: Spans, pause: int) -> Spans:
    """Excursions together with the missing stretches that touch them: an overload begins and ends within a turn."""
    if len(excursions) == 0 or len(missing) == 0:
        return excursions
    before = np.searchsorted(excursions[:, 0], missing[:, 1] + pause, side="right") - 1
    near = (before >= 0) & (excursions[np.maximum(before, 0), 1] + pause >= missing[:, 0])
    return merge_spans(np.concatenate([excursions, _bridged(missing[near], excursions, pause)]))


def _bridged(missing: Spans, excursions: Spans, pause: int) -> Spans:
    """Missing stretches grown to reach the excursions beside them."""
    grown = missing.copy()
    for i, (a, b) in enumerate(missing):
        left = excursions[(excursions[:, 1] <= a) & (excursions[:, 1] + pause >= a)]
        right = excursions[(excursions[:, 0] >= b) & (excursions[:, 0] - pause <= b)]
        grown[i, 0] = left[-1, 1] if len(left) else a
        grown[i, 1] = right[0, 0] if len(right) else b
    return grown


def _measure(signal: _Signal, level: _LevelTrack, a: int, b: int, before: int, after: int) -> Excursion:
    """Angle, size and flat parts of an excursion; `before` and `after` end the neighbours."""
    rate = level.grid.rate
    around = math.ceil(AROUND * rate)
    first, last = max(before, a - around), min(after, b + around)
    values = signal.read(first, last)
    inside = values[a - first : b - first]
    ends = [x[~np.isnan(x)] for x in (values[: a - first], values[b - first :])]
    ends = [x for x in ends if len(x) >= 3]
    base = (
        float(np.mean([np.median(x) for x in ends]))
        if ends
        else float(level.at(np.array([0.5 * (a + b)]))[0][0])
    )
    there = inside[~np.isnan(inside)]
    off = there - base
    high, low = (float(there.max()), float(there.min())) if len(there) else (base, base)
    peak = float(np.abs(off).max(initial=0.0))
    near = max(LOW * level.sigma, 5e-3 * peak)
    round_top = BELL * math.sqrt(near / peak) * len(inside) / rate if peak > 0.0 else math.inf
    missing = len(inside) - len(there)
    return Excursion(
        start=a,
        stop=b,
        area=float(off.sum()) / rate,
        path=float(np.abs(off).sum()) / rate,
        peak=peak,
        high=high,
        low=low,
        flat_high=_flat(there >= high - near, rate, round_top) if high - base > 0.3 * peak else 0.0,
        flat_low=_flat(there <= low + near, rate, round_top) if base - low > 0.3 * peak else 0.0,
        missing=missing / rate,
        overload=missing > 0 and signal.overloaded(a, b),
    )


def _flat(near: Flags, rate: float, round_top: float) -> float:
    """Time near an extreme [s]; none where the rounded top of a free movement is as broad."""
    time = float(near.sum()) / rate
    return time if time > round_top else 0.0


# -- dropouts ---------------------------------------------------------------------------------------


def _outside(silent: Spans, excursions: Spans) -> Spans:
    """Dropouts that no excursion holds: a clipped turn repeats its limit, an overload has its flanks."""
    if len(excursions) == 0 or len(silent) == 0:
        return silent
    near = np.maximum(np.searchsorted(excursions[:, 0], silent[:, 0], side="right") - 1, 0)
    held = (excursions[near, 0] <= silent[:, 0]) & (silent[:, 1] <= excursions[near, 1])
    return np.asarray(silent[~held])


def _dropouts(signal: _Signal, spans: Spans, stuck: Spans) -> Iterator[Dropout]:
    for a, b in spans.tolist():
        if ((stuck[:, 0] < b) & (a < stuck[:, 1])).any():
            kind = "stuck"
        else:
            kind = "overload" if signal.overloaded(a, b) else "missing"
        yield Dropout(start=a, stop=b, kind=kind)
