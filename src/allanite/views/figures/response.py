# SPDX-License-Identifier: BSD-3-Clause
"""A sensor on a rate table: its response less the best straight line, the steps one after another, noise, bandwidth.

Deviations are in ppm of full scale.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from allanite.experiments.rate_table import RateTableEstimate
from allanite.views.figures.earth import quantile
from allanite.views.figures.panel import Array, Axis, Curve, Label, Panel, around, array
from allanite.views.figures.records import clock
from allanite.views.wording.rate_table import PPM, output_unit
from allanite.views.wording.rates import DEG

__all__ = ["VIEWS", "drift_panels", "frequency_panels", "noise_panels", "response_panels", "step_panels"]

VIEWS = ("whole", "response", "steps", "drift", "noise", "frequency")
_SIDES = (
    (0, "mean of a step", "z", "circle"),
    (1, "rate growing", "z", "triangle"),
    (-1, "rate falling", "x", "down"),
)


def response_panels(result: RateTableEstimate) -> list[Panel]:
    """Deviation of the response from its best straight line against the rate, with the fitted curve."""
    points = result.points
    if not points:
        return []
    wide, percent = quantile(result.confidence), f"{100 * result.confidence:g} %"
    fitted = result.fitted
    rate, value, sd = (
        fitted[:, 0] * result.full_scale / DEG,
        fitted[:, 1] / PPM,
        wide * fitted[:, 2] / PPM,
    )
    band = Curve(
        x=rate,
        y=value,
        lower=value - sd,
        upper=value + sd,
        label="fitted",
        colour="orange",
        band_label=f"{percent} band",
    )
    curves = [band]
    for direction, name, colour, marker in _SIDES:
        along = [p for p in points if p.direction == direction]
        if not along:
            continue
        y = array([p.deviation for p in along]) / PPM
        half = wide * array([p.sd for p in along]) / PPM
        curves.append(
            Curve(
                x=array([p.rate for p in along]) / DEG,
                y=y,
                lower=y - half,
                upper=y + half,
                bars=True,
                label=f"{name}, {percent} by the noise",
                colour=colour,
                style="none",
                marker=marker,
            )
        )
    return [
        Panel(
            title=f"Response less its best straight line: {result.verdict.words}",
            x=Axis(label="Rate of the table [deg/s]"),
            y=Axis(label="Deviation [ppm of full scale]", limits=_ends(curves)),
            curves=tuple(curves),
            labels=(Label(x=0.0, y=0.0, text="", colour="ink", place="level"),),
            height=0.4,
            key="above",
        )
    ]


def step_panels(result: RateTableEstimate) -> list[Panel]:
    """Residual of each step, in the order of time, before and after the slow noise was removed."""
    steps = [s for s in result.steps if s.used and math.isfinite(s.residual)]
    size = result.full_output
    if not steps or not size:
        return []
    wide, percent = quantile(result.confidence), f"{100 * result.confidence:g} %"
    unit, second = clock(result.duration)
    x = array([(s.start + s.stop) / 2 for s in steps]) / second
    y, half = (
        array([s.residual for s in steps]) / size / PPM,
        array([s.sd for s in steps]) / size / PPM,
    )
    raw = Curve(
        x=x,
        y=y,
        lower=y - wide * half,
        upper=y + wide * half,
        bars=True,
        label=f"as recorded, {percent} by the noise",
        colour="z",
        style="none",
        marker="circle",
    )
    curves = [raw]
    corrected = array([s.corrected for s in steps]) / size / PPM
    if np.isfinite(corrected).any():
        label = "slow noise removed against the table"
        curves.append(Curve(x=x, y=corrected, label=label, colour="orange", style="none", marker="square"))
    return [
        Panel(
            title="Residual of each step",
            x=Axis(label=f"Time since the first sample [{unit}]", limits=(0.0, result.duration / second)),
            y=Axis(label="Residual [ppm of full scale]", limits=_ends(curves)),
            curves=tuple(curves),
            labels=(Label(x=0.0, y=0.0, text="", colour="ink", place="level"),),
            height=0.28,
            key="above",
        )
    ]


def drift_panels(result: RateTableEstimate) -> list[Panel]:
    """The slow noise that the reference-aided filter took off."""
    aided = result.aided
    if aided is None:
        return []
    unit, second = clock(result.duration)
    text, factor = output_unit(result)
    drift = aided.drift / factor
    return [
        Panel(
            title="Slow noise, from the filter with the fitted response as reference",
            x=Axis(label=f"Time since the first sample [{unit}]", limits=(0.0, result.duration / second)),
            y=Axis(label=f"Slow noise [{text}]", limits=around(drift)),
            curves=(Curve(x=aided.time / second, y=drift, label="removed", colour="z"),),
            height=0.24,
        )
    ]


def noise_panels(result: RateTableEstimate) -> list[Panel]:
    """The noise against the rate, over that of the model, with where it would lie by chance."""
    rows = result.noise_by_rate
    if len(rows) < 2:
        return []
    rate, ratio = array([r.rate for r in rows]), array([r.ratio for r in rows])
    half = quantile(result.confidence) / np.sqrt(2 * array([r.dof for r in rows]))
    percent = f"{100 * result.confidence:g} %"
    expected = Curve(
        x=rate / DEG,
        y=np.ones_like(rate),
        lower=1 - half,
        upper=1 + half,
        label="that of the model",
        colour="guide",
        style="dashed",
        band_label=f"{percent} expected",
    )
    ratios = Curve(x=rate / DEG, y=ratio, label="found", colour="z", style="none", marker="circle")
    return [
        Panel(
            title="Noise against the rate",
            x=Axis(label="Absolute rate of the table [deg/s]"),
            y=Axis(label="Noise / model", limits=around(ratio, 1 - half, 1 + half)),
            curves=(expected, ratios),
            height=0.24,
            key="above",
        )
    ]


def frequency_panels(result: RateTableEstimate) -> list[Panel]:
    """Gain and phase at each frequency."""
    rows = result.frequencies
    if not rows:
        return []
    wide, percent = quantile(result.confidence), f"{100 * result.confidence:g} %"
    lowest = min(rows, key=lambda r: r.frequency)
    frequency = array([r.frequency for r in rows])
    x = Axis(label="Frequency [Hz]", log=True)
    look: dict[str, Any] = {"style": "none", "marker": "circle", "bars": True}
    gains = f"Gain over that at {lowest.frequency:g} Hz"
    gain, gain_half = array([(r.gain, r.gain_sd) for r in rows]).T / lowest.gain
    phase, phase_half = np.degrees(array([(r.phase, r.phase_sd) for r in rows])).T
    return [
        _bode("Gain", gains, frequency, gain, wide * gain_half, x, percent, look),
        _bode("Phase", "Phase [deg]", frequency, phase, wide * phase_half, x, percent, look),
    ]  # fmt: skip


def _bode(
    title: str,
    label: str,
    x: Array,
    y: Array,
    half: Array,
    axis: Axis,
    percent: str,
    look: Mapping[str, Any],
) -> Panel:
    curve = Curve(
        x=x, y=y, lower=y - half, upper=y + half, label=f"found, {percent} by the noise", colour="z", **look
    )
    return Panel(
        title=title,
        x=axis,
        y=Axis(label=label, limits=_ends([curve])),
        curves=(curve,),
        height=0.28,
        key="above",
    )


def _ends(curves: Sequence[Curve]) -> tuple[float, float]:
    parts = [end for c in curves for end in (c.y, c.lower, c.upper) if end is not None]
    return around([0.0] if len(parts) > 3 else parts[0], *parts)
