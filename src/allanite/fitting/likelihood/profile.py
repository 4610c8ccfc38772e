# SPDX-License-Identifier: BSD-3-Clause
"""Confidence sets from the profile of a likelihood: every value that the record does not contradict.

A value v of a variance or of a correlation time is contradicted when 2 (ln p_max - ln p_max|v) exceeds a critical
value, all other parameters being free, their variances not negative (`allanite.fitting.inversion`). A set that holds
zero gives an upper limit. Where there may be a ramp the likelihood is averaged over its slope, whose own interval is
that of generalized least squares.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.inversion import (
    CERTAIN,
    cone_point,
    end_of_set,
    end_of_time,
    normals,
    square_cone_point,
)
from allanite.fitting.likelihood.maximum import LikelihoodSearch, Peak
from allanite.fitting.likelihood.objective import RandomTerm

__all__ = [
    "coefficient_set",
    "critical_value",
    "relative_sd",
    "slope_set",
    "time_end",
    "time_set",
]

Array = NDArray[np.float64]

_FEWEST_DRAWS = 100
_LEAST_VARIANCE = 0.1  # of the slope, relative to that at the best values


def relative_sd(peak: Peak) -> dict[int, float]:
    """Standard deviation of ln c and ln T, by position in the gradient, of what has a value."""
    at, covariance = peak.log_covariance()
    return {i: math.sqrt(max(v, 0.0)) for i, v in zip(at, np.diag(covariance), strict=True)}


# -- critical values --------------------------------------------------------------------------------------


def critical_value(peak: Peak, tested: int, free: frozenset[int], confidence: float) -> float:
    """The distance that the true value of parameter `tested` exceeds with probability 1 - confidence.

    Parameters
    ----------
    tested : int
        Position in the gradient.
    free : frozenset of int
        Parameters far from their border. The others are taken to sit at zero, where they may only grow: the least
        favourable case.
    """
    H = peak.value.information
    n = len(peak.at.c)
    informed = [i for i in range(len(H)) if H[i, i] > 0 and (i < n or i in peak.moving())]
    if tested not in informed:
        return cone_point((), (), confidence)
    order = [tested, *(i for i in informed if i != tested)]
    scale = np.sqrt(np.diag(H)[order])
    scaled = H[np.ix_(order, order)] / np.outer(scale, scale)
    root = np.linalg.cholesky(scaled + 1e-9 * np.eye(len(order))).T
    sided = [k for k, i in enumerate(order) if k > 0 and i < n and i not in free]
    return square_cone_point(root, sided, confidence)


# -- the slope of a ramp ----------------------------------------------------------------------------------


def slope_set(search: LikelihoodSearch, best: Peak, confidence: float) -> tuple[float, float]:
    """Ends of the interval of the slope of a ramp, with its sign.

    The noise at the lowest frequencies, which the slope is judged by, is itself known from few degrees of freedom, so
    that slope/error follows Student's law. With V the variance of the slope, drawn from all coefficients that the
    record allows (none of them negative), they are 2 E(V)^2/var(V) (Satterthwaite), and E(V) is the error squared,
    unless V at the best values is larger.
    """
    from scipy.special import stdtrit

    here = 1 / best.value.slope_information
    places, change = _slope_variance_gradient(search, best)
    drawn = here + _allowed(best, places) @ change
    drawn = np.maximum(drawn, _LEAST_VARIANCE * here)
    mean = max(float(drawn.mean()), here)
    dof = max(2 / max(float((drawn / mean).var()), 1e-9), 1.0)
    reach = float(stdtrit(dof, (1 + confidence) / 2)) * math.sqrt(mean)
    return best.value.slope - reach, best.value.slope + reach


def _slope_variance_gradient(search: LikelihoodSearch, best: Peak) -> tuple[list[int], Array]:
    """Parameters that the record knows something of, and what each changes the variance of the slope by."""
    at, H = best.at, best.value.information
    n, moving = len(at.c), best.moving()
    timed = [i for i, k in enumerate(at.components) if k.T is not None]
    places = [i for i in range(len(H)) if H[i, i] > 0 and (i < n or i in moving)]

    def variance(i: int, step: float) -> float:
        c, components = at.c.copy(), list(at.components)
        if i < n:
            c[i] += step
        else:
            k = components[timed[i - n]]
            components[timed[i - n]] = RandomTerm(k.symbol, (k.T or 1.0) * math.exp(step))
        return 1 / search.evaluate(replace(at, c=c, components=tuple(components))).slope_information

    change = []
    for i in places:
        step = 1e-2 / math.sqrt(H[i, i])
        below = step if i >= n or at.c[i] > step else 0.0
        change.append((variance(i, step) - variance(i, -below)) / (step + below))
    return places, np.array(change)


def _allowed(best: Peak, places: list[int]) -> Array:
    """Draws of the parameters less their best values, shape (n_draws, n): normal, no coefficient negative."""
    n = len(best.at.c)
    H = best.value.information[np.ix_(places, places)]
    unit = np.sqrt(np.diag(H))
    scaled = H / np.outer(unit, unit) + 1e-9 * np.eye(len(places))
    middle = np.linalg.solve(scaled, best.value.gradient[places] / unit)
    root = np.linalg.inv(np.linalg.cholesky(scaled))  # draws of N(middle, scaled^-1)
    drawn = (middle + normals(len(places)) @ root) / unit
    floor = np.array([-best.at.c[i] if i < n else -math.inf for i in places])
    kept = drawn[(drawn >= floor).all(axis=1)]
    return kept if len(kept) >= _FEWEST_DRAWS else np.maximum(drawn, floor)


# -- sets -------------------------------------------------------------------------------------------------


def coefficient_set(
    search: LikelihoodSearch, best: Peak, i: int, critical: float, scanned: Callable[[], Peak]
) -> tuple[float, float]:
    """Ends of the set of variance coefficient i.

    Parameters
    ----------
    best : Peak
        Nothing held.
    critical : float
        From `critical_value`.
    scanned : callable
        The best fit without the term, all correlation times tried.
    """
    near = best

    def loss(value: float) -> float:
        nonlocal near
        start = replace(near.at, c=np.where(np.arange(len(near.at.c)) == i, value, near.at.c))
        near = search.climb(start, held=frozenset({i}))
        return _distance(best, near)

    estimate = float(best.at.c[i])
    sd = relative_sd(best).get(i, 1.0)
    lower = 0.0
    if estimate > 0 and (sd < CERTAIN or _distance(best, scanned()) > critical):
        lower = end_of_set(loss, critical, estimate, -1, sd)
        near = best
    unseen = 0.1 / math.sqrt(best.value.information[i, i])  # far too little to be contradicted
    return lower, end_of_set(loss, critical, max(estimate, unseen), +1, sd if estimate > unseen else 1.0)


def time_set(search: LikelihoodSearch, best: Peak, j: int, critical: float) -> tuple[float, float]:
    """Ends of the set of the correlation time of component j [samples]; those of `search.times` where it has none."""
    lower, upper = (time_end(search, best, j, critical, limit) for limit in search.times)
    return lower, upper


def time_end(search: LikelihoodSearch, best: Peak, j: int, critical: float, limit: float) -> float:
    """The end of that set toward `limit`; `limit` where it has none."""
    place = len(best.at.c) + [i for i, k in enumerate(best.at.components) if k.T is not None].index(j)
    near = best

    def loss(T: float) -> float:
        nonlocal near
        components = tuple(RandomTerm(k.symbol, T) if i == j else k for i, k in enumerate(near.at.components))
        near = search.climb(replace(near.at, components=components), held=frozenset({place}))
        return _distance(best, near)

    sd = min(max(relative_sd(best).get(place, 0.3), 1e-3), 1.0)
    return end_of_time(loss, critical, best.at.components[j].T or 1.0, sd, limit)


def _distance(best: Peak, null: Peak) -> float:
    return 2 * (best.log_likelihood - null.log_likelihood)
