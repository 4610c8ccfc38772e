# SPDX-License-Identifier: BSD-3-Clause
"""A measurement of the Earth's rotation: how it grew, what the dwells say, and what other ways of reading it give.

In deg/h.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from allanite.experiments.reversals.sides import direction_of, is_vertical, sides_of
from allanite.quantities.distributions import normal_quantile
from allanite.quantities.number_words import interval, number
from allanite.views.figures.panel import Array, Axis, Curve, Label, Panel, around, array
from allanite.views.figures.records import clock

if TYPE_CHECKING:
    from allanite.experiments.earth_rate import EarthRateEstimate

__all__ = [
    "DEG_H",
    "VIEWS",
    "dead_time_panel",
    "dwell_panels",
    "estimator_panel",
    "known_rate",
    "level",
    "open_panel",
    "quantile",
    "running_panel",
]

#: One degree per hour [rad/s].
DEG_H = math.radians(1) / 3600
_SETTLED = 0.2  # part of the record after which everything must lie inside the frame of the running estimate
_LOOKS = ((1, "z", "circle"), (-1, "x", "square"), (0, "guide", "diamond"))  # of the dwells, by their sign
VIEWS = ("whole", "record", "running", "dwells", "residuals", "dead-time", "estimators", "bias")


def known_rate(known: float, ends: tuple[float, float]) -> Curve:
    """The known rate [rad/s], as a line between two places of the horizontal axis."""
    rate = known / DEG_H
    return level(rate, ends, f"known rate {rate:.3f} deg/h")


def level(height: float, ends: tuple[float, float], label: str) -> Curve:
    """A line to compare with."""
    return Curve(x=array(ends), y=array([height, height]), label=label, colour="ink", style="dashed")


def quantile(confidence: float) -> float:
    """Half width of an interval, in standard deviations of a normal law."""
    return normal_quantile((1 + confidence) / 2)


# -- as the record grows ----------------------------------------------------------------------------------


def running_panel(estimate: EarthRateEstimate) -> Panel:
    """The estimate so far with its band, and the mean of the pairs so far."""
    running, wide = estimate.running, quantile(estimate.confidence)
    unit, second = clock(estimate.duration)
    time = running.time / second
    rate, sd, pairs = (series / DEG_H for series in (running.rate, running.sd, running.pairs))
    percent = f"{100 * estimate.confidence:g} %"
    curves = [
        Curve(
            x=time,
            y=rate,
            lower=rate - wide * sd,
            upper=rate + wide * sd,
            label="regression",
            colour="z",
            band_label=f"{percent} band expected from the noise",
        ),
        Curve(x=time, y=pairs, label="mean of the pairs", colour="orange", style="dashed", marker="square"),
    ]
    frame = 0.0, 1.02 * estimate.duration / second
    final = _result(estimate, estimate.duration / second, f"result, {percent} interval")
    return Panel(
        title=f"Running estimate: {estimate.verdict}",
        x=Axis(label=f"Time since the first sample [{unit}]", limits=frame),
        y=Axis(label="Earth rate [deg/h]", limits=_settled(estimate, time, (rate, pairs), wide * sd)),
        curves=(*curves, *final, known_rate(estimate.earth_rate, frame)),
        height=0.4,
        key="above",
    )


def _result(estimate: EarthRateEstimate, x: float, label: str) -> list[Curve]:
    ends = (estimate.rate, *estimate.interval)
    if not all(map(math.isfinite, ends)):
        return []
    y, low, high = (array([v]) / DEG_H for v in ends)
    return [
        Curve(
            x=array([x]),
            y=y,
            lower=low,
            upper=high,
            bars=True,
            label=label,
            colour="ink",
            style="none",
            marker="diamond",
        )
    ]


def _settled(
    estimate: EarthRateEstimate, time: Array, lines: tuple[Array, Array], half: Array
) -> tuple[float, float]:
    """Limits that hold the known rate, the result, and everything after the first part of the record.

    The first dwells know next to nothing: their band runs out of the frame.
    """
    late = time >= _SETTLED * time[-1] if time.size else np.zeros(0, dtype=np.bool_)
    parts = [array([estimate.earth_rate, estimate.rate, *estimate.interval]) / DEG_H]
    parts += [line[late] for line in lines] + [(lines[0] + sign * half)[late] for sign in (-1, 1)]
    return around(*parts)


# -- dwells -----------------------------------------------------------------------------------------------


def dwell_panels(estimate: EarthRateEstimate) -> tuple[Panel, Panel]:
    """Means of the dwells less the level of the record, and what the fit leaves of them."""
    base = np.nan_to_num(estimate.bias[0]) / DEG_H
    expected = estimate.component.expected / DEG_H
    means = _dwell_curves(estimate, "mean", base)
    left = _dwell_curves(estimate, "residual", 0.0)
    unit, second = clock(estimate.duration)
    frame = 0.0, estimate.duration / second
    x = Axis(label=f"Time since the first sample [{unit}]", limits=frame)
    alone = Curve(
        x=array([*frame, math.nan, *frame]),
        y=array([expected, expected, math.nan, -expected, -expected]),
        label="the Earth alone",
        colour="ink",
        style="dashed",
    )
    return (
        Panel(
            title=f"Means of the dwells, less the level of {number(base, 5)} deg/h".replace("-", "−"),
            x=x,
            y=Axis(label="Mean [deg/h]", limits=_bars(means, array([-expected, expected]))),
            curves=(*means, alone),
            height=0.34,
            key="above",
        ),
        Panel(
            title="Residuals without level and Earth rate: noise and drift",
            x=x,
            y=Axis(label="Residual [deg/h]", limits=_bars(left, array([0.0]))),
            curves=left,
            labels=(Label(x=0.0, y=0.0, text="", colour="ink", place="level"),),
            height=0.26,
            key="above",
        ),
    )


def _dwell_curves(
    estimate: EarthRateEstimate, what: Literal["mean", "residual"], level: float
) -> tuple[Curve, ...]:
    _, second = clock(estimate.duration)
    curves = []
    for sign, colour, marker in _LOOKS:
        name = direction_of(estimate.first, sign, "direction not known")
        dwells = [d for d in estimate.dwells if d.sign == sign and math.isfinite(getattr(d, what))]
        if not dwells:
            continue
        y = array([getattr(d, what) for d in dwells]) / DEG_H - level
        sd = array([d.sd for d in dwells]) / DEG_H
        curves.append(
            Curve(
                x=array([(d.start + d.stop) / 2 for d in dwells]) / second,
                y=y,
                lower=y - sd,
                upper=y + sd,
                bars=True,
                label=f"{name}, ± 1 sd of white noise",
                colour=colour,
                style="none",
                marker=marker,
            )
        )
    return tuple(curves)


def _bars(curves: tuple[Curve, ...], others: Array) -> tuple[float, float]:
    ends = [end for c in curves for end in (c.lower, c.upper) if end is not None]
    return around(others, *ends)


# -- other ways -------------------------------------------------------------------------------------------


def dead_time_panel(estimate: EarthRateEstimate) -> Panel:
    """The estimate for other times left out after each turn: it may wander by the noise of what is left out alone."""
    wide = quantile(estimate.confidence)
    dead, rate, sd = estimate.dead_times[:, 0], *(estimate.dead_times[:, 1:] / DEG_H).T
    used = estimate.reversals.dead_time
    low, high = rate - wide * sd, rate + wide * sd
    curves = [
        Curve(
            x=dead,
            y=rate,
            lower=low,
            upper=high,
            bars=True,
            style="thin",
            marker="circle",
            colour="sky",
            label="regression",
        )
    ]
    at = dead == used
    if at.any():
        curves.append(
            Curve(
                x=dead[at],
                y=rate[at],
                lower=low[at],
                upper=high[at],
                bars=True,
                style="none",
                marker="diamond",
                colour="ink",
                label=f"{used:g} s, as used",
            )
        )
    frame = around(dead, [0.0], room=0.06)
    known = estimate.earth_rate / DEG_H
    return Panel(
        title="Estimate against dead time",
        x=Axis(label="Left out after each turn [s]", limits=frame),
        y=Axis(
            label="Earth rate [deg/h]",
            limits=around([known], low, high, room=0.12),
        ),
        curves=(*curves, known_rate(estimate.earth_rate, frame)),
        height=0.3,
        key="above",
    )


def estimator_panel(estimate: EarthRateEstimate) -> Panel:
    """Pairs, three dwells at a time, and regression side by side."""
    wide = quantile(estimate.confidence)
    percent = f"{100 * estimate.confidence:g} %"
    names = [r.name for r in estimate.readings]
    points: list[tuple[float, float, float]] = []
    scatters: list[tuple[float, float, float]] = []
    for i, reading in enumerate(estimate.readings):
        points.append((i, reading.rate / DEG_H, wide * reading.sd / DEG_H))
        if reading.scatter is not None:
            scatters.append((i + 0.14, reading.rate / DEG_H, wide * reading.scatter / DEG_H))
    curves = [_points(points, f"{percent} by the noise model", "orange", "square")] if points else []
    curves += [_points(scatters, f"{percent} by their own scatter", "sky", "triangle")] if scatters else []
    result = _result(estimate, float(len(names)), _text(estimate))
    ends = [end for c in (*curves, *result) for end in (c.lower, c.upper) if end is not None]
    known = array([estimate.earth_rate / DEG_H])
    ticks = [*names, "regression"]
    frame = -0.6, len(names) + 0.6
    return Panel(
        title="Three estimators for the same dwells",
        x=Axis(label="", limits=frame, names=tuple(enumerate(ticks))),
        y=Axis(label="Earth rate [deg/h]", limits=around(known, *ends, room=0.12)),
        curves=(*curves, *result, known_rate(estimate.earth_rate, frame)),
        height=0.3,
        key="above",
    )


def open_panel(estimate: EarthRateEstimate) -> Panel:
    """Without reversals: the bias that the record leaves for each direction that the axis may have had."""
    base, sd = (v / DEG_H for v in estimate.bias)
    expected = estimate.component.expected / DEG_H
    half = quantile(estimate.confidence) * sd
    plus, minus = sides_of(estimate.first)
    poses = [(-expected, f"if the axis pointed {plus}"), (0.0, "east or west"), (expected, minus)]
    if is_vertical(estimate.first):
        del poses[1]
    y = base + array([change for change, _ in poses])
    percent = f"{100 * estimate.confidence:g} %"
    curve = Curve(
        x=np.arange(float(len(poses))),
        y=y,
        lower=y - half,
        upper=y + half,
        bars=True,
        label=f"bias under the known rate, {percent} interval",
        colour="z",
        style="none",
        marker="circle",
    )
    names = tuple((i, words) for i, (_, words) in enumerate(poses))
    return Panel(
        title="Without reversals rate and bias are a single constant",
        x=Axis(label="", limits=(-0.5, len(poses) - 0.5), names=names),
        y=Axis(label="Bias [deg/h]", limits=around(y - half, y + half, [0.0], room=0.12)),
        curves=(curve,),
        labels=(Label(x=0.0, y=0.0, text="", colour="guide", place="level"),),
        height=0.34,
        key="above",
    )


def _points(rows: list[tuple[float, float, float]], label: str, colour: str, marker: str) -> Curve:
    x, y, half = array(rows).T
    return Curve(
        x=x,
        y=y,
        lower=y - half,
        upper=y + half,
        label=label,
        colour=colour,
        marker=marker,
        style="none",
        bars=True,
    )


def _text(estimate: EarthRateEstimate) -> str:
    value, low, high = interval(*(v / DEG_H for v in (estimate.rate, *estimate.interval)))
    return f"result {value} deg/h [{low}, {high}]"
