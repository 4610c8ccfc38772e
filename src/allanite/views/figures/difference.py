# SPDX-License-Identifier: BSD-3-Clause
"""Two noise models side by side: Allan deviations, and the drift over time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from allanite.fitting.model_difference import drift
from allanite.noise import NoiseModel
from allanite.quantities.display_units import display_unit
from allanite.views.figures.curves import tau_axis
from allanite.views.figures.panel import SERIES, Axis, Curve, Panel, positive_range
from allanite.views.wording import drift_unit

__all__ = ["VIEWS", "curve_panels", "drift_panels"]

Json = Mapping[str, Any]

VIEWS = ("whole", "curves", "drift")
#: Averaging times of the curves [s]; drifts are drawn a decade beyond those of the table.
_TAU = (1e-2, 1e5)
_STYLES = ("solid", "dashed")


def curve_panels(document: Json) -> list[Panel]:
    """Allan deviation of both models of each sensor."""
    tau = np.geomspace(*_TAU, 241)
    panels = []
    for channel in document["channels"]:
        unit, factor = display_unit(channel["kind"], "adev", channel["unit"])
        curves = _both(document, channel, tau, lambda model, t: model.adev(t), factor)
        panels.append(_panel(channel["name"], tau_axis(_TAU), f"Allan deviation σ(τ) [{unit}]", curves))
    return panels


def drift_panels(document: Json) -> list[Panel]:
    """Drift of both models of each sensor over the time."""
    panels = []
    for channel in document["channels"]:
        seconds = [line["seconds"] for line in channel["drifts"]]
        t = np.geomspace(min(seconds) / 10, max(seconds) * 10, 121)
        unit, factor = drift_unit(channel["kind"], channel["unit"])
        rest = document["rest"]

        def of(model: NoiseModel, t: np.ndarray, rest: float | None = rest) -> np.ndarray:
            return np.array([drift(model, float(s), rest) for s in t])

        curves = _both(document, channel, t, of, factor)
        x = Axis(label="Time without help [s]", log=True, limits=(float(t[0]), float(t[-1])))
        panels.append(_panel(channel["name"], x, f"Drift, 1 σ [{unit}]", curves))
    return panels


def _both(document: Json, channel: Json, x: np.ndarray, of: Any, factor: float) -> tuple[Curve, ...]:
    curves = []
    for i, key in enumerate(("first", "second")):
        model = NoiseModel.from_json(channel[key])
        curves.append(
            Curve(
                x=x, y=of(model, x) / factor, label=document["names"][i], colour=SERIES[i], style=_STYLES[i],  # type: ignore[arg-type]
            )
        )  # fmt: skip
    return tuple(curves)


def _panel(title: str, x: Axis, label: str, curves: tuple[Curve, ...]) -> Panel:
    low, high = positive_range(*(c.y for c in curves))
    return Panel(
        title=title,
        x=x,
        y=Axis(label=label, log=True, limits=(low / 2, high * 2)),
        curves=curves,
        height=0.56,
    )
