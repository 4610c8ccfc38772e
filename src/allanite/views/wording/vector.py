# SPDX-License-Identifier: BSD-3-Clause
"""The rate vector in people's words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from allanite.quantities.number_words import duration, interval, number
from allanite.views.wording.rates import DEG_H, EarthRateWording, angle, budget_lines, estimate_of, known_rate

__all__ = [
    "EMPTY_BUDGET",
    "axis_lines",
    "latitude_words",
    "left_out_lines",
    "length_lines",
    "pose_words",
    "used_words",
    "vector_budget",
]

Json = Mapping[str, Any]

EMPTY_BUDGET = "The interval holds the noise alone: no uncertainty of scale factor or bias is stated."


# -- rate vector ------------------------------------------------------------------------------------------


def length_lines(document: Json) -> list[EarthRateWording]:
    """The length and the known rate."""
    low, high = document["interval"]
    note = "bias and Earth together, everything in the budget included"
    length = estimate_of(document["length"], low, high, name="length of the vector", note=note, kept=True)
    return [length, known_rate(document["earth_rate"])]


def axis_lines(document: Json) -> list[tuple[str, str, str, str]]:
    """Each axis: name, rate in deg/h, its standard deviation by the noise, and what of the length it is."""
    rows = []
    for i, (name, rate) in enumerate(zip(document["channels"], document["vector"], strict=True)):
        variance = document["covariance"][i][i]
        if rate is None or variance is None:
            continue
        sd = math.sqrt(variance) / DEG_H
        value, _, _ = interval(rate / DEG_H, rate / DEG_H - sd, rate / DEG_H + sd)
        size = math.hypot(*document["vector"])
        share = f"{math.degrees(math.acos(max(-1.0, min(1.0, rate / size)))):.1f}°" if size else "–"
        rows.append((name, value, number(sd, 2), share))
    return rows


def used_words(document: Json) -> str:
    """How much was quiet.

    >>> used_words({"used": [{}, {}], "quiet": 900.0, "duration": 1000.0})
    '15 min of 16.7 min at rest (90 %), in 2 stretches'
    """
    count = len(document["used"])
    share = 100 * document["quiet"] / document["duration"]
    stretches = f"{count} stretch{'es' * (count != 1)}"
    return f"{duration(document['quiet'])} of {duration(document['duration'])} at rest ({share:.3g} %), in {stretches}"


def left_out_lines(document: Json) -> list[tuple[str, str, str, str]]:
    """Why, how often, how long together, and where the longest stretch is; the largest part first."""
    kinds: dict[str, list[tuple[float, float]]] = {}
    for span in document["left_out"]:
        kinds.setdefault(span["why"], []).append((span["start"], span["stop"]))
    rows = sorted(kinds.items(), key=lambda kind: -_total(kind[1]))
    if len(rows) > 1:
        rows.append(("together", [span for spans in kinds.values() for span in spans]))
    return [(why, str(len(spans)), duration(_total(spans)), _longest(spans)) for why, spans in rows]


def _total(spans: Iterable[tuple[float, float]]) -> float:
    return sum(stop - start for start, stop in spans)


def _longest(spans: Iterable[tuple[float, float]]) -> str:
    start, stop = max(spans, key=lambda span: span[1] - span[0])
    return f"{duration(stop - start)}, from {_clock(start)} to {_clock(stop)}"


def _clock(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole // 3600}:{whole % 3600 // 60:02}:{whole % 60:02}"


def latitude_words(document: Json) -> str:
    """The latitude that gravity and the vector make together, beside the one that was given."""
    if document["latitude_found"] is None:
        return "not checked: that takes three accelerometers in the log"
    latitude = (
        f"{math.degrees(document['latitude_found']):.2f}° from the angle between gravity and the vector"
    )
    return latitude if document["latitude"] is None else f"{latitude}; given {angle(document['latitude'])}"


def pose_words(document: Json) -> str:
    """How the sensor stood; nothing where it stood still all the time."""
    turns = document["turns"]
    if len(turns) < 2:
        return ""
    angles = ["unknown" if turn is None else f"{math.degrees(turn):.1f}°" for turn in turns[1:]]
    turned_by = ", ".join(angles) if len(angles) <= 6 else f"{', '.join(angles[:6])} and more"
    return f"{len(turns)} poses, turned between them by {turned_by}"


def vector_budget(document: Json) -> list[tuple[str, str, str]]:
    """Source, standard uncertainty, share; a resolution that is fine enough is no entry."""
    budget = {k: v for k, v in document["budget"].items() if v or k != "resolution"}
    return budget_lines(budget)
