# SPDX-License-Identifier: BSD-3-Clause
"""Questions put to an alignment: the size of the noise, the scatter of the stands, turns and gravity."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.alignment.case import Case
from allanite.experiments.alignment.frame import AlignmentSetting
from allanite.experiments.alignment.solution import AlignmentSolution
from allanite.quantities.distributions import chi_square_tail
from allanite.quantities.earth import normal_gravity
from allanite.quantities.residual_tests import ALARM, ResidualTest, alarm, scatter_check, size_check
from allanite.quantities.units import STANDARD_GRAVITY
from allanite.recording.calibration import ACCELEROMETER

__all__ = ["TURNS", "gravity_of_stands", "questions", "scatter_of_stands", "tilt_of_turns"]

Array = NDArray[np.float64]

#: Name of the check that makes turns less certain, and takes nothing else away.
TURNS = "turns against gravity"
#: Turns from which gravity is asked about them [rad].
ASKED = math.radians(1.0)
#: How far local gravity may be from the normal one: anomalies, and a height that was not given [m/s^2].
LOCAL = 5e-3
_REASONS = (
    "an error changes from stand to stand (leveling, turns, a bias that depends on attitude, misalignment, rest that "
    "was none)"
)
_VERTICAL = (
    "the vertical part of what the gyros show is not that of the Earth at this latitude: the biases are larger than "
    "was said, or scale factor, latitude or leveling are wrong"
)


def questions(case: Case) -> list[ResidualTest]:
    """Is the noise within the stands that of the models? Not asked where the noise came from the record."""
    return [size_check(case.gyro.chi2, int(case.gyro.dof))] if case.gyro.dof > 0 else []


def scatter_of_stands(case: Case, solution: AlignmentSolution, one: bool) -> list[ResidualTest]:
    """Do the stands agree with one Earth and one bias?"""
    if solution.dof <= 0:
        return []
    if one:
        return [alarm("vertical rate", solution.chi2, solution.dof, _VERTICAL)]
    return [scatter_check("stands", solution.chi2, solution.dof, _REASONS)]


def gravity_of_stands(
    case: Case, solution: AlignmentSolution, setting: AlignmentSetting
) -> list[ResidualTest]:
    """Do calibrated accelerometers show gravity? Not asked of nominal ones, whose errors nobody stated."""
    if ACCELEROMETER not in setting.sensors.calibrated:
        return []
    gravity = normal_gravity(setting.frame.latitude, setting.height)

    def length(p: Array) -> Array:
        return np.asarray(np.linalg.norm(case.geometry.chain(p).force, axis=1))

    magnitudes = length(solution.parameters)
    gradient = solution.gradient(length)
    covariance = (
        gradient @ solution.inverse @ gradient.T + LOCAL**2 + np.eye(len(magnitudes)) * (1e-6 * gravity) ** 2
    )
    excess = magnitudes - gravity
    worst = float(excess[np.argmax(np.abs(excess))])
    says = (
        f"the calibrated accelerometers are off gravity by {1e3 * worst / STANDARD_GRAVITY:.3g} mg: the calibration is "
        "not that of this sensor, or its biases have changed (state bias_repeatability, --accelerometer-bias), or "
        "latitude or height are wrong"
    )
    return [alarm("gravity", float(excess @ np.linalg.solve(covariance, excess)), len(magnitudes), says)]


def tilt_of_turns(case: Case, solution: AlignmentSolution) -> tuple[ResidualTest | None, float]:
    """Do the turns that the gyros saw agree with gravity? If not, by how much their azimuth may be off.

    Returns
    -------
    check : ResidualTest or None
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
    size = math.degrees(math.sqrt(float(tilt @ tilt) / len(tilt)))
    check = ResidualTest(
        name=TURNS,
        statistic=chi2,
        dof=len(tilt),
        p=p_value,
        passed=p_value >= ALARM,
        says=f"after the turns gravity is {size:.2g} deg from where the gyros say: scale factor, misalignment, or "
        "rest that was none; the azimuth of each turn is taken to be as uncertain",
        widens=True,
    )
    if check.passed:
        return check, 0.0
    return check, max(float(np.mean(tilt**2 - np.diag(covariance))), 0.0)
