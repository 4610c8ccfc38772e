# SPDX-License-Identifier: BSD-3-Clause
"""Findings about what the numbers mean: units, scale, bias, aperture."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from allanite.recording.channel_names import unit_option
from allanite.recording.health.disturbance import NOTICED, excess_of, quiet_deviations
from allanite.recording.health.finding import Finding, Severity, finding
from allanite.recording.health.resolution import is_unresolved
from allanite.recording.health.survey import ChannelSurvey
from allanite.recording.records import Kind

__all__ = [
    "GRAVITY",
    "aliasing",
    "bias_removed",
    "known_step",
    "triads",
    "unit",
    "unit_trap",
]

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
#: Angular rate of the Earth [rad/s] (IERS Conventions 2010, table 1.1).
EARTH_RATE = 7.292115e-5
#: Size of a gyro's bias over its white noise, at the least [1/sqrt(s)]: 100 deg/h for each deg/sqrt(h), a choice far
#: on the safe side. Data sheets: 240 000 for the MPU-6050, 5 400 for the ADIS16405. Good gyros (0.1 deg/sqrt(h), 1
#: deg/h) fall short of it, but there the Earth's rotation is larger.
BIAS_OVER_NOISE = 100.0 / 60.0
#: Rate of records in which means that nobody touched are called removed.
BY_CHANCE = 0.01


def unit(survey: ChannelSurvey) -> Iterator[Finding]:
    """No unit, or counts (battery B18; class 13)."""
    if survey.channel.kind is Kind.UNKNOWN:
        yield finding(
            "unit_missing",
            "the unit is unknown: results stay in the channel's own unit",
            severity=Severity.WARNING,
            channel=survey.name,
            count=survey.present,
            advice=f"state it, as in {unit_option(_all_unknown(survey))}",
        )
    elif survey.channel.kind is Kind.COUNTS:
        yield finding(
            "counts",
            "in counts: results are in LSB",
            severity=Severity.INFO,
            channel=survey.name,
            count=survey.present,
        )


def _all_unknown(survey: ChannelSurvey) -> list[str]:
    return [c.name for c in survey.recording.channels if c.kind is Kind.UNKNOWN]


def aliasing(survey: ChannelSurvey) -> Iterator[Finding]:
    """An aperture shorter than the interval: wide-band noise folds down (class 10)."""
    aperture = survey.channel.aperture
    if aperture is None or aperture >= 0.999 * survey.dt:
        return
    factor = math.sqrt(survey.dt / aperture)
    yield finding(
        "aliasing",
        f"each sample averages {aperture:.6g} s of its {survey.dt:.6g} s: N of a wide-band sensor is "
        f"{factor:.3g} times too large",
        severity=Severity.WARNING if factor > 1.02 else Severity.INFO,
        channel=survey.name,
        count=survey.present,
    )


def unit_trap(survey: ChannelSurvey) -> Iterator[Finding]:
    """More noise than any gyro's: degrees labelled as radians, or no rate at all (battery B18)."""
    channel = survey.channel
    if channel.kind is not Kind.RATE or excess_of(survey) >= NOTICED:
        return
    noise = survey.sigma * abs(channel.scale) * math.sqrt(survey.dt)
    if noise > NOISIEST_GYRO:
        question, advice = _too_noisy(survey, math.degrees(noise))
        yield finding(
            "unit_trap",
            f"white noise of {math.degrees(noise):.3g} deg/s/√Hz is higher than that of any gyro{question}",
            severity=Severity.WARNING,
            channel=survey.name,
            count=survey.present,
            advice=advice,
        )


def _too_noisy(survey: ChannelSurvey, noise: float) -> tuple[str, str | None]:
    """What a rate with so much noise [deg/s/sqrt(Hz)] may be instead, and what to do."""
    unit, fewer = survey.channel.unit, math.radians(noise)
    if _angle_of(unit) == "rad" and math.radians(fewer) <= NOISIEST_GYRO:
        return f"; divided by 57.3 it would be {fewer:.3g}: are these degrees labeled {unit!r}?", None
    advice = (
        f"check the unit: --unit {survey.name}=mdeg/s; for counts --unit {survey.name}=LSB and, from the data sheet, "
        f"--scale-factor '{survey.name}=131 LSB/(deg/s)'"
    )
    return f": are these counts, volts or millidegrees labeled {unit!r}?", advice


def _angle_of(unit: str) -> str | None:
    """The unit of angle in a unit of rate: "rad", "deg" or neither."""
    return next((angle for angle in ("rad", "deg") if angle in unit.replace("°", "deg")), None)


def known_step(survey: ChannelSurvey) -> Iterator[Finding]:
    """The step of a gyro is that of a common range, but in the other unit of angle (battery B18)."""
    step, channel = survey.lattice.step, survey.channel
    if channel.kind is not Kind.RATE or step <= 0.0 or survey.lattice.codes < 8 or not channel.unit:
        return
    if survey.sigma < 1e-6 * step or any(True for _ in unit_trap(survey)):  # which says it
        return
    stated = _angle_of(channel.unit)
    if stated is None:
        return
    meant, factor = ("deg", math.radians(1.0)) if stated == "rad" else ("rad", math.degrees(1.0))
    other = math.degrees(
        step * channel.scale * factor
    )  # the step in deg/s, were the numbers in the other unit
    known = [s for s in GYRO_STEPS if abs(other / s - 1.0) < STEP_AGREES]
    if known:
        yield finding(
            "unit_trap",
            f"the values come in steps of {step:.6g}: in {meant}/s that is the step of a common 16-bit gyro "
            f"({known[0]:.6g} deg/s), in {channel.unit} it is that of none: are these {meant}/s labeled "
            f"{channel.unit!r}?",
            severity=Severity.WARNING,
            channel=survey.name,
            count=survey.present,
            advice=f"if so, pass --unit {survey.name}={meant}/s",
        )


