# SPDX-License-Identifier: BSD-3-Clause
"""The means of the steps: what the fit leaves of them, and whether repeats of a rate agree.

Their covariance under the noise model is that of `allanite.noise.span_means`, a second method beside the regression.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_table.checks import TableCheck
from allanite.experiments.rate_table.motion import RateSteps
from allanite.experiments.rate_table.record.fit import TableSolution
from allanite.experiments.rate_table.record.rows import RATE, TEMPERATURE, WARM_RATE
from allanite.experiments.rate_table.verdict import TableCheckKind
from allanite.filtering.regression import LEVEL
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, White
from allanite.noise.span_means import contrast_whitener, span_covariance
from allanite.quantities.residual_tests import scatter_check
from allanite.recording.records import Sampling

__all__ = ["StepMeans"]

Array = NDArray[np.float64]

#: Most steps that are compared; of more, those in the middle.
MOST = 600
#: Least repeats that say something; rates this close are repeats, over the largest.
REPEATS, SAME = 2, 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class StepMeans:
    """Steps that were used, in order.

    Attributes
    ----------
    number : ndarray of int64, shape (n,)
        Of the step in the table.
    rate : ndarray, shape (n,) [rad/s]
    mean : ndarray, shape (n,) [SI of the channel]
    residual, sd : ndarray, shape (n,) [SI of the channel]
        What the fit leaves, and its standard deviation under the noise model.
    covariance : ndarray, shape (n, n)
        Of the means; it holds for contrasts.
    design : ndarray, shape (n, k)
        Columns of the fit but the level.
    companions : ndarray, shape (n, m)
        Those of them that are not the rate's.
    """

    number: NDArray[np.int64]
    rate: Array
    mean: Array
    residual: Array
    sd: Array
    covariance: Array
    design: Array
    companions: Array

    @classmethod
    def of(
        cls, table: RateSteps, solution: TableSolution, model: NoiseModel, rate: float, sampling: Sampling
    ) -> StepMeans:
        """From the fit; `rate` is that of the samples [Hz]."""
        rows = solution.rows
        number = np.flatnonzero(rows.steps[:, 0] > 0)
        if len(number) > MOST:
            first = (len(number) - MOST) // 2
            number = number[first : first + MOST]
        step_averages = {name: average[number] for name, average in rows.averages.items()}
        count, mean, start, stop = rows.steps[number].T
        covariance = span_covariance(model, start, stop, count, dt=1 / rate, sampling=sampling)
        trust = _trust(solution, number)
        white = sum(t.N**2 for t in model.terms if isinstance(t, White)) * rate
        covariance = covariance + np.diag(white * (1 / trust - 1) / count)
        names = [n for n in solution.fit.names if n != LEVEL]
        design = np.column_stack([_average(solution, step_averages, n) for n in names])
        others = [i for i, n in enumerate(names) if n in (TEMPERATURE, WARM_RATE)]
        residual = mean - solution.predicted(step_averages)
        return cls(
            number=number,
            rate=table.rate[number],
            mean=mean,
            residual=residual,
            sd=_residual_sd(covariance, design),
            covariance=covariance,
            design=design,
            companions=design[:, others],
        )

    @property
    def size(self) -> int:
        """Number of steps."""
        return len(self.mean)

    @property
    def group(self) -> NDArray[np.int64]:
        """Which steps repeat one rate, as closely as a table does; shape (n,)."""
        order = np.argsort(self.rate)
        apart = np.diff(self.rate[order]) > SAME * float(np.abs(self.rate).max())
        out = np.zeros(self.size, dtype=np.int64)
        out[order[1:]] = np.cumsum(apart)
        return out

    def checks(self) -> tuple[TableCheck, ...]:
        """Do repeats of a rate agree, and do the rates lie on the fitted curve?"""
        whole, dof = self._left(self.design)
        if dof < 1:
            return ()
        again = np.eye(self.size)[self.group]  # of residuals, for a table does not quite repeat its rates
        same, repeats = self._left(np.column_stack([again, self.companions]))
        if repeats < REPEATS:
            return (TableCheck.of(TableCheckKind.STEPS, scatter_check("steps", whole, dof)),)
        checks = [TableCheck.of(TableCheckKind.REPEATS, scatter_check("repeats", same, repeats))]
        if dof > repeats:
            test = scatter_check("rates", max(whole - same, 0.0), dof - repeats)
            checks.append(TableCheck.of(TableCheckKind.SHAPE, test))
        return tuple(checks)

    def _left(self, design: Array) -> tuple[float, int]:
        """Chi-square of the residuals about a design and a constant, and its degrees of freedom."""
        if self.size < 3:
            return 0.0, 0
        whitener = contrast_whitener(self.covariance)
        table, y = whitener @ design, whitener @ (self.residual - self.residual.mean())
        size = np.linalg.norm(table, axis=0)
        left, values, _ = np.linalg.svd(table[:, size > 0] / size[size > 0], full_matrices=False)
        left = left[:, values > 1e-9 * values.max(initial=0.0)]
        y = y - left @ (left.T @ y)
        return float(y @ y), self.size - 1 - left.shape[1]


def _trust(solution: TableSolution, number: NDArray[np.int64]) -> Array:
    """Of the blocks of each step."""
    rows = solution.rows
    last = int(number.max(initial=0)) + 1
    used = (rows.span >= 0) & (rows.span < last)
    count = np.bincount(rows.span[used], minlength=last)
    total = np.bincount(rows.span[used], rows.trust[used], last)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), 1.0)[number])


def _average(solution: TableSolution, step_averages: dict[str, Array], name: str) -> Array:
    if name in solution.shape:
        level, slope = solution.rows.line(name)
        return np.asarray(step_averages[name] - level - slope * step_averages[RATE])
    return step_averages[name]


def _residual_sd(covariance: Array, design: Array) -> Array:
    """Of what a least-squares fit with a constant leaves: its rows are contrasts, for which the covariance holds."""
    table = np.column_stack([np.ones(len(design)), design])
    left = np.eye(len(design)) - table @ np.linalg.pinv(table)
    return np.asarray(np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", left, covariance, left), 0.0)))
