# SPDX-License-Identifier: BSD-3-Clause
"""Units whose coefficient changes over their repeats, by the profiles of their logs.

The logarithm of a coefficient of one unit is a + b t at the date t of a log, plus the effects of other conditions,
plus a part of the log that varies as repeats do. With that part integrated, the loss of b alone, the best a for each b,
has the signed root S(b). C(b) is the mean of Phi(S(b)) over what the fleet allows of the spread of repeats; the
interval of b lies between its quantiles, and the probability of no drift is 2 min(C(0), 1 - C(0)). Units that drift are
chosen by the step-up procedure [1] among all coefficients of all units.

References
----------
.. [1] Y. Benjamini, Y. Hochberg, "Controlling the false discovery rate", J. R. Stat. Soc. B 57 (1995) 289.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.stability.fleet.draws import Draws
from allanite.stability.fleet.evidence import Design
from allanite.stability.fleet.profile_table import ProfileTable
from allanite.stability.fleet.standing_out import RESOLVED

__all__ = ["LEAST_SPAN", "DatedLogs", "dated_logs"]

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: Between the first and the last log that resolve a coefficient [years].
LEAST_SPAN = 30 / 365.25
_SPREADS = 6  # of repeats, that the fleet allows
_ROUNDS, _LONGEST, _CLOSE = 60, 1.0, 1e-8
_HALVINGS, _DOUBLINGS = 26, 12
_LEAST_VARIANCE = 1e-8


@dataclass(frozen=True, slots=True)
class DatedLogs:
    """The logs of one coefficient of units that have two or more, with dates.

    Attributes
    ----------
    profiles : ProfileTable
        Of n logs.
    years : ndarray, shape (n,)
        Since the mean date of the unit.
    effects : ndarray, shape (n,)
        Of the other conditions.
    unit : ndarray of int, shape (n,)
        Not decreasing, each of 0 ... n_units - 1.
    numbers : ndarray of int, shape (n_units,)
        Of the units in the fleet.
    variances : ndarray, shape (m,)
        Equally likely ones of the repeats.
    """

    profiles: ProfileTable
    years: Array
    effects: Array
    unit: Index
    numbers: Index
    variances: Array

    def of_units(self, chosen: Index) -> DatedLogs:
        """Some of the units, in their order."""
        rows = np.flatnonzero(np.isin(self.unit, chosen))
        return replace(
            self,
            profiles=self.profiles.of_rows(rows),
            years=self.years[rows],
            effects=self.effects[rows],
            unit=np.searchsorted(chosen, self.unit[rows]).astype(np.intp),
            numbers=self.numbers[chosen],
        )

    def probability(self) -> Array:
        """Two-sided, of a slope that is zero, for each unit."""
        below = self._below_zero()
        bent = np.unique(self.unit[~self.profiles.straight])
        if len(bent):
            logs = self.of_units(bent)
            below[bent] = logs._confidence(logs._peaks(), np.zeros(len(bent)))
        return np.asarray(2 * np.minimum(below, 1 - below))

    def _below_zero(self) -> Array:
        """C(0) of normal profiles, by least squares: a hundred times as fast as by Newton steps."""
        from scipy.special import ndtr

        mean, precision = self.profiles.normal
        x, t, total = mean - self.effects, self.years, np.zeros(len(self.numbers))
        for v in self.variances:
            w = precision / (1.0 + v * precision)
            center = self._sum(w * t) / np.maximum(self._sum(w), 1e-12)
            apart = t - center[self.unit]
            squares = np.maximum(self._sum(w * apart**2), 1e-12)
            total += ndtr(-self._sum(w * apart * x) / np.sqrt(squares))
        return np.asarray(total / len(self.variances))

    def slope(self, confidence: float) -> tuple[float, float, float]:
        """Median and ends of the interval [1/year] of the only unit."""
        peaks = self._peaks()
        start = float(np.mean([b[0] for _, b in peaks]))
        tails = (0.5, 0.5 - confidence / 2, 0.5 + confidence / 2)
        median, low, high = (self._quantile(peaks, start, p) for p in tails)
        return median, low, high

    def _quantile(self, peaks: list[tuple[Array, Array]], start: float, p: float) -> float:
        """b at which C is p, by bisection."""

        def rises(b: float) -> bool:
            return bool(self._confidence(peaks, np.array([b]))[0] < p)

        step = 0.1 / max(float(np.ptp(self.years)), 1e-3)
        side = 1.0 if rises(start) else -1.0
        near, far = start, start + side * step
        for _ in range(_DOUBLINGS):
            if rises(far) != (side > 0):
                break
            near, far, step = far, far + 2 * side * step, 2 * step
        for _ in range(_HALVINGS):
            middle = 0.5 * (near + far)
            near, far = (middle, far) if rises(middle) == (side > 0) else (near, middle)
        return 0.5 * (near + far)

    def _peaks(self) -> list[tuple[Array, Array]]:
        """Largest log-likelihood of each unit and its slope, for each variance."""
        zero = np.zeros(len(self.numbers))
        return [self._climbed(float(v), zero, free=True) for v in self.variances]

    def _confidence(self, peaks: list[tuple[Array, Array]], b: Array) -> Array:
        """C(b), which rises with b."""
        from scipy.special import ndtr

        total = np.zeros(len(b))
        for v, (top, best) in zip(self.variances, peaks, strict=True):
            value, _ = self._climbed(float(v), b, free=False)
            total += ndtr(np.sign(b - best) * np.sqrt(2 * np.maximum(top - value, 0.0)))
        return np.asarray(total / len(peaks))

    def _climbed(self, v: float, b: Array, *, free: bool) -> tuple[Array, Array]:
        """The best value over a, and over b where that is free, by Newton steps; with b."""
        a, b, t = self._first(b), b.copy(), self.years
        value = self._value(a, b, v)
        for _ in range(_ROUNDS):
            step_a, step_b = self._step(a, b, v, free=free)
            longest = np.maximum(np.abs(step_a), np.abs(step_b) * float(np.abs(t).max()))
            share = np.minimum(1.0, _LONGEST / np.maximum(longest, 1e-300))
            for _ in range(8):
                ahead = self._value(a + share * step_a, b + share * step_b, v)
                worse = ahead < value - 1e-12
                if not worse.any():
                    break
                share = np.where(worse, 0.3 * share, share)
            share = np.where(ahead < value, 0.0, share)
            a, b, value = a + share * step_a, b + share * step_b, np.maximum(ahead, value)
            if float((share * longest).max()) < _CLOSE:
                break
        return value, b

    def _first(self, b: Array) -> Array:
        """a by the logs that resolve the coefficient."""
        mean, precision = self.profiles.normal
        weight = np.maximum(precision, 1e-12)
        rest = mean - self.effects - b[self.unit] * self.years
        return self._sum(weight * rest) / self._sum(weight)

    def _value(self, a: Array, b: Array, v: float) -> Array:
        m = a[self.unit] + b[self.unit] * self.years + self.effects
        return self._sum(self.profiles.tilted(m, np.full(len(m), v)).log_mass)

    def _step(self, a: Array, b: Array, v: float, *, free: bool) -> tuple[Array, Array]:
        t = self.years
        m = a[self.unit] + b[self.unit] * t + self.effects
        tilted = self.profiles.tilted(m, np.full(len(m), v))
        pull = (tilted.mean - m) / v
        bend = np.maximum((1.0 - tilted.variance / v) / v, 1e-6)
        g, h = self._sum(pull), self._sum(bend)
        if not free:
            return g / h, np.zeros(len(h))
        g_t, h_t, h_tt = self._sum(t * pull), self._sum(t * bend), self._sum(t * t * bend)
        determinant = np.maximum(h * h_tt - h_t**2, 1e-12)
        return (h_tt * g - h_t * g_t) / determinant, (h * g_t - h_t * g) / determinant

    def _sum(self, values: Array) -> Array:
        return np.asarray(np.bincount(self.unit, values, minlength=len(self.numbers)))


def dated_logs(design: Design, draws: Draws, years: Array, dated: int | None) -> DatedLogs | None:
    """The logs of units that can tell of a drift; None where there is no such unit.

    Parameters
    ----------
    design : Design
        Of the coefficient.
    draws : Draws
        Of its population.
    years : ndarray, shape (n,)
        Date of each log; NaN where it has none.
    dated : int or None
        Column of the covariates that holds the date: its effect is part of a drift.
    """
    resolving = np.isfinite(years) & (design.profiles.root_at_zero < -RESOLVED)
    first, last = np.full(design.units, np.inf), np.full(design.units, -np.inf)
    np.minimum.at(first, design.unit[resolving], years[resolving])
    np.maximum.at(last, design.unit[resolving], years[resolving])
    rows = np.flatnonzero(np.isfinite(years) & (last - first >= LEAST_SPAN)[design.unit])
    if not len(rows):
        return None
    numbers, unit = np.unique(design.unit[rows], return_inverse=True)
    count, total = np.bincount(unit), np.bincount(unit, years[rows])
    beta = draws.location.mean(axis=0)
    others = [i for i in range(1, len(beta)) if i != dated]
    shares = (np.arange(_SPREADS) + 0.5) / _SPREADS
    return DatedLogs(
        profiles=design.profiles.of_rows(rows),
        years=years[rows] - (total / count)[unit],
        effects=design.covariates[rows][:, others] @ beta[others],
        unit=unit.astype(np.intp),
        numbers=numbers.astype(np.intp),
        variances=np.maximum(np.quantile(draws.scale("repeat"), shares) ** 2, _LEAST_VARIANCE),
    )
