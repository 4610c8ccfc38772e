# SPDX-License-Identifier: BSD-3-Clause
"""The week and the takes in words, for terminal and report."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from allanite.experiments.earth_rate.verdict import EarthRateVerdict
from allanite.quantities.number_words import interval, number
from allanite.views.wording.rates import DEG

__all__ = ["TONE_OF", "WeekLine", "take_name", "week_lines", "week_words"]

Json = Mapping[str, Any]

TONE_OF: Mapping[str, str] = {verdict.value: verdict.tone for verdict in EarthRateVerdict}
"""How the verdict of a take looks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WeekLine:
    """A noise coefficient of the simulated week beside the published one, in the units of the paper."""

    symbol: str
    unit: str
    published: str
    value: str
    range: str
    slope: str
    inside: bool


_WEEK_UNITS = {"N": ("deg/√s", DEG), "B": ("deg/s", DEG), "T": ("s", 1.0), "K": ("deg/s/√s", DEG)}


def week_lines(week: Json) -> list[WeekLine]:
    """N, B, T_b and K: published, fitted, and read off the curve by slope."""
    return [_week_line(row) for row in week["parameters"]]


def _week_line(row: Json) -> WeekLine:
    unit, factor = _WEEK_UNITS[row["symbol"]]
    value, low, high = (None if row[k] is None else row[k] / factor for k in ("value", "lower", "upper"))
    published = row["published"] / factor
    if row["supported"] and value is not None:
        middle, lower, upper = interval(value, low, high)
        shown, ends = middle, f"[{lower}, {upper}]"
    else:
        shown, ends = "not bounded" if high is None else f"below {number(high)}", ""
    return WeekLine(
        symbol="T_b" if row["symbol"] == "T" else row["symbol"],
        unit=unit,
        published=f"{published:.5g} {unit}",
        value=shown,
        range=ends,
        slope="–" if row["slope"] is None else number(row["slope"] / factor),
        inside=(low or 0.0) <= published <= (math.inf if high is None else high),
    )


def week_words(week: Json) -> str:
    """How many of the published values the sets hold: intervals and upper limits apart."""
    lines = week_lines(week)
    two_sided = [line for line in lines if line.range]
    limits = [line for line in lines if line.value.startswith("below")]
    held = sum(line.inside for line in two_sided)
    words = [f"{held} of {len(two_sided)} published parameters with a 95 % interval lie inside it"]
    if limits:
        above = sum(line.inside for line in limits)
        words.append(f"{above} of {len(limits)} with an upper limit alone lie below it")
    if len(two_sided) + len(limits) < len(lines):
        words.append(f"{len(lines) - len(two_sided) - len(limits)} is not bounded")
    return "; ".join(words)


_FAULTS = {
    "coherent": "a bias that turns with the sensor",
    "settling": "a rotation that settles after each turn",
    "drift": "a drift",
}
_TAKES = {1: "2 h", 2: "12 min", 3: "25 min", 4: "60 min"}


def take_name(row: Json) -> str:
    """A take with its length, and what is special about this evaluation of it.

    >>> take_name({"take": 4, "remark": "last 13 min"})
    'take 4, last 13 min'
    """
    special = row.get("remark") or _FAULTS.get(row.get("fault", "")) or _TAKES[row["take"]]
    return f"take {row['take']}, {special}"
