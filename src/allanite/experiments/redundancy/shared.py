# SPDX-License-Identifier: BSD-3-Clause
"""Noise that sensors share: temperature, a supply, a clock. Measured on a record at rest, pair by pair.

At rest the sensors see a constant, which the second difference of the Allan variance does not feel. So the Allan
covariance of two sensors,

    C_ij(tau) = <D_i D_j> / 2,     D = difference of adjacent means over tau,

is that of their noise alone. Its correlation coefficient has the interval of Fisher's z [1] with the degrees of
freedom of the Allan variance at that tau; estimates of both come from the same windows.

References
----------
.. [1] R. A. Fisher, "On the probable error of a coefficient of correlation deduced from a small sample", Metron 1
   (1921) 3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.redundancy.results import SharedNoise
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.allan.covariance import edf
from allanite.noise.allan.lags import octave_lags
from allanite.noise.allan.matrix import allan_products
from allanite.quantities.distributions import normal_quantile
from allanite.quantities.quantity import Quantity

__all__ = ["AllanCovariance", "allan_covariance", "correlation_kept", "pairs_of"]

Array = NDArray[np.float64]

#: Probability that any pair of independent sensors is called correlated.
FALSE_PAIR = 0.01
#: Smallest eigenvalue left to a matrix of correlations.
LEAST = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class AllanCovariance:
    """Allan covariance of n sensors over tau.

    Attributes
    ----------
    tau : ndarray, shape (k,) [s]
    matrix : ndarray, shape (k, n, n) [SI^2]
    edf : ndarray, shape (k,)
    """

    tau: Array
    matrix: Array
    edf: Array

    def shortened(self, count: int) -> AllanCovariance:
        """The first so many averaging times."""
        return AllanCovariance(tau=self.tau[:count], matrix=self.matrix[:count], edf=self.edf[:count])


def allan_covariance(means: Array, dt: float, model: NoiseModel) -> AllanCovariance:
    """Overlapping Allan covariance at octaves of dt, from means of shape (windows, n); NaN: missing.

    `model` says which noise the degrees of freedom belong to.
    """
    rows = len(means)
    bad = np.isnan(means).any(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], bad, [False])).astype(np.int8)))
    levels = np.nan_to_num(means - np.nanmean(means, axis=0)).T
    phases = np.concatenate([np.zeros((len(levels), 1)), np.cumsum(levels, axis=1)], axis=1)
    lags = octave_lags(rows, window=4)
    covariance, counts = allan_products(phases, edges.astype(np.int64).reshape(-1, 2), lags)
    enough = np.logical_and.accumulate(counts >= 2 * lags)
    # gaps leave fewer windows: those of a shorter record
    free = [
        float(edf(model, [m], count + 2 * m - 1, dt, "mean")[0])
        for m, count in zip(lags[enough].tolist(), counts[enough].tolist(), strict=True)
    ]
    return AllanCovariance(
        tau=lags[enough].astype(np.float64) * dt, matrix=covariance[enough], edf=np.array(free)
    )


def pairs_of(
    allan: AllanCovariance, tau: float, names: Sequence[str], confidence: float
) -> tuple[SharedNoise, ...]:
    """Correlation of every pair at the tau nearest to the wanted one, with its interval."""
    at = int(np.argmin(np.abs(np.log(allan.tau / tau))))
    c, spread = allan.matrix[at], math.sqrt(max(float(allan.edf[at]) - 2, 1.0))
    count = len(names) * (len(names) - 1) // 2
    wide = normal_quantile(0.5 + confidence / 2) / spread
    strict = normal_quantile(1 - FALSE_PAIR / (2 * count)) / spread
    pairs = []
    for i in range(len(names)):
        for j in range(i):
            scale = math.sqrt(c[i, i] * c[j, j])
            r = float(np.clip(c[i, j] / scale, -1 + 1e-12, 1 - 1e-12)) if scale > 0 else 0.0
            z = math.atanh(r)
            pairs.append(
                SharedNoise(
                    first=names[j],
                    second=names[i],
                    tau=float(allan.tau[at]),
                    correlation=Quantity.of(r, (math.tanh(z - wide), math.tanh(z + wide)), "1"),
                    seen=abs(z) > strict,
                )
            )
    return tuple(pairs)


def correlation_kept(pairs: Sequence[SharedNoise], names: Sequence[str]) -> Array:
    """Correlations that are seen, zero elsewhere, as a matrix that is one of correlations, shape (n, n)."""
    r = np.eye(len(names))
    for pair in pairs:
        if pair.seen:
            i, j = names.index(pair.first), names.index(pair.second)
            r[i, j] = r[j, i] = pair.correlation.value
    values, vectors = np.linalg.eigh(r)
    if values[0] < LEAST:
        r = (vectors * np.maximum(values, LEAST)) @ vectors.T
        size = np.sqrt(np.diag(r))
        r = r / np.outer(size, size)
    return np.asarray(r)
