# SPDX-License-Identifier: BSD-3-Clause
"""What the null test between east and west says: its verdict, the bias that follows the turns, and its limit."""

from __future__ import annotations

from collections.abc import Iterator

from allanite.experiments.north import EastWestNull
from allanite.quantities.earth import DEG_H
from allanite.quantities.number_words import duration, interval, number, with_sd
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Cell, Hero, Page, PageBlock, Text, drawn, equation, pairs, table
from allanite.views.rates import checks_table, contradiction_banners, rate_budget
from allanite.views.result_page import advice, findings_of, result_page, verdict_banner
from allanite.views.wording.rates import angle, budget_lines, check_wordings, model_words

__all__ = ["view"]

_UNSTATED = "The interval includes only the noise: no uncertainty of heading or tilt is stated."


def view(document: ResultDocument[EastWestNull]) -> Page:
    """The page of a null test."""
    result, recording = document.result, document.recording
    return result_page(
        document,
        title=result.source or "East and west",
        kicker="Null test between east and west",
        facts=[
            ("Channel", result.channel),
            ("Length", duration(recording.duration) if recording else ""),
            ("Positions", str(len(result.reversals.positions)) if result.reversals else ""),
            ("Latitude", angle(result.latitude)),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(document)]),
            "checks": ("Checks", [*_checks(result)]),
            "findings": ("Findings", findings_of(document)),
            "record": ("Record", [*_record(document)]),
            "method": ("Method", _method()),
        },
    )


def _verdict(document: ResultDocument[EastWestNull]) -> Iterator[PageBlock]:
    result = document.result
    yield from contradiction_banners(document.findings or ())
    yield verdict_banner(result.verdict, result.reason)
    yield from advice(words for words in result.advice if words not in result.reason)
    if not result.following.resolved:
        return
    value, low, high = interval(*(v / DEG_H for v in (result.value, *result.interval)))
    limit, error = (number(v / DEG_H, 3) for v in (result.limit, result.error_of_rate))
    percent = f"{100 * result.confidence:g} % interval"
    yield Hero(
        value,
        "deg/h follow the turns, + pointing east",
        f"{percent} [{low}, {high}] deg/h: none above {limit} deg/h",
        f"in an Earth rate measured with such turns: at most {error} deg/h",
        result.verdict.tone,
    )
    rows: list[tuple[str, str | Cell]] = [
        ("Bias that follows the turns", Cell(text=value, below=f"[{low}, {high}]", look="value")),
        ("Excluded beyond", limit),
        ("Of an Earth rate, at most", error),
    ]
    yield from table(("East and west", f"deg/h, {percent}"), rows, kept=[True, False, False])
    yield from rate_budget(budget_lines(result.budget)) or [Text(_UNSTATED, note=True, brief=True)]


def _checks(result: EastWestNull) -> Iterator[PageBlock]:
    yield from checks_table(check_wordings(result.checks))
    yield pairs([("Bias that stays", with_sd(*result.bias, "deg/h", DEG_H))])


def _record(document: ResultDocument[EastWestNull]) -> Iterator[PageBlock]:
    result, overview = document.result, document.overview
    if overview is not None and result.reversals is not None:
        yield from drawn(
            "record-figure",
            result.reversals,
            "The record: minimum and maximum of each block.",
            f"Raw record of {result.channel}.",
            recording=overview.to_json(),
        )
    noise = "" if result.model is None else f"{document.model_name or 'given'}: {model_words(result.model)}"
    yield pairs([("Latitude", angle(result.latitude)), ("Noise", noise)])


def _method() -> list[PageBlock]:
    return [
        Text(
            "Between east and west the horizontal part of the Earth's rotation does not change. Anything "
            "that still follows the turns is an error that would look like the Earth's rotation between "
            "north and south:"
        ),
        *equation("null_test"),
        Text(
            "Positions within 45° of east or west are used. The test detects a bias that changes between "
            "these two. A bias that changes between north and south affects the Earth rate but does not show here."
        ),
    ]
