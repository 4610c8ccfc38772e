# SPDX-License-Identifier: BSD-3-Clause
"""All scales that a fleet allows, with their weights.

The evidence of the scales gets the reference prior of a random-effects model [1]: per level and in ln tau, the root
mean square of tau^2 / (tau^2 + v) over its groups, v the variance of what each group says. Where scales are precisely
known that is the usual 1 / tau, of which intervals cover exactly; toward zero it falls with tau^2, so that a level that
nobody resolves gets a limit. Tails are normal unless the units reject that at 99 %; then the share of the wide part
gets Beta(1, 19), one unit in twenty before the data.

Draws come from Student's distribution about the mode, weighted by what the evidence says of each; where few of them
carry the weight, more are drawn about what these have found [2]. A large fleet leaves so narrow a distribution that the
normal one about the mode does.

References
----------
.. [1] O. Bodnar, A. Link, B. Arendacka, A. Possolo, C. Elster, "Bayesian estimation in random effects meta-analysis
   using a non-informative prior", Stat. Med. 36 (2017) 378.
.. [2] E. Veach, L. J. Guibas, "Optimally combining sampling techniques for Monte Carlo rendering", SIGGRAPH 95, 419.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.stability.fleet.evidence import Design, ScaleEvidence, Scales, evidence

__all__ = ["WIDE_FROM", "Posterior", "posterior_of"]

Array = NDArray[np.float64]

#: Twice the gain in evidence from which on a fleet has units that spread more widely: 99 % of the half chi-square.
WIDE_FROM = 5.41
_HALF_CHI_SQUARE = 3.84  # 97.5 %
_DRAWS, _DEGREES = 384, 6.0
_TURNS, _ENOUGH, _NARROWEST = 3, 0.3, 1e-4
_LARGE = 4000  # logs from which on the normal distribution about the mode serves
_BENT = 20_000
_STEP, _LONGEST, _CLOSE, _ROUNDS = 0.1, 1.5, 0.02, 15
_PRIOR_WIDE = 19.0
_FIRST_SHARE = -3.0  # logit
_FLAT, _STEEP = 0.05, 1e4  # curvature of the logarithm along any direction
_OCTAVES = 4  # down to where a scale adds 1/256 of the variance it has at the mode
_LOG_RANGE = (-9.0, 6.0)
_NEAR_END, _BEYOND = 1.0, 0.025
_SHARE_RANGE = (-9.0, 1.0)


@dataclass(frozen=True, slots=True)
class Posterior:
    """Draws of the scales, each with the location that goes with it.

    Attributes
    ----------
    scales : tuple of Scales
        n draws; the first is the mode.
    weight : ndarray, shape (n,)
        Sums to 1.
    location : ndarray, shape (n, p)
        beta, the mean for each draw.
    root : ndarray, shape (n, p, p)
        Of the covariance of beta.
    lots, lot_sd : ndarray, shape (n, n_lots)
        l for each draw, and its standard deviation for a given beta.
    lot_lean : ndarray, shape (n, n_lots, p)
        By how much l falls where beta rises: what a lot is expected to be, beta + l, is known far better than each.
    mode : ScaleEvidence
        At the mode.
    resolved : frozenset of str
        Levels whose scale is not compatible with zero at 97.5 %.
    tails : float
        Twice the gain in evidence by a wide part; `WIDE_FROM` and more: there is one.
    """

    scales: tuple[Scales, ...]
    weight: Array
    location: Array
    root: Array
    lots: Array
    lot_sd: Array
    lot_lean: Array
    mode: ScaleEvidence
    resolved: frozenset[str]
    tails: float

    @property
    def bounded(self) -> bool:
        """The units bound their own spread from above; two lots never bound theirs."""
        largest = np.log([s.unit for s in self.scales])
        return bool(self.weight[largest > _LOG_RANGE[1] - _NEAR_END].sum() < _BEYOND)


def posterior_of(design: Design, progress: Callable[[float], None] | None = None) -> Posterior:
    """Scales and location of a fleet.

    Parameters
    ----------
    design : Design
    progress : callable, optional
        Called with the fraction done.
    """
    report = progress or (lambda fraction: None)
    surface, mode, bend, tails = _peak(design, report)
    report(0.4)
    resolved = frozenset(level for level in surface.levels if surface.excludes_zero(mode, level))
    report(0.5)
    proposal = _Proposal(mode, np.linalg.cholesky(np.linalg.inv(bend)))
    if len(surface.design.unit) > _LARGE:
        points = surface.inside(proposal.points(normal=True))
        best = _Surface(design, wide=surface.wide).at(mode)[1]
        every, weight = [best] * _DRAWS, np.full(_DRAWS, 1.0 / _DRAWS)
    else:
        best = surface.at(mode)[1]
        points, every, weight = _weighted(surface, proposal, best, report)
    return Posterior(
        scales=tuple(surface.scales(point) for point in points),
        weight=weight,
        location=np.array([e.location for e in every]),
        root=np.array([np.linalg.cholesky(e.covariance) for e in every]),
        lots=np.array([e.lots for e in every]),
        lot_sd=np.sqrt([e.lot_variance for e in every]),
        lot_lean=np.array([e.lot_lean for e in every]),
        mode=best,
        resolved=resolved,
        tails=tails,
    )


@dataclass(frozen=True, slots=True)
class _Proposal:
    """Student's distribution about a center, shape (d,), whose scatter has this Cholesky factor."""

    center: Array
    root: Array

    def points(self, *, normal: bool = False) -> Array:
        """Spread evenly, the first at the center."""
        away, stretch = _even_draws(_DRAWS, len(self.center))
        away[0] = 0.0
        return self.center + (1.0 if normal else stretch[:, None]) * (away @ self.root.T)

    def log_density(self, points: Array) -> Array:
        """But for a constant that all have in common."""
        z = np.linalg.solve(self.root, (points - self.center).T)
        square = (z**2).sum(axis=0)
        return np.asarray(
            -0.5 * (_DEGREES + len(z)) * np.log1p(square / _DEGREES) - np.log(np.diag(self.root)).sum()
        )


