# SPDX-License-Identifier: BSD-3-Clause
"""What the reports of filters say: of the filter of a noise model, and of the one that is told the rate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.views.blocks import (
    Banner,
    Page,
    PageBlock,
    References,
    Text,
    bullets,
    drawn,
    equation,
    findings,
    pairs,
    table,
)
from allanite.views.rates import SEED
from allanite.views.report.measurement import measurement_page
from allanite.views.wording import (
    AIDED,
    aided_lines,
    consistency_lines,
    duration,
    filter_lines,
    filter_verdict,
    model_words,
    sentence,
    tone,
)

__all__ = ["READINGS", "aided_table", "page"]

Json = Mapping[str, Any]

BAR_SHALOM = (
    "Y. Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation with applications to tracking and navigation (2001)."
)
LJUNG_BOX = (
    "G. M. Ljung, G. E. P. Box, On a measure of lack of fit in time series models, Biometrika 65 (1978) 297."
)
_UNSIGNED = (
    "Unsigned: the mean of the corrected samples as they come. It moves with the reference by the share in the last "
    "column, whatever the sensor saw; from a minute on that is all but one to one."
)
_DEMODULATED = (
    "Demodulated: reference and samples are taken with the sign of the heading. Then the reference counts less the "
    "longer the record is, and the sensor decides the rest. The rest is no mean of the samples, but what the filter "
    "leaves of them: it takes part of the alternating signal for flicker, so the Earth comes out too small."
)
READINGS = (_UNSIGNED, _DEMODULATED)
"""The two ways in which the seed paper's filtered takes can be read."""


def page(document: Json) -> Page:
    """The page of a filter of either kind."""
    return (
        _aided_page(document) if document["format"] == "allanite-reference-aided" else _filter_page(document)
    )


# -- the filter of a noise model --------------------------------------------------------------------------


def _filter_page(document: Json) -> Page:
    samples = f"{document['samples']:,}".replace(",", "\u202f")
    return measurement_page(
        document,
        title=document.get("source") or document["channel"],
        kicker="Filter of the noise model",
        facts=[
            ("Channel", document["channel"]),
            ("Length", duration(document["samples"] / document["rate"])),
            ("Rate", f"{document['rate']:.7g} Hz"),
            ("Samples", samples),
            ("Noise", document.get("model_name", "")),
        ],
        parts={
            "verdict": _filter_verdict,
            "pictures": _filter_pictures,
            "findings": findings,
            "method": _filter_method,
        },
    )


def _filter_verdict(document: Json) -> list[PageBlock]:
    verdict, reason = filter_verdict(document)
    return [
        Banner(tone(verdict), sentence(verdict), sentence(reason)),
        pairs(filter_lines(document)),
        *table(("Innovations", "Found", "If the model holds"), consistency_lines(document)),
        *bullets([sentence(note) for note in document["notes"]]),
    ]


def _filter_pictures(document: Json) -> list[PageBlock]:
    name = document["channel"]
    several = sum(term != "level" for term in document["terms"]) > 1
    return [
        *drawn(
            "series",
            document,
            "Measured samples, and the same without the drift: lowest and highest value of each block.",
            f"{name} before and after the filter.",
            view="series",
        ),
        *drawn(
            "drift",
            document,
            "The drift that was removed, with two standard deviations.",
            f"Drift of {name} with its band.",
            view="drift",
        ),
        *(
            drawn(
                "terms",
                document,
                "What the drift is made of: each slow term of the model, and the level as it becomes known.",
                f"Slow terms of {name} against time.",
                view="terms",
            )
            if several
            else []
        ),
        *drawn(
            "whiteness",
            document,
            "Correlation of the innovations at short lags. Inside the band they are as white as the model says.",
            "Correlation of the innovations against lag.",
            view="whiteness",
        ),
    ]


def _filter_method(document: Json) -> list[PageBlock]:
    return [
        Text("Every noise term of the model is a state, discretized exactly at the sample interval:"),
        *equation("state_space"),
        Text(
            "The filter starts without knowing the level (exact diffuse start), predicts over missing samples, and "
            "subtracts the sum of the slow states. If the model holds, the innovations are independent with the "
            "variances S that the filter states; their size and their whiteness are tested:"
        ),
        *equation("nis"),
        pairs(
            [("Noise model", document.get("model_name", "")), ("Its terms", model_words(document["model"]))]
        ),
        References([BAR_SHALOM, LJUNG_BOX]),
    ]


# -- the filter that is told the rate ---------------------------------------------------------------------


def _aided_page(document: Json) -> Page:
    return measurement_page(
        document,
        title=document.get("source") or document["channel"],
        kicker="Reference-aided filter",
        facts=[("Channel", document["channel"]), ("Noise", document.get("model_name", ""))],
        parts={
            "verdict": _aided_verdict,
            "pictures": _aided_pictures,
            "findings": findings,
            "method": _aided_method,
        },
    )


def _readings(document: Json) -> Sequence[Json]:
    return document.get("readings") or [document]


def _aided_verdict(document: Json) -> list[PageBlock]:
    readings = _readings(document)
    notes = [sentence(note) for reading in readings for note in reading["notes"]]
    return [
        Banner("warning", "Reference-aided.", AIDED),
        *aided_table(readings),
        *bullets([*READINGS, *dict.fromkeys(notes)]),
    ]


def aided_table(readings: Sequence[Json], caption: str = "") -> list[PageBlock]:
    """What was told, and what came back."""
    heads = (
        "Reading",
        "Told, deg/h",
        "Raw mean, deg/h",
        "Corrected mean, deg/h",
        "Follows what it was told by",
    )
    return table(heads, aided_lines(readings), caption=caption)


def _aided_pictures(document: Json) -> list[PageBlock]:
    return [
        block
        for reading in _readings(document)
        for block in drawn(
            f"aided-{reading['reading']}",
            {"format": "allanite-reference-aided", **reading},
            f"Read {reading['reading']}: corrected samples and cumulative mean, beside the rate typed in.",
            f"Corrected series and cumulative mean of the reference-aided filter, {reading['reading']}.",
        )
    ]


def _aided_method(document: Json) -> list[PageBlock]:
    blocks: list[PageBlock] = [
        Text(
            "The filter of the seed paper compares the sensor with a rate that is known and estimates what is slow in "
            "the difference: the Gauss-Markov bias and the random walk."
        ),
        *equation("seed_filter"),
        Text(
            "It removes noise against a known input, which is what a rate table needs. Where the rate itself is the "
            "question it is circular. The covariance update is done as (I − K H) P; the paper prints its inverse."
        ),
    ]
    if document.get("model"):
        blocks.append(pairs([("Its terms", model_words(document["model"]))]))
    return [*blocks, References([SEED])]
