# SPDX-License-Identifier: BSD-3-Clause
"""What the report of a search for north says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.blocks import (
    Hero,
    Page,
    PageBlock,
    References,
    Text,
    drawn,
    equation,
    findings,
    pairs,
    table,
)
from allanite.views.rates import ROSENBERG, checks_table, contradiction_banners
from allanite.views.report.measurement import judgement, measurement_page
from allanite.views.wording import (
    DEG_H,
    angle,
    angle_budget_lines,
    arcs_words,
    azimuth_words,
    check_lines,
    duration,
    findings_in,
    heading_words,
    horizontal_words,
    model_words,
    sentence,
    tone,
    with_sd,
)

__all__ = ["page"]

Json = Mapping[str, Any]


def page(document: Json) -> Page:
    """The page of a search for north."""
    return measurement_page(
        document,
        title=document.get("source") or "North",
        kicker="North from the Earth's rotation",
        facts=[
            ("Axes", ", ".join(f"{name} at {angle(a)}" for name, a in document["axes"].items())),
            ("Length", duration(document["duration"])),
            ("Positions", _positions(document)),
            ("Latitude", angle(document["latitude"])),
        ],
        parts={
            "verdict": _verdict,
            "pictures": _pictures,
            "checks": _checks,
            "findings": findings,
            "method": _method,
        },
    )


def _positions(document: Json) -> str:
    if document["rotation"] is not None:
        return "turning all the time"
    return str(len((document["reversals"] or {"positions": ()})["positions"]))


def _verdict(document: Json) -> list[PageBlock]:
    verdict = document["verdict"]
    rate, ends, expected = horizontal_words(document)
    return [
        *contradiction_banners(findings_in(document)),
        *judgement(document),
        Hero(
            azimuth_words(document),
            "azimuth of the mark, from north over east",
            f"{100 * document['confidence']:g} % interval: {arcs_words(document['interval'])}",
            f"horizontal rate {rate} deg/h {ends}; expected {expected}",
            tone(verdict),
        ),
        *table(
            ("Source", "Standard uncertainty of the azimuth, deg"),
            angle_budget_lines(document),
            caption="Where the uncertainty comes from.",
        ),
        *(Text(sentence(words), note=True) for words in [heading_words(document)] if words),
    ]


def _pictures(document: Json) -> list[PageBlock]:
    return [
        *drawn(
            "compass",
            document,
            "The azimuth with the directions that the record does not contradict.",
            f"Compass: {azimuth_words(document)}, interval {arcs_words(document['interval'])}.",
            view="compass",
        ),
        *drawn(
            "running",
            document,
            "The azimuth as the record grows.",
            "Running estimate of the azimuth.",
            view="running",
        ),
    ]


def _checks(document: Json) -> list[PageBlock]:
    biases = [(name, with_sd(level, sd, "deg/h", DEG_H)) for name, (level, sd) in document["biases"].items()]
    return [
        *checks_table(check_lines(document["checks"]), "Questions put to what the fit leaves."),
        pairs([(f"Bias of {name}", words) for name, words in biases]),
    ]


def _method(document: Json) -> list[PageBlock]:
    return [
        Text(
            "Axis i, at the heading α from the mark, sees the horizontal part of the Earth's rotation at azimuth ψ:"
        ),
        *equation("north"),
        Text(
            "The two components of that vector and the bias of each axis are fitted by generalized least squares in "
            "the noise of the model. The length of the vector is not taken from the latitude: that it agrees is a "
            "check. A direction is not a number on a line: the interval may wrap, and it is the whole circle where no "
            "signal is seen."
        ),
        *equation("least_squares"),
        pairs([(f"Noise of {name}", model_words(model)) for name, model in document["models"].items()]),
        References([ROSENBERG]),
    ]
