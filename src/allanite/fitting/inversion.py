# SPDX-License-Identifier: BSD-3-Clause
"""Confidence sets by test inversion: where a set ends, and the critical value that decides it.

The set of a parameter holds every value whose loss, with all other parameters free, stays below a critical value. The
root of the loss is nearly linear in the logarithm of a coefficient; the search for an end relies on that.

Coefficients live on a cone (none is negative), so the distance of two fits is not exactly chi-square: with several
terms near zero its 95 % point lies between 3.84 and about 5.5. The point is computed by drawing from the linearized
problem itself [1].

References
----------
.. [1] S. Self, K.-Y. Liang, "Asymptotic properties of maximum likelihood estimators and likelihood ratio tests under
   nonstandard conditions", JASA 82 (1987) 605.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite.quantities.distributions import chi_square_quantile

__all__ = ["CERTAIN", "cone_point", "crossing", "end_of_set", "end_of_time", "normals", "square_cone_point"]

Array = NDArray[np.float64]
#: What a value of the tested parameter costs, all others free: twice the drop of the log-likelihood, or its like.
Loss = Callable[[float], float]

#: Relative standard deviation of a coefficient below which its set cannot reach zero (thirty sigma).
CERTAIN = 0.03
_DRAWS = 8000
_TOLERANCE = 2e-3  # of the root of the loss; the rest is interpolated
_WIDEST = 50.0  # in the logarithm of a parameter
_FIRST_STEP = 1.5  # largest, in the logarithm
_ROUNDS = 40


# -- ends of sets -----------------------------------------------------------------------------------------


def crossing(loss: Loss, critical: float, first: float, reach: float = math.inf) -> float:
    """Where a loss that rises from 0 at x = 0 becomes critical; infinite where it does not before `reach`.

    Parameters
    ----------
    loss : callable
        Of x > 0.
    critical : float
    first : float
        First step: about the expected distance.
    """

    def excess(x: float) -> float:
        return math.sqrt(max(loss(x), 0.0)) - math.sqrt(critical)

    inner = (0.0, -math.sqrt(critical))
    x = min(first, reach)
    while (value := excess(x)) < 0:
        if x >= reach:
            return math.inf
        rise = max((value - inner[1]) / (x - inner[0]), 1e-300)
        inner = (x, value)
        x = min(x + min(max(-1.1 * value / rise, 0.1 * x), 2.0 * x), reach)
    return _between(excess, inner, (x, value))


def _between(excess: Loss, inner: tuple[float, float], outer: tuple[float, float]) -> float:
    """Where the excess crosses zero between two points (x, excess) on either side of it."""
    for _ in range(_ROUNDS):
        width = outer[0] - inner[0]
        share = -inner[1] / (outer[1] - inner[1]) if math.isfinite(outer[1]) else 0.5
        if min(-inner[1], outer[1]) < _TOLERANCE or width < 1e-9 * outer[0]:
            return inner[0] + share * width
        x = inner[0] + width * min(max(share, 0.1), 0.9)
        here = (x, excess(x))
        inner, outer = (here, outer) if here[1] < 0 else (inner, here)
    return outer[0]


def end_of_set(
    loss: Loss, critical: float, at: float, direction: int, sd: float, reach: float = _WIDEST
) -> float:
    """The end of a set of positive values on one side of `at`; 0 or infinite where the set has none within `reach`.

    Parameters
    ----------
    loss : callable
        Of the value.
    critical : float
    at : float
        A value within the set.
    direction : {-1, 1}
    sd : float
        Approximate standard deviation of the logarithm of the value.
    reach : float
        Of the search, in the logarithm.
    """
    first = min(max(2.0 * sd, 1e-6), _FIRST_STEP)
    x = crossing(lambda x: loss(at * math.exp(direction * x)), critical, first, reach)
    return at * math.exp(direction * x)


def end_of_time(loss: Loss, critical: float, at: float, sd: float, limit: float) -> float:
    """The end toward `limit` of the set of a correlation time; `limit` where the record sets none."""
    reach = abs(math.log(limit / at))
    if reach == 0:
        return limit
    end = end_of_set(loss, critical, at, 1 if limit > at else -1, sd, reach)
    return end if 0 < end < math.inf else limit


# -- critical values --------------------------------------------------------------------------------------


@lru_cache(maxsize=8)
def normals(k: int) -> Array:
    """Standard normal draws, the same each time, shape (8000, k)."""
    draws = np.random.default_rng(952).standard_normal((_DRAWS, k))
    draws.flags.writeable = False
    return draws


def cone_point(columns: Sequence[Array], kinds: tuple[str, ...], confidence: float) -> float:
    """The distance that a true value exceeds with probability 1 - confidence, given the whitened problem.

    Parameters
    ----------
    columns : sequence of ndarray, shape (n,)
        Directions of unit length of the tested parameter (first) and of the others; none: the chi-square point.
    kinds : tuple of "free" or "one-sided"
        One for each column: a one-sided parameter sits at zero and may only grow.
    confidence : float
    """
    if not columns or not np.all(np.isfinite(np.stack(columns))):
        return chi_square_quantile(confidence, 1)
    U = np.asarray(np.linalg.qr(np.stack(columns, axis=1), mode="r"), dtype=np.float64)
    return square_cone_point(U, [i for i, k in enumerate(kinds) if k == "one-sided"], confidence)


def square_cone_point(U: Array, sided: Sequence[int], confidence: float) -> float:
    """The same for directions that are the columns of a square root of the information, the tested one first."""
    y = np.ascontiguousarray(normals(len(U)).T)
    loose = [i for i in range(U.shape[1]) if i not in sided]
    gain = _explained(U, y, loose, sided) - _explained(U, y, [i for i in loose if i], sided)
    return max(chi_square_quantile(confidence, 1), float(np.quantile(gain, confidence)))


def _explained(U: Array, y: Array, loose: Sequence[int], sided: Sequence[int]) -> Array:
    """Squared length of the projection of draws on the cone of the columns of U, shape (n_draws,).

    Parameters
    ----------
    y : ndarray, shape (n, n_draws)
    loose, sided : sequence of int
        Columns with any weight, and with weights that are not negative.
    """
    best = np.zeros(y.shape[1])
    for size in range(len(sided) + 1):
        for chosen in itertools.combinations(sided, size):
            index = [*loose, *chosen]
            if not index:
                continue
            Q, R = np.linalg.qr(U[:, index])
            part = Q.T @ y
            length = np.einsum("in,in->n", part, part)
            if chosen:
                weights = np.linalg.pinv(R, rcond=1e-10)[len(loose) :] @ part
                length = np.where(weights.min(axis=0) >= 0, length, 0.0)
            best = np.maximum(best, length)
    return best
