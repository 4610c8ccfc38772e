# SPDX-License-Identifier: BSD-3-Clause
"""A first look at time stamps: which regime they belong to, their interval, and how each difference is judged.

* *coarse* stamps (written in steps that are not short against the interval): each bounds the time of its sample;
  a pause is where the bounds of a run exclude the next stamp (`coarse_stamps`).
* *regular* stamps (most differences within a quarter of their median): each difference is judged alone;
  a late stamp is forgiven when the next ones make up for it.
* *jittered* stamps (most differences within half of their median): each stamp lies nearest to its own place, whose
  phase its neighbors tell (`jittered_stamps`).
* *late* stamps (regular or jittered, but for what a host stamped late in one go): a gap is a step of the earliest
  time that the stamps behind a sample allow (`late_stamps`).
* *irregular* stamps (bursts): a gap is a jump beyond the regular ones that the stamps around it do not make up for,
  measured by medians on both sides.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.files.readers.coarse_stamps import CoarseStamps, coarse_interval, pauses_between, shared_step
from allanite.files.readers.filled_stamps import Filled
from allanite.files.readers.jittered_stamps import (
    MARGIN,
    between,
    common_slope,
    holds,
    interval_between_pauses,
    steps_of,
)
from allanite.files.readers.late_stamps import (
    REACH,
    brought_forward,
    earliest,
    off_grid,
    usual_lateness,
)
from allanite.files.readers.rate_change import RateChange, two_rates
from allanite.lazy_dataclasses import dataclass

__all__ = ["JUDGES", "LONGEST", "SHORTEST", "Probe", "no_grid", "probe_of"]

_Floats = NDArray[np.float64]
_Ints = NDArray[np.int64]

SHORTEST, LONGEST = 1e-9, 1e7  # a sample interval outside is no sensor's [s]

_CALM = 0.05  # half of the regular differences lie so close to an interval
_WALK = 64
_WANDERS = 3.0  # a walk of 64 steps goes 8 times as far as one; stamps that are only late go no farther
_FEWEST_BURSTS = 20
_MAKE_UP = 4  # a late stamp is forgiven if one of the next so many is in time again
_LISTED_ROWS = 5
_LONG = 1 << 17  # coarse stamps that are looked at in one go
_ON_GRID = 0.2  # rms distance from whole intervals, between stamps in time, if others were brought forward
_FEW = 0.005  # share of the differences that coarse stamps make another
_IN_TIME = 0.5  # share of the stamps by which the others are judged
_BEFORE = 16  # late stamps before a step that tell where it begins
_STEADY = 0.5  # share of the samples before which no pause is


@dataclass(frozen=True, slots=True, kw_only=True)
class Probe:
    """A first look at stretches of the stamps."""

    stamps: _Floats
    median: float  # of the differences that are not zero, unless most are not
    interval: float  # first estimate of the sample interval
    regime: Literal["coarse", "regular", "jittered", "irregular"]
    threshold: float  # a longer difference may be a gap
    ticks: bool = (
        False  # stamps come in bursts, or from a coarse clock: only the first of each counts for the slope
    )
    window: int  # stamps on either side that judge it
    late: float | None = None  # stamps later than this, beside their interval, are brought forward [s]
    coarse: CoarseStamps | None = None


@dataclass(frozen=True, slots=True)
class _StampStretches:
    """Stretches of the stamps, and what lies between stamps in them."""

    stretches: list[_Floats]
    differences: _Floats
    median: float  # of the differences; of those that rise where it is not positive
    bursts: bool

    @classmethod
    def of(cls, stretches: list[_Floats]) -> _StampStretches:
        differences = np.concatenate([np.diff(s) for s in stretches])
        median = float(np.median(differences))
        if median <= 0:
            median = float(np.median(differences[differences > 0]))
        return cls(stretches, differences, median, _bursts(differences, median))


def probe_of(stamps: Filled, source: str, *, exact: bool = False) -> Probe:
    """The regime of the stamps and their interval.

    Parameters
    ----------
    exact : bool
        They are no coarser than they seem: numbers of samples.

    Raises
    ------
    DataQualityError
        No grid can be built.
    """
    look = _look(stamps, source)
    with np.errstate(
        over="ignore", invalid="ignore", divide="ignore"
    ):  # absurd stamps are refused further on
        probe = None if exact else _coarse(stamps, look)
        probe = probe or _even(look)
        if probe is not None and probe.regime != "coarse":
            probe = _late(look, probe.interval) or probe
        elif probe is None:
            probe = _late(look, interval_between_pauses(look.stretches, look.median, lossy=True))
        if probe is None and _wander(look.stretches, look.differences):
            raise no_grid(stamps, source)
        if probe is not None:
            return probe
        interval = _block_interval(stamps, source)
        return _late(look, interval) or _irregular(look, interval)


def _look(stamps: Filled, source: str) -> _StampStretches:
    n = len(stamps)
    length = min(n, 4096)
    starts = np.unique(np.linspace(0, n - length, min(64, max(1, n // length))).astype(np.int64))
    stretches = [stamps.read(int(a), int(a) + length) for a in starts]
    differences = np.concatenate([np.diff(s) for s in stretches])
    rising = np.count_nonzero(differences > 0)
    if not differences.any():
        raise no_grid(stamps, source, "all are equal")
    if rising < 0.5 * np.count_nonzero(differences):
        raise no_grid(stamps, source, "they do not rise")
    if rising < 2 and n > 8:  # one step in the whole record tells no rate
        raise no_grid(stamps, source, "all but one are equal")
    return _StampStretches.of(stretches)


def _coarse(stamps: Filled, look: _StampStretches) -> Probe | None:
    step = shared_step(look.stretches)
    if step is None or np.mean(np.abs(look.differences - look.median) > 0.5 * step) < _FEW:
        return None
    n = len(stamps)
    length = min(n, _LONG)
    starts = np.unique(np.linspace(0, n - length, min(4, max(1, n // length))).astype(np.int64))
    coarse = coarse_interval([stamps.read(int(a), int(a) + length) for a in starts], step)
    if coarse is None:
        return None
    threshold = max(step, 1.5 * coarse.interval)
    return Probe(
        stamps=look.stretches[0],
        median=look.median,
        interval=coarse.interval,
        regime="coarse",
        threshold=threshold,
        ticks=step > coarse.interval,
        window=2 * coarse.window,
        coarse=coarse,
    )


def _even(look: _StampStretches) -> Probe | None:
    return _regular(look) or _jittered(look)


def _late(look: _StampStretches, interval: float) -> Probe | None:
    """Stamps that are even once the late ones among them are brought forward."""
    if not interval > 0:
        return None
    single = [_without_doubles(stretch, interval) for stretch in look.stretches]
    for _ in range(2):
        usual = usual_lateness(single, interval)
        brought = [brought_forward(stretch, interval, usual) for stretch in single]
        stretches = [stretch for stretch, _ in brought]
        in_time = [stretch[~late] for stretch, late in brought]
        if sum(map(len, in_time)) < _IN_TIME * sum(map(len, stretches)):
            return None
        if not any(
            _piled(stretch, late, interval) for stretch, (_, late) in zip(single, brought, strict=True)
        ):
            return None
        interval = interval_between_pauses(stretches, interval, lossy=True)
    if _steady(look, interval) < _STEADY or off_grid(in_time, interval) > _ON_GRID:
        return None
    even = _even(_StampStretches.of(stretches))
    if even is None:
        return None
    return replace(
        even, window=REACH, late=usual, interval=interval, stamps=look.stretches[0], median=look.median
    )


def _piled(stamps: _Floats, late: NDArray[np.bool_], interval: float) -> bool:
    """True if late stamps lie close together; what is late alone, or evenly so, is forgiven anyhow."""
    return bool(np.any(late[1:] & late[:-1] & (np.diff(stamps) < 0.5 * interval)))


def _without_doubles(stamps: _Floats, interval: float) -> _Floats:
    """Without the rows written twice among even ones: each sets all before it back by one, as if they had been late."""
    differences = np.diff(stamps)
    even = np.abs(differences - interval) <= 0.25 * interval
    double = differences == 0
    double[1:] &= even[:-1]
    double[:-1] &= even[1:]
    return np.asarray(stamps[np.append(True, ~double)])


def _steady(look: _StampStretches, interval: float) -> float:
    return float((look.differences < 2.5 * interval).mean())


def _regular(look: _StampStretches) -> Probe | None:
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
    return Probe(
        stamps=look.stretches[0],
        median=look.median,
        interval=interval,
        regime="regular",
        threshold=1.5 * interval,
        window=_MAKE_UP,
    )


def _jittered(look: _StampStretches) -> Probe | None:
    ratio = look.differences / look.median
    if look.bursts or (np.abs(ratio - np.round(ratio).clip(1)) <= 0.5).mean() <= 0.6:
        return None
    interval = interval_between_pauses(look.stretches, look.median)
    if not (interval > 0.0 and holds(look.stretches, interval)):
        return None
    return Probe(
        stamps=look.stretches[0],
        median=look.median,
        interval=interval,
        regime="jittered",
        threshold=1.5 * interval,
        window=MARGIN,
    )


def _irregular(look: _StampStretches, interval: float) -> Probe:
    differences = look.differences
    longest = float(np.quantile(differences[differences > 0], 0.995))
    burst = len(differences) / max(int(np.count_nonzero(differences > 1.5 * interval)), 1)
    window = int(np.clip(10 * burst, 20, 4096))
    ticks = float((differences < 0.5 * interval).mean()) > 0.4
    threshold = max(1.5 * interval, 1.5 * longest + 0.5 * interval)
    return Probe(
        stamps=look.stretches[0],
        median=look.median,
        interval=interval,
        regime="irregular",
        threshold=threshold,
        ticks=ticks,
        window=window,
    )


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


def _regular_interval(look: _StampStretches) -> float:
    """Median slope of the stretches that hold no odd difference; else that of all that lies between odd ones."""
    parts = [between([stretch], 0.4 * look.median, 1.6 * look.median) for stretch in look.stretches]
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
        raise no_grid(stamps, source, "they do not rise")
    return interval


def no_grid(
    stamps: Filled, source: str, why: str = "", *, change: RateChange | None = None
) -> DataQualityError:
    """The error of a time column without an even grid: why, where it is known, its first stamps, and what to do."""
    if change := change or two_rates(stamps):
        return DataQualityError(
            f"the times in column {source!r} fit no even grid: the rate changes from {change.before:.4g} Hz to "
            f"{change.after:.4g} Hz about {change.at:.6g} s after the first stamp; analyze each part by itself, with "
            "--to and --from"
        )
    first = ", ".join(f"row {k}: {t:.9g} s" for k, t in enumerate(stamps.read(0, _LISTED_ROWS)))
    return DataQualityError(
        f"the times in column {source!r} fit no even grid{why and ': '}{why} (since the first stamp, {first}); "
        f"if the samples are evenly spaced, give their rate ({_by_count(stamps)}), which overrides the stamps"
    )


def _by_count(stamps: Filled) -> str:
    """The option for the rate, with the samples over their span where these tell one."""
    n = len(stamps)
    last = float(stamps.read(n - 4096, n)[-1])
    rate = (n - 1) / last if last > 0 else math.inf
    if not 1.0 / LONGEST <= rate <= 1.0 / SHORTEST:
        return "--rate"
    return f"--rate {rate:.6g} if nothing is missing: {n} samples over {last:.6g} s"


# -- judges ------------------------------------------------------------------------------------------------


def _judge_regular(
    block: _Floats, differences: _Floats, lead: int, count: int, interval: float, probe: Probe
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
    block: _Floats, differences: _Floats, lead: int, count: int, interval: float, probe: Probe
) -> tuple[_Ints, _Floats]:
    """Steps from place to place beyond one interval: where they are and how long [s]."""
    if not np.any(np.abs(differences - interval) > 0.5 * interval):
        return np.empty(0, dtype=np.int64), np.empty(0)
    step = steps_of(block, interval)[lead : lead + count]
    at = np.flatnonzero(step)
    return at + lead, step[at] * interval


def _judge_coarse(
    block: _Floats, differences: _Floats, lead: int, count: int, interval: float, probe: Probe
) -> tuple[_Ints, _Floats]:
    """Pauses between runs of stamps that one place allows: where they are and how long [s]."""
    at, step = pauses_between(block, probe.coarse or CoarseStamps(interval, interval))
    in_block = (at >= lead) & (at < lead + count) & (np.abs(step) > 0.5 * interval)
    return at[in_block], step[in_block]


def _judge_late(
    block: _Floats, differences: _Floats, lead: int, count: int, interval: float, probe: Probe
) -> tuple[_Ints, _Floats]:
    """Steps of the earliest time that the stamps after a sample allow.

    The last few before a step have no more than each other to tell their time: the lowest of them counts.
    """
    level = earliest(block, interval, probe.late or 0.0) - interval * np.arange(len(block))
    step = np.diff(level)
    at = np.flatnonzero(np.abs(step) > 0.5 * interval)
    begins = np.maximum(np.concatenate(([0], at[:-1] + 1)), at - _BEFORE) if len(at) else at
    before = np.array([level[a : b + 1].min() for a, b in zip(begins, at, strict=True)])
    within = (at >= lead) & (at < lead + count)
    return at[within], (level[at + 1] - before)[within]


def _judge_irregular(
    block: _Floats, differences: _Floats, lead: int, count: int, interval: float, probe: Probe
) -> tuple[_Ints, _Floats]:
    """Jumps beyond the regular ones that stay: their places and their lasting size [s]."""
    in_block = slice(lead, lead + count)
    odd = (
        np.flatnonzero((differences[in_block] > probe.threshold) | (differences[in_block] < -0.5 * interval))
        + lead
    )
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


JUDGES = {
    "coarse": _judge_coarse,
    "late": _judge_late,
    "regular": _judge_regular,
    "jittered": _judge_jittered,
    "irregular": _judge_irregular,
}
