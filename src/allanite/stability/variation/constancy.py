# SPDX-License-Identifier: BSD-3-Clause
"""Is the Allan variance the same in every window? Cube roots with their exact covariance.

The variance of a window is nearly chi-square with e degrees of freedom, its cube root nearly normal even at e = 2 [1]:

    z = a u - (1 - 2/(9 e)),   u = v^(1/3),   cov(z_i, z_j) = rho_ij 2/(9 sqrt(e_i e_j)),                          (1)

with rho and e from the exact covariance of all windows and lags under a model of the noise. The level a^-3 of every
lag is free: what is tested is constancy, not the model, which only says how much windows scatter by chance. Noise
that is not Gaussian scatters more: excess kurtosis kappa of the white noise adds kappa/n to the relative variance of a
window of n samples, at all lags alike as far as the noise is white.

All lags together are tested by the sum of the chi-squares of the single lags. Neighbouring lags see nearly the same
noise; the whitened differences between them, that a sum over all cells at once would count, are small and of a law
with long tails. With z' A z that sum, A one block for each lag, and C the covariance of all cells,

    E = tr(A C),   var = 2 tr(A C A C):   z' A z is nearly var/(2 E) chi-square with 2 E^2/var degrees of freedom  (2)

(Satterthwaite [3]).

References
----------
.. [1] E. Wilson, M. Hilferty, "The distribution of chi-square", PNAS 17 (1931) 684.
.. [2] L. Galleani, P. Tavella, "The dynamic Allan variance", IEEE Trans. UFFC 56 (2009) 450.
.. [3] F. Satterthwaite, "An approximate distribution of estimates of variance components", Biometrics Bull. 2 (1946)
   110.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan.cells import AllanCells
from allanite.noise.allan.tails import kurtosis_of

__all__ = ["Whitened", "WindowScatter", "excess_kurtosis", "together", "window_scores"]

Array = NDArray[np.float64]

#: Least eigenvalue of a matrix of correlations: neighbours of long lags are nearly the same.
_LEAST = 1e-6
#: Samples of which the kurtosis is taken.
_ENOUGH = 1 << 21


@dataclass(frozen=True, slots=True)
class WindowScatter:
    """How windows scatter by chance: covariance of z, and degrees of freedom.

    Attributes
    ----------
    edf : ndarray, shape (n_cells,)
    covariance : ndarray, shape (n_cells, n_cells)
    """

    edf: Array
    covariance: Array

    @classmethod
    def of(cls, relative: Array) -> WindowScatter:
        """From the covariance of the variances over the product of their expectations, equation (1)."""
        spread = np.diag(relative)
        edf = 2.0 / spread
        rho = relative / np.sqrt(np.outer(spread, spread))
        sd = np.sqrt(2.0 / (9.0 * edf))
        return cls(edf, rho * np.outer(sd, sd))

    @property
    def centre(self) -> Array:
        """Mean of a u, shape (n_cells,)."""
        return 1.0 - 2.0 / (9.0 * self.edf)

    def of_cells(self, keep: NDArray[np.intp]) -> WindowScatter:
        """Of some of the cells."""
        return WindowScatter(self.edf[keep], self.covariance[np.ix_(keep, keep)])


@dataclass(frozen=True, slots=True)
class Whitened:
    """Residuals z of all cells after the levels of the lags, whitened.

    Attributes
    ----------
    factor : ndarray, shape (n_cells, n_cells)
        F with F C F' = 1.
    levels : ndarray, shape (n_cells, n_lags)
        Orthonormal columns: what free levels can explain.
    residual : ndarray, shape (n_cells,)
        F z, free of the levels.
    root : ndarray, shape (n_lags,)
        a of each lag.
    """

    factor: Array
    levels: Array
    residual: Array
    root: Array

    @classmethod
    def of(cls, variance: Array, row: NDArray[np.int64], scatter: WindowScatter) -> Whitened:
        """Levels at which the residuals of (1) are orthogonal to their means.

        Least squares over the levels would take u, which scatters, for the regressor, and find every level too low.
        """
        factor = _inverse_root(scatter.covariance)
        member = row[:, None] == np.arange(row.max() + 1)
        levels, _ = np.linalg.qr(factor @ (scatter.centre[:, None] * member))
        columns = factor @ (np.cbrt(variance)[:, None] * member)
        target = factor @ scatter.centre
        root = np.linalg.solve(levels.T @ columns, levels.T @ target)
        return cls(factor, levels, columns @ root - target, root)

    @property
    def chi2(self) -> float:
        """Sum of squares of the residuals."""
        return float(self.residual @ self.residual)

    def without_levels(self, columns: Array) -> Array:
        """Whitened columns, shape (n_cells, k), less what the levels explain of them."""
        made = self.factor @ columns
        return np.asarray(made - self.levels @ (self.levels.T @ made))


def window_scores(variance: Array, scatter: WindowScatter) -> tuple[float, Array]:
    """Chi-square of the windows of one lag, and z of each over its standard deviation, shape (n_windows,).

    A window takes part in the level that it is compared with; the standard deviation allows for it.
    """
    fitted = Whitened.of(variance, np.zeros(len(variance), dtype=np.int64), scatter)
    mean = scatter.centre
    spread = np.diag(scatter.covariance) - mean**2 / float(np.sum((fitted.factor @ mean) ** 2))
    scores = (fitted.root[0] * np.cbrt(variance) - mean) / np.sqrt(np.maximum(spread, 1e-300))
    return fitted.chi2, np.asarray(scores)


def together(variance: Array, row: NDArray[np.int64], scatter: WindowScatter) -> tuple[float, float]:
    """Chi-square of the windows of all lags, and its degrees of freedom, which are no whole number: equation (2).

    No degrees of freedom where no lag has two windows.
    """
    blocks, total = np.zeros_like(scatter.covariance), 0.0
    for one in np.unique(row):
        here = np.flatnonzero(row == one)
        whitened = Whitened.of(variance[here], np.zeros(len(here), dtype=np.int64), scatter.of_cells(here))
        free = whitened.without_levels(np.eye(len(here)))
        blocks[np.ix_(here, here)] = free.T @ free
        total += whitened.chi2
    product = blocks @ scatter.covariance
    mean, spread = float(np.trace(product)), 2.0 * float(np.sum(product * product.T))
    if spread < 1e-12:
        return 0.0, 0.0
    return total * 2.0 * mean / spread, 2.0 * mean**2 / spread


def _inverse_root(covariance: Array) -> Array:
    """Inverse of the Cholesky factor; of the nearest matrix that has one."""
    sd = np.sqrt(np.diag(covariance))
    rho = covariance / np.outer(sd, sd)
    rho = 0.5 * (rho + rho.T)
    try:
        root = np.linalg.cholesky(rho + 1e-9 * np.eye(len(rho)))
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(rho)
        root = np.linalg.cholesky((vectors * np.maximum(values, _LEAST)) @ vectors.T)
    return np.asarray(np.linalg.solve(root, np.diag(1.0 / sd)))


def excess_kurtosis(x: Array, cells: AllanCells) -> float:
    """Excess kurtosis of the white noise from the second differences of a phase; 0 where it may be chance.

    The mean over the windows of the shortest lag, so that a level of noise that changes does not look like tails.
    See `allanite.noise.allan.tails`.
    """
    here = np.flatnonzero(cells.row == 0)
    if len(here) == 0 or cells.lags[0] != 1:
        return 0.0
    most = max(_ENOUGH // len(here), 64)
    extents = ((int(cells.first[i]), int(cells.last[i]), int(cells.count[i])) for i in here)
    # a stretch at a time; none of a window in which samples are missing
    return kurtosis_of(
        np.diff(x[first : min(last, first + most) + 2], n=2)
        for first, last, count in extents
        if count == last - first >= 16
    )
