# SPDX-License-Identifier: BSD-3-Clause
"""By which factors are N and K of a filter wrong? Fitted to all frequencies of its innovations in one.

Notes
-----
The density of the standardized innovations (see `allanite.filtering.innovations`) is

    S(w) = (b c^2 + a w^2)/(c^2 + w^2),    w = 2 sin(pi f/rate),                                                (1)

where a and b are the squares of the factors of N and K, and c = K/(N rate), the corner of the filter, is not in its
innovations: all three are fitted. The likelihood of the periodogram I is that of Whittle,

    -ln L = sum of ln S(w_i) + I(w_i)/S(w_i),                                                                   (2)

and the interval of a or b holds the values whose likelihood, at the best of the two others, is within the quantile of
chi-square of the largest. Corners above `_HIGHEST` are not tried: there the filter would follow every sample, and even
a flat density could be that of b alone. The interval of b has no upper end where the record does not reach down to its
plateau. A mean over the lowest frequencies of the record is no estimate of b: it is a part of the way from a to b.

References
----------
.. [1] P. Whittle, "Estimation and information in stationary time series", Arkiv för Matematik 2 (1953) 423.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_quantile
from allanite.quantities.quantity import Quantity, QuantityStatus

__all__ = ["WrongFactors", "wrong_factors"]

Array = NDArray[np.float64]

#: Of fewer innovations nothing is fitted.
_FEWEST = 30
#: Neighbouring frequencies up to this ratio are one point.
_RATIO = 1.1
#: Corners that are tried, from below the lowest frequency to the highest that a filter of a sensor may have; then
#: between neighbours of the best.
_CORNERS, _BEYOND, _HIGHEST = 24, 1.0, 4.0
_ZOOMS, _WITHIN = 3, 9
#: Largest step of a coefficient in one iteration, and when it has settled.
_LEAST, _SETTLED, _ROUNDS = 0.2, 1e-8, 60
#: How far from the estimate an end is looked for, in the logarithm of a square, and the first step.
_FAR, _STEP, _HALVINGS = 16.0, 0.02, 12


@dataclass(frozen=True, slots=True, kw_only=True)
class WrongFactors:
    """By what N and K of a filter are to be multiplied.

    Attributes
    ----------
    noise, drift : Quantity
        NaN at an end: the innovations set no limit there.
    """

    noise: Quantity
    drift: Quantity


def wrong_factors(z: Array, confidence: float) -> WrongFactors:
    """Factors of N and K from standardized innovations.

    Parameters
    ----------
    z : ndarray, shape (n,)
        In the order of the updates; what is NaN is left out.
    confidence : float
        Level of the intervals.
    """
    fit = _Fit.of(z[np.isfinite(z)])
    if fit is None:
        return WrongFactors(noise=_unknown(), drift=_unknown())
    least = 0.5 * chi_square_quantile(confidence, 1.0)
    return WrongFactors(noise=fit.factor(0, least), drift=fit.factor(1, least))


def _unknown() -> Quantity:
    return Quantity.of(math.nan, (0.0, math.inf), "1")


@dataclass(frozen=True, slots=True)
class _Fit:
    """Means of the periodogram over narrow bands."""

    power: Array  # (m,)
    count: Array  # (m,) frequencies in each
    w: Array  # (m,)

    @classmethod
    def of(cls, z: Array) -> _Fit | None:
        """None of fewer points than there are unknowns."""
        if (n := len(z)) < _FEWEST:
            return None
        power = np.abs(np.fft.rfft(z)[1 : (n + 1) // 2]) ** 2 / n
        w = 2.0 * np.sin(np.pi * np.arange(1, len(power) + 1) / n)
        starts = [0]
        while starts[-1] < len(power):
            starts.append(max(starts[-1] + 1, int(starts[-1] * _RATIO)))
        first = np.array(starts[:-1], dtype=np.int64)
        if not power.any():
            return None
        count = np.diff(np.append(first, len(power))).astype(np.float64)
        middle = np.exp(np.add.reduceat(np.log(w), first) / count)
        return cls(np.add.reduceat(power, first) / count, count, middle)

    def factor(self, which: int, least: float) -> Quantity:
        """The root of a (0) or b (1), with its interval."""
        best, square, _ = self._over_corners(lambda corners: self._of_both(which, corners))

        def lacks(log_square: float) -> tuple[float, bool]:
            """What the likelihood lacks, and whether the plateau is below the record."""
            given = math.exp(log_square)
            loss, _, is_lowest = self._over_corners(lambda corners: self._of_other(which, given, corners))
            return loss - best, is_lowest and which == 1

        low, high = (_end(lacks, math.log(square), side, least) for side in (-1, 1))
        resolved = not math.isnan(low + high)
        return Quantity(
            value=math.sqrt(square),
            lower=math.exp(0.5 * low),
            upper=math.exp(0.5 * high),
            unit="1",
            status=QuantityStatus.RESOLVED if resolved else QuantityStatus.NOT_RESOLVED,
        )

    def _over_corners(self, of: Callable[[Array], tuple[Array, Array]]) -> tuple[float, float, bool]:
        """The least -ln L over all corners, the square there, and whether that corner is the lowest of those tried."""
        lowest = math.log(self.w[0]) - _BEYOND
        corners = np.linspace(lowest, max(math.log(_HIGHEST), lowest + 2 * _BEYOND), _CORNERS)
        losses, squares = of(corners)
        at = int(losses.argmin())
        is_lowest = at == 0
        for _ in range(_ZOOMS):
            near = corners[max(at - 1, 0)], corners[min(at + 1, len(corners) - 1)]
            corners = np.linspace(*near, _WITHIN)
            losses, squares = of(corners)
            at = int(losses.argmin())
        return float(losses[at]), float(squares[at]), is_lowest

    def _shapes(self, which: int, corners: Array) -> tuple[Array, Array]:
        """What a (0) or b (1) stands for in the density, and the other; shape (corners, m)."""
        high = self.w**2 / (np.exp(2.0 * corners)[:, None] + self.w**2)
        return (high, 1.0 - high) if which == 0 else (1.0 - high, high)

    def _of_other(self, which: int, square: float, corners: Array) -> tuple[Array, Array]:
        """-ln L of every corner with one square given, and the best of the other."""
        one, shape = self._shapes(which, corners)
        given, other = square * one, np.ones((len(shape), 1))
        for _ in range(_ROUNDS):
            density = given + other * shape
            step = self._slope(density, shape) / self._curvature(density, shape, shape)
            stepped = np.maximum(other - step, _LEAST * other)
            settled = np.abs(stepped - other).max() <= _SETTLED * other.max()
            other = stepped
            if settled:
                break
        return self._loss(given + other * shape), other[:, 0]

    def _of_both(self, which: int, corners: Array) -> tuple[Array, Array]:
        """-ln L of every corner with the best of both squares, and that asked for: Fisher's scoring."""
        one, two = self._shapes(which, corners)
        x, y = (np.ones((len(one), 1)) for _ in range(2))
        for _ in range(_ROUNDS):
            density = x * one + y * two
            g, h = self._slope(density, one), self._slope(density, two)
            a, b, c = (self._curvature(density, *p) for p in ((one, one), (one, two), (two, two)))
            scale = a * c * (1.0 + _SETTLED) - b * b
            to_x, to_y = x - (c * g - b * h) / scale, y - (a * h - b * g) / scale
            x, y = np.maximum(to_x, _LEAST * x), np.maximum(to_y, _LEAST * y)
        return self._loss(x * one + y * two), x[:, 0]

    def _loss(self, density: Array) -> Array:
        return np.asarray((self.count * (np.log(density) + self.power / density)).sum(axis=1))

    def _slope(self, density: Array, shape: Array) -> Array:
        part = self.count * shape / density
        return np.asarray((part * (1.0 - self.power / density)).sum(axis=1, keepdims=True))

    def _curvature(self, density: Array, one: Array, two: Array) -> Array:
        return np.asarray((self.count * one * two / density**2).sum(axis=1, keepdims=True))


def _end(lacks: Callable[[float], tuple[float, bool]], middle: float, side: int, least: float) -> float:
    """Where the likelihood lacks `least`; NaN where that is nowhere, or above with a plateau below the record."""
    inside, step = 0.0, _STEP
    while True:
        lack, is_below = lacks(middle + side * (inside + step))
        if lack >= least:
            break
        if (is_below and side > 0) or inside + step > _FAR:
            return math.nan
        inside, step = inside + step, 1.5 * step
    outside = inside + step
    for _ in range(_HALVINGS):
        half = 0.5 * (inside + outside)
        inside, outside = (half, outside) if lacks(middle + side * half)[0] < least else (inside, half)
    return middle + side * outside
