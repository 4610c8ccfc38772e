# SPDX-License-Identifier: BSD-3-Clause
"""What an alignment says: its verdict, the angles, the biases, what was used, and what speaks against them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from allanite.experiments.alignment import AlignmentEstimate, Bias, LevelledAttitude
from allanite.plain_files.counted import plural
from allanite.quantities.distributions import normal_quantile
from allanite.quantities.earth import DEG_H
from allanite.quantities.number_words import duration, interval, number
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Details, Hero, Page, PageBlock, References, Text, equation, pairs, table
from allanite.views.rates import ROSENBERG, angle_budget, checks_table
from allanite.views.result_page import advice, findings_of, pictures, result_page, verdict_banner
from allanite.views.wording.north import arcs_words, direction_words
from allanite.views.wording.rates import DEG, angle, capitalised, check_wordings, model_words, sentence

__all__ = ["rows", "view"]

_MOST_ROWS = 12  # of a table that is not folded away
#: A bias is known better than before, if by no more than to this part of its standard deviation then.
_PARTLY = 0.9
_WAYS = {"F": "forward", "B": "backward", "R": "right", "L": "left", "D": "down", "U": "up"}

BLACK = "H. D. Black, A passive system for determining the attitude of a satellite, AIAA Journal 2 (1964) 1350 (TRIAD)."
SHUSTER = (
    "M. D. Shuster, S. D. Oh, Three-axis attitude determination from vector observations, Journal of Guidance and "
    "Control 4 (1981) 70 (QUEST)."
)


def view(document: ResultDocument[AlignmentEstimate]) -> Page:
    """The page of an alignment."""
    result = document.result
    axes = ", ".join(f"{a} {_WAYS[way]}" for a, way in zip("xyz", result.axes, strict=True))
    axes = f"{axes} ({result.axes})"
    return result_page(
        document,
        title=result.source or "Alignment",
        kicker="Roll, pitch and heading from gravity and the Earth's rotation",
        facts=[
            ("Gyros", ", ".join(result.channels["gyro"])),
            ("Accelerometers", ", ".join(result.channels["accelerometer"])),
            ("Axes", axes),
            ("Length", duration(result.duration)),
            ("Latitude", angle(result.latitude)),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "pictures": ("Pictures", pictures(result, _pictures(result))),
            "record": ("What was used", [*_record(result, axes)]),
            "checks": ("Checks", [*_checks(result)]),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", _method(result)),
        },
    )


# -- verdict ----------------------------------------------------------------------------------------------

_Line = tuple[str, str, str, str]
"""Name, value, interval, and what is expected."""


def _verdict(result: AlignmentEstimate) -> Iterator[PageBlock]:
    last, percent = result.last, f"{100 * result.confidence:g} % interval"
    yield verdict_banner(result.verdict, result.reason)
    yield from advice(words for words in result.advice if words not in result.reason)
    rate = _horizontal(result)
    yield Hero(
        direction_words(last),
        f"heading of the {last.heading_axis} axis, from north over east",
        f"{percent}: {arcs_words([last.interval])}",
        f"horizontal rate {rate[1]} [{rate[2]}]; expected {rate[3]}",
        result.verdict.tone,
    )
    yield from table(
        ("", "Estimate", percent, "Expected"),
        [(capitalised(name), *cells) for name, *cells in (*_angles(result), rate, *_latitude(result))],
        caption="Roll, pitch and heading are those of forward, right, down.",
    )
    if result.statement:
        yield Text(sentence(result.statement), note=True, brief=True)
    yield from angle_budget(result.budget, "heading")


def _angles(result: AlignmentEstimate) -> Iterator[_Line]:
    """Heading, roll and pitch at the end; the heading at the beginning where the unit was turned."""
    last, z = result.last, normal_quantile(0.5 + 0.5 * result.confidence)
    yield _heading(last, "heading" if result.one_attitude else "heading at the end")
    yield _level("roll", last.roll, z * last.roll_sd)
    yield _level("pitch", last.pitch, z * last.pitch_sd)
    if not result.one_attitude:
        yield _heading(result.first, "heading at the beginning")


def _heading(attitude: LevelledAttitude, name: str) -> _Line:
    of = "" if attitude.heading_axis == "forward" else f", of the {attitude.heading_axis} axis"
    return f"{name}{of}", direction_words(attitude), arcs_words([attitude.interval]), ""


def _level(name: str, value: float, half: float) -> _Line:
    if not math.isfinite(half):
        return name, "–", "not separable from the heading: the nose points up or down", ""
    middle, low, high = interval(*(v / DEG for v in (value, value - half, value + half)))
    return name, f"{middle}°", f"{low}° to {high}°", ""


def _horizontal(result: AlignmentEstimate) -> _Line:
    """The horizontal rate beside that of the Earth."""
    rate, expected = result.horizontal_length, f"{number(result.expected_rate / DEG_H, 4)} deg/h"
    if not rate.resolved:
        return "horizontal rate", "–", "not separable from the biases", expected
    middle, lower, upper = interval(*(v / DEG_H for v in (rate.value, rate.lower, rate.upper)))
    return "horizontal rate", f"{middle} deg/h", f"{lower} to {upper}", expected


def _latitude(result: AlignmentEstimate) -> Iterator[_Line]:
    """The latitude by the angle between gravity and the rotation, beside the one that was given."""
    latitude = result.measured_latitude
    if latitude.resolved:
        middle, low, high = interval(*(v / DEG for v in (latitude.value, latitude.lower, latitude.upper)))
        yield "latitude", f"{middle}°", f"{low}° to {high}°", angle(result.latitude)


def _pictures(result: AlignmentEstimate) -> dict[str, tuple[str, str]]:
    compass = f"Compass: {direction_words(result.last)}, interval {arcs_words([result.last.interval])}."
    return {
        "compass": (
            ("The heading with its interval, and the horizontal rate compared with that of the Earth."),
            compass,
        ),
        "convergence": (
            "The running estimate of the final heading, with its interval.",
            "Running estimate of the heading.",
        ),
        "residuals": (
            "Residual of each gyro in each attitude, with its standard deviation from the noise.",
            "Residuals of each stand.",
        ),
    }


# -- what was used, checks --------------------------------------------------------------------------------


def _record(result: AlignmentEstimate, axes: str) -> Iterator[PageBlock]:
    yield from table(
        ("Gyro", "Bias, deg/h", "Standard deviation", "Prior sd", "Determined"),
        [(name, *_bias(bias)) for name, bias in result.biases.items()],
        caption="Gyro biases from the fit.",
    )
    yield from table(
        ("From two vectors alone", "Heading", "Roll", "Pitch"),
        [(c.name, *(_degrees(a, 3) for a in (c.heading, c.roll, c.pitch))) for c in result.coarse],
        caption="Coarse answers of the first attitude: no noise, no interval.",
        brief=False,
    )
    yield from _stands(result)
    coarse = [c for c in result.coarse if not math.isnan(c.heading)]
    noise = {name: model_words(model) for name, model in result.models.items()}
    same = set(noise.values())
    given = (result.calibration_source or "given") if result.calibrated else "none: nominal sensors"
    yield pairs(
        [
            ("Stood", _stood(result)),
            ("Coarse", ", ".join(f"{c.name} {_degrees(c.heading, 3)}" for c in coarse)),
            ("Calibration", given),
            ("Plain mean", _naive(result)),
            ("Axes", axes),
            ("Latitude", angle(result.latitude)),
            *([(f"Noise of {name}", words) for name, words in noise.items()] if len(same) > 1 else []),
            ("Noise", "" if len(same) > 1 else "".join(same) or "from the record"),
        ]
    )


def _stands(result: AlignmentEstimate) -> list[PageBlock]:
    if len(result.stands) < 2:
        return []
    lines = [
        (
            str(i),
            f"{s.start:.0f} to {s.stop:.0f} s",
            duration(s.rest),
            *(_degrees(a, 2) for a in (s.turned, s.roll, s.pitch)),
        )
        for i, s in enumerate(result.stands, 1)
    ]
    heads = ("Attitude", "Time", "At rest", "Turned since the first", "Roll", "Pitch")
    stands = table(heads, lines, caption="Attitudes in chronological order.", brief=False)
    return [Details(f"All {len(lines)} attitudes", stands)] if len(lines) > _MOST_ROWS else stands


def _bias(bias: Bias) -> tuple[str, str, str, str]:
    """Value, standard deviation, what was known before [deg/h], and what determines it."""
    before = number(bias.before / DEG_H, 3) if math.isfinite(bias.before) else "unknown"
    if not math.isfinite(bias.value + bias.sd):
        return "–", "–", before, "not separable from the Earth"
    value, sd = bias.value / DEG_H, bias.sd / DEG_H
    by = "record and latitude" if bias.by_latitude else "the record"
    known = "by" if bias.separable else "partly by" if bias.sd < _PARTLY * bias.before else "not by"
    return interval(value, value - sd, value + sd)[0], number(sd, 2), before, f"{known} {by}"


def _degrees(value: float, decimals: int) -> str:
    # a zero without its sign
    return "–" if math.isnan(value) else f"{round(value / DEG, decimals) + 0.0:.{decimals}f}°"


def _naive(result: AlignmentEstimate) -> str:
    """What the plain mean of the beginning would have said."""
    naive = result.naive
    if naive is None or math.isnan(naive.heading):
        return ""
    words = (
        f"{_degrees(naive.heading, 1)}, with {naive.rate / DEG_H:.2f} deg/h: the plain mean of the first "
        f"{duration(naive.duration)}"
    )
    return f"{words}; {'not to be used' if naive.flagged else 'agrees'}"


def _stood(result: AlignmentEstimate) -> str:
    """How the unit stood."""
    if result.mode == "rotation":
        tilted = f"{result.tilt / DEG:.2f}° from the vertical"
        return f"turning all the time: {result.revolutions:.1f} revolutions about an axis {tilted}"
    rest = sum(stop - start for start, stop in result.spans)
    stands = "one attitude" if len(result.stands) == 1 else f"{len(result.stands)} attitudes"
    places = f"{plural(len(result.spans), 'stretch')} and {stands}"
    return f"{duration(rest)} of {duration(result.duration)} at rest, in {places}"


def _checks(result: AlignmentEstimate) -> Iterator[PageBlock]:
    yield from checks_table(check_wordings(result.checks))
    if math.isfinite(result.gravity):
        expected = f"{result.expected_gravity:.5f} m/s² by latitude and height"
        yield pairs([("Gravity", f"{result.gravity:.5f} m/s² measured, {expected}")])


def _method(result: AlignmentEstimate) -> list[PageBlock]:
    words = (
        "The unit turned about one axis. The rotation modulates the component of the Earth's rotation "
        "perpendicular to that axis. Biases, and the effects of the rotation on gyros and accelerometers, "
        "are constant and drop out. The modulation of the accelerometers gives the tilt of the axis."
        if result.mode == "rotation"
        else "The accelerometers level each attitude, and the gyros measure the turns in azimuth between "
        "attitudes. The vertical part v of the Earth's rotation is known from the latitude; the horizontal part e is "
        "fitted with the biases of the gyros, and its direction is north. Biases, scale factors, "
        "misalignments, and the noise of the accelerometers and of the turns enter with their prior "
        "uncertainty, so the interval includes them all."
    )
    return [
        Text("At rest gyro and accelerometer show, in attitude C:"),
        *equation("alignment"),
        Text(words),
        Text(
            "The magnitude of e does not use the latitude, so its agreement is a check. A heading is an "
            "angle: its interval may wrap, and it is the whole circle if no rotation is resolved."
        ),
        *equation("least_squares"),
        References([BLACK, SHUSTER, ROSENBERG]),
    ]


def rows(result: AlignmentEstimate) -> Iterator[dict[str, object]]:
    """One row of a table for each attitude, in people's units."""
    for s in result.stands:
        yield {
            "start_s": f"{s.start:.6f}",
            "stop_s": f"{s.stop:.6f}",
            "rest_s": f"{s.rest:.6f}",
            **{
                f"{name}_deg": f"{value / DEG:.6f}"
                for name, value in (("roll", s.roll), ("pitch", s.pitch), ("turned", s.turned))
            },
            **{f"residual_{a}_deg_h": f"{v / DEG_H:.6g}" for a, v in zip("xyz", s.residual, strict=True)},
            **{f"sd_{a}_deg_h": f"{v / DEG_H:.6g}" for a, v in zip("xyz", s.sd, strict=True)},
        }
