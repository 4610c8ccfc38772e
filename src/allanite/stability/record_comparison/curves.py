# SPDX-License-Identifier: BSD-3-Clause
"""Are the Allan curves the same? Lag by lag, and all lags together with their full covariance.

What is compared is the ratio of each curve to the pooled model, so that rates, lengths and sampling conventions may
differ; the model need not fit, because what it misses it misses in all records alike. With the cube roots z of
`fitting.objective`, nearly normal with the exact covariance C_r of the curve of record r,

    Q = min over beta of  sum_r (z_r - beta)' C_r^-1 (z_r - beta),                                         (1)

beta one value for each lag: chi-square with (values - lags) degrees of freedom. Neighbouring lags, correlated at 0.5 to
0.85, so do not count twice. Where the lags of a record lie between those of the others, z is interpolated in the
logarithm of the lag, and its covariance with it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.objective import CurveSolution
from allanite.lazy_dataclasses import dataclass
from allanite.stability.record_comparison.null_law import ScaledChiSquare
from allanite.stability.record_comparison.pooled import JointDesign, seen_by
from allanite.stability.record_comparison.series import FittedChannel

__all__ = ["CurveTest", "Ratio", "compared", "ratios"]

Array = NDArray[np.float64]

_SAME = 1e-6  # relative difference of lags that are the same


@dataclass(frozen=True, slots=True, kw_only=True)
class Ratio:
    """One curve over the pooled model, on the lags of the comparison.

    Attributes
    ----------
    tau : ndarray, shape (n,) [s]
        Lags of the comparison that this record reaches.
    z : ndarray, shape (n,)
        Cube root of the ratio, less its expectation.
    covariance : ndarray, shape (n, n)
    """

    tau: Array
    z: Array
    covariance: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class CurveTest:
    """The test of the curves.

    Attributes
    ----------
    tau : ndarray, shape (n_lags,) [s]
        Lags that two records or more reach.
    statistic : float
        Q of eq. (1), with `dof` degrees of freedom.
    p : float
    lag_p : ndarray, shape (n_lags,)
        Of each lag by itself.
    lag_p_adjusted : ndarray, shape (n_lags,)
        For the number of lags (Holm).
    records : tuple of (float, float, float)
        Of each record: by how much Q falls without it, how many degrees of freedom, and p; not adjusted.
    rest : tuple of float
        p of the others without that record.
    """

    tau: Array
    statistic: float
    dof: float
    p: float
    lag_p: Array
    lag_p_adjusted: Array
    records: tuple[tuple[float, float, float], ...]
    rest: tuple[float, ...]


def ratios(design: JointDesign, pooled: CurveSolution) -> list[Ratio]:
    """Every curve over the pooled model, on the lags of the record whose lags are farthest apart."""
    series = design.series
    taus = [s.curve.tau[s.fit.used] for s in series]
    grid = max(taus, key=lambda t: float(np.median(np.diff(np.log(t)))))
    return [_ratio(s, seen_by(design, i, pooled), grid) for i, s in enumerate(series)]


def _ratio(series: FittedChannel, null: CurveSolution, grid: Array) -> Ratio:
    data = series.fit.data
    if null.weight is None:
        return Ratio(tau=grid[:0], z=grid[:0], covariance=np.zeros((0, 0)))
    mu = data.design.columns(null.symbols, null.times) @ null.c
    z = np.cbrt(data.variance / mu) - null.weight.centre
    (block,) = null.weight.blocks
    factor = np.linalg.inv(block)
    rows, kept = _rows(np.log(series.curve.tau[series.fit.used]), np.log(grid))
    return Ratio(tau=grid[kept], z=rows @ z, covariance=rows @ (factor @ factor.T) @ rows.T)


def _rows(lags: Array, grid: Array) -> tuple[Array, NDArray[np.int64]]:
    """Linear interpolation from `lags` to the lags of the grid inside it, and which those are.

    Two lags of the grid between the same two neighbours would say the same twice: the second is left out.
    """
    rows, kept, before = [], [], -1.0
    for j, x in enumerate(grid):
        near = int(np.argmin(np.abs(lags - x)))
        row = np.zeros(len(lags))
        if abs(lags[near] - x) < _SAME:
            row[near], place = 1.0, float(near)
        elif lags[0] < x < lags[-1]:
            i = int(np.searchsorted(lags, x)) - 1
            part = (x - lags[i]) / (lags[i + 1] - lags[i])
            row[i], row[i + 1], place = 1 - part, part, i + 0.5
        else:
            continue
        if place - before >= 0.75:
            rows.append(row)
            kept.append(j)
            before = place
    return np.array(rows).reshape(-1, len(lags)), np.array(kept, dtype=np.int64)


def compared(parts: Sequence[Ratio]) -> CurveTest:
    """The test of eq. (1), each lag by itself, and each record against the others."""
    tau = _shared_lags(parts)
    sums = _Sums.of(parts)
    statistic, dof = sums.test()
    single = np.array([_one_lag(parts, t) for t in tau])
    records, rest = [], []
    for i in range(len(parts)):
        q, d = sums.test(without=i)
        gain, lost = max(statistic - q, 0.0), dof - d
        records.append((gain, lost, ScaledChiSquare(dof=lost).tail(gain)))
        rest.append(ScaledChiSquare(dof=d).tail(q))
    return CurveTest(
        tau=tau,
        statistic=statistic,
        dof=dof,
        p=ScaledChiSquare(dof=dof).tail(statistic),
        lag_p=single,
        lag_p_adjusted=holm(single),
        records=tuple(records),
        rest=tuple(rest),
    )


def _shared_lags(parts: Sequence[Ratio]) -> Array:
    every = np.concatenate([p.tau for p in parts])
    tau, counts = np.unique(every, return_counts=True)
    return np.asarray(tau[counts > 1])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sums:
    """The sums over records that Q is made of, and what each record adds to them.

    Attributes
    ----------
    information : ndarray, shape (n_lags, n_lags)
    pull : ndarray, shape (n_lags,)
    square : float
    added : list of (ndarray of int64, ndarray, ndarray, float)
        Of each record: its lags, and what it adds there.
    """

    information: Array
    pull: Array
    square: float
    added: list[tuple[NDArray[np.int64], Array, Array, float]]

    @classmethod
    def of(cls, parts: Sequence[Ratio]) -> _Sums:
        lags = np.unique(np.concatenate([p.tau for p in parts]))
        information, pull, square, added = np.zeros((len(lags),) * 2), np.zeros(len(lags)), 0.0, []
        for part in parts:
            at = np.searchsorted(lags, part.tau).astype(np.int64)
            inverse: Array = np.linalg.inv(part.covariance).astype(np.float64)
            drawn = inverse @ part.z
            information[np.ix_(at, at)] += inverse
            pull[at] += drawn
            square += float(part.z @ drawn)
            added.append((at, inverse, drawn, float(part.z @ drawn)))
        return cls(information=information, pull=pull, square=square, added=added)

    def test(self, without: int | None = None) -> tuple[float, float]:
        """Q and its degrees of freedom, of all records or of all but one."""
        information, pull, square = self.information.copy(), self.pull.copy(), self.square
        counts = np.zeros(len(pull), dtype=np.int64)
        for at, *_ in self.added:
            counts[at] += 1
        if without is not None:
            at, inverse, drawn, alone = self.added[without]
            information[np.ix_(at, at)] -= inverse
            pull[at] -= drawn
            square -= alone
            counts[at] -= 1
        kept = counts > 0
        if not kept.any():
            return 0.0, 0.0
        solved = np.linalg.solve(information[np.ix_(kept, kept)], pull[kept])
        return max(square - float(pull[kept] @ solved), 0.0), float(counts.sum() - kept.sum())


def _one_lag(parts: Sequence[Ratio], tau: float) -> float:
    z, variance = [], []
    for p in parts:
        places = np.flatnonzero(p.tau == tau)
        if len(places):
            z.append(p.z[places[0]])
            variance.append(p.covariance[places[0], places[0]])
    weight = 1 / np.array(variance)
    middle = float(weight @ z) / float(weight.sum())
    q = float(weight @ (np.array(z) - middle) ** 2)
    return ScaledChiSquare(dof=len(z) - 1.0).tail(q)


def holm(p: Array) -> Array:
    """Adjusted p values of several tests, whatever their dependence (Holm 1979)."""
    order = np.argsort(p)
    steps = np.maximum.accumulate(p[order] * (len(p) - np.arange(len(p)))) if len(p) else p
    out = np.empty(len(p))
    out[order] = np.minimum(steps, 1.0)
    return out
