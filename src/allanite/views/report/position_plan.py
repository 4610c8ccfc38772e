# SPDX-License-Identifier: BSD-3-Clause
"""What the report of a plan of positions says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.blocks import (
    Banner,
    Cell,
    Hero,
    Page,
    PageBlock,
    References,
    Text,
    equation,
    table,
)
from allanite.views.report.measurement import known_facts, measurement_page, views
from allanite.views.wording import (
    duration,
    plan_facts,
    planned_lines,
    position_rows,
    scheme_lines,
    sentence,
)

__all__ = ["page"]

Json = Mapping[str, Any]

FEDOROV = "V. V. Fedorov, “Theory of Optimal Experiments”, Academic Press (1972)."


def page(document: Json) -> Page:
    """The page of a plan of positions."""
    calibration = document["what"] == "calibration"
    return measurement_page(
        document,
        title="Calibration: which positions, how long"
        if calibration
        else "Heading: which positions, how long",
        kicker="Plan",
        facts=[
            ("Positions", str(len(document["positions"]))),
            ("Length", duration(document["total"])),
            ("From rest to rest", duration(document["turn"])),
        ],
        parts={"verdict": _verdict, "pictures": _pictures, "known": _known, "method": _method},
        titles={"known": "What will be known"},
    )


def _verdict(document: Json) -> list[PageBlock]:
    count = len(document["positions"])
    return [
        *(Banner("warning", "Mind.", sentence(note)) for note in document["notes"]),
        Hero(
            duration(document["total"]),
            f"for {count} position{'s' * (count != 1)}",
            f"{duration(document['turn'])} from rest to rest",
            "the goals are reached" if document["reached"] else "the goals are not reached",
            "good" if document["reached"] else "warning",
        ),
        Text(sentence(document["says"])),
        *table(("Number", "Position", "Rest"), position_rows(document), caption="In this order."),
        *table(
            ("Scheme", "reaches the goals after", "sd over goal in this time", "not determined"),
            scheme_lines(document),
            caption="The usual schemes beside it, with equal rests.",
        ),
    ]


def _pictures(document: Json) -> list[PageBlock]:
    pictures = (
        ("sphere", "What points up in each position."),
        ("length", "Standard deviations over their goals, by length of the record."),
        ("schemes", "This plan and the usual schemes."),
    )
    return views(document, pictures)


def _known(document: Json) -> list[PageBlock]:
    rows: list[list[str | Cell]] = [
        [name, unit, Cell(text=sd, look="limit" if name in document["open"] else "value"), goal]
        for name, unit, sd, goal in planned_lines(document)
    ]
    return [
        *table(("Parameter", "Unit", "Standard deviation", "Goal"), rows, caption="Under the noise alone."),
        known_facts(plan_facts(document)),
    ]


def _method(document: Json) -> list[PageBlock]:
    words = (
        "The covariance depends on the positions, the turns and the noise models, not on the data: it is that which "
        "the calibration itself will state. "
        if document["what"] == "calibration"
        else "The covariance is that which the alignment itself will state, computed without a sample. "
    )
    if document["what"] == "calibration":
        words += (
            "Positions are added one by one, each the one that helps most; then they are exchanged for others, left "
            "out or held longer as long as that shortens the record."
        )
    return [Text(words), *equation("least_squares"), References([FEDOROV])]
