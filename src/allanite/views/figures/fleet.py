# SPDX-License-Identifier: BSD-3-Clause
"""A fleet: each coefficient relative to its middle, with the units that stand out; and lot by lot."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from allanite.quantities.display_units import coefficient_unit
from allanite.stability.fleet.results import CoefficientPopulation, FleetPopulation, UnitDensity
from allanite.views.figures.panel import (
    MARKERS,
    SERIES,
    Axis,
    Curve,
    Panel,
    around,
    array,
    level,
    positive_range,
)

__all__ = ["VIEWS", "correlation_panels", "density_panels", "lot_panels", "population_panels"]

VIEWS = ("whole", "population", "density", "correlations", "lots")
_PAIRS = 20  # that a table has
_LONG, _NAMES = 12, 16  # characters of a lot's name below its place, and how many have room


def population_panels(result: FleetPopulation) -> Iterator[Panel]:
    """One panel for each channel: where the next unit lies, and which ones stand out."""
    for channel in dict.fromkeys(c.channel for c in result.coefficients):
        yield _population(result, [c for c in result.coefficients if c.channel == channel])


def _population(result: FleetPopulation, coefficients: Sequence[CoefficientPopulation]) -> Panel:
    place = np.arange(1.0, len(coefficients) + 1)
    middle, one = array([c.middle.value for c in coefficients]), np.ones(len(place))
    at = {c.symbol: x for c, x in zip(coefficients, place, strict=True)}
    outside = [
        s for s in result.standing_out if s.channel == coefficients[0].channel and not math.isnan(s.ratio)
    ]
    curves = [
        _bars(
            place - 0.15,
            one,
            array([c.next_unit for c in coefficients]) / middle[:, None],
            "next unit",
            "guide",
        ),
        _bars(
            place,
            one,
            array([(c.middle.lower, c.middle.upper) for c in coefficients]) / middle[:, None],
            "middle",
            "z",
        ),
        Curve(
            x=place + 0.15,
            y=array([c.tolerance[1] for c in coefficients]) / middle,
            label=f"{100 * coefficients[0].content:g} % bound",
            colour="limit",
            style="none",
            marker="down",
        ),
    ]
    if outside:
        curves.append(
            Curve(
                x=array([at[s.symbol] for s in outside]),
                y=array([s.ratio for s in outside]),
                label="stands out",
                colour="x",
                style="none",
                marker="cross",
            )
        )
    low, high = positive_range(*(c.y for c in curves), *(c.lower for c in curves if c.lower is not None))
    return Panel(
        title=f"{coefficients[0].channel}: relative to the middle",
        x=Axis(label="", limits=(0.4, len(place) + 0.6), names=tuple((x, s) for s, x in at.items())),
        y=Axis(label="Ratio to the middle", log=True, limits=(low / 1.2, 1.2 * high)),
        curves=tuple(curves),
        height=0.45,
        key="above",
    )


def density_panels(result: FleetPopulation) -> Iterator[Panel]:
    """One panel for each coefficient: its units, its population, and the units that stand out."""
    for c in result.coefficients:
        if c.density is not None:
            lots = {lot.lot: lot.ratio.value for lot in c.of_lots}
            outside = [
                s.ratio * c.middle.value * lots.get(s.lot, 1.0)
                for s in result.standing_out
                if (s.channel, s.symbol) == (c.channel, c.symbol) and not math.isnan(s.ratio)
            ]
            yield _density(c, c.density, outside)


def _density(c: CoefficientPopulation, density: UnitDensity, outside: Sequence[float]) -> Panel:
    unit, factor = coefficient_unit(c.kind, c.symbol, c.middle.unit)
    x, top = density.x / factor, float(max(density.units.max(), density.population.max()))
    curves = [
        Curve(x=x, y=density.units, label="all units", colour="z"),
        Curve(x=x, y=density.population, label="population", colour="model", style="dashed"),
    ]
    if outside:
        at = array(outside) / factor
        curves.append(
            Curve(
                x=at, y=np.full(len(at), 0.02 * top), label="unit that stands out", colour="x", style="none",
                marker="cross",
            )
        )  # fmt: skip
    low, high = positive_range(*(curve.x for curve in curves))
    return Panel(
        title=f"{c.symbol} of {c.channel}: {c.units} units",
        x=Axis(label=f"{c.symbol} [{unit}]", log=True, limits=(low / 1.03, 1.03 * high)),
        y=Axis(label=f"Density of ln {c.symbol}", limits=(0.0, 1.08 * top)),
        curves=tuple(curves),
        height=0.45,
        key="above",
    )


def correlation_panels(result: FleetPopulation) -> Iterator[Panel]:
    """One panel with the strongest correlations, numbered as in the table."""
    shown = result.correlations[:_PAIRS]
    if not shown:
        return
    place = np.arange(1.0, len(shown) + 1)
    limits = (0.4, len(shown) + 0.6)
    quantities = [c.correlation for c in shown]
    ends = [(q.lower, q.upper) for q in quantities]
    yield Panel(
        title="Correlation over units",
        x=Axis(label="Pair of coefficients", limits=limits, names=tuple((x, f"{x:g}") for x in place)),
        y=Axis(label="Correlation", limits=(-1.05, 1.05)),
        curves=(
            _bars(place, [q.value for q in quantities], ends, "correlation, with its interval", "z"),
            level(limits, 0.0, "none"),
        ),
        height=0.45,
        key="above",
    )


def lot_panels(result: FleetPopulation) -> Iterator[Panel]:
    """One panel for each channel that has lots, with all its coefficients."""
    for channel in dict.fromkeys(c.channel for c in result.coefficients if c.of_lots):
        yield _lots(channel, [c for c in result.coefficients if c.channel == channel and c.of_lots])


def _lots(channel: str, coefficients: Sequence[CoefficientPopulation]) -> Panel:
    lots = sorted({lot.lot for c in coefficients for lot in c.of_lots})
    place = {lot: i + 1.0 for i, lot in enumerate(lots)}
    curves, every = [], []
    for i, c in enumerate(coefficients):
        beside = 0.5 * (i - (len(coefficients) - 1) / 2) / len(coefficients)
        x = [place[lot.lot] + beside for lot in c.of_lots]
        ends = [(lot.ratio.lower, lot.ratio.upper) for lot in c.of_lots]
        every += ends
        look = {"label": c.symbol, "colour": SERIES[i % len(SERIES)], "marker": MARKERS[i % len(MARKERS)]}
        curves.append(_bars(x, [lot.ratio.value for lot in c.of_lots], ends, **look))
    limits = (0.4, len(lots) + 0.6)
    names = [(x, lot if len(lot) <= _LONG else lot[: _LONG - 1] + "…") for lot, x in place.items()]
    return Panel(
        title=f"{channel}, lot by lot",
        x=Axis(label="", limits=limits, names=tuple(names[:: max(1, math.ceil(len(lots) / _NAMES))])),
        y=Axis(label="Ratio to the middle", limits=around(every)),
        curves=(*curves, level(limits, 1.0, "middle of all lots")),
        height=0.45,
        key="above",
    )


def _bars(
    x: ArrayLike, y: ArrayLike, ends: ArrayLike, label: str, colour: str, marker: str = "circle"
) -> Curve:
    low, high = array(ends).T
    return Curve(
        x=array(x), y=array(y), lower=low, upper=high, bars=True, style="none", marker=marker, label=label,
        colour=colour,
    )  # fmt: skip
