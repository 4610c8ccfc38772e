# SPDX-License-Identifier: BSD-3-Clause
"""What the report of the null test between east and west says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.blocks import (
    Hero,
    Page,
    PageBlock,
    Text,
    drawn,
    equation,
    findings,
    pairs,
)
from allanite.views.rates import checks_table, contradiction_banners, rate_budget
from allanite.views.report.measurement import judgement, measurement_page
from allanite.views.wording import (
    DEG_H,
    angle,
    check_lines,
    duration,
    findings_in,
    model_words,
    null_budget,
    null_words,
    number,
    tone,
    with_sd,
)

__all__ = ["page"]

Json = Mapping[str, Any]


def page(document: Json) -> Page:
    """The page of a null test."""
    recording = document.get("recording") or {}
    reversals = document.get("reversals")
    return measurement_page(
        document,
        title=document.get("source") or "East and west",
        kicker="Null test between east and west",
        facts=[
            ("Channel", document["channel"]),
            ("Length", duration(recording["duration"]) if recording else ""),
            ("Positions", str(len(reversals["positions"])) if reversals else ""),
            ("Latitude", angle(document["latitude"])),
        ],
        parts={
            "verdict": _verdict,
            "checks": _checks,
            "findings": findings,
            "record": _record,
            "method": _method,
        },
    )


def _verdict(document: Json) -> list[PageBlock]:
    verdict = document["verdict"]
    blocks = [*contradiction_banners(findings_in(document)), *judgement(document)]
    value, ends, limit = null_words(document)
    if value == "–":
        return blocks
    error = number(document["error_of_rate"] / DEG_H, 3)
    blocks.append(
        Hero(
            value,
            "deg/h follow the turns, + pointing east",
            f"{100 * document['confidence']:g} % interval {ends} deg/h: none above {limit} deg/h",
            f"in an Earth rate measured with such turns: at most {error} deg/h",
            tone(verdict),
        )
    )
    return [*blocks, *rate_budget(null_budget(document))]


def _checks(document: Json) -> list[PageBlock]:
    level, sd = document["bias"]
    return [
        *checks_table(check_lines(document["checks"]), "Questions put to what the fit leaves."),
        pairs([("Bias that stays", with_sd(level, sd, "deg/h", DEG_H))]),
    ]


def _record(document: Json) -> list[PageBlock]:
    if not document.get("overview") or not document.get("reversals"):
        return []
    return drawn(
        "record-figure",
        document["reversals"],
        "The record: lowest and highest value of each block.",
        f"Raw record of {document['channel']}.",
        recording=document["overview"],
    )


def _method(document: Json) -> list[PageBlock]:
    return [
        Text(
            "Between east and west the horizontal part of the Earth's rotation does not change. What still follows the "
            "turns is an error that between north and south would be taken for the Earth:"
        ),
        *equation("null_test"),
        Text(
            "Positions within 45° of east or west are used. The test sees a bias that changes between these two: one "
            "that points along north and south on the ground shows in the Earth rate and not here."
        ),
        pairs(
            [
                ("Noise model", document.get("model_name", "")),
                ("Its terms", model_words(document["model"]) if document.get("model") else ""),
            ]
        ),
    ]
