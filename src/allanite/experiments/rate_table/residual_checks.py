# SPDX-License-Identifier: BSD-3-Clause
"""What the residuals say: the noise by rate, hysteresis, a scale factor that changes, a temperature, a clock."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_table.checks import TableCheck
from allanite.experiments.rate_table.motion import RateSteps
from allanite.experiments.rate_table.record.fit import TableSolution, design
from allanite.experiments.rate_table.record.rows import (
    ABSOLUTE,
    CONSTANCY,
    DIRECTION,
    LOOP,
    POWERS,
    RATE,
    RegressionRows,
    power,
)
from allanite.experiments.rate_table.results import NoiseAtRate
from allanite.experiments.rate_table.verdict import TableCheckKind
from allanite.filtering.regression import Regression
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, White
from allanite.quantities.distributions import chi_square_tail
from allanite.quantities.residual_tests import ALARM, FOREIGN, alarm, scatter_check, size_check

__all__ = [
    "agreement_checks",
    "noise_by_rate",
    "noise_checks",
    "regression_checks",
    "trust_by_rate",
]

Array = NDArray[np.float64]

#: Groups of rates of a record whose rate changes all the time; most rates of steps that are looked at one by one.
GROUPS, MANY = 8, 200
#: Usual and least differences of a group.
LEAST, FEW = 10, 3
#: Part of the signal that a fit may leave where the table is that of the record.
STRANGE = 0.01


def noise_by_rate(solution: TableSolution, model: NoiseModel) -> tuple[NoiseAtRate, ...]:
    """Differences of neighbouring blocks against the model, by rate: blind to whatever is slow."""
    rows = solution.rows
    left = rows.mean - solution.predicted()
    early, late = _pairs(rows)
    step = left[late] - left[early]
    white = sum(t.N**2 for t in model.terms if isinstance(t, White)) / rows.dt
    partly = white * (1 / rows.part[early] + 1 / rows.part[late] - 2)
    variance = 2 * float(model.avar_sampled(1, rows.dt, rows.sampling)) + partly
    rate = rows.full_scale * np.abs(rows.column(RATE)[early] + rows.column(RATE)[late]) / 2
    group, sizes = _groups(rows, rate)
    counts = np.bincount(group, minlength=len(sizes))
    chosen = np.flatnonzero(counts >= min(LEAST, max(counts.max(initial=0), FEW))).tolist()
    out = []
    for g in chosen:
        members = group == g
        chi2, dof = float((step[members] ** 2 / variance[members]).sum()), int(members.sum())
        p = min(chi_square_tail(chi2, dof) * len(chosen), 1.0)
        out.append(NoiseAtRate(rate=float(sizes[g]), ratio=math.sqrt(chi2 / dof), chi2=chi2, dof=dof, p=p))
    return tuple(out)


def _pairs(rows: RegressionRows) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Neighbouring blocks of one stretch, each block in one pair only."""
    early = np.arange(0, len(rows.part) - 1, 2)
    together = (rows.span[early] == rows.span[early + 1]) & (rows.span[early] >= 0)
    enough = np.minimum(rows.part[early], rows.part[early + 1]) > 0
    early = early[together & enough]
    return early, early + 1


