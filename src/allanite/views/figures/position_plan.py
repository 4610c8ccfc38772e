# SPDX-License-Identifier: BSD-3-Clause
"""A plan of positions: where they lie on the sphere, and what the length of the record makes of them."""

from __future__ import annotations

import numpy as np

from allanite.experiments.position_planning import PositionPlan
from allanite.quantities.number_words import duration
from allanite.views.figures.panel import MARKERS, SERIES, Array, Axis, Curve, Label, Panel, positive_range
from allanite.views.figures.sphere import Spot, sphere_panel

__all__ = ["VIEWS", "length_panel", "scheme_panel", "sphere_panels"]

VIEWS = ("whole", "sphere", "length", "schemes")
#: Schemes that never come nearer to their goals than this are left out: they do not determine something.
_FAR = 30.0
_LANDMARKS = ((60.0, "1 min"), (600.0, "10 min"), (3600.0, "1 h"), (21600.0, "6 h"))


def sphere_panels(plan: PositionPlan) -> list[Panel]:
    """Which way is up in each position; nothing for headings, which are all upright."""
    if plan.what != "calibration":
        return []
    spots = [Spot(up=p.up, label=str(p.number)) for p in plan.positions]
    return [sphere_panel(spots, title="Direction of up, in the axes of the sensor, in this order")]


def length_panel(plan: PositionPlan) -> Panel:
    """Standard deviation of each kind over its goal, by length of record."""
    curves = []
    for i, name in enumerate(plan.groups):
        goal = _goal(plan, name)
        if goal is not None and np.isfinite(plan.running[:, i]).any():
            curves.append(
                Curve(
                    x=plan.totals,
                    y=_known(plan.running[:, i] / goal),
                    label=name.replace(".", ": "),
                    colour=SERIES[i % 6],
                    marker=MARKERS[i % 6],
                )
            )
    return _against_length(plan, "Largest standard deviation of each kind", curves)


def scheme_panel(plan: PositionPlan) -> Panel:
    """The plan beside the usual schemes."""
    curves = [
        Curve(
            x=plan.totals,
            y=_known(values),
            label=name,
            colour=SERIES[2] if i == 0 else SERIES[(3, 4, 5, 0)[(i - 1) % 4]],
            style="solid" if i == 0 else "dashed",
            marker=MARKERS[i % 6],
        )
        for i, (name, values) in enumerate(plan.compared.items())
        if np.nanmin(_known(values), initial=np.inf) < _FAR
    ]
    return _against_length(plan, "This plan and other schemes", curves)


def _known(values: Array) -> Array:
    """What is infinite is not drawn."""
    return np.where(np.isfinite(values), values, np.nan)


def _goal(plan: PositionPlan, group: str) -> float | None:
    """The strictest of a kind."""
    values = [goal for key, goal in plan.goals.items() if key == group or key.rpartition("_")[0] == group]
    return min(values) if values else None


def _against_length(plan: PositionPlan, title: str, curves: list[Curve]) -> Panel:
    x, y = plan.totals, positive_range(*(c.y for c in curves), [1.0])
    ends = min(0.8 * float(x.min()), 0.8 * plan.total), float(x.max())
    marks = tuple((t, words) for t, words in _LANDMARKS if ends[0] < t < ends[1])
    planned = f"the plan, {duration(plan.total)}"
    return Panel(
        title=title,
        x=Axis(label="Length of the record [s]", log=True, limits=ends, landmarks=marks),
        y=Axis(label="Standard deviation over its goal", log=True, limits=(y[0] / 1.5, y[1] * 1.6)),
        curves=tuple(curves),
        labels=(
            Label(x=ends[0], y=1.0, text="goal", colour="guide", side="above right", place="level"),
            Label(x=plan.total, y=y[0], text=planned, colour="ink", side="above right", place="line"),
        ),
        height=0.44,
        key="above",
    )
