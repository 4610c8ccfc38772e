# SPDX-License-Identifier: BSD-3-Clause
"""What the lines before a table say: sample rate, unit, serial number, sensor."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from allanite.errors import InputError
from allanite.quantities.units import QuantityKind, parse_unit

__all__ = ["facts_in", "rate_in", "units_in"]

_NUMBER = r"(?P<value>[+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)"
_SIGN = r"[\"'\s]*[:=][\"'\s]*[,;\t]?[\"'\s]*|[\"'\s]*[,;][\"'\s]*"
_GAP = r"(?:" + _SIGN + r"|\s+(?:is\s+|of\s+)?)"
_BRACKET = r"\s*(?:[\[(](?P<before>[^\])]*)[\])])?"
_RATES = (
    r"(?:\b|_)(?:fs|f_s|odr|abtastrate|(?:sample|sampling|output|data|output data|update)[ _-]?(?:rate|frequency))\b",
    r"(?<!baud )(?<!bit )\b(?:rate|frequency|frequenz)\b",
)
_PERIOD = r"(?:\b|_)(?:dt|ts|(?:sample|sampling|data)[ _-]?(?:interval|period|time)|period|tau0)\b"
_HERTZ = r"(?:\s*(?P<unit>[kM]?hz|sps|samples/s|1/s|s\^-1)(?![\w/])|(?!\s*[\w/°.]))"
_SECONDS = r"\s*(?P<unit>[a-zµμ]+)?"
#: Pattern, and whether it states the interval instead of the rate. A bare "rate" or "frequency" needs a sign:
#: "frequency of 10 MHz" says what was measured.
_PATTERNS = (
    (re.compile(_RATES[0] + _BRACKET + _GAP + _NUMBER + _HERTZ, re.IGNORECASE), False),
    (re.compile(_RATES[1] + _BRACKET + "(?:" + _SIGN + ")" + _NUMBER + _HERTZ, re.IGNORECASE), False),
    (re.compile(_PERIOD + _BRACKET + _GAP + _NUMBER + _SECONDS, re.IGNORECASE), True),
)
_UNIT = re.compile(r"\bunits?\b(?:" + _GAP + r"(?P<unit>[^\s,;\"']+)|[ \t]*[:=,;][\s,;]*$)", re.IGNORECASE)
_SERIAL = re.compile(
    r"\b(?:s/?n|serial(?:[ _]?(?:no|number|nr))?\.?)" + _GAP + r"(?P<text>[\w-]+)", re.IGNORECASE
)
_SENSOR = re.compile(r"\b(?:sensor|device|model|instrument|imu)\s*[:=,;]\s*(?P<text>[^,;\"]+)", re.IGNORECASE)


def rate_in(preamble: Sequence[str]) -> tuple[float | None, str, tuple[str, ...]]:
    """The sample rate [Hz] that the preamble states, the line that states it, and what had to be guessed."""
    rates = [(r, line.strip()) for line in preamble for r in [_rate(line)] if r is not None]
    if not rates:
        return None, "", ()
    guesses: tuple[str, ...] = ()
    if len({round(r, 9) for r, _ in rates}) > 1:
        guesses = (f"several rates in the preamble: {rates[0][1]!r} is used",)
    return rates[0][0], f"preamble: {rates[0][1]}", guesses


def _rate(line: str) -> float | None:
    for pattern, inverse in _PATTERNS:
        match = pattern.search(line)
        if match is None:
            continue
        factor = _factor((match["unit"] or match["before"] or ("s" if inverse else "Hz")).strip(), inverse)
        value = float(match["value"].replace(",", ".")) * (factor or 0.0)
        if value > 0 and math.isfinite(value):
            return 1.0 / value if inverse else value
    return None


def _factor(unit: str, inverse: bool) -> float | None:
    if unit.lower() in ("sps", "samples/s"):
        unit = "Hz"
    try:
        return parse_unit(unit, QuantityKind.TIME if inverse else QuantityKind.FREQUENCY).factor
    except InputError:
        return None


def units_in(preamble: Sequence[str]) -> list[str]:
    """The units that the preamble states, as they stand there; "" for one that is left open."""
    return [match["unit"] or "" for match in map(_UNIT.search, preamble) if match]


def facts_in(preamble: Sequence[str]) -> dict[str, str]:
    """Serial number and sensor, where the preamble names them."""
    facts = {"serial": _first(_SERIAL, preamble, "text"), "sensor": _first(_SENSOR, preamble, "text")}
    return {k: v for k, v in facts.items() if v}


def _first(pattern: re.Pattern[str], lines: Sequence[str], group: str) -> str | None:
    return next((m[group].strip() for m in map(pattern.search, lines) if m), None)
