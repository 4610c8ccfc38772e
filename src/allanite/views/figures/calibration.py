# SPDX-License-Identifier: BSD-3-Clause
"""A self-calibration: where the unit was held, what the fit leaves there, and how well each parameter is known.

Everything is drawn from the plain document of a `CalibrationEstimate`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from allanite.experiments.calibration.orientations import ORIENTATIONS
from allanite.views.figures.correlation import correlation_panel
from allanite.views.figures.earth import DEG_H, quantile
from allanite.views.figures.panel import MARKERS, Array, Axis, Curve, Panel, around, array
from allanite.views.figures.sphere import Spot, sphere_panel
from allanite.views.wording import calibration_name, parameter_groups, rest_unit, sensor_words
from allanite.views.wording.calibration import ParameterGroup

__all__ = ["VIEWS", "correlation_panels", "parameter_panels", "residual_panels", "sphere_panels"]

Json = Mapping[str, Any]

VIEWS = ("whole", "sphere", "residuals", "parameters", "correlation")
_AXES = "xyz"
_APART = 0.2  # of a position, between its three axes
_MOST_NAMED = 40  # positions that have a tick each
_BESIDE = 3  # panels side by side


# -- positions --------------------------------------------------------------------------------------------


def sphere_panels(document: Json) -> list[Panel]:
    """The positions on the sphere, with those that should be added."""
    oriented = [p for p in document["positions"] if None not in p["up"]]
    spots = [Spot(up=tuple(p["up"]), label=str(p["number"]), kind=_kind(p)) for p in oriented]
    words = {"proposed": "to be added"}
    return [sphere_panel([*spots, *_proposed(document["add"])], words=words)] if spots else []


def _proposed(words: Sequence[str]) -> list[Spot]:
    """Positions that are asked for in words."""
    known = sorted(
        ORIENTATIONS.items(), key=lambda entry: -len(entry[0])
    )  # "on an edge, +x and +y up" before "y up"
    directions = [next((up for name, up in known if name in text), None) for text in words]
    return [Spot(up=(float(x), float(y), float(z)), kind="proposed") for x, y, z in filter(None, directions)]


def _kind(position: Json) -> Any:
    return "outlier" if position["outlier"] else "used" if position["used"] else "left out"


# -- residuals --------------------------------------------------------------------------------------------


def residual_panels(document: Json) -> list[Panel]:
    """What the calibrated sensors read too much at each position, what is left of each turn, and the misfits."""
    positions = document["positions"]
    panels = []
    if any(p["excess"] is not None for p in positions):
        panels.append(_force_panel(document))
    if any(p["rate"] is not None for p in positions):
        panels.append(_rate_panel(document))
    if any(t["used"] for t in document["turns"]):
        panels.append(_turn_panel(document))
    if any(p["misfit"] is not None for p in positions):
        panels.append(_misfit_panel(document))
    return panels


def _force_panel(document: Json) -> Panel:
    """Length of the specific force less gravity, with the band that the noise and the scatter allow."""
    unit, size = rest_unit(document)
    at, value, sd = _series(document["positions"], "excess", "excess_sd", size)
    half = quantile(document["confidence"]) * sd
    return Panel(
        title="Accelerometers at rest: how far |f| is from g",
        x=_numbered(document),
        y=Axis(label=f"|f| − g [{unit}]", limits=around([0.0], value, half, -half)),
        curves=(_band(at, half, document), *_marked(document["positions"], at, value)),
        height=0.3,
        key="above",
    )


def _rate_panel(document: Json) -> Panel:
    """What is left of the rates of the three gyros, less the Earth's."""
    rows = document["positions"]
    at = array([p["number"] for p in rows])
    rate, sd = (array([p[k] or [None] * 3 for p in rows]) / DEG_H for k in ("rate", "rate_sd"))
    half = quantile(document["confidence"]) * _largest(sd)
    return Panel(
        title="Gyros at rest: rate less the Earth's",
        x=_numbered(document),
        y=Axis(label="Rate [deg/h]", limits=around([0.0], rate, half, -half)),
        curves=(_band(at, half, document), *_axes(at, rate)),
        height=0.3,
        key="above",
    )


