# SPDX-License-Identifier: BSD-3-Clause
"""North in people's words: directions, their intervals, and what an azimuth depends on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from allanite.quantities.number_words import interval, number
from allanite.views.wording.rates import DEG, DEG_H

__all__ = ["angle_budget_lines", "arcs_words", "azimuth_words", "heading_words", "horizontal_words"]

Json = Mapping[str, Any]


def arcs_words(arcs: Sequence[Json]) -> str:
    """An interval of directions; it may wrap, be the whole circle, or two arcs.

    >>> arcs_words([{"start": 6.2657, "stop": 0.0349, "width": 0.0523}])
    '359.0° to 2.0°'
    """
    if not arcs:
        return "no direction at all"
    if any(arc["width"] >= 2 * math.pi for arc in arcs):
        return "the whole circle"
    return " and ".join(_arc(arc) for arc in arcs)


def _arc(arc: Json) -> str:
    decimals = min(max(1 - math.floor(math.log10(max(arc["width"] / DEG, 1e-9))), 0), 6)
    return " to ".join(f"{arc[end] / DEG:.{decimals}f}°" for end in ("start", "stop"))


def azimuth_words(document: Json) -> str:
    """The azimuth with the digits that its standard deviation allows; candidates where there are two."""
    sd = document["total_sd"] or document["sd"]
    decimals = 2 if not sd else min(max(1 - math.floor(math.log10(sd / DEG)), 0), 6)
    if document["azimuth"] is None:
        candidates = [f"{c / DEG:.{decimals}f}°" for c in document["candidates"] if c is not None]
        return " or ".join(candidates) or "–"
    return f"{document['azimuth'] / DEG:.{decimals}f}°"


def angle_budget_lines(document: Json) -> list[tuple[str, str]]:
    """Source and standard uncertainty of the azimuth in degrees; the sum last."""
    budget = {k: v for k, v in document["budget"].items() if v}
    rows = [(name, number(value / DEG, 3)) for name, value in budget.items()]
    whole = math.sqrt(sum(v**2 for v in budget.values()))
    return [*rows, ("together", number(whole / DEG, 3))] if len(rows) > 1 else rows


def horizontal_words(document: Json) -> tuple[str, str, str]:
    """The horizontal rate, its interval and the expected rate in deg/h; a dash where one component alone is seen."""
    value, expected = document["horizontal_rate"], number(document["expected_rate"] / DEG_H, 4)
    low, high = document["horizontal_interval"]
    if value is None or low is None:
        return "–", "not bounded: not both components are seen", expected
    if high is None:
        return number(value / DEG_H), f"at least {number(low / DEG_H)}", expected
    middle, lower, upper = interval(value / DEG_H, low / DEG_H, high / DEG_H)
    return middle, f"[{lower}, {upper}]", expected


def heading_words(document: Json) -> str:
    """Which way headings count, where nothing but that tells an azimuth from its mirror image.

    A second axis would contradict headings that count the other way round; one axis fits either way.
    """
    if len(document["axes"]) > 1:
        return ""
    what = "headings count" if document["rotation"] is None else "the rotation counts"
    return f"{what} clockwise seen from above; counted the other way the azimuth comes out mirrored"
