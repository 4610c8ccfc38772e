# SPDX-License-Identifier: BSD-3-Clause
"""Effects of the environment: temperature and warm-up, told from the noise, removed, and said.

``climate``          signal and temperature on blocks
``design``           the columns of the regression
``noise_left_open``  regression in noise that is fitted to the same record
``warming``          a warm-up, found by a test
``questions``        lag of the thermometer, hysteresis
``estimation``       all of it for one channel, or for several
``effect``           what is removed, sample by sample
``correction``       the Allan curve of the residual
"""

from allanite.stability.environment.correction import Correction
from allanite.stability.environment.effect import Effect
from allanite.stability.environment.estimation import (
    free_of_environment,
    regress_environment,
    warm_ups_to_cut,
)
from allanite.stability.environment.results import (
    Coefficient,
    Environment,
    EnvironmentEstimate,
    EnvironmentFacts,
    FreedRecording,
    Hysteresis,
    Lag,
    WarmUp,
)
from allanite.stability.environment.verdict import EnvironmentVerdict

__all__ = [
    "Coefficient",
    "Correction",
    "Effect",
    "Environment",
    "EnvironmentEstimate",
    "EnvironmentFacts",
    "EnvironmentVerdict",
    "FreedRecording",
    "Hysteresis",
    "Lag",
    "WarmUp",
    "free_of_environment",
    "regress_environment",
    "warm_ups_to_cut",
]
