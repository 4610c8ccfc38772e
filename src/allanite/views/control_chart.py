# SPDX-License-Identifier: BSD-3-Clause
"""What a control chart says: which points signal, by which rule, and the limits."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import groupby

from allanite.quantities.display_units import coefficient_unit
from allanite.quantities.number_words import number
from allanite.stability.fleet.charts import ControlChart
from allanite.stability.fleet.control_rules import EWMA_LIMIT, EWMA_WEIGHT
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Page, PageBlock, References, Text, pairs, table
from allanite.views.result_page import pictures, result_page, verdict_banner

__all__ = ["rows", "view"]

_MOST = 30  # signals that a page lists; the table beside it has all
_PICTURES = {
    "individuals": (
        "Each log with its 95 % interval; the band is three standard deviations wide on either side of the center."
    ),
    "ewma": "Exponentially weighted mean of the standardized points, with its limits.",
}
_METHOD = (
    "A point is standardized by the spread of the population in phase I, that between logs of one unit, and its own "
    "uncertainty. One point in 370 lies beyond three standard deviations by chance; the four rules of Western Electric "
    "signal once in 92 points [1, 3], the weighted mean once in 500 [4]. Logs that give an upper limit only are no "
    "points."
)
_REFERENCES = (
    "Western Electric, “Statistical Quality Control Handbook”, Indianapolis 1956.",
    "L. Nelson, “The Shewhart control chart – tests for special causes”, J. Qual. Technol. 16 (1984) 237.",
    (
        "C. Champ, W. Woodall, “Exact results for Shewhart control charts with supplementary runs rules”, "
        "Technometrics 29 (1987) 393."
    ),
    (
        "J. Lucas, M. Saccucci, “Exponentially weighted moving average control schemes”, Technometrics 32 (1990) 1."
    ),
)


def view(document: ResultDocument[ControlChart]) -> Page:
    """The page of a control chart."""
    result, made = document.result, document.provenance
    return result_page(
        document,
        title=f"{result.symbol} of {result.channel}",
        kicker="Control chart",
        facts=[
            ("Fleet", "" if made is None else made.source),
            ("Points", str(len(result.logs))),
            ("Phase I", str(result.first)),
            ("Upper limits", str(result.limits_only) if result.limits_only else ""),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "pictures": ("Pictures", pictures(result, _PICTURES)),
            "method": ("Method", [Text(_METHOD), References(_REFERENCES)]),
        },
    )


def _verdict(result: ControlChart) -> Iterator[PageBlock]:
    yield verdict_banner(result.verdict, result.reason, [f"{result.symbol} of {result.channel}"])
    yield from table(
        ("Point", "Log", "Unit", "Deviations", "Rules"),
        [*_signals(result)][:_MOST],
        caption="Points at which a rule signals.",
    )
    unit, factor = coefficient_unit(result.kind, result.symbol, result.unit_of_measure)
    yield pairs(
        [
            ("Center", f"{result.center.shown(factor)} {unit}"),
            ("Limits", _limits(result, unit, factor)),
            ("Weighted mean", f"weight {EWMA_WEIGHT:g}, limit {EWMA_LIMIT:g} standard deviations"),
            ("Order", "by date" if result.by_date else "as in the table"),
        ]
    )


def _signals(result: ControlChart) -> Iterator[tuple[str, ...]]:
    """Each point with all rules that signal at it."""
    for point, group in groupby(result.signals, key=lambda s: s.number):
        every = [*group]
        rules = "; ".join(s.rule.value for s in every)
        yield str(point), every[0].log, every[0].unit, f"{every[0].z:+.1f}", rules


def _limits(result: ControlChart, unit: str, factor: float) -> str:
    """Of the point with the narrowest ones."""
    if not len(result.low):
        return ""
    low, high = (number(end / factor) for end in (result.low.max(), result.high.min()))
    return f"{low} to {high} {unit} for the most certain point"


def rows(result: ControlChart) -> Iterator[dict[str, object]]:
    """One row of a table for each point, in SI."""
    rules: dict[int, list[str]] = {}
    for signal in result.signals:
        rules.setdefault(signal.number, []).append(signal.rule.value)
    for i, log in enumerate(result.logs):
        yield {
            "number": i + 1,
            "log": log,
            "unit": result.units[i],
            "year": "" if math.isnan(result.dates[i]) else float(result.dates[i]),
            "phase": 1 if i < result.first else 2,
            **{
                key: float(getattr(result, key)[i]) for key in ("value", "lower", "upper", "low", "high", "z")
            },
            "ewma": float(result.mean[i]),
            "ewma_limit": float(result.mean_limit[i]),
            "signals": "; ".join(rules.get(i + 1, ())),
        }
