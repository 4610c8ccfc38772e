# SPDX-License-Identifier: BSD-3-Clause
"""Allan curve of a data sheet beside the measured one, their ratio; and the bound above a fitted model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from allanite.noise import NoiseModel
from allanite.noise.allan.channel_curve import ChannelCurve
from allanite.quantities.display_units import display_unit
from allanite.views.figures.curves import measured_curve, model_curve, model_panel, series_colours, tau_axis
from allanite.views.figures.panel import Axis, Curve, Panel, array, level, positive_range

__all__ = ["VIEWS", "bound_panels", "inflation_panel", "ratio_panel", "sheet_panels"]

Json = Mapping[str, Any]

VIEWS = ("whole", "curves", "ratio")


def sheet_panels(document: Json) -> list[Panel]:
    """The curves of each channel; of each section, where nothing was measured."""
    if document["channels"]:
        return [_beside(channel) for channel in document["channels"]]
    panels = []
    for name, section in document["sections"].items():
        panel = model_panel(NoiseModel.from_json(section["model"]), (1e-2, 1e5))
        panels.append(replace(panel, title=f"Data sheet, {name}"))
    return panels


def _beside(channel: Json) -> Panel:
    unit, factor = display_unit(channel["kind"], "adev", channel["unit"])
    curve = ChannelCurve.from_json(channel["curve"])
    measured = measured_curve(curve, "measured", factor, series_colours([channel["name"]])[0])
    stated = Curve(
        x=curve.tau, y=array(channel["stated"]) / factor, label="data sheet", colour="model", style="dashed"
    )  # fmt: skip
    return _deviations(channel["name"], unit, (measured, stated))


def _deviations(title: str, unit: str, curves: tuple[Curve, ...]) -> Panel:
    x = positive_range(*(c.x for c in curves))
    bands = [c.upper for c in curves if c.upper is not None]
    low, high = positive_range(*(c.y for c in curves), *bands)
    x = (x[0] / 1.5, x[1] * 1.5)
    return Panel(
        title=title,
        x=tau_axis(x),
        y=Axis(label=f"Allan deviation σ(τ) [{unit}]", log=True, limits=(low / 2, high * 2)),
        curves=curves,
        height=0.56,
        key="above",
    )


def ratio_panel(document: Json) -> Panel:
    """Measured over stated at each lag, all channels."""
    names = [c["name"] for c in document["channels"]]
    curves = []
    for channel, (colour, marker) in zip(document["channels"], series_colours(names), strict=True):
        low, high = array(channel["ratio_lower"]), array(channel["ratio_upper"])
        curves.append(
            Curve(
                x=array(channel["curve"]["tau"]), y=array(channel["ratio_deviation"]), lower=low, upper=high, bars=True,
                label=channel["name"], colour=colour, marker=marker, style="thin",
            )
        )  # fmt: skip
    x = positive_range(*(c.x for c in curves))
    middle, ends = (
        positive_range(*(c.y for c in curves), [1.0]),
        [array(c["ratio_upper"]) for c in document["channels"]],
    )
    y = middle[0] / 1.6, min(positive_range(*ends, [1.0])[1], 3 * middle[1])
    return Panel(
        title="Measured over stated",
        x=tau_axis((x[0] / 1.5, x[1] * 1.5)),
        y=Axis(label="Ratio of Allan deviations", log=True, limits=(y[0], y[1] * 1.3)),
        curves=(*curves, level((x[0] / 1.5, x[1] * 1.5), 1.0, "the data sheet", "model")),
        height=0.36,
        key="above",
    )


# -- bounds ---------------------------------------------------------------------------------------------------


def bound_panels(document: Json) -> list[Panel]:
    """Measured, fitted and bound of each channel, to the horizon of the bound."""
    panels = []
    for channel in document["channels"]:
        unit, factor = display_unit(channel["kind"], "adev", channel["unit"])
        curve = ChannelCurve.from_json(channel["curve"])
        measured = measured_curve(curve, "measured", factor, series_colours([channel["name"]])[0])
        fitted = [
            replace(model_curve(curve, m, factor, i), label="fitted" if i == 0 else "or fitted")
            for i, m in enumerate(map(NoiseModel.from_json, channel["models"]))
        ]
        tau, bound = _bound(channel)
        line = Curve(x=tau, y=bound / factor, label=_words(channel), colour="limit")
        panels.append(_deviations(channel["name"], unit, (measured, *fitted, line)))
    return panels


def _words(channel: Json) -> str:
    return f"bound, {100 * channel['bound']['overbound']['probability']:g} %"


def _bound(channel: Json, key: str = "bound") -> tuple[np.ndarray, np.ndarray]:
    facts, curve = channel["bound"]["overbound"], channel["curve"]
    tau = np.geomspace(facts["shortest"], facts["horizon"], 200)
    model = NoiseModel.from_json(channel["bound"] if key == "bound" else channel["models"][0])
    return tau, np.sqrt(model.avar_sampled(tau / curve["dt"], curve["dt"], curve["sampling"]))


def inflation_panel(document: Json) -> Panel:
    """Bound over fitted, all channels."""
    names = [c["name"] for c in document["channels"]]
    curves = []
    for channel, (colour, _) in zip(document["channels"], series_colours(names), strict=True):
        tau, bound = _bound(channel)
        curves.append(
            Curve(x=tau, y=bound / _bound(channel, "fitted")[1], label=channel["name"], colour=colour)
        )
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
