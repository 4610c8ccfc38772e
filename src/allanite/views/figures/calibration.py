# SPDX-License-Identifier: BSD-3-Clause
"""A self-calibration: where the unit was held, what the fit leaves there, and how well each parameter is known."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from allanite.experiments.calibration import CalibrationEstimate, CalibrationPosition
from allanite.experiments.calibration.orientations import ORIENTATIONS
from allanite.experiments.calibration.verdict import ParameterStatus
from allanite.recording.calibration import AXES
from allanite.recording.records import Recording
from allanite.study.result_document import Overview
from allanite.views.figures.correlation import correlation_panel
from allanite.views.figures.earth import DEG_H, quantile
from allanite.views.figures.panel import MARKERS, Array, Axis, Curve, Panel, around, array
from allanite.views.figures.sphere import Spot, SpotKind, sphere_panel
from allanite.views.figures.static import level_panels, overviews_of, record_panels
from allanite.views.wording.calibration import (
    ParameterGroup,
    calibration_name,
    parameter_groups,
    rest_unit,
    sensor_words,
)

__all__ = [
    "VIEWS",
    "correlation_panels",
    "log_panels",
    "parameter_panels",
    "residual_panels",
    "sphere_panels",
]

VIEWS = ("whole", "sphere", "residuals", "parameters", "correlation", "log")
_APART = 0.2  # of a position, between its three axes
_MOST_NAMED = 40  # positions that have a tick each
_BESIDE = 3  # panels side by side
_NOTHING = np.full(3, np.nan)


# -- positions --------------------------------------------------------------------------------------------


def sphere_panels(result: CalibrationEstimate) -> list[Panel]:
    """The positions on the sphere, with those that should be added."""
    oriented = [p for p in result.positions if np.isfinite(p.up).all()]
    spots = [Spot(up=_direction(p.up), label=str(p.number), kind=_kind(p)) for p in oriented]
    proposed = [
        Spot(up=_direction(ORIENTATIONS[words]), kind="proposed")
        for words in result.add
        if words in ORIENTATIONS
    ]
    return [sphere_panel([*spots, *proposed], words={"proposed": "to be added"})] if spots else []


def _direction(up: Iterable[float]) -> tuple[float, float, float]:
    x, y, z = map(float, up)
    return x, y, z


def _kind(position: CalibrationPosition) -> SpotKind:
    return "outlier" if position.outlier else "used" if position.used else "left out"


def log_panels(result: CalibrationEstimate, recording: Recording | Sequence[Overview] | None) -> list[Panel]:
    """The log with the rests in it; nothing of rows of means."""
    spans = result.static_spans
    if spans is None:
        return []
    return [*level_panels(spans), *record_panels(spans, overviews_of(spans, recording))]


# -- residuals --------------------------------------------------------------------------------------------


def residual_panels(result: CalibrationEstimate) -> list[Panel]:
    """What the calibrated sensors read too much at each position, what is left of each turn, and the misfits."""
    panels = []
    if any(p.excess is not None for p in result.positions):
        panels.append(_force_panel(result))
    if any(p.rate is not None for p in result.positions):
        panels.append(_rate_panel(result))
    if any(t.used for t in result.turns):
        panels.append(_turn_panel(result))
    if any(math.isfinite(p.misfit) for p in result.positions):
        panels.append(_misfit_panel(result))
    return panels


def _force_panel(result: CalibrationEstimate) -> Panel:
    """Length of the specific force less gravity, with the band that the noise and the scatter allow."""
    unit, size = rest_unit(result)
    at = array([p.number for p in result.positions])
    value = array([p.excess for p in result.positions]) / size
    half = quantile(result.confidence) * array([p.excess_sd for p in result.positions]) / size
    return Panel(
        title="Accelerometers at rest: |f| less g",
        x=_numbered(result),
        y=Axis(label=f"|f| − g [{unit}]", limits=around([0.0], value, half, -half)),
        curves=(_band(at, half, result), *_marked(result.positions, at, value)),
        height=0.3,
        key="above",
    )


def _rate_panel(result: CalibrationEstimate) -> Panel:
    """What is left of the rates of the three gyros, less the Earth's."""
    at = array([p.number for p in result.positions])
    rate, sd = (
        np.stack([_NOTHING if value is None else value for value in values]) / DEG_H
        for values in ([p.rate for p in result.positions], [p.rate_sd for p in result.positions])
    )
    half = quantile(result.confidence) * _largest(sd)
    return Panel(
        title="Gyros at rest: rate less the Earth's",
        x=_numbered(result),
        y=Axis(label="Rate [deg/h]", limits=around([0.0], rate, half, -half)),
        curves=(_band(at, half, result), *_axes(at, rate)),
        height=0.3,
        key="above",
    )


