# SPDX-License-Identifier: BSD-3-Clause
"""How well does a sum of terms explain a curve? The objective of the moment fit, and its minimum.

An Allan variance v with e degrees of freedom is nearly a chi-square variable: skewed, with a spread proportional
to its mean. Its cube root is normal to high accuracy even at e = 2 (Wilson and Hilferty 1931):

    z_i = (v_i/mu_i)^(1/3) - (1 - 2/(9 e_i)),     cov(z_i, z_j) = rho_ij 2/(9 sqrt(e_i e_j)),

with rho and e from the exact covariance of the curve. Minus twice the log-likelihood of the whole curve is then

    L(p) = z' C^-1 z + log det C + (2/3) sum log mu_i,

whose differences behave as chi-square in short records too, where the plain quadratic form in v does not.

References
----------
.. [1] E. Wilson, M. Hilferty, "The distribution of chi-square", PNAS 17 (1931) 684.
.. [2] L. Hansen, "Large sample properties of generalized method of moments estimators", Econometrica 50 (1982) 1029.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite._kernels import curve_minimum, curve_step, curve_weight
from allanite.fitting.design import MARKOV, CurveDesign, Times
from allanite.fitting.nonnegative import nonnegative
from allanite.lazy_dataclasses import dataclass

__all__ = ["CurveData", "CurveSolution", "advantage", "distance", "linearized", "sensitivity", "solve"]

Array = NDArray[np.float64]

_ROUNDS = 12
_STEPS = 30
_SETTLED = 1e-5  # a gain of the objective that no longer matters: 0.003 standard deviations
_EDF_MIN = 0.5
_FARTHEST = 1.0  # in ln T, in one step
_RAMPS = ("R", "fR")  # no noise: they have no spread of their own


@dataclass(frozen=True, slots=True)
class CurveData:
    """What is fitted: Allan variances in sample units, scaled to order one, with their design.

    `discrepancy` is a relative error of the model at every lag, for curves that no sum of terms explains. With the
    floor of an instrument the variances are those of two curves, one after the other.
    """

    variance: Array
    design: CurveDesign
    discrepancy: float = 0.0


@dataclass(frozen=True, slots=True)
class CurveSolution:
    """A minimum of L.

    Attributes
    ----------
    symbols : tuple of str
    c : ndarray, shape (n_symbols,)
        Variance coefficients, not negative.
    times : tuple of float
        Correlation times [samples] of the Gauss-Markov terms, in the order of `MARKOV`.
    value : float
        L at the minimum.
    chi2 : float
        z' C^-1 z there.
    """

    symbols: tuple[str, ...]
    c: Array
    times: Times
    value: float
    chi2: float
    weight: _Weight | None

    @property
    def T(self) -> float | None:
        """Correlation time [samples] of the first Gauss-Markov term; None without one."""
        return self.times[0] if self.times else None

    @property
    def markov(self) -> tuple[str, ...]:
        """The Gauss-Markov terms whose correlation times these are."""
        return MARKOV[: len(self.times)]

    def coefficient(self, symbol: str) -> float:
        """The variance coefficient of a symbol, 0 where it is not a candidate."""
        return float(self.c[self.symbols.index(symbol)]) if symbol in self.symbols else 0.0


def solve(
    curve: CurveData,
    symbols: tuple[str, ...],
    *,
    times: Times = (),
    within: Sequence[tuple[float, float]] = (),
    fixed: Mapping[str, float] | None = None,
    start: Array | None = None,
) -> CurveSolution:
    """Minimise L over the coefficients that are not fixed, all of them >= 0.

    The weights (C) are those of the current model and are renewed until they no longer matter; within a round
    the minimum is found by Gauss-Newton steps, each a non-negative least-squares problem.

    Parameters
    ----------
    times : tuple of float [samples]
        Correlation times of the Gauss-Markov terms.
    within : sequence of (float, float), optional [samples]
        Each of the times is free between two ends, and the minimum is the one nearest to `times`. By default they are
        held.
    """
    fixed = fixed or {}
    A = curve.design.columns(symbols, times)
    free = np.array([s not in fixed for s in symbols])
    c = _start(curve.variance, A, symbols, fixed, free) if start is None else np.maximum(start, 0.0)
    for s, value in fixed.items():
        c[symbols.index(s)] = value
    weight = None
    for _ in range(_ROUNDS):
        fresh = _Weight.of(curve, symbols, c, A, times)
        if fresh is None:
            break
        weight = fresh
        before = weight.objective(curve.variance, A @ c)[0]
        if not within:
            c = _minimise(curve.variance, A, c, free, weight)
        else:
            c, times = _with_times(curve, symbols, c, free, times, within, weight)
            A = curve.design.columns(symbols, times)
        if before - weight.objective(curve.variance, A @ c)[0] < 1e-3:
            break
    if weight is None:
        return CurveSolution(symbols, c, times, np.inf, np.inf, None)
    value, chi2 = weight.objective(curve.variance, A @ c)
    return CurveSolution(symbols, c, times, value + weight.log_det, chi2, weight)


def distance(curve: CurveData, null: CurveSolution, times: Times = ()) -> float:
    """How much better the full family does than a constrained solution, judged with the weights of the latter.

    Under the constraint this is chi-square with one degree of freedom (half of the time zero on the border of the
    parameter space), because the weights are then the right ones. `times` are other correlation times at which the
    full family is tried, those of its own best fit.
    """
    if null.weight is None:
        return np.inf
    A = curve.design.columns(null.symbols, null.times)
    free = np.ones(len(null.symbols), dtype=bool)
    at_null = null.weight.objective(curve.variance, A @ null.c)[0]
    best = null.weight.objective(curve.variance, A @ _minimise(curve.variance, A, null.c, free, null.weight))[
        0
    ]
    if len(times) == len(null.times) and times != null.times:
        A = curve.design.columns(null.symbols, times)
        other = _minimise(curve.variance, A, null.c, free, null.weight)
        best = min(best, null.weight.objective(curve.variance, A @ other)[0])
    return at_null - best


def advantage(curve: CurveData, rival: CurveSolution, null: CurveSolution) -> float:
    """How much better a rival family does than `null`, judged with the weights that are right if `null` is true."""
    if null.weight is None:
        return np.inf
    A = curve.design.columns(null.symbols, null.times)
    at_null = null.weight.objective(curve.variance, A @ null.c)[0]
    A = curve.design.columns(rival.symbols, rival.times)
    c = _minimise(curve.variance, A, rival.c, np.ones(len(rival.c), dtype=bool), null.weight)
    return at_null - null.weight.objective(curve.variance, A @ c)[0]


def linearized(curve: CurveData, at: CurveSolution) -> tuple[Array, Array]:
    """Derivatives of the whitened curve with respect to c and, in the last columns, ln T; and its residuals.

    Near the solution the residuals change by minus the derivatives times the step. Where the solution is the truth, the
    residuals, shape (n_lags,), are standard normal. The derivatives have shape (n_lags, n).
    """
    A = curve.design.columns(at.symbols, at.times)
    mu = A @ at.c
    along = [at.coefficient(s) * curve.design.markov(T)[1] for s, T in zip(MARKOV, at.times, strict=False)]
    slope = np.concatenate([A, np.reshape(along, (-1, len(mu))).T], axis=1) / mu[:, None]
    if at.weight is None:
        return np.full_like(slope, np.nan), np.full_like(mu, np.nan)
    return at.weight.whitened(slope) / 3, at.weight.whitened(np.cbrt(curve.variance / mu) - at.weight.centre)


def sensitivity(curve: CurveData, at: CurveSolution) -> Array:
    """Expected change of the whitened residuals with ln c and, in the last columns, ln T; shape (n_lags, n)."""
    change = linearized(curve, at)[0]
    return np.asarray(-change * np.concatenate([at.c, np.ones(change.shape[1] - len(at.c))]))


def _start(
    v: Array, A: Array, symbols: tuple[str, ...], fixed: Mapping[str, float], free: NDArray[np.bool_]
) -> Array:
    """Relative least squares with non-negative coefficients: a safe first guess."""
    c = np.array([fixed.get(s, 0.0) for s in symbols])
    rest = np.maximum(v - A @ c, 0.05 * v) / v
    weight = 1 / np.sqrt(1 + np.arange(len(v)))
    if free.any():
        columns = A[:, free] / v[:, None] * weight[:, None]
        norm = np.linalg.norm(columns, axis=0)
        c[free] = nonnegative(columns / norm, rest * weight) / norm
    noise = [i for i, s in enumerate(symbols) if s not in _RAMPS]
    for row in (0, -1):  # of a floor, too, which stands after the measured curve
        if not np.all(A[:, noise] @ c[noise] > 0):
            able = [i for i in noise if free[i]]
            if able:
                anchor = able[int(np.argmax(A[row, able]))]
                c[anchor] += v[row] / A[row, anchor] if A[row, anchor] > 0 else 0.0
    return c


@dataclass(frozen=True, slots=True)
class _Weight:
    """Weights of one round: inverse factors of C, means of the cube roots, log det C.

    Records are independent of one another: each has a block of C, and a triangle of its inverse factor.
    """

    blocks: tuple[Array, ...]
    centre: Array
    log_det: float

    @classmethod
    def of(
        cls, curve: CurveData, symbols: tuple[str, ...], c: Array, A: Array, times: Times
    ) -> _Weight | None:
        """Weights of the noise alone. A ramp has no spread of its own; were it to lend its size to the weights, a
        large ramp would make the long lags look certain and never be let go of. So its set is a little too wide."""
        noise = np.where([s in _RAMPS for s in symbols], 0.0, c)
        mu = A @ noise
        if mu.min() <= 0:
            return None
        relative = curve.design.relative_covariances(list(symbols), noise, times, mu)
        factored = {id(block): _factored(block, curve.discrepancy) for block in relative}
        blocks = [one for one in (factored[id(block)] for block in relative) if one is not None]
        if len(blocks) < len(relative):
            return None
        whiten, centre, log_det = zip(*blocks, strict=True)
        return cls(whiten, np.concatenate(centre), sum(log_det))

    @property
    def rows(self) -> Array:
        """The triangles below one another, shape (n_lags, lags of the longest record)."""
        if len(self.blocks) == 1:
            return self.blocks[0]
        width = max(map(len, self.blocks))
        return np.concatenate([np.pad(block, ((0, 0), (0, width - len(block)))) for block in self.blocks])

    @property
    def starts(self) -> NDArray[np.int64]:
        """First lag of the record that each lag belongs to, shape (n_lags,)."""
        sizes = np.array([len(block) for block in self.blocks])
        return np.repeat(np.cumsum(sizes) - sizes, sizes)

    def whitened(self, x: Array) -> Array:
        """Inverse factor of C times x, shape of x: (n_lags,) or (n_lags, n)."""
        if len(self.blocks) == 1:
            return np.asarray(self.blocks[0] @ x)
        at = np.cumsum([len(block) for block in self.blocks])
        parts = np.split(x, at[:-1])
        return np.concatenate([block @ part for block, part in zip(self.blocks, parts, strict=True)])

    def objective(self, v: Array, mu: Array) -> tuple[float, float]:
        r = self.whitened(np.cbrt(v / mu) - self.centre)
        chi2 = float(r @ r)
        return chi2 + 2 / 3 * float(np.log(mu).sum()), chi2


def _factored(relative: Array, discrepancy: float) -> tuple[Array, Array, float] | None:
    """Inverse factor of C, means of the cube roots and log det C of one record; None where C has no factor.

    Parameters
    ----------
    relative : ndarray, shape (n_lags, n_lags)
        Covariance of the curve over the products of its means.
    """
    whiten, centre, log_det = curve_weight(np.ascontiguousarray(relative), discrepancy, _EDF_MIN)
    return None if math.isnan(log_det) else (whiten, centre, log_det)


def _minimise(v: Array, A: Array, c: Array, free: NDArray[np.bool_], weight: _Weight) -> Array:
    """Projected Newton steps for fixed weights, with step halving."""
    if not free.any():
        return c
    out = c.copy()
    out[free] = curve_minimum(
        v,
        np.ascontiguousarray(A[:, free]),
        A[:, ~free] @ c[~free],
        c[free],
        weight.rows,
        weight.starts,
        weight.centre,
        steps=_STEPS,
        settled=_SETTLED,
    )
    return out


def _with_times(
    curve: CurveData,
    symbols: tuple[str, ...],
    c: Array,
    free: NDArray[np.bool_],
    times: Times,
    within: Sequence[tuple[float, float]],
    weight: _Weight,
) -> tuple[Array, Times]:
    """The same over the correlation times, too: each is one more direction, its logarithm above the shortest."""
    v, design = curve.variance, curve.design
    places = [symbols.index(s) for s in MARKOV[: len(times)]]
    shortest, longest = np.log(within).T
    u = np.clip(np.log(times), shortest, longest)
    A = design.columns(symbols, times)
    mu = A @ c
    value, rows, starts = weight.objective(v, mu)[0], weight.rows, weight.starts
    for _ in range(_STEPS):
        moving = [k for k, i in enumerate(places) if c[i] > 0 and shortest[k] < longest[k]]
        along = [c[places[k]] * design.markov(math.exp(u[k]))[1] for k in moving]
        B = np.ascontiguousarray(np.concatenate([A[:, free], np.reshape(along, (-1, len(v))).T], axis=1))
        if not B.shape[1]:
            break
        here = np.concatenate([c[free], (u - shortest)[moving]])
        step = curve_step(v, B, here, mu, rows, starts, weight.centre)
        dc, du = np.zeros_like(c), np.zeros_like(u)
        dc[free] = step[: int(free.sum())]
        du[moving] = np.clip(step[int(free.sum()) :], -_FARTHEST, _FARTHEST)
        size, new = 1.0, np.inf
        while size > 1e-7:
            c_trial = np.maximum(c + size * dc, 0.0)
            u_trial = np.clip(u + size * du, shortest, longest)
            A_trial = design.columns(symbols, tuple(np.exp(u_trial).tolist()))
            mu_trial = A_trial @ c_trial
            if mu_trial.min() > 0:
                new = weight.objective(v, mu_trial)[0]
                if new <= value + 1e-12:
                    break
            size /= 2
        if not new <= value + 1e-12:
            break
        gain, c, u, A, mu, value = value - new, c_trial, u_trial, A_trial, mu_trial, new
        if gain < _SETTLED:
            break
    return c, tuple(np.exp(u).tolist())
