# SPDX-License-Identifier: BSD-3-Clause
"""The two candidate families: flicker or one Gauss-Markov term between the white noise and the random walk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.instrument import FLOOR, of_floor
from allanite.fitting.objective import CurveData, CurveSolution, distance, solve
from allanite.fitting.sets import CERTAIN, coefficient_set, critical_value, fisher_sd, time_set

__all__ = ["FLICKER", "GAUSS_MARKOV", "CurveFamilyFit", "Family", "fit_family"]

Array = NDArray[np.float64]

FLICKER = ("Q", "N", "B", "K", "R")
GAUSS_MARKOV = ("Q", "N", "G", "K", "R")
_SCAN = 4.0  # ratio of the correlation times tried first
_FIRST = 16.0  # shortest correlation time [samples]
_FLAT = 1e-3
_NEEDED = 6.0  # loss by leaving out all unsupported terms (95 % point for two) that calls one of them back


@dataclass(frozen=True, slots=True)
class Family:
    """A curve seen through one family: answers "the best fit with these coefficients fixed"."""

    curve: CurveData
    symbols: tuple[str, ...]

    @property
    def sensor(self) -> tuple[str, ...]:
        """The terms that are asked for: not those of the instrument."""
        return tuple(s for s in self.symbols if not of_floor(s))

    @property
    def times(self) -> tuple[float, float]:
        """Shortest and longest correlation time considered [samples].

        A bias that forgets itself within some samples is a matter of the sensor's bandwidth, and one that outlasts
        the record is a random walk.
        """
        return max(_FIRST, 2.0 * float(self.curve.design.lags[0])), float(self.curve.design.n_samples / 2)

    def __call__(
        self, fixed: Mapping[str, float], near: CurveSolution | None = None, T: float | None = None
    ) -> CurveSolution:
        start = None if near is None else near.c
        if "G" not in self.symbols:
            return solve(self.curve, self.symbols, fixed=fixed, start=start)
        if T is not None or fixed.get("G") == 0.0:
            return solve(
                self.curve, self.symbols, T=T or _time_of(near, self.times), fixed=fixed, start=start
            )
        if near is not None and near.T is not None:
            return self._refine(fixed, near, 0.15)
        return self._scan(fixed)

    def _scan(self, fixed: Mapping[str, float]) -> CurveSolution:
        """A coarse grid of correlation times, each fit beginning where its neighbour ended; the best is refined."""
        shortest, longest = self.times
        grid = np.geomspace(shortest, longest, int(np.log(longest / shortest) / np.log(_SCAN)) + 2)
        solutions: list[CurveSolution] = []
        for t in grid:
            start = solutions[-1].c if solutions else None
            solutions.append(solve(self.curve, self.symbols, T=float(t), fixed=fixed, start=start))
        best = min(solutions, key=lambda s: s.value)
        fresh = solve(self.curve, self.symbols, T=best.T, fixed=fixed)
        return self._refine(fixed, min((best, fresh), key=lambda s: s.value), float(np.log(_SCAN)) / 2)

    def _refine(self, fixed: Mapping[str, float], near: CurveSolution, step: float) -> CurveSolution:
        """Minimum over log T: walk downhill in steps, then the vertex of a parabola, twice."""
        shortest, longest = (float(np.log(t)) for t in self.times)
        known: dict[float, CurveSolution] = {}

        def at(x: float) -> float:
            x = min(max(x, shortest), longest)
            if x not in known:
                start = min(known.values(), key=lambda s: s.value).c if known else near.c
                known[x] = solve(self.curve, self.symbols, T=float(np.exp(x)), fixed=fixed, start=start)
            return known[x].value

        x = float(np.log(near.T or 1.0))
        for _ in range(20):
            left, here, right = at(x - step), at(x), at(x + step)
            if here <= min(left, right):
                bend = left - 2 * here + right
                if not 0 < bend < np.inf or step < 0.03:
                    break
                vertex = x + step * (left - right) / (2 * bend)
                x = vertex if at(vertex) < here else x
                step /= 4
            elif min(left, right) > here - _FLAT or not shortest < x < longest:
                step /= 2
                if step < 0.03:
                    break
                x = x - step if left < right else x + step
            else:
                x = max(x - step, shortest) if left < right else min(x + step, longest)
        return min(known.values(), key=lambda s: s.value)


def _time_of(near: CurveSolution | None, times: tuple[float, float]) -> float:
    return near.T if near is not None and near.T is not None else (times[0] * times[1]) ** 0.5


@dataclass(frozen=True, slots=True)
class CurveFamilyFit:
    """One family's fit: best solution, what is supported, and every parameter's set.

    Attributes
    ----------
    best : CurveSolution
        Of the full family.
    selected : CurveSolution
        Of the supported terms alone: the point estimates.
    supported : frozenset of str
    sets : dict of str to (float, float)
        Variance coefficients; "T" in samples.
    """

    family: Family
    best: CurveSolution
    selected: CurveSolution
    supported: frozenset[str]
    sets: dict[str, tuple[float, float]]


def fit_family(family: Family, best: CurveSolution, confidence: float) -> CurveFamilyFit:
    """Support, sets and point estimates of a family whose best fit is known."""
    symbols = family.sensor
    sd = fisher_sd(family.curve, best)
    rough = frozenset(
        s
        for s in symbols
        if best.coefficient(s) > 0 and (sd.get(s, 1.0) < CERTAIN or _excludes_zero(family, best, s, 3.84))
    )
    sets: dict[str, tuple[float, float]] = {}
    for s in symbols:
        critical = critical_value(family.curve, best, s, rough, confidence)
        sets[s] = coefficient_set(family.curve, family, best, s, critical)
    supported = frozenset(s for s in symbols if sets[s][0] > 0)
    if "G" in supported and best.T is not None:
        critical = critical_value(family.curve, best, "T", supported, confidence)
        sets["T"] = time_set(family.curve, family, best, critical, *family.times)
    return CurveFamilyFit(family, best, _selected(family, best, supported), supported, sets)


def _excludes_zero(family: Family, best: CurveSolution, symbol: str, critical: float) -> bool:
    null = family({symbol: 0.0}, best if symbol == "G" else None)
    return distance(family.curve, null, best.T) > critical


def _selected(family: Family, best: CurveSolution, supported: frozenset[str]) -> CurveSolution:
    """The supported terms, and as many more as the curve needs though none of them is resolved by itself.

    A ramp that is not supported is none of these: noise stands in for it, since a trend that the record does not show
    would rule every drift and every simulated twin of the model.
    """
    if "R" in family.symbols and "R" not in supported and best.coefficient("R") > 0:
        best = family({"R": 0.0}, best)
    chosen = set(supported) | (set(family.symbols) & set(FLOOR))
    fit = _only(family, best, chosen)
    while fit.value - best.value > _NEEDED:
        rest = [s for s in family.symbols if s not in chosen and best.coefficient(s) > 0]
        if not rest:
            break
        tried = {s: _only(family, best, chosen | {s}) for s in rest}
        symbol = min(rest, key=lambda s: tried[s].value)
        chosen.add(symbol)
        fit = tried[symbol]
    return fit


def _only(family: Family, best: CurveSolution, chosen: set[str]) -> CurveSolution:
    absent = {s: 0.0 for s in family.symbols if s not in chosen}
    if len(absent) == len(family.symbols):
        return replace(best, value=np.inf)
    return (
        family(absent, best) if "G" in chosen else solve(family.curve, family.symbols, T=best.T, fixed=absent)
    )