def _turn_panel(result: CalibrationEstimate) -> Panel:
    """What is left between the integrated rates and the attitudes, at the middle between two positions."""
    turns = [t for t in result.turns if t.used]
    at = array([0.5 * (t.before + t.after) for t in turns])
    residual = np.stack([t.residual for t in turns]) * 1e3
    return Panel(
        title="Turns: integrated rates less the attitudes before and after",
        x=_numbered(result),
        y=Axis(label="Rotation [mrad]", limits=around([0.0], residual)),
        curves=(_level(result), *_axes(at, residual)),
        height=0.3,
        key="above",
    )


def _misfit_panel(result: CalibrationEstimate) -> Panel:
    """Deletion residuals: a position that contradicts all others stands out."""
    at, value = array([p.number for p in result.positions]), array([p.misfit for p in result.positions])
    turns = [t for t in result.turns if t.used]
    between = array([0.5 * (t.before + t.after) for t in turns])
    left = array([t.misfit for t in turns])
    look: dict[str, Any] = {"style": "none", "marker": "triangle", "colour": "y"}
    beside = (Curve(x=between, y=left, label="turn", **look),) if turns else ()
    one = np.ones(2)
    expected = Curve(x=_ends(result), y=one, label="expected", colour="guide", style="dashed")
    _, high = around([0.0, 2.0], value, left)
    return Panel(
        title="Misfit: distance from the prediction of the others",
        x=_numbered(result),
        y=Axis(label="Standard deviations", limits=(0.0, high)),
        curves=(*_marked(result.positions, at, value), *beside, expected),
        height=0.3,
        key="above",
    )


def _marked(positions: Sequence[CalibrationPosition], at: Array, value: Array) -> list[Curve]:
    """Points of positions, told apart as on the sphere: used, outliers, left out."""
    kinds = np.where(np.isfinite(value), [_kind(p) for p in positions], "")
    looks = (("used", "position", "z", "circle"), ("outlier", "outlier", "x", "diamond"))
    curves = [
        Curve(x=at[here], y=value[here], label=label, colour=colour, style="none", marker=marker)
        for kind, label, colour, marker in looks
        if (here := kinds == kind).any()
    ]
    if (here := kinds == "left out").any():
        look: dict[str, Any] = {"style": "none", "marker": "circle", "colour": "guide"}
        hollow = np.ones(int(here.sum()), dtype=np.bool_)
        curves.append(
            Curve(x=at[here], y=value[here], label="", hollow=hollow, hollow_label="left out", **look)
        )
    return curves


def _axes(at: Array, values: Array) -> list[Curve]:
    """The three axes beside one another, each with its colour and mark."""
    return [
        Curve(
            x=at + _APART * (i - 1), y=values[:, i], label=axis, colour=axis, style="none", marker=MARKERS[i]
        )
        for i, axis in enumerate(AXES)
    ]


