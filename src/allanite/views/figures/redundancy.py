# SPDX-License-Identifier: BSD-3-Clause
"""Redundant sensors: their parity over time with its threshold, and the deviation of the combined axes beside one."""

from __future__ import annotations

from typing import Any

import numpy as np

from allanite.experiments.redundancy import Combination
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration
from allanite.views.figures.panel import (
    MARKERS,
    SERIES,
    Axis,
    Curve,
    Label,
    Panel,
    ShadedSpan,
    positive_range,
)
from allanite.views.figures.records import clock

__all__ = ["VIEWS", "deviation_panel", "gain_panel", "parity_panel"]

VIEWS = ("whole", "parity", "deviation", "gain")
#: Least chi-square that is drawn: the smallest say nothing.
_FLOOR = 1e-2
#: Of windows of one length, eight times it and 64 times it: the longer the darker.
_COLOURS = (5, 2, 0)


def parity_panel(result: Combination) -> Panel:
    """Chi-square of each window, its threshold, and the spans of the faults."""
    parity = result.parity
    unit, second = clock(result.duration)
    curves = [
        Curve(
            x=windows.time / second,
            y=np.maximum(windows.statistic, _FLOOR),
            label=f"windows of {duration(windows.length)}",
            colour=SERIES[_COLOURS[i]],
            style="none",
            marker=MARKERS[i],
        )
        for i, windows in enumerate(parity.windows)
    ]
    spans = tuple(
        ShadedSpan(
            start=f.start / second,
            stop=f.stop / second,
            kind="finding" if f.sensor is None else "disturbed",
            text=f"{f.who}: {f.kind}",
        )
        for f in result.faults
    )
    high = positive_range(*(c.y for c in curves), [parity.threshold])[1]
    alarm = Curve(
        x=np.array([0.0, result.duration / second]),
        y=np.full(2, parity.threshold),
        label=f"alarm: {100 * result.false_alarm:g} % of records without a fault",
        colour="x",
        style="dashed",
    )
    return Panel(
        title=f"Parity of the sensors; {parity.dof} expected",
        x=Axis(label=f"Time since the first sample [{unit}]", limits=(0.0, result.duration / second)),
        y=Axis(label="Chi-square of the window", log=True, limits=(_FLOOR, 4 * high)),
        curves=(*curves, alarm),
        spans=spans,
        height=0.36,
        key="above",
    )


def deviation_panel(result: Combination) -> Panel:
    """Allan deviation of the combined axes, measured and predicted, beside the best sensor."""
    unit, factor = display_unit(result.kind, "adev")
    tau = result.tau
    curves = [
        Curve(
            x=tau, y=result.single / factor, label="best sensor, by models", colour="guide", style="dashed"
        )
    ]  # fmt: skip
    for m, axis in enumerate(result.axes):
        colour = SERIES[m]
        predicted, measured, low, high = (
            values[:, m] / factor
            for values in (result.predicted, result.measured, result.lower, result.upper)
        )
        curves.append(Curve(x=tau, y=predicted, label=f"{axis}, by the models", colour=colour))
        if np.isfinite(measured).any():
            curves.append(
                Curve(
                    x=tau, y=measured, lower=low, upper=high, bars=True, style="none", marker=MARKERS[m],
                    label=f"{axis}, measured", colour=colour,
                )
            )  # fmt: skip
    y = positive_range(*(c.y for c in curves))
    return Panel(
        title="Allan deviation of the combined axes",
        x=Axis(label="Averaging time [s]", log=True),
        y=Axis(label=f"Allan deviation [{unit}]", log=True, limits=(y[0] / 2, 2 * y[1])),
        curves=tuple(curves),
        height=0.5,
        key="above",
    )


def gain_panel(result: Combination) -> Panel:
    """How many times better than the best sensor, with its interval, and what constant weights cost."""
    tau = result.tau
    curves = []
    for m, axis in enumerate(result.axes):
        gain, low, high = (values[:, m] for values in (result.gain, result.gain_lower, result.gain_upper))
        look: dict[str, Any] = {"colour": SERIES[m]}
        expected = result.gain_predicted[:, m]
        curves.append(Curve(x=tau, y=expected, label=f"{axis}, by the models", **look))
        best = expected * result.loss[:, m]
        if (best > 1.005 * expected).any():
            words = f"{axis}, weights for each time"
            curves.append(Curve(x=tau, y=best, label=words, style="dashed", **look))
        if np.isfinite(gain).any():
            curves.append(
                Curve(
                    x=tau, y=gain, lower=low, upper=high, bars=True, style="none", marker=MARKERS[m],
                    label=f"{axis}, measured", **look,
                )
            )  # fmt: skip
    words = f"weights for {result.averaging:.3g} s"
    top = float(np.nanmax(np.concatenate([c.y for c in curves])))
    return Panel(
        title="Gain over the best sensor",
        x=Axis(label="Averaging time [s]", log=True),
        y=Axis(label="Deviation of one over combined", limits=(0.0, 1.5 * top)),
        curves=tuple(curves),
        labels=(
            Label(x=result.averaging, y=0.0, text=words, colour="guide", side="above right", place="line"),
        ),
        height=0.36,
        key="above",
    )
