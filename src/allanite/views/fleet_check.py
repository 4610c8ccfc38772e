# SPDX-License-Identifier: BSD-3-Clause
"""What a bench test says: pass, fail or cannot tell, coefficient by coefficient."""

from __future__ import annotations

import math
from collections.abc import Iterator

from allanite.fitting.record_lengths import span
from allanite.quantities.display_units import coefficient_unit
from allanite.quantities.number_words import duration, number
from allanite.stability.fleet.checking import CoefficientCheck, FleetCheck
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Cell, Page, PageBlock, References, Text, table
from allanite.views.result_page import findings_of, result_page, verdict_banner

__all__ = ["rows", "view"]

_METHOD = (
    "A coefficient passes where its whole 95 % interval lies below the limit, and fails where it lies above; the 5 % "
    "of a false failure is shared by all coefficients. A unit at a limit passes in at most 5 % of logs, and one that "
    "keeps its limits fails in at most 5 %. All coefficients must pass [1]."
)
_LOOKS = {"pass": "good", "fail": "fatal"}
_REFERENCES = (
    "R. Berger, “Multiparameter hypothesis testing and acceptance sampling”, Technometrics 24 (1982) 295.",
)


def view(document: ResultDocument[FleetCheck]) -> Page:
    """The page of a bench test."""
    result, made = document.result, document.provenance
    return result_page(
        document,
        title=("" if made is None else made.source) or "Bench test",
        kicker="Does the unit keep its limits?",
        facts=[
            ("Length", duration(result.length)),
            ("Coefficients", str(len(result.coefficients))),
            ("Not checked", ", ".join(result.unlimited)),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", [Text(_METHOD), References(_REFERENCES)]),
        },
    )


def _verdict(result: FleetCheck) -> Iterator[PageBlock]:
    names = [*result.unfitted, *(f"{c.limit.symbol} of {c.limit.channel}" for c in result.coefficients)]
    yield verdict_banner(result.verdict, result.reason, names)
    yield from table(
        ("Coefficient", "Measured", "Limit", "Limit from", "Verdict"),
        [_line(c) for c in result.coefficients],
        caption="Coefficients with their 95 % intervals, beside their limits.",
    )
    if result.unlimited:
        yield Text(f"Not checked, without a limit: {', '.join(result.unlimited)}.", note=True, brief=True)


def _line(c: CoefficientCheck) -> tuple[str | Cell, ...]:
    unit, factor = coefficient_unit(c.kind, c.limit.symbol, c.measured.unit)
    return (
        f"{c.limit.channel} {c.limit.symbol} [{unit}]",
        c.measured.shown(factor),
        number(c.limit.value / factor, 4),
        c.limit.source.value,
        Cell(text=f"{c.verdict.words}{_longer(c.duration)}", look=_LOOKS.get(c.verdict.value, "")),
    )


def _longer(needed: float | None) -> str:
    if needed is None:
        return ""
    return f"; record {span(needed)}" if math.isfinite(needed) else "; no record decides"


def rows(result: FleetCheck) -> Iterator[dict[str, object]]:
    """One row of a table for each coefficient, in SI."""
    for c in result.coefficients:
        yield {
            "channel": c.limit.channel,
            "symbol": c.limit.symbol,
            "unit": c.measured.unit,
            "measured": c.measured.value,
            "lower": c.measured.lower,
            "upper": c.measured.upper,
            "limit": c.limit.value,
            "source": c.limit.source.value,
            "root": c.root,
            "verdict": c.verdict.value,
            "needed_s": "" if c.duration is None else c.duration,
        }
