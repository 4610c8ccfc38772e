# SPDX-License-Identifier: BSD-3-Clause
"""Sensors taken apart: deviation of what each has alone and of what they share, and how much they are correlated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from allanite.quantities.display_units import display_unit
from allanite.stability.shared_noise.results import COMMON, NoisePart, Separation
from allanite.views.figures.panel import MARKERS, SERIES, Axis, Curve, Panel, level, positive_range

__all__ = ["VIEWS", "correlation_panel", "part_panel", "parts"]

VIEWS = ("whole", "parts", "correlation")


def parts(result: Separation) -> Mapping[str, Callable[[], Sequence[Panel]]]:
    """Panels by view."""
    return {"parts": lambda: [part_panel(result)], "correlation": lambda: [correlation_panel(result)]}


def part_panel(result: Separation) -> Panel:
    """Own noise of every sensor and the common part, with intervals; a triangle alone is an upper limit."""
    unit, factor = display_unit(result.kind, "adev", result.unit)
    tau, curves, total = result.tau, [], result.total / factor
    for i, name in enumerate(result.channels):
        curves.append(
            Curve(x=tau, y=total[:, i], label=f"{name} as measured", colour=SERIES[i], style="dotted")
        )
    parts = result.parts
    shift = 2.0 ** (0.14 * (np.arange(len(parts)) - (len(parts) - 1) / 2))  # bars side by side
    floor = positive_range(*(p.deviation / factor for p in parts), total)[0] / 5
    for i, part in enumerate(parts):
        common = i == len(parts) - 1
        curves += _curves(part, tau * shift[i], factor, floor, "ink" if common else SERIES[i], MARKERS[i])
    high = positive_range(*(c.y for c in curves), *(c.upper for c in curves if c.upper is not None))[1]
    return Panel(
        title="Allan deviation of every part; a downward triangle is an upper limit",
        x=Axis(label="Averaging time [s]", log=True),
        y=Axis(label=f"Allan deviation [{unit}]", log=True, limits=(floor, 1.6 * high)),
        curves=tuple(curves),
        height=0.56,
        key="above",
    )


def _curves(
    part: NoisePart, tau: np.ndarray[Any, Any], factor: float, floor: float, colour: str, marker: str
) -> list[Curve]:
    """Points with bars where the part is seen; triangles where there is a limit."""
    value, low, high = (v / factor for v in (part.deviation, part.lower, part.upper))
    name = "common part" if part.name == COMMON else f"{part.name} alone"
    known = np.isfinite(value)
    curves = []
    if known.any():
        curves.append(
            Curve(
                x=tau[known], y=value[known], lower=np.maximum(low[known], floor), upper=high[known], bars=True,
                style="none", marker=marker, label=name, colour=colour,
            )
        )  # fmt: skip
    limit = ~known & np.isfinite(high)
    if limit.any():
        curves.append(
            Curve(
                x=tau[limit], y=high[limit], label=f"{name}, upper limit", colour=colour, style="none", marker="down",
            )
        )  # fmt: skip
    return curves


def correlation_panel(result: Separation) -> Panel:
    """Correlation of every pair over the averaging time."""
    tau, r = result.tau, result.correlation
    curves = tuple(
        Curve(x=tau, y=r[:, k], label=f"{first} and {second}", colour=SERIES[k], marker=MARKERS[k])
        for k, (first, second) in enumerate(result.pairs)
    )
    low = float(min(np.nanmin(r), 0.0))
    ends = float(tau.min()) / 1.3, float(tau.max()) * 1.3
    return Panel(
        title="Correlation of the sensors",
        x=Axis(label="Averaging time [s]", log=True, limits=ends),
        y=Axis(label="Correlation", limits=(max(low - 0.1, -1.05), 1.05)),
        curves=(*curves, level(ends, 0.0, "nothing shared")),
        height=0.3,
        key="above",
    )
