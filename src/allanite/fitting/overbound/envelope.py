# SPDX-License-Identifier: BSD-3-Clause
"""The least sum of noise terms above many curves at once.

Three steps. A band that the wanted share of the curves stays below everywhere at once: at each averaging time the
quantile of one common level [1]. The sum of terms above the band with the smallest mean ratio to it: some linear
programmes, because variances add. The way from the fitted model to that sum is then gone only as far as the wanted
share of the curves needs.

References
----------
.. [1] J. Besag, P. Green, D. Higdon, K. Mengersen, "Bayesian computation and stochastic systems", Statist. Sci. 10
   (1995) 3, section 6.3: simultaneous credible regions from order statistics.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FitError

__all__ = ["band_above", "least_above", "reach"]

Array = NDArray[np.float64]

#: Slopes, over the logarithm of time, of the logarithm of the weights to begin with.
_TILTS = (-3.0, -1.5, 0.0, 1.5, 3.0)
_ROUNDS = 12


def band_above(curves: Array, probability: float) -> Array:
    """Upper band that about this share of the curves stays below at every place at once.

    Parameters
    ----------
    curves : ndarray, shape (n_curves, n_places)
    probability : float

    Returns
    -------
    ndarray, shape (n_places,)
    """
    n = len(curves)
    ranks = np.argsort(np.argsort(curves, axis=0), axis=0)  # 0 is the lowest
    highest = np.sort(ranks.max(axis=1))
    level = int(highest[min(int(np.ceil(probability * n)), n - 1)])
    return np.asarray(np.sort(curves, axis=0)[level])


def least_above(columns: Array, fitted: Array, floor: Array) -> Array:
    """Coefficients of the sum of terms above a floor whose geometric mean ratio to it is least.

    The logarithm of a sum is concave in its coefficients, so the best of them stand at corners: each is found by linear
    programmes, each with the slopes of the logarithm at the solution of the one before. They begin from weights that
    favour short and long times in turn, and the best end is taken.

    Parameters
    ----------
    columns : ndarray, shape (n_places, n_terms)
        Of unit terms.
    fitted : ndarray, shape (n_terms,)
        None of the coefficients becomes smaller than this.
    floor : ndarray, shape (n_places,)

    Returns
    -------
    ndarray, shape (n_terms,)

    Raises
    ------
    FitError
        No sum of these terms lies above.
    """
    relative = columns / floor[:, None]
    size = relative.max(axis=0)  # each unit then reaches the floor somewhere
    relative = relative / size
    slope = np.linspace(-1.0, 1.0, len(floor))
    ends = [_settled(relative, fitted * size, np.exp(tilt * slope)) for tilt in _TILTS]
    best = min(ends, key=lambda c: float(np.log(relative @ c).mean()))
    return np.asarray(best / size)


def _settled(relative: Array, least: Array, weights: Array) -> Array:
    """Linear programmes until their solution stays; the weights are of the places."""
    from scipy.optimize import linprog

    before = np.inf
    for _ in range(_ROUNDS):
        programme = linprog(
            weights @ relative,
            A_ub=-relative,
            b_ub=-np.ones(len(relative)),
            bounds=[(low, None) for low in least],
        )
        if programme.x is None:
            raise FitError(f"no sum of these terms lies above the curve: {programme.message}")
        c = np.maximum(programme.x, least)
        value = float(np.log(relative @ c).mean())
        if value > before - 1e-6:
            break
        before, weights = value, 1 / (relative @ c)
    return np.asarray(c)


def reach(curves: Array, start: Array, end: Array) -> Array:
    """How far from `start` towards `end` a curve has to go to lie above each of the curves everywhere.

    Parameters
    ----------
    curves : ndarray, shape (n_curves, n_places)
    start, end : ndarray, shape (n_places,)
        `end` is above `start`.

    Returns
    -------
    ndarray, shape (n_curves,)
        0: `start` lies above the curve; 1: `end` is needed.
    """
    gap = end - start
    over = curves - start
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(over > 0, over / gap, 0.0)
    return np.asarray(np.maximum(share.max(axis=1), 0.0))
