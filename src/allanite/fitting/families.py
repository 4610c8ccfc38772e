# SPDX-License-Identifier: BSD-3-Clause
"""The candidate families: flicker, or one or two Gauss-Markov terms, between the white noise and the random walk."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.design import MARKOV, SHORTEST_TIME, TIME_OF, Times
from allanite.fitting.instrument import FLOOR, of_floor
from allanite.fitting.inversion import CERTAIN
from allanite.fitting.joined_sets import joined_sets
from allanite.fitting.objective import CurveData, CurveSolution, distance, solve
from allanite.fitting.sets import coefficient_set, critical_value, fisher_sd, time_set
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_quantile

__all__ = [
    "FLICKER",
    "GAUSS_MARKOV",
    "TWO_GAUSS_MARKOV",
    "CurveFamilyFit",
    "Family",
    "fit_family",
    "flicker_limit",
]

Array = NDArray[np.float64]
Ends = tuple[float, float]

FLICKER = ("Q", "N", "B", "K", "R")
GAUSS_MARKOV = ("Q", "N", "G", "K", "R")
#: Where one Gauss-Markov term does not explain a curve: two, down to correlation times of one sample.
TWO_GAUSS_MARKOV = ("Q", "N", "G", "G2", "K", "R")
_SCAN, _SCAN_OF_TWO = 4.0, 10.0  # ratio of the correlation times tried first
_NEEDED = 6.0  # loss by leaving out all unsupported terms (95 % point for two) that calls one of them back


@dataclass(frozen=True, slots=True)
class Family:
    """A curve seen through one family: answers "the best fit with these coefficients fixed".

    Attributes
    ----------
    shortest : float [samples]
        Shortest correlation time considered.
    """

    curve: CurveData
    symbols: tuple[str, ...]
    shortest: float = SHORTEST_TIME

    @property
    def sensor(self) -> tuple[str, ...]:
        """The terms that are asked for: not those of the instrument."""
        return tuple(s for s in self.symbols if not of_floor(s))

    @property
    def markov(self) -> tuple[str, ...]:
        """The Gauss-Markov terms, the quicker one first."""
        return tuple(s for s in MARKOV if s in self.symbols)

    @property
    def times(self) -> tuple[float, float]:
        """Shortest and longest correlation time considered [samples].

        A bias that outlasts the record is a random walk.
        """
        first = int(self.curve.design.lags[0])
        return max(self.shortest, 2.0 * first if first > 1 else 1.0), self.curve.design.n_samples / 2

    def __call__(
        self,
        fixed: Mapping[str, float],
        near: CurveSolution | None = None,
        held: Mapping[str, float] | None = None,
    ) -> CurveSolution:
        """The best fit with these coefficients fixed, and the correlation times of some Gauss-Markov terms held.

        Parameters
        ----------
        near : CurveSolution, optional
            Where to begin; all correlation times are tried without it.
        held : mapping of str to float [samples], optional
        """
        if not self.markov:
            return solve(self.curve, self.symbols, fixed=fixed, start=None if near is None else near.c)
        if near is None:
            return self._scan(fixed)
        return self._nearest(fixed, near, held or {})

    def _scan(self, fixed: Mapping[str, float]) -> CurveSolution:
        """A coarse grid of correlation times, each fit beginning where its neighbor ended; the best move on."""
        begun: list[CurveSolution] = []
        for times in self._grid([s for s in self.markov if fixed.get(s) != 0.0]):
            start = begun[-1].c if begun else None
            begun.append(solve(self.curve, self.symbols, times=times, fixed=fixed, start=start))
        best = min(begun, key=lambda s: s.value)
        return self._best([*begun, solve(self.curve, self.symbols, times=best.times, fixed=fixed)], fixed)

    def _best(self, begun: Sequence[CurveSolution], fixed: Mapping[str, float]) -> CurveSolution:
        """The lowest minimum near the best of these; with several correlation times there may be several."""
        few = sorted(begun, key=lambda s: s.value)[: 2 * len(self.markov) - 1]
        return min((self._nearest(fixed, at, {}) for at in few), key=lambda s: s.value)

    def _grid(self, moving: Sequence[str]) -> Iterator[Times]:
        """Correlation times to begin with; those of terms that are not there do not matter."""
        shortest, longest = self.times
        ratio = _SCAN if len(moving) < 2 else _SCAN_OF_TWO
        grid = np.geomspace(shortest, longest, int(math.log(longest / shortest) / math.log(ratio)) + 2)
        for chosen in itertools.combinations(grid.tolist(), len(moving)):
            named = dict(zip(moving, chosen, strict=True))
            yield tuple(named.get(s, math.sqrt(shortest * longest)) for s in self.markov)

    def _nearest(
        self, fixed: Mapping[str, float], near: CurveSolution, held: Mapping[str, float]
    ) -> CurveSolution:
        """The minimum over coefficients and correlation times that is nearest to another solution."""
        times = tuple(held.get(s, T) for s, T in zip(self.markov, near.times, strict=True))
        ends = [(held[s], held[s]) if s in held else self.times for s in self.markov]
        return solve(self.curve, self.symbols, times=times, within=ends, fixed=fixed, start=near.c)

    def above(self, nested: CurveSolution) -> CurveSolution:
        """The best fit, which is no worse than this one of a family with fewer terms."""
        start = np.array([nested.coefficient(s) for s in self.symbols])
        known = len(nested.times)
        begun = [
            solve(self.curve, self.symbols, times=(*nested.times, *times[known:]), start=start)
            for times in self._grid(self.markov[known:])
        ]
        return self._ordered(min((self._best(begun, {}), self._scan({})), key=lambda s: s.value))

    def _ordered(self, at: CurveSolution) -> CurveSolution:
        """The quicker Gauss-Markov term first."""
        if [*at.times] == sorted(at.times):
            return at
        c, (i, j) = at.c.copy(), (self.symbols.index(s) for s in self.markov)
        c[[i, j]] = c[[j, i]]
        return replace(at, c=c, times=at.times[::-1])


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
        Variance coefficients; "T" in samples. Each holds the point estimate.
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
    for s in (s for s in family.markov if s in supported):
        critical = critical_value(family.curve, best, TIME_OF[s], supported, confidence)
        sets[TIME_OF[s]] = time_set(family.curve, family, best, s, critical, family.times)
    chosen = _selected(family, best, supported)
    return CurveFamilyFit(family, best, chosen, supported, _joined(family, chosen, sets, confidence))


def flicker_limit(fit: CurveFamilyFit, confidence: float) -> float:
    """Upper end of the set of flicker beside the terms of a family without it, as a variance coefficient."""
    last = max(fit.family.symbols.index(s) for s in fit.family.markov) + 1
    symbols = (*fit.family.symbols[:last], "B", *fit.family.symbols[last:])
    family = Family(fit.family.curve, symbols, fit.family.shortest)
    best = family.above(fit.best)
    critical = critical_value(family.curve, best, "B", fit.supported, confidence)
    return coefficient_set(family.curve, family, best, "B", critical)[1]


def _excludes_zero(family: Family, best: CurveSolution, symbol: str, critical: float) -> bool:
    null = family({symbol: 0.0}, best if family.markov == (symbol,) else None)
    return distance(family.curve, null, best.times) > critical


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


def _joined(
    family: Family, chosen: CurveSolution, sets: Mapping[str, Ends], confidence: float
) -> dict[str, Ends]:
    """The sets, each joined with that of the chosen terms where it leaves out their value."""
    kept = [s for s in family.symbols if chosen.coefficient(s) > 0 or of_floor(s)]
    named = dict(
        zip([s for s in kept if s in MARKOV], MARKOV, strict=False)
    )  # of two, the slower one is left
    symbols = tuple(named.get(s, s) for s in kept)
    times = {s: T for s, T in zip(family.markov, chosen.times, strict=True) if s in named}
    c = np.array([chosen.coefficient(s) for s in kept])
    alone, fewer = (
        replace(chosen, symbols=symbols, c=c, times=tuple(times.values())),
        replace(family, symbols=symbols),
    )
    critical = chi_square_quantile(confidence, 1)

    def of_chosen(key: str) -> Ends:
        term = next((s for s, T in TIME_OF.items() if T == key), None)
        if term is None:
            return coefficient_set(family.curve, fewer, alone, named.get(key, key), critical)
        return time_set(family.curve, fewer, alone, named[term], critical, family.times)

    values = {s: chosen.coefficient(s) for s in kept} | {TIME_OF[s]: T for s, T in times.items()}
    return joined_sets(sets, values, of_chosen)


def _only(family: Family, best: CurveSolution, chosen: set[str]) -> CurveSolution:
    absent = {s: 0.0 for s in family.symbols if s not in chosen}
    if len(absent) == len(family.symbols):
        return replace(best, value=np.inf)
    return family(absent, best)
