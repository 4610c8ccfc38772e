# SPDX-License-Identifier: BSD-3-Clause
"""Octave bands of the inside of the blocks: where a fit starts, and whether it explains the record.

In a block of n rows the cosines cos(pi j (i + 1/2)/n), j = 1 ... n - 1, are orthonormal contrasts that are nearly
uncorrelated whatever the noise; the mean power of those with 2^b <= j < 2^(b+1) is the power of one octave.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.likelihood.objective import Component, Objective, Point, inner_of
from allanite.fitting.likelihood.pool import Pool, contrasts

__all__ = ["Band", "bands", "explained", "first_guess"]

Array = NDArray[np.float64]

_LEAST_VECTORS = 4  # pools of fewer small vectors say nothing


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """Mean power of an octave of the vectors of one pool.

    Attributes
    ----------
    pool : int
    power : float
        In squares of the scale.
    weights : ndarray, shape (d, d)
        power = tr(weights S).
    dof : float
    period : (float, float)
        Shortest and longest [samples].
    """

    pool: int
    power: float
    weights: Array
    dof: float
    period: tuple[float, float]

    def expected(self, matrix: Array) -> float:
        """Power of vectors with this covariance."""
        n = len(self.weights)
        return float(np.vdot(self.weights, matrix[:n, :n]))


def bands(objective: Objective) -> list[Band]:
    """All bands of a record, the quick ones first."""
    found = []
    for i, pool in enumerate(objective.pyramid.pools):
        if pool.count >= _LEAST_VECTORS or i == len(objective.pyramid.pools) - 1:
            found += _of_pool(i, pool, objective.scale)
    return found


def _of_pool(index: int, pool: Pool, scale: float) -> list[Band]:
    inner = inner_of(pool)
    n = inner + 1
    j = np.arange(1, n)
    wave = np.sqrt(2 / n) * np.cos(np.pi * np.outer(j, np.arange(n) + 0.5) / n)
    wave = wave @ contrasts(n).T
    found = []
    for octave in range(int(math.log2(n - 1)) + 1 if n > 1 else 0):
        inside = wave[2**octave - 1 : 2 ** (octave + 1) - 1]
        weights = inside.T @ inside / len(inside)
        power = float(np.vdot(weights, pool.second[:inner, :inner])) / scale**2
        longest = 2.0 * n * pool.block / 2**octave
        period = (max(longest / 2, 2.0 * pool.block), longest)
        dof = float(pool.count * len(inside))
        found.append(Band(pool=index, power=power, weights=weights, dof=dof, period=period))
    return found


def first_guess(objective: Objective, components: tuple[Component, ...], found: list[Band]) -> Array:
    """Relative non-negative least squares on the bands: a safe start."""
    from scipy.optimize import nnls

    power = np.array([b.power for b in found])
    expected = np.array([[b.expected(objective.matrices(k)[b.pool][0]) for k in components] for b in found])
    used = power > 0
    weight = np.sqrt(np.minimum(np.array([b.dof for b in found]), 50.0))[used] / power[used]
    columns = expected[used] * weight[:, None]
    norm = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    c = nnls(columns / norm, power[used] * weight, maxiter=50 * len(norm))[0] / norm
    # a term that starts at zero would have to be found by the gradient alone; a start somewhat above costs nothing
    share = expected[used] / power[used][:, None]
    return np.asarray(np.maximum(c, 1e-3 / np.maximum(share.max(axis=0), 1e-300)))


def explained(
    objective: Objective, at: Point, slope: float, found: list[Band], parameters: int
) -> tuple[float, int, float]:
    """Chi-square of the powers of all bands against the model, degrees of freedom, probability.

    A power of e degrees of freedom is compared by its cube root, which is nearly normal (Wilson and Hilferty 1931).
    """
    from scipy.special import chdtrc

    chi2, used = 0.0, 0
    b_slope = slope / objective.scale
    for b in found:
        V = sum(c * objective.matrices(k)[b.pool][0] for c, k in zip(at.c, at.components, strict=True))
        pool = objective.pyramid.pools[b.pool]
        inner = len(b.weights)
        V = np.asarray(V)[:inner, :inner]
        S = pool.second[:inner, :inner] / objective.scale**2
        m, r = pool.mean[:inner] / objective.scale, pool.tilt[:inner]
        S = S - b_slope * (np.outer(m, r) + np.outer(r, m)) + b_slope**2 * np.outer(r, r)
        mean = float(np.vdot(b.weights, V))
        inner_product = b.weights @ V
        spread = 2 * float(np.vdot(inner_product, inner_product.T)) / pool.count
        edf = 2 * mean**2 / spread
        z = (math.cbrt(float(np.vdot(b.weights, S)) / mean) - (1 - 2 / (9 * edf))) / math.sqrt(2 / (9 * edf))
        chi2, used = chi2 + z * z, used + 1
    dof = max(used - parameters, 1)
    return chi2, dof, float(chdtrc(dof, chi2))
