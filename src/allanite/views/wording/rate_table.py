# SPDX-License-Identifier: BSD-3-Clause
"""The response to a rate table in people's words: scale factors in the channel's unit, ppm, mrad."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from allanite.errors import InputError
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval, number
from allanite.views.wording.rates import DEG, capitalised

__all__ = [
    "NOISE_ALONE",
    "PPM",
    "ResponseLine",
    "full_output",
    "output_unit",
    "response_budget",
    "response_lines",
    "scale_unit",
    "shape_words",
    "step_rows",
    "table_words",
]

Json = Mapping[str, Any]

PPM = 1e-6
NOISE_ALONE = (
    "The interval of the scale factor holds the noise alone: no uncertainty of the table's rate is stated."
)
#: An entry of a budget below this part of the largest is none.
NEGLIGIBLE = 1e-2
_CLOCKS = ("clock offset", "clock drift", "delay")
_SAYS = {
    "quadratic": "quadratic term",
    "cubic": "cubic term",
    "quartic": "quartic term",
    "quintic": "quintic term",
    "nonlinearity": "nonlinearity, largest",
    "asymmetry": "asymmetry, + less −",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseLine:
    """One number of the response: its name, value, interval, unit, and whether it was seen."""

    name: str
    value: str
    range: str
    unit: str
    answer: str
    kept: bool = False


def scale_unit(document: Json) -> tuple[str, float]:
    """Unit of the scale factor, and the value of one of it in SI of the channel per rad/s; "" for a ratio.

    >>> scale_unit({"kind": "rate", "unit": "deg/s", "channel_scale": 0.0174533})
    ('', 1.0)
    """
    unit = document["unit"]
    if document["kind"] == "rate" and _is_rate(unit):
        return "", 1.0
    size = document["channel_scale"] / DEG
    value = next(
        (abs(p["value"]) for p in document["parameters"] if p["name"] == "scale factor" and p["value"]), 1.0
    )
    if unit == "V" and value / size < 0.5:
        return "mV/(deg/s)", size / 1e3
    return f"{unit or 'units'}/(deg/s)", size


def output_unit(document: Json) -> tuple[str, float]:
    """Unit of the output and its value in SI of the channel; rates in deg/s."""
    if document["kind"] == "rate":
        return "deg/s", DEG
    return display_unit(document["kind"], "mean", document["unit"])


def _is_rate(unit: str) -> bool:
    from allanite.quantities.units import QuantityKind, parse_unit

    try:
        return parse_unit(unit).quantity is QuantityKind.ANGLE_RATE
    except InputError:
        return False


def response_lines(document: Json) -> list[ResponseLine]:
    """Every parameter with its interval, in people's units."""
    return [_line(p, document) for p in document["parameters"]]


def _line(p: Json, document: Json) -> ResponseLine:
    name, unit, factor = p["name"], *_unit(p, document)
    label = capitalised(_SAYS.get(name) or name)
    if p["value"] is None or None in p["interval"]:
        return ResponseLine(name=label, value="–", range="", unit=unit, answer="not determined")
    value, low, high = (v / factor for v in (p["value"], *p["interval"]))
    middle, lower, upper = interval(value, low, high)
    answer = (
        "resolved" if p["resolved"] else f"not resolved: below {number(abs(p['limit']) / abs(factor), 2)}"
    )
    if name in (*_CLOCKS, "bias", "bias without the Earth"):
        answer = ""
    if name == "nonlinearity" and document["span"]:
        share = 100 * p["value"] * document["full_scale"] / document["span"]
        answer = f"{number(share, 2)} % of the span" if p["resolved"] else answer
    kept = name == "scale factor"
    return ResponseLine(
        name=label, value=middle, range=f"[{lower}, {upper}]", unit=unit, answer=answer.strip(), kept=kept
    )


