# SPDX-License-Identifier: BSD-3-Clause
"""Alarms at a stated rate per record, and the fault of which sensor explains them.

Every window, every longer window (8 and 64 of them) and every run of 16 windows is one test of a chi-square that the
filter of `parity` made independent; all of them share the false-alarm rate of the record [Bonferroni]. An alarm is
explained by a hypothesis: in sensor i, from window k on, a step, a step that ends, a drift, a spike or more noise. The
hypothesis that raises the likelihood most, less the price of its parameters [BIC], wins; noise, which takes its windows
out of all tests and so leaves no alarm whatever the truth is, replaces an earlier explanation only if it is likelier
than that one and a second fault together. Sensors whose own best hypothesis comes within a factor of 20 in probability
stay candidates. What is explained is taken out, and the tests are made again.

With one parity (n = m + 1) all hypotheses fit alike: a fault is seen, its sensor is not. A sensor whose samples stand
still is named by that alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.redundancy.alarms import RUN, Bench
from allanite.experiments.redundancy.means import WindowMeans
from allanite.experiments.redundancy.results import SensorFault
from allanite.experiments.redundancy.verdict import FaultKind
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel

__all__ = ["Examination", "examine"]

Array = NDArray[np.float64]

#: Faults that are looked for in a record.
MOST = 12
#: A sensor stays a candidate down to this part of the probability of the best.
ODDS = 20.0
#: A sensor that stands still in more separate spells than this is coarse, not stuck.
SPELLS = 3
#: Onsets that are tried, so many lengths of the alarm before it; lengths of it, and windows at least, that are
#: looked at after it.
ONSETS, BEFORE, AFTER, SOON = 32, 2, 2, 32
#: Ends that are tried, and further onsets and ends, where the parity changes most from one window to the next.
ENDS, JUMPS = 12, 6
#: Twice the log-likelihood by which an onset may be worse than the best and is not contradicted: 95 %.
NEAR = 3.84
#: Another noise of what is left, from which on the search is made again.
CHANGED = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class Examination:
    """What the parity says.

    Attributes
    ----------
    faults : tuple of SensorFault
    series : dict of int to ndarray, shape (windows // scale,)
        Chi-square of the parity of each window, and of windows so many times as long.
    threshold : float
    dof : int
    noise_ratio : float
        Noise of the parity over that of the models: median of the windows.
    unusual : bool
        That ratio cannot be chance.
    """

    faults: tuple[SensorFault, ...]
    series: dict[int, Array]
    threshold: float
    dof: int
    noise_ratio: float
    unusual: bool


def examine(
    means: WindowMeans,
    parity: Array,
    models: Sequence[NoiseModel],
    correlation: Array,
    names: Sequence[str],
    *,
    false_alarm: float,
    extra: Array,
) -> Examination:
    """Faults of sensors in a record of window means.

    Parameters
    ----------
    extra : ndarray, shape (windows,) [SI^2]
        Variance of each sensor that motion adds (scale factors and axes that are not exact).
    """
    stuck, open_ = _stuck(means, names, len(parity))
    bench = Bench.of(means, parity, models, correlation, extra, open_, false_alarm)
    series = bench.series()
    explanations, before = _search(bench, names), bench.allowed
    bench.measure()  # a long fault is in the first measure of the noise
    if abs(bench.allowed / before - 1) > CHANGED:
        clean = Bench.of(means, parity, models, correlation, extra, open_, false_alarm)
        clean.median, clean.unusual = bench.median, bench.unusual
        bench, explanations = clean, _search(clean, names)
        bench.measure()
    faults = _joined(bench, explanations, names)
    return Examination(
        faults=tuple(sorted([*stuck, *faults], key=lambda f: f.start)),
        series={scale: chi2 / bench.allowed for scale, chi2 in series.items()},
        threshold=bench.level(len(parity)),
        dof=len(parity),
        noise_ratio=math.sqrt(bench.median),
        unusual=bench.unusual,
    )


# -- stuck ---------------------------------------------------------------------------------------------------


def _stuck(
    means: WindowMeans, names: Sequence[str], parities: int
) -> tuple[list[SensorFault], NDArray[np.bool_]]:
    """Sensors whose samples stand still for windows on end, and the windows without such a sensor."""
    faults, open_ = [], np.ones(len(means), dtype=np.bool_)
    for i, name in enumerate(names):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], means.frozen[:, i].astype(np.int8), [0]])))
        spells = edges.reshape(-1, 2)
        if not len(spells) or len(spells) > SPELLS or means.frozen[:, i].all():
            continue
        for start, stop in spells.tolist():
            open_[start:stop] = False
            faults.append(
                SensorFault(
                    kind=FaultKind.STUCK,
                    sensor=name,
                    candidates=(name,),
                    start=start * means.dt,
                    stop=stop * means.dt,
                    since=start * means.dt,
                    size=math.nan,
                    size_sd=math.nan,
                    statistic=math.inf,
                    parities=parities,
                )
            )
    return faults, open_


# -- hypotheses ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Hypothesis:
    kind: str  # of Fault; "spell" is a step that ends in window stop - 1
    sensor: int
    start: int
    stop: int
    since: int  # the earliest onset that the windows do not contradict
    gain: float  # twice that in log-likelihood, less ln N for each parameter
    ratio: float = math.nan  # variance along what the fault does to the parity, over that of the models


@dataclass(frozen=True, slots=True, kw_only=True)
class _Explained:
    best: _Hypothesis
    candidates: tuple[int, ...]
    columns: tuple[int, ...]  # places in `Bench.explained`
    alarm: tuple[int, int]


def _search(bench: Bench, names: Sequence[str]) -> list[_Explained]:
    explanations: list[_Explained] = []
    horizon, windows, n = 0, len(bench.means), len(names)
    while len(explanations) < MOST:
        cleaned = bench.cleaned(horizon)
        alarm = bench.first_alarm(cleaned)
        if alarm is None:
            _again(bench, explanations, None, windows, n)
            break
        length = alarm[1] - alarm[0]
        horizon = min(alarm[1] + max(AFTER * length, SOON), windows)
        if not _again(bench, explanations, alarm, horizon, n):
            # the sizes of the earlier faults by the same windows: noise is judged by what they leave
            ranked = _ranked(bench, bench.cleaned(horizon), alarm, horizon, n)
            explanations.append(_explained(bench, ranked, alarm, n))
    return _pruned(bench, explanations)


def _explained(bench: Bench, ranked: list[_Hypothesis], alarm: tuple[int, int], n: int) -> _Explained:
    """The best hypothesis for an alarm, put on the bench."""
    if ranked[0].gain > 0 and ranked[0].kind == "noise":
        ranked = _whole_spell(bench, bench.cleaned(len(bench.means)), ranked[0], n)
    best = ranked[0]
    near = [h.sensor for h in ranked if best.gain - h.gain <= 2 * math.log(ODDS * max(n - 1, 1))]
    if best.gain <= 0:
        best = replace(best, kind="other", start=alarm[0], stop=alarm[1], since=alarm[0])
        near = list(range(n))
    if best.kind in ("noise", "other"):
        bench.mask(best.start, best.stop)
    at, shapes = len(bench.explained), _shapes(bench, best)
    bench.explained += shapes
    return _Explained(
        best=best, candidates=tuple(near), columns=tuple(range(at, at + len(shapes))), alarm=alarm
    )


def _again(
    bench: Bench, explanations: list[_Explained], alarm: tuple[int, int] | None, horizon: int, n: int
) -> bool:
    """The last hypothesis chosen anew, by all windows before the horizon, if that leaves no alarm there.

    It was judged by few windows: a drift of which only the beginning was seen, or a size that was not exact.
    """
    if not explanations or not explanations[-1].columns:
        return False
    before, both = bench.state(), explanations[-1].alarm
    if alarm is not None:
        both = min(both[0], alarm[0]), max(both[1], alarm[1])
    misfit = bench.misfit(horizon)
    del bench.explained[explanations[-1].columns[0] :]
    gain = bench.misfit(horizon) - misfit - _price(explanations[-1].best.kind, horizon)
    ranked = _ranked(bench, bench.cleaned(horizon), both, horizon, n)
    if ranked[0].kind == "noise" and alarm is not None:
        bench.restore(before)
        second = _ranked(bench, bench.cleaned(horizon), alarm, horizon, n)[0]
        if ranked[0].gain < gain + max(second.gain, 0.0):
            return False
        del bench.explained[explanations[-1].columns[0] :]
    again = _explained(bench, ranked, both, n)
    left = bench.first_alarm(bench.cleaned(horizon))
    if left is not None and left[0] < horizon:
        bench.restore(before)
        return False
    explanations[-1] = again
    return True


def _pruned(bench: Bench, explanations: list[_Explained]) -> list[_Explained]:
    """Without hypotheses that later ones made unnecessary."""
    kept = list(explanations)
    for item in explanations:
        if item.columns:
            sizes, covariance = bench.sizes()
            at = list(item.columns)
            chi2 = float(sizes[at] @ np.linalg.pinv(covariance[np.ix_(at, at)]) @ sizes[at])
            if chi2 < bench.level(len(at)):
                kept.remove(item)
                bench.explained[at[0] : at[-1] + 1] = []
                shift = len(at)
                moved = [
                    replace(k, columns=tuple(c - shift for c in k.columns))
                    if k.columns and k.columns[0] > at[-1]
                    else k
                    for k in kept
                ]
                return _pruned(bench, moved)
    return kept


def _shapes(bench: Bench, best: _Hypothesis) -> list[Array]:
    """Columns of a hypothesis, of size one, in the sensors: shape (windows, n) each."""
    time = np.arange(len(bench.means))
    profiles = {
        "step": [(time > best.start).astype(float), (time == best.start).astype(float)],
        "spell": [
            ((time > best.start) & (time < best.stop - 1)).astype(float),
            (time == best.start).astype(float),
            (time == best.stop - 1).astype(float),
        ],
        "drift": [np.maximum(time - best.start, 0.0) * bench.means.dt],
        "spike": [(time == best.start).astype(float)],
        "noise": [],
        "other": [],
    }[best.kind]
    return [p[:, None] * (np.arange(bench.parity.shape[1]) == best.sensor) for p in profiles]


def _ranked(bench: Bench, cleaned: Array, alarm: tuple[int, int], horizon: int, n: int) -> list[_Hypothesis]:
    """The best hypothesis of every sensor, best first."""
    white = bench.whitened(cleaned[:horizon])
    length = alarm[1] - alarm[0]
    first, last = max(alarm[0] - BEFORE * length, 0), alarm[1] - 1
    even = [np.linspace(first, last, ONSETS), np.linspace(alarm[0], horizon - 1, ENDS)]
    places = np.unique(np.concatenate([*even, _jumps(bench, cleaned, first, horizon)]).astype(np.int64))
    basis = None
    if bench.explained:
        rows = bench.whitened(np.stack(bench.explained, axis=-1)[:horizon])
        basis = np.asarray(np.linalg.qr(rows.reshape(-1, rows.shape[-1]))[0])
    marks = _marks(bench, places)
    best = []
    for sensor in range(n):
        shapes = _marks_of(bench, marks, sensor, horizon)
        signal = max(_signals(white, shapes, places, last, sensor, basis), key=lambda h: h.gain)
        signal = _to_the_window(bench, white, signal, places, last, basis)
        best.append(max(signal, *_noises(_power(bench, white, sensor), alarm, sensor), key=lambda h: h.gain))
    return sorted(best, key=lambda h: -h.gain)


def _jumps(bench: Bench, cleaned: Array, first: int, horizon: int) -> NDArray[np.int64]:
    """Windows around which the parity changes most: where a large fault begins and ends."""
    parity = cleaned[first:horizon] @ bench.parity.T
    change = np.abs(np.diff(np.where(bench.masked[first:horizon, None], np.nan, parity), axis=0)).max(axis=1)
    largest = np.argsort(np.nan_to_num(change))[-JUMPS:] + first
    return np.concatenate([largest, largest + 1])


def _to_the_window(
    bench: Bench,
    white: Array,
    rough: _Hypothesis,
    places: NDArray[np.int64],
    last: int,
    basis: Array | None,
) -> _Hypothesis:
    """The same kind of fault, its onset and end searched window by window between the neighbouring places."""
    ends = [rough.start, rough.stop - 1] if rough.kind == "spell" else [rough.start]
    near: set[int] = set()
    for end in ends:
        at = int(np.searchsorted(places, end))
        low, high = places[max(at - 1, 0)], places[min(at + 1, len(places) - 1)]
        near |= set(range(int(low), min(int(high), len(white) - 1) + 1))
    fine = np.array(sorted(near), dtype=np.int64)
    shapes = _marks_of(bench, _marks(bench, fine), rough.sensor, len(white))
    hypotheses = _signals(white, shapes, fine, last, rough.sensor, basis)
    return next((h for h in hypotheses if h.kind == rough.kind), rough)


def _marks(bench: Bench, onsets: NDArray[np.int64]) -> Array:
    """Level after, pulse at and ramp from each onset: shape (windows, 3 onsets)."""
    time = np.arange(len(bench.means))[:, None]
    return np.concatenate(
        [time > onsets, time == onsets, np.maximum(time - onsets, 0) * bench.means.dt], axis=1
    ).astype(np.float64)


def _marks_of(bench: Bench, marks: Array, sensor: int, horizon: int) -> Array:
    """The marks of one sensor, whitened: shape (windows q, 3, onsets)."""
    one = (np.arange(bench.parity.shape[1]) == sensor).astype(np.float64)
    white = bench.whitened(one[None, :, None] * marks[:horizon, None, :])
    return white.reshape(-1, 3, marks.shape[1] // 3)


def _price(kind: str, windows: int) -> float:
    """ln N for each parameter: onset, size and what a window holds of either end."""
    parameters = {"step": 3, "spell": 5, "spike": 2, "drift": 2, "noise": 3, "other": 0}[kind]
    return parameters * math.log(max(windows, 2))


def _signals(
    white: Array,
    shapes: Array,
    places: NDArray[np.int64],
    last: int,
    sensor: int,
    basis: Array | None,
) -> list[_Hypothesis]:
    """Step, spike and drift from the best of the places up to the last each, and the step that ends."""
    x, y = shapes.reshape(len(shapes), -1), white.ravel()
    if basis is not None:
        x = x - basis @ (basis.T @ x)
        y = y - basis @ (basis.T @ y)
    level, pulse, ramp = x.reshape(shapes.shape).transpose(1, 2, 0)
    begins = places <= last
    with np.errstate(divide="ignore", invalid="ignore"):
        spike = np.nan_to_num((pulse @ y) ** 2 / (pulse**2).sum(axis=1))
        drift = np.nan_to_num((ramp @ y) ** 2 / (ramp**2).sum(axis=1))
        # the level, with the pulse taken out of it: together they are a step inside a window
        along = np.nan_to_num((level * pulse).sum(axis=1) / (pulse**2).sum(axis=1))
        rest = level - along[:, None] * pulse
        step = spike + np.nan_to_num((rest @ y) ** 2 / (rest**2).sum(axis=1))
    hypotheses = []
    for kind, gains in (("step", step), ("spike", spike), ("drift", drift)):
        gains = gains[begins]
        k = int(np.argmax(gains))
        stop = int(places[k]) + 1 if kind == "spike" else len(white)
        hypotheses.append(_signal(kind, sensor, places[begins], gains, stop, len(white)))
    starts, stops, gains = _spells(level, pulse, y, places, begins)
    if len(gains):
        stop = int(stops[int(np.argmax(gains))]) + 1
        hypotheses.append(_signal("spell", sensor, starts, gains, stop, len(white)))
    return hypotheses


def _signal(
    kind: str, sensor: int, starts: NDArray[np.int64], gains: Array, stop: int, windows: int
) -> _Hypothesis:
    k = int(np.argmax(gains))
    return _Hypothesis(
        kind=kind,
        sensor=sensor,
        start=int(starts[k]),
        stop=stop,
        since=int(starts[gains >= gains[k] - NEAR].min()),
        gain=float(gains[k]) - _price(kind, windows),
    )


def _spells(
    level: Array, pulse: Array, y: Array, places: NDArray[np.int64], begins: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Onset, end and gain of every step that ends: a level between them, and what the two windows hold of it."""
    first, then = np.nonzero(begins[:, None] & (places[None, :] >= places[:, None] + 2))
    if not len(first):
        return places[:0], places[:0], np.zeros(0)
    x = np.concatenate([level, pulse])
    gram, projections = x @ x.T, x @ y
    a, b, p, q = first, then, first + len(places), then + len(places)

    def inner(i: NDArray[np.int64]) -> Array:
        """Products of level a - level b with the columns i."""
        return np.asarray(gram[a, i] - gram[b, i])

    normal = np.empty((len(a), 3, 3))
    normal[:, 0, 0] = inner(a) - inner(b)
    normal[:, 0, 1] = normal[:, 1, 0] = inner(p)
    normal[:, 0, 2] = normal[:, 2, 0] = inner(q)
    normal[:, 1, 1], normal[:, 2, 2] = gram[p, p], gram[q, q]
    normal[:, 1, 2] = normal[:, 2, 1] = gram[p, q]
    right = np.stack([projections[a] - projections[b], projections[p], projections[q]], axis=-1)
    size, along = np.linalg.eigh(normal)  # no negative ones but for rounding; of nothing, nothing is gained
    determined_axes = size > 1e-10 * size[:, -1:]
    part = (along.transpose(0, 2, 1) @ right[:, :, None])[:, :, 0]
    return places[a], places[b], (part**2 / np.where(determined_axes, size, np.inf)).sum(axis=1)


def _power(bench: Bench, white: Array, sensor: int) -> Array:
    """Square of the parity along what a fault of the sensor does to it, expected 1; NaN where nothing is seen."""
    index = bench.filters[1].index[: len(white)]
    direction = np.zeros_like(white)
    there = index >= 0
    direction[there] = bench.filters[1].direction(index[there], sensor)
    length = np.linalg.norm(direction, axis=1)
    use = (length > 0) & ~bench.masked[: len(white)]
    along = (direction * white).sum(axis=1) / np.where(length > 0, length, 1.0)
    return np.where(use, along**2, np.nan)


def _noises(power: Array, alarm: tuple[int, int], sensor: int) -> list[_Hypothesis]:
    """More noise of one sensor around the alarm, for 16 windows, 32, ... up to the last."""
    hypotheses = []
    for start in sorted({alarm[0], max(alarm[0] - RUN // 2, 0), max(alarm[0] - RUN + 1, 0)}):
        size = RUN
        while size < 2 * (len(power) - start):
            hypotheses += _noise(power, start, min(start + size, len(power)), sensor)
            size *= 2
    return hypotheses


def _noise(power: Array, start: int, stop: int, sensor: int) -> list[_Hypothesis]:
    inside = power[start:stop]
    count = int((~np.isnan(inside)).sum())
    if count < 4:
        return []
    s = float(np.nanmean(inside))
    gain = count * (s - 1 - math.log(s)) if s > 1 else 0.0
    return [
        _Hypothesis(
            kind="noise",
            sensor=sensor,
            start=start,
            stop=stop,
            since=start,
            gain=gain - _price("noise", len(power)),
            ratio=s,
        )
    ]


def _whole_spell(bench: Bench, cleaned: Array, first: _Hypothesis, n: int) -> list[_Hypothesis]:
    """Noise that goes on beyond the windows by which it was found: every sensor over its whole spell, best first."""
    white = bench.whitened(cleaned)
    powers = [_power(bench, white, sensor) for sensor in range(n)]
    spells = [
        (start, stop)
        for start in range(max(first.start - RUN, 0), first.start + RUN, 2)
        for stop in range(first.start + RUN, len(white) + RUN, RUN // 2)
    ]
    best = max(
        (h for a, b in spells for h in _noise(powers[first.sensor], a, min(b, len(white)), first.sensor)),
        key=lambda h: h.gain,
    )
    same = [h for sensor in range(n) for h in _noise(powers[sensor], best.start, best.stop, sensor)]
    return sorted(same, key=lambda h: -h.gain)


# -- faults out of hypotheses ----------------------------------------------------------------------------------


def _joined(bench: Bench, explanations: list[_Explained], names: Sequence[str]) -> list[SensorFault]:
    """Faults with their spans: a step that is taken back ends there."""
    sizes, covariance = bench.sizes()
    faults: list[SensorFault] = []
    dt, end = bench.means.dt, len(bench.means)
    for item in sorted(explanations, key=lambda e: e.best.start):
        best = item.best
        at = item.columns[0] if item.columns else None
        size = _noise_factor(bench, best) if at is None else float(sizes[at])
        sd = math.nan if at is None else math.sqrt(max(float(covariance[at, at]), 0.0))
        who = tuple(names[i] for i in sorted(item.candidates, key=lambda i: i != best.sensor))
        fault = SensorFault(
            kind=FaultKind.STEP if best.kind == "spell" else FaultKind(best.kind),
            sensor=who[0] if len(who) == 1 else None,
            candidates=who,
            start=best.start * dt,
            stop=(end if best.kind in ("step", "drift") else best.stop) * dt,
            since=best.since * dt,
            size=size,
            size_sd=sd,
            statistic=best.gain,
            parities=len(bench.parity),
        )
        ended = _taken_back(faults, fault)
        for i in ended:
            faults[i] = replace(faults[i], stop=fault.start + dt)
        if not ended:
            faults.append(fault)
    return faults


def _noise_factor(bench: Bench, best: _Hypothesis) -> float:
    """Standard deviation of the means of the noisy sensor over that of its model."""
    effect = float((bench.filters[1].direction(np.array([-1]), best.sensor) ** 2).sum())
    more = (best.ratio - 1) * bench.allowed / effect
    model_variance = float(bench.models[best.sensor].avar(bench.means.dt)) * bench.allowed
    return math.sqrt(max(1 + more / model_variance, 0.0))


def _taken_back(faults: Sequence[SensorFault], later: SensorFault) -> list[int]:
    """Places of the steps that a later one takes back: the last that it undoes alone, or all that still last."""
    for i in reversed(range(len(faults))):
        if _takes_back(faults[i], later):
            return [i]
    lasting = [i for i, f in enumerate(faults) if f.kind is FaultKind.STEP and f.stop == later.stop]
    same = [i for i in lasting if faults[i].candidates[0] == later.candidates[0]]
    steps = [*(faults[i] for i in same), later]
    sd = math.hypot(*(f.size_sd for f in steps))
    back = abs(sum(f.size for f in steps)) < 4 * sd + 0.1 * max(abs(f.size) for f in steps)
    return same if later.kind is FaultKind.STEP and len(same) > 1 and back else []


def _takes_back(first: SensorFault, later: SensorFault) -> bool:
    """The same sensors step back by what they stepped."""
    if {first.kind, later.kind} != {FaultKind.STEP} or not set(first.candidates) & set(later.candidates):
        return False
    sd = math.hypot(first.size_sd, later.size_sd)
    # of candidates that cannot be told apart the first may be another one: then only the size can be compared
    same = first.candidates[0] == later.candidates[0]
    total = first.size + later.size if same else abs(first.size) - abs(later.size)
    return abs(total) < 4 * sd + 0.1 * abs(first.size)
