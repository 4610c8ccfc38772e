# SPDX-License-Identifier: BSD-3-Clause
"""What else a record may tell of the temperature: the lag of the thermometer, hysteresis, what noise does to it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.quantities.distributions import normal_quantile
from allanite.stability.environment.climate import Climate
from allanite.stability.environment.design import BRANCH, RATE, TEMPERATURE, play
from allanite.stability.environment.noise_left_open import Noise, Weighed
from allanite.stability.environment.results import Coefficient, Hysteresis, Lag
from allanite.stability.environment.verdict import HysteresisStatus, LagStatus

__all__ = ["coefficient_of", "hysteresis_of", "lag_of"]

Array = NDArray[np.float64]

#: Below this probability the branches differ.
HYSTERESIS = 0.01
#: Part of the span of the temperature that both branches have to cover.
COVERED = 0.25


def coefficient_of(fit: Weighed, name: str, confidence: float) -> Coefficient:
    """A coefficient with its interval; not resolved where that holds zero."""
    i = fit.names.index(name)
    low, high = fit.interval(name, confidence)
    resolved = not low <= 0 <= high
    return Coefficient(
        name=name,
        value=float(fit.mean[i]),
        sd=math.sqrt(fit.covariance[i, i]),
        lower=low,
        upper=high,
        p=fit.chance(name),
        status="resolved" if resolved else "not resolved",
        limit=None if resolved else max(abs(low), abs(high)),
    )


def lag_of(fit: Weighed, confidence: float) -> Lag:
    """The ratio of the coefficient of the rate to that of the temperature, its interval by Fieller's theorem [1].

    References
    ----------
    .. [1] E. C. Fieller, "Some problems in interval estimation", J. R. Statist. Soc. B 16 (1954) 175.
    """
    if RATE not in fit.names:
        return Lag(status=LagStatus.COLLINEAR, value=None, lower=None, upper=None)
    i, j = fit.names.index(TEMPERATURE), fit.names.index(RATE)
    c, g = float(fit.mean[i]), float(fit.mean[j])
    z2 = normal_quantile((1 + confidence) / 2) ** 2
    a = c**2 - z2 * fit.covariance[i, i]
    b = c * g - z2 * fit.covariance[i, j]
    d = g**2 - z2 * fit.covariance[j, j]
    root = b**2 - a * d
    if a <= 0 or root < 0:
        return Lag(status=LagStatus.TOO_SMALL, value=None, lower=None, upper=None)
    low, high = float((b - math.sqrt(root)) / a), float((b + math.sqrt(root)) / a)
    status = LagStatus.NO_LAG if low <= 0 <= high else LagStatus.RESOLVED
    return Lag(status=status, value=g / c, lower=low, upper=high)


def hysteresis_of(climate: Climate, noise: Noise, base: Sequence[str], confidence: float) -> Hysteresis:
    """Do warming and cooling differ at one temperature, beyond what a lag does?

    Parameters
    ----------
    base : sequence of str
        Other columns of the regression; the rate is taken among them where it can be told.
    """
    why = _untested(climate)
    others = list(base)
    if RATE not in others and noise.separable(RATE, others):
        others.append(RATE)
    if why is None and not noise.separable(BRANCH, others):
        why = HysteresisStatus.COLLINEAR
    if why is not None:
        return Hysteresis(status=why, gap=None, lower=None, upper=None, p=None)
    fit = noise.fit([*others, BRANCH])
    p = fit.chance(BRANCH)
    low, high = fit.interval(BRANCH, confidence)
    return Hysteresis(
        status=HysteresisStatus.FOUND if p < HYSTERESIS else HysteresisStatus.NOT_FOUND,
        gap=2 * float(fit.mean[fit.names.index(BRANCH)]),
        lower=2 * low,
        upper=2 * high,
        p=p,
    )


def _untested(climate: Climate) -> HysteresisStatus | None:
    """Why the branches cannot be compared, or nothing."""
    branch, warmth = play(climate.warmth), climate.warmth
    up, down = warmth[branch > 0.5], warmth[branch < -0.5]
    span = float(warmth.max() - warmth.min())
    if not (len(up) and len(down)):
        return HysteresisStatus.ONE_WAY
    common = min(up.max(), down.max()) - max(up.min(), down.min())
    return None if common >= COVERED * span else HysteresisStatus.LITTLE_IN_COMMON
