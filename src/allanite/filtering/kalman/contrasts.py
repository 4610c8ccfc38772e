# SPDX-License-Identifier: BSD-3-Clause
"""The density of a record less its level: exact, by one covariance recursion for samples, ones and ramp.

With V the covariance of the samples y, 1 the constant and t the ramp, the density of n - 1 orthonormal contrasts is

    -2 ln p = (n - 1) ln 2 pi + ln det V + ln(1' V^-1 1) - ln n + (y - b t)' P (y - b t),
    P = V^-1 - V^-1 1 1' V^-1 / (1' V^-1 1),

and every product with V^-1 is one of whitened series.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.noise import StateSpace

__all__ = ["contrast_likelihood"]

Array = NDArray[np.float64]

_ROWS = 1 << 16


def contrast_likelihood(
    space: StateSpace, samples: Array, *, slope: float | None = 0.0, averaged: bool = False
) -> float:
    """Logarithm of the density of the contrasts of samples.

    Parameters
    ----------
    space : StateSpace
        The noise, without a level.
    samples : ndarray, shape (n,)
        NaN where missing.
    slope : float or None
        Of a ramp, per sample; None: that which fits best.
    averaged : bool
        Without a slope: the mean density over all slopes instead.
    """
    n = len(samples)
    covariance, state = space.initial.copy(), np.zeros((space.size, 3))
    total, products, count = 0.0, np.zeros((3, 3)), 0
    for start in range(0, n, _ROWS):
        y = samples[start : start + _ROWS]
        columns = np.stack([y, np.ones(len(y)), (np.arange(start, start + len(y)) - n / 2) / n], axis=1)
        white = np.empty_like(columns)
        noise = np.where(np.isfinite(y), space.noise, np.nan)
        total += _kernels.whiten(
            space.transition, space.process, space.output, noise, covariance, state, columns, white
        )
        white = white[np.isfinite(y)]
        products += white.T @ white
        count += len(white)
    ones = products[1, 1]
    rest = products[np.ix_([0, 2], [0, 2])] - np.outer(products[1, [0, 2]], products[1, [0, 2]]) / ones
    b = rest[0, 1] / rest[1, 1] if slope is None else slope * n
    squares = rest[0, 0] - 2 * b * rest[0, 1] + b**2 * rest[1, 1]
    level = total + math.log(ones / count)
    if averaged and slope is None:
        count, level = count - 1, level + math.log(rest[1, 1] / n**2)
    return float(-((count - 1) * math.log(2 * math.pi) + level + squares) / 2)
