# SPDX-License-Identifier: BSD-3-Clause
"""What to do when no sum of noise terms explains a curve.

Real sensors filter, vibrate and warm up. At short lags a curve may be known to 0.1 %, so that a shape which is wrong
by 1 % there would decide every parameter. Remedies, in this order, both said in the result:

1. one or two Gauss-Markov terms with correlation times down to one sample;
2. the shortest lags are left out, until the rest is explained;
3. if that does not help, every lag gets a relative model error (the *discrepancy*), as small as makes the misfit
   what chance would give; the intervals then hold it.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FitError
from allanite.fitting.design import SHORTEST_TIME, CurveDesign, design_of, without_shortest
from allanite.fitting.families import FLICKER, GAUSS_MARKOV, TWO_GAUSS_MARKOV, Family
from allanite.fitting.instrument import FLOOR, two_records
from allanite.fitting.objective import CurveData, CurveSolution, advantage
from allanite.fitting.rivals import DOUBTFUL, PAYS_FOR_TIME, PAYS_FOR_TWO, REJECTS_FLICKER
from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan.curve import AllanCurve
from allanite.quantities.distributions import chi_square_tail

__all__ = ["Floor", "LagChoice", "best_explained", "candidate"]

#: Goodness of fit below which a curve counts as not explained: a true model is treated so once in ten thousand records.
_NOT_EXPLAINED = 1e-4
_EXPLAINED = 1e-2
_FEWEST = 6  # lags that must be left
_SHARE = 0.5  # of the lags that may be left out
_BISECTIONS = 7
_WORST = 0.4  # a larger discrepancy describes nothing


@dataclass(frozen=True)
class LagChoice:
    """A choice of lags (and of a discrepancy), and the best fits to them; each is made when it is asked for.

    Attributes
    ----------
    used : ndarray of bool, shape (n_lags,)
        Of the whole curve.
    scale : float
        Variance unit of `data`.
    data : CurveData
    below : tuple of str
        Terms of the instrument, which every family has.
    more : bool
        Whether shorter correlation times, and two Gauss-Markov terms, may explain what neither family does.
    """

    used: NDArray[np.bool_]
    scale: float
    data: CurveData
    below: tuple[str, ...] = ()
    more: bool = False

    @cached_property
    def flicker(self) -> CurveSolution:
        """The best fit of the flicker family."""
        return Family(self.data, (*FLICKER, *self.below))({})

    @cached_property
    def markov(self) -> CurveSolution:
        """The best fit of the family with one Gauss-Markov term."""
        return Family(self.data, (*GAUSS_MARKOV, *self.below))({})

    @cached_property
    def other(self) -> CurveSolution | None:
        """One Gauss-Markov term of any correlation time, or two, where that explains what neither family does."""
        if not self.more:
            return None
        at_end = self.markov.times[0] <= 1.001 * SHORTEST_TIME and self._only_markov()
        if self.explained(DOUBTFUL) and not at_end:
            return None
        below = self.markov
        for symbols in (GAUSS_MARKOV, TWO_GAUSS_MARKOV):
            family = Family(self.data, symbols, shortest=1.0)
            if len(self.data.variance) <= len(symbols) + len(family.markov):
                break
            other = family.above(below)
            gain = min(self.flicker.value, self.markov.value) - other.value
            price = PAYS_FOR_TIME if at_end and symbols == GAUSS_MARKOV else PAYS_FOR_TWO
            if gain > price and self._p(other) >= _EXPLAINED:
                return other
            below = other
        return None

    @property
    def solutions(self) -> tuple[CurveSolution, ...]:
        """The best fits of all families that were tried."""
        return (self.flicker, self.markov, *([] if self.other is None else [self.other]))

    def explained(self, p: float) -> bool:
        """Whether one of the families fits as well as a true model does with this probability."""
        return self._p(self.flicker) >= p or self._p(self.markov) >= p

    def _only_markov(self) -> bool:
        """Whether the curve rejects flicker, and not a Gauss-Markov term."""
        return advantage(self.data, self.markov, self.flicker) > REJECTS_FLICKER

    def _p(self, at: CurveSolution) -> float:
        free = int((at.c > 0).sum()) + len(at.times)
        return chi_square_tail(at.chi2, max(len(self.data.variance) - free, 1))


@dataclass(frozen=True, slots=True)
class Floor:
    """The curve of the instrument alone, and which of its lags count."""

    curve: AllanCurve
    used: NDArray[np.bool_]


def candidate(
    curve: AllanCurve, used: NDArray[np.bool_], discrepancy: float = 0.0, floor: Floor | None = None
) -> LagChoice:
    """These lags."""
    return _Lags(curve, used, floor).candidate(discrepancy=discrepancy)


class _Lags:
    """The lags of a curve, from which the shortest may be left out; their covariances are computed once."""

    def __init__(self, curve: AllanCurve, used: NDArray[np.bool_], floor: Floor | None) -> None:
        self._curve, self._used, self._floor = curve, used, floor
        self._design = _design(curve, used)
        self._below = None if floor is None else _design(floor.curve, floor.used)

    @property
    def most_left_out(self) -> int:
        """Shortest lags that may be left out."""
        count = int(self._used.sum())
        return min(int(_SHARE * count), count - _FEWEST)

    def candidate(self, *, left_out: int = 0, discrepancy: float = 0.0) -> LagChoice:
        """These lags without the shortest ones."""
        used = self._used.copy()
        used[np.flatnonzero(used)[:left_out]] = False
        design = without_shortest(self._design, left_out)
        variance = self._curve.variance[used, 0]
        scale = float(variance[0])
        below: tuple[str, ...] = ()
        if self._floor is not None and self._below is not None:
            variance = np.concatenate([variance, self._floor.curve.variance[self._floor.used, 0]])
            design, below = two_records(design, self._below), FLOOR
        return LagChoice(used, scale, CurveData(variance / scale, design, discrepancy), below)


def _design(curve: AllanCurve, used: NDArray[np.bool_]) -> CurveDesign:
    starts = curve.starts()
    part = None if starts is None else [starts[i] for i in np.flatnonzero(used)]
    return design_of(curve.lags[used], curve.n_samples, curve.channels[0].sampling, part)


def best_explained(curve: AllanCurve, used: NDArray[np.bool_], floor: Floor | None = None) -> LagChoice:
    """All lags if they are explained, else fewer, else all of them with a discrepancy."""
    lags = _Lags(curve, used, floor)
    whole = replace(lags.candidate(), more=floor is None)
    if whole.explained(_NOT_EXPLAINED) or whole.other is not None:
        return whole
    for left_out in range(1, lags.most_left_out + 1):
        trial = lags.candidate(left_out=left_out)
        if trial.explained(_EXPLAINED):
            return trial
    return _with_discrepancy(lags)


def _with_discrepancy(lags: _Lags) -> LagChoice:
    low, high = np.log(1e-3), np.log(_WORST)
    best = lags.candidate(discrepancy=_WORST)
    if not best.explained(_NOT_EXPLAINED):
        raise FitError(
            f"no sum of noise terms explains the curve to {_WORST:.0%} in variance: the record is not the "
            "noise of a sensor at rest; check the findings, the spectrum and the time series"
        )
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        trial = lags.candidate(discrepancy=float(np.exp(middle)))
        if trial.explained(0.5):
            high, best = middle, trial
        else:
            low = middle
    return best
