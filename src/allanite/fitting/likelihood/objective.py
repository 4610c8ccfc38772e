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
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.design import LINEAR
from allanite.fitting.likelihood.pool import KINDS, Pool, autocovariance
from allanite.fitting.likelihood.pyramid import LikelihoodPyramid
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
class _PoolVectors:
    """The vectors of a pool, or of what is given in it (sign -1)."""

    pool: int
    sign: int
    count: int
    start: int
    mean: Array
    second: Array
    tilt: Array


@dataclass(frozen=True, slots=True)
class _Singles:
    """The quicker of the slow contrasts: vectors of one component, each with a variance of its own."""

    first: int  # of the modes
    value: Array
    tilt: Array


#: Covariances for every pool and the slowest modes, and variances of all modes; second entry: derivative with ln T.
_Expected = tuple[list[Array], Array]


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
    _parts: list[_PoolVectors] = field(default_factory=list)
    _high: _Singles = field(default_factory=lambda: _Singles(0, np.zeros(0), np.zeros(0)))
    _matrices: dict[RandomTerm, _Expected] = field(default_factory=dict)
    _nodes: dict[int, Array] = field(default_factory=dict)

    @classmethod
    def of(cls, pyramid: LikelihoodPyramid, sampling: str) -> Objective:
        """The objective of a record."""
        scale = _scale(pyramid)
        new = cls(pyramid, sampling, scale)
        if not (scale > 0 and math.isfinite(scale)):
            return new  # constant samples: there is nothing to say, as the caller sees by the scale
        for i, pool in enumerate(pyramid.pools):
            for sign, start in ((1, 0), (-1, inner_of(pool))):
                if start < pool.size:
                    at = slice(start, None)
                    new._parts.append(
                        _PoolVectors(
                            pool=i,
                            sign=sign,
                            count=pool.count,
                            start=start,
                            mean=pool.mean[at] / scale,
                            second=pool.second[at, at] / scale**2,
                            tilt=pool.tilt[at],
                        )
                    )
        if (modes := pyramid.modes) is not None:
            x, tilt = modes.value / scale, modes.tilt
            low, high = slice(modes.low), slice(modes.low, None)
            new._parts.append(
                _PoolVectors(
                    pool=len(pyramid.pools),
                    sign=1,
                    count=1,
                    start=0,
                    mean=x[low],
                    second=np.outer(x[low], x[low]),
                    tilt=tilt[low],
                )
            )
            new._high = _Singles(modes.low, x[high], tilt[high])
        return new

    # -- the model side -----------------------------------------------------------------------------------

    def matrices(self, component: RandomTerm) -> list[Array]:
        """E_t for every pool and the slowest modes, shape (1, d, d).

        Of a Gauss-Markov term its derivative with ln T too, shape (2, d, d).
        """
        return self._expected(component)[0]

    def variances(self, component: RandomTerm) -> Array:
        """Variances of all modes, shape (1, n) or (2, n)."""
        return self._expected(component)[1]

    def _expected(self, component: RandomTerm) -> _Expected:
        if component not in self._matrices:
            if len(self._matrices) > _KEPT:
                self._matrices = {k: v for k, v in self._matrices.items() if k.T is None}
            if component.T is None:
                self._matrices[component] = self._computed(component)
            else:
                self._matrices[component] = self._split(
                    self._between(component.symbol, math.log(component.T))
                )
        return self._matrices[component]

    def _computed(self, component: RandomTerm) -> _Expected:
        units = [component.unit()]
        if component.T is not None:
            units += [component.unit(math.exp(_LOG_STEP)), component.unit(math.exp(-_LOG_STEP))]
        extra = self._extra(component.symbol, units)

        def series(count: int, block: int) -> Array:
            return _with_derivative(self._series(units, count, block))

        matrices, variances = (
            [p.expected(series, extra) for p in self.pyramid.pools],
            np.zeros((len(extra), 0)),
        )
        if self.pyramid.modes is not None:
            low, variances = self.pyramid.modes.expected(series, extra)
            matrices.append(low)
        return matrices, variances

    def _between(self, symbol: str, log_time: float) -> Array:
        """Hermite's cubic between two correlation times: to 5e-7, and a search tries thousands of them."""
        place = log_time / _SPACING
        low = math.floor(place)
        s = place - low
        ends = np.concatenate([self._node(symbol, low), self._node(symbol, low + 1)])
        rise, rest = 3 * s**2 - 2 * s**3, 1 - s
        slope = 6 * s * rest / _SPACING
        weights = np.array(
            [
                [1 - rise, _SPACING * s * rest**2, rise, -_SPACING * s**2 * rest],
                [-slope, rest * (1 - 3 * s), slope, s * (3 * s - 2)],
            ]
        )
        return np.asarray(weights @ ends)

    def _node(self, symbol: str, number: int) -> Array:
        """All covariances of a Gauss-Markov term at a correlation time of the grid in two rows."""
        if number not in self._nodes:
            matrices, variances = self._computed(RandomTerm(symbol, math.exp(number * _SPACING)))
            self._nodes[number] = np.concatenate([*(m.reshape(2, -1) for m in matrices), variances], axis=1)
        return self._nodes[number]

    def _split(self, rows: Array) -> _Expected:
        """The matrices and variances that stand side by side in two rows."""
        sizes = [p.size for p in self.pyramid.pools]
        if self.pyramid.modes is not None:
            sizes.append(self.pyramid.modes.low)
        parts, place = [], 0
        for d in sizes:
            parts.append(rows[:, place : place + d * d].reshape(2, d, d))
            place += d * d
        return parts, rows[:, place:]

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

    def _stacked(self, components: Sequence[RandomTerm], times: Sequence[int], pool: int, c: Array) -> Array:
        """E_t of a pool, and what the logarithm of each correlation time changes, shape (n, d, d)."""
        return _with_times([self.matrices(k)[pool] for k in components], times, c)

    # -- the likelihood -----------------------------------------------------------------------------------

    def value(self, at: Point) -> float:
        """Logarithm of the likelihood of the samples as they are (their unit included)."""
        return self._evaluate(at, times=(), derivatives=False).log_likelihood

    def __call__(self, at: Point) -> LikelihoodValue:
        """Value, gradient and information; a covariance that is not positive definite has the value -inf."""
        times = tuple(i for i, k in enumerate(at.components) if k.T is not None)
        return self._evaluate(at, times=times, derivatives=True)

    def _evaluate(self, at: Point, *, times: tuple[int, ...], derivatives: bool) -> LikelihoodValue:
        n = len(at.c)
        size = n + len(times)
        stacks = [self._stacked(at.components, times, i, at.c) for i in range(self._parts[-1].pool + 1)]
        solved, log_det, dimensions = [], 0.0, 0
        for part in self._parts:
            E = stacks[part.pool][:, part.start :, part.start :]
            V = np.tensordot(at.c, E[:n], axes=1)
            inverse = _inverse(V)
            if inverse is None:
                return _impossible(size)
            solved.append((E, V, inverse[0]))
            log_det += part.sign * part.count * inverse[1]
            dimensions += part.sign * part.count * len(V)
        singles = self._high
        F = _with_times([self.variances(k)[:, singles.first :] for k in at.components], times, at.c)
        v = at.c @ F[:n]
        if not v.min(initial=1.0) > 0:
            return _impossible(size)
        log_det += float(np.log(v).sum())
        dimensions += len(v)
        slope, slope_information = self._slope(at, [W for _, _, W in solved], 1 / v)
        averaged = at.averaged and at.slope is None and slope_information > 0
        squares, gradient, information = 0.0, np.zeros(size), np.zeros((size, size))
        for part, (E, V, W) in zip(self._parts, solved, strict=True):
            S = part.second
            if slope != 0.0:
                cross = np.outer(part.mean, part.tilt)
                S = S - slope * (cross + cross.T) + slope**2 * np.outer(part.tilt, part.tilt)
            weight = part.sign * part.count
            squares += weight * float(np.vdot(W, S))
            if derivatives:
                change = W @ (S - V) @ W
                if averaged:
                    pull = W @ part.tilt
                    change += np.outer(pull, pull) / (slope_information * self.scale**2)
                gradient += weight / 2 * (E.reshape(size, -1) @ change.ravel())
                inner = (W @ E @ W).reshape(size, -1)
                information += weight / 2 * (inner @ E.reshape(size, -1).T)
        power = (singles.value - slope * singles.tilt) ** 2 / v
        squares += float(power.sum())
        if derivatives:
            change = power - 1.0
            if averaged:
                change += singles.tilt**2 / v / (slope_information * self.scale**2)
            F = F / v
            gradient += F @ change / 2
            information += F @ F.T / 2
        value = -(dimensions * (_LOG_2_PI + 2 * math.log(self.scale)) + log_det + squares) / 2
        value += self.pyramid.log_volume
        if averaged:
            value += (_LOG_2_PI - math.log(slope_information)) / 2
        return LikelihoodValue(
            value, gradient, (information + information.T) / 2, slope * self.scale, slope_information
        )

    def _slope(self, at: Point, inverses: list[Array], weights: Array) -> tuple[float, float]:
        """Slope of the ramp (in units of the scale) and the information on it."""
        weighted = weights * self._high.tilt
        projection, information = float(weighted @ self._high.value), float(weighted @ self._high.tilt)
        for part, W in zip(self._parts, inverses, strict=True):
            pull = part.sign * part.count * (W @ part.tilt)
            projection += float(pull @ part.mean)
            information += float(pull @ part.tilt)
        if at.slope is not None:
            return at.slope / self.scale, information / self.scale**2
        return (projection / information if information > 0 else 0.0), information / self.scale**2


