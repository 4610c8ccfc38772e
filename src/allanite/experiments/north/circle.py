# SPDX-License-Identifier: BSD-3-Clause
"""Directions and their confidence sets: arcs that wrap, and the whole circle where nothing is known.

A vector of unknown length is measured with normal noise; in which directions may it point? In the plane where the
noise has the covariance 1, a measured vector of length r lies sqrt(1 - cos^2 d) r from the ray at an angle d, or r
where the ray points away. The directions whose ray is closer than z, the normal quantile, are those within
asin(z/r). That set misses too often where the true vector is short. It is exact at every length, or wide by at most
0.013, if the whole circle is given up to a longer r_0 > z: the length from which a signal is seen. The set then holds
the truth at length zero with the stated probability,

    integral from r_0^2 of exp(-t/2)/2 (1 - asin(z/sqrt t)/pi) dt = 1 - confidence,                        (1)

and by quadrature over the law of r (Rice) and of d given r (von Mises, concentration r s) at every true length s:

    ==================  =====  =====  =====  =====  =====  =====  =====  =====
    true length s         0     0.3    0.6     1      2      3      5      30
    coverage of 95 %    0.950  0.959  0.962  0.961  0.954  0.951  0.950  0.950
    ==================  =====  =====  =====  =====  =====  =====  =====  =====
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import normal_quantile
from allanite.quantities.result import Result

__all__ = [
    "CIRCLE",
    "Arc",
    "direction_set",
    "half_width",
    "length_interval",
    "mean_direction",
    "seen_from",
    "wrapped",
]

Array = NDArray[np.float64]

FULL_TURN = 2 * math.pi
#: Beyond so many standard deviations the length is normal.
_FAR = 50.0


def wrapped(angle: float) -> float:
    """The same direction from 0 to below 2 pi [rad]."""
    out = math.fmod(angle, FULL_TURN)
    out = out + FULL_TURN if out < 0 else out
    return 0.0 if out >= FULL_TURN else out


@dataclass(frozen=True, slots=True)
class Arc(Result):
    """Directions from `start` on towards larger angles.

    Attributes
    ----------
    stop : float [rad]
        The end, 0 to below 2 pi.
    start : float [rad]
        0 to below 2 pi.
    width : float [rad]
        0 to 2 pi, the whole circle.
    """

    STATED: ClassVar[tuple[str, ...]] = ("stop",)

    start: float
    width: float

    @classmethod
    def around(cls, middle: float, before: float, after: float) -> Arc:
        """From `before` [rad] below a direction to `after` above it; the circle where they meet."""
        if before + after >= FULL_TURN:
            return CIRCLE
        return cls(wrapped(middle - before), before + after)

    @property
    def stop(self) -> float:
        """The end, 0 to below 2 pi: less than `start` where north lies inside [rad]."""
        return wrapped(self.start + self.width)

    @property
    def full(self) -> bool:
        """True for the whole circle."""
        return self.width >= FULL_TURN

    def contains(self, angle: float) -> bool:
        """Does the direction lie on the arc, its ends included?"""
        return self.full or wrapped(angle - self.start) <= self.width


CIRCLE = Arc(0.0, FULL_TURN)
"""Every direction."""


def mean_direction(angles: ArrayLike, weights: ArrayLike | None = None) -> float:
    """Direction of the sum of unit vectors [rad], 0 to below 2 pi; NaN where they cancel.

    359.9 and 0.1 deg have the mean 0, not 180.
    """
    a = np.asarray(angles, dtype=np.float64)
    w = np.ones_like(a) if weights is None else np.asarray(weights, dtype=np.float64)
    c, s = float(w @ np.cos(a)), float(w @ np.sin(a))
    if math.hypot(c, s) <= 1e-12 * float(np.abs(w).sum()):
        return math.nan
    return wrapped(math.atan2(s, c))


def half_width(confidence: float) -> float:
    """z of the interval from -z to z."""
    return normal_quantile((1 + confidence) / 2)


@lru_cache(maxsize=64)
def seen_from(confidence: float) -> float:
    """r_0 of eq. (1): the length, in standard deviations, from which a direction is seen. 2.318 at 95 %.

    Raises
    ------
    InputError
        A confidence outside 0.5 to below 1.
    """
    if not 0.5 <= confidence < 1:
        raise InputError(f"confidence must be from 0.5 to below 1, not {confidence!r}")
    from scipy.integrate import quad
    from scipy.optimize import brentq

    z = half_width(confidence)

    def missed(r: float) -> float:
        return float(
            quad(lambda x: x * math.exp(-x * x / 2) * (1 - math.asin(z / x) / math.pi), r, r + 12)[0]
        )

    return float(brentq(lambda r: missed(r) - (1 - confidence), z, z + 5, xtol=1e-10))


def direction_set(vector: Array, covariance: Array, confidence: float, more: float = 0.0) -> Arc:
    """Directions in which a vector of unknown length may point.

    Parameters
    ----------
    vector : ndarray, shape (2,)
        Measured.
    covariance : ndarray, shape (2, 2)
        Of its normal noise.
    confidence : float
    more : float [rad]
        Standard uncertainty of the direction from elsewhere; added in quadrature to both sides.
    """
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, vector)
    r = float(np.hypot(*white))
    if not r > seen_from(confidence):
        return CIRCLE
    z = half_width(confidence)
    phi, half = math.atan2(white[1], white[0]), math.asin(z / r)
    middle, low, high = (
        math.atan2(*(factor @ [math.cos(a), math.sin(a)])[::-1]) for a in (phi, phi - half, phi + half)
    )
    before, after = (math.hypot(wrapped(d), z * more) for d in (middle - low, high - middle))
    return Arc.around(middle, before, after)


def length_interval(r: float, confidence: float) -> tuple[float, float]:
    """Interval of the true length s of a vector measured as r, in standard deviations of each component.

    From the law of r^2, chi-square with two degrees of freedom and noncentrality s^2. Below r = 1 the upper end stays
    that of r = 1: an improbably short vector says nothing good about the measurement.
    """
    z = half_width(confidence)
    if r > _FAR:
        middle = r - 1 / (2 * r)  # the mean of r is s + 1/(2 s)
        return middle - z, middle + z
    from scipy.optimize import brentq
    from scipy.special import chndtr

    tail = (1 - confidence) / 2

    def above(s: float, x: float) -> float:
        return 1.0 - float(chndtr(x * x, 2, s * s))

    low = 0.0 if math.exp(-r * r / 2) >= tail else brentq(lambda s: above(s, r) - tail, 0.0, r)
    longer = max(r, 1.0)
    high = brentq(lambda s: above(s, longer) - (1 - tail), 0.0, longer + z + 2)
    return float(low), float(high)
