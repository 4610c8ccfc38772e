# SPDX-License-Identifier: BSD-3-Clause
"""Findings about what the numbers mean: units, scale, bias, aperture."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from allanite.health.disturbance import NOTICED, excess_of, moved, quiet_deviations
from allanite.health.finding import Finding, Severity, finding
from allanite.health.survey import Survey
from allanite.recording import Kind

__all__ = ["aliasing", "bias_removed", "gravity", "known_step", "triads", "unit", "unit_trap"]

#: Standard gravity [m/s^2] (exact, CGPM 1901). Gravity on the ground is within 0.35 % of it.
GRAVITY = 9.80665
#: N of the noisiest gyros sold, with a margin [rad/s/sqrt(Hz)]: 0.3 deg/s/sqrt(Hz).
NOISIEST_GYRO = math.radians(0.3)
#: Steps of 16-bit gyros in deg/s: full scale over 32768, and the sensitivities of common data sheets.
GYRO_STEPS = (
    *(full / 32768.0 for full in (125.0, 250.0, 500.0, 1000.0, 2000.0)),
    *(1.0 / per for per in (262.4, 131.0, 131.2, 65.5, 65.6, 32.8, 16.4)),
    *(4.375e-3, 8.75e-3, 17.5e-3, 35e-3, 70e-3),
)
#: A step is one of these if it agrees to so much. Seventeen of them so wide cover 1.5e-3 of a decade: a step that may
#: be any number of eight decades agrees by chance in 2e-4 of records.
STEP_AGREES = 1e-4


def unit(survey: Survey) -> Iterator[Finding]:
    """No unit, or counts (battery B18; class 13)."""
    if survey.channel.kind is Kind.UNKNOWN:
        yield finding(
            "unit_missing",
            "the unit is unknown: results stay in the channel's own unit",
            severity=Severity.WARNING,
            channel=survey.name,
            count=survey.present,
        )
    elif survey.channel.kind is Kind.COUNTS:
        yield finding(
            "counts",
            "in counts: results are in LSB",
            severity=Severity.INFO,
            channel=survey.name,
            count=survey.present,
        )


def aliasing(survey: Survey) -> Iterator[Finding]:
    """An aperture shorter than the interval: wide-band noise folds down (class 10)."""
    aperture = survey.channel.aperture
    if aperture is None or aperture >= 0.999 * survey.dt:
        return
    factor = math.sqrt(survey.dt / aperture)
    yield finding(
        "aliasing",
        f"each sample averages {aperture:.6g} s of its {survey.dt:.6g} s: N of a wide-band sensor reads "
        f"{factor:.3g} times too large",
        severity=Severity.WARNING if factor > 1.02 else Severity.INFO,
        channel=survey.name,
        count=survey.present,
    )


def unit_trap(survey: Survey) -> Iterator[Finding]:
    """Degrees labelled as radians (battery B18)."""
    if survey.channel.kind is not Kind.RATE or excess_of(survey) >= NOTICED:
        return
    noise = survey.sigma * abs(survey.channel.scale) * math.sqrt(survey.dt)
    if noise > NOISIEST_GYRO:
        yield finding(
            "unit_trap",
            f"white noise of {math.degrees(noise):.3g} deg/s/√Hz is more than any gyro's; divided by 57.3 it would be "
            f"{noise:.3g}: are these degrees, labelled {survey.channel.unit!r}?",
            severity=Severity.WARNING,
            channel=survey.name,
            count=survey.present,
        )


def known_step(survey: Survey) -> Iterator[Finding]:
    """The step of a gyro is that of a common range, but in the other unit of angle (battery B18)."""
    step, channel = survey.lattice.step, survey.channel
    if channel.kind is not Kind.RATE or step <= 0.0 or survey.lattice.codes < 8 or not channel.unit:
        return
    if survey.sigma < 1e-6 * step or any(True for _ in unit_trap(survey)):  # which says it
        return
    said = next((angle for angle in ("rad", "deg") if angle in channel.unit.replace("°", "deg")), None)
    if said is None:
        return
    meant, factor = ("deg", math.radians(1.0)) if said == "rad" else ("rad", math.degrees(1.0))
    other = math.degrees(
        step * channel.scale * factor
    )  # the step in deg/s, were the numbers in the other unit
    known = [s for s in GYRO_STEPS if abs(other / s - 1.0) < STEP_AGREES]
    if known:
        yield finding(
            "unit_trap",
            f"the values come in steps of {step:.6g}: in {meant}/s that is the step of a common 16-bit gyro "
            f"({known[0]:.6g} deg/s), in {channel.unit} of none: are these {meant}/s, labelled {channel.unit!r}?",
            severity=Severity.WARNING,
            channel=survey.name,
            count=survey.present,
            advice=f"if so, say it: --unit {survey.name}={meant}/s",
        )


# -- the whole recording ----------------------------------------------------------------------------------


def bias_removed(surveys: Sequence[Survey]) -> Iterator[Finding]:
    """Gyro means of zero within their own noise (class 9).

    The mean is compared with three times the smallest deviation between block means that the record shows. A
    real bias is far larger; if it were spread over only a hundred times that deviation, one axis would pass by
    chance in 2.4 % and two of three in 0.2 %, so of a triad at least two axes must agree.
    """
    gyros = [s for s in surveys if s.channel.kind is Kind.RATE and s.scales and not s.constant]
    tiny = [s for s in gyros if abs(s.mean) < 3.0 * min(quiet_deviations(s)) and excess_of(s) < NOTICED]
    if len(tiny) < (2 if len(gyros) >= 3 else 1):
        return
    for s in tiny:
        rate = math.degrees(s.mean * s.channel.scale) * 3600.0
        yield finding(
            "bias_removed",
            f"the mean is {s.mean:.3g}{s.unit} ({rate:.3g} deg/h), zero within the sensor's own noise: the bias was "
            "subtracted, and the Earth's rotation is gone with it",
            severity=Severity.WARNING,
            channel=s.name,
            count=s.present,
        )


def gravity(surveys: Sequence[Survey]) -> Iterator[Finding]:
    """The mean of an accelerometer triad is not 1 g long (battery B18)."""
    if any(moved(s) for s in surveys):
        return
    for triad in triads([s for s in surveys if s.channel.kind is Kind.ACCELERATION and s.present]):
        norm = math.sqrt(sum((s.mean * s.channel.scale) ** 2 for s in triad))
        ratio = norm / GRAVITY
        if abs(ratio - 1.0) <= 0.01:
            continue
        names = ", ".join(s.name for s in triad)
        yield finding(
            "gravity",
            f"the mean of {names} is {norm:.5g} m/s² long, {ratio:.4g} g{_mix_up(ratio)}",
            severity=Severity.WARNING,
            count=sum(s.present for s in triad),
        )


def triads(accelerometers: Sequence[Survey]) -> list[tuple[Survey, ...]]:
    """Threes of channels whose names differ in the axis alone; three unrelated names are one triad too."""
    groups: dict[str, list[Survey]] = {}
    for s in accelerometers:
        stem = "".join(c for c in s.name.casefold() if c not in "xyz0123")
        groups.setdefault(stem, []).append(s)
    triads = [tuple(g) for g in groups.values() if len(g) == 3]
    return triads or ([tuple(accelerometers)] if len(accelerometers) == 3 else [])


def _mix_up(ratio: float) -> str:
    """What would explain a length of so many g."""
    if ratio < 0.02 and abs(ratio / 1e-3 - 1.0) >= 0.03:
        return ": gravity was subtracted before logging, and the bias cannot be told from what is left"
    for factor, text in (
        (GRAVITY, "m/s² labelled as g"),
        (1.0 / GRAVITY, "g labelled as m/s²"),
        (1e3, "mg labelled as g"),
        (1e-3, "g labelled as mg"),
        (math.degrees(1.0), "a factor 57.3 between degrees and radians"),
        (math.radians(1.0), "a factor 57.3 between degrees and radians"),
    ):
        if abs(ratio / factor - 1.0) < 0.03:
            return f": {text} would explain it"
    return ""
