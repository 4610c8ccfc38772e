# SPDX-License-Identifier: BSD-3-Clause
"""What may be said of a calibration: checks of the residuals, the verdict with its reason, and advice."""

from __future__ import annotations

from dataclasses import replace

from allanite.experiments.calibration.adjustment import Adjustment
from allanite.experiments.calibration.adjustment.weights import TURNS
from allanite.experiments.calibration.results import CalibrationEstimate, EarthSeen
from allanite.experiments.calibration.rows import SOURCES
from allanite.plain_files.counted import plural
from allanite.quantities.earth import DEG_H
from allanite.quantities.residual_tests import SCATTER_ALARM, ResidualTest, alarm
from allanite.recording.calibration import ACCELEROMETER, GYRO

__all__ = ["MORE_POSITIONS", "WHAT", "checks_of", "judge"]

#: What a parameter needs of which the interval is as wide as what is known of any unit.
MORE_POSITIONS = "record more positions: these are too few to tell how far they scatter"
#: Kinds of observations in words.
WHAT = {ACCELEROMETER: "accelerometers at rest", GYRO: "gyros at rest", TURNS: "turns"}
#: What makes them scatter beyond the noise.
REASONS = {
    ACCELEROMETER: "the unit moved while it rested, the accelerometers are not linear (quadratic terms), or their "
    "biases follow the temperature",
    GYRO: "the unit turned while it rested, or the biases of the gyros follow gravity or the temperature",
    TURNS: "the turns were too fast or too rough for the rate of sampling, the gyros are not linear, or the clocks of "
    "gyros and accelerometers differ",
}


def checks_of(fit: Adjustment, *, expected: bool) -> tuple[ResidualTest, ...]:
    """Questions put to the residuals; not of their scatter where it is `expected`: in the hand, or as the noise."""
    checks = []
    for name, group in fit.pure.items():
        if expected or group.dof < 0.5:
            continue
        checks.append(
            ResidualTest(
                name=f"scatter of the {WHAT[name]}",
                statistic=group.chi2,
                dof=group.dof,
                p=group.p,
                passed=group.p >= SCATTER_ALARM,
                says=f"the {WHAT[name]} scatter {group.ratio:.3g} times as much as the noise says, which widens the "
                f"intervals: {REASONS[name]}",
                widens=True,
            )
        )
    if fit.earth is not None and fit.earth.resolved:
        checks.append(_earth_check(fit.earth))
    return tuple(checks)


def _earth_check(earth_estimate: EarthSeen) -> ResidualTest:
    z = (earth_estimate.length - earth_estimate.expected) / earth_estimate.length_sd
    return alarm(
        "rate of the Earth",
        z**2,
        1,
        f"the gyros at rest see a rotation of {earth_estimate.length / DEG_H:.4g} deg/h where the Earth has "
        f"{earth_estimate.expected / DEG_H:.4g}: wrong latitude, biases that follow gravity, or a unit that turned",
    )


def judge(estimate: CalibrationEstimate, *, astray: str, missing: tuple[str, ...]) -> CalibrationEstimate:
    """With verdict, reason and advice; `missing` are the half axes that no position covers."""
    estimated = [p for p in estimate.parameters if p.status == "estimated"]
    verdict, reason = _verdict(estimate, astray, len(estimated), missing)
    return replace(estimate, verdict=verdict, reason=reason, advice=() if astray else _advice(estimate))


def _advice(estimate: CalibrationEstimate) -> tuple[str, ...]:
    """What to do, the most pressing first."""
    advice = [c.says for c in estimate.checks if not c.passed]
    if estimate.outliers:
        phrases = (
            ("it contradicts", "look at it")
            if len(estimate.outliers) == 1
            else ("they contradict", "look at them")
        )
        advice.insert(
            0,
            f"{', '.join(estimate.outliers)}: {phrases[0]} the rest; {phrases[1]} in the pictures and, if something "
            f"happened there, calibrate without (--without {','.join(_numbers(estimate))})",
        )
    if (
        estimate.temperature_span is not None
        and estimate.calibration.temperature is None
        and _drifts(estimate)
    ):
        low, high = estimate.temperature_span
        advice.append(
            f"the temperature went from {low:.3g} to {high:.3g}: slopes of the biases with it may explain the scatter "
            f"(--reference-temperature {(low + high) / 2:.0f})"
        )
    if estimate.add:
        advice.append(f"to estimate what is left open, add: {'; '.join(estimate.add)}")
    elif estimate.assumed:
        advice.extend(dict.fromkeys(a for p in estimate.parameters for a in p.advice))
    if MORE_POSITIONS not in advice and any(MORE_POSITIONS in p.advice for p in estimate.parameters):
        advice.append(MORE_POSITIONS)
    return tuple(advice)


def _numbers(estimate: CalibrationEstimate) -> list[str]:
    """Of what contradicts the rest, as `without` takes them."""
    positions = [str(p.number) for p in estimate.positions if p.outlier]
    return positions + [f"{t.before}-{t.after}" for t in estimate.turns if t.outlier]


def _axes(missing: tuple[str, ...]) -> str:
    axes = list(dict.fromkeys(words[0] for words in missing))
    return f"accelerometer{'s' * (len(axes) > 1)} {', '.join(axes)}"


def _drifts(estimate: CalibrationEstimate) -> bool:
    return any(not c.passed and c.widens and "at rest" in c.name for c in estimate.checks)


def _verdict(
    estimate: CalibrationEstimate, astray: str, estimated: int, missing: tuple[str, ...]
) -> tuple[str, str]:
    used = sum(p.used for p in estimate.positions)
    determine = plural(used, "position", "determine")
    if astray:
        return "inconsistent", astray
    grave = [c for c in estimate.checks if not c.passed and not c.widens]
    earth = [c.says for c in grave if c.name == "rate of the Earth"]
    if earth:
        return "inconsistent", earth[0]
    if estimate.outliers:  # named before what it does to the comparison of accelerometers and gyros
        one = len(estimate.outliers) == 1
        phrase = "does not go with what all others say" if one else "do not go with what the others say"
        return "inconsistent", f"{', '.join(estimate.outliers)} {phrase}"
    if grave:
        return "inconsistent", grave[0].says
    if not estimated:
        return "not calibrated", f"{determine} no parameter"
    if missing and estimated + len(estimate.assumed) < len(estimate.parameters):
        return (
            "partly calibrated",
            (
                f"no position has {' or '.join(missing)} within 60 deg: bias and scale factor of {_axes(missing)} are "
                f"not resolved; {determine} {estimated} of {len(estimate.parameters)} parameters"
            ),
        )
    if any(p.status == "not resolved" for p in estimate.parameters):
        return (
            "partly calibrated",
            f"{determine} {estimated} of {len(estimate.parameters)} parameters and hardly tell how far they scatter",
        )
    if estimate.assumed:
        return (
            "partly calibrated",
            f"{determine} {estimated} of {len(estimate.parameters)} parameters; the others stay near nominal",
        )
    noise_is_stated = estimate.model_source != SOURCES["scatter"]
    widened = (
        " with intervals widened by scatter beyond the noise" if estimate.inflated and noise_is_stated else ""
    )
    return "calibrated", f"{determine} all {len(estimate.parameters)} parameters{widened}"
