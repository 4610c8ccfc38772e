# SPDX-License-Identifier: BSD-3-Clause
"""What the report of compared records says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.blocks import (
    Page,
    PageBlock,
    References,
    Subheading,
    Text,
    bullets,
    drawn,
    equation,
    pairs,
    table,
)
from allanite.views.report.measurement import judgement, known_facts, measurement_page
from allanite.views.wording import (
    channel_names,
    channel_table,
    comparison_facts,
    duration,
    model_words,
    outlier_lines,
    record_lines,
    sameness_lines,
    sentence,
)

__all__ = ["page"]

Json = Mapping[str, Any]

#: Rows of a channel's table that speak of all records together.
_TOGETHER = frozenset({"equal?", "if equal", "would be seen", "spread", "middle", "the next", "largest"})

COCHRAN = "W. Cochran, “The combination of estimates from different experiments”, Biometrics 10 (1954) 101."
SELF = (
    "S. Self, K.-Y. Liang, “Asymptotic properties of maximum likelihood estimators and likelihood ratio tests under "
    "nonstandard conditions”, JASA 82 (1987) 605."
)
PAULE = "R. Paule, J. Mandel, “Consensus values and weighting factors”, J. Res. NBS 87 (1982) 377."
VIECHTBAUER = (
    "W. Viechtbauer, “Confidence intervals for the amount of heterogeneity in meta-analysis”, Stat. Med. 26 (2007) "
    "37."
)
NAGASHIMA = (
    "K. Nagashima, H. Noma, T. Furukawa, “Prediction intervals for random-effects meta-analysis: a confidence "
    "distribution approach”, Stat. Methods Med. Res. 28 (2019) 1689."
)


def page(document: Json) -> Page:
    """The page of a comparison."""
    records = document["records"]
    lengths = sorted({duration(r["duration"]) for r in records})
    return measurement_page(
        document,
        title=", ".join(r["name"] for r in records[:4]) + (", …" if len(records) > 4 else ""),
        kicker="Are the records the same?",
        facts=[
            ("Records", str(len(records))),
            ("Channels", ", ".join(c["name"] for c in document["channels"])),
            ("Length", lengths[0] if len(lengths) == 1 else f"{len(lengths)} different ones"),
        ],
        parts={
            "verdict": _verdict,
            "curves": _curves,
            "parameters": _parameters,
            "records": _records,
            "method": _method,
        },
    )


def _verdict(document: Json) -> list[PageBlock]:
    return [
        *judgement(document, ()),
        *table(
            ("Channel", "Allan curves", "Parameters", "Lags that differ alone"),
            sameness_lines(document),
            caption="Are they the same? All lags together with their full covariance, and all parameters together.",
        ),
        *table(
            ("Channel", "What", "Record", "Chance", "The others"),
            outlier_lines(document),
            caption="What stands out.",
        ),
        *bullets([sentence(remark, channel_names(document)) for remark in document["remarks"]]),
    ]


def _curves(document: Json) -> list[PageBlock]:
    words = "Allan deviation of all records with their intervals; dotted: one noise model for all."
    return drawn("curves", document, words, words, view="curves")


def _parameters(document: Json) -> list[PageBlock]:
    blocks: list[PageBlock] = []
    for channel in document["channels"]:
        heads, rows = channel_table(document, channel)
        blocks += [
            Subheading(channel["name"]),
            *table(heads, rows, kept=[row[0] in _TOGETHER for row in rows]),
            pairs([("One noise for all", model_words(channel["model"]))]),
        ]
    words = (
        "Every parameter, record by record, with its interval; an arrow is an upper limit. Dashed: the middle of the "
        "kind with its interval; between the dotted lines lies the next sensor."
    )
    return [
        *blocks,
        Text(
            "“Equal?” is answered with p adjusted for the number of parameters; “would be seen” is the change of one "
            "record that the test sees in four of five cases. Spread: standard deviation of the true values between "
            "records, relative to the value, apart from what each record's own uncertainty adds.",
            note=True,
        ),
        *drawn("parameters", document, words, words, view="parameters"),
    ]


def _records(document: Json) -> list[PageBlock]:
    return [
        *table(("Record", "Log", "Rate", "Length", "Samples"), record_lines(document)),
        known_facts(comparison_facts(document)),
    ]


def _method(document: Json) -> list[PageBlock]:
    return [
        Text("Each record says of a parameter how much worse its fit gets away from the best value:"),
        *equation("compared"),
        Text(
            "D is the loss of the fit (minus twice a log-likelihood ratio) with the parameter held and all others "
            "free; an upper limit takes part with all that it excludes. For normal estimates Q at τ = 0 is Cochran's "
            "chi-square [1]; where coefficients stand at zero its law is drawn from the linearized problem [2]. The "
            "curves are compared by their ratio to one model for all, as cube roots with the exact covariance of each "
            "record, so that neighboring lags do not count twice, and rates, lengths and sampling conventions may "
            "differ. The spread τ is where Q takes its expectation [3], its interval where Q takes the quantiles of "
            "chi-square [4]; middle and next sensor follow from all τ with their weights [5]."
        ),
        References([COCHRAN, SELF, PAULE, VIECHTBAUER, NAGASHIMA]),
    ]
