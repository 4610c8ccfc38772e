# SPDX-License-Identifier: BSD-3-Clause
"""What the report of sensors taken apart says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.blocks import (
    Page,
    PageBlock,
    References,
    Text,
    equation,
    findings,
    table,
)
from allanite.views.report.measurement import judgement, known_facts, measurement_page, views
from allanite.views.wording import duration, part_lines, part_term_lines, separation_facts

__all__ = ["page"]

Json = Mapping[str, Any]

GRAY = (
    "J. Gray, D. Allan, “A method for estimating the frequency stability of an individual oscillator”, Proc. 28th "
    "Annual Symposium on Frequency Control (1974) 243."
)
LANTZ = (
    "E. Lantz, C. Calosso, E. Rubiola et al., “KLTS: A rigorous method to compute the confidence intervals for the "
    "three-cornered hat and for Groslambert covariance”, IEEE Trans. UFFC 66 (2019) 1942."
)
WEERAHANDI = "S. Weerahandi, “Generalized confidence intervals”, J. Am. Stat. Assoc. 88 (1993) 899."


def page(document: Json) -> Page:
    """The page of a separation."""
    return measurement_page(
        document,
        title=document.get("source") or "Sensors taken apart",
        kicker="Noise of each sensor without the common part",
        facts=[
            ("Sensors", ", ".join(document["channels"])),
            ("Length", duration(document["duration"])),
        ],
        parts={
            "verdict": _verdict,
            "pictures": _pictures,
            "noise": _noise,
            "findings": findings,
            "method": _method,
        },
        titles={"noise": "Every part"},
    )


def _verdict(document: Json) -> list[PageBlock]:
    return [
        *judgement(document, document["remarks"]),
        known_facts(separation_facts(document)),
    ]


def _pictures(document: Json) -> list[PageBlock]:
    pictures = (
        ("parts", "Allan deviation of what each sensor has alone, and of what all share."),
        ("correlation", "Correlation of the sensors over the averaging time."),
    )
    return views(document, pictures)


def _noise(document: Json) -> list[PageBlock]:
    percent = f"{100 * document['confidence']:g} %"
    heads, rows = part_lines(document)
    term_heads, terms = part_term_lines(document)
    return [
        *table(
            heads,
            rows,
            caption=f"Allan deviation with its {percent} interval; “<” is an upper limit, its upper end.",
        ),
        *table(
            term_heads,
            terms,
            caption=f"Terms with their {percent} intervals, each with all others free; “<” is an upper limit.",
        ),
    ]


def _method(document: Json) -> list[PageBlock]:
    return [
        Text("Differences of adjacent means of all sensors, at the positions where all are complete:"),
        *equation("separation"),
        Text(
            "Two sensors: their covariance is the variance of the common part. Three: the own noise follows from the "
            "variances of the differences (three-cornered hat), whatever all three share. An estimate may come out "
            "negative; its interval then reaches zero and its upper end is an upper limit. Degrees of freedom come "
            "from the exact variance of every estimate under the noise terms of all parts; the interval is that of a "
            "covariance with so many degrees of freedom, right also near zero."
        ),
        References([GRAY, LANTZ, WEERAHANDI]),
    ]
