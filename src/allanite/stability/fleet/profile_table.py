# SPDX-License-Identifier: BSD-3-Clause
"""The profiles of one coefficient in many logs, as arrays: what each log says, beside what the fleet expects.

The signed root S of a profile is a chain of straight pieces over x, the logarithm of the coefficient. Beside a normal
expectation N(m, v) each piece of the likelihood exp(-S^2/2) is a normal density between two ends, so that its mass,
mean and variance have closed forms. With the origin at m and S = a + b x between l and u,

    mass = exp(-a^2 / (2 (1 + v b^2))) / sqrt(1 + v b^2)  [Phi(h) - Phi(g)],    P = b^2 + 1/v,
    g, h = (l + a b / P) sqrt(P), (u + a b / P) sqrt(P).                                                      (1)
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.stability.fleet.levels import LEVELS

__all__ = ["ProfileTable", "Tilted"]

Array = NDArray[np.float64]

_LEVELS = np.array(LEVELS)
_PIECES = 2  # between two levels
#: Roots above the floor, relative to that of the lowest level, to which the tail is followed.
_TAIL = np.array([0.03, 0.15, 0.35, 0.6])
_LEAST, _FAR = 1e-9, 50.0
#: A root that is off a straight line by no more than this is one.
_STRAIGHT = 0.03
_ROOT_2_PI = 0.5 * math.log(2 * math.pi)


@dataclass(frozen=True, slots=True)
class Tilted:
    """Expectation times likelihood.

    Attributes
    ----------
    log_mass : ndarray, shape (n,)
        Logarithm of the integral.
    mean, variance : ndarray, shape (n,)
        Of x.
    """

    log_mass: Array
    mean: Array
    variance: Array


@dataclass(frozen=True, slots=True)
class ProfileTable:
    """Profiles of n logs.

    Attributes
    ----------
    knots : ndarray, shape (n, 9)
        x where the signed root has the fixed levels; -inf where it does not get so low.
    root_at_zero : ndarray, shape (n,)
        The lowest value of the root.
    edges : ndarray, shape (n, m + 2)
        Ends of the pieces.
    offset, slope : ndarray, shape (n, m + 1)
        a and b of each piece.
    straight : ndarray of bool, shape (n,)
        The likelihood is a normal density.
    """

    knots: Array
    root_at_zero: Array
    edges: Array
    offset: Array
    slope: Array
    straight: NDArray[np.bool_]

    @classmethod
    def of(cls, knots: NDArray[np.floating[Any]], root_at_zero: Array) -> ProfileTable:
        """From the columns of a table."""
        x, floor = np.array(knots, dtype=np.float64), np.array(root_at_zero, dtype=np.float64)
        ends, roots = _chains(x, floor)
        slope, offset = _pieces(ends, roots)
        bounded = np.isfinite(floor)
        slope[:, 0], offset[:, 0] = (
            np.where(bounded, 0.0, slope[:, 0]),
            np.where(bounded, floor, offset[:, 0]),
        )
        out = np.full((len(x), 1), np.inf)
        return cls(x, floor, np.hstack((-out, ends, out)), offset, slope, _straight(x, floor))

    def __len__(self) -> int:
        return len(self.knots)

    def of_rows(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> ProfileTable:
        """Those of some logs."""
        return ProfileTable(*(getattr(self, name)[rows] for name in self.__slots__))

    @property
    def normal(self) -> tuple[Array, Array]:
        """Mean and precision of each likelihood near its best value; precision 0 where that is zero."""
        low, high = LEVELS.index(-0.75), LEVELS.index(0.75)
        width = self.knots[:, high] - self.knots[:, low]
        known = np.isfinite(width)
        middle = 0.5 * (self.knots[:, high] + self.knots[:, low])
        with np.errstate(invalid="ignore"):
            precision = np.where(known, (1.5 / width) ** 2, 0.0)
        return np.where(known, middle, 0.0), precision

    def root(self, x: Array) -> Array:
        """Signed root at one x for each log, shape (n,)."""
        piece = np.clip((self.edges[:, 1:-1] <= x[:, None]).sum(axis=1), 0, self.slope.shape[1] - 1)
        rows = np.arange(len(self))
        return np.asarray(self.offset[rows, piece] + self.slope[rows, piece] * x)

    def nearest(self, m: Array, v: Array) -> Array:
        """x that makes root^2 + (x - m)^2 / v least, shape (n,): where a likelihood and an expectation meet."""
        a, b, edges = self.offset, self.slope, self.edges
        mean, variance = m[:, None], v[:, None]
        x = np.clip((mean / variance - a * b) / (b**2 + 1 / variance), edges[:, :-1], edges[:, 1:])
        loss = (a + b * x) ** 2 + (x - mean) ** 2 / variance
        return np.asarray(np.take_along_axis(x, loss.argmin(axis=1)[:, None], axis=1)[:, 0])

    def tilted(self, m: Array, v: Array) -> Tilted:
        """Beside normal expectations of mean m and variance v, eq. (1)."""
        b, edges = self.slope, self.edges - m[:, None]
        a = self.offset + b * m[:, None]
        spread = 1.0 + v[:, None] * b**2
        root_P = np.sqrt(spread / v[:, None])
        center = -a * b * v[:, None] / spread
        g, h = (edges[:, :-1] - center) * root_P, (edges[:, 1:] - center) * root_P
        log_between = _log_between(g, h)
        log_weight = -0.5 * (a**2 / spread + np.log(spread)) + log_between
        top = log_weight.max(axis=1)
        weight = np.exp(log_weight - top[:, None])
        total = weight.sum(axis=1)
        with np.errstate(over="ignore", invalid="ignore"):
            at_g, at_h = _density_over(g, log_between), _density_over(h, log_between)
            shift = at_g - at_h
            mean = np.clip(center + shift / root_P, edges[:, :-1], edges[:, 1:])
            inner = 1.0 + _times(g, at_g) - _times(h, at_h) - shift**2
        variance = np.clip(np.nan_to_num(inner, nan=0.0), 0.0, 1.0) / root_P**2
        mean = np.where(weight > 0, np.nan_to_num(mean, neginf=0.0, posinf=0.0), 0.0)
        share = weight / total[:, None]
        first = (share * mean).sum(axis=1)
        second = (share * (variance + (mean - first[:, None]) ** 2)).sum(axis=1)
        return Tilted(top + np.log(total), m + first, np.maximum(second, 1e-12 * v))


def _ratio(a: Array, b: Array) -> Array:
    """a / b, and 0 where that is not a number."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(a / b, nan=0.0, posinf=0.0, neginf=0.0))


