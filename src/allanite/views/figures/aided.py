# SPDX-License-Identifier: BSD-3-Clause
"""The seed paper's filter, which is told the rate: what it makes of the samples, and what its mean follows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from allanite.experiments.aided_readings import AidedReading
from allanite.views.figures.panel import Array, Axis, Curve, Envelope, Label, Panel, Style, around
from allanite.views.figures.records import clock

__all__ = [
    "DEG",
    "MILLI",
    "MILLI_NAME",
    "corrected_panel",
    "means_panel",
    "raw_panel",
    "states_panel",
]

#: One degree per second [rad/s], and a thousandth of it: rates of the size of the Earth's are compared in these.
DEG = math.radians(1)
MILLI = DEG / 1000
MILLI_NAME = "10⁻³ deg/s"
_LOOKS: tuple[tuple[str, Style, str], ...] = (
    ("z", "solid", "circle"),
    ("x", "dashed", "square"),
    ("y", "dashdot", "triangle"),
)
_STATES = ("flicker as one Gauss-Markov term", "random walk")


# -- panels -----------------------------------------------------------------------------------------------


def corrected_panel(reading: AidedReading) -> Panel:
    """The corrected samples and their cumulative mean."""
    axis, second = _axis(reading)
    samples, means = reading.corrected, reading.running
    low, high = samples.low / DEG, samples.high / DEG
    known = np.isfinite(low)
    middle = float(np.median((low + high)[known])) / 2 if known.any() else 0.0
    reach = 1.2 * float(np.median((high - low)[known])) if known.any() else 1.0
    return Panel(
        title="Reference-aided, not a measurement: corrected samples",
        x=axis,
        y=Axis(label="Corrected [deg/s]", limits=(middle - reach, middle + reach)),
        envelopes=(
            Envelope(
                x=samples.t / second,
                low=low,
                high=high,
                label="corrected, lowest and highest",
                colour="guide",
            ),
        ),
        curves=(Curve(x=means.t / second, y=means.corrected / DEG, label="cumulative mean", colour="x"),),
        height=0.22,
        key="above",
    )


def means_panel(readings: Sequence[AidedReading]) -> Panel:
    """The cumulative mean for each rate that was typed in, and that rate: one reading, one or more results."""
    axis, second = _axis(readings[0])
    references = [reading.mean_reference / MILLI for reading in readings]
    curves, late = [], []
    for reading, (colour, style, marker), rate in zip(readings, _LOOKS, references, strict=False):
        time, mean = reading.running.t, reading.running.corrected
        words = f"given {rate / 1000:.6f} deg/s".replace("-", "−") if math.isfinite(rate) else "no reference"
        look: dict[str, Any] = {"colour": colour, "style": style, "marker": marker}
        curves.append(Curve(x=time / second, y=mean / MILLI, label=words, **look))
        late.append((mean / MILLI)[time > 0.1 * reading.duration])
    lines = [
        Label(x=0.0, y=rate, text="", colour=look[0], place="level")
        for rate, look in zip(references, _LOOKS, strict=False)
        if math.isfinite(rate)
    ]
    kind, follows = readings[0].reading, readings[0].follows
    moved = f"{follows:.2f}" if math.isfinite(follows) else "–"
    return Panel(
        title=f"Reference-aided, {kind}: a unit typed in moves the mean by {moved}",
        x=axis,
        y=Axis(label=f"Mean so far [{MILLI_NAME}]", limits=around(references, [0.0], *late, room=0.14)),
        curves=tuple(curves),
        labels=tuple(lines),
        height=0.3,
        key="above",
    )


def raw_panel(reading: AidedReading, others: Sequence[Curve] = ()) -> Panel:
    """The cumulative mean of the samples as they were measured."""
    axis, second = _axis(reading)
    time, mean = reading.running.t, reading.running.raw
    signed = ", with the sign of the heading" if reading.reading == "demodulated" else ""
    late = (mean / MILLI)[time > 0.03 * reading.duration]
    return Panel(
        title=f"Mean of the measured samples, turns left out{signed}",
        x=axis,
        y=Axis(
            label=f"Mean so far [{MILLI_NAME}]", limits=around(late, [0.0], *(c.y for c in others), room=0.15)
        ),
        curves=(
            Curve(x=time / second, y=mean / MILLI, label="mean of the samples so far", colour="x"),
            *others,
        ),
        height=0.3,
        key="above",
    )


def states_panel(reading: AidedReading) -> Panel:
    """Both states of the filter with their bands: what it takes off the samples."""
    axis, second = _axis(reading)
    curves: list[Curve] = []
    late: list[Array] = []
    for name, look, state in zip(_STATES, _LOOKS, reading.states or (), strict=False):
        y, half = state.value / DEG, 2 * state.sd / DEG
        late.append(y[state.t > 0.02 * reading.duration])
        curves.append(
            Curve(
                x=state.t / second,
                y=y,
                lower=y - half,
                upper=y + half,
                label=name,
                colour=look[0],
                style=look[1],
                band_label="" if curves else "± 2 sd",
            )
        )
    return Panel(
        title="What the filter removes",
        x=axis,
        y=Axis(label="State [deg/s]", limits=around([0.0], *late, room=0.3)),
        curves=tuple(curves),
        height=0.3,
        key="above",
    )


def _axis(reading: AidedReading) -> tuple[Axis, float]:
    unit, second = clock(reading.duration)
    return Axis(
        label=f"Time since the first sample [{unit}]", limits=(0.0, reading.duration / second)
    ), second
