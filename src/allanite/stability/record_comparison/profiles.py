# SPDX-License-Identifier: BSD-3-Clause
"""What one record says of one parameter: how much worse its fit gets away from the best value.

A profile is D(x) >= 0, the loss of the fit with the parameter held at x and all others free: minus twice a
log-likelihood ratio. x is the natural logarithm of the parameter. Where the record only sets an upper limit, D is
zero (or constant) from the limit on down: such a record takes part with exactly what it knows.

Its signed root S, D = S^2, is nearly a straight line; it is kept at some knots and interpolated linearly. With a
spread tau of the true values about mu, the profile of mu is

    D_tau(mu) = min over x of  D(x) + (x - mu)^2 / tau^2,                                                  (1)

which for a normal estimate is (x - mu)^2 / (s^2 + tau^2), and holds for an upper limit as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = ["Chords", "Profile", "limit", "normal_profile", "traced"]

Array = NDArray[np.float64]

_FAR = 6.0  # roots beyond this are extrapolated: no test or interval reaches so far
_LOWEST = math.log(1e3)  # a parameter a thousand times below its limit is zero
_STEPS = 60
_CHORD, _WIDER = (
    0.5,
    0.25,
)  # widest step of the root without a knot, and by how much more far from the best value
_HALVINGS = 8
_NEGLIGIBLE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """The loss of a fit along one parameter.

    Attributes
    ----------
    knots : ndarray, shape (n,)
        x, increasing.
    roots : ndarray, shape (n,)
        Signed root of the loss, not decreasing.
    low, high : float
        Slopes of the root below the first knot and above the last; 0: constant.
    best : float
        Where the loss is least; -inf for a parameter that is best at zero.
    critical : float
        Loss that the truth exceeds with probability 1 - confidence.
    """

    knots: Array
    roots: Array
    low: float
    high: float
    best: float
    critical: float

    def root(self, x: Array) -> Array:
        """S(x)."""
        inside = np.interp(x, self.knots, self.roots)
        below = np.minimum(np.asarray(x) - self.knots[0], 0.0) * self.low
        above = np.maximum(np.asarray(x) - self.knots[-1], 0.0) * self.high
        return np.asarray(inside + below + above)

    def loss(self, mu: Array, tau: float = 0.0) -> Array:
        """D_tau(mu) of eq. (1), shape of mu."""
        if tau <= 0:
            return np.asarray(self.root(mu) ** 2)
        return Chords.of([self]).total(np.asarray(mu), tau)

    @property
    def normal(self) -> bool:
        """The root is one straight line."""
        return len(self.knots) == 2 and self.low == self.high

    @property
    def interval(self) -> tuple[float, float]:
        """Ends of the set of x at the level of `critical`; infinite where the record sets none."""
        edge = math.sqrt(self.critical)
        return self._where(-edge), self._where(edge)

    @property
    def supported(self) -> bool:
        """The set is bounded on both sides."""
        return all(math.isfinite(end) for end in self.interval)

    @property
    def sd(self) -> float:
        """Standard deviation that fits the width of the set; infinite for a limit."""
        low, high = self.interval
        return (high - low) / (2 * math.sqrt(self.critical))

    def _where(self, root: float) -> float:
        if root < self.roots[0]:
            return self.knots[0] + (root - self.roots[0]) / self.low if self.low > 0 else -math.inf
        if root > self.roots[-1]:
            return self.knots[-1] + (root - self.roots[-1]) / self.high if self.high > 0 else math.inf
        return float(np.interp(root, self.roots, self.knots))


@dataclass(frozen=True, slots=True, kw_only=True)
class Chords:
    """Roots of several profiles as pieces a + b x between two ends, shape (n_profiles, n_pieces) each.

    A profile of fewer pieces than another has its last one several times.
    """

    a: Array
    b: Array
    low: Array
    high: Array

    @classmethod
    def of(cls, profiles: Sequence[Profile]) -> Chords:
        """Of these profiles; the first and the last piece have no outer end."""
        most = max(len(p.knots) for p in profiles) + 2
        pieces = np.empty((4, len(profiles), most - 1))
        for i, p in enumerate(profiles):
            x = np.concatenate(([p.knots[0] - 1.0], p.knots, [p.knots[-1] + 1.0]))
            s = p.root(x)
            b = np.diff(s) / np.diff(x)
            n = len(b)
            pieces[:2, i, :n] = s[:-1] - b * x[:-1], b
            x[0], x[-1] = -np.inf, np.inf
            pieces[2:, i, :n] = x[:-1], x[1:]
            pieces[:, i, n:] = pieces[:, i, n - 1 : n]
        return cls(a=pieces[0], b=pieces[1], low=pieces[2], high=pieces[3])

    def total(self, mu: Array, tau: float) -> Array:
        """Sum of D_tau(mu) over the profiles, eq. (1): each piece has its minimum in closed form; shape of mu."""
        pull, stiff = tau**2 * self.a * self.b, 1 + tau**2 * self.b**2
        out = np.empty(mu.size)
        for i, m in enumerate(mu.flat):
            at = np.clip((m - pull) / stiff, self.low, self.high)
            out[i] = ((self.a + self.b * at) ** 2 + ((at - m) / tau) ** 2).min(axis=1).sum()
        return out.reshape(mu.shape)


def normal_profile(best: float, sd: float, critical: float) -> Profile:
    """The profile of a normal estimate."""
    return Profile(
        knots=np.array([best - sd, best + sd]),
        roots=np.array([-1.0, 1.0]),
        low=1 / sd,
        high=1 / sd,
        best=best,
        critical=critical,
    )


def traced(
    loss: Callable[[float], float],
    best: float,
    sd: float,
    critical: float,
    *,
    at_zero: float | None,
    bounds: tuple[float, float] = (-math.inf, math.inf),
) -> Profile:
    """A profile by walking from the best value outwards.

    Parameters
    ----------
    loss : callable
        D at x, warm-started from the call before.
    best, sd : float
        Where to start, and a first guess of the step.
    at_zero : float or None
        Loss at parameter zero (x = -inf); None where there is no zero.
    bounds : (float, float)
        Ends of the range in which the parameter is looked for; the loss is constant beyond.
    """
    step = min(max(0.5 * sd, 1e-9), 0.5)
    up_x, up_s, high = _walk(loss, best, step, bounds[1])
    floor = bounds[0] if at_zero is None else best - _LOWEST
    # below zero by rounding where zero is as good as the best
    ceiling = None if at_zero is None else math.sqrt(max(at_zero, 0.0))
    down_x, down_s, low = _walk(loss, best, -step, floor, ceiling)
    if ceiling is not None and not low and (not down_x or down_x[-1] > floor):
        down_x.append(floor)
        down_s.append(ceiling)
    knots = np.array([*down_x[::-1], best, *up_x])
    roots = np.maximum.accumulate(np.array([*(-s for s in down_s[::-1]), 0.0, *up_s]))
    return Profile(knots=knots, roots=roots, low=low, high=high, best=best, critical=critical)


def limit(loss: Callable[[float], float], guess: float, critical: float) -> Profile:
    """The profile of a parameter that is best at zero; `guess` is an x near which the loss is small."""
    x = guess
    while loss(x) > _NEGLIGIBLE and x > guess - _LOWEST:
        x -= 1.0
    up_x, up_s, high = _walk(loss, x, 0.5, math.inf)
    return Profile(
        knots=np.array([x, *up_x]),
        roots=np.maximum.accumulate(np.array([0.0, *up_s])),
        low=0.0,
        high=high,
        best=-math.inf,
        critical=critical,
    )


def _walk(
    loss: Callable[[float], float], start: float, step: float, end: float, ceiling: float | None = None
) -> tuple[list[float], list[float], float]:
    """Knots and roots on one side, and the slope beyond them (0: constant)."""
    xs: list[float] = []
    roots: list[float] = []
    x, before, slope = start, 0.0, 0.0
    if (x - end) * step >= 0:
        return xs, roots, 0.0
    for _ in range(_STEPS):
        x = x + step
        last = (x - end) * step >= 0
        x = end if last else x
        value = math.sqrt(max(loss(x), 0.0))
        value = max(value, before) if ceiling is None else min(max(value, before), ceiling)
        slope = (value - before) / abs(x - (xs[-1] if xs else start))
        xs.append(x)
        roots.append(value)
        if last or (ceiling is not None and value > 0.98 * ceiling):
            return *_refined(loss, start, xs, roots), 0.0
        if value > _FAR:
            return *_refined(loss, start, xs, roots), slope
        step *= 1.5 if value - before < 1.0 else 1.0
        before = value
    return *_refined(loss, start, xs, roots), 0.0


def _refined(
    loss: Callable[[float], float], start: float, xs: Sequence[float], roots: Sequence[float]
) -> tuple[list[float], list[float]]:
    """With knots between those whose chord would cut a bend: a limit's root doubles over 0.35."""
    fine = [(start, 0.0)]
    for end in zip(xs, roots, strict=True):
        fine += _between(loss, fine[-1], end, _HALVINGS)
    return [x for x, _ in fine[1:]], [root for _, root in fine[1:]]


def _between(
    loss: Callable[[float], float], a: tuple[float, float], b: tuple[float, float], halvings: int
) -> list[tuple[float, float]]:
    """Knots after a, up to b."""
    if not halvings or a[1] > _FAR or b[1] - a[1] <= _CHORD + _WIDER * a[1]:
        return [b]
    x = 0.5 * (a[0] + b[0])
    middle = (x, min(max(math.sqrt(max(loss(x), 0.0)), a[1]), b[1]))
    return [*_between(loss, a, middle, halvings - 1), *_between(loss, middle, b, halvings - 1)]
