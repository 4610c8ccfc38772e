# SPDX-License-Identifier: BSD-3-Clause
"""What the report of a selection of terms says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.blocks import (
    Page,
    PageBlock,
    References,
    Subheading,
    Text,
    drawn,
    equation,
    findings,
    pairs,
    table,
)
from allanite.views.report.measurement import judgement, measurement_page
from allanite.views.wording import (
    candidate_lines,
    chosen_line_lines,
    duration,
    selection_facts,
    term_lines,
    weight_words,
)

__all__ = ["page"]

Json = Mapping[str, Any]

SELF = (
    "S. Self, K.-Y. Liang, “Asymptotic properties of maximum likelihood estimators and likelihood ratio tests under "
    "nonstandard conditions”, JASA 82 (1987) 605."
)
DAVIES = (
    "R. B. Davies, “Hypothesis testing when a nuisance parameter is present only under the alternative”, Biometrika "
    "74 (1987) 33."
)
BURNHAM = "K. P. Burnham, D. R. Anderson, “Model selection and multimodel inference”, 2nd ed., Springer 2002."
BUCKLAND = (
    "S. T. Buckland, K. P. Burnham, N. H. Augustin, “Model selection: an integral part of inference”, Biometrics 53 "
    "(1997) 603."
)


def page(document: Json) -> Page:
    """The page of a selection."""
    channels = document["channels"]
    return measurement_page(
        document,
        title=document.get("source") or "Which terms",
        kicker="Which sum of noise terms does the record support, and how sure is that?",
        facts=[
            ("Channels", ", ".join(c["name"] for c in channels)),
            ("Length", duration(channels[0]["duration"])),
        ],
        parts={
            "verdict": _verdict,
            "sets": _sets,
            "terms": _terms,
            "findings": findings,
            "method": _method,
        },
        titles={"sets": "Sets of terms", "terms": "Terms and lines"},
    )


def _verdict(document: Json) -> list[PageBlock]:
    channels = document["channels"]
    remarks = [f"{c['name']}: {c['verdict']}" for c in channels] if len(channels) > 1 else []
    remarks += [f"{c['name']}: {remark}" for c in channels for remark in c["remarks"]]
    return judgement(document, remarks)


def _sets(document: Json) -> list[PageBlock]:
    blocks: list[PageBlock] = []
    for i, channel in enumerate(document["channels"]):
        name, options = channel["name"], {"channels": [channel["name"]]}
        words = f"{name}: weight of every set of terms that was tried."
        blocks += drawn(f"weights-{i}", document, words, words, view="weights", **options)
        words = f"{name}: Allan deviation with its interval, and that of the first sets of terms."
        blocks += drawn(f"curves-{i}", document, words, words, view="curves", **options)
        rows = [
            (terms, weight_words(weight), score, parameters, p)
            for terms, weight, score, parameters, p in candidate_lines(channel)
        ]
        blocks += table(
            (name, "Weight", "Score", "Parameters", "Goodness"),
            rows,
            caption="Score: 2 ln L less the prices of the terms, below that of the best.",
            kept=[row == 0 for row in range(len(rows))],
        )
        blocks.append(pairs([(fact.capitalize(), sentence) for fact, sentence in selection_facts(channel)]))
    return blocks


def _terms(document: Json) -> list[PageBlock]:
    blocks: list[PageBlock] = []
    level = f"{100 * document['confidence']:g} %"
    for channel in document["channels"]:
        if len(document["channels"]) > 1:
            blocks.append(Subheading(channel["name"]))
        blocks += table(
            ("Term", "In sets of weight", f"{level} interval over all sets"),
            term_lines(channel),
            caption="Intervals of the terms of the best set; zero within the interval makes it an upper limit. How "
            "large an absent term may be, is a question for the fit.",
        )
        blocks += table(
            ("Line", "Amplitude", "Gain and price", ""),
            chosen_line_lines(channel),
            caption="What every line gains in 2 ln L, and what it must.",
        )
    return blocks


def _method(document: Json) -> list[PageBlock]:
    return [
        Text(
            "Every sum of terms is a candidate: quantization, white noise, flicker, up to two Gauss-Markov terms, "
            "random walk, ramp. The likelihood of the samples is maximized for each set that is tried, from set to "
            "set until none that is one step away is better. A set scores and weighs"
        ),
        *equation("selection"),
        Text(
            "The price c of a term is what the likelihood gains in one record out of a hundred when the term is "
            "absent: 5.41 for a variance, which cannot be negative; 9.5 for a Gauss-Markov term, whose correlation "
            "time is free, and which with a long one passes for a random walk; 9.5 for a ramp, which weak slow noise "
            "imitates; "
            "for a spectral line by the number of frequencies that it was looked for at. A term too weak to be seen "
            "can never be excluded: every absent one keeps some percent of the weight."
        ),
        Text(
            "The intervals of the parameters are quantiles of the mixture of all sets by their weight. Intervals "
            "that take the chosen set for granted would cover too little."
        ),
        References([SELF, DAVIES, BURNHAM, BUCKLAND]),
    ]