def _turn_panel(document: Json) -> Panel:
    """What is left between the integrated rates and the attitudes, at the middle between two positions."""
    rows = [t for t in document["turns"] if t["used"]]
    at = array([0.5 * (t["before"] + t["after"]) for t in rows])
    residual = array([t["residual"] or [None] * 3 for t in rows]) * 1e3
    return Panel(
        title="Turns: integrated rates less the attitudes before and after",
        x=_numbered(document),
        y=Axis(label="Rotation [mrad]", limits=around([0.0], residual)),
        curves=(_level(document), *_axes(at, residual)),
        height=0.3,
        key="above",
    )


def _misfit_panel(document: Json) -> Panel:
    """Deletion residuals: a position that contradicts all others stands out."""
    rows = document["positions"]
    at, value = (array([p[k] for p in rows]) for k in ("number", "misfit"))
    turns = [t for t in document["turns"] if t["used"]]
    between = array([0.5 * (t["before"] + t["after"]) for t in turns])
    left = array([t["misfit"] for t in turns])
    look: dict[str, Any] = {"style": "none", "marker": "triangle", "colour": "y"}
    beside = (Curve(x=between, y=left, label="turn", **look),) if turns else ()
    one = np.ones(2)
    expected = Curve(x=_ends(document), y=one, label="expected", colour="guide", style="dashed")
    _, high = around([0.0, 2.0], value, left)
    return Panel(
        title="Misfit: distance from what all others predict",
        x=_numbered(document),
        y=Axis(label="Standard deviations", limits=(0.0, high)),
        curves=(*_marked(rows, at, value), *beside, expected),
        height=0.3,
        key="above",
    )


def _marked(rows: Sequence[Json], at: Array, value: Array) -> list[Curve]:
    """Points of positions, told apart as on the sphere: used, outliers, left out."""
    kinds = np.where(np.isfinite(value), [_kind(p) for p in rows], "")
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
        for i, axis in enumerate(_AXES)
    ]


def _band(at: Array, half: Array, document: Json) -> Curve:
    """What is expected of a position, as a step over its place."""
    percent = f"{100 * document['confidence']:g} %"
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


def _level(document: Json) -> Curve:
    return Curve(x=_ends(document), y=np.zeros(2), label="", colour="guide", style="thin")


def _ends(document: Json) -> Array:
    numbers = [p["number"] for p in document["positions"]]
    return array([min(numbers) - 0.7, max(numbers) + 0.7])


def _numbered(document: Json) -> Axis:
    """Positions by their numbers, each with a tick where there is room."""
    numbers = [p["number"] for p in document["positions"]]
    step = math.ceil(len(numbers) / _MOST_NAMED)
    names = tuple((float(n), str(n)) for n in numbers[::step])
    low, high = _ends(document).tolist()
    return Axis(label="Position", limits=(low, high), names=names)


def _series(rows: Sequence[Json], *keys: Any) -> tuple[Array, Array, Array]:
    value, sd, size = keys
    return (
        array([p["number"] for p in rows]),
        array([p[value] for p in rows]) / size,
        array([p[sd] for p in rows]) / size,
    )


def _largest(rows: Array) -> Array:
    """Of each row; NaN where it has no number."""
    return np.asarray(np.fmax.reduce(rows, axis=1))


# -- parameters -------------------------------------------------------------------------------------------


def parameter_panels(document: Json) -> list[tuple[Panel, ...]]:
    """The parameters with their intervals: rows for each triad, a panel for each kind."""
    groups = parameter_groups(document)
    confidence = f"{100 * document['confidence']:g} % interval"
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
        (~known, "not observable: what was assumed", "limit", "diamond"),
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


def correlation_panels(document: Json) -> list[Panel]:
    """Correlations of what was estimated."""
    kept = [i for i, p in enumerate(document["parameters"]) if p["status"] == "estimated"]
    if len(kept) < 2:
        return []
    names = [calibration_name(document["parameters"][i]["name"]) for i in kept]
    matrix = array(document["correlation"])[np.ix_(kept, kept)]
    return [correlation_panel(names, matrix, title="Correlations of the estimated parameters")]
