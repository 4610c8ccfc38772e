# SPDX-License-Identifier: BSD-3-Clause
"""A plan of positions: where they lie on the sphere, and what the length of the record makes of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from allanite.views.figures.panel import MARKERS, SERIES, Axis, Curve, Label, Panel, array, positive_range
from allanite.views.figures.sphere import Spot, sphere_panel
from allanite.views.wording import duration

__all__ = ["VIEWS", "length_panel", "scheme_panel", "sphere_panels"]

Json = Mapping[str, Any]

VIEWS = ("whole", "sphere", "length", "schemes")
#: Schemes that never come nearer to their goals than this are left out: they do not determine something.
_FAR = 30.0
_LANDMARKS = ((60.0, "1 min"), (600.0, "10 min"), (3600.0, "1 h"), (21600.0, "6 h"))


def sphere_panels(document: Json) -> list[Panel]:
    """Which way is up in each position; nothing for headings, which are all upright."""
    if document["what"] != "calibration":
        return []
    spots = [Spot(up=tuple(p["up"]), label=str(p["number"])) for p in document["positions"]]
    return [sphere_panel(spots, title="Which way is up, in the axes of the sensor, in this order")]


def length_panel(document: Json) -> Panel:
    """Standard deviation of each kind over its goal, by length of record."""
    totals, running = array(document["totals"]), array(document["running"])
    curves = []
    for i, name in enumerate(document["groups"]):
        goal = _goal(document["goals"], name)
        if goal is not None and np.isfinite(running[:, i]).any():
            curves.append(
                Curve(
                    x=totals, y=running[:, i] / goal, label=name.replace(".", ": "), colour=SERIES[i % 6],
                    marker=MARKERS[i % 6],
                )
            )  # fmt: skip
    return _against_length(document, "Largest standard deviation of each kind", curves)


def scheme_panel(document: Json) -> Panel:
    """The plan beside the usual schemes."""
    totals = array(document["totals"])
    curves = [
        Curve(
            x=totals,
            y=array(values),
            label=name,
            colour=SERIES[2] if i == 0 else SERIES[(3, 4, 5, 0)[(i - 1) % 4]],
            style="solid" if i == 0 else "dashed",
            marker=MARKERS[i % 6],
        )
        for i, (name, values) in enumerate(document["compared"].items())
        if np.nanmin(array(values), initial=np.inf) < _FAR
    ]
    return _against_length(document, "This plan and other schemes", curves)


def _goal(goals: Json, group: str) -> float | None:
    """The strictest of a kind."""
    values = [goal for key, goal in goals.items() if key == group or key.rpartition("_")[0] == group]
    return min(values) if values else None


def _against_length(document: Json, title: str, curves: list[Curve]) -> Panel:
    x, y = array(document["totals"]), positive_range(*(c.y for c in curves), [1.0])
    ends = min(0.8 * float(x.min()), 0.8 * document["total"]), float(x.max())
    marks = tuple((t, words) for t, words in _LANDMARKS if ends[0] < t < ends[1])
    return Panel(
        title=title,
        x=Axis(label="Length of the record [s]", log=True, limits=ends, landmarks=marks),
        y=Axis(label="Standard deviation over its goal", log=True, limits=(y[0] / 1.5, y[1] * 1.6)),
        curves=tuple(curves),
        labels=(
            Label(x=ends[0], y=1.0, text="goal", colour="guide", side="above right", place="level"),
            Label(
                x=document["total"], y=y[0], text=f"the plan, {duration(document['total'])}", colour="ink",
                side="above right", place="line",
            ),
        ),
        height=0.44,
        key="above",
    )  # fmt: skip
