# SPDX-License-Identifier: BSD-3-Clause
"""The Earth's rotation from one axis that was turned between north and south, or between up and down.

    y(t) = Omega cos(latitude) s(t) + bias + noise,    s = +1 to the north, -1 to the south;
    y(t) = Omega sin(latitude) s(t) + bias + noise,    s = +1 up, -1 down.

The estimate is the generalised least-squares fit of Omega and the bias in the noise of the model
(`allanite.filtering.regression`), on means over blocks short against the dwells. The seed paper's estimator, the mean
of (omega_N - omega_S)/(2 cos(latitude)) over pairs of dwells, is computed beside it, and one that cancels drift.

What the noise model does not know about is looked for in the residuals: more scatter from turn to turn than the model
says, a residual rotation after each turn, a warm-up, a turn that was missed. Scatter widens the interval; the rest
takes away the verdict "resolved". A bias that follows the turns exactly cannot be told from the Earth by any
estimator: only a result that contradicts the known rate, or a null test between east and west, shows it. Turning an
axis over reverses gravity along it, so that its g-sensitivity is such a bias: unless it is stated, the result is a
bound on the sum.
"""

from allanite.experiments.earth_rate.estimation import measure_earth_rate
from allanite.experiments.earth_rate.results import DwellMean, EarthRateEstimate, RateReading, RunningEstimate
from allanite.experiments.reversals.turns import DEAD_TIME
from allanite.quantities.residual_tests import ResidualTest
from allanite.quantities.setup_uncertainty import SetupUncertainty

__all__ = [
    "DEAD_TIME",
    "DwellMean",
    "EarthRateEstimate",
    "RateReading",
    "ResidualTest",
    "RunningEstimate",
    "SetupUncertainty",
    "measure_earth_rate",
]
