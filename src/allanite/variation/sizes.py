# SPDX-License-Identifier: BSD-3-Clause
"""Time and size of changes by maximum likelihood, given which terms change.

Minus twice the log-likelihood of all windows is, with the cube roots of `constancy` and the effect of the changes,

    L = z' C^-1 z + (2/3) sum ln(effect) - 2 sum ln a,    z = a (v/effect)^(1/3) - (1 - 2/(9 e)).                    (1)

Sizes have the interval of its curvature. The time of a step has the set of times at which L, least over the size, is
within 7.35 (for 95 %) of its minimum [1].

References
----------
.. [1] B. E. Hansen, "Sample splitting and threshold estimation", Econometrica 68 (2000) 575, theorem 2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from allanite.allan.cells import Cells
from allanite.laws import normal_quantile
from allanite.variation.constancy import Scatter, Whitened
from allanite.variation.shapes import Shape, effect_of

__all__ = ["FoundChange", "Misfit", "joint_effect", "placed", "ratio_of"]

Array = NDArray[np.float64]

_FINE = 8  # times within a window at which a step is placed
_ROUNDS, _STEP, _FARTHEST = 12, 0.02, 0.7
_LARGEST = 12.0  # logarithm of a ratio that is as good as infinite


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundChange:
    """One change in the units of the record.

    Attributes
    ----------
    shape : Shape
    lower, upper : float or None [samples]
        Set of times of a step.
    beta, sd : float
        Logarithm of the amplitude after over that before, and its standard deviation.
    p : float
        Chance of one as clear in a record whose noise is constant.
    """

    shape: Shape
    lower: float | None
    upper: float | None
    beta: float
    sd: float
    p: float


def joint_effect(changes: Sequence[FoundChange], cells: Cells, shares: Mapping[str, Array]) -> Array:
    """Variance of every cell under all changes over that of the whole record, shape (n_cells,)."""
    return effect_of([c.shape for c in changes], np.array([c.beta for c in changes]), cells, shares)


def ratio_of(change: FoundChange, confidence: float) -> tuple[float, float, float]:
    """Amplitude after over before, with its interval."""
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

    cells: Cells
    shares: Mapping[str, Array]
    centre: Array
    inverse: Array
    instrument: Array
    member: NDArray[np.bool_]

    @classmethod
    def of(cls, cells: Cells, scatter: Scatter, shares: Mapping[str, Array]) -> Misfit:
        """Of the cells of a record."""
        factor = Whitened.of(cells.variance, cells.row, scatter).factor
        inverse = factor.T @ factor
        member = cells.row[:, None] == np.arange(len(cells.lags))
        instrument = (scatter.centre[:, None] * member).T @ inverse
        return cls(cells, shares, scatter.centre, inverse, instrument, member)

    def __call__(self, shapes: Sequence[Shape], beta: Array) -> float:
        """L under these changes, levels solved for."""
        effect = effect_of(shapes, beta, self.cells, self.shares)
        if effect.min() <= 0 or np.abs(beta).max(initial=0.0) > _LARGEST:
            return math.inf
        u = np.cbrt(self.cells.variance / effect)
        a = np.linalg.solve((self.instrument * u) @ self.member, self.instrument @ self.centre)
        if a.min() <= 0:
            return math.inf
        level = a[self.cells.row]
        z = level * u - self.centre
        return float(z @ self.inverse @ z + 2 / 3 * np.log(effect).sum() - 2 * np.log(level).sum())


def placed(changes: Sequence[FoundChange], misfit: Misfit, confidence: float) -> list[FoundChange]:
    """Sizes of all changes, then the time of each step given the others, then sizes once more."""
    out = _sized(changes, misfit)
    for i, change in enumerate(out):
        if change.shape.time is not None:
            out[i] = _timed(change, out[:i] + out[i + 1 :], misfit, confidence)
    return _sized(out, misfit)


# -- sizes ---------------------------------------------------------------------------------------------------------


def _sized(changes: Sequence[FoundChange], misfit: Misfit) -> list[FoundChange]:
    shapes = [c.shape for c in changes]
    beta, hessian = _minimum(lambda at: misfit(shapes, at), np.array([c.beta for c in changes]))
    sds = np.sqrt(np.maximum(np.diag(2.0 * np.linalg.pinv(hessian)), 0.0))
    return [replace(c, beta=float(b), sd=float(s)) for c, b, s in zip(changes, beta, sds, strict=True)]


def _minimum(function: Callable[[Array], float], start: Array) -> tuple[Array, Array]:
    """Newton's method with halved steps; where the minimum lies, and the second derivatives there."""
    at, value = start, function(start)
    hessian = np.eye(len(at))
    for _ in range(_ROUNDS):
        gradient, hessian = _derivatives(function, at, value)
        values, vectors = np.linalg.eigh(hessian)
        step = vectors @ ((vectors.T @ gradient) / np.maximum(np.abs(values), 1e-6))
        step *= min(1.0, _FARTHEST / max(float(np.abs(step).max()), 1e-12))
        scale, new = 1.0, function(at - step)
        while new > value and scale > 1e-3:
            scale /= 2
            new = function(at - scale * step)
        if new > value:
            break
        at, value = at - scale * step, new
        if np.abs(scale * step).max() < 1e-3:
            break
    return at, hessian


def _derivatives(function: Callable[[Array], float], at: Array, middle: float) -> tuple[Array, Array]:
    """Gradient and Hessian by differences."""
    k, h = len(at), _STEP
    eye = h * np.eye(k)
    up = np.array([function(at + e) for e in eye])
    down = np.array([function(at - e) for e in eye])
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
    """The time with the least L, first among the borders of windows, then within the two windows around the best."""
    cells = misfit.cells
    borders = np.append(np.unique(cells.start[cells.row == 0]), cells.stop.max()).astype(np.float64)
    known = {t: _least(t, change, others, misfit) for t in borders[1:-1].tolist()}
    best = min(known, key=lambda t: known[t])
    k = int(np.searchsorted(borders, best))
    step = float(np.diff(borders).max()) / _FINE
    for t in np.arange(borders[k - 1] + step, borders[k + 1] - step / 2, step):
        known.setdefault(float(t), _least(float(t), change, others, misfit))
    best = min(known, key=lambda t: known[t])
    inside = [t for t, value in known.items() if value <= known[best] + _hansen(confidence)]
    # of a border the neighbours beyond were not tried: they may belong to the set as far as half a window
    reach = {t: step if borders[k - 1] <= t <= borders[k + 1] else _FINE * step / 2 for t in inside}
    return replace(
        change,
        shape=Shape(symbol=change.shape.symbol, time=best),
        lower=max(min(t - reach[t] for t in inside), 0.0),
        upper=min(max(t + reach[t] for t in inside), float(borders[-1])),
    )


def _least(time: float, change: FoundChange, others: Sequence[FoundChange], misfit: Misfit) -> float:
    """L of a step at a time, least over its size: two steps of Newton's method from the size at the best time."""
    shapes = [Shape(symbol=change.shape.symbol, time=time), *(c.shape for c in others)]
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
