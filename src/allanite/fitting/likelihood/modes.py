# SPDX-License-Identifier: BSD-3-Clause
"""The last rows of a pyramid as slow contrasts: the slowest ones jointly, the others as if they were independent.

Of the cosines of n rows those of white noise and of a random walk are uncorrelated, those of all other noise nearly so
but for the slowest. With 32 of them treated as one vector nothing is lost: 0.1 % in standard deviation for mixtures of
white noise, flicker, Gauss-Markov noise and random walk, 1 % for quantisation, and the stated errors are right to 0.3 %
(the tests compute it), at the price of a transform instead of matrices of n rows.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.likelihood.pool import KINDS, Series
from allanite.fitting.slow_contrasts import autocorrelations, correlations, slow_contrasts
from allanite.lazy_dataclasses import dataclass

__all__ = ["Modes", "modes_of"]

Array = NDArray[np.float64]

#: Contrasts that are treated jointly; of up to so many rows all are.
LOW, FEW = 32, 128
#: Squared relative spread of the white noise of rows up to which they count as even.
_EVEN = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Modes:
    """Contrasts of rows, from slow to quick.

    Attributes
    ----------
    block : int
        Samples in a row.
    rows : int
        Places, taken or not.
    low : int
        The first so many are one vector.
    value : ndarray, shape (n,)
    tilt : ndarray, shape (n,)
        What a ramp of one unit per sample makes of them.
    log_volume : float
        Logarithm of the volume element from these to orthonormal contrasts of the rows that are there.
    shape : ndarray, shape (n_pairs + n, rows)
        Correlations of the weights: pairs of the low ones (lower triangle), then each with itself.
    extra : ndarray, shape (KINDS, n_pairs + n), optional
        By how much incomplete rows exceed complete ones, as in `Pool`.
    """

    block: int
    rows: int
    low: int
    value: Array
    tilt: Array
    log_volume: float
    shape: Array
    extra: Array | None

    def expected(self, series: Series, extra: Array) -> tuple[Array, Array]:
        """Covariances of the low ones, shape (k, low, low), and variances of all, shape (k, n); see `Pool.expected`."""
        covariances = series(max(self.rows, 3), self.block)[:, : self.rows] @ self.shape.T
        if self.extra is not None:
            covariances = covariances + extra @ self.extra
        first, second = _pairs(self.low)
        low = np.empty((len(covariances), self.low, self.low))
        low[:, first, second] = low[:, second, first] = covariances[:, : len(first)]
        return low, covariances[:, len(first) :]


def modes_of(values: Array, extra: Array, block: int) -> Modes | None:
    """All contrasts of the rows that are there; None of fewer than two.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Rows in order, NaN where missing.
    extra : ndarray, shape (n, KINDS + 1)
        Extra noise of incomplete rows, and how much later their centres lie [samples].
    block : int
        Samples in a row.
    """
    here = np.flatnonzero(np.isfinite(values))
    n = len(here)
    if n < 2:
        return None
    white = 1.0 / block + extra[here, 0]
    low = n - 1 if n <= FEW else LOW
    if n == len(values) and white.var() < _EVEN * white.mean() ** 2:
        white = np.full(n, white.mean())
        u, shape = _contrasts_of(len(values), here.tobytes(), np.ones(n).tobytes(), low)
        u, shape = u / np.sqrt(white[0]), shape / white[0]
    else:
        u, shape = _contrasts_of(len(values), here.tobytes(), white.tobytes(), low)
    return Modes(
        block=block,
        rows=len(values),
        low=low,
        value=u[:, here] @ (values[here] - values[here].mean()),
        tilt=u @ (block * np.arange(float(len(values))) + extra[:, KINDS]),
        log_volume=float(np.log(n) - np.log(white).sum() - np.log((1 / white).sum())) / 2,
        shape=shape,
        extra=_spread(u, extra[:, :KINDS], low) if extra.any() else None,
    )


@lru_cache(maxsize=4)
def _contrasts_of(places: int, here: bytes, white: bytes, low: int) -> tuple[Array, Array]:
    """Contrasts of the rows that are there, over all places, and their shape; of the channels of a unit these agree."""
    at, variance = np.frombuffer(here, dtype=np.int64), np.frombuffer(white)
    u = np.zeros((len(at) - 1, places))
    u[:, at] = slow_contrasts(at, variance, len(at) - 1)[1]
    shape = _shape(u, low)
    u.flags.writeable = shape.flags.writeable = False
    return u, shape


def _spread(u: Array, extra: Array, low: int) -> Array:
    """By how much incomplete rows exceed complete ones."""
    first, second = _pairs(low)
    slow, square = u[:low], u**2
    return np.stack([np.concatenate([((slow * e) @ slow.T)[first, second], square @ e]) for e in extra.T])


@lru_cache(maxsize=16)
def _pairs(low: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The lower triangle; every step of a search asks for it."""
    first, second = np.tril_indices(low)
    first.flags.writeable = second.flags.writeable = False
    return first, second


def _shape(u: Array, low: int) -> Array:
    first, second = _pairs(low)
    return np.concatenate([correlations(u, first, second), autocorrelations(u)])
