# SPDX-License-Identifier: BSD-3-Clause
"""Noise terms of every part: generalised least squares on all elements of C at all lags, in their exact covariance.

All elements are linear in the squared coefficients of the parts: C_ij = a_own,i [i = j] + a_common. The covariance of
the elements depends on the coefficients; it is renewed until it no longer matters. Coefficients for the covariance are
not negative; the printed intervals come from the free solution, whose other terms are nuisances of either sign, so that
an interval which reaches zero is an upper limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.design import LINEAR
from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan.covariance import LagPairs
from allanite.quantities.distributions import chi_square_quantile
from allanite.stability.shared_noise.quadratic import Products, covariance_of, entries, patterns

__all__ = ["SYMBOLS", "FittedTerms", "fit_terms"]

Array = NDArray[np.float64]

SYMBOLS = ("Q", "N", "B", "K")
_ROUNDS = 5
_OPEN = 0.15  # of the square in an interval, below which its upper end runs away
#: Own white noise that a channel has at least, as a part of its variance: else nothing would scatter.
_FLOOR = 1e-4
#: Eigenvalue below which a combination of terms is not determined, and the part of a term that may lie in such ones.
_SINGULAR, _BLIND = 1e-12, 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedTerms:
    """Squared coefficients in sample units, parts in the order of `patterns`.

    Attributes
    ----------
    coefficients : ndarray, shape (parts, n_symbols)
        Not negative.
    free, sd : ndarray, shape (parts, n_symbols)
        Free solution with its standard deviations; infinite where the lags do not determine a term.
    spread : ndarray, shape (parts, n_symbols, 3)
        Variance of every free coefficient as a quadratic in its true value: constant, slope, curvature.
    products : ndarray, shape (parts, parts, n_lags, n_lags)
        J under the coefficients.
    means : ndarray, shape (parts, n_lags)
        Allan variance of every part.
    """

    coefficients: Array
    free: Array
    sd: Array
    spread: Array
    products: Array
    means: Array

    def interval(self, row: int, k: int, reach: float) -> tuple[float, float]:
        """Values of one coefficient that its estimate does not contradict: (x - c)^2 <= reach^2 var(c).

        A coefficient that a few degrees of freedom determine scatters in proportion to itself: its interval reaches
        farther up than down.
        """
        x, (q0, q1, q2) = float(self.free[row, k]), self.spread[row, k].tolist()
        if not math.isfinite(self.sd[row, k]):
            return -math.inf, math.inf
        if x <= 0.0:  # nothing to scatter in proportion to
            return x - reach * float(self.sd[row, k]), reach * float(self.sd[row, k])
        a, b, c = 1.0 - reach**2 * q2, 2.0 * x + reach**2 * q1, x * x - reach**2 * q0
        root = math.sqrt(max(b * b - 4.0 * a * c, 0.0))
        if a > _OPEN:
            return (b - root) / (2.0 * a), (b + root) / (2.0 * a)
        # so few degrees of freedom that the normal law sets no upper end: that of chi-square
        low = 2.0 * c / (b + root) if b + root > 0 else -math.inf
        freedom = 2.0 / q2
        high = max(x, 0.0) * freedom / chi_square_quantile(0.5 * math.erfc(reach / math.sqrt(2.0)), freedom)
        return low, high + reach * math.sqrt(q0)

    def matrix(self) -> Array:
        """C under the coefficients, shape (n_lags, n, n)."""
        basis = patterns(len(self.means) - 1)
        return np.asarray(np.einsum("pl,pij->lij", self.means, basis))


def fit_terms(covariance: Array, pairs: LagPairs, sampling: str) -> FittedTerms:
    """Fit terms to C, shape (n_lags, n, n), in sample units and scaled to order one."""
    from scipy.optimize import nnls

    n = covariance.shape[1]
    m = pairs.lags.astype(np.float64)
    columns = np.stack([LINEAR[s].avar_sampled(m, 1.0, sampling) for s in SYMBOLS], axis=1)
    products = Products(pairs, np.stack([pairs.cross(LINEAR[s], sampling) for s in SYMBOLS]))
    forms = [_form(n, i, j) for i, j in entries(n)]
    design = np.concatenate([np.kron(_loads(n, i, j), columns) for i, j in entries(n)])
    target = np.concatenate([covariance[:, i, j] for i, j in entries(n)])
    size = np.concatenate(
        [np.sqrt(covariance[:, i, i] * covariance[:, j, j] * m) for i, j in entries(n)]
    )  # relative errors grow with the square root of the lag
    whiten = np.diag(1.0 / size)
    norm = np.tile(np.sqrt((columns**2).sum(axis=0)), n + 1)
    c = np.zeros((n + 1, len(SYMBOLS)))
    for _ in range(_ROUNDS):
        made = whiten @ (design / norm)
        c = (nnls(made, whiten @ target, maxiter=1000)[0] / norm).reshape(n + 1, -1)
        c[:n, 1] = np.maximum(c[:n, 1], _FLOOR * covariance[0, range(n), range(n)])
        V = covariance_of(forms, products.of(c)).reshape(len(target), len(target))
        whiten = _inverse_root(V)
    made = whiten @ (design / norm)
    inverse, known = _inverse(made.T @ made)
    free = (inverse @ (made.T @ (whiten @ target)) / norm).reshape(n + 1, -1)
    sd = np.where(known, np.sqrt(np.maximum(np.diag(inverse), 0.0)) / norm, np.inf).reshape(n + 1, -1)
    weights = inverse @ made.T @ whiten / norm[:, None]

    def others(at: int, value: float) -> Array:
        """Coefficients where one of them is `value`: the rest fitted again, for what it took belongs to them."""
        rest = np.delete(np.arange(len(norm)), at)
        around = whiten @ (target - design[:, at] * value)
        coefficients = np.full(len(norm), value)
        coefficients[rest] = nnls(made[:, rest], around, maxiter=1000)[0] / norm[rest]
        return coefficients.reshape(n + 1, -1)

    return FittedTerms(
        coefficients=c,
        free=free,
        sd=sd,
        spread=_spread(weights, others, c, free, sd, products, forms),
        products=products.of(c),
        means=np.asarray(c @ columns.T),
    )


def _spread(
    weights: Array,
    others: Callable[[int, float], Array],
    c: Array,
    free: Array,
    sd: Array,
    products: Products,
    forms: Sequence[Array],
) -> Array:
    """Variance of every linear estimate at three values of its own coefficient, as a quadratic."""
    out = np.zeros((*free.shape, 3))
    for place, (at, row) in enumerate(zip(np.ndindex(*free.shape), weights, strict=True)):
        if not np.isfinite(sd[at]):
            continue
        # the fitted value is a node, so that the stated standard deviation is met there
        step = float(c[at]) if c[at] > 0.5 * sd[at] else max(float(free[at]), float(sd[at]), 1e-300)
        spreads = []
        for value in (0.0, step, 2.0 * step):
            V = covariance_of(forms, products.of(others(place, value))).reshape(len(row), len(row))
            spreads.append(float(row @ V @ row))
        zero, one, two = spreads
        curvature = max((two - 2.0 * one + zero) / (2.0 * step**2), 0.0)
        out[at] = max(zero, 0.0), max((one - zero) / step - curvature * step, 0.0), curvature
    return out


def _form(n: int, i: int, j: int) -> Array:
    """A of one element of C."""
    out = np.zeros((n, n))
    out[i, j] += 0.5
    out[j, i] += 0.5
    return out


def _loads(n: int, i: int, j: int) -> Array:
    """Which parts an element of C is made of, shape (1, n + 1)."""
    out = np.zeros((1, n + 1))
    out[0, n] = 1.0
    if i == j:
        out[0, i] = 1.0
    return out


def _inverse(normal: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Pseudo-inverse of a normal matrix, and which unknowns it determines: few lags may not tell terms apart."""
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    values, vectors = np.linalg.eigh(normal / np.outer(size, size))
    good = values > _SINGULAR * values[-1]
    inverse = (vectors[:, good] / values[good]) @ vectors[:, good].T / np.outer(size, size)
    blind = (vectors[:, ~good] ** 2).sum(axis=1) if (~good).any() else np.zeros(len(size))
    return np.asarray(inverse), np.asarray(blind < _BLIND)


def _inverse_root(V: Array) -> Array:
    sd = np.sqrt(np.diag(V))
    rho = V / np.outer(sd, sd)
    root = np.linalg.cholesky(0.5 * (rho + rho.T) + 1e-7 * np.eye(len(rho)))
    return np.asarray(np.linalg.solve(root, np.diag(1.0 / sd)))
