# SPDX-License-Identifier: BSD-3-Clause
"""From time stamps to an even time grid: the rate of the stamps as a whole, and where samples are missing.

The rate is the slope of the stamps against the sample number, never the median difference: stamps that a
host gives in bursts have a median far from the mean. Missing samples keep their place: the stamps say how
many fit into a gap, and the samples after it are placed behind it.

Three regimes:

* *regular* stamps (most differences within a quarter of their median): each difference is judged alone;
  a late stamp is forgiven when the next ones make up for it.
* *jittered* stamps (most differences within half of their median): each stamp lies nearest to its own place, whose
  phase its neighbors tell (`jittered_stamps`).
* *irregular* stamps (bursts, a resolution coarser than the sample interval): a gap is a jump beyond
  the regular ones that the stamps around it do not make up for, measured by medians on both sides.

Nothing is repaired here. Duplicates, backward steps and the jitter are counted, and `allanite.health` judges
them; only stamps from which no grid can be built are refused.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.readers.clock_line import Marks, fit_line
from allanite.readers.filled_stamps import ArrayStamps, Filled, Stamps
from allanite.readers.jittered_stamps import (
    MARGIN,
    between,
    common_slope,
    holds,
    interval_between_pauses,
    steps_of,
)

__all__ = ["ArrayStamps", "Stamps", "Timebase", "even_grid", "fit_grid", "resolution_of"]

_Floats = NDArray[np.float64]
_Ints = NDArray[np.int64]

_LISTED_ROWS = 5
_SHORTEST, _LONGEST = 1e-9, 1e7  # a sample interval outside is no sensor's [s]
_LISTED_GAPS = 100
_CALM = 0.05  # half of the regular differences lie so close to an interval
_WALK = 64
_WANDERS = 3.0  # a walk of 64 steps goes 8 times as far as one; stamps that are only late go no farther
_FEWEST_BURSTS = 20
_MAKE_UP = 4  # a late stamp is forgiven if one of the next so many is in time again
_PAUSE = 1.5  # intervals: longer steps are pauses
_ON_GRID = 0.02  # intervals by which a pause misses the grid that ends on it, beside the jitter
_FEW_PAUSES = 8
_LOOSE = 0.2  # intervals by which a pause misses the grid that ends beside it
_ENDLESS = 1e15  # more missing samples than that are not counted
_LONG_ENOUGH = 2_000_000  # positions that any record may have
_LONGEST_GRID = 50  # positions per sample; beyond both the clock was set, or two records stand in one file


@dataclass(frozen=True, slots=True, kw_only=True)
class Timebase:
    """An even grid and where the samples lie on it.

    Attributes
    ----------
    rate : float [Hz]
    length : int
        Positions on the grid.
    source, grid : ndarray of int64, shape (n_runs + 1,), (n_runs,)
        Run r holds samples source[r]..source[r+1] and begins at position grid[r]; one run if nothing is
        missing.
    facts : dict
        What was found, for `allanite.health`.
    """

    rate: float
    length: int
    source: _Ints
    grid: _Ints
    facts: dict[str, Any]


def even_grid(n: int, rate: float, *, source: str, nominal: float | None = None) -> Timebase:
    """The grid of samples without stamps (or whose stamps are set aside): even, nothing missing."""
    facts = _facts(source=source, unit="", rate=rate, nominal=nominal, interval=1.0 / rate)
    return Timebase(
        rate=rate,
        length=n,
        source=np.array([0, n], dtype=np.int64),
        grid=np.zeros(1, dtype=np.int64),
        facts=facts,
    )


def fit_grid(
    stamps: Stamps, *, source: str, unit: str, nominal: float | None = None, resolution: float | None = None
) -> Timebase:
    """The even grid behind time stamps.

    Parameters
    ----------
    stamps : Stamps, at least 2
    source, unit : str
        Name of the time column and the unit its stamps were written in, for the facts.
    nominal : float, optional [Hz]
        Rate that the file claims elsewhere; compared, not used.
    resolution : float, optional [s]
        Step in which the stamps are written; estimated from them if absent.

    Raises
    ------
    DataQualityError
        No grid can be built: fewer than two stamps, all equal, not in order, or a jump far longer than the
        record. The first five rows are listed.
    """
    n = len(stamps)
    if n < 2:
        raise DataQualityError(
            f"time column {source!r} has {n} stamp(s): at least 2 are needed to tell the rate"
        )
    filled = Filled(stamps)
    probe = _probe(filled, source)
    if not _SHORTEST <= probe.interval <= _LONGEST:
        raise _no_grid(filled, source, f"they are {probe.interval:.3g} s apart")
    if resolution is None:
        resolution = resolution_of(probe.stamps)
    interval = probe.interval
    marks, tally = _find(filled, probe, interval)
    for _ in range(3):
        _refuse(filled, marks, tally, source, interval)
        line = fit_line(filled, marks, interval, probe.ticks)
        if marks.loose and probe.regime != "irregular":
            break  # what lies between pauses tells the interval; their lengths say nothing of it
        interval = line.interval
        if not (len(marks.missing) and marks.missing.max() > 50):  # the first interval was good enough
            break
        again, tally = _find(filled, probe, interval)
        settled = np.array_equal(again.gaps, marks.gaps) and np.array_equal(again.missing, marks.missing)
        marks = again
        if settled:
            break
    # Half the standard deviation of a least-squares slope (relative): digits beyond it say nothing.
    rate = _plain(1.0 / interval, 0.5 * tally.jitter / interval * math.sqrt(12.0 / n**3) + 1e-14)
    begins = np.concatenate(([0], marks.gaps + 1))
    grid = begins + np.concatenate(([0], np.cumsum(marks.missing)))
    facts = _facts(source=source, unit=unit, rate=rate, nominal=nominal, interval=probe.median)
    facts |= tally.facts(coarse=resolution > 1.5 * interval)
    # What is only inferred, missing samples among stamps that tell no single interval, says nothing of a change.
    counted = probe.regime != "irregular" or len(marks.missing) == 0
    facts |= {
        "rate_change_ppm": line.change_ppm if counted else None,
        "rate_change_error_ppm": line.change_error_ppm if counted else None,
        "span_s": _span(stamps),
    }
    facts |= {
        "gaps": len(marks.gaps),
        "missing": int(marks.missing.sum()),
        "gap_places": [
            [int(g - m), int(g)]
            for g, m in zip(grid[1 : _LISTED_GAPS + 1], marks.missing[:_LISTED_GAPS], strict=True)
        ],
        "resolution_s": float(resolution),
    }
    length = int(grid[-1] + n - begins[-1])
    return Timebase(rate=rate, length=length, source=np.append(begins, n), grid=grid, facts=facts)


def _span(stamps: Stamps) -> float | None:
    """From the first stamp to the last one that there is."""
    tail = stamps.read(max(len(stamps) - 4096, 0), len(stamps))
    known = tail[np.isfinite(tail)]
    return float(known[-1]) if len(known) else None


def _facts(*, source: str, unit: str, rate: float, nominal: float | None, interval: float) -> dict[str, Any]:
    return {
        "source": source,
        "unit": unit,
        "rate": rate,
        "rate_nominal": nominal,
        "median_rate": 1.0 / interval,
        "jitter_rms_s": 0.0,
        "duplicates": 0,
        "duplicate_rows": [],
        "backward": 0,
        "backward_rows": [],
        "gaps": 0,
        "missing": 0,
        "gap_places": [],
        "rate_change_ppm": None,
        "rate_change_error_ppm": None,
        "span_s": None,
        "drift_ppm": None if nominal is None else (rate / nominal - 1.0) * 1e6,
        "resolution_s": 0.0,
    }


def resolution_of(stamps: _Floats) -> float:
    """Step in which stamps were written: the largest power of ten of seconds that divides all differences.

    Parameters
    ----------
    stamps : ndarray [s]
        Seconds since the first stamp (at most a few thousand of them are looked at).

    Returns
    -------
    float [s]
        At least the spacing of the floating-point numbers used; 0.0 if the differences share no step.
    """
    part = stamps[np.isfinite(stamps)][:4096]
    if len(part) < 2:
        return 0.0
    floor = float(np.spacing(np.abs(part).max()))
    rising = np.diff(part)
    rising = rising[rising > 0]
    if len(rising) and rising.min() > 1.5 * (part[-1] - part[0]) / (len(part) - 1):
        return float(rising.min())  # coarser than the samples: the step shows itself
    for power in range(1, -10, -1):
        step = 10.0**power
        if step < 4 * floor:
            break
        multiples = (part - part[0]) / step
        nearest = np.round(multiples)
        if nearest.any() and np.abs(multiples - nearest).max() < 1e-3 + floor / step:
            return step
    return floor


# -- a first look ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Probe:
    """A first look at stretches of the stamps."""

    stamps: _Floats
    median: float  # of the differences that are not zero, unless most are not
    interval: float  # first estimate of the sample interval
    regime: Literal["regular", "jittered", "irregular"]
    threshold: float  # a longer difference may be a gap
    ticks: bool  # stamps come in bursts, or from a coarse clock: only the first of each counts for the slope
    window: int  # stamps on either side that judge it


@dataclass(frozen=True, slots=True)
class _Look:
    """Stretches of the stamps, and what lies between stamps in them."""

    stretches: list[_Floats]
    differences: _Floats
    median: float  # of the differences; of those that rise where it is not positive
    bursts: bool


def _probe(stamps: Filled, source: str) -> _Probe:
    look = _look(stamps, source)
    with np.errstate(
        over="ignore", invalid="ignore", divide="ignore"
    ):  # absurd stamps are refused further on
        found = _regular(look) or _jittered(look)
        if found is None and _wander(look.stretches, look.differences):
            raise _no_grid(stamps, source, "the times fit no even grid")
    return found or _irregular(look, _block_interval(stamps, source))


def _look(stamps: Filled, source: str) -> _Look:
    n = len(stamps)
    length = min(n, 4096)
    starts = np.unique(np.linspace(0, n - length, min(64, max(1, n // length))).astype(np.int64))
    stretches = [stamps.read(int(a), int(a) + length) for a in starts]
    differences = np.concatenate([np.diff(s) for s in stretches])
    rising = differences[differences > 0]
    if not differences.any():
        raise _no_grid(stamps, source, "all are equal")
    if len(rising) < 0.5 * np.count_nonzero(differences):
        raise _no_grid(stamps, source, "they do not rise")
    if len(rising) < 2 and n > 8:  # one step in the whole record tells no rate
        raise _no_grid(stamps, source, "all but one are equal")
    median = float(np.median(differences))
    if median <= 0:
        median = float(np.median(rising))
    return _Look(stretches, differences, median, _bursts(differences, median))


def _regular(look: _Look) -> _Probe | None:
    ratio = look.differences / look.median
    near = np.abs(ratio - 1.0) <= 0.25
    # Whole multiples are lost samples, zeros are rows written twice: both leave the others regular.
    whole = (np.abs(ratio - np.round(ratio)) <= 0.25) & ((ratio > 0.5) | (ratio == 0))
    short = (ratio > 0) & (ratio < 0.5)
    if look.bursts or near.mean() < 0.5 or whole.mean() < 0.75 or short.mean() >= 0.02:
        return None
    if np.median(np.abs(ratio - 1.0)[near]) >= _CALM:
        return None
    interval = _regular_interval(look)
    return _Probe(look.stretches[0], look.median, interval, "regular", 1.5 * interval, False, _MAKE_UP)


def _jittered(look: _Look) -> _Probe | None:
    ratio = look.differences / look.median
    if look.bursts or (np.abs(ratio - np.round(ratio).clip(1)) <= 0.5).mean() <= 0.6:
        return None
    interval = interval_between_pauses(look.stretches, look.median)
    if not (interval > 0.0 and holds(look.stretches, interval)):
        return None
    return _Probe(look.stretches[0], look.median, interval, "jittered", 1.5 * interval, False, MARGIN)


def _irregular(look: _Look, interval: float) -> _Probe:
    differences = look.differences
    longest = float(np.quantile(differences[differences > 0], 0.995))
    burst = len(differences) / max(int(np.count_nonzero(differences > 1.5 * interval)), 1)
    window = int(np.clip(10 * burst, 20, 4096))
    ticks = float((differences < 0.5 * interval).mean()) > 0.4
    threshold = max(1.5 * interval, 1.5 * longest + 0.5 * interval)
    return _Probe(look.stretches[0], look.median, interval, "irregular", threshold, ticks, window)


def _wander(stretches: list[_Floats], differences: _Floats) -> bool:
    """True if differences are as random over many samples as over one: events, not samples that were stamped late."""
    lag = min(_WALK, max(map(len, stretches)) // 8)
    if lag < 8:
        return False
    over = [s[lag:] - s[:-lag] for s in stretches if len(s) >= 8 * lag]
    one, many = _scatter(differences), _scatter(np.concatenate(over))
    return many > max(_WANDERS * one, float(np.quantile(differences, 0.995)))


def _scatter(values: _Floats) -> float:
    """Half the width that holds 80 percent."""
    low, high = np.quantile(values, [0.1, 0.9])
    return float(high - low) / 2


def _bursts(differences: _Floats, median: float) -> bool:
    """True if long differences are frequent and even, or hold most of the time: a buffer, not lost samples."""
    long = np.flatnonzero(differences > 1.5 * median)
    if len(long) < max(0.01 * len(differences), _FEWEST_BURSTS):
        return False
    apart = np.diff(long)
    typical = float(np.median(differences[long]))
    if len(long) * typical > 0.5 * differences.sum():
        # A buffer is emptied at an even rate, pauses come as they like: time for each sample from burst to burst.
        each = np.diff(np.cumsum(differences)[long]) / apart
        middle = float(np.median(each))
        return bool(np.median(np.abs(each - middle)) < 0.3 * middle)
    return typical > 2.5 * median and bool(apart.std() < 0.3 * apart.mean())


def _regular_interval(look: _Look) -> float:
    """Median slope of the stretches that hold no odd difference; else that of all that lies between odd ones."""
    parts = [between([stretch], 0.5 * look.median, 1.5 * look.median) for stretch in look.stretches]
    slopes = [common_slope(part) for part in parts if len(part) == 1 and len(part[0]) > 1]
    return float(np.median(slopes)) if slopes else common_slope([one for part in parts for one in part])


def _block_interval(stamps: Filled, source: str) -> float:
    """Median slope between stamps of like phase, some 64 of them: a gap bends only its own stretch.

    The stamp after the longest difference of a stretch is the first of a burst, or the first after a tick of a
    coarse clock: there the phase is known to a sample.
    """
    n = len(stamps)
    reach = min(n // 8 + 2, 1 << 16)
    places, times = [], []
    for start in np.unique(np.linspace(0, max(n - reach, 0), min(65, max(2, n // 16))).astype(np.int64)):
        stretch = stamps.read(int(start), int(start) + reach)
        first = int(np.argmax(np.diff(stretch))) + 1
        places.append(int(start) + first)
        times.append(float(stretch[first]))
    place, at = np.unique(places, return_index=True)
    if len(place) > 1:
        interval = float(np.median(np.diff(np.array(times)[at]) / np.diff(place)))
    else:
        interval = float(stamps.read(n - 1, n)[0]) / (n - 1)
    if not interval > 0:
        raise _no_grid(stamps, source, "they do not rise")
    return interval


def _no_grid(stamps: Filled, source: str, why: str) -> DataQualityError:
    first = ", ".join(f"row {k}: {t:.9g} s" for k, t in enumerate(stamps.read(0, _LISTED_ROWS)))
    return DataQualityError(
        f"no time grid can be built from the time column {source!r}: {why} (since the first stamp, {first}); "
        f"if the samples are evenly spaced, give their rate ({_by_count(stamps)}), which sets the stamps aside"
    )


def _by_count(stamps: Filled) -> str:
    """The option for the rate, with the samples over their span where these tell one."""
    n = len(stamps)
    last = float(stamps.read(n - 4096, n)[-1])
    rate = (n - 1) / last if last > 0 else math.inf
    if not 1.0 / _LONGEST <= rate <= 1.0 / _SHORTEST:
        return "--rate"
    return f"--rate {rate:.6g} if nothing is missing: {n} samples over {last:.6g} s"


# -- gaps and steps ----------------------------------------------------------------------------------------


class _Tally:
    """What is odd about the differences, and how far the ordinary ones scatter."""

    def __init__(self) -> None:
        self.duplicates = self.backward = 0
        self.duplicate_rows: list[int] = []
        self.backward_rows: list[int] = []
        self._squares = 0.0
        self._counted = 0

    def add(self, first: int, differences: _Floats, interval: float, left_out: NDArray[np.bool_]) -> None:
        """Take differences from interval number `first` on; gaps and wild stamps do not count as scatter."""
        if not differences.min(initial=1.0) > 0.0:
            self.duplicates += self._note(differences == 0, first, self.duplicate_rows)
            self.backward += self._note(differences < 0, first, self.backward_rows)
        e = differences - interval
        e = e[~left_out] if left_out.any() else e
        self._squares += float(e @ e)
        self._counted += len(e)

    @staticmethod
    def _note(odd: NDArray[np.bool_], first: int, rows: list[int]) -> int:
        where = np.flatnonzero(odd)
        rows.extend(int(first + k + 1) for k in where[: _LISTED_ROWS - len(rows)])
        return len(where)

    @property
    def jitter(self) -> float:
        """Rms deviation of a stamp [s], from the differences: slow drifts of the clock do not count."""
        return math.sqrt(self._squares / (2 * self._counted)) if self._counted else 0.0

    def facts(self, *, coarse: bool) -> dict[str, Any]:
        """For the notes; equal stamps are no duplicates where the clock is coarser than the samples."""
        return {
            "jitter_rms_s": self.jitter,
            "duplicates": 0 if coarse else self.duplicates,
            "duplicate_rows": [] if coarse else self.duplicate_rows,
            "backward": self.backward,
            "backward_rows": self.backward_rows,
        }


def _find(stamps: Filled, probe: _Probe, interval: float) -> tuple[Marks, _Tally]:
    """One pass over the stamps: where samples are missing, where the clock fell back, and the odd rows."""
    tally = _Tally()
    before = after = probe.window
    judge = _JUDGES[probe.regime]
    gaps: list[_Ints] = []
    steps: list[_Floats] = []
    for first, count, block in stamps.blocks(before, after):
        lead = min(before, first)
        differences = np.diff(block)
        at, step = judge(block, differences, lead, count, interval, probe)
        own = differences[lead : lead + count]
        wild = np.abs(own - interval) > 20.0 * interval + 2.0 * probe.threshold
        wild[at - lead] = True
        tally.add(first, own, interval, wild)
        gaps.append(at - lead + first)
        steps.append(step)
    at, step = np.concatenate(gaps), np.concatenate(steps)
    missing, loose = _counted(np.clip(step / interval, -_ENDLESS, _ENDLESS), probe, tally.jitter / interval)
    up, down = missing >= 1, step < -0.5 * interval
    return Marks(at[up], missing[up], at[down], step[down], loose), tally


def _judge_regular(
    block: _Floats, differences: _Floats, lead: int, count: int, interval: float, probe: _Probe
) -> tuple[_Ints, _Floats]:
    """Odd differences that the next stamps do not make up for: their places and their excess [s]."""
    odd = np.flatnonzero(np.abs(differences - interval) > 0.5 * interval)
    forgiven = np.zeros(len(differences), dtype=bool)
    for j in range(1, _MAKE_UP + 1):
        k = odd[odd + 1 + j < len(block)]
        k = k[np.abs(block[k + 1 + j] - block[k] - (1 + j) * interval) < 0.5 * interval]
        for i in range(j + 1):
            forgiven[k + i] = True
    at = odd[~forgiven[odd] & (odd >= lead) & (odd < lead + count)]
    return at, differences[at] - interval


def _judge_jittered(
    block: _Floats, differences: _Floats, lead: int, count: int, interval: float, probe: _Probe
) -> tuple[_Ints, _Floats]:
    """Steps from place to place beyond one interval: where they are and how long [s]."""
    if not np.any(np.abs(differences - interval) > 0.5 * interval):
        return np.empty(0, dtype=np.int64), np.empty(0)
    step = steps_of(block, interval)[lead : lead + count]
    at = np.flatnonzero(step)
    return at + lead, step[at] * interval


def _judge_irregular(
    block: _Floats, differences: _Floats, lead: int, count: int, interval: float, probe: _Probe
) -> tuple[_Ints, _Floats]:
    """Jumps beyond the regular ones that stay: their places and their lasting size [s]."""
    own = slice(lead, lead + count)
    odd = np.flatnonzero((differences[own] > probe.threshold) | (differences[own] < -0.5 * interval)) + lead
    at, steps = [], []
    w = probe.window
    level = block - interval * np.arange(len(block))
    i = 0
    while i < len(odd):
        j = i
        while j + 1 < len(odd) and odd[j + 1] - odd[j] <= w:  # judge a cluster of jumps as one
            j += 1
        first, last = odd[i], odd[j]
        step = float(
            np.median(level[last + 1 : last + 1 + w]) - np.median(level[max(first + 1 - w, 0) : first + 1])
        )
        largest = odd[i : j + 1][np.argmax(np.abs(differences[odd[i : j + 1]]))]
        if step > 0.5 * probe.threshold or step < -0.5 * interval - 0.25 * probe.threshold:
            at.append(int(largest))
            steps.append(step)
        i = j + 1
    return np.array(at, dtype=np.int64), np.array(steps, dtype=np.float64)


_JUDGES = {"regular": _judge_regular, "jittered": _judge_jittered, "irregular": _judge_irregular}


def _counted(step: _Floats, probe: _Probe, jitter: float) -> tuple[_Ints, bool]:
    """Missing samples of each step, given in intervals, and whether pauses end beside the grid.

    Where they do, what is rounded off is handed on to the next pause: it does not add up. Of a few pauses one is
    enough, if it is farther from the grid than the jitter (rms, in intervals) explains, or if the jitter would hide it:
    else the rounding passes for a change of the rate.
    """
    whole = np.round(step)
    off, pause = np.abs(step - whole), np.abs(step) > _PAUSE
    loose = bool(np.count_nonzero(pause & (off > _LOOSE)) > max(0.25 * len(step), 1))
    if probe.regime != "irregular":
        clear = np.count_nonzero(pause & (off > _ON_GRID + 6.0 * jitter))
        hidden = probe.regime == "jittered" and 0 < len(step) <= _FEW_PAUSES and bool(pause.any())
        loose = loose or hidden or bool(clear > 0.05 * len(step))
    if loose:
        whole = np.diff(np.round(np.cumsum(step)), prepend=0.0)
    return whole.astype(np.int64), loose


def _refuse(stamps: Filled, marks: Marks, tally: _Tally, source: str, interval: float) -> None:
    n = len(stamps)
    if tally.backward > 0.1 * n:
        raise DataQualityError(
            f"time column {source!r} runs backward at {tally.backward} of {n} rows (first: rows "
            f"{', '.join(map(str, tally.backward_rows))}): the rows are not in order of time; sort them, or give "
            "the rate (--rate), which sets the stamps aside"
        )
    if len(marks.missing) and int(marks.missing.sum()) + n > _LONGEST_GRID * n + _LONG_ENOUGH:
        longest = np.argsort(marks.missing)[::-1][:_LISTED_ROWS]
        rows = ", ".join(
            f"row {marks.gaps[k] + 1} by {(marks.missing[k] + 1) * interval:.6g} s" for k in sorted(longest)
        )
        raise DataQualityError(
            f"time column {source!r} jumps far beyond the length of the record ({rows}): the clock was set, or "
            f"several records stand in one file. Cut it there, {_cut(stamps, marks, interval)}, or give the rate "
            f"(--rate {1.0 / interval:.6g}), which sets the stamps aside"
        )


def _cut(stamps: Filled, marks: Marks, interval: float) -> str:
    """The options that take the longest part between jumps that are longer than the record."""
    n = len(stamps)
    far = marks.missing > n
    jumps = marks.gaps[far if far.any() else marks.missing == marks.missing.max()]
    back = marks.shifts[marks.offsets < -n * interval]
    edges = np.concatenate(([0], np.sort(np.concatenate((jumps, back))) + 1, [n]))
    k = int(np.argmax(np.diff(edges)))
    first, last = int(edges[k]), int(edges[k + 1]) - 1
    own, others = _stamp(stamps, first), [_stamp(stamps, int(a)) for a in np.delete(edges[:-1], k)]
    words = [f"--from {_near(stamps, first, -interval)}"] if min(others) < own else []
    words += [f"--to {_near(stamps, last, interval)}"] if max(others) > own else []
    return f"{' '.join(words)} for the longest part ({last - first + 1} of {n} rows)"


def _stamp(stamps: Filled, row: int) -> float:
    return float(stamps.read(row, row + 1)[0])


def _near(stamps: Filled, row: int, way: float) -> str:
    """A short number of seconds between a stamp and the place a few intervals before or after it."""
    stamp = _stamp(stamps, row)
    low, high = sorted((stamp + 0.01 * way, stamp + 4.0 * way))
    middle = stamp + 2.0 * way
    return next((t for d in range(1, 17) if low < float(t := f"{middle:.{d}g}") < high), repr(middle))


def _plain(value: float, tolerance: float) -> float:
    """The value with the fewest digits that differs by less than the relative tolerance."""
    for digits in range(1, 17):
        short = float(f"{value:.{digits}g}")
        if abs(short / value - 1.0) <= tolerance:
            return short
    return value
