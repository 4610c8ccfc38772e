# SPDX-License-Identifier: BSD-3-Clause
"""The mean of each record with its uncertainty by the noise model: does the bias come back after the power was off?

The mean over the time T of a record of n samples is the bias at its start plus noise of variance

    N^2/(n dt) + K^2 T/3 + flicker and Gauss-Markov states of correlation time T_c, each                          (1)
    2 sigma^2 a [1 - a (1 - e^(-1/a))],      a = T_c/T;

the walk starts with the record, the states are stationary, and flicker is the sum of states with correlation times
up to 30 records (`NoiseModel.state_space`): what it does more slowly than that is part of the bias. If the means
scatter more, the bias changed from one record to the next.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.quantities.distributions import normal_quantile
from allanite.stability.record_comparison.profiles import Profile, normal_profile
from allanite.stability.record_comparison.series import FittedChannel

__all__ = ["bias_profiles", "mean_sd"]

_RECORDS = 30.0  # longest correlation time of flicker, in records
_STATES = 400


def mean_sd(model: NoiseModel, duration: float, present: int, dt: float) -> float:
    """Standard deviation of the mean of a record about the bias at its start, eq. (1), SI.

    Parameters
    ----------
    model : NoiseModel
    duration : float [s]
    present : int
        Samples that are not missing.
    dt : float [s]
    """
    total = 0.0
    for term in model.terms:
        match term:
            case White():
                total += term.N**2 / (present * dt)
            case RandomWalk():
                total += term.K**2 * duration / 3
            case GaussMarkov():
                total += term.sigma**2 * float(_kept(np.array([term.T / duration]))[0])
            case Flicker():
                log_a = np.linspace(math.log(dt / 30 / duration), math.log(_RECORDS), _STATES)
                total += term.B**2 / math.pi * float(np.trapezoid(_kept(np.exp(log_a)), log_a))
    return math.sqrt(total)


def _kept(a: np.ndarray) -> np.ndarray:
    """What averaging leaves of the variance of a state with correlation time a records."""
    exact = 2 * a * (1 + a * np.expm1(-1 / a))
    return np.asarray(np.where(a > 1e4, 1 - 1 / (3 * a), exact))


def bias_profiles(
    series: Sequence[FittedChannel], models: Sequence[NoiseModel], confidence: float
) -> list[Profile] | None:
    """The bias of each record as a normal estimate; None where a mean is not known."""
    if any(s.mean is None for s in series):
        return None
    critical = normal_quantile((1 + confidence) / 2) ** 2
    return [
        normal_profile(s.mean or 0.0, max(mean_sd(m, s.duration, s.present, s.curve.dt), 1e-300), critical)
        for s, m in zip(series, models, strict=True)
    ]
