# SPDX-License-Identifier: BSD-3-Clause
"""A curve over the floor of its instrument, in people's units: measured, instrument, sensor."""

from __future__ import annotations

import math

import numpy as np

from allanite.noise.allan.channel_curve import ChannelCurve
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import number, upper_limit
from allanite.study.results import SensorCurve

__all__ = ["floor_lines"]


def floor_lines(
    kind: str, shown_in: str, measured: ChannelCurve, instrument: ChannelCurve, sensor: SensorCurve
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: averaging time, deviation measured, of the instrument, of the sensor with its interval.

    Parameters
    ----------
    kind, own : str
        Of the channel: what it measures, and its own unit.
    measured, instrument : ChannelCurve
        Lags that one lacks are dashes.
    sensor : SensorCurve
        What is left.
    """
    unit, factor = display_unit(kind, "adev", shown_in)
    heads = ("τ [s]", f"measured [{unit}]", "instrument", "sensor", "95 % interval")
    rows = []
    for tau, *ends in zip(sensor.tau, sensor.deviation, sensor.lower, sensor.upper, strict=True):
        value, low, high = (end / factor for end in ends)
        words, interval = number(value, 4), f"{number(low, 4)} to {number(high, 4)}"
        if math.isnan(high):
            words, interval = "floor not known", "–"
        elif math.isnan(value):
            words, interval = upper_limit(high), "not resolved"
        others = (number(_near(curve, tau) / factor, 4) for curve in (measured, instrument))
        rows.append((f"{tau:.6g}", *others, words, interval))
    return heads, rows


def _near(curve: ChannelCurve, tau: float) -> float:
    """The deviation at a time that may differ by a rounding; NaN where there is none."""
    near = np.flatnonzero(np.abs(curve.tau / tau - 1) < 1e-3)
    return float(curve.deviation[near[0]]) if near.size else math.nan
