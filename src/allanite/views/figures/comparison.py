# SPDX-License-Identifier: BSD-3-Clause
"""Compared records: their Allan curves over each other, and every parameter record by record with middle and spread."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import probability
from allanite.stability.record_comparison.results import (
    ChannelComparison,
    Comparison,
    ParameterComparison,
    SensorSpread,
)
from allanite.stability.record_comparison.words import parameter_name
from allanite.views.figures.drawing import Drawing
from allanite.views.figures.panel import (
    MARKERS,
    SERIES,
    Axis,
    Curve,
    Label,
    Limit,
    Panel,
    around,
    array,
    positive_range,
)

__all__ = ["VIEWS", "columns", "curves_panel", "parameter_panels"]

VIEWS = ("whole", "curves", "parameters")
#: With more records the bands would hide one another.
_BANDS = 6
#: A parameter whose values lie farther apart than this has a logarithmic axis.
_WIDE = 8.0
#: Channels side by side, and height over width of the curves and of a parameter.
_BESIDE, _TALL, _LOW = 3, 0.6, 0.3
_LONG = 12  # characters of a record's name below its place


def curves_panel(result: Comparison, channel: ChannelComparison) -> Panel:
    """All curves with their bands, and one model for all of them."""
    unit, factor = display_unit(channel.kind, "adev", channel.unit)
    banded = len(channel.curves) <= _BANDS
    curves = []
    for i, (record, c) in enumerate(zip(result.records, channel.curves, strict=True)):
        curves.append(
            Curve(
                x=c.tau,
                y=c.deviation / factor,
                lower=c.lower / factor if banded else None,
                upper=c.upper / factor if banded else None,
                label=record.name,
                colour=SERIES[i % len(SERIES)],
                marker=MARKERS[i % len(MARKERS)] if i < len(SERIES) else None,
                style="solid" if i < len(SERIES) else "dashed",
            )
        )
    model = channel.model
    tau = np.unique(np.concatenate([c.x for c in curves]))
    if model.terms:
        curves.append(
            Curve(x=tau, y=model.adev(tau) / factor, label="one for all", colour="model", style="dotted")
        )
    p = channel.lag_p_adjusted
    differ = [
        Label(x=float(t), y=0.0, text="differs most", colour="guide", side="above right", place="line")
        for t in channel.tau[(p < result.level) & (p == p.min())]
    ]
    y = positive_range(*(c.y for c in curves), *(c.upper for c in curves if c.upper is not None))
    return Panel(
        title=f"{channel.name}: Allan deviation, curves {probability(channel.curve.p_adjusted)}",
        x=Axis(label="Averaging time [s]", log=True),
        y=Axis(label=f"Allan deviation [{unit}]", log=True, limits=(y[0] / 1.6, 1.6 * y[1])),
        curves=tuple(curves),
        labels=tuple(differ[:1]),
        height=0.72,
    )


def parameter_panels(result: Comparison, channel: ChannelComparison) -> list[Panel]:
    """One panel for each parameter and for the bias."""
    return [_parameter(result, channel, p) for p in channel.every_parameter]


def columns(result: Comparison) -> list[tuple[Panel, ...]]:
    """Rows of a sheet with a column for each channel: the curves, and one low row for each parameter below them.

    The parameters of all channels stand in the same order, so that one reads across; three channels at most stand
    side by side. Of a single channel every legend stands above its panel, of several one stands below them all.
    """
    rows: list[tuple[Panel, ...]] = []
    channels = result.channels
    for i in range(0, len(channels), _BESIDE):
        block = channels[i : i + _BESIDE]
        alone = len(channels) == 1
        rows.append(tuple(replace(curves_panel(result, c), **_form(_TALL, alone)) for c in block))
        made = [{p.y.label: p for p in parameter_panels(result, c)} for c in block]
        for label in dict.fromkeys(label for one in made for label in one):
            height = _LOW / (1.5 if alone else 1.0)
            rows.append(
                tuple(
                    replace(
                        one[label],
                        title=f"{'' if alone else c.name + ', '}{one[label].title}",
                        **_form(height, alone),
                    )
                    if label in one
                    else Panel(title="", drawing=Drawing(width=1.0, height=height, parts=()))
                    for c, one in zip(block, made, strict=True)
                )
            )
    return _said_once(rows) if len(channels) == 1 else rows


def _form(height: float, alone: bool) -> dict[str, Any]:
    return {"height": height, "key": "above" if alone else "inside"}


def _said_once(rows: Sequence[tuple[Panel, ...]]) -> list[tuple[Panel, ...]]:
    """The panels of one column without the entries of a legend that stand above an earlier one."""
    labels = set[str]()
    out: list[tuple[Panel, ...]] = []
    for (panel,) in rows:
        curves = tuple(replace(c, label="") if c.label in labels else c for c in panel.curves)
        labels |= {c.label for c in panel.curves}
        out.append((replace(panel, curves=curves),))
    return out


def _parameter(result: Comparison, channel: ChannelComparison, parameter: ParameterComparison) -> Panel:
    unit, factor = display_unit(channel.kind, parameter.symbol, channel.unit)
    place = np.arange(1.0, len(parameter.records) + 1)
    value, low, high = (
        np.array([getattr(r, end) for r in parameter.records]) / factor for end in ("value", "lower", "upper")
    )
    limits = np.isnan(value) & np.isfinite(high)
    ends = (0.4, len(place) + 0.6)
    curves = [
        Curve(
            x=place,
            y=value,
            lower=np.where(limits, np.nan, low),
            upper=np.where(limits, np.nan, high),
            bars=True,
            style="none",
            marker="circle",
            colour="z",
            label="record, with its interval",
        )
    ]
    curves += _population(parameter.population, factor, ends)
    shown = np.concatenate(
        [
            value,
            np.where(limits, 0.0, low),  # from zero on, where it is a limit
            high,
            *(array(b) for c in curves[1:] for b in (c.y, c.lower, c.upper) if b is not None),
        ]
    )
    name, equality = parameter_name(parameter.symbol), parameter.equality
    y = _axis(f"{name} [{unit}]", parameter, shown)
    title = f"{name}: {probability(equality.p_adjusted) if equality else 'upper limits'}"
    return Panel(
        title=title,
        x=Axis(label="", limits=ends, names=tuple(_names(result))),
        y=y,
        curves=tuple(curves),
        limits=tuple(
            Limit(x=np.array([p - 0.3, p + 0.3]), y=np.full(2, u), at=(p, u), text="")
            for p, u in zip(place[limits], high[limits], strict=True)
        ),
        height=0.72,
    )


def _names(result: Comparison) -> list[tuple[float, str]]:
    return [
        (i + 1.0, name if len(name) <= _LONG else name[: _LONG - 1] + "…")
        for i, name in enumerate(r.name for r in result.records)
    ]


def _population(population: SensorSpread | None, factor: float, ends: tuple[float, float]) -> list[Curve]:
    """The middle of the kind with its interval, and where the next one lies."""
    if population is None:
        return []
    x = np.array(ends)

    def level(value: float, low: float | None, high: float | None, label: str, **look: Any) -> Curve:
        flat = [None if end is None else np.full(2, end / factor) for end in (low, high)]
        return Curve(x=x, y=np.full(2, value / factor), lower=flat[0], upper=flat[1], label=label, **look)

    middle, look = population.middle, {"colour": "guide", "style": "dotted"}
    return [
        level(middle.value, middle.lower, middle.upper, "middle of the kind", colour="y", style="dashed"),
        *(level(end, None, None, "the next lies between", **look) for end in population.next_sensor or ()),
    ]


def _axis(label: str, parameter: ParameterComparison, shown: Any) -> Axis:
    positive = shown[np.isfinite(shown) & (shown > 0)]
    if parameter.symbol != "mean" and len(positive) and positive.max() > _WIDE * positive.min():
        low, high = positive_range(positive)
        return Axis(label=label, log=True, limits=(low / 1.3, 1.3 * high))
    low, high = around(shown)
    return Axis(label=label, limits=(low, high))
