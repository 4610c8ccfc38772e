# SPDX-License-Identifier: BSD-3-Clause
"""A control chart: every log with its interval between limits of its own, and the weighted mean below."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.quantities.display_units import coefficient_unit
from allanite.stability.fleet.charts import ControlChart
from allanite.stability.fleet.control_rules import ControlRule
from allanite.views.figures.panel import Axis, Curve, Label, Panel, around, level, positive_range

__all__ = ["VIEWS", "individuals_panel", "weighted_panel"]

VIEWS = ("whole", "individuals", "ewma")


def individuals_panel(result: ControlChart) -> Panel:
    """The points, their limits, and those at which a rule signals."""
    unit, factor = coefficient_unit(result.kind, result.symbol, result.unit_of_measure)
    x = _places(result)
    ends = _ends(x)
    signalled = _signalled(result, weighted=False)
    curves = [
        Curve(
            x=x,
            y=np.full(len(x), result.center.value / factor),
            lower=result.low / factor,
            upper=result.high / factor,
            label="center",
            band_label="three standard deviations",
            colour="guide",
            style="dashed",
        ),
        _points(x, result, ~signalled, factor, "log, with its interval", "z"),
        _points(x, result, signalled, factor, "log at which a rule signals", "x"),
    ]
    low, high = positive_range(
        result.lower / factor, result.upper / factor, result.low / factor, result.high / factor
    )
    return Panel(
        title=f"{result.symbol} of {result.channel}: individuals",
        x=_axis(result, ends),
        y=Axis(label=f"{result.symbol} [{unit}]", log=True, limits=(low / 1.05, 1.05 * high)),
        curves=tuple(c for c in curves if len(c.x)),
        labels=_second_phase(result, x),
        height=0.4,
        key="above",
    )


def weighted_panel(result: ControlChart) -> Panel:
    """The exponentially weighted mean."""
    x = _places(result)
    ends = _ends(x)
    signalled = _signalled(result, weighted=True)
    limit = result.mean_limit
    curves = [
        Curve(
            x=x, y=np.zeros(len(x)), lower=-limit, upper=limit, label="", band_label="limits", colour="guide",
            style="none",
        ),
        Curve(x=x, y=result.mean, label="weighted mean", colour="z", marker="circle", style="solid"),
        Curve(
            x=x[signalled], y=result.mean[signalled], label="beyond the limits", colour="x", marker="cross",
            style="none",
        ),
        level(ends, 0.0, "center"),
    ]  # fmt: skip
    return Panel(
        title=f"{result.symbol} of {result.channel}: weighted mean",
        x=_axis(result, ends),
        y=Axis(label="Standard deviations", limits=around(result.mean, limit, -limit)),
        curves=tuple(c for c in curves if len(c.x)),
        labels=_second_phase(result, x),
        height=0.3,
        key="above",
    )


def _places(result: ControlChart) -> NDArray[np.float64]:
    return result.dates if result.by_date else np.arange(1.0, len(result.logs) + 1)


def _ends(x: NDArray[np.float64]) -> tuple[float, float]:
    return around(x, room=0.02)


def _axis(result: ControlChart, ends: tuple[float, float]) -> Axis:
    return Axis(label="Date [year]" if result.by_date else "Log", limits=ends)


def _signalled(result: ControlChart, *, weighted: bool) -> NDArray[np.bool_]:
    at = [s.number - 1 for s in result.signals if (s.rule is ControlRule.EWMA) is weighted]
    marks = np.zeros(len(result.logs), dtype=bool)
    marks[at] = True
    return marks


def _points(
    x: NDArray[np.float64],
    result: ControlChart,
    chosen: NDArray[np.bool_],
    factor: float,
    label: str,
    colour: str,
) -> Curve:
    value, low, high = (end[chosen] / factor for end in (result.value, result.lower, result.upper))
    return Curve(
        x=x[chosen], y=value, lower=low, upper=high, bars=True, style="none", marker="circle", label=label,
        colour=colour,
    )  # fmt: skip


def _second_phase(result: ControlChart, x: NDArray[np.float64]) -> tuple[Label, ...]:
    if result.first >= len(x):
        return ()
    return (
        Label(
            x=float(x[result.first]), y=0.0, text="phase II", colour="guide", side="above right", place="line"
        ),
    )
