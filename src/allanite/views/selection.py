# SPDX-License-Identifier: BSD-3-Clause
"""What a selection says: sets of terms with their weights, terms with their intervals, lines, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Iterator

from allanite.fitting.selection import TermSelection
from allanite.fitting.selection.results import ChannelSelection, RankedSet
from allanite.noise import Estimate
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, number, probability
from allanite.quantities.quantity import interval_words
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import (
    Cell,
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
from allanite.views.result_page import advice, findings_of, result_page, verdict_banner
from allanite.views.wording.provisos import scale_proviso
from allanite.views.wording.selection import weight_words

__all__ = ["rows", "view"]

#: Terms in the order of their averaging times, and which parameters they have.
_PARAMETERS = {
    "Q": ("Q",), "N": ("N",), "B": ("B",), "G": ("sigma", "B_equiv", "T"),
    "GG": ("sigma", "B_equiv", "T", "sigma_2", "B_equiv_2", "T_2"), "K": ("K",), "R": ("R",),
}  # fmt: skip
_NAMES = {"G": "Gauss-Markov", "GG": "two Gauss-Markov terms"}
#: Sets that a table lists.
_MOST = 8
_REFERENCES = (
    (
        "S. Self, K.-Y. Liang, “Asymptotic properties of maximum likelihood estimators and likelihood ratio tests "
        "under nonstandard conditions”, JASA 82 (1987) 605."
    ),
    (
        "R. B. Davies, “Hypothesis testing when a nuisance parameter is present only under the alternative”, "
        "Biometrika 74 (1987) 33."
    ),
    "K. P. Burnham, D. R. Anderson, “Model selection and multimodel inference”, 2nd ed., Springer 2002.",
    (
        "S. T. Buckland, K. P. Burnham, N. H. Augustin, “Model selection: an integral part of inference”, Biometrics "
        "53 (1997) 603."
    ),
)


def view(document: ResultDocument[TermSelection]) -> Page:
    """The page of a selection."""
    result, made = document.result, document.provenance
    return result_page(
        document,
        title=(made.source if made else "") or "Which terms",
        kicker="Which sum of noise terms does the record support, and with what confidence?",
        facts=[
            ("Channels", ", ".join(c.name for c in result.channels)),
            ("Length", duration(result.channels[0].duration)),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "sets": (
                "Sets of terms",
                [block for i in range(len(result.channels)) for block in _sets(result, i)],
            ),
            "terms": ("Terms and lines", [block for c in result.channels for block in _terms(result, c)]),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", _method()),
        },
    )


def _verdict(result: TermSelection) -> Iterator[PageBlock]:
    channels = result.channels
    names = [c.name for c in channels]
    yield verdict_banner(result.verdict, result.reason, names)
    each = [f"{c.name}: {c.verdict}" for c in channels] if len(channels) > 1 else []
    left_in = (f"{c.name}: {line.words}" for c in channels for line in c.left_in)
    scaled = (f"{c.name}: {words}" for c in channels for words in scale_proviso(c.model))
    yield from advice([*each, *left_in, *scaled], names)


# -- sets -------------------------------------------------------------------------------------------------


def _sets(result: TermSelection, i: int) -> Iterator[PageBlock]:
    channel = result.channels[i]
    name, chosen = channel.name, [channel.name]
    words = f"{name}: weight of every tested set of terms."
    yield from drawn(f"weights-{i}", result, words, words, view="weights", channels=chosen)
    words = f"{name}: Allan deviation with its interval, and that of the best sets of terms."
    yield from drawn(f"curves-{i}", result, words, words, view="curves", channels=chosen)
    lines = [_set_row(channel, ranked) for ranked in channel.candidates[:_MOST]]
    yield from table(
        (name, "Weight", "Score", "Parameters", "Goodness"),
        lines,
        caption="Score: 2 ln L less the penalties of the terms, relative to the best set.",
        kept=[row == 0 for row in range(len(lines))],
    )
    best, shortest = channel.best, duration(channel.shortest)
    left_out = channel.shortest > 1.5 * channel.curve.dt
    yield pairs(
        [
            ("Record", f"{duration(channel.duration)}, {channel.samples} samples"),
            ("Sets tried", str(channel.tried)),
            ("Goodness of the best", f"χ² {best.chi2:.0f} ({best.dof} expected), {probability(best.p)}"),
            (
                "Left out",
                f"averaging times below {shortest}, which no sum of terms explains" if left_out else "",
            ),
        ]
    )


def _set_row(channel: ChannelSelection, ranked: RankedSet) -> tuple[str | Cell, ...]:
    score = f"{ranked.score:.1f}" if ranked.score < -0.05 else "best"
    parameters = ", ".join(
        _parameter(channel, symbol, value)
        for symbol, value in ranked.parameters.items()
        if not symbol.startswith(("amplitude", "frequency"))
    )
    weight = Cell(text=weight_words(ranked.weight), share=ranked.weight)
    return (ranked.words, weight, score, parameters, probability(ranked.p))


def _parameter(channel: ChannelSelection, symbol: str, value: float) -> str:
    unit, factor = _unit(channel, symbol)
    return f"{_name(symbol)} {number(value / factor)} {unit}" if value else f"{_name(symbol)} 0"


def _name(symbol: str) -> str:
    return symbol.replace("T", "T_b")


def _unit(channel: ChannelSelection, symbol: str) -> tuple[str, float]:
    return display_unit(channel.kind, symbol, channel.unit)


# -- terms and lines --------------------------------------------------------------------------------------


def _terms(result: TermSelection, channel: ChannelSelection) -> Iterator[PageBlock]:
    if len(result.channels) > 1:
        yield Subheading(channel.name, brief=True)
    yield from table(
        ("Term", "In sets of weight", f"{100 * result.confidence:g} % interval over all sets"),
        [*_term_rows(channel)],
        caption="Intervals of the terms of the best set; an interval that includes zero is an upper "
        "limit. For the limit of an absent term, use the fit.",
    )
    unit, factor = display_unit(channel.kind, "mean", channel.unit)
    yield from table(
        ("Line", "Amplitude", "Gain and price", ""),
        [
            (
                f"{number(line.frequency, 6)} Hz",
                f"{number(line.amplitude / factor)} {unit}" if line.kept else "–",
                f"{number(line.gain)} of {number(line.price)}",
                "a term" if line.kept else "not supported",
            )
            for line in channel.lines
        ],
        caption="Gain of every line in 2 ln L, and the required gain.",
    )


def _term_rows(channel: ChannelSelection) -> Iterator[tuple[str, str, str]]:
    """Term, weight of the sets that hold it, and its parameters with their intervals if the best set holds it."""
    estimates = {e.symbol: e for e in channel.model.estimates}
    # of one and two Gauss-Markov terms, that which is not the best
    elsewhere = "G" if "sigma_2" in estimates else "GG"
    for letter, symbols in _PARAMETERS.items():
        weight = channel.term_weights[letter]
        texts = [_estimate(channel, estimates[s]) for s in symbols if s in estimates and letter != elsewhere]
        if letter != "GG" or texts or weight > 0.01:
            yield _NAMES.get(letter, letter), weight_words(weight), ", ".join(texts) or "–"


def _estimate(channel: ChannelSelection, e: Estimate) -> str:
    unit, factor = _unit(channel, e.symbol)
    if e.value is None and math.isinf(e.upper):
        return f"{_name(e.symbol)} not identified"
    return f"{_name(e.symbol)} {interval_words(e.value, e.lower, e.upper, factor)} {unit}"


def _method() -> list[PageBlock]:
    return [
        Text(
            "Every sum of terms is a candidate: quantization, white noise, flicker, up to two Gauss-Markov terms, "
            "random walk, ramp. The likelihood of the samples is maximized for each tested set, from set "
            "to set until no neighbor is better. Score and weight of a set are"
        ),
        *equation("selection"),
        Text(
            "The penalty c of a term is the gain in likelihood that an absent term exceeds in one record "
            "out of a hundred: 5.41 for a variance, which cannot be negative; 9.5 for a Gauss-Markov "
            "term, whose correlation time is free, and which can imitate a random walk; 9.5 for a ramp, "
            "which weak slow noise imitates; for a spectral line, by the number of frequencies searched. "
            "A term too weak to detect can never be excluded: every absent term keeps a few percent of the weight."
        ),
        Text(
            "The intervals of the parameters are quantiles of the mixture of all sets by weight. "
            "Intervals for the chosen set alone would have too little coverage."
        ),
        References(_REFERENCES),
    ]


def rows(result: TermSelection) -> Iterator[dict[str, object]]:
    """One row of a table for each candidate, parameters in SI."""
    symbols = list(
        dict.fromkeys(s for c in result.channels for ranked in c.candidates for s in ranked.parameters)
    )
    for channel in result.channels:
        for ranked in channel.candidates:
            yield {
                "channel": channel.name,
                "terms": " ".join(ranked.letters),
                **{name: getattr(ranked, name) for name in ("weight", "score", "log_likelihood", "p")},
                **{symbol: ranked.parameters.get(symbol, "") for symbol in symbols},
            }
