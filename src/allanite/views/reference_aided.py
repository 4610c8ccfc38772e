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
from allanite.views.wording import DEG_H, model_words

__all__ = ["READINGS", "aided_banner", "aided_table", "view"]

_AIDED = (
    "This is no measurement. The filter was told the rate: where the samples are read as they come, every unit that is "
    "typed in moves the mean of the corrected samples by the share in the last column, whatever the sensor saw."
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
    """What was told, and what came back."""
    heads = (
        "Reading", "Told, deg/h", "Raw mean, deg/h", "Corrected mean, deg/h", "Follows what it was told by",
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
    yield Text("The Earth rate is measured by `allanite earth-rate`, which is not told it.", brief=True)


def _pictures(result: AidedTake) -> Iterator[PageBlock]:
    for reading in result.readings:
        yield from drawn(
            f"aided-{reading.reading}",
            replace(result, readings=(reading,)),
            f"Read {reading.reading}: corrected samples and cumulative mean, beside the rate typed in.",
            f"Corrected series and cumulative mean of the reference-aided filter, {reading.reading}.",
        )


def _method(result: AidedTake) -> list[PageBlock]:
    return [
        Text(
            "The filter of the seed paper compares the sensor with a rate that is known and estimates what is slow in "
            "the difference: the Gauss-Markov bias and the random walk."
        ),
        *equation("seed_filter"),
        Text(
            "It removes noise against a known input, which is what a rate table needs. Where the rate itself is the "
            "question it is circular. The covariance update is done as (I − K H) P; the paper prints its inverse."
        ),
        *([] if result.model is None else [pairs([("Its terms", model_words(result.model))], brief=False)]),
        References([SEED]),
    ]
