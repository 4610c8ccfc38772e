# SPDX-License-Identifier: BSD-3-Clause
"""What two noise models side by side say: the drift of each, their parameters, and the ratios."""

from __future__ import annotations

from collections.abc import Iterator

from allanite.fitting.model_difference import ChannelDifference, Difference, DriftPair
from allanite.noise import NoiseModel
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, number
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Page, PageBlock, References, Subheading, Text, table
from allanite.views.result_page import pictures, result_page
from allanite.views.wording.difference import drift_unit
from allanite.views.wording.study import COLUMNS, column_of, reading, shown_symbol

__all__ = ["ratio_words", "rows", "view"]

_METHOD = (
    "The drift is the integral of the noise over a time, after subtraction of its mean over a rest just before; it "
    "exists for every term. With a rest as long as the time itself it is √2 times that time times the Allan deviation. "
    "Intervals of the ratio follow from those of the fitted parameters, to first order in their logarithms; stated "
    "parameters count as exact."
)
_GREENHALL = (
    "C. Greenhall, W. Riley, “Uncertainty of stability variances based on finite differences”, PTTI 2003."
)
_PICTURES = {
    "curves": "Allan deviation of both models.",
    "drift": "Drift of each over time, and their ratio at the times of the table.",
}


def view(document: ResultDocument[Difference]) -> Page:
    """The page of two noise models."""
    result = document.result
    return result_page(
        document,
        title=" and ".join(result.names),
        kicker="Two noise models side by side",
        facts=[
            ("Sensors", ", ".join(c.name for c in result.channels)),
            ("Only in one", ", ".join(result.unpaired)),
        ],
        sections={
            "drift": ("Drift", [*_drift(result)]),
            "parameters": ("Parameters", [*_parameters(result)]),
            "pictures": ("Pictures", pictures(result, _PICTURES)),
            "method": ("Method", [Text(_METHOD), References([_GREENHALL])]),
        },
    )


def _drift(result: Difference) -> Iterator[PageBlock]:
    for channel in result.channels:
        yield Subheading(channel.name, brief=True)
        lines = [_drift_line(channel, pair) for pair in channel.drifts]
        yield from table(("Drift after", *result.names, "Ratio"), lines)
    before = "the same time" if result.rest is None else duration(result.rest)
    yield Text(
        "Drift: standard deviation (1 σ) of the angle or velocity error that the noise accumulates unaided, after the "
        f"bias is removed as its mean over {before} at rest just before. The interval of the ratio includes terms that "
        "a record does not resolve, up to their limits.",
        note=True,
        brief=True,
    )
    if result.unpaired:
        yield Text(f"Only in one of the two: {', '.join(result.unpaired)}.", brief=True)


def _drift_line(channel: ChannelDifference, pair: DriftPair) -> tuple[str, ...]:
    unit, factor = drift_unit(channel.kind, channel.unit)
    both = (f"{number(drift / factor)} {unit}" for drift in (pair.first, pair.second))
    return f"{pair.seconds:g} s", *both, ratio_words(pair.ratio)


def ratio_words(ratio: Quantity) -> str:
    """A ratio and its interval; digits of each for itself where it spans more than a factor of two.

    >>> ratio_words(Quantity.of(0.836, (0.0646, 13.02), "1")), ratio_words(Quantity.of(1.003, (0.973, 1.034), "1"))
    ('0.84 [0.065, 13]', '1.003 [0.973, 1.034]')
    """
    if not ratio.resolved:
        open_ = " [not resolved]" if ratio.status is QuantityStatus.NOT_RESOLVED else ""
        return number(ratio.value) + open_
    if ratio.lower > 0 and ratio.upper > 2 * ratio.lower:
        return f"{number(ratio.value, 2)} [{number(ratio.lower, 2)}, {number(ratio.upper, 2)}]"
    return ratio.shown()


def _parameters(result: Difference) -> Iterator[PageBlock]:
    for channel in result.channels:
        yield Subheading(channel.name, brief=True)
        yield from table(("Parameter", *result.names, "Ratio"), [*_parameter_lines(channel)])


def _parameter_lines(channel: ChannelDifference) -> Iterator[tuple[str, ...]]:
    """Symbol with its unit, the parameter of each, and the ratio of the two values."""
    both = [_known(model, channel) for model in (channel.first, channel.second)]
    for symbol in COLUMNS:
        if any(symbol in known for known in both):
            (first, a), (second, b) = (known.get(symbol, ("–", None)) for known in both)
            unit = display_unit(channel.kind, symbol, channel.unit)[0]
            yield f"{shown_symbol(symbol)}, {unit}", first, second, number(b / a) if a and b else "–"


def _known(model: NoiseModel, channel: ChannelDifference) -> dict[str, tuple[str, float | None]]:
    """By symbol: words, and the value where one is known."""
    known: dict[str, tuple[str, float | None]] = {}
    for estimate in model.estimates:
        symbol = column_of(estimate.symbol)
        if symbol in COLUMNS and (symbol != "T" or estimate.supported):
            read = reading(channel.kind, channel.unit, estimate)
            words = " ".join(part for part in (read.value, read.range) if part)
            known[symbol] = words, estimate.value if estimate.supported else None
    if not model.estimates:
        for symbol, value in _stated(model).items():
            known[symbol] = number(value / display_unit(channel.kind, symbol, channel.unit)[1]), value
    return known


def _stated(model: NoiseModel) -> dict[str, float]:
    """Coefficients of a model that was not fitted; of several Gauss-Markov terms the first."""
    values: dict[str, float] = {}
    for term in model.terms:
        of_term = {s: float(getattr(term, s)) for s in COLUMNS if hasattr(term, s)}
        if hasattr(term, "B_equiv"):
            of_term["B"] = float(term.B_equiv)
        values = {**of_term, **values}
    return values


def rows(result: Difference) -> Iterator[dict[str, object]]:
    """One row of a table for each drift, in SI."""
    for channel in result.channels:
        for pair in channel.drifts:
            yield {
                "first": channel.names[0],
                "second": channel.names[1],
                "seconds": pair.seconds,
                "drift_first": pair.first,
                "drift_second": pair.second,
                "ratio": pair.ratio.value,
                "lower": pair.ratio.lower,
                "upper": pair.ratio.upper,
            }
