# SPDX-License-Identifier: BSD-3-Clause
"""White noise and flicker from the very record whose rate is wanted, by restricted maximum likelihood.

For a user without a record at rest. The contrasts in which neither rate nor bias appears carry the likelihood
(Harville 1977), so that fitting the rate does not make the noise look smaller. One record of minutes determines the
flicker poorly: the interval of the rate is widened by other means, see `measure_earth_rate`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.experiments.earth_rate.take import Take
from allanite.filtering.regression import regress
from allanite.noise import Flicker, NoiseModel, White

__all__ = ["fit_noise"]

Array = NDArray[np.float64]

#: Most rows of the search: the beginning of the record has to speak for the rest.
MOST_ROWS = 20_000


def fit_noise(take: Take) -> NoiseModel:
    """White noise N and flicker B.

    Raises
    ------
    DataQualityError
        Fewer than ten blocks, or samples that do not vary.
    """
    from scipy.optimize import minimize

    rows, blocks = slice(0, MOST_ROWS), take.blocks
    steps = np.diff(blocks.mean[rows])[(np.diff(blocks.span[rows]) == 0) & (blocks.span[rows][1:] >= 0)]
    spread = float(np.nanmedian(np.abs(steps))) if np.isfinite(steps).sum() >= 10 else 0.0
    if spread == 0:
        raise DataQualityError(
            "the noise cannot be fitted to this record: it is too short, or its samples do not vary; give a noise "
            "model of the sensor at rest (--model)"
        )
    table, names = take.columns()
    known = slice(0 if take.reversals.turns else 1, None)  # without turns, rate and level are one column

    def model(logs: Array) -> NoiseModel:
        return NoiseModel.of(White(N=math.exp(logs[0])), Flicker(B=math.exp(logs[1])))

    def cost(logs: Array) -> float:
        fit = regress(
            blocks.mean[rows],
            table[rows, known],
            model(logs),
            dt=blocks.dt,
            names=names[known],
            counts=blocks.part[rows],
            sampling=take.sampling,
        )
        return math.inf if fit.log_likelihood is None else -fit.log_likelihood

    start = spread / 0.9539 * math.sqrt(blocks.dt)  # the median of |x1 - x2| is 0.9539 standard deviations
    guess = np.log([start, start / math.sqrt(100.0)])
    optimum = minimize(
        cost, guess, method="Nelder-Mead", options={"xatol": 0.01, "fatol": 0.02, "maxfev": 150}
    )
    return model(optimum.x)
