# SPDX-License-Identifier: BSD-3-Clause
"""Questions put to an alignment: the size of the noise, the scatter of the stands, turns and gravity."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.alignment.case import Case
from allanite.experiments.alignment.checks import AlignmentCheck
from allanite.experiments.alignment.frame import AlignmentSetting
from allanite.experiments.alignment.solution import AlignmentSolution
from allanite.experiments.alignment.verdict import AlignmentCheckKind
from allanite.quantities.distributions import chi_square_tail
from allanite.quantities.earth import normal_gravity
from allanite.quantities.residual_tests import ALARM, alarm, scatter_check, size_check
from allanite.recording.calibration import ACCELEROMETER

__all__ = ["gravity_of_stands", "questions", "scatter_of_stands", "tilt_of_turns"]

Array = NDArray[np.float64]

#: Turns from which gravity is asked about them [rad].
ASKED = math.radians(1.0)
#: How far local gravity may be from the normal one: anomalies, and a height that was not given [m/s^2].
LOCAL = 5e-3


def questions(case: Case) -> list[AlignmentCheck]:
    """Is the noise within the stands that of the models? Not asked where the noise came from the record."""
    if not case.gyro.dof > 0:
        return []
    return [AlignmentCheck.of(AlignmentCheckKind.SIZE, size_check(case.gyro.chi2, int(case.gyro.dof)))]


def scatter_of_stands(case: Case, solution: AlignmentSolution, one: bool) -> list[AlignmentCheck]:
    """Do the stands agree with one Earth and one bias?"""
    if solution.dof <= 0:
        return []
    if one:
        test = alarm("vertical rate", solution.chi2, solution.dof)
        return [AlignmentCheck.of(AlignmentCheckKind.VERTICAL, test)]
    return [
        AlignmentCheck.of(AlignmentCheckKind.STANDS, scatter_check("stands", solution.chi2, solution.dof))
    ]


def gravity_of_stands(
    case: Case, solution: AlignmentSolution, setting: AlignmentSetting
) -> list[AlignmentCheck]:
    """Do calibrated accelerometers show gravity? Not asked of nominal ones, whose errors nobody stated."""
    if ACCELEROMETER not in setting.sensors.calibrated:
        return []
    gravity = normal_gravity(setting.frame.latitude, setting.height)

    def length(p: Array) -> Array:
        return np.asarray(np.linalg.norm(case.geometry.chain(p).force, axis=-1))

    magnitudes = length(solution.parameters)
    gradient = solution.gradient(length)
    covariance = (
        gradient @ solution.inverse @ gradient.T + LOCAL**2 + np.eye(len(magnitudes)) * (1e-6 * gravity) ** 2
    )
    excess = magnitudes - gravity
    worst = float(excess[np.argmax(np.abs(excess))])
    test = alarm("gravity", float(excess @ np.linalg.solve(covariance, excess)), len(magnitudes))
    return [AlignmentCheck.of(AlignmentCheckKind.GRAVITY, test, value=worst)]


def tilt_of_turns(case: Case, solution: AlignmentSolution) -> tuple[AlignmentCheck | None, float]:
    """Do the turns that the gyros saw agree with gravity? If not, by how much their azimuth may be off.

    Returns
    -------
    check : AlignmentCheck or None
    excess : float [rad^2]
        Variance of a turn that gravity finds beyond what was known; 0 where it agrees.
    """
    geometry = case.geometry
    asked = np.array([t.known and t.size > ASKED for t in geometry.turns], dtype=np.bool_)
    if not asked.any():
        return None, 0.0
    values, gradient = solution.answers
    rows = 8 + np.flatnonzero(np.repeat(asked, 2))
    tilt, gradient = values[rows], gradient[rows]
    noise = np.repeat(case.turn_noise[asked], 2)
    covariance = gradient @ solution.inverse @ gradient.T + np.diag(noise + 1e-18)
    chi2 = float(tilt @ np.linalg.solve(covariance, tilt))
    p_value = chi_square_tail(chi2, len(tilt))
    check = AlignmentCheck(
        kind=AlignmentCheckKind.TURNS,
        statistic=chi2,
        dof=len(tilt),
        p=p_value,
        passed=p_value >= ALARM,
        widens=True,
        value=math.sqrt(float(tilt @ tilt) / len(tilt)),
    )
    if check.passed:
        return check, 0.0
    return check, max(float(np.mean(tilt**2 - np.diag(covariance))), 0.0)
