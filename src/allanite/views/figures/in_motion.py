# SPDX-License-Identifier: BSD-3-Clause
"""Noise in motion: its density beside that at rest, and their ratio by band."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from allanite.quantities.display_units import display_unit
from allanite.quantities.quantity import Quantity
from allanite.stability.in_motion import ChannelInMotion, InMotion
from allanite.views.figures.curves import series_colours
from allanite.views.figures.panel import Axis, Curve, Panel, level, positive_range
from allanite.views.figures.spectra import density_curve, density_panel, frequency_axis

__all__ = ["VIEWS", "bands_panel", "density_panels", "inflation_panel", "parts"]

VIEWS = ("whole", "inflation", "spectra")


def parts(result: InMotion) -> Mapping[str, Callable[[], Sequence[Panel]]]:
    """Panels by view."""
    return {"inflation": lambda: [inflation_panel(result)], "spectra": lambda: [*density_panels(result)]}


def density_panels(result: InMotion) -> Iterator[Panel]:
    """Each channel at rest and in motion."""
    for channel in result.channels:
        unit, factor = display_unit(channel.kind, "N", channel.unit)
        colour = series_colours([channel.name])[0][0]
        rest = density_curve(channel.at_rest, "at rest", factor, "guide", band=False)
        moving = density_curve(channel.in_motion, "in motion", factor, colour, band=True)
        yield density_panel(_title(result, channel), unit, (rest, moving), ())


def inflation_panel(result: InMotion) -> Panel:
    """Ratio of the root densities by band, all channels."""
    return bands_panel(
        {_title(result, c): [(b.lower, b.upper, b.inflation) for b in c.bands] for c in result.channels},
        title="Inflation: in motion over at rest",
        label="Ratio of root densities",
        one="as at rest",
    )


def _title(result: InMotion, channel: ChannelInMotion) -> str:
    return channel.name if len(result.logs) == 1 else f"{channel.name}, {channel.log}"


def bands_panel(
    series: Mapping[str, Sequence[tuple[float, float, Quantity]]], *, title: str, label: str, one: str
) -> Panel:
    """Ratios by band, as (lowest, highest frequency, ratio) of each channel, and the ratio of 1, called `one`."""
    shown = {name: bands for name, bands in series.items() if bands}
    curves = [
        Curve(
            x=np.array([np.sqrt(low * high) for low, high, _ in bands]),
            y=np.array([ratio.value for *_, ratio in bands]),
            lower=np.array([ratio.lower for *_, ratio in bands]),
            upper=np.array([ratio.upper for *_, ratio in bands]),
            bars=True, label=name, colour=colour, marker=marker, style="thin",
        )
        for (name, bands), (colour, marker) in zip(shown.items(), series_colours(list(shown)), strict=True)
    ]  # fmt: skip
    ends = positive_range(*(c.x for c in curves))
    y = positive_range([1.0], *([r.lower, r.value, r.upper] for bands in shown.values() for *_, r in bands))
    return Panel(
        title=title,
        x=frequency_axis(*(c.x for c in curves)),
        y=Axis(label=label, log=True, limits=(y[0] / 1.2, y[1] * 1.2)),
        curves=(*curves, level((ends[0] / 1.2, ends[1] * 1.2), 1.0, one, "model")),
        height=0.4,
        key="above",
    )
