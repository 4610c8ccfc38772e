# SPDX-License-Identifier: BSD-3-Clause
"""What a search for north says: its verdict, the azimuth, the horizontal rate, and what speaks against them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from allanite.experiments.north import NorthEstimate
from allanite.quantities.earth import DEG_H
from allanite.quantities.number_words import duration, interval, number, with_sd
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Hero, Page, PageBlock, References, Text, equation, pairs, table
from allanite.views.rates import ROSENBERG, angle_budget, checks_table, contradiction_banners
from allanite.views.result_page import advice, findings_of, pictures, result_page, verdict_banner
from allanite.views.wording.north import arcs_words, degrees_of
from allanite.views.wording.rates import angle, check_wordings, model_words, sentence

__all__ = ["view"]


def view(document: ResultDocument[NorthEstimate]) -> Page:
    """The page of a search for north."""
    result = document.result
    axes = ", ".join(f"{name} at {angle(heading)}{_side(heading)}" for name, heading in result.axes.items())
    return result_page(
        document,
        title=result.source or "North",
        kicker="North from the Earth's rotation",
        facts=[
            ("Axes", axes),
            ("Length", duration(result.duration)),
            ("Positions", _positions(result)),
            ("Latitude", angle(result.latitude)),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(document)]),
            "pictures": ("Pictures", pictures(result, _pictures(result))),
            "checks": ("Checks", [*_checks(result)]),
            "findings": ("Findings", findings_of(document)),
            "record": ("Record", [_record(result, axes)]),
            "method": ("Method", _method()),
        },
    )


def _positions(result: NorthEstimate) -> str:
    if result.rotation is not None:
        return "turning all the time"
    return str(len(result.reversals.positions)) if result.reversals else ""


def _verdict(document: ResultDocument[NorthEstimate]) -> Iterator[PageBlock]:
    result = document.result
    yield from contradiction_banners(document.findings or ())
    yield verdict_banner(result.verdict, result.reason)
    yield from advice(words for words in result.advice if words not in result.reason)
    percent, azimuth, arcs = (
        f"{100 * result.confidence:g} % interval",
        _azimuth(result),
        arcs_words(result.interval),
    )
    rate, ends, expected = _horizontal(result)
    yield Hero(
        azimuth,
        "azimuth of the mark, from north over east",
        f"{percent}: {arcs}",
        f"horizontal rate {rate} deg/h {ends}; expected {expected}",
        result.verdict.tone,
    )
    lines = [("Azimuth of the mark", azimuth, arcs, ""), ("Horizontal rate [deg/h]", rate, ends, expected)]
    yield from table(("", "Estimate", percent, "Expected"), lines)
    yield from angle_budget(result.budget, "azimuth")
    if mirrored := _mirrored(result):
        yield Text(sentence(mirrored), note=True, brief=True)


def _azimuth(result: NorthEstimate) -> str:
    """The azimuth with the digits that its standard deviation allows; candidates where there are two."""
    sd = result.total_sd if math.isfinite(result.total_sd) else 0.0
    directions = result.candidates if math.isnan(result.azimuth) else (result.azimuth,)
    return " or ".join(degrees_of(direction, sd) for direction in directions) or "–"


def _horizontal(result: NorthEstimate) -> tuple[str, str, str]:
    """The horizontal rate, its interval and the expected rate in deg/h; a dash where one component alone is seen."""
    rate, expected = result.horizontal, number(result.expected_rate / DEG_H, 4)
    if not rate.resolved:
        return "–", "unbounded: only one component is resolved", expected
    middle, lower, upper = interval(*(v / DEG_H for v in (rate.value, rate.lower, rate.upper)))
    return middle, f"[{lower}, {upper}]", expected


def _side(heading: float) -> str:
    """Where an axis points, seen from the first; "" of that."""
    across = math.sin(heading)
    return "" if abs(across) < 1e-9 else " (right)" if across > 0 else " (left)"


def _mirrored(result: NorthEstimate) -> str:
    """Which way headings count and on which side a second axis is: the azimuth of the mirror image fits as well.

    Opposite positions alone do not tell which way headings count. Others contradict one that is wrong by itself, not
    both together.
    """
    sense = "headings count clockwise" if result.rotation is None else "the rotation counts clockwise"
    if len(result.axes) == 1:
        return f"{sense} seen from above; with the opposite sense the azimuth is mirrored"
    first, second, *_ = result.axes
    side = "right" if math.sin(result.axes[second]) > 0 else "left"
    points = f"the second axis, {second}, points to the {side} of {first}, seen from above"
    if _on_a_line(result):
        return f"{points}; if it points to the other side, the azimuth is mirrored"
    return f"{points}, and {sense}; with both the other way round the azimuth is mirrored"


def _on_a_line(result: NorthEstimate) -> bool:
    """The table stood in opposite directions alone."""
    if result.rotation is not None or result.reversals is None:
        return False
    headings = [d.heading for d in result.reversals.dwells if math.isfinite(d.heading)]
    return all(abs(math.sin(h - headings[0])) < 1e-6 for h in headings)


def _pictures(result: NorthEstimate) -> dict[str, tuple[str, str]]:
    compass = f"Compass: {_azimuth(result)}, interval {arcs_words(result.interval)}."
    return {
        "compass": ("The azimuth with its interval.", compass),
        "running": ("The running estimate of the azimuth.", "Running estimate of the azimuth."),
    }


def _checks(result: NorthEstimate) -> Iterator[PageBlock]:
    yield from checks_table(check_wordings(result.checks))
    yield pairs([(f"Bias of {name}", with_sd(*bias, "deg/h", DEG_H)) for name, bias in result.biases.items()])


def _record(result: NorthEstimate, axes: str) -> PageBlock:
    return pairs(
        [
            ("Axes", axes),
            ("Signal to noise", number(result.signal_to_noise, 3)),
            ("Latitude", angle(result.latitude)),
            ("Length", f"{duration(result.duration)}, in means over {duration(result.block)}"),
            *((f"Noise of {name}", model_words(model)) for name, model in result.models.items()),
        ]
    )


def _method() -> list[PageBlock]:
    return [
        Text(
            "Axis i, at the heading α from the mark, senses the horizontal part of the Earth's rotation at azimuth ψ:"
        ),
        *equation("north"),
        Text(
            "The two components of that vector and the bias of each axis are fitted by generalized least "
            "squares with the noise model. The magnitude of the vector does not use the latitude, so its "
            "agreement is a check. A direction is an angle: its interval may wrap, and it is the whole "
            "circle if no signal is resolved."
        ),
        *equation("least_squares"),
        References([ROSENBERG]),
    ]
