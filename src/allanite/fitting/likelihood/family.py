# SPDX-License-Identifier: BSD-3-Clause
"""A sum of terms by its likelihood: best fit, every parameter's set, what is supported, point estimates.

The rules are those of the fit of the curve (`fitting.families`): sets by test inversion in the full sum, in which
terms that are not supported stay as nuisances that are not negative; point estimates from the supported terms alone.
Parameters are named by their place in the gradient: coefficients, then the correlation times of Gauss-Markov terms.
"""

from __future__ import annotations

import math
from dataclasses import replace

from allanite.fitting.joined_sets import joined_sets
from allanite.fitting.likelihood.maximum import Peak
from allanite.fitting.likelihood.problem import LikelihoodProblem
from allanite.fitting.likelihood.profile import (
    coefficient_set,
    critical_value,
    relative_sd,
    slope_set,
    time_set,
)
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_quantile

__all__ = [
    "FLICKER",
    "GAUSS_MARKOV",
    "TWO_GAUSS_MARKOV",
    "LikelihoodFamilyFit",
    "fit_family",
    "flicker_limit",
]

FLICKER = ("Q", "N", "B", "K")
GAUSS_MARKOV = ("Q", "N", "G", "K")
TWO_GAUSS_MARKOV = ("Q", "N", "G", "G", "K")
_CERTAIN = 0.03  # relative standard deviation of a coefficient whose set cannot reach zero
_NEEDED = 6.0  # loss by leaving out all unsupported terms (95 % point for two) that calls one of them back


@dataclass(frozen=True, slots=True, kw_only=True)
class LikelihoodFamilyFit:
    """The fit of a sum of terms.

    Attributes
    ----------
    letters : tuple of str
        Random terms.
    best : Peak
        Of all of them, averaged over the slopes of a ramp where there may be one.
    selected : Peak
        The point estimates: the terms that are supported, or all that were given.
    sets : dict of int to (float, float)
        Variance coefficients, and correlation times [samples] of supported terms, by place. Each holds the point
        estimate.
    supported : frozenset of int
        Places of letters.
    slope : (float, float) or None
        Set of the slope of a ramp, with its sign; None: there is none.
    """

    letters: tuple[str, ...]
    best: Peak
    selected: Peak
    sets: dict[int, tuple[float, float]]
    supported: frozenset[int]
    slope: tuple[float, float] | None

    @property
    def ramp(self) -> bool:
        """Whether a ramp is supported."""
        return self.slope is not None and (self.slope[0] > 0 or self.slope[1] < 0)

    def supports(self, symbol: str) -> bool:
        """Whether every term with this letter is supported."""
        return all(i in self.supported for i, s in enumerate(self.letters) if s == symbol)


def fit_family(
    problem: LikelihoodProblem,
    letters: tuple[str, ...],
    best: Peak,
    confidence: float,
    *,
    ramp: bool = True,
    keep: bool = False,
) -> LikelihoodFamilyFit:
    """Sets, support and point estimates of a sum of terms whose best fit is known.

    Parameters
    ----------
    best : Peak
        Averaged over slopes if there may be a `ramp`, else with none.
    keep : bool
        All terms are taken as given, and stay in the point estimates.
    """
    search = problem.search
    without = [_FitWithoutTerm(problem, letters, i, best) for i in range(len(letters))]
    sd = relative_sd(best)
    free = frozenset(
        i
        for i in range(len(letters))
        if i in sd and (sd[i] < _CERTAIN or 2 * (best.log_likelihood - without[i]().log_likelihood) > 3.84)
    )
    sets: dict[int, tuple[float, float]] = {}
    for i in range(len(letters)):
        critical = critical_value(best, i, free, confidence)
        sets[i] = coefficient_set(search, best, i, critical, without[i])
    supported = frozenset(i for i in range(len(letters)) if sets[i][0] > 0)
    timed = [i for i, s in enumerate(letters) if s == "G"]
    for place, i in enumerate(timed, start=len(letters)):
        if i in supported:
            critical = critical_value(best, place, supported, confidence)
            sets[place] = time_set(search, best, i, critical)
    slope = _slope_set(problem, letters, best, supported, confidence) if ramp else None
    known = LikelihoodFamilyFit(
        letters=letters, best=best, selected=best, sets=sets, supported=supported, slope=slope
    )
    return known if keep else _selected(problem, known, confidence)


