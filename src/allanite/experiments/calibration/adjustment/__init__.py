# SPDX-License-Identifier: BSD-3-Clause
"""The adjustment: everything that is unknown, fitted to everything that was observed.

``interval_noise``  noise of means over parts of a record; noise of a record that comes without a model.
``rounding``        errors of a converter's steps that do not average out.
``turning``         the rotation by the gyros, and what it owes to their parameters.
``design``          the unknowns, what they predict, derivatives.
``weights``         the covariance of everything observed.
``solution``        the least squares, and the directions that the positions leave open.
``headings``        positions that no turn links to the others.
``scatter``         residuals beyond the noise; spans that stand out.
``leaving_out``     one position against the others, with the scatter that they show.
``rounds``          all this in turn; biases of gyros that follow gravity; the Earth where it is seen.
"""

from allanite.experiments.calibration.adjustment.interval_noise import Intervals, interval_covariance
from allanite.experiments.calibration.adjustment.leaving_out import left_out
from allanite.experiments.calibration.adjustment.rounds import (
    OPEN,
    RESOLVED,
    Adjustment,
    adjust,
    earth_prior,
    nominal_of,
    plausible_of,
)
from allanite.experiments.calibration.adjustment.solution import CalibrationSolution, Earth

__all__ = [
    "OPEN",
    "RESOLVED",
    "Adjustment",
    "CalibrationSolution",
    "Earth",
    "Intervals",
    "adjust",
    "earth_prior",
    "interval_covariance",
    "left_out",
    "nominal_of",
    "plausible_of",
]
