# SPDX-License-Identifier: BSD-3-Clause
"""What the report of a budget of dead reckoning says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.blocks import Banner, Hero, Page, PageBlock, References, Text, table
from allanite.views.report.measurement import known_facts, measurement_page, views
from allanite.views.wording import (
    BUDGET_QUANTITIES,
    angle,
    budget_facts,
    budget_rows,
    duration,
    growth_rows,
    number,
    rest_before,
    sentence,
    source_rows,
)

__all__ = ["page"]

Json = Mapping[str, Any]

TITTERTON = "D. H. Titterton, J. L. Weston, “Strapdown Inertial Navigation Technology”, 2nd ed., IET (2004)."
ZOU = (
    "G. Y. Zou, A. Donner, “Construction of confidence limits about effect measures”, Statistics in Medicine 27 "
    "(2008) 1693."
)


def page(document: Json) -> Page:
    """The page of a budget of dead reckoning."""
    return measurement_page(
        document,
        title="Dead reckoning: what the noise costs",
        kicker="Error budget",
        facts=[
            ("Length", duration(document["duration"])),
            ("Latitude", angle(document["latitude"])),
            ("At rest before", rest_before(document)),
            ("Height", "held by something else" if document["held"] else "unaided"),
        ],
        parts={"verdict": _verdict, "pictures": _pictures, "sources": _sources, "method": _method},
        titles={"verdict": "Errors", "sources": "By source"},
    )


def _verdict(document: Json) -> list[PageBlock]:
    column = document["quantities"].index("position_horizontal")
    low, high = document["lower"][-1][column], document["upper"][-1][column]
    known = (
        "no interval: a model states none"
        if low is None
        else f"[{number(low)}, {number(high) if high else '∞'}] m"
    )
    heads, rows = growth_rows(document)
    return [
        Hero(
            f"{number(document['sd'][-1][column])} m",
            f"horizontal position after {duration(document['duration'])}",
            known,
            "one standard deviation, unaided",
            "good",
        ),
        Text(sentence(document["says"])),
        *(Banner("warning", "Mind.", sentence(note)) for note in document["notes"]),
        *table(heads, rows, caption=_caption(document)),
    ]


def _caption(document: Json) -> str:
    percent = f"{100 * document['confidence']:g} %"
    return (
        f"One standard deviation; in brackets the {percent} interval that those of the models' parameters leave. The "
        "horizontal ones and the tilt are roots of the sum of the variances along (about) north and east."
    )


def _pictures(document: Json) -> list[PageBlock]:
    wanted = [("position", "Horizontal position"), ("velocity", "Horizontal velocity")]
    wanted += [] if document["held"] else [("height", "Height")]
    wanted += [("tilt", "Tilt"), ("heading", "Heading")]
    return views(
        document,
        [(view, f"{name} over time: all sources together, and those that matter most.") for view, name in wanted],
    )  # fmt: skip


def _sources(document: Json) -> list[PageBlock]:
    heads, rows = budget_rows(document)
    last = [row[0] == "together" for row in rows]
    blocks = table(heads, rows, caption=f"After {duration(document['duration'])}.", kept=last)
    for quantity in BUDGET_QUANTITIES:
        if not (document["held"] and quantity == "position_down"):
            heads, rows = source_rows(document, quantity)
            blocks += table(heads, rows, caption="One standard deviation, by source.", kept=last)
    return blocks


def _method(document: Json) -> list[PageBlock]:
    return [
        Text(
            "The covariance of the linear error model of a level navigator at rest on the rotating ellipsoid, "
            "Schuler’s and Foucault’s oscillation included, driven by each noise term as an exact process: nothing is "
            "stepped. Flicker is the sum of Gauss-Markov states that the filter uses, from a sample to five times the "
            "whole length; the constant level that it has besides belongs to the turn-on bias. The axes are "
            "independent."
        ),
        Text(
            "Each parameter of a noise model makes a part of the variance, whose ends follow from its own interval; "
            "the distances of the ends add as the estimates correlate. What the record does not resolve has an upper "
            "limit only, and enters the upper end."
        ),
        known_facts(budget_facts(document)),
        References([TITTERTON, ZOU]),
    ]
