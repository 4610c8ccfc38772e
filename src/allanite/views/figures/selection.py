# SPDX-License-Identifier: BSD-3-Clause
"""Sets of terms: their weights as bars, and their Allan deviations over the measured one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from allanite.fitting.selection.results import ChannelSelection
from allanite.noise import NoiseModel
from allanite.quantities.display_units import display_unit
from allanite.views.figures.curves import measured_curve, model_curve
from allanite.views.figures.drawing import Drawing, DrawnShape, Words, box
from allanite.views.figures.panel import Axis, Panel, Style, positive_range
from allanite.views.wording.selection import weight_words

__all__ = ["VIEWS", "curves_panel", "weights_panel"]

VIEWS = ("whole", "weights", "curves")

#: Sets with a bar, and with a curve.
_BARS, _CURVES = 8, 4
_STYLES: tuple[Style, ...] = ("dashed", "dashdot", "dotted", "thin")
_COLOURS = ("model", "other", "x", "y")
_WIDTH, _LEFT, _RIGHT, _ROW, _BAR, _MARGIN = 100.0, 50.0, 9.0, 4.4, 2.9, 1.5


def weights_panel(channel: ChannelSelection) -> Panel:
    """A bar for the weight of every set."""
    return Panel(title=f"{channel.name}: weight of every set of terms", drawing=_bars(channel))


def _bars(channel: ChannelSelection) -> Drawing:
    shown = channel.candidates[:_BARS]
    full = _WIDTH - _LEFT - _RIGHT
    height = 2 * _MARGIN + _ROW * (len(shown) + 1)
    parts: list[DrawnShape | Words] = []
    for row, candidate in enumerate(shown):
        y = height - _MARGIN - _ROW * (row + 0.5)
        parts += _bar(candidate.words, candidate.weight, y, full, bold=row == 0)
    rest = 1.0 - sum(c.weight for c in shown)
    parts += _bar("all others together", max(rest, 0.0), _MARGIN + 0.5 * _ROW, full, faint=True)
    return Drawing(width=_WIDTH, height=height, parts=tuple(parts))


def _bar(
    words: str, weight: float, y: float, full: float, *, bold: bool = False, faint: bool = False
) -> list[DrawnShape | Words]:
    colour = "guide" if faint else "ink"
    length = max(weight * full, 0.3)
    fill = "guide" if faint else "z"
    return [
        Words(x=_LEFT - 1.2, y=y, text=words, across="right", bold=bold, colour=colour, size=0.9),
        box(_LEFT, y - _BAR / 2, full, _BAR, colour=None, fill="guide", opacity=0.12),
        box(_LEFT, y - _BAR / 2, length, _BAR, colour=None, fill=fill, opacity=0.85 if bold else 0.5, name="weight"),
        Words(x=_WIDTH, y=y, text=weight_words(weight), across="right", colour=colour, size=0.9),
    ]  # fmt: skip


def curves_panel(channel: ChannelSelection) -> Panel:
    """The measured deviation with its band, and what the first sets of terms make of it."""
    unit, factor = display_unit(channel.kind, "adev", channel.unit)
    curve = channel.curve
    measured = measured_curve(curve, "measured", factor, ("z", "circle"))
    lines = []
    for i, candidate in enumerate([channel.best, *channel.rivals][:_CURVES]):
        line = model_curve(
            curve,
            NoiseModel.from_json({"terms": candidate.terms, "kind": channel.kind}),
            factor,
            i,
            colour=_COLOURS[i],
            label=f"{candidate.words} ({weight_words(candidate.weight)})",
        )
        lines.append(replace(line, style=_STYLES[i]))
    low, high = positive_range(measured.y, *(line.y for line in lines), _finite(measured.upper))
    return Panel(
        title=f"{channel.name}: Allan deviation, and the best sets of terms",
        x=Axis(label="Averaging time [s]", log=True),
        y=Axis(label=f"Allan deviation [{unit}]", log=True, limits=(low / 1.5, 1.5 * high)),
        curves=(measured, *lines),
        height=0.6,
        key="above",
    )


def _finite(values: Any) -> Any:
    """Ends of a band that would not stretch the axis."""
    return np.zeros(0) if values is None else values[np.isfinite(values)]
