# SPDX-License-Identifier: BSD-3-Clause
"""One noise model for several records of different length, rate and sampling.

The curves stand below one another as one long curve, and the records are independent: its covariance is block
diagonal. With the coefficients of the first record (sample units, scaled to order one) those of record r are

    c_r = c (v_0/v_r) (dt_0/dt_r)^(2 p),      T_r = T dt_0/dt_r,                                           (1)

v being the variance unit and p the power of time of a symbol (`fitting.design.TIME_POWER`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.design import MARKOV, TIME_POWER, CurveDesign, Times
from allanite.fitting.families import Family
from allanite.fitting.objective import CurveData, CurveSolution, distance, solve
from allanite.lazy_dataclasses import dataclass
from allanite.noise import GaussMarkov, NoiseModel, TermType, term_of
from allanite.stability.record_comparison.series import FittedChannel

__all__ = ["JointDesign", "model_of", "pooled_fit", "seen_by"]

Array = NDArray[np.float64]

#: Terms that a comparison does without where nothing shows them.
_RARE = ("Q", "R")
#: Loss without a term from which on all records together show it, or a single one among several.
_SHOWN, _SHOWN_BY_ONE = 3.84, 6.63


@dataclass(slots=True)
class JointDesign(CurveDesign):
    """Columns and covariance of several records, for the coefficients of the first."""

    series: Sequence[FittedChannel] = ()
    _factors: dict[tuple[int, str], float] = field(default_factory=dict)

    @classmethod
    def of(cls, series: Sequence[FittedChannel]) -> JointDesign:
        """The design of these records together."""
        first = series[0]
        design = first.fit.data.design
        length = max(s.duration for s in series) / first.curve.dt
        return cls(
            lags=design.lags,
            n_samples=round(length),
            sampling=design.sampling,
            pairs=design.pairs,
            series=series,
        )

    def factor(self, i: int, symbol: str) -> float:
        """Coefficient of record i over that of the first, where both have the same noise (eq. 1)."""
        if (i, symbol) not in self._factors:
            a, b = self.series[0], self.series[i]
            ratio = (a.curve.dt / b.curve.dt) ** (2 * TIME_POWER[symbol])
            self._factors[i, symbol] = a.fit.scale / b.fit.scale * ratio
        return self._factors[i, symbol]

    def times(self, i: int, times: Times) -> Times:
        """Correlation times in samples of record i."""
        return tuple(T * self.series[0].curve.dt / self.series[i].curve.dt for T in times)

    def column(self, symbol: str, times: Times = ()) -> Array:
        """AVAR of the unit process at the lags of all records, shape (n_all_lags,)."""
        if symbol in MARKOV:
            return self.markov(times[MARKOV.index(symbol)])[0]
        if symbol not in self._columns:
            parts = [
                s.fit.data.design.column(symbol) * self.factor(i, symbol) for i, s in enumerate(self.series)
            ]
            self._columns[symbol] = np.concatenate(parts)
        return self._columns[symbol]

    def markov(self, T: float) -> tuple[Array, Array]:
        """Gauss-Markov noise at the lags of all records, shape (n_all_lags,) each."""
        kinds = {
            kind: np.array(s.fit.data.design.markov(self.times(i, (T,))[0])) for i, kind, s in self._first()
        }
        parts = [kinds[_kind(s)] * self.factor(i, "G") for i, s in enumerate(self.series)]
        column, slope = np.concatenate(parts, axis=1)
        return column, slope

    def relative_covariances(
        self, symbols: Sequence[str], c: Array, times: Times, mean: Array
    ) -> list[Array]:
        """A block for each record; one for all records of one kind, whose noise differs by a scale alone."""
        stops = np.cumsum([len(s.fit.data.variance) for s in self.series])
        kinds = {}
        for i, kind, s in self._first():
            factors = np.array([value * self.factor(i, name) for name, value in zip(symbols, c, strict=True)])
            there = mean[stops[i] - len(s.fit.data.variance) : stops[i]]
            design = s.fit.data.design
            (kinds[kind],) = design.relative_covariances(symbols, factors, self.times(i, times), there)
        return [kinds[_kind(s)] for s in self.series]

    def _first(self) -> Iterator[tuple[int, tuple[object, float], FittedChannel]]:
        """Place and kind of the first record of each kind."""
        known = set()
        for i, s in enumerate(self.series):
            if _kind(s) not in known:
                known.add(_kind(s))
                yield i, _kind(s), s


def _kind(series: FittedChannel) -> tuple[object, float]:
    """Records of one kind have the same lags, length, sampling and rate, and no gaps."""
    design = series.fit.data.design
    return design.kind or id(design), series.curve.dt


def pooled_fit(
    series: Sequence[FittedChannel], symbols: tuple[str, ...]
) -> tuple[JointDesign, CurveSolution]:
    """The best single model of a family for all records, and with it the terms that they are compared by.

    Without quantisation and ramp, unless all records together or one of them show it: a term that may only add and is
    not there takes a little from its neighbours in every record, by chance to one side. N would come out low by 0.4
    standard deviations of one record, which the mean of ten records does not forgive.
    """
    design = JointDesign.of(series)
    variance = np.concatenate([s.fit.data.variance for s in series])
    curve = CurveData(variance, design, max(s.fit.data.discrepancy for s in series))
    best = Family(curve, symbols)({})
    for symbol in (s for s in _RARE if s in symbols):
        kept = best.symbols
        shown = _loss_without(Family(curve, kept), best, symbol) > _SHOWN or any(
            _loss_without(Family(s.fit.data, kept), s.best(kept), symbol) > _SHOWN_BY_ONE for s in series
        )
        if not shown:
            best = Family(curve, tuple(s for s in kept if s != symbol))({})
    return design, best


def _loss_without(family: Family, best: CurveSolution, symbol: str) -> float:
    if best.coefficient(symbol) <= 0:
        return 0.0
    return distance(family.curve, family({symbol: 0.0}, best), best.times)


def seen_by(design: JointDesign, i: int, pooled: CurveSolution) -> CurveSolution:
    """The pooled model as a solution of record i: its coefficients there, and the weights that they give."""
    fixed = {s: pooled.coefficient(s) * design.factor(i, s) for s in pooled.symbols}
    return solve(design.series[i].fit.data, pooled.symbols, times=design.times(i, pooled.times), fixed=fixed)


def model_of(series: FittedChannel, at: CurveSolution) -> NoiseModel:
    """A solution of one record as a noise model in SI."""
    dt, scale = series.curve.dt, series.fit.scale
    terms: list[TermType] = []
    for symbol, c in zip(at.symbols, at.c, strict=True):
        if c <= 0:
            continue
        value = float(np.sqrt(c * scale)) * dt ** TIME_POWER[symbol]
        made = (
            GaussMarkov.from_sigma(value, (at.T or 1.0) * dt)
            if symbol == "G"
            else term_of(symbol, value, dt=dt)
        )
        terms.append(made)
    return NoiseModel(terms=tuple(terms), kind=series.kind.value, unit=series.unit)
