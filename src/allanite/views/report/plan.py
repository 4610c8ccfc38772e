# SPDX-License-Identifier: BSD-3-Clause
"""What the report of a plan says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.blocks import (
    Banner,
    Cell,
    Hero,
    Page,
    PageBlock,
    Text,
    drawn,
    equation,
    pairs,
    table,
)
from allanite.views.report.measurement import measurement_page
from allanite.views.wording import angle, duration, goal_words, model_words, number, plan_table, sentence

__all__ = ["page"]

Json = Mapping[str, Any]


def page(document: Json) -> Page:
    """The page of a plan."""
    rate = document["what"] == "rate"
    return measurement_page(
        document,
        title="Earth rate: how long, which dwell" if rate else "North: how long, which dwell",
        kicker="Plan",
        facts=[
            ("Goal", goal_words(document)),
            ("Latitude", angle(document["latitude"])),
            ("Lost at each turn", f"{document['dead_time']:g} s"),
            ("Positions", str(document["positions"])),
            ("Axes", str(document["axes"])),
        ],
        parts={"verdict": _verdict, "pictures": _pictures, "method": _method},
    )


def _verdict(document: Json) -> list[PageBlock]:
    made = plan_table(document)
    rows: list[list[str | Cell]] = [
        [
            dwell,
            *(Cell(text=c, look="value best" if made.best[j] == i else "value") for j, c in enumerate(cells)),
            reached,
        ]
        for i, (dwell, cells, reached) in enumerate(made.rows)
    ]
    blocks: list[PageBlock] = [Banner("warning", "Doubtful.", sentence(n)) for n in document.get("notes", ())]
    if document["duration"] is not None:
        blocks.append(
            Hero(
                duration(document["duration"]),
                f"for {goal_words(document)}",
                f"with dwells of {duration(document['dwell'])}",
                "standard deviation, one record, this sensor",
                "good",
            )
        )
    blocks.append(Text(sentence(document["says"])))
    blocks += table(
        ("Dwell", *made.durations, f"{goal_words(document)} after"),
        rows,
        caption=f"Standard deviation in {made.unit}, by dwell and length of record; the best dwell for each length is "
        "marked.",
    )
    if document["budget"]:
        factor = 100 if document["what"] == "rate" else 57.29577951308232
        unit = "%" if document["what"] == "rate" else "deg"
        stated = [(name, f"{number(value * factor, 3)} {unit}") for name, value in document["budget"].items()]
        blocks.append(Text("What no length of record reduces:"))
        blocks.append(pairs([(name, words) for name, words in stated]))
    return blocks


def _pictures(document: Json) -> list[PageBlock]:
    return drawn(
        "plan",
        document,
        "Standard deviation against dwell, and against the length of the record.",
        sentence(document["says"]),
    )


def _method(document: Json) -> list[PageBlock]:
    return [
        Text(
            "The covariance of a regression depends on the noise, the turns and the clock, not on the data. So it is "
            "computed from the columns alone, by the filter that would whiten the record; no sample is needed:"
        ),
        *equation("least_squares"),
        pairs(
            [("Noise model", document.get("model_name", "")), ("Its terms", model_words(document["model"]))]
        ),
    ]
