# SPDX-License-Identifier: BSD-3-Clause
"""The scheme that reaches the goals first.

Positions are added one by one, each the candidate after which the sum of squares of sd/goal is least; every beginning
of that sequence, with the dwell that it needs, is a scheme, and the shortest wins. Then positions are exchanged for
others one by one, and dwells made unequal, as long as that shortens it [1].

References
----------
.. [1] V. V. Fedorov, "Theory of Optimal Experiments", Academic Press (1972): the exchange algorithm.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.position_planning.prediction import Forecast, PlannedUnit
from allanite.experiments.position_planning.schemes import attitudes_along
from allanite.lazy_dataclasses import dataclass

__all__ = ["Draft", "dwell_for", "found_scheme", "nearest_dwell", "score", "worst_of"]

Array = NDArray[np.float64]
Progress = Callable[[float], None]

#: Longest dwell [s].
LONGEST = 3600.0
#: Dwell at which positions are chosen, relative to the longest that fits: the order hardly depends on it.
TRIAL = 30.0
#: Dwells whose largest sd/goal is within this factor of the least come as near to the goals.
NEAR = 1.02
#: A change must shorten the record by this part to be made.
WORTH = 0.01
#: Factors by which single dwells are tried.
STRETCH = (0.5, 0.7, 1.4, 2.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """Positions with their dwells; `attitudes` of a scheme whose way is prescribed."""

    ups: Array
    shares: Array  # dwells relative to their mean
    attitudes: Array | None = None

    @property
    def n(self) -> int:
        """Number of positions."""
        return len(self.shares)

    @property
    def way(self) -> Array:
        """Attitudes in order."""
        return attitudes_along(self.ups) if self.attitudes is None else self.attitudes

    def forecast(self, unit: PlannedUnit, dwell: float) -> Forecast:
        """At this mean dwell [s]."""
        return unit.forecast(self.way, np.maximum(dwell * self.shares, 1 / unit.rate).tolist())

    def total(self, unit: PlannedUnit, dwell: float) -> float:
        """Length of the record [s]."""
        return self.n * dwell + (self.n - 1) * unit.turn


def worst_of(forecast: Forecast, goals: Array) -> float:
    """Largest standard deviation over its goal."""
    return float((forecast.sd / goals).max())


def score(forecast: Forecast, goals: Array) -> float:
    """Sum of squares of standard deviations over their goals."""
    return float(((forecast.sd / goals) ** 2).sum())


def dwell_for(unit: PlannedUnit, draft: Draft, goals: Array) -> float:
    """Least mean dwell with which the goals are reached [s]; infinite where no dwell up to an hour does it.

    Dwells are doubled until one does: with noise that wanders too long a rest is as bad as too short a one.
    """
    way = replace(draft, attitudes=draft.way)
    last = 0.0
    for dwell in _dwells(unit, draft):
        if worst_of(way.forecast(unit, dwell), goals) <= 1:
            return _between(unit, way, goals, last, dwell)
        last = dwell
    return math.inf


def _between(unit: PlannedUnit, draft: Draft, goals: Array, low: float, high: float) -> float:
    """The least dwell that reaches the goals; `high` does, `low` does not, or is zero: nothing shorter is allowed."""
    while low > 0 and high > 1.02 * low:
        middle = math.sqrt(low * high)
        reached = worst_of(draft.forecast(unit, middle), goals) <= 1
        low, high = (low, middle) if reached else (middle, high)
    return high


def nearest_dwell(unit: PlannedUnit, draft: Draft, goals: Array) -> float:
    """Mean dwell that comes nearest to goals that are out of reach: the shortest that is within 2 % of the best [s]."""
    way = replace(draft, attitudes=draft.way)
    dwells = _dwells(unit, draft)
    worst = [worst_of(way.forecast(unit, d), goals) for d in dwells]
    return next(d for d, w in zip(dwells, worst, strict=True) if w <= NEAR * min(worst))


def _dwells(unit: PlannedUnit, draft: Draft) -> list[float]:
    """Mean dwells that are tried, from the shortest on."""
    shortest = unit.shortest / float(draft.shares.min())
    count = max(math.ceil(math.log2(LONGEST / shortest)), 0) + 1
    return [min(shortest * 2**i, max(LONGEST, shortest)) for i in range(count)]


def found_scheme(
    unit: PlannedUnit, goals: Array, candidates: Array, *, most: int, time: float | None, progress: Progress
) -> Draft:
    """Positions and relative dwells.

    Parameters
    ----------
    goals : ndarray, shape (k,)
        Of all parameters; infinite for those that nobody asked for.
    candidates : ndarray, shape (c, 3)
    most : int
        Positions.
    time : float or None [s]
        Length of the record; None: as long as the goals need.
    """
    trial = TRIAL if time is None else max(time / most - unit.turn, unit.shortest)
    whole = _greedy(unit, goals, candidates, most, trial, progress)
    drafts = [Draft(ups=whole[:n], shares=np.ones(n)) for n in range(1, len(whole) + 1)]
    best = min(drafts, key=lambda d: _cost(unit, d, goals, time))
    progress(0.6)
    best = _exchanged(unit, best, goals, candidates, time, lambda part: progress(0.6 + 0.25 * part))
    best = _stretched(unit, best, goals, time)
    progress(1.0)
    return best


def _cost(unit: PlannedUnit, draft: Draft, goals: Array, time: float | None) -> float:
    """What is to be small: the length of the record, or how far from the goals it stays in a given time.

    Where the goals are out of reach, schemes that come nearest to them go first, all behind those that reach them.
    """
    if time is not None:
        dwell = (time - (draft.n - 1) * unit.turn) / draft.n
        return math.inf if dwell < unit.shortest else worst_of(draft.forecast(unit, dwell), goals)
    dwell = dwell_for(unit, draft, goals)
    if math.isfinite(dwell):
        return draft.total(unit, dwell)
    return 1e9 * worst_of(draft.forecast(unit, nearest_dwell(unit, draft, goals)), goals)


def _greedy(
    unit: PlannedUnit, goals: Array, candidates: Array, most: int, dwell: float, progress: Progress
) -> Array:
    """Directions in the order in which they help most; flat on the table first."""
    chosen = [candidates[int(np.argmax(candidates[:, 2]))]]
    while len(chosen) < most:
        others = [c for c in candidates if float(c @ chosen[-1]) < 1 - 1e-9]
        drafts = [Draft(ups=np.stack([*chosen, c]), shares=np.ones(len(chosen) + 1)) for c in others]
        chosen.append(others[int(np.argmin([score(d.forecast(unit, dwell), goals) for d in drafts]))])
        progress(0.5 * len(chosen) / most)
    return np.stack(chosen)


def _exchanged(
    unit: PlannedUnit, draft: Draft, goals: Array, candidates: Array, time: float | None, progress: Progress
) -> Draft:
    """Each position but the first for the candidate that is best in its place; without it, where that is as good."""
    dwell = _dwell(unit, draft, goals, time)
    for i in range(1, draft.n):
        ways = [c for c in candidates if _fits(draft.ups, i, c)]
        tried = [
            replace(draft, ups=np.concatenate([draft.ups[:i], c[None], draft.ups[i + 1 :]])) for c in ways
        ]
        if tried:
            better = min(tried, key=lambda d: score(d.forecast(unit, dwell), goals))
            draft = _nearer(unit, draft, better, goals, dwell)
        progress(i / draft.n)
    cost = _cost(unit, draft, goals, time)
    for i in reversed(range(1, draft.n)):
        fewer = Draft(ups=np.delete(draft.ups, i, axis=0), shares=np.delete(draft.shares, i))
        if fewer.n > 1 and _distinct(fewer.ups):
            new = _cost(unit, fewer, goals, time)
            if new < (1 - WORTH) * cost:
                draft, cost = fewer, new
    return draft


def _stretched(unit: PlannedUnit, draft: Draft, goals: Array, time: float | None) -> Draft:
    """Longer and shorter dwells where that helps, the time of all of them kept."""
    dwell = _dwell(unit, draft, goals, time)
    for i in range(draft.n):
        for factor in STRETCH:
            shares = draft.shares.copy()
            shares[i] *= factor
            if dwell * shares.min() / shares.mean() < unit.shortest * (1 - 1e-9):
                continue
            draft = _nearer(unit, draft, replace(draft, shares=shares / shares.mean()), goals, dwell)
    return draft


def _dwell(unit: PlannedUnit, draft: Draft, goals: Array, time: float | None) -> float:
    if time is not None:
        return (time - (draft.n - 1) * unit.turn) / draft.n
    dwell = dwell_for(unit, draft, goals)
    return dwell if math.isfinite(dwell) else nearest_dwell(unit, draft, goals)


def _nearer(unit: PlannedUnit, draft: Draft, other: Draft, goals: Array, dwell: float) -> Draft:
    """The other one, if it comes nearer to the goals in the same time."""
    old, new = (worst_of(d.forecast(unit, dwell), goals) for d in (draft, other))
    return other if new < (1 - WORTH) * old else draft


def _fits(ups: Array, i: int, candidate: Array) -> bool:
    """Another position than that before, that after, and that which it stands for."""
    near = ups[max(i - 1, 0) : i + 2]
    return bool((near @ candidate < 1 - 1e-9).all())


def _distinct(ups: Array) -> bool:
    return bool(((ups[1:] * ups[:-1]).sum(axis=1) < 1 - 1e-9).all())