def _scale(pyramid: LikelihoodPyramid) -> float:
    """Root mean square of the contrasts of the first level, or of the last rows where there is no other."""
    if pyramid.pools:
        first = pyramid.pools[0]
        inner = inner_of(first)
        return math.sqrt(float(np.trace(first.second[:inner, :inner])) / inner)
    modes = pyramid.modes
    return 0.0 if modes is None else math.sqrt(float(np.mean(modes.value**2)) / modes.block)


def _impossible(size: int) -> LikelihoodValue:
    return LikelihoodValue(-math.inf, np.zeros(size), np.zeros((size, size)), 0.0, 0.0)


def _with_times(changes: list[Array], times: Sequence[int], c: Array) -> Array:
    """What each coefficient changes, then what the logarithm of each correlation time does."""
    return np.array([*(f[0] for f in changes), *(c[i] * changes[i][1] for i in times)])


def inner_of(pool: Pool) -> int:
    """Number of components of a pool that are not given."""
    return pool.size - pool.given if pool.given else pool.size


def _with_derivative(values: Array) -> Array:
    """The first, and the derivative with ln T from the two others (nothing without them)."""
    if len(values) == 1:
        return values
    return np.stack([values[0], (values[1] - values[2]) / (2 * _LOG_STEP)])


def _inverse(V: Array) -> tuple[Array, float] | None:
    """V^-1 and ln det V; None where V is not positive definite. Scaled to a unit diagonal first."""
    from scipy.linalg.lapack import dpotrf, dpotri

    d = np.sqrt(np.maximum(V.diagonal(), 0.0))
    if not d.min(initial=1.0) > 0 or not np.isfinite(d).all():
        return None
    outer = d[:, None] * d
    root, failed = dpotrf(V / outer, lower=1, clean=1, overwrite_a=1)
    if failed:
        return None
    log_det = 2 * float(np.log(root.diagonal()).sum() + np.log(d).sum())
    half = dpotri(root, lower=1, overwrite_c=1)[0]
    inverse = half + half.T
    inverse.flat[:: len(V) + 1] /= 2
    return inverse / outer, log_det
