# SPDX-License-Identifier: BSD-3-Clause
"""What a comparison of records says: are they the same, how much do they scatter, and which one stands out."""

from __future__ import annotations

import math
from collections.abc import Iterator

from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, number, probability, upper_limit
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.stability.record_comparison.remarks import remarks
from allanite.stability.record_comparison.results import (
    ChannelComparison,
    Comparison,
    Equality,
    Outlier,
    ParameterComparison,
    SensorSpread,
)
from allanite.stability.record_comparison.words import others_words, parameter_name
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import (
    Page,
    PageBlock,
    References,
    Subheading,
    Text,
    drawn,
    equation,
    pairs,
    table,
)
from allanite.views.result_page import advice, result_page, verdict_banner
from allanite.views.wording.rates import model_words

__all__ = ["rows", "view"]

#: A spread of the logarithm beyond this is shown as a factor.
_FACTOR = 0.3
#: An interval whose end is so many times its middle says "nobody knows".
_OPEN = 1e4
#: Records that a title names.
_MOST = 4

_REFERENCES = (
    "W. Cochran, “The combination of estimates from different experiments”, Biometrics 10 (1954) 101.",
    (
        "S. Self, K.-Y. Liang, “Asymptotic properties of maximum likelihood estimators and likelihood ratio tests "
        "under nonstandard conditions”, JASA 82 (1987) 605."
    ),
    "R. Paule, J. Mandel, “Consensus values and weighting factors”, J. Res. NBS 87 (1982) 377.",
    (
        "W. Viechtbauer, “Confidence intervals for the amount of heterogeneity in meta-analysis”, Stat. Med. 26 (2007) "
        "37."
    ),
    (
        "K. Nagashima, H. Noma, T. Furukawa, “Prediction intervals for random-effects meta-analysis: a confidence "
        "distribution approach”, Stat. Methods Med. Res. 28 (2019) 1689."
    ),
)
_METHOD = (
    "D is the loss of the fit (minus twice a log-likelihood ratio) with the parameter fixed and all "
    "others free; an upper limit contributes its one-sided information. For normal estimates Q at τ = 0 is Cochran's "
    "chi-square [1]; if coefficients are at zero, its distribution is simulated from the linearized "
    "problem [2]. The curves are compared through their ratio to a common model, as cube roots with the "
    "exact covariance of each record. So neighboring lags do not count twice, and rates, lengths and "
    "sampling conventions may differ. The spread τ is where Q equals its expectation [3], and its "
    "interval is where Q equals the quantiles of chi-square [4]; middle and next sensor are averages over "
    "all τ by weight [5]."
)
_CURVES = "Allan deviation of all records with their intervals; dotted: the common noise model."
_PARAMETERS = (
    "Every parameter, record by record, with its interval; an arrow is an upper limit. Dashed: the middle "
    "of the population with its interval; dotted: the prediction interval of the next sensor."
)
_ROWS = (
    "“Equal?” is answered with p adjusted for the number of parameters; “detectable” is the change of "
    "one record that the test detects in four of five cases. Spread: relative standard deviation of the "
    "true values between records, without the uncertainty of each record."
)


def view(document: ResultDocument[Comparison]) -> Page:
    """The page of a comparison."""
    result = document.result
    names = [r.name for r in result.records]
    lengths = sorted({duration(r.duration) for r in result.records})
    return result_page(
        document,
        title=", ".join(names[:_MOST]) + (", …" if len(names) > _MOST else ""),
        kicker="Are the records the same?",
        facts=[
            ("Records", str(len(names))),
            ("Channels", ", ".join(c.name for c in result.channels)),
            ("Length", lengths[0] if len(lengths) == 1 else f"{len(lengths)} different ones"),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "curves": ("Curves", drawn("curves", result, _CURVES, _CURVES, view="curves")),
            "parameters": ("Parameters", [*_parameters(result)]),
            "records": ("Records", [*_records(result)]),
            "method": ("Method", _method()),
        },
    )


def _verdict(result: Comparison) -> Iterator[PageBlock]:
    names = [c.name for c in result.channels]
    yield verdict_banner(result.verdict, result.reason, names)
    yield from table(
        ("Channel", "Allan curves", "Parameters", "Lags that differ alone"),
        [(c.name, _test(c.curve), _test(c.joint), _lags(c, result.level)) for c in result.channels],
        caption="Are they the same? All lags together with their full covariance, and all parameters together.",
    )
    yield from table(
        ("Channel", "What stands out", "Record", "Chance", "The others"),
        [row for c in result.channels for row in _outliers(c, result.level)],
        caption="What stands out.",
    )
    yield from advice(remarks(result), names)


def _test(test: Equality) -> str:
    return f"χ² {number(test.statistic)} ({number(test.dof)} expected), {probability(test.p)}"


def _lags(channel: ChannelComparison, level: float) -> str:
    differ = channel.tau[channel.lag_p_adjusted < level]  # NaN is not below
    if differ.size < 2:
        return duration(differ[0]) if differ.size else "none"
    return f"{differ.size}, from {duration(differ.min())} to {duration(differ.max())}"


def _outliers(channel: ChannelComparison, level: float) -> Iterator[tuple[str, ...]]:
    looked: list[tuple[str, Outlier | None]] = [("Allan curve", channel.outlier)]
    looked += [(parameter_name(p.symbol), p.outlier) for p in channel.every_parameter]
    for what, outlier in looked:
        if outlier is not None and outlier.p < level:
            chance = f"{probability(outlier.p)} for {outlier.looked_at} looked at"
            others = others_words(agree=outlier.rest_p >= level)
            yield channel.name, what, outlier.record, chance, others


