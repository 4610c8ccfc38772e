# SPDX-License-Identifier: BSD-3-Clause
"""What the report of the deviation over time says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.report.blocks import (
    Block,
    bullets,
    drawn,
    equation,
    findings,
    pairs,
    references,
    table,
    text,
)
from allanite.views.report.measurement import judgement, known_facts, measurement_page
from allanite.views.wording import (
    change_lines,
    channel_names,
    constancy_lines,
    duration,
    model_words,
    sentence,
    variation_facts,
)

__all__ = ["page"]

Json = Mapping[str, Any]

GALLEANI = "L. Galleani, P. Tavella, “The dynamic Allan variance”, IEEE Trans. UFFC 56 (2009) 450."
ANDREWS = (
    "D. W. K. Andrews, “Tests for parameter instability and structural change with unknown change point”, "
    "Econometrica 61 (1993) 821."
)
HANSEN = "B. E. Hansen, “Sample splitting and threshold estimation”, Econometrica 68 (2000) 575."
WILSON = "E. Wilson, M. Hilferty, “The distribution of chi-square”, PNAS 17 (1931) 684."


def page(document: Json) -> dict[str, Any]:
    """The page of a variation."""
    return measurement_page(
        document,
        title=document.get("source") or "Deviation over time",
        kicker="Does the noise change during the record?",
        facts=[
            ("Channels", ", ".join(c["name"] for c in document["channels"])),
            ("Length", duration(document["duration"])),
        ],
        parts={
            "verdict": _verdict,
            "pictures": _pictures,
            "lags": _lags,
            "findings": findings,
            "method": _method,
        },
        titles={"lags": "Constancy of every lag"},
    )


def _verdict(document: Json) -> list[Block]:
    remarks = [f"{c['name']}: {remark}" for c in document["channels"] for remark in c["remarks"]]
    return [
        *judgement(document, ()),
        *table(
            ("Channel", "What", "When", "After over before", "Chance"),
            change_lines(document),
            caption=f"Changes with their {100 * document['confidence']:g} % intervals.",
        ),
        *bullets([sentence(remark, channel_names(document)) for remark in remarks]),
        known_facts(variation_facts(document)),
    ]


def _pictures(document: Json) -> list[Block]:
    blocks: list[Block] = []
    for i, channel in enumerate(document["channels"]):
        caption = (
            f"{channel['name']}: Allan deviation over time and averaging time, over that of the whole record. Red: "
            "larger, blue: smaller. A frame marks what chance makes of none of all windows; pale is what it may make."
        )
        options = {"channels": [channel["name"]]}
        blocks += drawn(f"map-{i}", document, caption, caption, view="map", **options)
        caption = f"{channel['name']}: some averaging times, every window with its interval."
        blocks += drawn(f"lines-{i}", document, caption, caption, view="lines", **options)
    return blocks


def _lags(document: Json) -> list[Block]:
    return [
        *table(
            (
                "Channel",
                "Averaging",
                "Windows",
                "Least to largest",
                "Whole record",
                "Beyond chance",
                "Constant",
            ),
            constancy_lines(document),
            caption="Every averaging time by itself: chi-square of its windows with their exact covariance.",
        ),
        pairs([(f"Noise of {c['name']}", model_words(c["model"])) for c in document["channels"]]),
    ]


def _method(document: Json) -> list[Block]:
    return [
        text("The overlapping Allan variance of every window of time, at every averaging time:"),
        *equation("variation"),
        text(
            "Windows share no term, and at long averaging times they are joined until four lags fit into each; "
            "lags for which fewer than four windows are left say nothing about change. How much windows scatter "
            "by chance, and how neighbours and lags hang together, is the exact covariance under the noise model "
            "of the whole record; the level of every lag is free, so that the model need not fit. Cube roots of "
            "variances are nearly normal. Two questions are asked, each at half the stated rate of false alarms: "
            "the chi-square of all windows together, and the largest of all scores of a step at any time, or a "
            "drift, of any term, whose law is simulated for this record. The time of a step has the set of times "
            "that the likelihood does not reject."
        ),
        references([GALLEANI, WILSON, ANDREWS, HANSEN]),
    ]