def _weighted(
    surface: _Surface, proposal: _Proposal, best: ScaleEvidence, report: Callable[[float], None]
) -> tuple[Array, list[ScaleEvidence], Array]:
    """Draws with their weights.

    Few logs, or logs that contradict each other, leave a posterior that is not like its peak. Where the weights show
    that, draws are added about what the former ones have found; all are weighted by the mean of the proposals [2].
    """
    proposals, every, values = [proposal], [], np.zeros(0)
    points = np.zeros((0, len(proposal.center)))
    for turn in range(_TURNS):
        drawn = proposals[-1].points()
        for i, point in enumerate(surface.inside(drawn)):
            value, solution = surface.at(point, best)
            every.append(solution)
            values = np.append(values, value)
            report(0.5 + 0.5 * (turn + i / _DRAWS) / _TURNS)
        points = np.concatenate((points, drawn))
        log_weight = values - np.logaddexp.reduce([p.log_density(points) for p in proposals], axis=0)
        weight = np.exp(log_weight - log_weight.max())
        weight /= weight.sum()
        if 1.0 / float(weight @ weight) > _ENOUGH * _DRAWS:
            break
        center = weight @ points
        scatter = (points - center).T @ (weight[:, None] * (points - center))
        proposals.append(_Proposal(center, np.linalg.cholesky(scatter + _NARROWEST * np.eye(len(center)))))
    return surface.inside(points), every, weight


def _even_draws(n: int, dimensions: int) -> tuple[Array, Array]:
    """Normal numbers, and what makes them Student's, spread evenly: few random draws would set every interval askew.

    The additive recurrence of the generalized golden ratio, x^(d + 1) = x + 1.
    """
    from scipy.special import chdtri, ndtri

    ratio = 2.0
    for _ in range(40):
        ratio = (1.0 + ratio) ** (1.0 / (dimensions + 2))
    u = (0.5 + np.outer(np.arange(1, n + 1), ratio ** -np.arange(1.0, dimensions + 2))) % 1.0
    return np.asarray(ndtri(u[:, :-1])), np.sqrt(_DEGREES / chdtri(_DEGREES, 1.0 - u[:, -1]))


def _peak(design: Design, report: Callable[[float], None]) -> tuple[_Surface, Array, Array, float]:
    """The surface that serves, its mode, minus the second derivatives there, and the gain by a wide part.

    A large fleet is climbed in a part of it first. Bent profiles cost a hundred times as much as straight ones, so that
    no more than 20 000 of them say how large the scales are: half a percent is enough.
    """
    first = None
    if len(design.unit) > _LARGE:
        small, first, _, _ = _peak(design.thinned(_LARGE), report)
        first = first[: len(small.levels)]
        if np.count_nonzero(~design.profiles.straight) > _BENT:
            design = design.thinned(_BENT)
    surface, heavy = _Surface(design, wide=False), _Surface(design, wide=True)
    mode, bend = surface.climbed(surface.start() if first is None else first)
    report(0.2)
    mode_of_heavy, bend_of_heavy = heavy.climbed(np.array([*mode, _FIRST_SHARE]))
    tails = 2 * (heavy.at(mode_of_heavy)[1].value - surface.at(mode)[1].value)
    if tails >= WIDE_FROM:
        return heavy, mode_of_heavy, bend_of_heavy, tails
    return surface, mode, bend, tails


