# SPDX-License-Identifier: BSD-3-Clause
"""When a control chart signals: rules of Western Electric and of Nelson, and the exponentially weighted mean.

All of them take standardized points, z = (x - center) / sd, each with its own sd. For independent normal points one
beyond three standard deviations comes by chance in 0.27 % of points; the four rules of Western Electric together signal
once in 92 points [3].

References
----------
.. [1] Western Electric, "Statistical Quality Control Handbook", Indianapolis 1956, part B.
.. [2] L. Nelson, "The Shewhart control chart - tests for special causes", J. Qual. Technol. 16 (1984) 237.
.. [3] C. Champ, W. Woodall, "Exact results for Shewhart control charts with supplementary runs rules",
   Technometrics 29 (1987) 393.
.. [4] J. Lucas, M. Saccucci, "Exponentially weighted moving average control schemes", Technometrics 32 (1990) 1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.quantities.verdict import WordedCode

__all__ = ["EWMA_LIMIT", "NELSON", "WESTERN_ELECTRIC", "ControlRule", "ewma", "signals"]

Array = NDArray[np.float64]
Marks = NDArray[np.bool_]

#: Weight of a new point, and limit in standard deviations: one false alarm in 500 points [4].
EWMA_WEIGHT, EWMA_LIMIT = 0.2, 2.962


class ControlRule(WordedCode):
    """What a chart looks for; a point is marked where the pattern is complete."""

    BEYOND_3 = "beyond 3 sd", "one point beyond 3 sd"
    TWO_OF_THREE = "2 of 3 beyond 2 sd", "two of three points beyond 2 sd on one side"
    FOUR_OF_FIVE = "4 of 5 beyond 1 sd", "four of five points beyond 1 sd on one side"
    EIGHT_ON_SIDE = "8 on one side", "eight points in a row on one side"
    NINE_ON_SIDE = "9 on one side", "nine points in a row on one side"
    SIX_TREND = "6 in a trend", "six points in a row rising or falling"
    FOURTEEN_ALTERNATING = "14 alternating", "fourteen points in a row alternating up and down"
    FIFTEEN_WITHIN_1 = "15 within 1 sd", "fifteen points in a row within 1 sd"
    EIGHT_BEYOND_1 = "8 beyond 1 sd", "eight points in a row beyond 1 sd on either side"
    EWMA = "ewma", "the weighted mean beyond its limit"


#: The rules of the handbook, zone by zone [1].
WESTERN_ELECTRIC = (
    ControlRule.BEYOND_3,
    ControlRule.TWO_OF_THREE,
    ControlRule.FOUR_OF_FIVE,
    ControlRule.EIGHT_ON_SIDE,
)
#: The eight tests in their order [2].
NELSON = (
    ControlRule.BEYOND_3,
    ControlRule.NINE_ON_SIDE,
    ControlRule.SIX_TREND,
    ControlRule.FOURTEEN_ALTERNATING,
    ControlRule.TWO_OF_THREE,
    ControlRule.FOUR_OF_FIVE,
    ControlRule.FIFTEEN_WITHIN_1,
    ControlRule.EIGHT_BEYOND_1,
)


def signals(z: Array, rule: ControlRule) -> Marks:
    """Points at which a rule signals.

    Parameters
    ----------
    z : ndarray, shape (n,)
        Standardized, in their order; finite.
    rule : ControlRule

    Returns
    -------
    ndarray of bool, shape (n,)

    Raises
    ------
    InputError
        Points that are not finite.
    """
    if not np.isfinite(z).all():
        raise InputError("a control chart needs finite points; leave out those that are only limits")
    return _RULES[rule](z) if len(z) else np.zeros(0, dtype=bool)


def ewma(z: Array, weight: float = EWMA_WEIGHT) -> tuple[Array, Array]:
    """Exponentially weighted means of standardized points, and their standard deviations, shape (n,) each.

    Parameters
    ----------
    z : ndarray, shape (n,)
    weight : float
        Of a new point; the mean begins at the center.
    """
    mean, current = np.empty(len(z)), 0.0
    for i, value in enumerate(z):
        current += weight * (value - current)
        mean[i] = current
    n = np.arange(1, len(z) + 1)
    return mean, np.sqrt(weight / (2 - weight) * (1 - (1 - weight) ** (2 * n)))


def _ending(marks: Marks, count: int, of: int) -> Marks:
    """Where so many of the last `of` points are marked, the last one among them."""
    sums = np.cumsum(np.r_[0, marks.astype(np.int64)])
    first = np.maximum(np.arange(1, len(marks) + 1) - of, 0)
    return np.asarray(marks & (sums[1:] - sums[first] >= count))


def _beyond(z: Array, sd: float, count: int, of: int) -> Marks:
    """So many of the last points beyond so many standard deviations, on one side."""
    return np.asarray(_ending(z > sd, count, of) | _ending(z < -sd, count, of))


def _trend(z: Array, count: int) -> Marks:
    """So many points of which each is higher than the one before, or each lower."""
    step = np.diff(z, prepend=z[0])
    return np.asarray(_ending(step > 0, count - 1, count - 1) | _ending(step < 0, count - 1, count - 1))


def _alternating(z: Array, count: int) -> Marks:
    """So many points whose steps change sign at each."""
    step = np.diff(z, prepend=z[0])
    turns = np.r_[False, step[1:] * step[:-1] < 0]
    return _ending(turns, count - 2, count - 2)


_RULES: Mapping[ControlRule, Callable[[Array], Marks]] = {
    ControlRule.BEYOND_3: partial(_beyond, sd=3.0, count=1, of=1),
    ControlRule.TWO_OF_THREE: partial(_beyond, sd=2.0, count=2, of=3),
    ControlRule.FOUR_OF_FIVE: partial(_beyond, sd=1.0, count=4, of=5),
    ControlRule.EIGHT_ON_SIDE: partial(_beyond, sd=0.0, count=8, of=8),
    ControlRule.NINE_ON_SIDE: partial(_beyond, sd=0.0, count=9, of=9),
    ControlRule.SIX_TREND: partial(_trend, count=6),
    ControlRule.FOURTEEN_ALTERNATING: partial(_alternating, count=14),
    ControlRule.FIFTEEN_WITHIN_1: lambda z: _ending(np.abs(z) < 1, 15, 15),
    ControlRule.EIGHT_BEYOND_1: lambda z: _ending(np.abs(z) > 1, 8, 8),
    ControlRule.EWMA: lambda z: np.abs(ewma(z)[0]) > EWMA_LIMIT * ewma(z)[1],
}
