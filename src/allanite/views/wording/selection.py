# SPDX-License-Identifier: BSD-3-Clause
"""Sets of terms in people's words: candidates with their parameters, terms with their weight, lines."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval, number, probability

__all__ = ["candidate_lines", "chosen_line_lines", "selection_facts", "term_lines", "weight_words"]

Json = Mapping[str, Any]

#: Terms in the order of their averaging times, and which parameters they have.
_PARAMETERS = {
    "Q": ("Q",), "N": ("N",), "B": ("B",), "G": ("sigma", "B_equiv", "T"),
    "GG": ("sigma", "B_equiv", "T", "sigma_2", "B_equiv_2", "T_2"), "K": ("K",), "R": ("R",),
}  # fmt: skip
_NAMES = {"G": "Gauss-Markov", "GG": "two Gauss-Markov terms"}


def weight_words(weight: float) -> str:
    """A weight as people write it.

    >>> weight_words(0.613), weight_words(0.0012), weight_words(0.9999)
    ('61 %', '< 1 %', '> 99 %')
    """
    if weight < 0.01:
        return "< 1 %"
    return "> 99 %" if weight > 0.99 else f"{100 * weight:.0f} %"


def candidate_lines(channel: Json, most: int = 8) -> list[tuple[str, float, str, str, str]]:
    """Terms, weight, score, parameters and goodness of the first candidates."""
    return [
        (
            c["words"],
            c["weight"],
            f"{c['score']:.1f}" if c["score"] < -0.05 else "best",
            _parameters(channel, c["parameters"]),
            probability(c["p"]),
        )
        for c in channel["candidates"][:most]
    ]


def _parameters(channel: Json, parameters: Json) -> str:
    parts = []
    for symbol, value in parameters.items():
        if not symbol.startswith(("amplitude", "frequency")):
            unit, factor = _unit(channel, symbol)
            parts.append(
                f"{_name(symbol)} {number(value / factor)} {unit}" if value else f"{_name(symbol)} 0"
            )
    return ", ".join(parts)


def _name(symbol: str) -> str:
    return symbol.replace("T", "T_b")


def _unit(channel: Json, symbol: str) -> tuple[str, float]:
    return display_unit(channel["kind"], symbol.removesuffix("_2"), channel["unit"])


def term_lines(channel: Json) -> list[tuple[str, str, str]]:
    """Term, weight of the sets that hold it, and its parameters with their intervals if the best set holds it."""
    estimates = {e["symbol"]: e for e in channel["model"]["estimates"]}
    elsewhere = (
        "G" if "sigma_2" in estimates else "GG"
    )  # of one and two Gauss-Markov terms, that which is not the best
    rows = []
    for letter, symbols in _PARAMETERS.items():
        weight = channel["presence"][letter]
        shown = [s for s in symbols if s in estimates and letter != elsewhere]
        texts = [_estimate(channel, estimates[s]) for s in shown]
        if letter != "GG" or texts or weight > 0.01:
            rows.append((_NAMES.get(letter, letter), weight_words(weight), ", ".join(texts) or "–"))
    return rows


def _estimate(channel: Json, e: Json) -> str:
    unit, factor = _unit(channel, e["symbol"])
    upper = math.inf if e["upper"] is None else e["upper"] / factor
    if e["value"] is None:
        limit = f"< {number(upper)} {unit}" if math.isfinite(upper) else "not identified"
        return f"{_name(e['symbol'])} {limit}"
    value, low, high = interval(e["value"] / factor, e["lower"] / factor, upper)
    return f"{_name(e['symbol'])} {value} [{low}, {high}] {unit}"


def chosen_line_lines(channel: Json) -> list[tuple[str, str, str, str]]:
    """Frequency, amplitude, gain against price, and whether the line is a term."""
    unit, factor = display_unit(channel["kind"], "mean", channel["unit"])
    return [
        (
            f"{number(line['frequency'], 6)} Hz",
            "–" if line["amplitude"] is None else f"{number(line['amplitude'] / factor)} {unit}",
            f"{number(line['gain'])} of {number(line['price'])}",
            "a term" if line["kept"] else "not supported",
        )
        for line in channel["lines"]
    ]


def selection_facts(channel: Json) -> list[tuple[str, str]]:
    """What the choice rests on."""
    best = channel["candidates"][0]
    left_out = channel["shortest"] > 1.5 * channel["curve"]["dt"]
    return [
        ("record", f"{duration(channel['duration'])}, {channel['samples']} samples"),
        ("sets tried", str(channel["tried"])),
        ("goodness of the best", f"χ² {best['chi2']:.0f} ({best['dof']} expected), {probability(best['p'])}"),
        (
            "left out",
            f"what happens within {duration(channel['shortest'])}, which no sum of terms explains"
            if left_out
            else "",
        ),
    ]
