# SPDX-License-Identifier: BSD-3-Clause
"""What to do when no sum of noise terms explains a spectrum.

A long record knows its density to 0.1 % where a sensor's filter or its vibration bends it by 1 %. Two remedies, in
this order, both said in the result, as for a curve: the highest frequencies are left out, until the rest is explained;
if that does not help, every ordinate gets a relative model error, as small as makes the misfit what chance would give.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from allanite.errors import FitError
from allanite.fitting.spectral.ordinates import Ordinates
from allanite.fitting.spectral.whittle import WhittleProblem, WhittleSolution
from allanite.quantities.distributions import chi_square_tail

__all__ = ["Explained", "best_explained", "chance"]

#: As for a curve: a true model is treated as wrong once in ten thousand records.
_NOT_EXPLAINED, _EXPLAINED = 1e-4, 1e-2
_STEP = math.sqrt(2)  # of the highest frequency
_SHARE = 0.5  # of the decades of the spectrum that may be left out
_FEWEST = 12  # ordinates that must be left
_WORST = 0.4  # a larger error describes nothing
_BISECTIONS = 7

#: Problems of one choice of ordinates with their minima.
Explained = list[tuple[WhittleProblem, WhittleSolution]]


def chance(problem: WhittleProblem, at: WhittleSolution) -> float:
    """Probability of a larger misfit if the model is true."""
    free = sum(c > 0 for c in at.c) + sum(at.c[g] > 0 for g in problem.markov)
    return chi_square_tail(problem.chi2(at), max(len(problem.data.value) - int(free), 1))


def best_explained(data: Ordinates, candidates: Sequence[tuple[str, ...]]) -> Explained:
    """The best fit of each sum of terms to all ordinates if one explains them, else to fewer, else with an error.

    Raises
    ------
    FitError
        None of them explains the spectrum even to a large error.
    """
    whole = _solved(data, candidates)
    if _best(whole) >= _NOT_EXPLAINED:
        return whole
    highest, lowest = float(data.frequency.max()), float(data.frequency.min())
    top = highest / _STEP
    while top > highest * (lowest / highest) ** _SHARE:
        fewer = data.below(top)
        if len(fewer.value) < max(_FEWEST, len(data.contrast) + 1):
            break
        trial = _solved(fewer, candidates)
        if _best(trial) >= _EXPLAINED:
            return trial
        top /= _STEP
    return _with_discrepancy(data, candidates)


def _solved(data: Ordinates, candidates: Sequence[tuple[str, ...]]) -> Explained:
    problems = (WhittleProblem(data=data, letters=letters) for letters in candidates)
    return [(p, p.best()) for p in problems]


def _best(explained: Explained) -> float:
    return max(chance(problem, at) for problem, at in explained)


def _with_discrepancy(data: Ordinates, candidates: Sequence[tuple[str, ...]]) -> Explained:
    low, high = math.log(1e-3), math.log(_WORST)
    best = _solved(replace(data, discrepancy=_WORST), candidates)
    if _best(best) < _NOT_EXPLAINED:
        raise FitError(
            f"no sum of noise terms explains the spectrum to {_WORST:.0%}: the record is not the noise of "
            "a sensor at rest; check the findings, the spectrum and the time series"
        )
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        trial = _solved(replace(data, discrepancy=math.exp(middle)), candidates)
        if _best(trial) >= 0.5:
            high, best = middle, trial
        else:
            low = middle
    return best