def flicker_limit(problem: LikelihoodProblem, fit: LikelihoodFamilyFit, confidence: float) -> float:
    """Upper end of the set of flicker beside the terms of a sum without it, as a variance coefficient."""
    at = fit.best.at
    best = problem.peak((*fit.letters, "B"), slope=at.slope, averaged=at.averaged, nested=[fit.best])
    place = best.place("B")
    critical = critical_value(best, place, fit.supported, confidence)
    return coefficient_set(problem.search, best, place, critical, lambda: fit.best)[1]


def _slope_set(
    problem: LikelihoodProblem,
    letters: tuple[str, ...],
    best: Peak,
    supported: frozenset[int],
    confidence: float,
) -> tuple[float, float]:
    """The wider of two intervals: with all terms, and with the supported ones alone.

    A term that is not there takes some of the noise that slopes are judged by from one that is.
    """
    sets = [slope_set(problem.search, best, confidence)]
    if 0 < len(supported) < len(letters):
        chosen = [letters[i] for i in sorted(supported)]
        alone = problem.peak(chosen, slope=None, averaged=True, near=best)
        sets.append(slope_set(problem.search, alone, confidence))
    return max(sets, key=lambda ends: ends[1] - ends[0])


class _FitWithoutTerm:
    """The best fit without one of the terms, found when first asked for."""

    def __init__(self, problem: LikelihoodProblem, letters: tuple[str, ...], place: int, best: Peak) -> None:
        self._ask = problem, letters[:place] + letters[place + 1 :], best
        self._found: Peak | None = None

    def __call__(self) -> Peak:
        if self._found is None:
            problem, letters, best = self._ask
            at = best.at
            if letters:
                self._found = problem.peak(letters, slope=at.slope, averaged=at.averaged, near=best)
            else:  # without any noise no record is possible
                self._found = replace(best, value=replace(best.value, log_likelihood=-math.inf))
        return self._found


def _selected(problem: LikelihoodProblem, fit: LikelihoodFamilyFit, confidence: float) -> LikelihoodFamilyFit:
    """The supported terms, and as many more as the record needs though none of them is resolved by itself."""
    best = fit.best if fit.ramp else problem.search.climb(replace(fit.best.at, slope=0.0, averaged=False))

    def of(places: list[int]) -> Peak:
        letters = [fit.letters[i] for i in sorted(places)]
        return problem.peak(letters, slope=best.at.slope, averaged=best.at.averaged, near=best)

    chosen = sorted(fit.supported)
    peak = of(chosen) if chosen else None
    while peak is None or 2 * (best.log_likelihood - peak.log_likelihood) > _NEEDED:
        rest = [i for i in range(len(fit.letters)) if i not in chosen and best.at.c[i] > 0]
        if not rest:
            break
        tried = {i: of([*chosen, i]) for i in rest}
        added = max(rest, key=lambda i: tried[i].log_likelihood)
        chosen, peak = [*chosen, added], tried[added]
    if peak is None:
        return fit
    return replace(fit, selected=peak, sets=_joined(problem, fit, peak, sorted(chosen), confidence))


def _joined(
    problem: LikelihoodProblem, fit: LikelihoodFamilyFit, chosen: Peak, places: list[int], confidence: float
) -> dict[int, tuple[float, float]]:
    """The sets, each joined with that of the chosen terms where it leaves out their value.

    Parameters
    ----------
    places : list of int
        Of the chosen terms, in their order.
    """
    n, at = len(fit.letters), chosen.at
    critical = chi_square_quantile(confidence, 1)
    timed = [i for i, s in enumerate(fit.letters) if s == "G"]
    values = {i: float(c) for i, c in zip(places, at.c, strict=True) if c > 0}
    term_of = {n + timed.index(i): i for i in timed if i in values}
    values |= {place: at.components[places.index(i)].T or 0.0 for place, i in term_of.items()}

    def of_chosen(place: int) -> tuple[float, float]:
        i = places.index(term_of.get(place, place))
        if place in term_of:
            return time_set(problem.search, chosen, i, critical)
        rest = tuple(fit.letters[p] for p in places)
        return coefficient_set(problem.search, chosen, i, critical, _FitWithoutTerm(problem, rest, i, chosen))

    return joined_sets(fit.sets, values, of_chosen)
