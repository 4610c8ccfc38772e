# SPDX-License-Identifier: BSD-3-Clause
"""Innovations of a filter: their size over time and over frequency."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from allanite.filtering.innovations import Innovations
from allanite.views.figures.in_motion import bands_panel
from allanite.views.figures.panel import Axis, Curve, Panel

__all__ = ["VIEWS", "nis_panel", "parts", "ratio_panel"]

VIEWS = ("whole", "nis", "bands")


def parts(result: Innovations) -> Mapping[str, Callable[[], Sequence[Panel]]]:
    """Panels by view; those of bands where the log is long enough."""
    made = {"nis": lambda: [nis_panel(result)], "bands": lambda: [ratio_panel(result)]}
    return made if any(axis.bands for axis in result.axes) else {"nis": made["nis"]}


def nis_panel(result: Innovations) -> Panel:
    """Size in windows of time, with the band of a filter that is right."""
    series = result.series
    t = (series.start + series.stop) / 2
    expected = Curve(
        x=t, y=np.ones(len(t)), lower=series.lower, upper=series.upper, label="a right filter", colour="guide",
        style="dashed", band_label=f"{100 * result.confidence:g} % band",
    )  # fmt: skip
    measured = Curve(x=t, y=series.nis, label="measured", colour="x", marker="circle", style="thin")
    return Panel(
        title="Size of the innovations over time",
        x=Axis(label="Time [s]"),
        y=Axis(label="NIS over its dimension", log=True),
        curves=(expected, measured),
        height=0.4,
    )


def ratio_panel(result: Innovations) -> Panel:
    """Size by frequency, all axes."""
    return bands_panel(
        {axis.name: [(b.lower, b.upper, b.ratio) for b in axis.bands] for axis in result.axes},
        title="Size of the innovations over frequency",
        label="Over the stated size",
        one="a right filter",
    )
