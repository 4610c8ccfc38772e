# SPDX-License-Identifier: BSD-3-Clause
"""A plan of positions in people's words: the positions, what they will tell, and the usual schemes beside it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, number
from allanite.views.wording.rates import DEG, angle, model_words

__all__ = ["parameter_unit", "plan_facts", "planned_lines", "position_rows", "scheme_lines"]

Json = Mapping[str, Any]

_KINDS = {"accelerometer": "acceleration", "gyro": "rate"}


def parameter_unit(name: str) -> tuple[str, float]:
    """People's unit of a parameter or a kind of parameter, and its size in SI."""
    sensor, _, rest = name.partition(".")
    if not rest:
        return "deg", DEG
    kind = rest.partition("_")[0]
    if kind == "bias":
        return ("mg", 9.80665e-3) if sensor == "accelerometer" else display_unit(_KINDS[sensor], "mean")
    return ("ppm", 1e-6) if kind == "scale" else ("mrad", 1e-3)


def position_rows(document: Json) -> list[tuple[str, str, str]]:
    """Number, position in words, and how long."""
    return [(str(p["number"]), p["words"], duration(p["dwell"])) for p in document["positions"]]


def planned_lines(document: Json) -> list[tuple[str, str, str, str]]:
    """Parameter, unit, predicted standard deviation, and what was wanted."""
    rows = []
    for name, sd in zip(document["names"], document["sd"], strict=True):
        unit, factor = parameter_unit(name)
        goal = _goal(document["goals"], name)
        predicted = "not determined" if name in document["open"] or sd is None else number(sd / factor, 3)
        rows.append((name, unit, predicted, "" if goal is None else number(goal / factor, 3)))
    return rows


def _goal(goals: Json, name: str) -> float | None:
    values = [goals[key] for key in (name, name.rpartition("_")[0]) if key in goals]
    return min(values) if values else None


def scheme_lines(document: Json) -> list[tuple[str, str, str, str]]:
    """Scheme, when it reaches the goals, largest sd over its goal in the time of the plan, and how much stays open."""
    here = f"{len(document['positions'])} positions" if len(document["positions"]) > 1 else "1 position"
    ratio = document["worst"]
    rows = [
        (
            f"this plan, {here}",
            duration(document["total"]) if document["reached"] else "never",
            "–" if ratio is None else number(ratio, 2),
            str(len(document["open"]) or ""),
        )
    ]
    for s in document["schemes"]:
        rows.append(
            (
                s["name"],
                "never" if s["total"] is None else duration(s["total"]),
                "–" if s["worst"] is None else number(s["worst"], 2),
                str(len(s["open"]) or ""),
            )
        )
    return rows


def plan_facts(document: Json) -> list[tuple[str, str]]:
    """What the plan rests on."""
    latitude = document["latitude"]
    return [
        ("whole record", duration(document["total"])),
        ("from rest to rest", duration(document["turn"])),
        ("latitude", "not given" if latitude is None else angle(latitude)),
        *((f"noise of {name}", model_words(model)) for name, model in document["models"].items()),
    ]
