# SPDX-License-Identifier: BSD-3-Clause
"""Linear regression whose noise is a NoiseModel: y(t) = X(t) c + noise. One engine for all known columns.

The filter of the noise alone whitens: its innovations, over their standard deviations, are independent numbers of
variance one. Whitening is linear, so the same gains whiten every column of X, and what is left is ordinary least
squares. The coefficients have no prior. That is the exact diffuse Kalman filter of the model with the coefficients
as constant states, without a large number anywhere: scaling y or a column scales the answer and nothing else.

The bias of the sensor is a column of ones, "level": random walks start at zero, stationary terms start stationary.
Columns that the design cannot tell apart are found by a scale-free rank test and come back as "unbounded".

References
----------
.. [1] B. Rosenberg, "Random coefficients models", Annals of Economic and Social Measurement 2 (1973) 399, and
   P. de Jong, "The diffuse Kalman filter", Annals of Statistics 19 (1991) 1073: the augmented filter.
.. [2] D. A. Harville, "Maximum likelihood approaches to variance component estimation", JASA 72 (1977) 320: the
   likelihood of the contrasts that no coefficient enters.
.. [3] A. Bjorck, "Iterative refinement of linear least squares solutions", BIT 7 (1967) 257.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite import _kernels
from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, StateSpace, White
from allanite.plain_files.counted import plural
from allanite.recording.records import Sampling

__all__ = ["LEVEL", "RANK", "Regression", "Whitener", "covariance_of", "regress"]

Array = NDArray[np.float64]

LEVEL = "level"
"""Name of the column of ones: bias and whatever else is constant."""

#: Correlation times of flicker are this ratio apart: Allan variance within 0.01 %.
FLICKER_RATIO = math.sqrt(10)
#: Whitened columns of unit length whose combination is shorter than this cannot be told apart in float64.
RANK = 1e-9
#: Part of a coefficient in such a combination from which the coefficient is unbounded.
TOUCHED = 1e-6
_REFINEMENTS = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Regression:
    """Generalised least squares.

    Attributes
    ----------
    names : tuple of str
    coefficients : ndarray, shape (k,)
        NaN where unbounded.
    covariance : ndarray, shape (k, k)
        Under the noise model; infinite on the diagonal where unbounded.
    unbounded : tuple of str
        Coefficients that the design cannot tell apart.
    condition : float
        Longest over shortest combination of the whitened columns, each of unit length. Digits lost in the solution:
        its logarithm; beyond 1/`RANK` the columns are not told apart.
    residuals : ndarray, shape (n,)
        Whitened: independent, of variance one, if the model holds; NaN where y is missing.
    chi2, dof : float, int
        Sum of their squares, and its expectation.
    log_likelihood : float or None
        Of the contrasts that no coefficient enters [2]; None where a coefficient is unbounded. Columns scaled by c
        shift it by ln c: compare it between noise models, not between designs.
    running : ndarray, shape (n_checkpoints, 2, k)
        Coefficients and standard deviations from the rows before each checkpoint; NaN and infinity while unbounded.
    """

    names: tuple[str, ...]
    coefficients: Array
    covariance: Array
    unbounded: tuple[str, ...]
    condition: float
    residuals: Array
    chi2: float
    dof: int
    log_likelihood: float | None
    running: Array

    @property
    def sd(self) -> Array:
        """Standard deviations, shape (k,)."""
        return np.sqrt(np.diag(self.covariance))

    def __getitem__(self, name: str) -> tuple[float, float]:
        """Coefficient and its standard deviation."""
        try:
            i = self.names.index(name)
        except ValueError:
            raise InputError(f"no coefficient {name!r}; there are: {', '.join(self.names)}") from None
        return float(self.coefficients[i]), float(self.sd[i])


@dataclass(frozen=True, slots=True, kw_only=True)
class Whitener:
    """The linear map that turns noise of a model into independent numbers of variance one.

    Attributes
    ----------
    space : StateSpace
        Of the noise alone.
    noise : ndarray, shape (n,)
        Variance of the white part of each row; NaN where the row is missing.
    """

    space: StateSpace
    noise: Array

    @classmethod
    def of(
        cls,
        model: NoiseModel,
        *,
        dt: float,
        counts: ArrayLike,
        sampling: Sampling = "mean",
    ) -> Whitener:
        """The whitener of rows at interval dt.

        Parameters
        ----------
        model : NoiseModel
        dt : float [s]
            Interval of the rows.
        counts : array_like, shape (n,)
            Part of each row's interval that was measured, 0 to 1; 0: the row is missing. The white noise of a row
            has the variance N^2/(dt count); the slow terms are taken as means over the whole interval.
        sampling : "mean" or "point"

        Raises
        ------
        InputError
            Counts outside 0 to 1, or a model without noise in a sample.
        """
        part = np.asarray(counts, dtype=np.float64)
        if part.ndim != 1 or not np.all((part >= 0) & (part <= 1)):
            raise InputError("counts must be a row of numbers from 0 (missing) to 1 (whole)")
        space = model.state_space(dt, sampling=sampling, record=max(len(part), 1) * dt, ratio=FLICKER_RATIO)
        white = sum(t.N**2 for t in model.terms if isinstance(t, White)) / dt
        if not (space.noise > 0 or np.trace(space.initial) > 0):
            raise InputError(
                "the noise model has no noise in a sample: give it at least N, or a stationary term"
            )
        with np.errstate(divide="ignore", invalid="ignore"):
            noise = np.where(part > 0, space.noise - white + white / part, np.nan)
        return cls(space=space, noise=noise)

    def __call__(self, columns: ArrayLike) -> tuple[Array, float]:
        """Whitened columns, shape (n, c), NaN in missing rows; and the sum of the logarithms of the variances."""
        table = np.ascontiguousarray(columns, dtype=np.float64)
        out = np.empty_like(table)
        state = np.zeros((self.space.size, table.shape[1]))
        logs = _kernels.whiten(
            self.space.transition,
            self.space.process,
            self.space.output,
            self.noise,
            self.space.initial.copy(),
            state,
            table,
            out,
        )
        return out, float(logs)


def regress(
    y: ArrayLike,
    columns: ArrayLike,
    model: NoiseModel,
    *,
    dt: float,
    names: Sequence[str],
    counts: ArrayLike | None = None,
    sampling: Sampling = "mean",
    checkpoints: Sequence[int] = (),
) -> Regression:
    """Coefficients of known columns in noise of a known model, with their covariance.

    Parameters
    ----------
    y : array_like, shape (n,)
        NaN: missing.
    columns : array_like, shape (n, k)
        Means over each row's interval where `sampling` is "mean". A row in which any column is NaN is missing.
    model : NoiseModel
        In the unit of y.
    dt : float [s]
        Interval of the rows.
    names : sequence of str
        One for each column.
    counts : array_like, shape (n,), optional
        Part of each row's interval that was measured (see `Whitener.of`).
    sampling : "mean" or "point"
    checkpoints : sequence of int
        Row numbers at which the running estimate is wanted: that from all rows before.

    Raises
    ------
    InputError
        Shapes that do not fit, a column that is infinite, fewer rows than columns.
    """
    table = np.column_stack([np.asarray(columns, dtype=np.float64), np.asarray(y, dtype=np.float64)])
    k = table.shape[1] - 1
    if len(names) != k:
        raise InputError(f"{k} columns, but {len(names)} names")
    if np.isinf(table).any():
        raise InputError("columns and samples must be finite; a missing sample is NaN")
    part = np.ones(len(table)) if counts is None else np.asarray(counts, dtype=np.float64)
    part = np.where(np.isnan(table).any(axis=1), 0.0, part)
    if np.count_nonzero(part) < k:
        raise InputError(
            f"{plural(int(np.count_nonzero(part)), 'row')} cannot determine {plural(k, 'coefficient')}"
        )
    whitener = Whitener.of(model, dt=dt, counts=part, sampling=sampling)
    white, logs = whitener(np.nan_to_num(table))
    return _solve(white[:, :k], white[:, k], tuple(names), logs, checkpoints)


def covariance_of(
    columns: ArrayLike,
    model: NoiseModel,
    *,
    dt: float,
    counts: ArrayLike | None = None,
    sampling: Sampling = "mean",
) -> Array:
    """Covariance that `regress` would state, without a single sample: shape (k, k), infinite where unbounded."""
    table = np.asarray(columns, dtype=np.float64)
    part = np.ones(len(table)) if counts is None else np.asarray(counts, dtype=np.float64)
    white, _ = Whitener.of(model, dt=dt, counts=part, sampling=sampling)(table)
    return _decompose(white[~np.isnan(white[:, 0])]).covariance


@dataclass(frozen=True, slots=True, kw_only=True)
class _Design:
    """Whitened columns, each of unit length, by their singular values; the short directions are left out."""

    condition: float
    lengths: Array
    values: Array
    right: Array
    touched: NDArray[np.bool_]

    @property
    def covariance(self) -> Array:
        half = self.right.T / self.values / self.lengths[:, None]
        covariance = half @ half.T
        covariance[self.touched] = covariance[:, self.touched] = np.nan
        covariance[self.touched, self.touched] = np.inf
        return np.asarray(covariance)


def _decompose(white: Array) -> _Design:
    lengths = np.linalg.norm(white, axis=0)
    lengths = np.where(lengths > 0, lengths, 1.0)
    _, values, right = np.linalg.svd(white / lengths, full_matrices=False)
    keep = values > RANK
    touched = (np.abs(right[~keep]) > TOUCHED).any(axis=0)
    return _Design(
        condition=float(values[0] / values[-1]) if len(values) and values[-1] > 0 else math.inf,
        lengths=lengths,
        values=values[keep],
        right=right[keep],
        touched=touched,
    )


def _solve(
    columns: Array, y: Array, names: tuple[str, ...], logs: float, checkpoints: Sequence[int]
) -> Regression:
    present = ~np.isnan(y)
    design = _decompose(columns[present])
    coefficients, left = _refined(design, columns[present], y[present])
    residuals = np.full(len(y), np.nan)
    residuals[present] = left
    chi2, dof = float(np.nansum(residuals**2)), int(present.sum() - len(design.values))
    unbounded = tuple(name for name, touched in zip(names, design.touched, strict=True) if touched)
    likelihood = None
    if not unbounded:
        information = 2 * float(np.log(design.values).sum() + np.log(design.lengths).sum())
        likelihood = -0.5 * (dof * math.log(2 * math.pi) + logs + information + chi2)
    return Regression(
        names=names,
        coefficients=np.where(design.touched, np.nan, coefficients),
        covariance=design.covariance,
        unbounded=unbounded,
        condition=design.condition,
        residuals=residuals,
        chi2=chi2,
        dof=dof,
        log_likelihood=likelihood,
        running=_running(np.nan_to_num(columns), np.nan_to_num(y), design.lengths, checkpoints),
    )


def _refined(design: _Design, columns: Array, y: Array) -> tuple[Array, Array]:
    """Coefficients and residuals, with the residuals' own products with the columns taken in extended precision [3].

    Noise that is large beside what a coefficient adds costs it digits by the square of the condition; this returns
    them (where the machine has a longer float than float64).
    """
    wide, coefficients = columns.astype(np.longdouble), np.zeros(columns.shape[1])
    residuals = y.astype(np.longdouble)
    for _ in range(_REFINEMENTS + 1):
        inside = np.asarray(wide.T @ residuals / design.lengths, dtype=np.float64)
        coefficients += design.right.T @ (design.right @ inside / design.values**2) / design.lengths
        residuals = y - wide @ coefficients
    return coefficients, residuals.astype(np.float64)


def _running(columns: Array, y: Array, lengths: Array, checkpoints: Sequence[int]) -> Array:
    """Estimates from the rows before each checkpoint, from sums of products that grow from one to the next."""
    k = columns.shape[1]
    table = np.column_stack([columns / lengths, y])
    out = np.full((len(checkpoints), 2, k), np.nan)
    products, done = np.zeros((k + 1, k + 1)), 0
    for i, stop in enumerate(checkpoints):
        part = table[done:stop]
        products, done = products + part.T @ part, max(done, stop)
        sizes = np.sqrt(np.diag(products)[:k])
        scale = np.where(sizes > 0, sizes, 1.0)
        values, vectors = np.linalg.eigh(products[:k, :k] / np.outer(scale, scale))
        if values[0] <= RANK:
            out[i, 1] = np.inf
            continue
        inverse = (vectors / values) @ vectors.T / np.outer(scale, scale)
        out[i, 0] = inverse @ products[:k, k] / lengths
        out[i, 1] = np.sqrt(np.diag(inverse)) / lengths
    return out
