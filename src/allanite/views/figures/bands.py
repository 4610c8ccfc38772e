# SPDX-License-Identifier: BSD-3-Clause
"""Ratios by band of frequency, with their intervals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.quantity import Quantity
from allanite.views.figures.curves import series_colours
from allanite.views.figures.panel import Axis, Curve, Panel, level, positive_range
from allanite.views.figures.spectra import frequency_axis

__all__ = ["BandSeries", "bands_panel"]


@dataclass(frozen=True, slots=True, kw_only=True)
class BandSeries:
    """Ratios of one channel: ends of each band [Hz], and the ratio."""

    name: str
    bands: Sequence[tuple[float, float, Quantity]]


def bands_panel(series: Sequence[BandSeries], *, title: str, label: str, one: str) -> Panel:
    """All channels, and the ratio of 1, called `one`."""
    shown = [s for s in series if s.bands]
    curves = [
        Curve(
            x=np.array([np.sqrt(low * high) for low, high, _ in s.bands]),
            y=np.array([ratio.value for *_, ratio in s.bands]),
            lower=np.array([ratio.lower for *_, ratio in s.bands]),
            upper=np.array([ratio.upper for *_, ratio in s.bands]),
            bars=True, label=s.name, colour=colour, marker=marker, style="thin",
        )
        for s, (colour, marker) in zip(shown, series_colours([s.name for s in shown]), strict=True)
    ]  # fmt: skip
    ends = positive_range(*(c.x for c in curves))
    y = positive_range([1.0], *([r.lower, r.value, r.upper] for s in shown for *_, r in s.bands))
    return Panel(
        title=title,
        x=frequency_axis(*(c.x for c in curves)),
        y=Axis(label=label, log=True, limits=(y[0] / 1.2, y[1] * 1.2)),
        curves=(*curves, level((ends[0] / 1.2, ends[1] * 1.2), 1.0, one, "model")),
        height=0.4,
        key="above",
    )
