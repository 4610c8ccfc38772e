# SPDX-License-Identifier: BSD-3-Clause
"""Words for an axis that was turned: between north and south, or between up and down."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.experiments.reversals.sides import direction_of, is_vertical, sides_of, triple_of
from allanite.quantities.earth import DEG_H
from allanite.quantities.number_words import interval, number
from allanite.quantities.units import STANDARD_GRAVITY

__all__ = ["axis_facts", "dwell_direction", "function_of_latitude", "reading_words", "unstated_words"]

Json = Mapping[str, Any]


def function_of_latitude(document: Json) -> str:
    """What takes the latitude to the part of the Earth's rotation along the axis: "sine" or "cosine"."""
    return "sine" if is_vertical(document["first"]) else "cosine"


def dwell_direction(document: Json, sign: int) -> str:
    """Where the axis pointed in a dwell; "unknown" where that is not known."""
    return direction_of(document["first"], sign)


def reading_words(document: Json, name: str) -> tuple[str, str]:
    """Name and note of a simple estimator."""
    plus, minus = sides_of(document["first"])
    function = "sin" if is_vertical(document["first"]) else "cos"
    notes = {
        "pairs": f"the seed paper's estimator: ({plus} − {minus}) / (2 {function} latitude)",
        triple_of(document["first"]): "three dwells at a time: a linear drift cancels",
    }
    return "pairs of dwells" if name == "pairs" else name, notes.get(name, "")


def axis_facts(document: Json) -> list[tuple[str, str]]:
    """What the axis saw beside what is expected of it, and the g-sensitivity of a vertical axis; each with its name."""
    found = document.get("component")
    if not found or found["value"] is None:
        return []
    plus, minus = sides_of(document["first"])
    expected = found["expected"] / DEG_H
    facts = [("component", f"{_with_ends(found, DEG_H, 'deg/h')} {plus}")]
    of_latitude = f"the known rate times the {function_of_latitude(document)} of the latitude"
    sd = abs(expected) * (document["budget"].get("latitude") or 0.0) / document["earth_rate"]
    by = f" (standard deviation {number(sd, 2)} by the latitude)" if sd else ""
    facts.append(
        ("expected", f"{expected:.3f} deg/h {plus}, {-expected:.3f} deg/h {minus}{by}: {of_latitude}")
    )
    gravity = document.get("g_sensitivity")
    if gravity:
        words = _with_ends(gravity, DEG_H / STANDARD_GRAVITY, "deg/h/g")
        facts.append(("g-sensitivity", f"{words} if the Earth turns at its known rate"))
    return facts


def unstated_words(document: Json, is_: str) -> str:
    """That nothing is stated beside the noise."""
    last = "g-sensitivity" if is_vertical(document["first"]) else "heading"
    return f"The interval holds the noise alone: no uncertainty of scale factor, latitude, tilt or {last} {is_} stated."


def _with_ends(found: Json, factor: float, unit: str) -> str:
    value, (low, high) = found["value"], found["interval"]
    if low is None or high is None:
        return f"{number(value / factor, 5)} {unit}"
    middle, lower, upper = interval(value / factor, low / factor, high / factor)
    return f"{middle} {unit} [{lower}, {upper}]"