def _unit(p: Json, document: Json) -> tuple[str, float]:
    """Unit of a parameter and its SI value."""
    name, unit = p["name"], p["unit"]
    if name == "scale factor":
        return scale_unit(document)
    if name.startswith("bias"):
        text, factor = display_unit(document["kind"], "mean", document["unit"])
        return (f"{text}/K", factor) if unit.endswith("/K") else (text, factor)
    if unit == "1":
        return ("ppm of full scale" if name in _SAYS and name != "asymmetry" else "ppm"), PPM
    if unit == "1/K":
        return "ppm/K", PPM
    if unit == "rad":
        return "mrad", 1e-3
    if unit == "s":
        return ("ms", 1e-3) if abs(p["value"] or 0.0) < 0.9995 else ("s", 1.0)
    return unit, 1.0


def response_budget(document: Json) -> list[tuple[str, str]]:
    """Source and standard uncertainty of the scale factor in ppm; the sum last."""
    largest = max((v for v in document["budget"].values() if v), default=0.0)
    budget = {name: v for name, v in document["budget"].items() if v and v > NEGLIGIBLE * largest}
    rows = [(name, number(value / PPM, 3)) for name, value in budget.items()]
    whole = math.sqrt(sum(v**2 for v in budget.values()))
    return [*rows, ("together", number(whole / PPM, 3))] if len(rows) > 1 else rows


def table_words(document: Json) -> str:
    """How the table turned.

    >>> table_words({"table": {"kind": "steps", "rate": [0.0, 1.0, -1.0]}, "steps": [{"used": True}] * 3,
    ...     "full_scale": 1.0, "dead_time": 0.5})
    '3 steps up to 57.3 deg/s, 0.5 s left out after each change'
    """
    table, most = document["table"], f"up to {number(document['full_scale'] / DEG, 3)} deg/s"
    left = "the changes lie between the steps"
    if document["dead_time"]:
        left = f"{duration(document['dead_time'])} left out after each change"
    if table["kind"] == "sinusoids":
        low, high = min(table["frequency"]), max(table["frequency"])
        of = f"{number(low, 3)} Hz" if low == high else f"{number(low, 3)} to {number(high, 3)} Hz"
        waves = len(table["frequency"])
        return f"{waves} sinusoid{'s' * (waves != 1)} of {of}, {most}"
    steps = document["steps"]
    if steps:
        used = sum(s["used"] for s in steps)
        count = (
            f"{len(steps)} step{'s' * (len(steps) != 1)}"
            if used == len(steps)
            else f"{used} of {len(steps)} steps used"
        )
        return f"{count} {most}, {left}"
    return f"{table['samples']} {table['quantity']}s at intervals of {duration(table['interval'])}, {most}"


def shape_words(document: Json) -> str:
    """What was fitted."""
    if document["nonlinearity"] == "sign":
        return "two straight lines that meet at zero"
    degree = document["nonlinearity"]
    return "a straight line" if degree == 1 else f"a polynomial of degree {degree}"


def step_rows(document: Json) -> list[Json]:
    """One row for each step, residuals in ppm of full scale."""
    text, factor = output_unit(document)
    key = "".join(c if c.isalnum() else "_" for c in text)
    size = full_output(document)

    def ppm(value: float | None) -> str:
        return "" if value is None or not size else f"{value / size / PPM:.4g}"

    return [
        {
            "number": i,
            "start_s": f"{s['start']:.4f}",
            "stop_s": f"{s['stop']:.4f}",
            "rate_deg_s": f"{s['rate'] / DEG:.9g}",
            f"mean_{key}": "" if s["mean"] is None else f"{s['mean'] / factor:.9g}",
            "residual_ppm": ppm(s["residual"]),
            "sd_ppm": ppm(s["sd"]),
            "corrected_ppm": ppm(s["corrected"]),
            "used": "yes" if s["used"] else "no",
            "why": s["why"],
        }
        for i, s in enumerate(document["steps"], 1)
    ]


def full_output(document: Json) -> float:
    """Output at full scale, in SI of the channel."""
    value = next((p["value"] for p in document["parameters"] if p["name"] == "scale factor"), None)
    return abs(value) * float(document["full_scale"]) if value else 0.0
