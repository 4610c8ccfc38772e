# SPDX-License-Identifier: BSD-3-Clause
"""What the filter of a noise model says: whether the model holds, what was removed, and what is left."""

from __future__ import annotations

import math
from collections.abc import Iterator

from allanite.filtering.kalman import FilterEstimate
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, number, probability, with_sd
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Page, PageBlock, References, Text, equation, pairs, table
from allanite.views.result_page import advice, findings_of, pictures, result_page, verdict_banner
from allanite.views.wording.rates import model_words

__all__ = ["OF_INNOVATIONS", "view"]

_TERMS = {"gauss_markov": "Gauss-Markov term"}
OF_INNOVATIONS = (
    "Y. Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation with applications to tracking and navigation (2001).",
    "G. M. Ljung, G. E. P. Box, On a measure of lack of fit in time series models, Biometrika 65 (1978) 297.",
)


def view(document: ResultDocument[FilterEstimate]) -> Page:
    """The page of a filtered channel."""
    result, made = document.result, document.provenance
    return result_page(
        document,
        title=("" if made is None else made.source) or result.channel,
        kicker="Filter of the noise model",
        facts=[
            ("Channel", result.channel),
            ("Length", duration(result.samples / result.rate)),
            ("Rate", f"{result.rate:.7g} Hz"),
            ("Samples", f"{result.samples:,}".replace(",", "\u202f")),
            ("Noise", document.model_name),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(document)]),
            "pictures": ("Pictures", _pictures(result)),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", _method(document)),
        },
    )


def _verdict(document: ResultDocument[FilterEstimate]) -> Iterator[PageBlock]:
    result = document.result
    yield verdict_banner(result.verdict, result.reason)
    yield pairs([*_numbers(result)])
    yield from table(("Innovations", "Measured", "If the model holds"), [*_tests(result)])
    yield from advice(result.notes)
    yield pairs([("Noise", f"{document.model_name or 'given'}: {model_words(result.model)}")])


def _numbers(result: FilterEstimate) -> Iterator[tuple[str, str]]:
    unit, factor = display_unit(result.kind, "mean", result.unit)
    yield "Level under the drift", with_sd(result.level, result.level_sd, unit, factor)
    for name, series in result.terms.items():
        if name != "level" and series.value.size:
            words = _TERMS.get(name, name.replace("_", " ").capitalize())
            value, sd = float(series.value[-1]), float(series.sd[-1])
            yield f"{words} at the end", with_sd(value, sd, unit, factor)
    means = [number(mean / factor, 6) for mean in (result.mean_measured, result.mean_corrected)]
    yield "Mean, measured and corrected", f"{means[0]} and {means[1]} {unit}"
    how = "smoothed, from the whole record" if result.smoothed else "filtered, from the samples so far"
    yield "Drift", f"{how}; {result.states} states, {result.form} form"


def _tests(result: FilterEstimate) -> Iterator[tuple[str, str, str]]:
    """The tests of the innovations: name, what was measured, what the model allows."""
    c = result.consistency
    allowed = f"{number(c.nis_lower, 4)} to {number(c.nis_upper, 4)}"
    yield "size of the innovations (NIS)", number(c.nis, 4), f"{allowed}, {probability(c.nis_p)}"
    if not math.isnan(c.whiteness):
        expected = f"about {len(c.correlations)}, {probability(c.whiteness_p)}"
        yield "whiteness, χ²", number(c.whiteness, 3), expected


def _pictures(result: FilterEstimate) -> list[PageBlock]:
    name = result.channel
    captions: dict[str, str | tuple[str, str]] = {
        "series": (
            "Samples as measured and without the drift: lowest and highest value of each block.",
            f"{name} before and after the filter.",
        ),
        "drift": (
            "The drift that was removed, with two standard deviations.",
            f"Drift of {name} with its band.",
        ),
        "terms": (
            "Components of the drift: each slow term of the model, and the estimated level.",
            f"Slow terms of {name} against time.",
        ),
        "whiteness": (
            "Correlation of the innovations at short lags. Inside the band they are white, as the model predicts.",
            "Correlation of the innovations against lag.",
        ),
    }
    if sum(term != "level" for term in result.terms) < 2:  # the drift is that one term
        del captions["terms"]
    return pictures(result, captions)


def _method(document: ResultDocument[FilterEstimate]) -> list[PageBlock]:
    return [
        Text("Every noise term of the model is a state, discretized exactly at the sample interval:"),
        *equation("state_space"),
        Text(
            "The filter starts with an unknown level (exact diffuse start), predicts over missing samples, and "
            "subtracts the sum of the slow states. If the model holds, the innovations are independent, with the "
            "variances S that the filter states. Their size and whiteness are tested:"
        ),
        *equation("nis"),
        pairs(
            [("Noise model", document.model_name), ("Its terms", model_words(document.result.model))],
            brief=False,
        ),
        References(OF_INNOVATIONS),
    ]
