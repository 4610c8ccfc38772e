# SPDX-License-Identifier: BSD-3-Clause
"""A budget of dead reckoning in people's words: errors over time, and what each source makes of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from allanite.quantities.number_words import duration, interval, number
from allanite.views.wording.rates import DEG, angle, model_words

__all__ = [
    "BUDGET_QUANTITIES",
    "budget_facts",
    "budget_rows",
    "growth_rows",
    "largest_sources",
    "quantity_words",
    "rest_before",
    "source_rows",
]

Json = Mapping[str, Any]

#: What people ask for -> its name and its unit.
BUDGET_QUANTITIES: Mapping[str, tuple[str, str, float]] = {
    "position_horizontal": ("Horizontal position", "m", 1.0),
    "position_down": ("Height", "m", 1.0),
    "velocity_horizontal": ("Horizontal velocity", "m/s", 1.0),
    "tilt": ("Tilt", "deg", DEG),
    "heading": ("Heading", "deg", DEG),
}
#: Less than this part of the whole is nothing: what a rest takes off leaves rounding.
_NOTHING = 1e-6
_INITIAL = {
    "position": ("m", 1.0),
    "velocity": ("m/s", 1.0),
    "tilt": ("deg", DEG),
    "heading": ("deg", DEG),
    "gyro_bias": ("deg/h", DEG / 3600),
    "accelerometer_bias": ("mg", 9.80665e-3),
    "gyro_scale": ("ppm", 1e-6),
    "accelerometer_scale": ("ppm", 1e-6),
    "gyro_misalignment": ("mrad", 1e-3),
    "accelerometer_misalignment": ("mrad", 1e-3),
}


def quantity_words(quantity: str) -> str:
    """Name of a quantity with its unit in brackets."""
    name, unit, _ = BUDGET_QUANTITIES[quantity]
    return f"{name} [{unit}]"


def _quantities(document: Json) -> list[str]:
    return [q for q in BUDGET_QUANTITIES if not (document["held"] and q == "position_down")]


def _rows_of(document: Json) -> list[int]:
    """Where the times of the tables stand."""
    times = document["times"]
    return [min(range(len(times)), key=lambda i: abs(times[i] - t)) for t in document["shown"]]


def growth_rows(document: Json) -> tuple[list[str], list[list[str]]]:
    """Heads and rows: each shown time, and the quantities with their intervals."""
    wanted = _quantities(document)
    heads = ["After", *(quantity_words(q) for q in wanted)]
    rows = [
        [
            duration(t),
            *(_cell(document, at, document["quantities"].index(q), BUDGET_QUANTITIES[q][2]) for q in wanted),
        ]
        for t, at in zip(document["shown"], _rows_of(document), strict=True)
    ]
    return heads, rows


def _cell(part: Json, at: int, column: int, factor: float) -> str:
    value, low, high = (part[end][at][column] for end in ("sd", "lower", "upper"))
    if low is None:
        return number(None if value is None else value / factor)
    if high is None:
        return f"{number(value / factor)} [{number(low / factor)}, ∞]"
    if (high - low) <= 1e-9 * high:
        return number(value / factor)
    middle, lower, upper = interval(value / factor, low / factor, high / factor)
    return f"{middle} [{lower}, {upper}]"


def source_rows(document: Json, quantity: str) -> tuple[list[str], list[list[str]]]:
    """Heads and rows: what each source makes of one quantity at the shown times, the whole last."""
    column, factor = document["quantities"].index(quantity), BUDGET_QUANTITIES[quantity][2]
    heads = [quantity_words(quantity), *(duration(t) for t in document["shown"])]
    places = _rows_of(document)
    rows = [
        [s["name"], *(_short(s, document, at, column, factor) for at in places)] for s in document["sources"]
    ]
    return heads, [*rows, ["together", *(number(document["sd"][at][column] / factor) for at in places)]]


def _short(source: Json, document: Json, at: int, column: int, factor: float) -> str:
    if source["is_limit"]:
        high = source["upper"][at][column]
        return "no limit" if high is None else f"< {number(high / factor)}"
    value = source["sd"][at][column]
    return "0" if value <= _NOTHING * document["sd"][at][column] else number(value / factor)


def budget_rows(document: Json) -> tuple[list[str], list[list[str]]]:
    """Heads and rows: what each source makes of every quantity at the end, with intervals."""
    wanted = _quantities(document)
    rows = []
    for source in document["sources"]:
        cells = []
        for q in wanted:
            column, factor = document["quantities"].index(q), BUDGET_QUANTITIES[q][2]
            small = source["is_limit"] or source["sd"][-1][column] <= _NOTHING * document["sd"][-1][column]
            cells.append(
                _short(source, document, -1, column, factor) if small else _cell(source, -1, column, factor)
            )
        rows.append([source["name"], *cells])
    whole = [_cell(document, -1, document["quantities"].index(q), BUDGET_QUANTITIES[q][2]) for q in wanted]
    return ["Source", *(quantity_words(q) for q in wanted)], [*rows, ["together", *whole]]


def rest_before(document: Json) -> str:
    """How long the unit rested before, and what became of the vertical accelerometer's bias."""
    if document["rest"] is None:
        return "not"
    removed = document.get("vertical", True)  # the first documents do not say it: it was always removed
    return f"{duration(document['rest'])}; vertical accelerometer bias {'removed' if removed else 'kept'}"


def budget_facts(document: Json) -> list[tuple[str, str]]:
    """What the budget rests on."""
    stated = [
        f"{key.replace('_', ' ')} {_stated(key, size)}" for key, size in document["initial"].items() if size
    ]
    return [
        ("latitude", angle(document["latitude"])),
        ("heading of the x axis", angle(document["heading"])),
        ("at rest before", rest_before(document)),
        ("height", "held by something else" if document["held"] else "unaided"),
        ("wrong at the start", ", ".join(stated) or "nothing"),
        ("samples", f"{number(document['rate'])} Hz"),
        *((f"noise of {name or 'the sensor'}", model_words(model)) for name, model in document["models"].items()),
    ]  # fmt: skip


def _stated(key: str, size: float) -> str:
    unit, factor = _INITIAL[key]
    return f"{number(size / factor)} {unit}"


def largest_sources(document: Json, quantity: str, most: int) -> Sequence[Json]:
    """Those that matter most at any shown time, in the order of the document."""
    column = document["quantities"].index(quantity)
    places = _rows_of(document)

    def weight(source: Json) -> float:
        shares = [
            (source["sd"][at][column] or 0.0) / (document["sd"][at][column] or math.inf) for at in places
        ]
        return max(shares)

    order = sorted(document["sources"], key=weight, reverse=True)
    kept = [s["name"] for s in order[:most] if weight(s) > 0.01]
    return [s for s in document["sources"] if s["name"] in kept]
