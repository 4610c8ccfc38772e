# SPDX-License-Identifier: BSD-3-Clause
"""What the filter that is told the rate says: what it was told, what came back, and that it is no measurement."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

from allanite.experiments.aided_readings import AidedMeans, AidedTake
from allanite.quantities.number_words import number
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import (
    Banner,
    Page,
    PageBlock,
    References,
    Text,
    bullets,
    drawn,
    equation,
    pairs,
    table,
)
from allanite.views.rates import SEED
from allanite.views.result_page import advice, findings_of, result_page
from allanite.views.wording.rates import DEG_H, model_words

__all__ = ["READINGS", "aided_banner", "aided_table", "view"]

_AIDED = (
    "This is not a measurement. The filter was given the rate: in unsigned samples the mean of the corrected samples "
    "follows that rate by the share in the last column, whatever the sensor measured."
)
_UNSIGNED = (
    "Unsigned: the mean of the corrected samples as recorded. It follows the reference by the share in the last "
    "column, whatever the sensor measured; from a minute on this is almost 100 %."
)
_DEMODULATED = (
    "Demodulated: reference and samples have the sign of the heading. The longer the record, the less the reference "
    "counts; the sensor gives the rest. That rest is biased: the filter removes part of the alternating signal as "
    "flicker, so the Earth rate reads too small."
)
READINGS = (_UNSIGNED, _DEMODULATED)
"""The two ways in which the seed paper's filtered takes can be read."""


def view(document: ResultDocument[AidedTake]) -> Page:
    """The page of a record through the filter that is told the rate."""
    result, made = document.result, document.provenance
    return result_page(
        document,
        title=("" if made is None else made.source) or result.channel,
        kicker="Reference-aided filter",
        facts=[("Channel", result.channel), ("Noise", document.model_name)],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "pictures": ("Pictures", [*_pictures(result)]),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", _method(result)),
        },
    )


def aided_banner() -> PageBlock:
    """What must stand beside every result of the reference-aided filter."""
    return Banner("warning", "Reference-aided.", _AIDED)


def aided_table(readings: Iterable[AidedMeans], caption: str = "") -> list[PageBlock]:
    """The given rate, and the means of what the filter made of it."""
    heads = (
        "Reading", "Given, deg/h", "Raw mean, deg/h", "Corrected mean, deg/h", "Follows the given rate by",
    )  # fmt: skip
    return table(heads, [_line(reading) for reading in readings], caption=caption)


def _line(reading: AidedMeans) -> tuple[str, ...]:
    means = (reading.mean_reference, reading.mean_raw, reading.mean_corrected)
    follows = f"{100 * reading.follows:.0f} %" if math.isfinite(reading.follows) else "–"
    return reading.reading, *(number(mean / DEG_H, 4) for mean in means), follows


def _verdict(result: AidedTake) -> Iterator[PageBlock]:
    yield aided_banner()
    yield from aided_table(result.readings)
    yield from bullets(READINGS, brief=False)
    yield from advice(result.notes)
    yield Text("To measure the Earth rate, use `allanite earth-rate`: it needs no reference.", brief=True)


def _pictures(result: AidedTake) -> Iterator[PageBlock]:
    for reading in result.readings:
        yield from drawn(
            f"aided-{reading.reading}",
            replace(result, readings=(reading,)),
            f"{reading.reading.capitalize()}: corrected samples and cumulative mean, with the given rate.",
            f"Corrected series and cumulative mean of the reference-aided filter, {reading.reading}.",
        )


def _method(result: AidedTake) -> list[PageBlock]:
    return [
        Text(
            "The filter of the seed paper compares the sensor with a known rate and estimates the slow part of the "
            "difference: the Gauss-Markov bias and the random walk."
        ),
        *equation("seed_filter"),
        Text(
            "It removes noise relative to a known input, as a rate table needs. If the rate itself is unknown, this is "
            "circular. The covariance update is (I − K H) P; the paper prints its inverse."
        ),
        *([] if result.model is None else [pairs([("Its terms", model_words(result.model))], brief=False)]),
        References([SEED]),
    ]
