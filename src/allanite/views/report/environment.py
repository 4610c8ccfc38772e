# SPDX-License-Identifier: BSD-3-Clause
"""What the report of the environment says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.stability.environment import EnvironmentFacts
from allanite.views.blocks import (
    Cell,
    Drawn,
    Page,
    PageBlock,
    References,
    Subheading,
    Text,
    findings,
    table,
)
from allanite.views.figures import sheet_of
from allanite.views.pieces import Figure
from allanite.views.report.measurement import judgement, known_facts, measurement_page
from allanite.views.wording import (
    coefficient_lines,
    duration,
    effect_lines,
    environment_facts,
)

__all__ = ["page", "pictures_of"]

Json = Mapping[str, Any]

HARVILLE = (
    "D. A. Harville, “Maximum likelihood approaches to variance component estimation”, JASA 72 (1977) 320."
)
FIELLER = "E. C. Fieller, “Some problems in interval estimation”, J. R. Statist. Soc. B 16 (1954) 175."
PLAY = "M. A. Krasnosel’skii, A. V. Pokrovskii, “Systems with hysteresis”, Springer (1989), chapter 1."


def page(document: Json) -> Page:
    """The page of the environment of a log."""
    return measurement_page(
        document,
        title=document["provenance"].get("source") or "Environment",
        kicker="Effects of the environment",
        facts=[
            ("Channels", ", ".join(estimate.channel for estimate in _found(document))),
            ("Length", duration(document["duration"])),
        ],
        parts={
            "verdict": _verdict,
            "pictures": _pictures,
            "effect": _effect,
            "findings": findings,
            "method": _method,
        },
        titles={"effect": "What was removed"},
    )


def _found(document: Json) -> list[EnvironmentFacts]:
    return [EnvironmentFacts.from_json(entry) for entry in document["channels"]]


def _verdict(document: Json) -> list[PageBlock]:
    blocks: list[PageBlock] = []
    for entry in document["channels"]:
        estimate = EnvironmentFacts.from_json(entry)
        blocks += [
            Subheading(estimate.channel),
            *judgement(entry),
            *table(
                ("Bias by", f"{100 * estimate.confidence:g} % interval", "", ""),
                [(*row[:3], Cell(text="", below=row[3])) for row in coefficient_lines(estimate)],
            ),
            known_facts(environment_facts(estimate)),
        ]  # fmt: skip
    return blocks


def pictures_of(estimate: EnvironmentFacts, prefix: str = "environment") -> list[Figure]:
    """The figure of one channel."""
    sheet = sheet_of(estimate)
    words = (
        "The signal against the temperature, warming and cooling apart; the Allan deviation before and after; the "
        "signal over time."
    )
    return [Figure.of(f"{prefix}-{estimate.channel}", sheet, f"{estimate.channel}. {words}", words)]


def _pictures(document: Json) -> list[PageBlock]:
    return [Drawn(figure) for estimate in _found(document) for figure in pictures_of(estimate)]


def _effect(document: Json) -> list[PageBlock]:
    return [
        block
        for estimate in _found(document)
        for block in table(
            ("Averaging", "Before", "Taken off", "Share of the curve", "Noise left"),
            effect_lines(estimate),
            caption=f"{estimate.channel}: Allan deviation of the block means, of what was removed with its error of "
            "one standard deviation, and the part of the noise that is left, by which the curve is corrected.",
        )
    ]


def _method(_: Json) -> list[PageBlock]:
    return [
        Text(
            "The means of some 1500 blocks are fitted by generalized least squares with a level, a drift, the "
            "temperature, its square, its rate and, where a warm-up is modeled, exponentials of the time. The noise, "
            "white noise, flicker and random walk, is fitted beside them by the likelihood of the contrasts that no "
            "coefficient enters; intervals are averaged over what the record leaves open of it. All columns take part "
            "in every interval; only what is resolved is removed, from every sample, with the temperature smoothed "
            "and interpolated. The drift stays: a sensor may drift by itself."
        ),
        Text(
            "A lag of the thermometer and a bias by the rate of the temperature are one column; the lag is their "
            "ratio, with Fieller’s interval. Hysteresis is tested beside the rate, with the play operator as its "
            "column. A warm-up is found where the best of several exponentials is larger than noise allows, at the "
            "price of having tried all of them."
        ),
        Text(
            "A regression also removes noise that looks like the effect. How much is known from the covariance of "
            "its coefficients, and the Allan curve of the residual is divided by what is left; where that is not "
            "within a quarter of the whole, the lag does not enter a noise model."
        ),
        References([HARVILLE, FIELLER, PLAY]),
    ]
