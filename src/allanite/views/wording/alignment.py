# SPDX-License-Identifier: BSD-3-Clause
"""An alignment in people's words: angles with the digits of their intervals, budget, biases, what stands beside it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

from allanite.experiments.north import Arc
from allanite.quantities.number_words import duration, interval, number
from allanite.views.wording.north import arcs_words
from allanite.views.wording.rates import DEG, DEG_H

__all__ = [
    "AngleLine",
    "alignment_budget",
    "attitude_lines",
    "axes_words",
    "bias_words",
    "coarse_lines",
    "direction_words",
    "horizontal_line",
    "latitude_line",
    "naive_words",
    "stand_words",
    "standing_words",
]

Json = Mapping[str, Any]

#: A bias is known better than before, if by no more than to this part of its standard deviation then.
_PARTLY = 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class AngleLine:
    """One line of the result: a name, the value, its interval, and what it should be, if that is known."""

    name: str
    value: str
    range: str
    expected: str = ""


def direction_words(attitude: Json) -> str:
    """A heading with the digits of its interval; a dash where there is none.

    >>> direction_words({"heading": 1.5707963, "heading_sd": 0.013, "interval": {"width": 0.052}})
    '90.0°'
    """
    if attitude["heading"] is None:
        return "–"
    width = attitude["interval"]["width"] / DEG
    decimals = min(max(1 - math.floor(math.log10(max(width, 1e-9))), 0), 6)
    turned = round(attitude["heading"] / DEG, decimals) % 360
    return f"{turned:.{decimals}f}°"


def attitude_lines(document: Json) -> list[AngleLine]:
    """Heading, roll and pitch at the end; the heading at the beginning where the unit was turned."""
    last, first = document["last"], document["first"]
    z = NormalDist().inv_cdf(0.5 + 0.5 * document["confidence"])
    lines = [_heading(last, "heading" if document["mode"] == "static" else "heading at the end")]
    lines += [_level(last, name, z) for name in ("roll", "pitch")]
    if document["mode"] != "static":
        lines.append(_heading(first, "heading at the beginning"))
    return lines


def _heading(attitude: Json, name: str) -> AngleLine:
    axis = attitude["heading_axis"]
    words = name if axis == "forward" else f"{name}, of the {axis} axis"
    return AngleLine(
        name=words, value=direction_words(attitude), range=arcs_words([Arc.from_json(attitude["interval"])])
    )


def _level(attitude: Json, name: str, z: float) -> AngleLine:
    value, sd = attitude[name] / DEG, attitude[f"{name}_sd"]
    if sd is None:
        return AngleLine(name=name, value="–", range="not told from the heading: the nose points up or down")
    middle, low, high = interval(value, value - z * sd / DEG, value + z * sd / DEG)
    return AngleLine(name=name, value=f"{middle}°", range=f"{low}° to {high}°")


def horizontal_line(document: Json) -> AngleLine:
    """The horizontal rate beside that of the Earth."""
    value, expected = document["horizontal_rate"], f"{number(document['expected_rate'] / DEG_H, 4)} deg/h"
    low, high = document["horizontal_interval"]
    name = "horizontal rate"
    if value is None or high is None:
        return AngleLine(name=name, value="–", range="not told from the biases", expected=expected)
    middle, lower, upper = interval(value / DEG_H, low / DEG_H, high / DEG_H)
    return AngleLine(name=name, value=f"{middle} deg/h", range=f"{lower} to {upper}", expected=expected)


def latitude_line(document: Json) -> AngleLine | None:
    """The latitude by the angle between gravity and the rotation, beside the one that was given."""
    latitude, expected = document["latitude_found"], f"{document['latitude'] / DEG:.6g}°"
    if latitude is None:
        return None
    ends = document["latitude_interval"]
    middle, low, high = interval(latitude / DEG, ends[0] / DEG, ends[1] / DEG)
    return AngleLine(name="latitude", value=f"{middle}°", range=f"{low}° to {high}°", expected=expected)


def alignment_budget(document: Json) -> list[tuple[str, str]]:
    """Source and standard uncertainty of the heading in degrees, the whole last; what is negligible left out."""
    budget = document["budget"]
    whole = budget.get("together")
    if not whole:
        return []
    kept = {k: v for k, v in budget.items() if k != "together" and v > 1e-3 * whole}
    return [*((name, number(v / DEG, 3)) for name, v in kept.items()), ("together", number(whole / DEG, 3))]


def bias_words(bias: Json) -> tuple[str, str, str, str]:
    """Value, standard deviation, what was known before [deg/h], and whether the turns tell it from the Earth."""
    before = "nothing" if bias["before"] is None else number(bias["before"] / DEG_H, 3)
    if bias["value"] is None or bias["sd"] is None:
        return "–", "–", before, "not told from the Earth"
    value, sd = bias["value"] / DEG_H, bias["sd"] / DEG_H
    middle, _, _ = interval(value, value - sd, value + sd)
    return middle, number(sd, 2), before, _told(bias)


def _told(bias: Json) -> str:
    """What determines a bias."""
    if bias["separable"]:
        return "by the record"
    gained = bias["before"] is not None and bias["sd"] < _PARTLY * bias["before"]
    return "partly by the record" if gained else "as it was known before"


_WAYS = {"F": "forward", "B": "backward", "R": "right", "L": "left", "D": "down", "U": "up"}


def axes_words(document: Json) -> str:
    """Where the axes of the sensors point.

    >>> axes_words({"axes": "FLU"})
    'x forward, y left, z up (FLU)'
    """
    axes = document["axes"]
    return f"{', '.join(f'{a} {_WAYS[way]}' for a, way in zip('xyz', axes, strict=True))} ({axes})"


def coarse_lines(document: Json) -> list[tuple[str, str, str, str]]:
    """TRIAD and QUEST: name, heading, roll and pitch of the first stand."""
    return [
        (c["name"], *(_degrees(c[name], 3) for name in ("heading", "roll", "pitch")))
        for c in document["coarse"]
    ]


def _degrees(angle: float | None, decimals: int) -> str:
    # a zero without its sign
    return "–" if angle is None else f"{round(angle / DEG, decimals) + 0.0:.{decimals}f}°"


def naive_words(document: Json) -> str:
    """What the plain mean of the beginning would have said."""
    naive = document["naive"]
    if naive is None or naive["heading"] is None:
        return ""
    words = (
        f"{_degrees(naive['heading'], 1)}, with {naive['rate'] / DEG_H:.2f} deg/h: the plain mean of the first "
        f"{duration(naive['duration'])}"
    )
    return f"{words}; not to be used" if naive["flagged"] else f"{words}; it agrees"


def standing_words(document: Json) -> str:
    """How the unit stood."""
    rest = sum(stop - start for start, stop in document["spans"])
    if document["mode"] == "rotation":
        return f"turning all the time: {document['revolutions']:.1f} revolutions about an axis {_tilted(document)}"
    count = len(document["spans"])
    stretches = f"{count} stretch{'es' * (count != 1)}"
    rests = f"{duration(rest)} of {duration(document['duration'])} at rest, in {stretches}"
    stands = len(document["stands"])
    return f"{rests} and one attitude" if stands == 1 else f"{rests} and {stands} attitudes"


def _tilted(document: Json) -> str:
    return f"{document['tilt'] / DEG:.2f}° from the vertical"


def stand_words(stand: Json) -> tuple[str, str, str, str, str]:
    """When, how long at rest, azimuth since the first stand, roll and pitch."""
    return (
        f"{stand['start']:.0f} to {stand['stop']:.0f} s",
        duration(stand["rest"]),
        *(_degrees(stand[name], 2) for name in ("turned", "roll", "pitch")),
    )  # type: ignore[return-value]
