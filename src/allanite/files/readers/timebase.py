# SPDX-License-Identifier: BSD-3-Clause
"""From time stamps to an even time grid: the rate of the stamps as a whole, and where samples are missing.

The rate is the slope of the stamps against the sample number, never the median difference: stamps that a
host gives in bursts have a median far from the mean. Missing samples keep their place: the stamps say how
many fit into a gap, and the samples after it are placed behind it.

How each difference is judged depends on the regime of the stamps: regular, jittered, late, coarse or irregular
(`stamp_regimes`).

Nothing is repaired here. Duplicates, backward steps and the jitter are counted, and `allanite.recording.health` judges
them; only stamps from which no grid can be built are refused.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.files.readers.clock_line import ClockLine, Marks, fit_line
from allanite.files.readers.coarse_stamps import without_place
from allanite.files.readers.filled_stamps import CACHED, ArrayStamps, Filled, Stamps
from allanite.files.readers.grid_check import in_stalls, off_grid_share
from allanite.files.readers.late_stamps import InTime
from allanite.files.readers.rate_change import two_rates
from allanite.files.readers.set_back import between, longest_alone
from allanite.files.readers.stamp_regimes import JUDGES, LONGEST, SHORTEST, Probe, no_grid, probe_of
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.sums import sum_of_products

__all__ = ["ArrayStamps", "Stamps", "Timebase", "even_grid", "fit_grid", "resolution_of"]

_Floats = NDArray[np.float64]
_Ints = NDArray[np.int64]

_LISTED_ROWS = 5
_LISTED_GAPS = 100
_PAUSE = 1.5  # intervals: longer steps are pauses
_ON_GRID = 0.02  # intervals by which a pause misses the grid that ends on it, beside the jitter
_FEW_PAUSES = 8
_FEW_SHIFTS, _MANY_GAPS = 8, 0.1  # times that a clock may be set back, share of the samples before gaps
_HEAD = 16  # samples behind a pause whose stamps say together where it ends
_LOOSE = 0.2  # intervals by which a pause misses the grid that ends beside it
_UNPLACED = 0.3  # share of the samples without a place of their own beyond which there is no grid
_OFF_GRID = 0.05  # share of the samples that lie off the grid beyond which the stamps contradict it
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
        What was found, for `allanite.recording.health`.
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
        raise DataQualityError(f"time column {source!r} has {n} stamp(s): at least 2 are needed for the rate")
    filled = Filled(stamps)
    probe = probe_of(filled, source, exact=resolution == 0.0)
    if not SHORTEST <= probe.interval <= LONGEST:
        raise no_grid(filled, source, f"they are {probe.interval:.3g} s apart")
    if probe.coarse is not None:
        resolution = probe.coarse.step
    elif resolution is None:
        resolution = resolution_of(probe.stamps)
    interval = probe.interval
    marks, tally = _find(filled, probe, interval)
    placed = filled if probe.late is None else InTime(filled, interval, probe.late)
    for _ in range(3):
        _refuse(filled, marks, tally, source, interval)
        line = fit_line(placed, marks, interval, probe.ticks)
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
    if change := line.kink or (two_rates(filled) if _as_of_two_rates(marks, probe, n) else None):
        raise no_grid(filled, source, change=change)
    if probe.late is not None:
        _refuse_off_grid(filled, marks, source, interval)
    # Half the standard deviation of a least-squares slope (relative): digits beyond it say nothing.
    rate = _plain(1.0 / interval, 0.5 * tally.jitter / interval * math.sqrt(12.0 / n**3) + 1e-14)
    begins = np.concatenate(([0], marks.gaps + 1))
    grid = begins + np.concatenate(([0], np.cumsum(marks.missing)))
    facts = _facts(source=source, unit=unit, rate=rate, nominal=nominal, interval=probe.median)
    facts |= tally.facts(coarse=probe.coarse is not None or resolution > 1.5 * interval)
    # What is only inferred, missing samples among stamps that tell no single interval, says nothing of a change.
    counted = probe.regime in ("regular", "jittered") or len(marks.missing) == 0
    facts |= {
        "rate_change_ppm": line.change_ppm if counted else None,
        "rate_change_error_ppm": line.change_error_ppm if counted else None,
        "wander_s": line.wander if counted and not probe.ticks else 0.0,
        "off_grid": _off_grid(filled, probe, marks, tally, line, interval),
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
        "unplaced": _unplaced(filled, probe, marks, source, interval),
        "set_back": len(marks.shifts),
        "alone": longest_alone(filled, marks, interval) if tally.backward else None,
    }
    if len(marks.shifts):
        facts["restarts"] = _restarts(filled, marks, begins, grid)
    length = int(grid[-1] + n - begins[-1])
    return Timebase(rate=rate, length=length, source=np.append(begins, n), grid=grid, facts=facts)


def _as_of_two_rates(marks: Marks, probe: Probe, n: int) -> bool:
    """Do the marks look like those of a rate that changes? Their places then hide that it does.

    One that rises looks like a clock that falls back by half an interval, again and again; one that falls, like pauses
    that end beside the grid, again and again.
    """
    off_grid = marks.loose and probe.regime in ("regular", "jittered")
    return len(marks.shifts) > _FEW_SHIFTS or (off_grid and len(marks.gaps) > _MANY_GAPS * n)


def _restarts(stamps: Filled, marks: Marks, begins: _Ints, grid: _Ints) -> list[list[float]]:
    """Where on the grid the clock goes on from an earlier time, and that time [s since the first stamp]."""
    rows = marks.shifts[:_LISTED_GAPS] + 1
    runs = np.searchsorted(begins, rows, side="right") - 1
    return [
        [int(grid[run] + row - begins[run]), _stamp(stamps, int(row))]
        for run, row in zip(runs, rows.tolist(), strict=True)
    ]


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
        "wander_s": 0.0,
        "off_grid": 0.0,
        "span_s": None,
        "drift_ppm": None if nominal is None else (rate / nominal - 1.0) * 1e6,
        "resolution_s": 0.0,
        "unplaced": 0,
        "set_back": 0,
        "alone": None,
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
        with np.errstate(over="ignore"):  # absurd stamps are refused further on
            self._squares += sum_of_products(e, e)
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


def _find(stamps: Filled, probe: Probe, interval: float) -> tuple[Marks, _Tally]:
    """One pass over the stamps: where samples are missing, where the clock fell back, and the odd rows."""
    tally = _Tally()
    before = after = probe.window
    judge = JUDGES[probe.regime if probe.late is None else "late"]
    gaps: list[_Ints] = []
    steps: list[_Floats] = []
    for first, count, block in stamps.blocks(before, after, CACHED):
        lead = min(before, first)
        all_differences = np.diff(block)
        differences = all_differences[lead : lead + count]
        at, step = judge(block, all_differences, lead, count, interval, probe)
        wild = np.abs(differences - interval) > 20.0 * interval + 2.0 * probe.threshold
        wild[at - lead] = True
        tally.add(first, differences, interval, wild)
        gaps.append(at - lead + first)
        steps.append(step)
    at, step = np.concatenate(gaps), np.concatenate(steps)
    missing, loose = _counted(np.clip(step / interval, -_ENDLESS, _ENDLESS), probe, tally.jitter / interval)
    up, down = missing >= 1, step < -0.5 * interval
    if loose and not down.any() and probe.late is None and probe.regime in ("regular", "jittered"):
        missing[up] = _by_levels(stamps, at[up], interval)
        up = missing >= 1
    return Marks(at[up], missing[up], at[down], step[down], loose), tally


def _counted(step: _Floats, probe: Probe, jitter: float) -> tuple[_Ints, bool]:
    """Missing samples of each step, given in intervals, and whether pauses end beside the grid.

    Where they do, what is rounded off is handed on to the next pause: it does not add up. Of a few pauses one is
    enough, if it is farther from the grid than the jitter (rms, in intervals) explains, or if the jitter would hide it:
    else the rounding passes for a change of the rate.
    """
    whole = np.round(step)
    off, pause = np.abs(step - whole), np.abs(step) > _PAUSE
    loose = bool(np.count_nonzero(pause & (off > _LOOSE)) > max(0.25 * len(step), 1))
    if probe.regime == "coarse":
        loose = len(step) > 0
    elif probe.regime != "irregular":
        clear = np.count_nonzero(pause & (off > _ON_GRID + 6.0 * jitter))
        hidden = probe.regime == "jittered" and 0 < len(step) <= _FEW_PAUSES and bool(pause.any())
        loose = loose or hidden or bool(clear > 0.05 * len(step))
    if loose:
        whole = np.diff(np.round(np.cumsum(step)), prepend=0.0)
    return whole.astype(np.int64), loose


def _by_levels(stamps: Filled, gaps: _Ints, interval: float) -> _Ints:
    """Missing samples of pauses that end beside the grid, by where the stamps behind each of them lie on the whole.

    Summed from pause to pause, the rounding of the stamps on both sides of each would add up.
    """
    begins = np.concatenate(([0], gaps + 1))
    levels = np.zeros(len(begins))
    for first, count, block in stamps.blocks(0, _HEAD):
        inside = np.arange(*np.searchsorted(begins, (first, first + count + 1)))
        for k in inside:
            end = begins[k + 1] if k + 1 < len(begins) else len(stamps)
            head = block[begins[k] - first : min(begins[k] + _HEAD, end) - first]
            levels[k] = np.median(head - interval * (begins[k] + np.arange(len(head))))
    return np.asarray(np.diff(np.round((levels - levels[0]) / interval)), dtype=np.int64)


def _refuse(stamps: Filled, marks: Marks, tally: _Tally, source: str, interval: float) -> None:
    n = len(stamps)
    if tally.backward > 0.1 * n:
        raise DataQualityError(
            f"time column {source!r} runs backward at {tally.backward} of {n} rows (first: rows "
            f"{', '.join(map(str, tally.backward_rows))}): the rows are not in chronological order; sort "
            "them, or pass the rate (--rate), which overrides the stamps"
        )
    if len(marks.missing) and int(marks.missing.sum()) + n > _LONGEST_GRID * n + _LONG_ENOUGH:
        longest = np.argsort(marks.missing)[::-1][:_LISTED_ROWS]
        rows = ", ".join(
            f"row {marks.gaps[k] + 1} by {(marks.missing[k] + 1) * interval:.6g} s" for k in sorted(longest)
        )
        raise DataQualityError(
            f"time column {source!r} jumps far beyond the length of the record ({rows}): the clock was "
            f"set, or the file contains several records. Split it there, {_cut(stamps, marks, interval)}, "
            f"or pass the rate (--rate {1.0 / interval:.6g}), which overrides the stamps"
        )


def _refuse_off_grid(stamps: Filled, marks: Marks, source: str, interval: float) -> None:
    """Refuse a grid that late stamps, which are right but for their lateness, contradict as a whole."""
    share = off_grid_share(stamps, marks, interval)
    if share > _OFF_GRID:
        raise no_grid(
            stamps,
            source,
            f"{100.0 * share:.2g} % of the samples are more than half an interval from the best grid, "
            f"{interval:.6g} s: samples were lost without a gap in the stamps, or sampling was uneven",
        )


def _off_grid(
    stamps: Filled, probe: Probe, marks: Marks, tally: _Tally, line: ClockLine, interval: float
) -> float:
    """Share of the samples off the grid; looked for where the stamps leave the line, and tell single samples."""
    if probe.late is not None or probe.coarse is not None or probe.ticks or line.wander <= 0.5 * interval:
        return 0.0
    return off_grid_share(stamps, marks, interval, tally.jitter)


def _unplaced(stamps: Filled, probe: Probe, marks: Marks, source: str, interval: float) -> int:
    """Samples whose place the stamps do not tell: coarse ones, or those that a host wrote in one go."""
    if probe.coarse is None:
        return 0 if probe.late is None else in_stalls(stamps, marks, interval)
    count = without_place(stamps, probe.coarse)
    if count > _UNPLACED * len(stamps):
        raise no_grid(
            stamps,
            source,
            f"they come in steps of {probe.coarse.step:.3g} s, and pauses are so many that {count} of {len(stamps)} "
            "samples do not fit between them",
        )
    return count


def _cut(stamps: Filled, marks: Marks, interval: float) -> str:
    """The options that take the longest part between jumps that are longer than the record."""
    n = len(stamps)
    far = marks.missing > n
    jumps = marks.gaps[far if far.any() else marks.missing == marks.missing.max()]
    back = marks.shifts[marks.offsets < -n * interval]
    edges = np.concatenate(([0], np.sort(np.concatenate((jumps, back))) + 1, [n]))
    k = int(np.argmax(np.diff(edges)))
    first, last = int(edges[k]), int(edges[k + 1]) - 1
    longest, others = _stamp(stamps, first), [_stamp(stamps, int(a)) for a in np.delete(edges[:-1], k)]
    words = [f"--from {_near(stamps, first, -interval)}"] if min(others) < longest else []
    words += [f"--to {_near(stamps, last, interval)}"] if max(others) > longest else []
    return f"{' '.join(words)} for the longest part ({last - first + 1} of {n} rows)"


def _stamp(stamps: Filled, row: int) -> float:
    return float(stamps.read(row, row + 1)[0])


def _near(stamps: Filled, row: int, way: float) -> str:
    """A short number of seconds between a stamp and the place a few intervals before or after it."""
    stamp = _stamp(stamps, row)
    return repr(between(*sorted((stamp + 0.01 * way, stamp + 4.0 * way))))


def _plain(value: float, tolerance: float) -> float:
    """The value with the fewest digits that differs by less than the relative tolerance."""
    for digits in range(1, 17):
        short = float(f"{value:.{digits}g}")
        if abs(short / value - 1.0) <= tolerance:
            return short
    return value