# -- the whole recording ----------------------------------------------------------------------------------


def bias_removed(surveys: Sequence[ChannelSurvey]) -> Iterator[Finding]:
    """Gyro means that are zero within their own standard error, and nearer than chance brings them (class 9).

    At rest a gyro shows its bias and its part of the Earth's rotation: over orientations evenly spread that part is
    even between -15 and 15 deg/h, and the bias of a gyro is at least `BIAS_OVER_NOISE` times its white noise. So the
    mean, and its error with it, lies within c of zero with a chance of at most p = c/S, S the larger of the two. The
    finding is stated where j of n axes are that close, of a triad at least two, and the chance that j or more are
    (at most the sum over all sets of j axes of the product of their p) is below `BY_CHANCE`: that is the rate of
    false findings. It supposes biases that do not depend on each other. An axis that was put at right angles to the
    Earth's, of a gyro with hardly any bias, is one.
    """
    gyros = [s for s in surveys if s.channel.kind is Kind.RATE and not s.constant and not is_unresolved(s)]
    known = [(s, zero) for s in gyros if (zero := _zero_of(s)) is not None]
    near = [(s, zero) for s, zero in known if zero.near]
    if len(near) < (2 if len(gyros) >= 3 else 1):
        return
    if _chance_of_so_many([zero.chance for _, zero in known], len(near)) > BY_CHANCE:
        return
    most = {s.name: zero.most for s, zero in near}
    gone = any(math.hypot(*(most[s.name] for s in t)) < EARTH_RATE for t in triads([s for s, _ in near]))
    for s, zero in near:
        yield finding(
            "bias_removed",
            f"the mean is {s.mean:.3g}{s.unit} ({_deg_h(zero.mean)} deg/h), zero within its uncertainty "
            f"(standard error {_deg_h(zero.error)} deg/h), although bias and the Earth's rotation give about "
            f"{_deg_h(zero.spread)} deg/h "
            f"or more in a gyro of such noise: the bias was subtracted, {_of_the_earth(zero, gone)}",
            severity=Severity.WARNING,
            channel=s.name,
            count=s.present,
        )


class _Zero(NamedTuple):
    """How a gyro's mean lies to zero [rad/s]: mean, standard error, what 99 % reach, least size of such means."""

    mean: float
    error: float
    reach: float
    spread: float

    @property
    def near(self) -> bool:
        return abs(self.mean) <= self.reach

    @property
    def chance(self) -> float:
        """That the mean of a gyro whose bias was left in lies within the reach; an upper limit."""
        return min(self.reach / self.spread, 1.0)

    @property
    def most(self) -> float:
        """The largest part of the Earth's rotation that may be left in the mean (99 %)."""
        return abs(self.mean) + self.reach


def _zero_of(survey: ChannelSurvey) -> _Zero | None:
    """The mean with its standard error from the scatter of sixteen parts, so slow noise counts; None if unknown."""
    parts = survey.parts[~np.isnan(survey.parts)]
    if not survey.scales or 2 * len(parts) < len(survey.parts) or excess_of(survey) >= NOTICED:
        return None
    scale = abs(survey.channel.scale)
    error = scale * float(parts.std(ddof=1)) / math.sqrt(len(parts))
    lags = [s.lag * survey.dt for s in survey.scales]
    white = min(d * math.sqrt(lag) for d, lag in zip(quiet_deviations(survey), lags, strict=True))
    return _Zero(
        mean=survey.channel.scale * survey.mean,
        error=error,
        reach=_student(len(parts) - 1) * error,
        spread=max(EARTH_RATE, BIAS_OVER_NOISE * scale * white),
    )


def _student(dof: int) -> float:
    """0.995 quantile of Student's distribution (Cornish-Fisher; within 1.2 % from 7 degrees of freedom on)."""
    z = 2.575829
    return z + (z**3 + z) / (4.0 * dof) + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * dof**2)


def _chance_of_so_many(chances: Sequence[float], count: int) -> float:
    """Upper limit of the chance that so many of independent events happen: the elementary symmetric polynomial."""
    sums = [1.0] + [0.0] * count
    for p in chances:
        for j in range(count, 0, -1):
            sums[j] += p * sums[j - 1]
    return sums[count]


def _of_the_earth(zero: _Zero, gone: bool) -> str:
    """What the record can tell of the Earth's rotation."""
    if gone:
        return "and the Earth's rotation, 15 deg/h, with it"
    if zero.most < EARTH_RATE:
        return f"and of the Earth's rotation, at most 15 deg/h, no more than {_deg_h(zero.most)} deg/h can remain"
    return "and the record cannot show whether the Earth's rotation, at most 15 deg/h, was subtracted, too"


def _deg_h(rate: float) -> str:
    return f"{math.degrees(rate) * 3600.0:.3g}"


def triads(sensors: Sequence[ChannelSurvey]) -> list[tuple[ChannelSurvey, ...]]:
    """Threes of channels whose names differ in the axis alone; three unrelated names are one triad too."""
    groups: dict[str, list[ChannelSurvey]] = {}
    for s in sensors:
        stem = "".join(c for c in s.name.casefold() if c not in "xyz0123")
        groups.setdefault(stem, []).append(s)
    triads = [tuple(g) for g in groups.values() if len(g) == 3]
    return triads or ([tuple(sensors)] if len(sensors) == 3 else [])
