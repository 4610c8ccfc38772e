# SPDX-License-Identifier: BSD-3-Clause
"""Self-calibration of three accelerometers, three gyros or both, from gravity and the Earth's rotation.

A unit rests in several positions and is turned between them. At rest the accelerometers show gravity, whose length is
known, and the gyros the Earth's rotation; what the gyros show on the way must carry gravity from one position to the
next. One least squares of all that gives biases, scale factors and misalignments of both triads, with their covariance
under the noise models of the sensors.

``gathering``, ``starting``, ``problem``   from a recording to a first idea.
``rows``          the same of positions that are kept as their means.
``adjustment``    the least squares, its weights, and what the residuals say.
``estimation``    calibrate.
``outcome``, ``completion``, ``questions``, ``agreement``   what comes of it.
``results``, ``verdict``, ``checks``, ``words``   what is said of it.
``prediction``    the covariance before a single sample is taken.
``orientations``  positions in words.
"""

from allanite.experiments.calibration.estimation import calibrate, calibrate_means
from allanite.experiments.calibration.prediction import Prediction, predict
from allanite.experiments.calibration.results import (
    CalibrationEstimate,
    CalibrationParameter,
    CalibrationPosition,
    CalibrationTurn,
    EarthSeen,
    GyrosAstray,
    ObservationScatter,
)
from allanite.experiments.calibration.verdict import (
    CalibrationNoise,
    CalibrationRemark,
    CalibrationVerdict,
    ParameterNeed,
    ParameterStatus,
)

__all__ = [
    "CalibrationEstimate",
    "CalibrationNoise",
    "CalibrationParameter",
    "CalibrationPosition",
    "CalibrationRemark",
    "CalibrationTurn",
    "CalibrationVerdict",
    "EarthSeen",
    "GyrosAstray",
    "ObservationScatter",
    "ParameterNeed",
    "ParameterStatus",
    "Prediction",
    "calibrate",
    "calibrate_means",
    "predict",
]
