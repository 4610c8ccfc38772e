# SPDX-License-Identifier: BSD-3-Clause
"""Noise in motion: its density beside that at rest, and their ratio by band."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from allanite.quantities.display_units import display_unit
from allanite.stability.in_motion import ChannelInMotion, InMotion
from allanite.views.figures.bands import BandSeries, bands_panel
from allanite.views.figures.curves import series_colours
from allanite.views.figures.panel import Panel
from allanite.views.figures.spectra import density_curve, density_panel

__all__ = ["VIEWS", "density_panels", "inflation_panel", "parts"]

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
        [
            BandSeries(name=_title(result, c), bands=[(b.lower, b.upper, b.inflation) for b in c.bands])
            for c in result.channels
        ],
        title="Inflation: in motion over at rest",
        label="Ratio of root densities",
        one="as at rest",
    )


def _title(result: InMotion, channel: ChannelInMotion) -> str:
    return channel.name if len(result.logs) == 1 else f"{channel.name}, {channel.log}"
