# SPDX-License-Identifier: BSD-3-Clause
"""What the report of an alignment says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.experiments.north import Arc
from allanite.views.blocks import (
    Details,
    Hero,
    Page,
    PageBlock,
    References,
    Text,
    drawn,
    equation,
    findings,
    pairs,
    table,
)
from allanite.views.rates import ROSENBERG, checks_table
from allanite.views.report.measurement import judgement, measurement_page
from allanite.views.wording import (
    alignment_budget,
    angle,
    arcs_words,
    attitude_lines,
    axes_words,
    bias_words,
    check_lines,
    coarse_lines,
    direction_words,
    duration,
    horizontal_line,
    latitude_line,
    model_words,
    naive_words,
    sentence,
    stand_words,
    standing_words,
    tone,
)

__all__ = ["page"]

Json = Mapping[str, Any]
_MOST_ROWS = 12  # of a table that is not folded away

BLACK = "H. D. Black, A passive system for determining the attitude of a satellite, AIAA Journal 2 (1964) 1350 (TRIAD)."
SHUSTER = (
    "M. D. Shuster, S. D. Oh, Three-axis attitude determination from vector observations, Journal of Guidance and "
    "Control 4 (1981) 70 (QUEST)."
)


def page(document: Json) -> Page:
    """The page of an alignment."""
    channels = document["channels"]
    return measurement_page(
        document,
        title=document.get("source") or "Alignment",
        kicker="Roll, pitch and heading from gravity and the Earth's rotation",
        facts=[
            ("Gyros", ", ".join(channels["gyro"])),
            ("Accelerometers", ", ".join(channels["accelerometer"])),
            ("Axes", axes_words(document)),
            ("Length", duration(document["duration"])),
            ("Latitude", angle(document["latitude"])),
        ],
        parts={
            "verdict": _verdict,
            "pictures": _pictures,
            "record": _record,
            "checks": _checks,
            "findings": findings,
            "method": _method,
        },
        titles={"record": "What was used"},
    )


def _verdict(document: Json) -> list[PageBlock]:
    verdict, last = document["verdict"], document["last"]
    percent = f"{100 * document['confidence']:g} %"
    blocks = judgement(document)
    rate = horizontal_line(document)
    axis = last["heading_axis"]
    blocks.append(
        Hero(
            direction_words(last),
            f"heading of the {axis} axis, from north over east",
            f"{percent} interval: {arcs_words([Arc.from_json(last['interval'])])}",
            f"horizontal rate {rate.value} [{rate.range}]; expected {rate.expected}",
            tone(verdict),
        )
    )
    lines = [*attitude_lines(document), rate, *(x for x in [latitude_line(document)] if x)]
    blocks += table(
        ("", "Found", f"{percent} interval", "Expected"),
        [(line.name, line.value, line.range, line.expected) for line in lines],
        caption="Roll, pitch and heading are those of forward, right, down.",
    )
    if document["statement"]:
        blocks.append(Text(sentence(document["statement"]), note=True))
    rows = alignment_budget(document)
    blocks += table(
        ("Source", "Standard uncertainty of the heading, deg"),
        rows,
        caption="Where the uncertainty comes from.",
        kept=[name == "together" for name, _ in rows],
    )
    return blocks


def _pictures(document: Json) -> list[PageBlock]:
    last = document["last"]
    return [
        *drawn(
            "compass",
            document,
            "The heading with the directions that the record does not contradict, and the horizontal rate beside that "
            "of the Earth.",
            f"Compass: {direction_words(last)}, interval {arcs_words([Arc.from_json(last['interval'])])}.",
            view="compass",
        ),
        *drawn(
            "convergence",
            document,
            "The heading at the end of the record, from what was measured until then, with its interval.",
            "Running estimate of the heading.",
            view="convergence",
        ),
        *drawn(
            "residuals",
            document,
            "What each gyro shows in each attitude less the fit, with its standard deviation by the noise.",
            "Residuals of each stand.",
            view="residuals",
        ),
    ]


def _record(document: Json) -> list[PageBlock]:
    rows = [(str(i + 1), *stand_words(s)) for i, s in enumerate(document["stands"])]
    heads = ("Attitude", "Time", "At rest", "Turned since the first", "Roll", "Pitch")
    stands = table(heads, rows, caption="Attitudes in the order of time.")
    if len(rows) > _MOST_ROWS:
        stands = [Details(f"All {len(rows)} attitudes", stands)]
    biases = table(
        ("Gyro", "Bias, deg/h", "Standard deviation", "Known before to", "Told"),
        [(name, *bias_words(bias)) for name, bias in document["biases"].items()],
        caption="Biases of the gyros as the fit leaves them.",
    )
    calibration = (
        document["calibration_source"] or "given" if document["calibrated"] else "none: nominal sensors"
    )
    return [
        pairs(
            [
                ("Stood", standing_words(document)),
                ("Calibration", calibration),
                ("Plain mean", naive_words(document)),
            ]
        ),
        *(stands if len(rows) > 1 else []),
        *biases,
        *table(
            ("From two vectors alone", "Heading", "Roll", "Pitch"),
            coarse_lines(document),
            caption="Coarse answers of the first attitude: no noise, no interval.",
        ),
    ]


def _checks(document: Json) -> list[PageBlock]:
    gravity = document["gravity"]
    agreement = (
        ""
        if gravity is None
        else f"{gravity:.5f} m/s² measured, {document['expected_gravity']:.5f} m/s² by latitude and height"
    )
    return [
        *checks_table(check_lines(document["checks"]), "Questions put to what the fit leaves."),
        pairs([("Gravity", agreement)]),
    ]


def _method(document: Json) -> list[PageBlock]:
    turning = document["mode"] == "rotation"
    words = (
        "The unit turned about one axis. In the plane across it the Earth's rotation is modulated by the turning; "
        "biases, and what turning adds to gyros and accelerometers, are constants and drop out. The axis is leveled "
        "by what the turning modulates in the accelerometers."
        if turning
        else "Each attitude is leveled by the accelerometers and turned in azimuth by what the gyros saw of the turns "
        "in between. The vertical part v of the Earth's rotation is known from the latitude; the horizontal part e is "
        "fitted with the biases of the gyros, and its direction is north. Biases, scale factors, misalignments, the "
        "noise of the accelerometers and of the turns take part with what is known of them beforehand, so that the "
        "interval holds them all."
    )
    return [
        Text("At rest gyro and accelerometer show, in attitude C:"),
        *equation("alignment"),
        Text(words),
        Text(
            "The length of e is not taken from the latitude: that it agrees is a check. A heading is not a number on a "
            "line: the interval may wrap, and it is the whole circle where no rotation is seen."
        ),
        *equation("least_squares"),
        pairs([(f"Noise of {name}", model_words(model)) for name, model in document["models"].items()]),
        References([BLACK, SHUSTER, ROSENBERG]),
    ]
