# SPDX-License-Identifier: BSD-3-Clause
"""Vectors of one shape, cut out of a record again and again: their number, mean and second moments.

For a Gaussian likelihood of independent vectors these are all that the data have to say, however many there are.
The model side is linear in its variance coefficients: the covariance of the vectors is sum_t c_t E_t, and E_t follows
from the autocovariance of the unit process of term t, which may be known up to a constant only (a random walk, flicker)
because every vector is made of contrasts.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import TermType

__all__ = ["EXTRA", "KINDS", "LEVELS", "Pool", "Series", "autocovariance", "contrasts"]

Array = NDArray[np.float64]

#: Levels of blocks at most: of 1e10 samples.
LEVELS = 5
#: Kinds of noise whose share in the mean of an incomplete block is kept, in this order: white, quantisation, and slow
#: noise by the level on which samples are missing.
KINDS = 2 + LEVELS
#: What is kept of a row: its extra noise of these kinds, and how much later its centre lies than that of a whole one.
EXTRA = KINDS + 1


def contrasts(n: int) -> Array:
    """Orthonormal contrasts of n numbers (Helmert), shape (n - 1, n): each row sums to zero."""
    k = np.arange(1, n)[:, None]
    j = np.arange(n)[None, :]
    rows = np.where(j < k, 1.0, np.where(j == k, -k, 0.0))
    return np.asarray(rows / np.sqrt(k * (k + 1.0)))


def autocovariance(term: TermType, count: int, block: int, sampling: str) -> Array:
    """Autocovariance, up to a constant, of the means over `block` samples at distances 0 ... count - 1.

    The term is in sample units (interval 1). It is the second difference of that of the phase, which is exact for
    interval means and for point samples alike.
    """
    k = np.arange(-1, count + 1, dtype=np.float64) * block
    phase = term.phase_covariance(k, 1.0, sampling)
    return np.asarray((2 * phase[1:-1] - phase[2:] - phase[:-2]) / float(block) ** 2)


#: series(count, block): see `Pool.expected`.
Series = Callable[[int, int], Array]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pool:
    """Vectors u = A x, x being rows (means over `block` samples) at adjacent or at scattered places.

    Attributes
    ----------
    block : int
        Samples in a row.
    given : int
        The last so many components are what the others are conditioned on.
    count : int
        Number of vectors.
    mean : ndarray, shape (d,)
    second : ndarray, shape (d, d)
        Mean of u u'.
    mixing : ndarray, shape (d, K)
        A.
    lags : ndarray, shape (K, K, L), optional
        Rows at scattered places: which share of the vectors has rows i and j at distance l. Without it x are K adjacent
        rows.
    extra : ndarray, shape (KINDS, d, d), optional
        Mean covariance by which incomplete rows exceed complete ones: per unit of white noise, of quantisation, and of
        slow noise relative to a random walk, level by level.
    tilt : ndarray, shape (d,)
        What a ramp of one unit per sample makes of u.
    """

    block: int
    given: int
    count: int
    mean: Array
    second: Array
    mixing: Array
    lags: Array | None
    extra: Array | None
    tilt: Array

    @property
    def size(self) -> int:
        """Number of components."""
        return len(self.mean)

    def expected(self, series: Series, extra: Array) -> Array:
        """Covariances of u, shape (k, d, d).

        Parameters
        ----------
        series : callable
            series(count, block): autocovariances of means over `block` samples at distances 0 ... count - 1, of k
            processes, shape (k, count).
        extra : ndarray, shape (k, KINDS)
            How much extra noise of each kind the processes make in incomplete rows.
        """
        if self.lags is not None:
            covariances = series(self.lags.shape[2], self.block)
            rows = np.moveaxis(self.lags @ covariances.T, -1, 0)
        else:
            width = self.mixing.shape[1]
            covariances = series(max(width, 3), self.block)
            rows = covariances[:, np.abs(np.arange(width)[:, None] - np.arange(width)[None, :])]
        covariance = self.mixing @ rows @ self.mixing.T
        if self.extra is not None:
            covariance = covariance + np.tensordot(extra, self.extra, axes=1)
        return np.asarray((covariance + covariance.transpose(0, 2, 1)) / 2)
