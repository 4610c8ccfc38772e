# SPDX-License-Identifier: BSD-3-Clause
"""Log-likelihood of a sum of terms, its gradient and its expected information, from the pools of a record.

With the covariance V = sum_t c_t E_t of the vectors of a pool, their number n, mean m and second moments S, and r the
vector that a ramp of unit slope makes,

    ln p = -n/2 [d ln 2 pi + ln det V + tr V^-1 S(b)],     S(b) = S - b (m r' + r m') + b^2 r r',        (1)
    d ln p / dc_t = n/2 tr V^-1 E_t V^-1 (S(b) - V),                                                     (2)
    information_tu = n/2 tr V^-1 E_t V^-1 E_u,                                                           (3)

less the same for the components that are given. The slow contrasts of the last rows, but for the slowest, count as
vectors of one component each. The slope b follows from the rest in closed form (generalised least
squares), so that (2) is the gradient of the profile over it. Averaged over all slopes instead, ln p has
(ln 2 pi - ln I)/2 more, I = n r' V^-1 r being the information on the slope, and (2) (n/2I) r' V^-1 E_t V^-1 r.

All in sample units: interval 1, variance coefficients c = Q^2, N^2, B^2, K^2, and sigma^2 of Gauss-Markov terms.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite._kernels import pool_likelihood
from allanite.fitting.design import LINEAR
from allanite.fitting.likelihood.pool import KINDS, Pool, autocovariance
from allanite.fitting.likelihood.pyramid import LikelihoodPyramid
from allanite.lazy_dataclasses import dataclass
from allanite.noise import GaussMarkov, TermType

__all__ = ["LikelihoodValue", "Objective", "Point", "RandomTerm"]

Array = NDArray[np.float64]

#: Step of ln T in the derivative of a covariance; its error is of the order of the square.
_LOG_STEP = 1e-3
#: Covariances of Gauss-Markov terms that are kept.
_KEPT = 200
#: Distance in ln T of the correlation times whose covariances are computed; between them they are interpolated.
_SPACING = 1 / 16
#: Terms of the first kinds of extra noise.
_QUICK = "NQ"
_LOG_2_PI = math.log(2 * math.pi)


@dataclass(frozen=True, slots=True)
class RandomTerm:
    """One random term: its letter (Q, N, B, K or G), and the correlation time of a G [samples]."""

    symbol: str
    T: float | None = None

    def unit(self, stretch: float = 1.0) -> TermType:
        """The unit process, with its correlation time stretched by a factor."""
        if self.T is None:
            return LINEAR[self.symbol]
        return GaussMarkov.from_sigma(1.0, self.T * stretch)


@dataclass(frozen=True, slots=True)
class Point:
    """A place in parameter space.

    Attributes
    ----------
    components : tuple of RandomTerm
    c : ndarray, shape (n_components,)
        Variance coefficients, not negative.
    slope : float or None
        Of the ramp per sample; None: whatever fits best.
    averaged : bool
        Of a free slope: the likelihood is its mean over all slopes instead of its value at the best (restricted
        likelihood), as it is for the level of the record. The noise is then not judged too small by what a ramp takes.
    """

    components: tuple[RandomTerm, ...]
    c: Array
    slope: float | None = 0.0
    averaged: bool = False


@dataclass(frozen=True, slots=True)
class LikelihoodValue:
    """What the record says there.

    Attributes
    ----------
    log_likelihood : float
    gradient : ndarray, shape (n_components + n_times,)
        With the coefficients, then with ln T of each Gauss-Markov term in order.
    information : ndarray, square
        Expected, of the same.
    slope, slope_information : float
        The slope used, and the information on it.
    """

    log_likelihood: float
    gradient: Array
    information: Array
    slope: float
    slope_information: float


@dataclass(frozen=True, slots=True)
class _Vectors:
    """What the record leaves, divided by the scale, as the kernel takes it.

    Attributes
    ----------
    shapes : ndarray of int64, shape (n_pools, 3)
        Of the pools, and of the slowest modes as a pool of one vector: components, how many are given, vectors.
    moments : ndarray
        Of each of them the mean, what a ramp makes of it, and the second moments.
    value, tilt : ndarray, shape (n_quick,)
        The quicker of the slow contrasts: vectors of one component, each with a variance of its own.
    dimensions : int
        Numbers that are not given, in all.
    """

    shapes: NDArray[np.int64]
    moments: Array
    value: Array
    tilt: Array
    dimensions: int

    @classmethod
    def of(cls, pyramid: LikelihoodPyramid, scale: float) -> _Vectors:
        shapes = [(p.size, p.given, p.count) for p in pyramid.pools]
        moments = [
            part for p in pyramid.pools for part in (p.mean / scale, p.tilt, p.second.ravel() / scale**2)
        ]
        value = tilt = np.zeros(0)
        if (modes := pyramid.modes) is not None:
            x, low = modes.value / scale, modes.low
            shapes.append((low, 0, 1))
            moments += [x[:low], modes.tilt[:low], np.outer(x[:low], x[:low]).ravel()]
            value, tilt = x[low:].copy(), modes.tilt[low:].copy()
        dimensions = len(value) + sum(count * (size - given) for size, given, count in shapes)
        at = np.array(shapes, dtype=np.int64).reshape(-1, 3)
        return cls(at, np.concatenate([*moments, np.zeros(0)]), value, tilt, dimensions)


@dataclass(slots=True)
class Objective:
    """Likelihood of the random terms of a record, in sample units; samples divided by `scale`.

    Attributes
    ----------
    pyramid : LikelihoodPyramid
    sampling : "mean" or "point"
    scale : float
        Root mean square of the contrasts of the first level: keeps all numbers of order one, whatever the unit.
    """

    pyramid: LikelihoodPyramid
    sampling: str
    scale: float
    _vectors: _Vectors = field(init=False)
    _expected: dict[RandomTerm, Array] = field(default_factory=dict)
    _nodes: dict[RandomTerm, Array] = field(init=False)

    def __post_init__(self) -> None:
        layout = self.pyramid.layout
        self._nodes = {} if layout is None else _nodes_of(layout, self.sampling)
        # constant samples have nothing to say, as the caller sees by the scale
        scale = self.scale if self.scale > 0 and math.isfinite(self.scale) else 1.0
        self._vectors = _Vectors.of(self.pyramid, scale)

    @classmethod
    def of(cls, pyramid: LikelihoodPyramid, sampling: str) -> Objective:
        """The objective of a record."""
        return cls(pyramid, sampling, _scale(pyramid))

    # -- the model side -----------------------------------------------------------------------------------

    def matrices(self, component: RandomTerm) -> list[Array]:
        """E_t for every pool and the slowest modes, shape (1, d, d).

        Of a Gauss-Markov term its derivative with ln T too, shape (2, d, d).
        """
        rows, place, parts = self.expected(component), 0, []
        for d in self._vectors.shapes[:, 0].tolist():
            parts.append(rows[:, place : place + d * d].reshape(-1, d, d))
            place += d * d
        return parts

    def variances(self, component: RandomTerm) -> Array:
        """Variances of all modes, shape (1, n) or (2, n)."""
        low = 0 if self.pyramid.modes is None else self.pyramid.modes.low
        rows, quick = self.expected(component), len(self._vectors.value)
        slow = self.matrices(component)[-1].diagonal(axis1=1, axis2=2) if low else rows[:, :0]
        return np.concatenate([slow, rows[:, rows.shape[1] - quick :]], axis=1)

    def expected(self, component: RandomTerm) -> Array:
        """Covariances of all vectors side by side, shape (1, n).

        Of a Gauss-Markov term their derivative with ln T too, shape (2, n).
        """
        if component not in self._expected:
            if len(self._expected) > _KEPT:
                self._expected = {k: v for k, v in self._expected.items() if k.T is None}
            T = component.T
            self._expected[component] = (
                self._node(component) if T is None else self._between(component.symbol, math.log(T))
            )
        return self._expected[component]

    def _computed(self, component: RandomTerm) -> Array:
        units = [component.unit()]
        if component.T is not None:
            units += [component.unit(math.exp(_LOG_STEP)), component.unit(math.exp(-_LOG_STEP))]
        extra = self._extra(component.symbol, units)

        def series(count: int, block: int) -> Array:
            return _with_derivative(self._series(units, count, block))

        parts = [p.expected(series, extra) for p in self.pyramid.pools]
        rows = [part.reshape(len(extra), -1) for part in parts]
        if (modes := self.pyramid.modes) is not None:
            low, variances = modes.expected(series, extra)
            rows += [low.reshape(len(extra), -1), variances[:, modes.low :]]
        return np.concatenate(rows, axis=1)

    def _between(self, symbol: str, log_time: float) -> Array:
        """Hermite's cubic between two correlation times: to 5e-7, and a search tries thousands of them."""
        place = log_time / _SPACING
        low = math.floor(place)
        s = place - low
        near = (RandomTerm(symbol, math.exp(k * _SPACING)) for k in (low, low + 1))
        ends = np.concatenate([self._node(component) for component in near])
        rise, rest = 3 * s**2 - 2 * s**3, 1 - s
        slope = 6 * s * rest / _SPACING
        weights = np.array(
            [
                [1 - rise, _SPACING * s * rest**2, rise, -_SPACING * s**2 * rest],
                [-slope, rest * (1 - 3 * s), slope, s * (3 * s - 2)],
            ]
        )
        return np.asarray(weights @ ends)

    def _node(self, component: RandomTerm) -> Array:
        """All covariances of a term; of a Gauss-Markov term at a correlation time of the grid, in two rows."""
        if component not in self._nodes:
            self._nodes[component] = self._computed(component)
        return self._nodes[component]

    def _series(self, units: Sequence[TermType], count: int, block: int) -> Array:
        return np.array([autocovariance(u, count, block, self.sampling) for u in units])

    def _extra(self, symbol: str, units: Sequence[TermType]) -> Array:
        """How much extra noise of each kind incomplete blocks have, shape (1, KINDS) or (2, KINDS)."""
        extra = np.zeros((len(units), KINDS))
        if symbol in _QUICK:
            extra[:, _QUICK.index(symbol)] = 1.0
        else:
            for i, gaps in enumerate(self.pyramid.gaps):
                if gaps.walk > 0:
                    series = self._series(units, len(gaps.shape), gaps.block)
                    extra[:, len(_QUICK) + i] = series @ gaps.shape / gaps.walk
        return _with_derivative(extra)

    # -- the likelihood -----------------------------------------------------------------------------------

    def value(self, at: Point) -> float:
        """Logarithm of the likelihood of the samples as they are (their unit included)."""
        return self(at).log_likelihood

    def __call__(self, at: Point) -> LikelihoodValue:
        """Value, gradient and information; a covariance that is not positive definite has the value -inf."""
        vectors, scale = self._vectors, self.scale
        of_terms = [self.expected(k) for k in at.components]
        rows = [rows[0] for rows in of_terms]
        rows += [c * rows[1] for c, rows in zip(at.c, of_terms, strict=True) if len(rows) > 1]
        head, information = pool_likelihood(
            np.asarray(at.c, dtype=np.float64),
            np.array(rows),
            vectors.shapes,
            vectors.moments,
            vectors.value,
            vectors.tilt,
            math.nan if at.slope is None else at.slope / scale,
            at.averaged,
        )
        deviance, slope, slope_information = head[:3].tolist()
        slope_information /= scale**2
        value = -(vectors.dimensions * (_LOG_2_PI + 2 * math.log(scale)) + deviance) / 2
        value += self.pyramid.log_volume
        if at.averaged and at.slope is None and slope_information > 0:
            value += (_LOG_2_PI - math.log(slope_information)) / 2
        return LikelihoodValue(value, head[3:], information, slope * scale, slope_information)


@lru_cache(maxsize=4)
def _nodes_of(layout: tuple[int, int], sampling: str) -> dict[RandomTerm, Array]:
    """Covariances that records of one length without gaps share, such as the channels of a unit."""
    return {}


def _scale(pyramid: LikelihoodPyramid) -> float:
    """Root mean square of the contrasts of the first level, or of the last rows where there is no other."""
    if pyramid.pools:
        first = pyramid.pools[0]
        inner = inner_of(first)
        return math.sqrt(float(np.trace(first.second[:inner, :inner])) / inner)
    modes = pyramid.modes
    return 0.0 if modes is None else math.sqrt(float(np.mean(modes.value**2)) / modes.block)


def inner_of(pool: Pool) -> int:
    """Number of components of a pool that are not given."""
    return pool.size - pool.given if pool.given else pool.size


def _with_derivative(values: Array) -> Array:
    """The first, and the derivative with ln T from the two others (nothing without them)."""
    if len(values) == 1:
        return values
    return np.stack([values[0], (values[1] - values[2]) / (2 * _LOG_STEP)])
