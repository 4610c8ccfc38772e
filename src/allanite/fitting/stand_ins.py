# SPDX-License-Identifier: BSD-3-Clause
"""What could stand in for the slow noise that a curve is said to show?

The families of a fit end in a random walk. Noise of density f^-slope, and a Gauss-Markov term whose correlation time
is long, bend a curve upward as well; where a record does not exclude them, the K that it supports is that of the model,
not of the sensor.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from functools import partial

import numpy as np

from allanite.fitting.design import power_law_symbol, slow_symbol
from allanite.fitting.families import CurveFamilyFit, Family
from allanite.fitting.objective import CurveData, CurveSolution, advantage, solve
from allanite.fitting.sets import coefficient_set
from allanite.lazy_dataclasses import dataclass

__all__ = ["INTERVAL", "PowerLaws", "power_laws", "shortest_time"]

Ends = tuple[float, float]

#: Twice the advantage in log-likelihood of the listed families that excludes a power law: by simulation of power laws
#: less than 1 % of their records reach it.
EXCLUDES_POWER_LAW = 10.0
#: That of a power law over all listed families, from which on it is said to explain the curve better.
PREFERS_POWER_LAW = 10.0
#: Loss in twice the log-likelihood at the ends of the interval of a slope, and of a correlation time (95 %).
INTERVAL = 3.84
_SLOPES: tuple[float, ...] = tuple(np.round(np.arange(0.5, 1.51, 0.1), 1).tolist())
_SHORTEST_SHARE = 512  # of the record, down to which correlation times are tried


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerLaws:
    """What a curve says of white noise and a density f^-slope, in the place of the listed families.

    Attributes
    ----------
    slopes : (float, float) or None
        Exponents that the curve does not exclude, from 0.5 to 1.5; None: it excludes all.
    better : bool
        The power law explains the curve better than every listed family.
    white : (float, float) or None
        Set of the coefficient of white noise under these power laws, where they explain the curve better than every
        listed family: the sets of those need not hold N.
    """

    slopes: Ends | None
    better: bool
    white: Ends | None

    def facts(self, supported: Collection[str]) -> dict[str, float]:
        """As `goodness` holds it. A slope of 1 is not said where neither flicker nor a walk is supported."""
        if self.slopes is None or not (
            {"B", "K"} & {*supported} or not self.slopes[0] <= 1 <= self.slopes[1]
        ):
            return {}
        low, high = self.slopes
        return {"slope_lower": low, "slope_upper": high, "slope_better": float(self.better)}


def power_laws(data: CurveData, listed: Sequence[CurveSolution]) -> PowerLaws:
    """Power laws beside the best fits of the listed families, the better one first."""
    data.design.expect_power_laws(_SLOPES)
    laws = [solve(data, ("Q", "N", power_law_symbol(slope), "R")) for slope in _SLOPES]
    law = min(laws, key=lambda s: s.value)
    allowed = [i for i, at in enumerate(laws) if at.value - law.value <= INTERVAL]
    excluded = advantage(data, listed[0], law) > EXCLUDES_POWER_LAW
    gain = min(s.value for s in listed) - law.value
    return PowerLaws(
        slopes=None if excluded else (_SLOPES[allowed[0]], _SLOPES[allowed[-1]]),
        better=all(advantage(data, law, s) > PREFERS_POWER_LAW for s in listed),
        white=_white_noise(data, [laws[allowed[0]], law, laws[allowed[-1]]]) if gain > INTERVAL else None,
    )


def shortest_time(fits: Sequence[CurveFamilyFit]) -> float | None:
    """Correlation time [samples] above which a Gauss-Markov term explains a curve as well as the random walk does.

    None: some family does without a random walk, or none of these terms does as well.
    """
    if not all("K" in f.supported for f in fits):
        return None
    shortest = min(_shortest_time(f) for f in fits)
    return shortest if shortest < fits[0].family.curve.design.n_samples else None


def _white_noise(data: CurveData, laws: Sequence[CurveSolution]) -> Ends:
    """The union of the sets of white noise beside these power laws."""
    sets = [coefficient_set(data, partial(_with_fixed, data, law), law, "N", INTERVAL) for law in laws]
    return min(low for low, _ in sets), max(high for _, high in sets)


def _with_fixed(
    data: CurveData, law: CurveSolution, fixed: Mapping[str, float], near: CurveSolution | None = None
) -> CurveSolution:
    return solve(data, law.symbols, fixed=fixed, start=None if near is None else near.c)


def _shortest_time(fit: CurveFamilyFit) -> float:
    """The shortest correlation time that explains the curve as well as the random walk does."""
    longest = float(fit.family.curve.design.n_samples)
    shortest, near = math.inf, fit.best
    for halvings in range(int(math.log2(_SHORTEST_SHARE)) + 2):
        T = 2 * longest / 2**halvings
        at = _in_place_of_the_walk(fit.family, near, T)
        if at.value - fit.best.value > INTERVAL:
            break
        shortest, near = T, at
    return shortest


def _in_place_of_the_walk(family: Family, near: CurveSolution, T: float) -> CurveSolution:
    """The best fit with a Gauss-Markov term of this correlation time for the slowest one, others being quicker."""
    slow = tuple(slow_symbol(T) if s == "K" or s[0] == slow_symbol(T)[0] else s for s in near.symbols)
    ends = (family.shortest, max(T / 2, family.shortest))
    times = tuple(min(t, ends[1]) for t in near.times)
    return solve(family.curve, slow, times=times, within=[ends] * len(times), start=near.c)
