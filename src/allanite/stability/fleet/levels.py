# SPDX-License-Identifier: BSD-3-Clause
"""A profile as nine numbers: where its signed root takes fixed values.

A table of a fleet holds the profile of each coefficient as the x (natural logarithm of the coefficient) at which the
signed root S of the loss equals each of `LEVELS`, and S at zero, r. Where S never gets so low, x is -inf; where it
never gets so high, +inf.

Between the levels the profile is restored by monotone cubics, of x against S where the record excludes zero beyond
doubt, and of x against ln(S - r) otherwise: the loss is smooth in the coefficient c, so that S approaches r in
proportion to a power of c, and its logarithm is nearly a straight line. The same line goes on below the lowest
level. A coefficient that is best at zero has r = 0 and

    S^2 = a c^2 + b c^4                                                                                    (1)

near zero (c an amplitude), with a and b from value and slope at the lowest level.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.stability.record_comparison.profiles import Profile, normal_profile

__all__ = ["LEVELS", "levels_of", "profile_of"]

Array = NDArray[np.float64]

#: Signed roots at which a profile is kept.
LEVELS = (-4.0, -2.5, -1.5, -0.75, 0.0, 0.75, 1.5, 2.5, 4.0)
_BEST = LEVELS.index(0.0)
_PIECES = 12  # knots of the restored profile for each interval between levels
_STRAIGHT = 2e-3  # S may be so far from a straight line, which float32 rounds
_TAIL_STEP = 0.25  # of ln(S - r) below the lowest level
_CLOSE = 0.01  # S this near to r is r
_APART = 0.02  # a level nearer to r than this says nothing of its x
_SQUARE = 0.5  # dx/dy where S - r goes with the square of the coefficient
_LEAST = 1e-9  # secant of levels that a float32 does not tell apart
_CRITICAL = 3.841458820694124  # of one normal parameter at 95 %


def levels_of(profile: Profile) -> tuple[Array, float]:
    """Reduce a profile to nine numbers and its root at zero.

    Parameters
    ----------
    profile : Profile

    Returns
    -------
    levels : ndarray, shape (9,)
        x at which the root equals each of `LEVELS`; -inf where it never gets so low, +inf where it never gets so high.
    root_at_zero : float
        Signed root at a coefficient of zero, at most 0; -inf where it goes on falling.
    """
    root_at_zero = -math.inf if profile.low > 0 else min(float(profile.roots[0]), 0.0)
    return np.array([_where(profile, level, root_at_zero) for level in LEVELS]), root_at_zero


def _where(profile: Profile, level: float, root_at_zero: float) -> float:
    if level <= root_at_zero + _APART:
        return -math.inf
    knots, roots = profile.knots, profile.roots
    if level > roots[-1]:
        return float(knots[-1] + (level - roots[-1]) / profile.high) if profile.high > 0 else math.inf
    if level < roots[0]:
        return float(knots[0] + (level - roots[0]) / profile.low)
    return float(np.interp(level, roots, knots))


def profile_of(levels: NDArray[np.floating], root_at_zero: float, critical: float = _CRITICAL) -> Profile:
    """Restore a profile from its nine numbers.

    Parameters
    ----------
    levels : ndarray, shape (9,)
        x at each of `LEVELS`, as `levels_of` gives them.
    root_at_zero : float
        Signed root at zero; -inf where it is beyond all levels.
    critical : float, default 3.84
        Loss that the truth exceeds with probability 1 - confidence.

    Returns
    -------
    Profile
        Its root is within 0.02 of the first one, or within 2 % of it, from -4 to 4.
    """
    at = np.asarray(levels, float)
    if not math.isfinite(root_at_zero) and _straight(at):
        return normal_profile(float(at[_BEST]), float(at[-1] - at[0]) / (LEVELS[-1] - LEVELS[0]), critical)
    inside = np.isfinite(at) & (np.asarray(LEVELS) > root_at_zero + _LEAST)
    if not inside.any():
        return _flat(critical)
    line = _Line(at[inside], np.asarray(LEVELS)[inside], root_at_zero)
    tail_x, tail_roots = line.tail()
    inner_x, inner_roots = line.inner()
    knots, values = np.r_[tail_x, inner_x], np.r_[tail_roots, inner_roots]
    return Profile(
        knots=knots,
        roots=values,
        low=0.0 if len(tail_x) else _slope(knots[:2], values[:2]),
        high=0.0 if at[-1] == np.inf else _slope(knots[-2:], values[-2:]),
        best=float(at[_BEST]),
        critical=critical,
    )


def _straight(at: Array) -> bool:
    line = np.interp(at, at[[0, -1]], (LEVELS[0], LEVELS[-1]))
    return bool(np.isfinite(at).all() and np.abs(line - LEVELS).max() < _STRAIGHT)


def _flat(critical: float) -> Profile:
    """A record that says nothing of the coefficient."""
    return Profile(
        knots=np.array([0.0, 1.0]), roots=np.zeros(2), low=0.0, high=0.0, best=-math.inf, critical=critical
    )


class _Line:
    """x as a monotone cubic of y, which is S or ln(S - r)."""

    def __init__(self, x: Array, roots: Array, root_at_zero: float) -> None:
        self.x, self.zero = x, root_at_zero
        self.y = self._forth(roots)
        self.slopes = _slopes(np.diff(self.y), np.maximum(np.diff(x) / np.diff(self.y), _LEAST))

    def _forth(self, roots: Array) -> Array:
        return np.asarray(np.log(roots - self.zero) if math.isfinite(self.zero) else roots)

    def _back(self, y: Array) -> Array:
        return np.asarray(self.zero + np.exp(y) if math.isfinite(self.zero) else y)

    def inner(self) -> tuple[Array, Array]:
        """Knots and roots from the lowest level to the highest."""
        t = np.arange(_PIECES) / _PIECES
        h = np.diff(self.y)[:, None]
        x = (
            (1 + 2 * t) * (1 - t) ** 2 * self.x[:-1, None]
            + t * (1 - t) ** 2 * h * self.slopes[:-1, None]
            + t**2 * (3 - 2 * t) * self.x[1:, None]
            - t**2 * (1 - t) * h * self.slopes[1:, None]
        )
        y = self.y[:-1, None] + t * h
        return np.r_[x.ravel(), self.x[-1]], np.r_[self._back(y.ravel()), self._back(self.y[-1:])]

    def tail(self) -> tuple[Array, Array]:
        """Knots and roots below the lowest level; none where the root goes on falling."""
        if not math.isfinite(self.zero):
            return np.empty(0), np.empty(0)
        steps = max(math.ceil((self.y[0] - math.log(_CLOSE)) / _TAIL_STEP), 1)
        down = -_TAIL_STEP * np.arange(steps, 0, -1)
        roots = self._back(self.y[0] + down)
        roots[0] = self.zero
        return self.x[0] + self._descent(down), roots

    def _descent(self, down: Array) -> Array:
        """Change of x while ln(S - r) changes by `down`."""
        rate = 1 / self.slopes[0]
        share = rate - 1.0
        if self.zero < 0 or not 0 < share < 1:
            return np.asarray(down / rate)
        # (1): with u = c^2 relative to the lowest level, (1 - share) u + share u^2 = exp(2 down)
        u = (np.sqrt((1 - share) ** 2 + 4 * share * np.exp(2 * down)) - (1 - share)) / (2 * share)
        return np.asarray(0.5 * np.log(u))


def _slopes(h: Array, secants: Array) -> Array:
    """dx/dy at each level: weighted harmonic means of the secants, which keep the cubics monotone."""
    if len(h) < 2:
        return np.full(len(h) + 1, secants[0] if len(h) else _SQUARE)
    inner = (h[1:] + h[:-1]) / (h[1:] / secants[:-1] + h[:-1] / secants[1:])
    first = secants[0] * (secants[0] / secants[1]) ** (h[0] / (h[0] + h[1]))
    last = secants[-1] * (secants[-1] / secants[-2]) ** (h[-1] / (h[-1] + h[-2]))
    steepest = 3 * np.minimum(np.r_[secants[0], secants], np.r_[secants, secants[-1]])
    return np.asarray(np.minimum(np.r_[first, inner, last], steepest))


def _slope(x: Array, roots: Array) -> float:
    return float((roots[1] - roots[0]) / (x[1] - x[0]))
