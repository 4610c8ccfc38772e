# SPDX-License-Identifier: BSD-3-Clause
"""What could stand in for the slow noise that a curve is said to show?

The families of a fit end in a random walk. Noise of density f^-slope, and a Gauss-Markov term whose correlation time
is long, bend a curve upward as well; where a record does not exclude them, the K that it supports is that of the model,
not of the sensor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from allanite.fitting.design import power_law_symbol, slow_symbol
from allanite.fitting.families import CurveFamilyFit
from allanite.fitting.objective import CurveData, CurveSolution, advantage, solve
from allanite.fitting.sets import coefficient_set

__all__ = ["StandIns", "stand_ins"]

Ends = tuple[float, float]

#: Twice the advantage in log-likelihood of the listed families that excludes a power law: by simulation of power laws
#: less than 1 % of their records reach it.
EXCLUDES_POWER_LAW = 10.0
#: That of a power law over all listed families, from which on it is said to explain the curve better.
PREFERS_POWER_LAW = 10.0
#: Loss in twice the log-likelihood at the ends of the interval of a slope, and of a correlation time (95 %).
_INTERVAL = 3.84
_SLOPES = np.round(np.arange(0.5, 1.51, 0.1), 1)
#: Correlation times of the other Gauss-Markov term that are tried, over that of the last fit.
_FASTER = (0.5, 0.7, 1.0, 1.4, 2.0)
_SHORTEST_SHARE = 512  # of the record, down to which correlation times are tried


@dataclass(frozen=True, slots=True, kw_only=True)
class StandIns:
    """What a curve allows in the place of a random walk.

    Attributes
    ----------
    slopes : (float, float) or None
        Exponents of a power law f^-slope beside white noise that the curve does not exclude, from 0.5 to 1.5; None: it
        excludes all.
    better : bool
        The power law explains the curve better than every listed family.
    white : (float, float) or None
        Set of the coefficient of white noise under these power laws, where they explain the curve better than every
        listed family: the sets of those need not hold N.
    shortest : float or None
        Correlation time [samples] above which a Gauss-Markov term does as well as the random walk; None: no random walk
        is supported.
    """

    slopes: Ends | None
    better: bool
    white: Ends | None
    shortest: float | None


def stand_ins(fits: Sequence[CurveFamilyFit]) -> StandIns:
    """What stands in for the slow noise of the families that a curve supports, the better one first."""
    best = fits[0].best
    data = fits[0].family.curve
    laws = _power_laws(data, best)
    law = min(laws, key=lambda s: s.value)
    allowed = [i for i, at in enumerate(laws) if at.value - law.value <= _INTERVAL]
    excluded = advantage(data, best, law) > EXCLUDES_POWER_LAW
    gain = min(f.best.value for f in fits) - law.value
    walks = [f for f in fits if "K" in f.supported]
    return StandIns(
        slopes=None if excluded else (float(_SLOPES[allowed[0]]), float(_SLOPES[allowed[-1]])),
        better=all(advantage(data, law, f.best) > PREFERS_POWER_LAW for f in fits),
        white=_white_noise(data, [laws[allowed[0]], law, laws[allowed[-1]]]) if gain > _INTERVAL else None,
        shortest=min((_shortest_time(f) for f in walks), default=None),
    )


def _power_laws(data: CurveData, best: CurveSolution) -> list[CurveSolution]:
    """The best sum of white noise, quantization, a ramp and a power law, for each slope."""
    return [solve(data, ("Q", "N", power_law_symbol(float(slope)), "R")) for slope in _SLOPES]


def _white_noise(data: CurveData, laws: Sequence[CurveSolution]) -> Ends:
    """The union of the sets of white noise beside these power laws."""
    sets = [coefficient_set(data, partial(_with_fixed, data, law), law, "N", _INTERVAL) for law in laws]
    return min(low for low, _ in sets), max(high for _, high in sets)


def _with_fixed(
    data: CurveData, law: CurveSolution, fixed: Mapping[str, float], near: CurveSolution | None = None
) -> CurveSolution:
    return solve(data, law.symbols, fixed=fixed, start=None if near is None else near.c)


def _shortest_time(fit: CurveFamilyFit) -> float:
    """The shortest correlation time that explains the curve as well as the random walk does."""
    data, longest = fit.family.curve, float(fit.family.curve.design.n_samples)
    shortest, near = math.inf, fit.best
    for halvings in range(int(math.log2(_SHORTEST_SHARE)) + 2):
        T = 2 * longest / 2**halvings
        at = _in_place_of_the_walk(data, near, T)
        if at.value - fit.best.value > _INTERVAL:
            break
        shortest, near = T, at
    return shortest


def _in_place_of_the_walk(data: CurveData, near: CurveSolution, T: float) -> CurveSolution:
    """The best fit with a Gauss-Markov term of this correlation time for the slowest one."""
    slow = tuple(slow_symbol(T) if s == "K" or s[0] == slow_symbol(T)[0] else s for s in near.symbols)
    times = [None] if near.T is None else [near.T * r for r in _FASTER if near.T * r <= T / 2] or [T / 2]
    fits = (solve(data, slow, T=time, start=near.c) for time in times)
    return min(fits, key=lambda s: s.value)