# -- parameters -------------------------------------------------------------------------------------------


def _parameters(result: Comparison) -> Iterator[PageBlock]:
    for channel in result.channels:
        yield Subheading(channel.name)
        yield from _table(result, channel)
        yield pairs([("One noise for all", model_words(channel.model))], brief=False)
    yield Text(_ROWS, note=True)
    yield from drawn("parameters", result, _PARAMETERS, _PARAMETERS, view="parameters")


def _table(result: Comparison, channel: ChannelComparison) -> list[PageBlock]:
    """The parameters of each record, then what they say together."""
    columns = [
        [*_column(p, result.level, display_unit(channel.kind, p.symbol, channel.unit)[1])]
        for p in channel.every_parameter
    ]
    units = (display_unit(channel.kind, p.symbol, channel.unit)[0] for p in channel.every_parameter)
    heads = [f"{parameter_name(p.symbol)} [{u}]" for p, u in zip(channel.every_parameter, units, strict=True)]
    records = [r.name for r in result.records]
    together = ("equal?", "common value", "detectable", "spread", "median", "next sensor", "largest")
    lines = [
        ((name, *cells), i >= len(records))
        for i, (name, *cells) in enumerate(zip([*records, *together], *columns, strict=True))
        if any(cell != "–" for cell in cells)
    ]
    return table([channel.name, *heads], [row for row, _ in lines], kept=[kept for _, kept in lines])


def _column(parameter: ParameterComparison, level: float, factor: float) -> Iterator[str]:
    """One parameter: of each record, and what they say together."""
    yield from (value.shown(factor) for value in parameter.records)
    test, population = parameter.equality, parameter.population
    differs = test is not None and test.p_adjusted < level
    yield (
        "–"
        if test is None
        else f"{'no' if differs else 'no difference seen'}, {probability(test.p_adjusted)}"
    )
    yield "–" if differs else parameter.common.shown(factor)
    yield _detectable(parameter, factor)
    yield (
        "–" if population is None else _spread(population.spread, factor, of_bias=parameter.symbol == "mean")
    )
    yield "–" if population is None else population.middle.shown(factor)
    yield _next(population, factor)
    yield _largest(parameter)


def _detectable(parameter: ParameterComparison, factor: float) -> str:
    """The change of one record that the test would have seen."""
    size = parameter.detectable
    if size is None:
        return "–"
    if parameter.symbol == "mean":
        return f"± {number(size / factor, 2)}"
    return f"+{number(100 * size, 2)} %" if size < 1 else f"{number(1 + size, 2)} times"


def _spread(spread: Quantity, factor: float, *, of_bias: bool) -> str:
    """Standard deviation between the records, or its limit: in a unit, as a factor, or in percent."""
    ends = (spread.value, spread.lower, spread.upper)
    if of_bias:
        value, low, high = (e / factor for e in ends)
        unit = ""
    elif spread.lower > _FACTOR or spread.value > _FACTOR:
        value, low, high = (math.exp(min(e, 50.0)) for e in ends)
        unit = " times"
    else:
        value, low, high = (100 * e for e in ends)
        unit = " %"
    known = high <= _OPEN * max(value, 1.0)  # NaN is not
    if spread.status is QuantityStatus.UPPER_LIMIT or math.isnan(low):
        return f"{upper_limit(high)}{unit}" if known else "–"
    return f"{number(value, 2)}{unit} [{number(low, 2)}, {number(high, 2) if known else '–'}]"


def _next(population: SensorSpread | None, factor: float) -> str:
    if population is None or population.next_sensor is None:
        return "–"
    low, high = (number(end / factor) for end in population.next_sensor)
    return f"{low} to {high}"


def _largest(parameter: ParameterComparison) -> str:
    if parameter.worst is None:
        return "–"
    sure = parameter.worst_p is not None and parameter.worst_p < 0.05
    return parameter.worst if sure else f"{parameter.worst}, not significant"


# -- records, method, table -------------------------------------------------------------------------------


def _records(result: Comparison) -> Iterator[PageBlock]:
    words = {"mean": "means", "point": "points"}
    yield from table(
        ("Record", "Log", "Rate", "Length", "Samples"),
        [
            (r.name, r.source, f"{number(r.rate, 6)} Hz", duration(r.duration), words[r.sampling])
            for r in result.records
        ],
    )
    families = {"flicker": "flicker", "gauss-markov": "a Gauss-Markov term"}
    yield pairs(
        [
            ("Intervals", f"{100 * result.confidence:g} %; “<” is an upper limit, and is used as such"),
            ("Tests", f"{100 * result.level:g} %; p is adjusted for the number of tests"),
            ("Slow noise", ", ".join(f"{c.name}: {families[c.family]}" for c in result.channels)),
        ]
    )


def _method() -> list[PageBlock]:
    return [
        Text("For each record, the loss of the fit away from the best value of a parameter is:"),
        *equation("compared"),
        Text(_METHOD),
        References(_REFERENCES),
    ]


def rows(result: Comparison) -> Iterator[dict[str, object]]:
    """One row of a table for each parameter of each record, in SI."""
    for channel in result.channels:
        for parameter in channel.every_parameter:
            for record, value in zip(result.records, parameter.records, strict=True):
                yield {
                    "channel": channel.name,
                    "parameter": parameter.symbol,
                    "record": record.name,
                    **{name: getattr(value, name) for name in ("value", "lower", "upper", "unit")},
                    "status": value.status.value,
                }
