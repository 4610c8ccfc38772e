# SPDX-License-Identifier: BSD-3-Clause
"""What a record says of every parameter of a family: profiles in SI, and how they bend near their best values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.design import TIME_POWER
from allanite.fitting.families import Family
from allanite.fitting.inversion import CERTAIN
from allanite.fitting.objective import CurveData, CurveSolution, distance, linearized
from allanite.fitting.sets import critical_value, fisher_sd
from allanite.lazy_dataclasses import dataclass
from allanite.noise import SIGMA_PER_B
from allanite.stability.record_comparison.profiles import Profile, limit, normal_profile, traced
from allanite.stability.record_comparison.series import FittedChannel

__all__ = ["Evidence", "evidence_of"]

Array = NDArray[np.float64]

#: Loss without a term from which on it is taken to be there, for the critical values of the others.
_THERE = 3.84
_SWEEP = 9  # correlation times tried for each value of q


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """One record under one family.

    Attributes
    ----------
    series : FittedChannel
    symbols : tuple of str
        Of the family.
    best : CurveSolution
    profiles : dict of str to Profile
        Logarithm of the SI value; "B_equiv" stands for "G", and "T" and "q" are there where the Gauss-Markov term is
        supported.
    columns : dict of str to ndarray, shape (n_lags,)
        Change of the whitened residuals with each coefficient c (sample units), and with ln T.
    present : frozenset of str
        Symbols whose coefficient is well away from zero.
    """

    series: FittedChannel
    symbols: tuple[str, ...]
    best: CurveSolution
    profiles: dict[str, Profile] = field(repr=False)
    columns: dict[str, Array] = field(repr=False)
    present: frozenset[str]


def evidence_of(
    series: FittedChannel, symbols: tuple[str, ...], confidence: float, *, traced: Sequence[str] | None = None
) -> Evidence:
    """Profiles of the parameters of a sum of these terms, or only of those `traced`."""
    family = Family(series.fit.data, symbols)
    best = series.best(symbols)
    tracer = _Tracer(series, family, best, confidence)
    profiles = {("B_equiv" if s == "G" else s): tracer.coefficient(s) for s in traced or symbols}
    if "B_equiv" in profiles and profiles["B_equiv"].supported:
        profiles["T"] = tracer.time()
        profiles["q"] = tracer.drive()
    return Evidence(
        series=series,
        symbols=symbols,
        best=best,
        profiles=profiles,
        columns=_columns(tracer.data, best, tracer.present),
        present=tracer.present,
    )


class _Tracer:
    """Walks along one parameter after the other, each fit beginning where the last one ended."""

    def __init__(self, series: FittedChannel, family: Family, best: CurveSolution, confidence: float) -> None:
        self.series, self.family, self.best, self.confidence = series, family, best, confidence
        self.data = series.fit.data
        self.sd = fisher_sd(self.data, best)
        self.present = frozenset(s for s in family.symbols if self._there(s))

    def _there(self, symbol: str) -> bool:
        if self.best.coefficient(symbol) <= 0:
            return False
        return self.sd.get(symbol, 1.0) < CERTAIN or self._loss(symbol, 0.0) > _THERE

    def _loss(self, symbol: str, c: float, near: CurveSolution | None = None) -> float:
        start = near or (self.best if symbol == "G" else None)
        return distance(self.data, self.family({symbol: c}, start), self.best.times)

    def coefficient(self, symbol: str) -> Profile:
        """ln of the SI amplitude."""
        shift = 0.5 * math.log(self.series.fit.scale) + TIME_POWER[symbol] * math.log(self.series.curve.dt)
        shift -= math.log(SIGMA_PER_B) if symbol == "G" else 0.0
        critical = critical_value(self.data, self.best, symbol, self.present, self.confidence)
        c, sd = self.best.coefficient(symbol), 0.5 * self.sd.get(symbol, 1.0)
        near = self.best

        def loss(x: float) -> float:
            nonlocal near
            near = self.family({symbol: math.exp(2 * (x - shift))}, near)
            return distance(self.data, near, self.best.times)

        if c <= 0:
            column = self.data.design.column(symbol, self.best.times)
            guess = float(np.min(self.data.variance / column)) * 1e-3
            return limit(loss, 0.5 * math.log(guess) + shift, critical)
        x = 0.5 * math.log(c) + shift
        if sd < CERTAIN / 2:
            return normal_profile(x, sd, critical)
        return traced(loss, x, sd, critical, at_zero=self._loss(symbol, 0.0))

    def time(self) -> Profile:
        """ln T [s]."""
        shift = math.log(self.series.curve.dt)
        near = self.best

        def loss(x: float) -> float:
            nonlocal near
            near = self.family({}, near, {"G": math.exp(x - shift)})
            return distance(self.data, near, self.best.times)

        bounds = tuple(math.log(t) + shift for t in self.family.times)
        x = math.log(self.best.T or 1.0) + shift
        critical = critical_value(self.data, self.best, "T", self.present, self.confidence)
        sd = self.sd.get("T", 1.0)
        return traced(loss, x, sd, critical, at_zero=None, bounds=(bounds[0], bounds[1]))

    def drive(self) -> Profile:
        """ln q, sigma^2 = q^2 T/2, whatever T is."""
        shift = 0.5 * math.log(self.series.fit.scale) - 0.5 * math.log(self.series.curve.dt)
        here = math.log(self.best.T or 1.0)
        low, high = (math.log(t) for t in self.family.times)
        width = 3.0 * min(self.sd.get("T", 1.0), 1.0)
        near = self.best

        def at(x: float, log_time: float) -> float:
            nonlocal near
            T = math.exp(log_time)
            null = self.family({"G": math.exp(2 * (x - shift)) * T / 2}, near, {"G": T})
            near = null if math.isfinite(null.value) else near
            return distance(self.data, null, self.best.times)

        def loss(x: float) -> float:
            times = np.linspace(max(here - width, low), min(here + width, high), _SWEEP)
            values = np.array([at(x, float(t)) for t in times])
            i = int(np.argmin(values))
            if 0 < i < _SWEEP - 1:
                a, b, c = values[i - 1 : i + 2]
                bend = a - 2 * b + c
                return float(b - (a - c) ** 2 / (8 * bend)) if bend > 0 else float(b)
            return float(values[i])

        c = self.best.coefficient("G")
        x = 0.5 * math.log(2 * c / math.exp(here)) + shift
        sd = math.hypot(0.5 * self.sd.get("G", 1.0), 0.5 * self.sd.get("T", 1.0))
        critical = critical_value(self.data, self.best, "G", self.present, self.confidence)
        return traced(loss, x, sd, critical, at_zero=None, bounds=(x - 4.0, x + 4.0))


def _columns(data: CurveData, at: CurveSolution, present: frozenset[str]) -> dict[str, Array]:
    if at.weight is None:
        return {}
    change = linearized(data, at)[0]
    columns = {s: change[:, i] for i, s in enumerate(at.symbols)}
    if at.T is not None and "G" in present:
        columns["T"] = change[:, -1]
    return columns
