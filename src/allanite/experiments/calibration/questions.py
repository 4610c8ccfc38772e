# SPDX-License-Identifier: BSD-3-Clause
"""What is asked of the residuals of a fit: do they scatter as the noise says, and do the gyros see the Earth?"""

from __future__ import annotations

from collections.abc import Iterator

from allanite.experiments.calibration.adjustment import Adjustment
from allanite.experiments.calibration.adjustment.weights import TURNS
from allanite.experiments.calibration.checks import CalibrationCheck
from allanite.experiments.calibration.results import EarthSeen
from allanite.experiments.calibration.verdict import CalibrationCheckKind
from allanite.quantities.residual_tests import SCATTER_ALARM, alarm
from allanite.recording.calibration import ACCELEROMETER, GYRO

__all__ = ["checks_of"]

_KINDS = {
    ACCELEROMETER: CalibrationCheckKind.FORCES,
    GYRO: CalibrationCheckKind.RATES,
    TURNS: CalibrationCheckKind.TURNS,
}


def checks_of(fit: Adjustment, *, expected: bool) -> Iterator[CalibrationCheck]:
    """Questions put to the residuals; not of their scatter where it is `expected`: in the hand, or as the noise."""
    for name, group in fit.pure.items():
        if expected or group.dof < 0.5:
            continue
        yield CalibrationCheck(
            kind=_KINDS[name],
            statistic=group.chi2,
            dof=group.dof,
            p=group.p,
            passed=group.p >= SCATTER_ALARM,
            widens=True,
        )
    if fit.earth is not None and fit.earth.resolved:
        yield _earth_check(fit.earth)


def _earth_check(earth: EarthSeen) -> CalibrationCheck:
    z = (earth.length - earth.expected) / earth.length_sd
    kind = CalibrationCheckKind.EARTH
    return CalibrationCheck.of(kind, alarm(kind, z**2, 1), value=earth.length, expected=earth.expected)
