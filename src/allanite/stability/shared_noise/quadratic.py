# SPDX-License-Identifier: BSD-3-Clause
"""Every estimate is a sum of squares and products: which one, and its exact variance under models of all parts.

With D(i) the differences of all channels at position i, an estimate is the mean of D' A D/2 over the positions, with a
symmetric A. D is Gaussian with stationary cross-covariances

    R(k) = E[D(i) D(i+k)']/2 = sum_p r_p(k) E_p,    E_p = e_p e_p' for the own noise of p, 1 1' for the common part, (1)

where r_p is the closed form r12 of a sum of noise terms (`allanite.noise.allan.covariance`). By Isserlis' theorem

    Cov(A at m1, B at m2) = 2/(M1 M2) sum_k n_k tr(A R12(k) B R12(k)') = 2 sum_pq tr(A E_p B E_q) J_pq,              (2)

    J_pq = 1/(M1 M2) sum_k n_k r_p(k) r_q(k).

References
----------
.. [1] L. Isserlis, "On a formula for the product-moment coefficient of any order", Biometrika 12 (1918) 134.
.. [2] J. Gray, D. Allan, "A method for estimating the frequency stability of an individual oscillator", Proc. 28th
   Annual Symposium on Frequency Control (1974) 243: the three-cornered hat.
.. [3] E. Lantz, C. Calosso, E. Rubiola et al., "KLTS: A rigorous method to compute the confidence intervals for the
   three-cornered hat and for Groslambert covariance", IEEE Trans. UFFC 66 (2019) 1942.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.noise.allan.covariance import LagPairs

__all__ = ["Products", "common_form", "covariance_of", "entries", "own_basis", "own_form", "patterns"]

Array = NDArray[np.float64]


def own_basis(n: int, i: int) -> Array:
    """Two combinations of the channels whose covariance is the own noise of channel i, shape (2, n)."""
    others = [j for j in range(n) if j != i]
    out = np.zeros((2, n))
    out[:, i] = 1.0
    out[1, others[0]] = -1.0
    if n == 3:
        out[0, others[1]] = -1.0
    return out


def own_form(n: int, i: int) -> Array:
    """A of the own noise of channel i, shape (n, n)."""
    first, second = own_basis(n, i)
    return np.asarray(0.5 * (np.outer(first, second) + np.outer(second, first)))


def common_form(n: int) -> Array:
    """A of the common part: the mean over the pairs, shape (n, n)."""
    return np.asarray((np.ones((n, n)) - np.eye(n)) / (n * (n - 1)))


def entries(n: int) -> list[tuple[int, int]]:
    """The different elements of C."""
    return [(i, j) for i in range(n) for j in range(i, n)]


def patterns(n: int) -> Array:
    """E_p of the own noise of every channel, then of the common part, shape (n + 1, n, n)."""
    return np.asarray([*(np.outer(e, e) for e in np.eye(n)), np.ones((n, n))])


class Products:
    """J of equation (2) for parts that are sums of unit processes with given variance coefficients.

    Parameters
    ----------
    pairs : LagPairs
        Of the record, with its gaps.
    units : ndarray, shape (n_units, n_nodes)
        r12 of every unit process at the nodes of the pairs.
    """

    def __init__(self, pairs: LagPairs, units: Array) -> None:
        count = len(units)
        self._sums = np.empty((count, count, len(pairs.lags), len(pairs.lags)))
        for s in range(count):
            for t in range(s + 1):
                self._sums[s, t] = self._sums[t, s] = pairs.sum(units[s] * units[t])

    def of(self, coefficients: Array) -> Array:
        """J_pq of parts with these coefficients, shape (parts, n_units), as (parts, parts, n_lags, n_lags)."""
        return np.asarray(
            np.einsum("ps,qt,stab->pqab", coefficients, coefficients, self._sums, optimize=True)
        )


def covariance_of(forms: Sequence[Array], products: Array) -> Array:
    """Covariance of several estimates at all lags, equation (2), shape (forms, n_lags, forms, n_lags)."""
    basis = patterns(forms[0].shape[0])
    traces = np.einsum("aij,pjk,bkl,qli->abpq", forms, basis, forms, basis, optimize=True)
    return np.asarray(2 * np.einsum("abpq,pqlm->albm", traces, products, optimize=True))