class _Surface:
    """The logarithm of the posterior over the logarithms of the scales and the logit of the wide share."""

    def __init__(self, design: Design, *, wide: bool) -> None:
        self.design, self.wide = design, wide
        present = {"lot": design.lots > 1, "unit": True, "repeat": design.repeats}
        self.levels = tuple(level for level, there in present.items() if there)
        self.near: ScaleEvidence | None = None

    def scales(self, point: Array) -> Scales:
        """At a point."""
        tau = dict.fromkeys(("lot", "unit", "repeat"), 0.0)
        tau |= {level: math.exp(x) for level, x in zip(self.levels, point, strict=False)}
        return Scales(**tau, wide=1.0 / (1.0 + math.exp(-point[-1])) if self.wide else 0.0)

    def inside(self, points: Array) -> Array:
        """Points within the range that is looked at."""
        n = len(self.levels)
        return np.column_stack((np.clip(points[:, :n], *_LOG_RANGE), np.clip(points[:, n:], *_SHARE_RANGE)))

    def start(self) -> Array:
        """From the scatter of the best values."""
        mean, precision = self.design.profiles.normal
        x = mean[precision > 0]
        quartiles = np.quantile(x, [0.25, 0.75]) if len(x) > 1 else np.array([0.0, 0.3])
        scatter = max(float(quartiles[1] - quartiles[0]) / 1.35, 1e-3)
        guess = {"lot": 0.5, "unit": 0.7, "repeat": 0.4}
        return np.array([math.log(guess[level] * scatter) for level in self.levels])

    def at(self, point: Array, near: ScaleEvidence | None = None) -> tuple[float, ScaleEvidence]:
        """Value and solution."""
        scales = self.scales(point)
        solution = evidence(self.design, scales, near or self.near)
        self.near = solution
        prior = math.log(scales.wide) + _PRIOR_WIDE * math.log1p(-scales.wide) if self.wide else 0.0
        prior += sum(math.log(max(solution.informed[level], 1e-12)) for level in self.levels)
        return solution.value + prior, solution

    def climbed(self, point: Array) -> tuple[Array, Array]:
        """The mode, and minus the second derivatives there."""
        bend = np.eye(len(point))
        value, near = self.at(point)
        for _ in range(_ROUNDS):
            slope, bend = self._bent(point, value, near)
            step = np.linalg.solve(bend, slope)
            step *= min(1.0, _LONGEST / float(np.abs(step).max()))
            for _ in range(6):
                ahead = self.inside((point + step)[None])[0]
                value_ahead, near_ahead = self.at(ahead, near)
                if value_ahead >= value - 1e-3:
                    break
                step *= 0.4
            moved = float(np.abs(ahead - point).max())
            if value_ahead > value - 1e-3:
                point, value, near = ahead, value_ahead, near_ahead
            if moved < _CLOSE:
                break
        return point, self._bent(point, value, near)[1]

    def _bent(self, point: Array, value: float, near: ScaleEvidence) -> tuple[Array, Array]:
        """Slope and minus the second derivatives, made positive, by central differences."""
        n = len(point)
        steps = _STEP * np.eye(n)
        up, down = (np.array([self.at(point + sign * s, near)[0] for s in steps]) for sign in (1, -1))
        slope = (up - down) / (2 * _STEP)
        second = np.diag((up - 2 * value + down) / _STEP**2)
        for i in range(n):
            for j in range(i):
                both = self.at(point + steps[i] + steps[j], near)[0]
                second[i, j] = second[j, i] = (both - up[i] - up[j] + value) / _STEP**2
        values, vectors = np.linalg.eigh(-second)
        return slope, np.asarray((vectors * np.clip(values, _FLAT, _STEEP)) @ vectors.T)

    def excludes_zero(self, mode: Array, level: str) -> bool:
        """Twice the gain in evidence over a level of zero, all others free, is beyond 97.5 % of the half chi-square."""
        index = self.levels.index(level)
        top = self.at(mode)[1].value
        low = mode.copy()
        free = [i for i in range(len(mode)) if i != index]
        for _ in range(_OCTAVES):
            low[index] -= math.log(2.0)
            value = self.at(low)[1].value
        if 2 * (top - value) < _HALF_CHI_SQUARE:
            return False
        if not free:
            return True
        from scipy.optimize import minimize

        def loss(x: Array) -> float:
            low[free] = x
            return -self.at(self.inside(low[None])[0])[1].value

        best = minimize(
            loss, mode[free], method="Nelder-Mead", options={"maxfev": 60, "xatol": 0.02, "fatol": 0.02}
        )
        return 2 * (top + min(float(best.fun), -value)) > _HALF_CHI_SQUARE