def _chains(x: Array, floor: Array) -> tuple[Array, Array]:
    """Ends of straight pieces and the roots there, filled up from below where a row has fewer."""
    width = len(_TAIL) + (len(_LEVELS) - 1) * _PIECES + 1
    ends, roots = np.zeros((len(x), width)), np.zeros((len(x), width))
    there = (x > -np.inf) & (_LEVELS > floor[:, None] + _LEAST)
    lowest = np.where(there.any(axis=1), np.argmax(there, axis=1), len(_LEVELS) - 2)
    group = 2 * lowest + np.isfinite(floor)
    for key in np.unique(group):
        rows = np.flatnonzero(group == key)
        chain = _chain(x[rows, key // 2 :], _LEVELS[key // 2 :], floor[rows] if key % 2 else None)
        for target, values in zip((ends, roots), chain, strict=True):
            target[rows, width - values.shape[1] :] = values
            target[rows, : width - values.shape[1]] = values[:, :1]
    return ends, roots


def _chain(x: Array, levels: Array, floor: Array | None) -> tuple[Array, Array]:
    """The profiles of rows with the same levels, as `levels.profile_of` restores one.

    x is a monotone cubic of y, which is S, or ln(S - r) where the loss ends in a floor r.
    """
    x = np.where(
        np.isfinite(x), x, np.maximum.accumulate(np.where(np.isfinite(x), x, -np.inf), axis=1) + _FAR
    )
    y = np.broadcast_to(levels, x.shape) if floor is None else np.log(levels - floor[:, None])
    h = np.diff(y, axis=1)
    slopes = _slopes(h, np.maximum(np.diff(x, axis=1) / h, _LEAST))
    t = np.arange(_PIECES) / _PIECES
    start, end, rise = x[:, :-1, None], x[:, 1:, None], h[:, :, None]
    inner = (
        (1 + 2 * t) * (1 - t) ** 2 * start
        + t * (1 - t) ** 2 * rise * slopes[:, :-1, None]
        + t**2 * (3 - 2 * t) * end
        - t**2 * (1 - t) * rise * slopes[:, 1:, None]
    ).reshape(len(x), -1)
    between = (y[:, :-1, None] + t * rise).reshape(len(x), -1)
    ends, ys = np.column_stack((inner, x[:, -1])), np.column_stack((between, y[:, -1]))
    if floor is None:
        return ends, ys
    ends = np.column_stack((x[:, :1] + _descent(slopes[:, :1], floor[:, None]), ends))
    ys = np.column_stack((y[:, :1] + np.log(_TAIL), ys))
    return ends, floor[:, None] + np.exp(ys)


def _descent(slope: Array, floor: Array) -> Array:
    """Change of x from the lowest level down to the roots of the tail; S^2 = a c^2 + b c^4 where c is best at zero."""
    share = np.clip(1.0 / slope - 1.0, 0.0, 1.0)
    u = (np.sqrt((1 - share) ** 2 + 4 * share * _TAIL**2) - (1 - share)) / np.maximum(2 * share, 1e-12)
    curved = (floor == 0) & (share > 1e-6) & (1.0 / slope < 2.0)
    return np.asarray(np.where(curved, 0.5 * np.log(np.maximum(u, 1e-300)), slope * np.log(_TAIL)))


def _slopes(h: Array, secants: Array) -> Array:
    """dx/dy at each level: weighted harmonic means of the secants, which keep the cubics monotone."""
    if h.shape[1] < 2:
        return np.repeat(secants, 2, axis=1)
    a, b = secants[:, :-1], secants[:, 1:]
    inner = (h[:, 1:] + h[:, :-1]) / (h[:, 1:] / a + h[:, :-1] / b)
    first = a[:, :1] * (a[:, :1] / b[:, :1]) ** (h[:, :1] / (h[:, :1] + h[:, 1:2]))
    last = b[:, -1:] * (b[:, -1:] / a[:, -1:]) ** (h[:, -1:] / (h[:, -1:] + h[:, -2:-1]))
    steepest = 3 * np.minimum(np.hstack((secants[:, :1], secants)), np.hstack((secants, secants[:, -1:])))
    return np.asarray(np.minimum(np.hstack((first, inner, last)), steepest))


def _pieces(ends: Array, roots: Array) -> tuple[Array, Array]:
    """Slopes and offsets between the ends, and of the tails, which go on as their neighbors do."""
    with np.errstate(invalid="ignore"):
        slope = _ratio(np.diff(roots, axis=1), np.diff(ends, axis=1))
    first = slope[np.arange(len(slope)), np.argmax(slope > 0, axis=1)]
    slope = np.column_stack((first, slope, slope[:, -1]))
    anchor, value = np.column_stack((ends[:, :1], ends)), np.column_stack((roots[:, :1], roots))
    return slope, value - slope * np.where(np.isfinite(anchor), anchor, 0.0)


def _straight(x: Array, floor: Array) -> NDArray[np.bool_]:
    """Rows whose root is one straight line that reaches far enough below."""
    known = np.isfinite(x).all(axis=1) & (floor <= _LEVELS[0])
    rows = np.where(known[:, None], x, _LEVELS)
    slope = (_LEVELS[-1] - _LEVELS[0]) / (rows[:, -1] - rows[:, 0])
    line = _LEVELS[0] + slope[:, None] * (rows - rows[:, :1])
    return np.asarray(known & (np.abs(line - _LEVELS).max(axis=1) < _STRAIGHT))


def _log_between(g: Array, h: Array) -> Array:
    """ln(Phi(h) - Phi(g)) for g <= h."""
    from scipy.special import log_ndtr

    above = g > 0
    high = log_ndtr(np.where(above, -g, h))
    low = log_ndtr(np.where(above, -h, g))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(h > g, high + np.log1p(-np.exp(np.minimum(low - high, 0.0))), -np.inf))


def _density_over(z: Array, log_between: Array) -> Array:
    """phi(z) over a mass."""
    return np.asarray(np.where(np.isfinite(z), np.exp(-0.5 * z**2 - _ROOT_2_PI - log_between), 0.0))


def _times(z: Array, density: Array) -> Array:
    return np.asarray(np.where(np.isfinite(z), z * density, 0.0))
