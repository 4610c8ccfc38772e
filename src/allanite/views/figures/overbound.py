# SPDX-License-Identifier: BSD-3-Clause
"""Bounds above fitted models: their Allan deviations over the measured one, and the inflation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from allanite.fitting.overbound import BoundedChannel, Bounds
from allanite.noise import NoiseModel
from allanite.quantities.display_units import display_unit
from allanite.views.figures.curves import (
    deviations_panel,
    measured_curve,
    model_curve,
    series_colours,
    tau_axis,
)
from allanite.views.figures.panel import Array, Axis, Curve, Panel, level, positive_range

__all__ = ["VIEWS", "bound_panels", "inflation_panel", "parts"]

VIEWS = ("whole", "curves", "inflation")


def parts(result: Bounds) -> Mapping[str, Callable[[], Sequence[Panel]]]:
    """Panels by view."""
    return {"curves": lambda: [*bound_panels(result)], "inflation": lambda: [inflation_panel(result)]}


def bound_panels(result: Bounds) -> Iterator[Panel]:
    """Measured, fitted and bound of each channel, to the horizon of the bound."""
    for channel in result.channels:
        unit, factor = display_unit(channel.kind, "adev", channel.unit)
        measured = measured_curve(channel.curve, "measured", factor, series_colours([channel.name])[0])
        fitted = [
            replace(model_curve(channel.curve, m, factor, i), label="fitted" if i == 0 else "or fitted")
            for i, m in enumerate(channel.fitted.families)
        ]
        tau = _times(channel)
        words = f"bound, {100 * channel.inflation.probability:g} %"
        line = Curve(x=tau, y=_deviation(channel, channel.bound, tau) / factor, label=words, colour="limit")
        yield deviations_panel(channel.name, unit, (measured, *fitted, line))


def _times(channel: BoundedChannel) -> Array:
    return np.geomspace(channel.inflation.shortest, channel.inflation.horizon, 200)


def _deviation(channel: BoundedChannel, model: NoiseModel, tau: Array) -> Array:
    curve = channel.curve
    return np.sqrt(model.avar_sampled(tau / curve.dt, curve.dt, curve.sampling))


def inflation_panel(result: Bounds) -> Panel:
    """Bound over fitted, all channels."""
    curves = []
    for channel, (colour, _) in zip(result.channels, series_colours(list(result.models)), strict=True):
        tau = _times(channel)
        bound, fitted = (_deviation(channel, model, tau) for model in (channel.bound, channel.fitted))
        curves.append(Curve(x=tau, y=bound / fitted, label=channel.name, colour=colour))
    x = positive_range(*(c.x for c in curves))
    top = max(float(c.y.max()) for c in curves)
    return Panel(
        title="Inflation: bound over fitted model",
        x=tau_axis((x[0] / 1.5, x[1] * 1.5)),
        y=Axis(label="Ratio of Allan deviations", log=True, limits=(0.9, 1.2 * top)),
        curves=(*curves, level((x[0] / 1.5, x[1] * 1.5), 1.0, "not inflated", "model")),
        height=0.36,
        key="above",
    )
