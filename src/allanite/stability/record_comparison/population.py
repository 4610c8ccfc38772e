# SPDX-License-Identifier: BSD-3-Clause
"""The kind of sensor behind the records: its middle, its spread, and where the next one lies.

Each record has its own true value, x_r = mu + tau e_r, e standard normal, x the logarithm of the parameter (or the
bias itself). With the profiles of mu for a spread tau, eq. (1) of `profiles`,

    Q(tau) = min over mu of  sum_r D_r,tau(mu)   is chi-square with k - 1 degrees of freedom                (1)

at the true tau, exactly so for normal estimates. The spread is where Q takes its expectation [1], its interval where Q
takes the quantiles [2], zero included; records that agree better than half of such records would bound it as half of
them would. Eq. (1) also gives every tau its weight; the middle and the next sensor follow
from all of them [3]: where the scatter is large, that is Student's interval, and where the records agree, that of the
weighted mean. An upper limit adds to Q what it contradicts, and is no degree of freedom.

References
----------
.. [1] R. Paule, J. Mandel, "Consensus values and weighting factors", J. Res. NBS 87 (1982) 377.
.. [2] W. Viechtbauer, "Confidence intervals for the amount of heterogeneity in meta-analysis", Stat. Med. 26 (2007) 37.
.. [3] K. Nagashima, H. Noma, T. Furukawa, "Prediction intervals for random-effects meta-analysis: a confidence
   distribution approach", Stat. Methods Med. Res. 28 (2019) 1689.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_quantile
from allanite.stability.record_comparison.equality import least, summed_loss
from allanite.stability.record_comparison.profiles import Chords, Profile

__all__ = ["Population", "population_of"]

Array = NDArray[np.float64]

_TAUS = 32
_TRIALS, _CLOSE = 4, 1e-4
#: Share of the usual scatter below which records are equal.
_EQUAL = 1e-9
_DRAWS = 20_000
_BEND = 0.2  # step for the curvature, in standard deviations
_PREDICTED_FROM = 3  # fewer resolved records say next to nothing of the next one


@dataclass(frozen=True, slots=True, kw_only=True)
class Population:
    """Middle and spread of x.

    Attributes
    ----------
    resolved : int
        Records that resolve the parameter: they carry the degrees of freedom.
    middle, lower, upper : float
        Of mu.
    spread, spread_lower, spread_upper : float
        Of tau.
    next_lower, next_upper : float or None
        Interval of the true value of the next sensor; None with fewer than three resolved records.
    """

    resolved: int
    middle: float
    lower: float
    upper: float
    spread: float
    spread_lower: float
    spread_upper: float
    next_lower: float | None
    next_upper: float | None


def population_of(profiles: Sequence[Profile], confidence: float) -> Population | None:
    """Random effects of these records; None where fewer than two resolve the parameter."""
    resolved = [p for p in profiles if p.supported]
    k = len(resolved)
    if k < 2:
        return None
    curve = _SpreadCurve(profiles, resolved)
    tail = (1 - confidence) / 2
    spread = curve.where(float(k - 1))
    low = curve.where(chi_square_quantile(1 - tail, len(profiles) - 1))
    high = curve.limit(chi_square_quantile(tail, k - 1))
    middle = least(profiles, spread)[0]
    ends = [1 - tail, tail]
    upper, lower = np.quantile(curve.draws(of_next=False), ends)
    ahead = np.quantile(curve.draws(of_next=True), ends) if k >= _PREDICTED_FROM else (None, None)
    return Population(
        resolved=k,
        middle=middle,
        lower=min(float(lower), middle),
        upper=max(float(upper), middle),
        spread=spread,
        spread_lower=min(low, spread),
        spread_upper=max(high, spread),
        next_lower=_number(ahead[1]),
        next_upper=_number(ahead[0]),
    )


def _number(value: float | None) -> float | None:
    return None if value is None else float(value)


class _SpreadCurve:
    """Q, the middle and its standard error over tau."""

    def __init__(self, profiles: Sequence[Profile], resolved: Sequence[Profile]) -> None:
        self.profiles, self.k, self._chords = profiles, len(resolved), Chords.of(profiles)
        x = np.array([p.best for p in resolved])
        self.sd = sd = np.array([p.sd for p in resolved])
        unit = max(float(np.ptp(x)), float(sd.max()))
        small = 1e-3 * float(sd.min())
        self.tau = np.concatenate(([0.0], np.geomspace(small, 100 * unit, _TAUS)))
        minima = [self._least(float(t)) for t in self.tau]
        self.middle = np.array([m for m, _ in minima])
        self.error = np.array([self._error(float(t), m) for t, (m, _) in zip(self.tau, minima, strict=True)])
        self.q = np.minimum.accumulate(np.array([q for _, q in minima]))

    def where(self, target: float) -> float:
        """tau at which Q falls to the target; 0 where it is below it from the start."""
        if self.q[0] <= target:
            return 0.0
        low, high = self.tau[1], float(self._at(np.array([target]))[0])
        for _ in range(_TRIALS):  # by secants of the logarithms, from what the table says
            value, further = (self._least(tau)[1] for tau in (high, 1.02 * high))
            if min(value, further) <= 0.0:  # limits let Q fall to nothing: no logarithm
                return self._halved(target, high)
            step = math.log(target / value) / min(math.log(further / value) / math.log(1.02), -1e-3)
            high = max(high * math.exp(min(max(step, -1.0), 1.0)), low)
            if abs(step) < _CLOSE:
                break
        return high

    def _halved(self, target: float, high: float) -> float:
        """The same between the last tau of the table whose Q is above the target and one whose Q is not."""
        low = float(max(self.tau[np.flatnonzero(self.q > target)[-1]], _CLOSE * self.tau[1]))
        high = max(high, low)
        while self._least(high)[1] > target:
            high *= 2.0
        while high / low > 1.0 + _CLOSE:
            middle = math.sqrt(low * high)
            low, high = (middle, high) if self._least(middle)[1] > target else (low, middle)
        return high

    def limit(self, target: float) -> float:
        """`where`, but records that agree better than they should bound the spread no more than usual ones would."""
        usual = chi_square_quantile(0.5, self.k - 1)
        if self.q[0] < _EQUAL * usual:  # equal to the last digits: how Q falls is rounding
            return self._of_usual(target / usual)
        return self.where(target * min(1.0, float(self.q[0]) / usual))

    def _of_usual(self, share: float) -> float:
        """tau at which Q falls to this share of itself where records scatter as their standard deviations say."""
        low, high = 0.0, 1.0
        while self._left(high) > share:
            high *= 2.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._left(middle) > share else (low, middle)
        return high

    def _left(self, tau: float) -> float:
        return float(np.mean(self.sd**2 / (self.sd**2 + tau**2)))

    def _at(self, target: Array) -> Array:
        """Inverse of Q in the logarithm of tau; far out Q falls with the square of tau."""
        log_q, log_tau = np.log(np.maximum(self.q[1:], 1e-300)), np.log(self.tau[1:])
        t = np.interp(-np.log(target), -log_q, log_tau)
        beyond = 0.5 * np.maximum(log_q[-1] - np.log(target), 0.0)
        return np.asarray(np.where(target >= self.q[0], 0.0, np.exp(t + beyond)))

    def _error(self, tau: float, middle: float) -> float:
        """Standard error of the middle, from the curvature of the loss."""
        information = float((1 / (self.sd**2 + tau**2)).sum())
        if all(p.normal for p in self.profiles):
            return 1 / math.sqrt(information)
        step = _BEND / math.sqrt(information)
        x = middle + step * np.array([-1.0, 0.0, 1.0])
        loss = self._chords.total(x, tau) if tau > 0 else summed_loss(self.profiles, x)
        bend = float(loss[0] - 2 * loss[1] + loss[2]) / step**2 / 2
        return 1 / math.sqrt(max(bend, 0.25 * information))

    def _least(self, tau: float) -> tuple[float, float]:
        return least(self.profiles, tau, self._chords)

    def draws(self, *, of_next: bool) -> Array:
        """The middle, or the next true value, for all tau that the records allow with their weights."""
        rng = np.random.default_rng(952)
        tau = self._at(rng.chisquare(self.k - 1, _DRAWS))
        middle = np.interp(tau, self.tau, self.middle)
        # beyond the table the error is that of equal weights
        error = np.where(tau > self.tau[-1], tau / math.sqrt(self.k), np.interp(tau, self.tau, self.error))
        scatter = np.hypot(tau, error) if of_next else error
        return np.asarray(middle + scatter * rng.standard_normal(_DRAWS))
