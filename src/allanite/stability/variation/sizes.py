# SPDX-License-Identifier: BSD-3-Clause
"""Time and size of changes by maximum likelihood, given which terms change.

Minus twice the log-likelihood of all windows is, with the cube roots of `constancy` and the effect of the changes,

    L = z' C^-1 z + ln det C + (2/3) sum ln(effect) - 2 sum ln a,    z = a (v/effect)^(1/3) - (1 - 2/(9 e)).        (1)

A window that a step divides has fewer degrees of freedom e than one of constant noise (`shapes`, equation 1): its
variance in C and its mean follow them, its correlations stay. The shares of the terms, from which the effect follows,
are known to some doubt D (`shapes`), a change of ln(effect) by D e with e standard normal: z has the covariance

    C + G G',    G = (1 - 2/(9 e)) D/3                                                                            (2)

where it is free of the levels; C alone in (1) would have sizes too sure wherever a term shrinks.

Sizes have the interval of the curvature of L. The time of a step has the set of times at which L, least over the size,
is within 7.35 (for 95 %) of its minimum [1].

References
----------
.. [1] B. E. Hansen, "Sample splitting and threshold estimation", Econometrica 68 (2000) 575, theorem 2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan.cells import AllanCells
from allanite.quantities.distributions import normal_quantile
from allanite.stability.variation.constancy import Whitened, WindowScatter
from allanite.stability.variation.shapes import ChangeShape, doubt_of_effect, effect_of, spread_of

__all__ = ["FoundChange", "Misfit", "joint_effect", "placed", "ratio_of", "sized"]

Array = NDArray[np.float64]

_FINE = 8  # times within a window at which a step is placed, and again between two of them
_ROUNDS, _STEP, _FARTHEST = 40, 0.02, 0.7
_LARGEST = 25.0  # logarithm of a ratio that is as good as infinite
_FEWEST = 1.0  # degrees of freedom: a sum of squares has no fewer


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundChange:
    """One change in the units of the record.

    Attributes
    ----------
    shape : ChangeShape
    lower, upper : float or None [samples]
        Set of times of a step.
    beta, sd : float
        Logarithm of the amplitude after over that before, and its standard deviation; infinite where the windows do
        not tell it.
    p : float
        Chance of one as clear in a record whose noise is constant.
    """

    shape: ChangeShape
    lower: float | None
    upper: float | None
    beta: float
    sd: float
    p: float


def joint_effect(changes: Sequence[FoundChange], cells: AllanCells, shares: Mapping[str, Array]) -> Array:
    """Variance of every cell under all changes over that of the whole record, shape (n_cells,)."""
    return effect_of([c.shape for c in changes], np.array([c.beta for c in changes]), cells, shares)


def ratio_of(change: FoundChange, confidence: float) -> tuple[float, float, float]:
    """Amplitude after over before, with its interval; from zero to infinity where the size is not known."""
    if not math.isfinite(change.sd):
        return math.exp(change.beta), 0.0, math.inf
    reach = normal_quantile(0.5 + confidence / 2) * change.sd
    low, high = max(change.beta - reach, -_LARGEST), min(change.beta + reach, _LARGEST)
    return math.exp(change.beta), math.exp(low), math.exp(high)


@dataclass(frozen=True, slots=True)
class Misfit:
    """L of equation (1) for any changes of one record.

    Attributes
    ----------
    inverse : ndarray, shape (n_cells, n_cells)
        C^-1.
    instrument : ndarray, shape (n_lags, n_cells)
        Means of the cells of each lag times C^-1: what levels are solved with.
    """

    cells: AllanCells
    shares: Mapping[str, Array]
    doubts: Mapping[str, Array]
    edf: Array
    centre: Array
    inverse: Array
    instrument: Array
    member: NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        cells: AllanCells,
        scatter: WindowScatter,
        shares: Mapping[str, Array],
        doubts: Mapping[str, Array],
    ) -> Misfit:
        """Of the cells of a record."""
        factor = Whitened.of(cells.variance, cells.row, scatter).factor
        inverse = factor.T @ factor
        member = cells.row[:, None] == np.arange(len(cells.lags))
        instrument = (scatter.centre[:, None] * member).T @ inverse
        return cls(cells, shares, doubts, scatter.edf, scatter.centre, inverse, instrument, member)

    def __call__(self, shapes: Sequence[ChangeShape], beta: Array) -> float:
        """L under these changes, levels solved for."""
        if np.abs(beta).max(initial=0.0) > _LARGEST:
            return math.inf
        effect = effect_of(shapes, beta, self.cells, self.shares)
        if effect.min() <= 0:
            return math.inf
        widened = np.sqrt(self._widened(shapes, beta))
        centre = 1.0 - 2.0 / 9.0 * widened**2 / self.edf
        # the instrument of other means and variances, from that of constant noise: few windows are divided
        weight = centre / widened
        other = np.flatnonzero(weight != self.centre)
        moved = (self.member[other] * (weight - self.centre)[other, None]).T @ self.inverse[other]
        levels = self.instrument + moved
        instrument = levels / widened
        u = np.cbrt(self.cells.variance / effect)
        try:
            a = np.linalg.solve((instrument * u) @ self.member, instrument @ centre)
        except np.linalg.LinAlgError:
            return math.inf
        if not a.min() > 0:
            return math.inf
        level = a[self.cells.row]
        z = (level * u - centre) / widened
        scale = 2 * np.log(widened).sum() + 2 / 3 * np.log(effect).sum() - 2 * np.log(level).sum()
        white = self.inverse @ z
        return float(z @ white + scale) + self._doubted(shapes, beta, weight, levels, white)

    def _doubted(
        self, shapes: Sequence[ChangeShape], beta: Array, mean: Array, levels: Array, white: Array
    ) -> float:
        """What L changes by with equation (2) in place of C: G of rank k, free of the levels (Woodbury)."""
        G = mean[:, None] / 3 * doubt_of_effect(shapes, beta, self.cells, self.shares, self.doubts)
        across = levels @ G
        inner = G.T @ self.inverse @ G
        inner -= across.T @ np.linalg.solve(levels @ (mean[:, None] * self.member), across)
        inner[np.diag_indices_from(inner)] += 1.0
        projected = G.T @ white
        return float(np.linalg.slogdet(inner)[1] - projected @ np.linalg.solve(inner, projected))

    def _widened(self, shapes: Sequence[ChangeShape], beta: Array) -> Array:
        """Degrees of freedom under constant noise over those under these changes."""
        return np.minimum(
            spread_of(shapes, beta, self.cells, self.shares), np.maximum(self.edf / _FEWEST, 1.0)
        )


def placed(changes: Sequence[FoundChange], misfit: Misfit, confidence: float) -> list[FoundChange]:
    """Sizes of all changes, then the time of each step given the others, then sizes once more."""
    out, _ = sized(changes, misfit)
    for i, change in enumerate(out):
        if change.shape.time is not None:
            out[i] = _timed(change, out[:i] + out[i + 1 :], misfit, confidence)
    return sized(out, misfit)[0]


# -- sizes ---------------------------------------------------------------------------------------------------------


def sized(changes: Sequence[FoundChange], misfit: Misfit) -> tuple[list[FoundChange], float]:
    """The changes with the sizes at which L is least, and L there."""
    shapes = [c.shape for c in changes]
    beta, loss, hessian = _minimum(lambda at: misfit(shapes, at), np.array([c.beta for c in changes]))
    sds = _deviations(hessian)
    out = [replace(c, beta=float(b), sd=float(s)) for c, b, s in zip(changes, beta, sds, strict=True)]
    return out, loss


def _deviations(hessian: Array) -> Array:
    """Standard deviations by the curvature of L; infinite where it has no minimum."""
    unknown = np.full(len(hessian), math.inf)
    if not np.isfinite(hessian).all():
        return unknown
    values, vectors = np.linalg.eigh(hessian)
    if values.min() <= 1e-9 * abs(values.max()):
        return unknown
    return np.asarray(np.sqrt(2.0 * (vectors**2 / values).sum(axis=1)))


def _minimum(function: Callable[[Array], float], start: Array) -> tuple[Array, float, Array]:
    """Newton's method with halved steps; where the minimum lies, its value, and the second derivatives there.

    Where the function or its derivatives are not finite the way ends; the derivatives tell it.
    """
    at, value = start, function(start)
    hessian = np.full((len(at), len(at)), math.nan)
    for _ in range(_ROUNDS):
        gradient, hessian = _derivatives(function, at, value)
        if not (np.isfinite(gradient).all() and np.isfinite(hessian).all()):
            break
        values, vectors = np.linalg.eigh(hessian)
        step = vectors @ ((vectors.T @ gradient) / np.maximum(np.abs(values), 1e-6))
        step *= min(1.0, _FARTHEST / max(float(np.abs(step).max()), 1e-12))
        scale, new = 1.0, function(at - step)
        while not new <= value and scale > 1e-3:
            scale /= 2
            new = function(at - scale * step)
        if not new <= value:
            break
        at, value = at - scale * step, new
        if np.abs(scale * step).max() < 1e-3:
            break
    return at, value, hessian


def _derivatives(function: Callable[[Array], float], at: Array, middle: float) -> tuple[Array, Array]:
    """Gradient and Hessian by differences."""
    k, h = len(at), _STEP
    eye = h * np.eye(k)
    up = np.array([function(at + e) for e in eye])
    down = np.array([function(at - e) for e in eye])
    if not (math.isfinite(middle) and np.isfinite(up).all() and np.isfinite(down).all()):
        return np.full(k, math.nan), np.full((k, k), math.nan)
    hessian = np.diag((up - 2 * middle + down) / h**2)
    for i in range(k):
        for j in range(i):
            same = function(at + eye[i] + eye[j]) + function(at - eye[i] - eye[j])
            other = function(at + eye[i] - eye[j]) + function(at - eye[i] + eye[j])
            hessian[i, j] = hessian[j, i] = (same - other) / (4 * h**2)
    return (up - down) / (2 * h), hessian


# -- times ---------------------------------------------------------------------------------------------------------


def _timed(
    change: FoundChange, others: Sequence[FoundChange], misfit: Misfit, confidence: float
) -> FoundChange:
    """The time with the least L: first among the borders of windows, then closer and closer around the best.

    Of a large step the divided window tells the time to a sample, and no coarser time explains it.
    """
    cells = misfit.cells
    borders = np.append(np.unique(cells.start[cells.row == 0]), cells.stop.max()).astype(np.float64)
    known = {t: _least(t, change, others, misfit) for t in borders[1:-1].tolist()}
    best, step = min(known, key=lambda t: known[t]), float(np.diff(borders).max())
    k, level = int(np.searchsorted(borders, best)), _hansen(confidence)
    low, high = float(borders[k - 1]), float(borders[k + 1])
    while True:
        step /= _FINE
        for t in np.unique(np.rint(np.arange(low + step, high - step / 2, step))).tolist():
            if t not in known:  # a step lies between two samples
                known[t] = _least(t, change, others, misfit)
        best = min(known, key=lambda t: known[t])
        low, high = best - step, best + step
        if step <= 1 or all(known.get(t, math.inf) <= known[best] + level for t in _beside(best, known)):
            break
    ends = _ends(known, level, float(np.diff(borders).max()) / _FINE)
    return replace(
        change,
        shape=ChangeShape(symbol=change.shape.symbol, time=best),
        lower=max(ends[0], 0.0),
        upper=min(ends[1], float(borders[-1])),
    )


def _beside(time: float, known: Mapping[float, float]) -> list[float]:
    """The times that were tried next before and after one."""
    return [*sorted(t for t in known if t < time)[-1:], *sorted(t for t in known if t > time)[:1]]


def _ends(known: Mapping[float, float], level: float, fine: float) -> tuple[float, float]:
    """Of the set of times: as far as the next time that was tried and is outside, half as far between borders."""
    bar = min(known.values()) + level
    inside = [t for t, value in known.items() if value <= bar]
    ends = []
    for end, way in ((min(inside), -1.0), (max(inside), 1.0)):
        gap = min((way * (t - end) for t in known if way * (t - end) > 0), default=_FINE * fine)
        ends.append(end + way * (gap if gap < 1.5 * fine else gap / 2))
    return ends[0], ends[1]


def _least(time: float, change: FoundChange, others: Sequence[FoundChange], misfit: Misfit) -> float:
    """L of a step at a time, least over its size: two steps of Newton's method from the size at the best time."""
    shapes = [ChangeShape(symbol=change.shape.symbol, time=time), *(c.shape for c in others)]
    fixed = [c.beta for c in others]
    trials = {}

    def value(beta: float) -> float:
        if beta not in trials:
            trials[beta] = misfit(shapes, np.array([beta, *fixed]))
        return trials[beta]

    at = change.beta
    for _ in range(2):
        up, middle, down = value(at + _STEP), value(at), value(at - _STEP)
        curvature = (up - 2 * middle + down) / _STEP**2
        if not (math.isfinite(curvature) and curvature > 0):
            break
        at -= float(np.clip((up - down) / (2 * _STEP) / curvature, -_FARTHEST, _FARTHEST))
        value(at)
    return min(trials.values())


def _hansen(confidence: float) -> float:
    """Quantile of the likelihood ratio of a time: P(ratio < x) = (1 - exp(-x/2))^2 [1]."""
    return -2.0 * math.log(1.0 - math.sqrt(confidence))
