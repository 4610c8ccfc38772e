# SPDX-License-Identifier: BSD-3-Clause
"""Data sheets and bounds in people's words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import interval, number

__all__ = ["StatementLine", "bound_lines", "bound_words", "inflation_words", "statement_lines"]

Json = Mapping[str, Any]

_NAMES = {
    "bias_instability": "bias instability",
    "rms_noise": "rms noise",
    "bias_stability": "bias stability (1 σ)",
}
_SYMBOLS = {"minimum": "B", "sigma": "B"}  # the unit is that of a rate


class StatementLine(NamedTuple):
    """A statement of a data sheet beside what was measured.

    Attributes
    ----------
    name, text : str
        What is stated, and how the sheet writes it and was read.
    stated, measured, ratio : str
        In one unit, which stands at the stated value; the measured value and the ratio with their intervals.
    verdict, note : str
    """

    name: str
    text: str
    stated: str
    measured: str
    ratio: str
    verdict: str
    note: str


def statement_lines(channel: Json) -> list[StatementLine]:
    """The statements about a channel."""
    lines = []
    for s in channel["statements"]:
        unit, factor = _unit(channel, s["symbol"])
        lines.append(
            StatementLine(
                name=_NAMES.get(s["name"], s["name"].replace("_", " ")),
                text=f"{s['text']}{', ' * bool(s['reading'])}{s['reading']}",
                stated=f"{number(s['value'] / factor)} {unit}",
                measured=_with_interval(s["measured"], s["lower"], s["upper"], factor),
                ratio=_with_interval(s["ratio"][0], s["ratio"][1], s["ratio"][2], 1.0),
                verdict=s["verdict"] or "stated, not promised",
                note=s["note"],
            )
        )
    return lines


def _unit(channel: Json, symbol: str) -> tuple[str, float]:
    return display_unit(channel["kind"], _SYMBOLS.get(symbol, symbol), channel["unit"])


def _with_interval(value: float | None, low: float, high: float | None, factor: float) -> str:
    if high is None:
        return "unknown"
    if value is None:
        return f"[{number(low / factor)}, {number(high / factor)}]" if low else f"< {number(high / factor)}"
    middle, lower, upper = interval(value / factor, low / factor, high / factor)
    return f"{middle} [{lower}, {upper}]"


# -- bounds ---------------------------------------------------------------------------------------------------


def bound_words(facts: Json) -> str:
    """What a bound promises."""
    return (
        f"above the sensor everywhere from {facts['shortest']:.3g} to {facts['horizon']:.4g} s with probability "
        f"{100 * facts['probability']:g} %"
    )


def inflation_words(facts: Json) -> str:
    """How much it is inflated."""
    return f"{number(facts['mean'])} times the fit on average, {number(facts['greatest'])} times at most"


def bound_lines(channel: Json) -> list[tuple[str, str, str, str]]:
    """Symbol, fitted, bound and inflation of each term of a bound."""
    facts = channel["bound"]["overbound"]
    fitted, bound = _amplitudes(facts["fitted"]), _amplitudes(channel["bound"]["terms"])
    lines = []
    for name, inflation in facts["factors"].items():
        if name in bound:
            unit, factor = _unit(channel, name.partition("_")[0])
            was = (
                "–"
                if inflation is None
                else f"{number(fitted[name] / factor, 4)} {unit}{_open(channel, name)}"
            )
            grown = "added" if inflation is None else f"× {number(inflation, 4)}"
            lines.append((name, was, f"{number(bound[name] / factor, 4)} {unit}", grown))
    return lines


def _open(channel: Json, symbol: str) -> str:
    """Behind a term that the curve needs, though the record cannot tell it from another."""
    estimates = channel["models"][0]["estimates"]
    limit = any(e["symbol"] == symbol and e["value"] is None and not e["supported"] for e in estimates)
    return ", or a term like it" if limit else ""


def _amplitudes(terms: list[Json]) -> dict[str, float]:
    """Amplitude of each term by its symbol, a Gauss-Markov term by its standard deviation; a second is called _2."""
    amplitudes: dict[str, float] = {}
    for term in terms:
        markov = term["type"] == "gauss_markov"
        symbol = "sigma" if markov else next(key for key in term if key not in ("type", "dt"))
        name, count = symbol, 1
        while name in amplitudes:
            count += 1
            name = f"{symbol}_{count}"
        amplitudes[name] = term["q"] * (term["T"] / 2) ** 0.5 if markov else term[symbol]
    return amplitudes
