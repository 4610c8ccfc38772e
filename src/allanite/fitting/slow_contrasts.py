# SPDX-License-Identifier: BSD-3-Clause
"""Contrasts of rows at the places that are there, ordered from slow to quick: cosines that know about gaps.

With d_j the variance of white noise in row j, and L the precision of a random walk at the rows that are there (the
Laplacian of a path, each edge as strong as the gap that it crosses is short),

    D^1/2 L D^1/2 w_k = lambda_k w_k,    u_k = D^-1/2 w_k,    0 = lambda_0 < lambda_1 < ...            (1)

The contrasts u_k . y are uncorrelated both in white noise (variance 1 each) and in a random walk (variance
1/lambda_k), do not see the level (u . 1 = 0), and cross gaps without closing or filling them. Without gaps they are
the discrete cosine transform. For other noise they are nearly uncorrelated, and their covariances follow from the
autocovariance R of the rows:

    E[c_j c_k] = sum over h of g_jk(h) R(h),    g_jk the correlation of u_j and u_k, both signs of h folded.    (2)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["autocorrelations", "correlations", "slow_contrasts"]

Array = NDArray[np.float64]


def slow_contrasts(place: NDArray[np.int64], white: Array, count: int) -> tuple[Array, Array]:
    """The `count` smallest lambda_k > 0 of eq. (1), and u_k as rows over the places.

    Parameters
    ----------
    place : ndarray of int, shape (n,)
        Where there are rows, ascending.
    white : ndarray, shape (n,)
        d_j.
    """
    n = len(place)
    if place[-1] - place[0] == n - 1 and np.all(white == white[0]):  # whole: the cosine transform
        k = np.arange(1, count + 1)
        u = np.cos(np.pi / n * np.outer(k, np.arange(n) + 0.5)) * np.sqrt(2 / n / white[0])
        return white[0] * 4 * np.sin(np.pi * k / (2 * n)) ** 2, u
    from scipy.linalg import eigh_tridiagonal

    edge = 1 / np.diff(place).astype(np.float64)
    root = np.sqrt(white)
    diagonal = (np.append(edge, 0.0) + np.append(0.0, edge)) * white
    rate, w = eigh_tridiagonal(diagonal, -edge * root[1:] * root[:-1], select="i", select_range=(0, count))
    return np.maximum(rate[1:], 0.0), (w[:, 1:] / root[:, None]).T


def autocorrelations(u: Array) -> Array:
    """g_kk of eq. (2) for each row, shape (n, n_places)."""
    each = np.arange(len(u))
    return correlations(u, each, each)


def correlations(u: Array, first: NDArray[np.int64], second: NDArray[np.int64]) -> Array:
    """g_jk of eq. (2) for pairs of rows, shape (n_pairs, n_places)."""
    n = u.shape[1]
    size = _quick_length(2 * n)
    transforms = np.fft.rfft(u, size, axis=1)
    lagged = np.fft.irfft((transforms[first] * transforms[second].conj()).real, size, axis=1)[:, :n]
    lagged[:, 1:] *= 2
    return lagged


def _quick_length(n: int) -> int:
    """A length of n or a little more whose Fourier transform is quick: m times a power of two."""
    return min(m << (-(-n // m) - 1).bit_length() for m in (1, 3, 5, 9, 15))
