# SPDX-License-Identifier: BSD-3-Clause
"""Octave bands of the inside of the blocks: where a fit starts, and whether it explains the record.

In a block of n rows the cosines cos(pi j (i + 1/2)/n), j = 1 ... n - 1, are orthonormal contrasts that are nearly
uncorrelated whatever the noise; the mean power of those with 2^b <= j < 2^(b+1) is the power of one octave.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.likelihood.objective import Objective, Point, RandomTerm, inner_of
from allanite.fitting.likelihood.pool import Pool, contrasts
from allanite.fitting.nonnegative import nonnegative
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_tail

__all__ = ["Band", "ModeBand", "bands", "explained", "first_guess"]

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

    def expected(self, objective: Objective, component: RandomTerm) -> float:
        """Power of a unit process."""
        n = len(self.weights)
        return float(np.vdot(self.weights, objective.matrices(component)[self.pool][0, :n, :n]))

    def seen(self, objective: Objective, at: Point, slope: float) -> tuple[float, float]:
        """Power without a ramp over that of a model, and its degrees of freedom."""
        pool, n = objective.pyramid.pools[self.pool], len(self.weights)
        matrices = [objective.matrices(k)[self.pool][0, :n, :n] for k in at.components]
        V = np.tensordot(at.c, np.array(matrices), axes=1)
        S = pool.second[:n, :n] / objective.scale**2
        m, r = pool.mean[:n] / objective.scale, pool.tilt[:n]
        S = S - slope * (np.outer(m, r) + np.outer(r, m)) + slope**2 * np.outer(r, r)
        mean, product = float(np.vdot(self.weights, V)), self.weights @ V
        return float(np.vdot(self.weights, S)) / mean, pool.count * mean**2 / float(
            np.vdot(product, product.T)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeBand:
    """Mean power of an octave of the modes.

    Attributes
    ----------
    places : slice
        Of the modes.
    power, dof, period
        As of a `Band`.
    """

    places: slice
    power: float
    dof: float
    period: tuple[float, float]

    def expected(self, objective: Objective, component: RandomTerm) -> float:
        """Power of a unit process."""
        return float(objective.variances(component)[0, self.places].mean())

    def seen(self, objective: Objective, at: Point, slope: float) -> tuple[float, float]:
        """Power without a ramp over that of a model, and its degrees of freedom."""
        modes = objective.pyramid.modes
        if modes is None:
            return 1.0, 1.0
        v = at.c @ np.array([objective.variances(k)[0, self.places] for k in at.components])
        x = modes.value[self.places] / objective.scale - slope * modes.tilt[self.places]
        return float(np.mean(x**2) / v.mean()), float(v.sum() ** 2 / (v**2).sum())


def bands(objective: Objective) -> list[Band | ModeBand]:
    """All bands of a record, the quick ones first."""
    every: list[Band | ModeBand] = []
    for i, pool in enumerate(objective.pyramid.pools):
        if pool.count >= _LEAST_VECTORS:
            every += _of_pool(i, pool, objective.scale)
    return every + _of_modes(objective)


def _of_pool(index: int, pool: Pool, scale: float) -> list[Band]:
    inner = inner_of(pool)
    n = inner + 1
    j = np.arange(1, n)
    wave = np.sqrt(2 / n) * np.cos(np.pi * np.outer(j, np.arange(n) + 0.5) / n)
    wave = wave @ contrasts(n).T
    of_pool = []
    for places in _octaves(inner):
        inside = wave[places]
        weights = inside.T @ inside / len(inside)
        power = float(np.vdot(weights, pool.second[:inner, :inner])) / scale**2
        dof = float(pool.count * len(inside))
        period = _period(n, pool.block, places)
        of_pool.append(Band(pool=index, power=power, weights=weights, dof=dof, period=period))
    return of_pool


def _of_modes(objective: Objective) -> list[ModeBand]:
    modes = objective.pyramid.modes
    if modes is None:
        return []
    x = (modes.value / objective.scale) ** 2
    return [
        ModeBand(
            places=places,
            power=float(x[places].mean()),
            dof=float(len(x[places])),
            period=_period(len(x) + 1, modes.block, places),
        )
        for places in _octaves(len(x))
    ]


def _octaves(n: int) -> list[slice]:
    """Octaves of the cosines 1, 2, ... n."""
    return [slice(2**b - 1, min(2 ** (b + 1) - 1, n)) for b in range(n.bit_length())]


def _period(n: int, block: int, places: slice) -> tuple[float, float]:
    """Shortest and longest of n rows [samples]."""
    longest = 2.0 * n * block / (places.start + 1)
    return max(longest / 2, 2.0 * block), longest


def first_guess(
    objective: Objective, components: tuple[RandomTerm, ...], of_record: Sequence[Band | ModeBand]
) -> Array:
    """Relative non-negative least squares on the bands: a safe start."""
    power = np.array([b.power for b in of_record])
    expected = np.array([[b.expected(objective, k) for k in components] for b in of_record])
    used = power > 0
    weight = np.sqrt(np.minimum(np.array([b.dof for b in of_record]), 50.0))[used] / power[used]
    columns = expected[used] * weight[:, None]
    norm = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    c = nonnegative(columns / norm, power[used] * weight) / norm
    # a term that starts at zero would have to be found by the gradient alone; a start somewhat above costs nothing
    share = expected[used] / power[used][:, None]
    return np.asarray(np.maximum(c, 1e-3 / np.maximum(share.max(axis=0), 1e-300)))


def explained(
    objective: Objective, at: Point, slope: float, of_record: Sequence[Band | ModeBand], parameters: int
) -> tuple[float, int, float]:
    """Chi-square of the powers of all bands against the model, degrees of freedom, probability.

    A power of e degrees of freedom is compared by its cube root, which is nearly normal (Wilson and Hilferty 1931).
    """
    chi2 = 0.0
    for b in of_record:
        ratio, edf = b.seen(objective, at, slope / objective.scale)
        spread = 2 / (9 * edf)
        chi2 += (math.cbrt(ratio) - (1 - spread)) ** 2 / spread
    dof = max(len(of_record) - parameters, 1)
    return chi2, dof, chi_square_tail(chi2, dof)
