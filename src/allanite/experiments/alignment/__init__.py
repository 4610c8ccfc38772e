# SPDX-License-Identifier: BSD-3-Clause
"""Self-alignment: roll, pitch and heading of a unit of three gyros and three accelerometers from gravity and the Earth.

At rest the accelerometers show the vertical, and the gyros what is left of the Earth's rotation beside their biases:

    mean of the gyros in stand k  =  M C_k^T (e + v) + bias + noise.

e is the horizontal part of the Earth's rotation, two unknown numbers in the level frame of the first stand, and its
direction is north; v is the vertical part, known from the latitude; M the calibrated scale factors and misalignments;
C_k the attitude of stand k, levelled by the accelerometers and turned in azimuth by what the gyros saw of the turns.
One stand cannot tell e from a bias. Turning about the vertical can.

``stands``       means of both triads in each stand, and their covariance in the noise of each axis.
``turns``        the rotation between two stands, by integrating the calibrated gyros, with its derivatives.
``geometry``     levelling and the chain of azimuths: from all parameters to what each gyro shows in each stand.
``known``        what is known beforehand, as one vector with its covariance; ``frame`` channels, models and place.
``case``         a record as stands.
``solution``     e and everything that is known beforehand, in one least squares.
``rotation``     a unit that turns all the time: ``spin`` reads it, ``modulation`` is what turning modulates.
``directions``   from e to headings, their arcs and their budget, at the end and as the record grows.
``questions``    checks of the residuals; ``judgement`` what may be said.
``latitude``     the latitude that the rotation means, without the given one.
``verdict``, ``checks``, ``words``  codes, questions, sentences.
``coarse``       TRIAD, QUEST, and the plain mean of the beginning.
``prediction``   predict_alignment: the standard deviations of a plan, without a sample.
``estimation``   align.
"""

from allanite.experiments.alignment.estimation import align
from allanite.experiments.alignment.frame import unit_of
from allanite.experiments.alignment.prediction import AlignmentPlan, predict_alignment
from allanite.experiments.alignment.results import (
    AlignmentEstimate,
    AlignmentPrediction,
    Bias,
    LevelledAttitude,
    RunningHeading,
)

__all__ = [
    "AlignmentEstimate",
    "AlignmentPlan",
    "AlignmentPrediction",
    "Bias",
    "LevelledAttitude",
    "RunningHeading",
    "align",
    "predict_alignment",
    "unit_of",
]
