# SPDX-License-Identifier: BSD-3-Clause
"""Compared records in people's words: values, equality, spread, and who stands out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval, number, probability

__all__ = [
    "adjusted_p",
    "channel_table",
    "compared_unit",
    "comparison_facts",
    "outlier_lines",
    "parameter_name",
    "record_lines",
    "sameness_lines",
]

Json = Mapping[str, Any]

#: A spread of the logarithm beyond this is told as a factor.
_FACTOR = 0.3
#: An interval whose end is so many times its middle says "nobody knows".
_OPEN = 1e4


def parameter_name(symbol: str) -> str:
    """As it stands in a table."""
    return {"T": "T_b", "mean": "bias"}.get(symbol, symbol)


def compared_unit(channel: Json, symbol: str) -> tuple[str, float]:
    """Unit and factor of a parameter of a channel."""
    return display_unit(channel["kind"], symbol, channel["unit"])


def _parameters(channel: Json) -> list[Json]:
    return [*channel["parameters"], *([channel["bias"]] if channel["bias"] else [])]


def channel_table(document: Json, channel: Json) -> tuple[list[str], list[list[str]]]:
    """Heads and rows: the parameters of each record, then what they say together."""
    parameters = _parameters(channel)
    units = [compared_unit(channel, p["symbol"]) for p in parameters]
    heads = [channel["name"]]
    heads += [f"{parameter_name(p['symbol'])} [{u}]" for p, (u, _) in zip(parameters, units, strict=True)]
    both = list(zip(parameters, units, strict=True))
    rows = [
        [record["name"], *(_value(p["records"][i], f) for p, (_, f) in both)]
        for i, record in enumerate(document["records"])
    ]
    rows.append(["equal?", *(_equality(p["equality"], document["level"]) for p in parameters)])
    rows.append(["if equal", *(_common(p, f, document["level"]) for p, (_, f) in both)])
    rows.append(["would be seen", *(_shift_words(channel, p) for p in parameters)])
    rows.append(["spread", *(_spread_words(channel, p) for p in parameters)])
    rows.append(["middle", *(_middle(p["population"], f) for p, (_, f) in both)])
    rows.append(["the next", *(_next(p["population"], f) for p, (_, f) in both)])
    rows.append(["largest", *(_largest(p) for p in parameters)])
    return heads, [row for row in rows if any(cell != "–" for cell in row[1:])]


def _value(value: Json, factor: float) -> str:
    low, high = _over(value["lower"], factor), _over(value["upper"], factor)
    if value["value"] is None:
        return "–" if high is None else f"< {number(high, 3)}"
    middle, a, b = interval(value["value"] / factor, low, high)
    return f"{middle} [{a}, {b}]"


def _common(parameter: Json, factor: float, level: float) -> str:
    """The one value for all records; none where they differ."""
    test = parameter["equality"]
    return "–" if test is not None and test["p_adjusted"] < level else _value(parameter["common"], factor)


def _over(value: float | None, factor: float) -> float | None:
    return None if value is None else value / factor


def _equality(test: Json | None, level: float) -> str:
    if test is None:
        return "–"
    words = "no" if test["p_adjusted"] < level else "no difference seen"
    return f"{words}, {adjusted_p(test)}"


def adjusted_p(test: Json) -> str:
    """The adjusted p of a test."""
    return probability(min(test["p_adjusted"], 1.0))


def _shift_words(channel: Json, parameter: Json) -> str:
    """The change of one record that the test would have seen."""
    size = parameter["detectable"]
    if size is None:
        return "–"
    if parameter["symbol"] == "mean":
        return f"± {number(size / compared_unit(channel, 'mean')[1], 2)}"
    return f"+{_percent(size)}" if size < 1 else f"{number(1 + size, 2)} times"


def _percent(share: float) -> str:
    return f"{number(100 * share, 2)} %"


def _spread_words(channel: Json, parameter: Json) -> str:
    """Standard deviation between the records, or its limit."""
    population = parameter["population"]
    if population is None:
        return "–"
    ends = population["spread"], population["spread_lower"], population["spread_upper"]
    if parameter["symbol"] == "mean":
        factor = compared_unit(channel, "mean")[1]
        return _spread([_over(e, factor) for e in ends], "")
    if ends[1] > _FACTOR or ends[0] > _FACTOR:
        return _spread([None if e is None else math.exp(min(e, 50.0)) for e in ends], " times", none=1.0)
    return _spread([None if e is None else 100 * e for e in ends], " %")


def _spread(ends: Sequence[float | None], unit: str, none: float = 0.0) -> str:
    value, low, high = ends
    top = "–" if high is None or high > _OPEN * max(value or 0.0, 1.0) else number(high, 2)
    if low is None or low <= none or value is None:
        return f"< {top}{unit}" if top != "–" else "–"
    return f"{number(value, 2)}{unit} [{number(low, 2)}, {top}]"


def _middle(population: Json | None, factor: float) -> str:
    if population is None:
        return "–"
    return _range(population["mean"], population["lower"], population["upper"], factor)


def _next(population: Json | None, factor: float) -> str:
    if population is None or population["next_lower"] is None or population["next_upper"] is None:
        return "–"
    return f"{number(population['next_lower'] / factor, 3)} to {number(population['next_upper'] / factor, 3)}"


def _range(value: float, low: float, high: float | None, factor: float) -> str:
    middle, a, b = interval(value / factor, _over(low, factor), _over(high, factor))
    return f"{middle} [{a}, {b}]"


def _largest(parameter: Json) -> str:
    if parameter["worst"] is None:
        return "–"
    sure = parameter["worst_p"] is not None and parameter["worst_p"] < 0.05
    return parameter["worst"] if sure else f"{parameter['worst']}, not for certain"


# -- tests ---------------------------------------------------------------------------------------------------------


def sameness_lines(document: Json) -> list[tuple[str, str, str, str]]:
    """Channel, curves, parameters, and the lags that differ by themselves."""
    rows = []
    for c in document["channels"]:
        rows.append(
            (
                c["name"],
                _test(c["curve"]),
                _test(c["joint"]),
                _lags(c, document["level"]),
            )
        )
    return rows


def _test(test: Json) -> str:
    return f"χ² {number(test['statistic'], 3)} ({number(test['dof'], 3)} expected), {probability(test['p'])}"


def _lags(channel: Json, level: float) -> str:
    differ = [
        tau
        for tau, p in zip(channel["tau"], channel["lag_p_adjusted"], strict=True)
        if p is not None and p < level
    ]
    if not differ:
        return "none"
    if len(differ) == 1:
        return duration(differ[0])
    return f"{len(differ)}, from {duration(min(differ))} to {duration(max(differ))}"


def outlier_lines(document: Json) -> list[tuple[str, str, str, str, str]]:
    """Channel, what, record, p and what the others do: the records that stand out."""
    rows = []
    for c in document["channels"]:
        outliers = [("Allan curve", c["outlier"])]
        outliers += [(parameter_name(p["symbol"]), p["outlier"]) for p in _parameters(c)]
        for what, o in outliers:
            if o is not None and o["p"] < document["level"]:
                others = "agree" if o["rest_p"] >= document["level"] else "differ, too"
                chance = f"{probability(o['p'])} for {o['looked_at']} looked at"
                rows.append((c["name"], what, o["record"], chance, others))
    return rows


def record_lines(document: Json) -> list[tuple[str, str, str, str, str]]:
    """Name, log, rate, length and sampling of every record."""
    words = {"mean": "means", "point": "points"}
    return [
        (r["name"], r["source"], f"{number(r['rate'], 6)} Hz", duration(r["duration"]), words[r["sampling"]])
        for r in document["records"]
    ]


def comparison_facts(document: Json) -> list[tuple[str, str]]:
    """What the comparison rests on."""
    confidence, level = f"{100 * document['confidence']:g} %", f"{100 * document['level']:g} %"
    families = {"flicker": "flicker", "gauss-markov": "a Gauss-Markov term"}
    slow = ", ".join(f"{c['name']}: {families[c['family']]}" for c in document["channels"])
    return [
        ("intervals", f"{confidence}; '<' is an upper limit, which takes part as such"),
        ("tests", f"{level}; p is adjusted for the number of tests"),
        ("slow noise as", slow),
    ]