def _groups(rows: RegressionRows, rate: Array) -> tuple[NDArray[np.int64], Array]:
    """Which group a pair is of, and the rate of each group: the rates of the table, or ranges of them, one at least."""
    rounded = np.round(rate / rows.full_scale, 9)
    distinct, group = np.unique(rounded, return_inverse=True)
    if len(distinct) <= min(max(len(rate) // LEAST, 1), MANY):
        return group.ravel(), distinct * rows.full_scale
    count = min(max(len(rate) // LEAST, 1), GROUPS)
    edges = np.quantile(rate, np.linspace(0, 1, count + 1)[1:-1])
    group = np.searchsorted(edges, rate)
    return group, np.array([rate[group == g].mean() if (group == g).any() else 0.0 for g in range(count)])


def noise_checks(by_rate: Sequence[NoiseAtRate]) -> tuple[TableCheck, ...]:
    """Size of the noise at the smallest rate; and whether it grows with the rate."""
    if not by_rate:
        return ()
    rest, *others = sorted(by_rate, key=lambda n: n.rate)
    checks = [TableCheck.of(TableCheckKind.SIZE, size_check(rest.chi2, rest.dof))]
    if others:
        base = max(rest.ratio, 1.0) ** 2
        worst = min(others, key=lambda n: chi_square_tail(n.chi2 / base, n.dof))
        test = alarm("noise", worst.chi2 / base, worst.dof, looks=len(others))
        checks.append(TableCheck.of(TableCheckKind.BY_RATE, test, rate=worst.rate, value=worst.ratio))
    return tuple(checks)


def trust_by_rate(rows: RegressionRows, by_rate: Sequence[NoiseAtRate]) -> Array | None:
    """Weight of the white noise of each block; None where the noise does not depend on the rate."""
    checks = noise_checks(by_rate)
    if len(checks) < 2 or checks[1].passed:
        return None
    base = max(min(by_rate, key=lambda n: n.rate).ratio, 1.0)
    rates = np.array([n.rate for n in by_rate])
    ratio = np.array([max(n.ratio / base, 1.0) if n.p < ALARM else 1.0 for n in by_rate])
    block_rates = rows.full_scale * np.abs(rows.column(RATE))
    nearest = np.argmin(np.abs(block_rates[:, None] - rates[None, :]), axis=1)
    return np.asarray(1 / ratio[nearest] ** 2)


def agreement_checks(solution: TableSolution) -> tuple[TableCheck, ...]:
    """Where far more of the response is left than the noise allows, or than any curvature is, it is another table."""
    rows = solution.rows
    weight, signal, left = (
        rows.part[rows.used],
        rows.mean[rows.used],
        (rows.mean - solution.predicted())[rows.used],
    )
    signal = signal - float(np.average(signal, weights=weight))
    share = math.sqrt(float(weight @ left**2) / max(float(weight @ signal**2), 1e-300))
    chi2, dof = solution.fit.chi2, max(solution.fit.dof, 1)
    if solution.fit.unbounded or share < STRANGE or chi2 < FOREIGN**2 * dof:
        return ()
    kind = TableCheckKind.AGREEMENT
    return (TableCheck(kind=kind, statistic=chi2, dof=dof, p=0.0, passed=False, value=share),)


def regression_checks(
    solution: TableSolution, model: NoiseModel, others: Sequence[str], *, steps: RateSteps | None
) -> tuple[TableCheck, ...]:
    """Columns that should not be there: each is tried beside the fit."""
    trial = _Trial(solution=solution, model=model, others=tuple(others))
    shape = None if steps is not None else _shape(solution, trial)
    chi2, dof, size = trial.loop()
    hysteresis = _alarm(TableCheckKind.HYSTERESIS, chi2, dof, size)
    constancy = _alarm(TableCheckKind.CONSTANCY, *trial.gain((CONSTANCY,)))
    return tuple(c for c in (shape, hysteresis, constancy) if c is not None)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Trial:
    """A fit to which columns are added."""

    solution: TableSolution
    model: NoiseModel
    others: tuple[str, ...]

    def gain(self, names: Sequence[str]) -> tuple[float, int]:
        """Chi-square that these columns take off, and their number; 0 where the design cannot tell them from others."""
        fit = self._with(names)
        return (0.0, 0) if fit.unbounded else (max(self.solution.fit.chi2 - fit.chi2, 0.0), len(names))

    def loop(self) -> tuple[float, int, float]:
        """The same of a hysteresis, and how far the output at rest depends on the direction, over full scale."""
        for names in ((DIRECTION, LOOP), (LOOP,)):
            fit = self._with(names)
            if not fit.unbounded:
                width = 2 * sum(fit[n][0] for n in names) / fit[RATE][0]
                return max(self.solution.fit.chi2 - fit.chi2, 0.0), len(names), abs(width)
        return 0.0, 0, 0.0

    def _with(self, names: Sequence[str]) -> Regression:
        rows = self.solution.rows
        table, fit_names = design(rows, self.solution.shape, self.others)
        more = [rows.straight(n) if n.startswith(RATE + "^") else rows.column(n) for n in names]
        return rows.regress(np.column_stack([table, *more]), (*fit_names, *names), self.model)


def _alarm(kind: TableCheckKind, chi2: float, dof: int, value: float = math.nan) -> TableCheck | None:
    return TableCheck.of(kind, alarm(kind, chi2, dof), value=value) if dof else None


def _shape(solution: TableSolution, trial: _Trial) -> TableCheck | None:
    """Powers above those that were fitted. How far the interval is from holding then, their gain does not say."""
    degree = 2 if solution.shape == (ABSOLUTE,) else len(solution.shape) + 1
    names = [power(k) for k in (degree + 1, degree + 2) if k <= POWERS]
    chi2, dof = trial.gain(names) if names else (0.0, 0)
    if not dof:
        return None
    test = replace(scatter_check("rates", chi2, dof), widens=False)
    return TableCheck.of(TableCheckKind.POWERS, test)
