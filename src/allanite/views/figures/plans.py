# SPDX-License-Identifier: BSD-3-Clause
"""A plan: how well rate or north will be known, against the dwell, for records of several lengths."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from allanite.experiments.planning import Plan
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.number_words import duration
from allanite.views.figures.panel import (
    MARKERS,
    SERIES,
    Array,
    Axis,
    Curve,
    Label,
    Panel,
    positive_range,
)

__all__ = ["dwell_panel", "length_panel"]

_MOST = 6  # lengths of record that are told apart
_LANDMARKS = ((60.0, "1 min"), (600.0, "10 min"), (3600.0, "1 h"), (86400.0, "1 d"), (604800.0, "7 d"))


def dwell_panel(plans: Sequence[Plan]) -> Panel:
    """Standard deviation against dwell, for the lengths of one plan; or for one length and several dead times."""
    first = plans[0]
    curves = _dead_times(plans) if len(plans) > 1 else _lengths(first)
    dwells = positive_range(first.dwells)
    y = positive_range(*(c.y for c in curves), [_goal(first)])
    dead = "no time lost in turning" if not first.dead_time else f"{first.dead_time:g} s lost at each turn"
    many = len(plans) > 1
    title = "By dwell and dead time" if many else f"By dwell, {dead}; filled: the best dwell"
    within = f" in a record of {duration(_middle(first))}" if many else ""
    return Panel(
        title=title,
        x=_time(f"Dwell{within} [s]", dwells),
        y=Axis(label=_quantity(first), log=True, limits=(y[0] / 1.5, y[1] * 1.4)),
        curves=curves,
        labels=(_goal_line(first),),
        height=0.5,
        key="above",
    )


def length_panel(plan: Plan) -> Panel:
    """Standard deviation against the length of the record, each at its best dwell, with and without what is stated."""
    scale = _scale(plan)
    noise, total = (_best(table / scale) for table in (plan.sd, plan.total))
    x = plan.durations
    curves = [Curve(x=x, y=noise, label="by the noise alone, at the best dwell", colour="z", marker="circle")]
    if plan.floor:
        look: dict[str, Any] = {"colour": "x", "style": "dashed", "marker": "square"}
        curves.append(Curve(x=x, y=total, label="with the stated uncertainties", **look))
    labels = [_goal_line(plan)]
    ends = positive_range(x, [plan.duration or math.nan])
    if plan.duration is not None:
        text = f"{duration(plan.duration)} with dwells of {plan.dwell:g} s"
        late = math.log(plan.duration / ends[0]) > 0.6 * math.log(ends[1] / ends[0])
        side = "below left" if late else "above right"
        labels.append(Label(x=plan.duration, y=_goal(plan), text=text, colour="ink", side=side))
    y = positive_range(*(c.y for c in curves), [_goal(plan)])
    return Panel(
        title="By length of the record",
        x=_time("Length of the record [s]", ends),
        y=Axis(label=_quantity(plan), log=True, limits=(y[0] / 1.5, y[1] * 1.6)),
        curves=tuple(curves),
        labels=tuple(labels),
        height=0.5,
        key="above",
    )


# -- curves -----------------------------------------------------------------------------------------------


def _lengths(plan: Plan) -> tuple[Curve, ...]:
    """One curve for each of some lengths; its best dwell is the filled point."""
    table, lengths = plan.total / _scale(plan), plan.durations
    curves = []
    for i, column in enumerate(_spread(np.isfinite(table).any(axis=0))):
        heights = table[:, column]
        curves.append(_curve(plan, heights, f"record of {duration(lengths[column])}", i))
    return tuple(curves)


def _dead_times(plans: Sequence[Plan]) -> tuple[Curve, ...]:
    """One curve for each plan, at the length that stands in the middle of the first."""
    curves = []
    for i, plan in enumerate(plans):
        column = int(np.argmin(np.abs(np.log(plan.durations / _middle(plans[0])))))
        heights = (plan.total / _scale(plan))[:, column]
        curves.append(_curve(plan, heights, f"{plan.dead_time:g} s lost at each turn", i))
    return tuple(curves)


def _curve(plan: Plan, heights: Array, label: str, number_: int) -> Curve:
    heights = np.where(np.isfinite(heights), heights, np.nan)
    best = np.nanargmin(heights) if np.isfinite(heights).any() else -1
    return Curve(
        x=plan.dwells,
        y=heights,
        label=label,
        colour=SERIES[number_ % len(SERIES)],
        marker=MARKERS[number_ % len(MARKERS)],
        hollow=np.arange(heights.size) != best,
        hollow_label="",
    )


def _spread(usable: Any) -> list[int]:
    """Some of the usable columns, evenly chosen, the last one included."""
    columns = np.flatnonzero(usable)
    if columns.size <= _MOST:
        return [int(c) for c in columns]
    places = np.linspace(0, columns.size - 1, _MOST).round().astype(int)
    return [int(columns[p]) for p in places]


def _best(table: Array) -> Array:
    """The smallest of each column; NaN where there is none."""
    lowest = np.where(np.isfinite(table), table, np.inf).min(axis=0)
    return np.where(np.isfinite(lowest), lowest, np.nan)


# -- scales -----------------------------------------------------------------------------------------------


def _scale(plan: Plan) -> float:
    """What one unit of the figure is: a percent of the rate, or a degree."""
    return EARTH_RATE / 100 if plan.what == "rate" else math.radians(1)


def _goal(plan: Plan) -> float:
    return float(100 * plan.goal if plan.what == "rate" else math.degrees(plan.goal))


def _goal_line(plan: Plan) -> Label:
    unit = "%" if plan.what == "rate" else "deg"
    text = f"goal {_goal(plan):.3g} {unit}"
    return Label(x=0.0, y=_goal(plan), text=text, colour="limit", side="below", place="level")


def _quantity(plan: Plan) -> str:
    return f"Standard deviation [{'% of the Earth rate' if plan.what == 'rate' else 'deg of heading'}]"


def _middle(plan: Plan) -> float:
    lengths = plan.durations
    return float(lengths[lengths.size // 2])


def _time(label: str, ends: tuple[float, float]) -> Axis:
    limits = ends[0] / 1.25, ends[1] * 1.25
    marks = tuple(mark for mark in _LANDMARKS if limits[0] < mark[0] < limits[1])
    return Axis(label=label, log=True, limits=limits, landmarks=marks)
