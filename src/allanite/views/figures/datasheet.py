# SPDX-License-Identifier: BSD-3-Clause
"""Allan curve of a data sheet beside the measured one, and their ratio."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from allanite.quantities.display_units import display_unit
from allanite.study.datasheet import ChannelJudgement, DatasheetJudgement
from allanite.views.figures.curves import (
    deviations_panel,
    measured_curve,
    model_panel,
    series_colours,
    tau_axis,
)
from allanite.views.figures.panel import Array, Axis, Curve, Panel, level, positive_range

__all__ = ["VIEWS", "ratio_panel", "sheet_panels"]

VIEWS = ("whole", "curves", "ratio")


def sheet_panels(result: DatasheetJudgement) -> Iterator[Panel]:
    """The curves of each channel; of each section, where nothing was measured."""
    yield from map(_beside, result.channels)
    if not result.channels:
        for name, model in result.datasheet.models.items():
            yield replace(model_panel(model, (1e-2, 1e5)), title=f"Data sheet, {name}")


def _beside(channel: ChannelJudgement) -> Panel:
    unit, factor = display_unit(channel.kind, "adev", channel.unit)
    curve = channel.curve
    measured = measured_curve(curve, "measured", factor, series_colours([channel.name])[0])
    stated = Curve(x=curve.tau, y=channel.stated / factor, label="data sheet", colour="model", style="dashed")
    return deviations_panel(channel.name, unit, (measured, stated))


def _ratios(channel: ChannelJudgement) -> tuple[Array, Array, Array]:
    """Measured over stated, and its ends; NaN where the sheet states nothing."""
    curve = channel.curve
    with np.errstate(divide="ignore", invalid="ignore"):
        middle, low, high = (each / channel.stated for each in (curve.deviation, curve.lower, curve.upper))
    return middle, low, high


def ratio_panel(result: DatasheetJudgement) -> Panel:
    """Measured over stated at each lag, all channels."""
    names = [c.name for c in result.channels]
    curves, ends = [], []
    for channel, (colour, marker) in zip(result.channels, series_colours(names), strict=True):
        middle, low, high = _ratios(channel)
        ends.append(high)
        curves.append(
            Curve(
                x=channel.curve.tau, y=middle, lower=low, upper=high, bars=True,
                label=channel.name, colour=colour, marker=marker, style="thin",
            )
        )  # fmt: skip
    x = positive_range(*(c.x for c in curves))
    bottom, top = positive_range(*(c.y for c in curves), [1.0])
    y = bottom / 1.6, min(positive_range(*ends, [1.0])[1], 3 * top)
    return Panel(
        title="Measured over stated",
        x=tau_axis((x[0] / 1.5, x[1] * 1.5)),
        y=Axis(label="Ratio of Allan deviations", log=True, limits=(y[0], y[1] * 1.3)),
        curves=(*curves, level((x[0] / 1.5, x[1] * 1.5), 1.0, "the data sheet", "model")),
        height=0.36,
        key="above",
    )