def _band(at: Array, half: Array, result: CalibrationEstimate) -> Curve:
    """What is expected of a position, as a step over its place."""
    percent = f"{100 * result.confidence:g} %"
    x = np.column_stack([at - 0.5, at + 0.5]).ravel()
    y = np.repeat(half, 2)
    return Curve(
        x=x,
        y=np.zeros(x.size),
        lower=-y,
        upper=y,
        label="",
        colour="guide",
        style="thin",
        band_label=f"expected, {percent}",
    )


def _level(result: CalibrationEstimate) -> Curve:
    return Curve(x=_ends(result), y=np.zeros(2), label="", colour="guide", style="thin")


def _ends(result: CalibrationEstimate) -> Array:
    numbers = [p.number for p in result.positions]
    return array([min(numbers) - 0.7, max(numbers) + 0.7])


def _numbered(result: CalibrationEstimate) -> Axis:
    """Positions by their numbers, each with a tick where there is room."""
    numbers = [p.number for p in result.positions]
    step = math.ceil(len(numbers) / _MOST_NAMED)
    names = tuple((float(n), str(n)) for n in numbers[::step])
    low, high = _ends(result).tolist()
    return Axis(label="Position", limits=(low, high), names=names)


def _largest(rows: Array) -> Array:
    """Of each row; NaN where it has no number."""
    return np.asarray(np.fmax.reduce(rows, axis=1))


# -- parameters -------------------------------------------------------------------------------------------


def parameter_panels(result: CalibrationEstimate) -> list[tuple[Panel, ...]]:
    """The parameters with their intervals: rows for each triad, a panel for each kind."""
    groups = parameter_groups(result.parameters)
    confidence = f"{100 * result.confidence:g} % interval"
    rows: list[tuple[Panel, ...]] = []
    for sensor in dict.fromkeys(group.sensor for group in groups):
        panels = [_parameter_panel(group, confidence) for group in groups if group.sensor == sensor]
        rows += [tuple(panels[i : i + _BESIDE]) for i in range(0, len(panels), _BESIDE)]
    return rows


def _parameter_panel(group: ParameterGroup, confidence: str) -> Panel:
    at = array(range(len(group.lines)))
    value, low, high = (array([getattr(line, part) for line in group.lines]) for part in ("x", "low", "high"))
    known = np.array([line.estimated for line in group.lines])
    frame = _framed(value, low, high, known)
    look: dict[str, Any] = {"style": "none", "bars": True}
    kinds = (
        (known, f"estimated, {confidence}", "z", "circle"),
        (~known, "not observable: assumed", "limit", "diamond"),
    )
    curves = [
        Curve(
            x=at[here],
            y=value[here],
            lower=low[here],
            upper=high[here],
            label=label,
            colour=colour,
            marker=marker,
            **look,
        )
        for here, label, colour, marker in kinds
        if here.any()
    ]
    return Panel(
        title=f"{sensor_words(group.sensor)}: {group.name.lower()} [{group.unit}]",
        x=Axis(
            label="",
            limits=(-0.6, len(group.lines) - 0.4),
            names=tuple((float(i), line.name) for i, line in enumerate(group.lines)),
        ),
        y=Axis(label="", limits=frame),
        curves=tuple(curves),
        height=0.62,
    )


def _framed(value: Array, low: Array, high: Array, known: Any) -> tuple[float, float]:
    """Limits around what was estimated: the bar of what was only assumed may run out of the frame."""
    chosen = known if known.any() else ~known
    return around(value, low[chosen], high[chosen], room=0.15)


def correlation_panels(result: CalibrationEstimate) -> list[Panel]:
    """Correlations of what was estimated."""
    kept = [i for i, p in enumerate(result.parameters) if p.status is ParameterStatus.ESTIMATED]
    if len(kept) < 2:
        return []
    names = [calibration_name(result.parameters[i].name) for i in kept]
    matrix = result.correlation[np.ix_(kept, kept)]
    return [correlation_panel(names, matrix, title="Correlations of the estimated parameters")]
