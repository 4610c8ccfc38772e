# SPDX-License-Identifier: BSD-3-Clause
"""One candidate family by its likelihood: best fit, every parameter's set, what is supported, point estimates.

The rules are those of the fit of the curve (`fitting.families`): sets by test inversion in the full family, in which
terms that are not supported stay as nuisances that are not negative; point estimates from the supported terms alone.
"""

from __future__ import annotations

from dataclasses import dataclass

from allanite.fitting.likelihood.maximum import Peak
from allanite.fitting.likelihood.problem import LikelihoodProblem
from allanite.fitting.likelihood.profile import (
    coefficient_set,
    critical_value,
    relative_sd,
    slope_critical_value,
    slope_set,
    time_set,
)

__all__ = ["FLICKER", "GAUSS_MARKOV", "FamilyFit", "fit_family"]

FLICKER = ("Q", "N", "B", "K")
GAUSS_MARKOV = ("Q", "N", "G", "K")
_CERTAIN = 0.03  # relative standard deviation of a coefficient whose set cannot reach zero
_NEEDED = 6.0  # loss by leaving out all unsupported terms (95 % point for two) that calls one of them back


@dataclass(frozen=True, slots=True, kw_only=True)
class FamilyFit:
    """A family's fit.

    Attributes
    ----------
    letters : tuple of str
        Random terms.
    best : Peak
        Of the full family with a ramp.
    selected : Peak
        Of the terms that are supported: the point estimates.
    ramp : bool
        Whether `selected` has one.
    sets : dict of str to (float, float)
        Variance coefficients by letter; "T" in samples; "R" the slope, signed.
    supported : frozenset of str
    """

    letters: tuple[str, ...]
    best: Peak
    selected: Peak
    ramp: bool
    sets: dict[str, tuple[float, float]]
    supported: frozenset[str]


def fit_family(
    problem: LikelihoodProblem, letters: tuple[str, ...], best: Peak, confidence: float
) -> FamilyFit:
    """Sets, support and point estimates of a family whose best fit (with a ramp) is known."""
    search = problem.search
    loss = {s: _Without(problem, letters, s, best) for s in letters}
    sd = relative_sd(best)
    free = frozenset(
        i
        for i, s in enumerate(letters)
        if i in sd and (sd[i] < _CERTAIN or 2 * (best.log_likelihood - loss[s]().log_likelihood) > 3.84)
    )
    sets: dict[str, tuple[float, float]] = {}
    for i, s in enumerate(letters):
        critical = critical_value(best, i, free, confidence)
        sets[s] = coefficient_set(search, best, i, critical, loss[s])
    supported = {s for s in letters if sets[s][0] > 0}
    if "G" in supported:
        place = len(letters)
        critical = critical_value(best, place, frozenset(letters.index(s) for s in supported), confidence)
        sets["T"] = time_set(search, best, letters.index("G"), critical)
    sets["R"] = slope_set(search, best, slope_critical_value(search, best, confidence))
    if sets["R"][0] > 0 or sets["R"][1] < 0:
        supported.add("R")
    selected = _selected(problem, letters, best, supported)
    return FamilyFit(
        letters=letters,
        best=best,
        selected=selected,
        ramp="R" in supported,
        sets=sets,
        supported=frozenset(supported),
    )


class _Without:
    """The best fit of a family without one of its terms, found when first asked for."""

    def __init__(self, problem: LikelihoodProblem, letters: tuple[str, ...], symbol: str, best: Peak) -> None:
        self._ask = problem, tuple(s for s in letters if s != symbol), best
        self._found: Peak | None = None

    def __call__(self) -> Peak:
        if self._found is None:
            problem, letters, best = self._ask
            self._found = problem.peak(letters, slope=None, near=best)
        return self._found


def _selected(problem: LikelihoodProblem, letters: tuple[str, ...], best: Peak, supported: set[str]) -> Peak:
    """The supported terms, and as many more as the record needs though none of them is resolved by itself."""
    slope = None if "R" in supported else 0.0
    chosen = [s for s in letters if s in supported]
    fit = problem.peak(chosen, slope=slope, near=best) if chosen else None
    while fit is None or 2 * (best.log_likelihood - fit.log_likelihood) > _NEEDED:
        rest = [s for s in letters if s not in chosen and best.coefficient(s) > 0]
        if not rest:
            break
        tried = {
            s: problem.peak([t for t in letters if t in (*chosen, s)], slope=slope, near=best) for s in rest
        }
        symbol = max(rest, key=lambda s: tried[s].log_likelihood)
        chosen = [t for t in letters if t in (*chosen, symbol)]
        fit = tried[symbol]
    return best if fit is None else fit
