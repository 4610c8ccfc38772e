# SPDX-License-Identifier: BSD-3-Clause
"""What the report of two noise models says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.blocks import Page, PageBlock, References, Subheading, Text, table
from allanite.views.report.measurement import measurement_page, views
from allanite.views.wording import drift_lines, pair_lines, rest_words

__all__ = ["page"]

Json = Mapping[str, Any]

_GREENHALL = (
    "C. Greenhall, W. Riley, “Uncertainty of stability variances based on finite differences”, PTTI 2003."
)


def page(document: Json) -> Page:
    """The page of two noise models."""
    first, second = document["names"]
    facts = [("Sensors", ", ".join(c["name"] for c in document["channels"]))]
    if document["unpaired"]:
        facts.append(("Only in one", ", ".join(document["unpaired"])))
    return measurement_page(
        document,
        title=f"{first} and {second}",
        kicker="Two noise models side by side",
        facts=facts,
        parts={"drift": _drift, "parameters": _parameters, "pictures": _pictures, "method": _method},
    )


def _drift(document: Json) -> list[PageBlock]:
    first, second = document["names"]
    blocks: list[PageBlock] = []
    for channel in document["channels"]:
        heads = ("Drift after", first, second, "Ratio")
        blocks += [Subheading(channel["name"]), *table(heads, drift_lines(channel))]
    return [*blocks, Text(f"{rest_words(document)}.", note=True)]


def _parameters(document: Json) -> list[PageBlock]:
    first, second = document["names"]
    blocks: list[PageBlock] = []
    for channel in document["channels"]:
        blocks += [
            Subheading(channel["name"]),
            *table(("Parameter", first, second, "Ratio"), pair_lines(channel)),
        ]
    return blocks


def _pictures(document: Json) -> list[PageBlock]:
    return views(
        document,
        [
            ("curves", "Allan deviation of both models."),
            ("drift", "What each adds up to over time, and their ratio after the times of the table."),
        ],
    )


def _method(_: Json) -> list[PageBlock]:
    return [
        Text(
            "The drift is the integral of the noise over a time less its mean before, taken over a time of rest; this "
            "exists for every term. With a rest as long as the time itself it is √2 times the time times the Allan "
            "deviation there. Intervals of the ratio are those of the fitted parameters, to first order in their "
            "logarithms; what was stated and not fitted counts as exact."
        ),
        References([_GREENHALL]),
    ]
