# SPDX-License-Identifier: BSD-3-Clause
"""A curve over the floor of its instrument, in people's units: measured, instrument, sensor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import number

__all__ = ["floor_lines"]

Json = Mapping[str, Any]
Column = Sequence[float | None]


def floor_lines(
    kind: str, own: str, measured: Json, instrument: Json, sensor: Json
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: averaging time, deviation measured, of the instrument, of the sensor with its interval.

    Parameters
    ----------
    kind, own : str
        Of the channel: what it measures, and its own unit.
    measured, instrument, sensor : dict
        With "tau" and "deviation", the sensor with "lower" and "upper" too; lags that one lacks are dashes.
    """
    unit, factor = display_unit(kind, "adev", own)
    heads = ("τ [s]", f"measured [{unit}]", "instrument", "sensor", "95 % interval")
    below = dict(zip(instrument["tau"], instrument["deviation"], strict=True))
    above = dict(zip(measured["tau"], measured["deviation"], strict=True))
    rows = []
    for i, tau in enumerate(sensor["tau"]):
        value, low, high = (_scaled(sensor[k][i], factor) for k in ("deviation", "lower", "upper"))
        cells = (_near(above, tau), _near(below, tau))
        words, interval = number(value, 4), f"{number(low, 4)} to {number(high, 4)}"
        if high is None:
            words, interval = "floor not known", "–"
        elif value is None:
            words, interval = f"< {number(high, 3)}", "not resolved"
        rows.append((f"{tau:.6g}", *(number(_scaled(c, factor), 4) for c in cells), words, interval))
    return heads, rows


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None or value != value else value / factor


def _near(values: Mapping[float, float | None], tau: float) -> float | None:
    """The value at a time that may differ by a rounding."""
    return next((v for t, v in values.items() if abs(t / tau - 1) < 1e-3), None)
