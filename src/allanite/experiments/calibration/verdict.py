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

__all__ = ["WHAT", "checks_of", "judge"]

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


def _earth_check(seen: EarthSeen) -> ResidualTest:
    z = (seen.length - seen.expected) / seen.length_sd
    return alarm(
        "rate of the Earth",
        z**2,
        1,
        f"the gyros at rest see a rotation of {seen.length / DEG_H:.4g} deg/h where the Earth has "
        f"{seen.expected / DEG_H:.4g}: wrong latitude, biases that follow gravity, or a unit that turned",
    )


def judge(found: CalibrationEstimate, *, astray: str, missing: tuple[str, ...]) -> CalibrationEstimate:
    """With verdict, reason and advice; `missing` are the half axes that no position covers."""
    estimated = [p for p in found.parameters if p.status == "estimated"]
    verdict, reason = _verdict(found, astray, len(estimated), missing)
    return replace(found, verdict=verdict, reason=reason, advice=() if astray else _advice(found))


def _advice(found: CalibrationEstimate) -> tuple[str, ...]:
    """What to do, the most pressing first."""
    advice = [c.says for c in found.checks if not c.passed]
    if found.outliers:
        said = (
            ("it contradicts", "look at it")
            if len(found.outliers) == 1
            else ("they contradict", "look at them")
        )
        advice.insert(
            0,
            f"{', '.join(found.outliers)}: {said[0]} the rest; {said[1]} in the pictures and, if something happened "
            f"there, calibrate without (--without {','.join(_numbers(found))})",
        )
    if found.temperature_span is not None and found.calibration.temperature is None and _drifts(found):
        low, high = found.temperature_span
        advice.append(
            f"the temperature went from {low:.3g} to {high:.3g}: slopes of the biases with it may explain the scatter "
            f"(--reference-temperature {(low + high) / 2:.0f})"
        )
    if found.add:
        advice.append(f"to estimate what is left open, add: {'; '.join(found.add)}")
    elif found.assumed:
        advice.extend(dict.fromkeys(a for p in found.parameters for a in p.advice))
    return tuple(advice)


def _numbers(found: CalibrationEstimate) -> list[str]:
    """Of what contradicts the rest, as `without` takes them."""
    positions = [str(p.number) for p in found.positions if p.outlier]
    return positions + [f"{t.before}-{t.after}" for t in found.turns if t.outlier]


def _axes(missing: tuple[str, ...]) -> str:
    axes = list(dict.fromkeys(words[0] for words in missing))
    return f"accelerometer{'s' * (len(axes) > 1)} {', '.join(axes)}"


def _drifts(found: CalibrationEstimate) -> bool:
    return any(not c.passed and c.widens and "at rest" in c.name for c in found.checks)


def _verdict(
    found: CalibrationEstimate, astray: str, estimated: int, missing: tuple[str, ...]
) -> tuple[str, str]:
    used = sum(p.used for p in found.positions)
    determine = plural(used, "position", "determine")
    if astray:
        return "inconsistent", astray
    grave = [c for c in found.checks if not c.passed and not c.widens]
    earth = [c.says for c in grave if c.name == "rate of the Earth"]
    if earth:
        return "inconsistent", earth[0]
    if found.outliers:  # named before what it does to the comparison of accelerometers and gyros
        one = len(found.outliers) == 1
        said = "does not go with what all others say" if one else "do not go with what the others say"
        return "inconsistent", f"{', '.join(found.outliers)} {said}"
    if grave:
        return "inconsistent", grave[0].says
    if not estimated:
        return "not calibrated", f"{determine} no parameter"
    if missing and estimated + len(found.assumed) < len(found.parameters):
        return (
            "partly calibrated",
            (
                f"no position has {' or '.join(missing)} within 60 deg: bias and scale factor of {_axes(missing)} are "
                f"not resolved; {determine} {estimated} of {len(found.parameters)} parameters"
            ),
        )
    if found.assumed:
        return (
            "partly calibrated",
            f"{determine} {estimated} of {len(found.parameters)} parameters; the others stay near nominal",
        )
    told = found.model_source != SOURCES["scatter"]
    widened = " with intervals widened by scatter beyond the noise" if found.inflated and told else ""
    return "calibrated", f"{determine} all {len(found.parameters)} parameters{widened}"
