# SPDX-License-Identifier: BSD-3-Clause
"""Two noise models side by side in people's words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from allanite.noise import Estimate, NoiseModel
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval, number
from allanite.views.wording.study import COLUMNS, column_of, reading, shown_symbol

__all__ = ["drift_lines", "drift_unit", "pair_lines", "rest_words"]

Json = Mapping[str, Any]


def drift_unit(kind: str, unit: str = "") -> tuple[str, float]:
    """The unit in which people read what a noise adds up to, and its size in SI.

    >>> drift_unit("rate")[0], drift_unit("acceleration")[0], drift_unit("counts", "LSB")[0]
    ('deg', 'm/s', 'LSB·s')
    """
    if kind in ("rate", "angle"):
        return "deg", math.radians(1)
    if kind in ("acceleration", "velocity"):
        return "m/s", 1.0
    return f"{unit or 'units'}·s", 1.0


def drift_lines(channel: Json) -> list[tuple[str, str, str, str]]:
    """Time, drift of each, and the ratio with its interval."""
    unit, factor = drift_unit(channel["kind"], channel["unit"])
    lines = []
    for line in channel["drifts"]:
        first, second = (f"{number(line[key] / factor)} {unit}" for key in ("first", "second"))
        ratio = number(line["ratio"])
        if line["lower"] is None and any(channel["intervals"]):
            ratio += " [not resolved]"
        if line["lower"] is not None:
            ratio = "{} [{}, {}]".format(*_ratio(line["ratio"], line["lower"], line["upper"]))
        lines.append((f"{line['seconds']:g} s", first, second, ratio))
    return lines


def _ratio(value: float, lower: float, upper: float) -> tuple[str, str, str]:
    """A ratio and its interval; digits of each for itself where it spans more than a factor of two."""
    if lower > 0 and upper > 2 * lower:
        return number(value, 2), number(lower, 2), number(upper, 2)
    return interval(value, lower, upper)


def pair_lines(channel: Json) -> list[tuple[str, str, str, str]]:
    """Symbol with its unit, the parameter of each, and the ratio of the two values."""
    both = [_parameters(channel[key], channel) for key in ("first", "second")]
    lines = []
    for symbol in COLUMNS:
        if not any(symbol in parameters for parameters in both):
            continue
        texts = [parameters[symbol][0] if symbol in parameters else "–" for parameters in both]
        values = [parameters[symbol][1] if symbol in parameters else None for parameters in both]
        ratio = "–"
        if values[0] and values[1]:
            ratio = number(values[1] / values[0])
        unit = display_unit(channel["kind"], symbol, channel["unit"])[0]
        lines.append((f"{shown_symbol(symbol)}, {unit}", *texts, ratio))
    return lines  # type: ignore[return-value]


def _parameters(model: Json, channel: Json) -> dict[str, tuple[str, float | None]]:
    """By symbol: words, and the value where one is known."""
    parameters: dict[str, tuple[str, float | None]] = {}
    for estimate in map(Estimate.from_json, model["estimates"]):
        symbol = column_of(estimate.symbol)
        if symbol in COLUMNS and (symbol != "T" or estimate.supported):
            read = reading(channel["kind"], channel["unit"], estimate)
            words = " ".join(part for part in (read.value, read.range) if part)
            parameters[symbol] = words, estimate.value if estimate.supported else None
    if not model["estimates"]:
        for symbol, value in _stated(model).items():
            factor = display_unit(channel["kind"], symbol, channel["unit"])[1]
            parameters[symbol] = number(value / factor), value
    return parameters


def _stated(model: Json) -> dict[str, float]:
    """Coefficients of a model that was not fitted; of several Gauss-Markov terms the first."""
    values: dict[str, float] = {}
    for term in NoiseModel.from_json(model).terms:
        of_term = {s: float(getattr(term, s)) for s in COLUMNS if hasattr(term, s)}
        if hasattr(term, "B_equiv"):
            of_term["B"] = float(term.B_equiv)
        values = {**of_term, **values}
    return values


def rest_words(document: Json) -> str:
    """What the drift is."""
    rest = document["rest"]
    before = "as long at rest just before" if rest is None else f"{duration(rest)} at rest just before"
    return (
        "Drift: standard deviation (1 σ) of the angle, or velocity, that the noise adds up to without help, the bias "
        f"being its mean over {before}. The interval of the ratio allows for terms that a record does not show, up to "
        "their limits"
    )
