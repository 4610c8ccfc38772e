# SPDX-License-Identifier: BSD-3-Clause
"""Two noise models side by side: Allan deviations, and the drift over time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from allanite.fitting.model_difference import Difference, drift
from allanite.quantities.display_units import display_unit
from allanite.views.figures.curves import tau_axis
from allanite.views.figures.panel import SERIES, Array, Axis, Curve, Panel, Style, positive_range
from allanite.views.wording.difference import drift_unit

__all__ = ["VIEWS", "curve_panels", "drift_panels"]

VIEWS = ("whole", "curves", "drift")
#: Averaging times of the curves [s]; drifts are drawn a decade beyond those of the table.
_TAU = (1e-2, 1e5)
_STYLES: tuple[Style, ...] = ("solid", "dashed")


def curve_panels(result: Difference) -> Iterator[Panel]:
    """Allan deviation of both models of each sensor."""
    tau = np.geomspace(*_TAU, 241)
    for channel in result.channels:
        unit, factor = display_unit(channel.kind, "adev", channel.unit)
        curves = _both(result, tau, [model.adev(tau) / factor for model in (channel.first, channel.second)])
        yield _panel(channel.name, tau_axis(_TAU), f"Allan deviation σ(τ) [{unit}]", curves)


def drift_panels(result: Difference) -> Iterator[Panel]:
    """Drift of both models of each sensor over the time."""
    for channel in result.channels:
        seconds = [pair.seconds for pair in channel.drifts]
        t = np.geomspace(min(seconds) / 10, max(seconds) * 10, 121)
        unit, factor = drift_unit(channel.kind, channel.unit)
        drifts = [
            np.array([drift(model, s, result.rest) / factor for s in t.tolist()])
            for model in (channel.first, channel.second)
        ]
        x = Axis(label="Time unaided [s]", log=True, limits=(float(t[0]), float(t[-1])))
        yield _panel(channel.name, x, f"Drift, 1 σ [{unit}]", _both(result, t, drifts))


def _both(result: Difference, x: Array, ys: Iterable[Array]) -> tuple[Curve, ...]:
    looks = zip(ys, result.names, SERIES, _STYLES, strict=False)
    return tuple(Curve(x=x, y=y, label=name, colour=colour, style=style) for y, name, colour, style in looks)


def _panel(title: str, x: Axis, label: str, curves: tuple[Curve, ...]) -> Panel:
    low, high = positive_range(*(c.y for c in curves))
    return Panel(
        title=title,
        x=x,
        y=Axis(label=label, log=True, limits=(low / 2, high * 2)),
        curves=curves,
        height=0.56,
    )
