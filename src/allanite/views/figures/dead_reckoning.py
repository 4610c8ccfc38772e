# SPDX-License-Identifier: BSD-3-Clause
"""Errors of dead reckoning over time: all sources together with their interval, and those that matter most."""

from __future__ import annotations

import numpy as np

from allanite.experiments.dead_reckoning import DeadReckoning
from allanite.views.figures.panel import SERIES, Axis, Curve, Panel, positive_range
from allanite.views.wording.dead_reckoning import BUDGET_QUANTITIES, quantity_words

__all__ = ["VIEWS", "growth_panel"]

VIEWS = {
    "position": "position_horizontal",
    "height": "position_down",
    "velocity": "velocity_horizontal",
    "tilt": "tilt",
    "heading": "heading",
}
_MOST = 6
_DECADES = 1e7
_LANDMARKS = ((60.0, "1 min"), (600.0, "10 min"), (3600.0, "1 h"), (21600.0, "6 h"), (86400.0, "1 d"))


def growth_panel(result: DeadReckoning, view: str) -> Panel:
    """One quantity over time."""
    quantity = VIEWS[view]
    column, (name, _, factor) = result.column(quantity), BUDGET_QUANTITIES[quantity]
    times = result.times
    whole, low, high = (part[:, column] / factor for part in (result.sd, result.lower, result.upper))
    banded = bool(np.isfinite(low).any() and np.isfinite(high).any())
    curves = [
        Curve(
            x=times, y=whole, label="total, 1 σ", colour="ink", lower=low if banded else None,
            upper=high if banded else None, band_label=f"{100 * result.confidence:g} % interval" if banded else "",
        )
    ]  # fmt: skip
    for i, source in enumerate(result.largest(quantity, _MOST)):
        sd = source.sd[:, column] / factor
        curves.append(
            Curve(
                x=times, y=np.where(sd > 0, sd, np.nan), label=source.name, colour=SERIES[i % len(SERIES)],
                style="dashed" if i < len(SERIES) // 2 else "dashdot",
            )
        )  # fmt: skip
    ends = max(float(times.min()), 0.5 * min(result.shown)), float(times.max())
    bottom, top = positive_range(whole, *([high] if banded else []))
    lowest = positive_range(*(c.y for c in curves))[0]
    return Panel(
        title=f"{name}, unaided",
        x=Axis(
            label="Time since the start [s]", log=True, limits=ends,
            landmarks=tuple((t, words) for t, words in _LANDMARKS if ends[0] < t < ends[1]),
        ),
        y=Axis(label=quantity_words(quantity), log=True, limits=(max(lowest, bottom / 30, top / _DECADES), 1.6 * top)),
        curves=tuple(curves),
        height=0.5,
        key="above",
    )  # fmt: skip
