# SPDX-License-Identifier: BSD-3-Clause
"""What a rate vector says: its verdict, the length and the axes, what was used, and what speaks against them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from allanite.experiments.rate_vector import RateSpan, RateVector
from allanite.experiments.rate_vector.words import LEFT_OUT
from allanite.plain_files.counted import plural
from allanite.quantities.earth import DEG_H
from allanite.quantities.number_words import duration, interval, number
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Hero, Page, PageBlock, Text, drawn, equation, pairs, table
from allanite.views.rates import checks_table, estimates_table, rate_budget
from allanite.views.result_page import advice, findings_of, pictures, result_page, verdict_banner
from allanite.views.wording.rates import (
    angle,
    budget_lines,
    check_wordings,
    estimate_of,
    known_rate,
    sentence,
)

__all__ = ["rows", "view"]

_UNSTATED = "The interval includes only the noise: no uncertainty of scale factor or bias is stated."
_QUESTIONS = "Checks of the vector. Chance: the probability of so large a value if the answer is yes."


def view(document: ResultDocument[RateVector]) -> Page:
    """The page of a rate vector."""
    result = document.result
    noise = document.model_name or result.model_source
    return result_page(
        document,
        title=result.source or "Rate vector",
        kicker="Rate vector of three axes at rest",
        facts=[
            ("Axes", ", ".join(result.channels)),
            ("Length", duration(result.duration)),
            ("At rest", f"{duration(result.quiet)} ({100 * result.share:.3g} %)"),
            ("Latitude", "" if result.latitude is None else angle(result.latitude)),
            ("Noise", noise),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "pictures": ("Pictures", pictures(result, _PICTURES)),
            "record": ("What was used", [*_record(document, noise)]),
            "checks": ("Checks", [*_checks(result)]),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", _method()),
        },
    )


# -- verdict ----------------------------------------------------------------------------------------------


def _verdict(result: RateVector) -> Iterator[PageBlock]:
    yield verdict_banner(result.verdict, result.reason)
    yield from advice(words for words in result.advice if words not in result.reason)
    if math.isnan(result.length):
        return
    percent = f"{100 * result.confidence:g} % interval"
    note = "bias and Earth together, everything in the budget included"
    main = estimate_of(result.length, *result.interval, name="magnitude", note=note, kept=True)
    known = known_rate(result.earth_rate)
    yield Hero(
        main.value,
        "deg/h",
        f"{percent} {main.range} deg/h",
        f"{main.seconds} deg/s {main.seconds_range}; the Earth turns at {known.value} deg/h",
        result.verdict.tone,
    )
    yield Text(sentence(result.statement), note=True, brief=True)
    yield from estimates_table([main, known], "Magnitude of the rate.", f", {percent}")
    yield from table(
        ("Axis", "deg/h", "Standard deviation, deg/h", "Angle to the vector"),
        [*_axes(result)],
        caption="The vector in the axes of the sensor; standard deviations from the noise.",
    )
    fine = {name: value for name, value in result.budget.items() if value or name != "resolution"}
    yield from rate_budget(budget_lines(fine)) or [Text(_UNSTATED, note=True, brief=True)]


def _axes(result: RateVector) -> Iterator[tuple[str, str, str, str]]:
    """Each axis: name, rate in deg/h, its standard deviation by the noise, and its angle to the vector."""
    sds, size = np.sqrt(np.diag(result.covariance)), float(np.linalg.norm(result.vector))
    for name, rate, sd in zip(result.channels, result.vector / DEG_H, sds / DEG_H, strict=True):
        if math.isfinite(rate) and math.isfinite(sd):
            value, _, _ = interval(rate, rate - sd, rate + sd)
            share = (
                f"{math.degrees(math.acos(max(-1.0, min(1.0, rate * DEG_H / size)))):.1f}°" if size else "–"
            )
            yield name, value, number(sd, 2), share


# -- pictures, record, checks -----------------------------------------------------------------------------


_PICTURES = {
    "length": (
        (
            "The magnitude of the measured vector, bias plus Earth rate, and the known rate of the Earth. "
            "It needs no latitude, heading or leveling."
        ),
        "Magnitude of the rate vector with its interval, and the known rate.",
    ),
    "means": (
        "The means of the quiet parts, by axis: a drift, a warm-up or a missed turn would show here.",
        "Means of the quiet cells of each axis against time.",
    ),
}


def _record(document: ResultDocument[RateVector], noise: str) -> Iterator[PageBlock]:
    result = document.result
    used = (
        f"{duration(result.quiet)} of {duration(result.duration)} at rest ({100 * result.share:.3g} %), in "
        f"{plural(len(result.used), 'stretch')}"
    )
    yield from drawn(
        "record-figure",
        result,
        "The record: minimum and maximum of each block. The parts at rest were detected in the signal.",
        f"Record of {', '.join(result.channels)}; {used}.",
        view="record",
        recording=document.overviews,
    )
    yield from table(
        ("Left out because", "Stretches", "Together", "The longest"),
        [*_left_out(result.left_out)],
        caption="What was left out; every stretch is in stretches.csv.",
    )
    yield pairs(
        [
            ("Used", used),
            ("Poses", _poses(result)),
            ("Looked at in", f"cells of {duration(result.cell)}"),
            ("Latitude", _latitude(result)),
            ("Noise", noise),
        ]
    )


def _left_out(spans: Iterable[RateSpan]) -> Iterator[tuple[str, str, str, str]]:
    """Why, how often, how long together, and where the longest stretch is; the largest part first."""
    kinds: dict[str, list[RateSpan]] = {}
    for span in spans:
        if span.why is not None:
            kinds.setdefault(LEFT_OUT[span.why], []).append(span)
    lines = sorted(kinds.items(), key=lambda kind: -_total(kind[1]))
    if len(lines) > 1:
        lines.append(("together", [span for several in kinds.values() for span in several]))
    for why, several in lines:
        longest = max(several, key=lambda span: span.duration)
        place = f"{duration(longest.duration)}, from {_clock(longest.start)} to {_clock(longest.stop)}"
        yield why, str(len(several)), duration(_total(several)), place


def _total(spans: Iterable[RateSpan]) -> float:
    return sum(span.duration for span in spans)


def _clock(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole // 3600}:{whole % 3600 // 60:02}:{whole % 60:02}"


def _poses(result: RateVector) -> str:
    """How the sensor stood; nothing where it stood still all the time."""
    if not result.turned:
        return ""
    angles = [
        "unknown" if math.isnan(turn) else f"{math.degrees(turn):.1f}°" for turn in result.turns[1:].tolist()
    ]
    turned_by = ", ".join(angles) if len(angles) <= 6 else f"{', '.join(angles[:6])} and more"
    return f"{len(result.turns)} poses, turned between them by {turned_by}"


def _latitude(result: RateVector) -> str:
    """The latitude that gravity and the vector make together, beside the one that was given."""
    if result.latitude_found is None:
        return "not checked: that takes three accelerometers in the log"
    latitude = f"{math.degrees(result.latitude_found):.2f}° from the angle between gravity and the vector"
    return latitude if result.latitude is None else f"{latitude}; given {angle(result.latitude)}"


def _checks(result: RateVector) -> Iterator[PageBlock]:
    yield from checks_table(check_wordings(result.checks), _QUESTIONS)


def _method() -> list[PageBlock]:
    return [
        Text(
            "Three orthogonal gyros sense the full rotation of the Earth in any attitude C, plus their "
            "biases. The magnitude of the Earth's part needs no latitude, heading or leveling:"
        ),
        *equation("rate_vector"),
        Text(
            "The record is divided into cells. A cell in which an axis moves more than in the quiet "
            "cells, at any time scale, or whose mean deviates, is left out with its neighbors. The level "
            "of the rest is fitted with the noise of each axis, from the given model or from the quiet "
            "parts themselves, averaged over its uncertainty. The bias of the magnitude due to noise is "
            "removed. The interval uses Student's t, and is no narrower than the scatter of batches of cells."
        ),
        Text(
            "Agreement with the Earth rate does not prove that the biases are small: they may match it by "
            "chance. The angle to gravity, and the same magnitude in several attitudes, are evidence against that."
        ),
    ]


def rows(result: RateVector) -> Iterator[dict[str, object]]:
    """One row of a table for each stretch, in the order of time."""
    for span in sorted((*result.used, *result.left_out), key=lambda s: s.start):
        yield {
            "start_s": f"{span.start:.6f}",
            "stop_s": f"{span.stop:.6f}",
            "used": "yes" if span.why is None else "no",
            "why": "" if span.why is None else LEFT_OUT[span.why],
            "pose": span.pose if span.pose >= 0 else "",
        }
