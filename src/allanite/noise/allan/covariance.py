# SPDX-License-Identifier: BSD-3-Clause
"""Exact finite-sample mean, covariance and degrees of freedom of the overlapping Allan variance.

For Gaussian noise with stationary second differences of the phase, with d_m(i) = (x_{i+2m} - 2 x_{i+m} + x_i)/(sqrt2 m)
and OAVAR(m) = mean of d_m(i)^2 over the M complete windows,

    r12(k)  = E[d_m1(i) d_m2(i+k)] = 1/(2 m1 m2) sum_ij w_i w_j S(k + j m2 - i m1),   w = (1, -2, 1),
    Cov     = 2/(M1 M2) sum_k n_k r12(k)^2,                 n_k = pairs of windows at distance k,
    edf     = 2 E^2 / Var.

A week at 32 Hz has 300 pairs of lags and 2e7 terms in each sum. r12 is smooth between nine break points, so
the sum over k is taken exactly near them and by Gauss-Legendre panels with the Euler-Maclaurin correction in
between: some hundred nodes per pair instead of 2e7, with a relative error below 1e-6 (tested against the plain sum).

References
----------
.. [1] C. Greenhall, W. Riley, "Uncertainty of stability variances based on finite differences", PTTI 2003.
.. [2] D. Percival, P. Guttorp, "Long-memory processes, the Allan variance and wavelets", 1994.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.lazy_dataclasses import dataclass
from allanite.noise import (
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    Sinusoid,
    TermType,
    White,
)
from allanite.noise.power_law import PowerLaw
from allanite.recording.records import merge_spans

__all__ = [
    "LagPairs",
    "complete_starts",
    "covariance",
    "cross_covariance",
    "distance_nodes",
    "edf",
    "in_samples",
    "lag_pairs",
    "touching_starts",
]

Array = NDArray[np.float64]
Spans = NDArray[np.int64]

_EXACT = 16  # integer positions summed one by one on each side of a break point
_RATIO = 3.0  # growth of the panels away from it
#: Gauss and Legendre's rule of eight points, its positive half, as `numpy.polynomial.legendre.leggauss` computes it.
_POSITIVE = np.array([0.18343464249564978, 0.525532409916329, 0.7966664774136267, 0.9602898564975362])
_HALF = np.array([0.36268378337836166, 0.3137066458778869, 0.22238103445337443, 0.10122853629037706])
_NODES, _WEIGHTS = np.concatenate([-_POSITIVE[::-1], _POSITIVE]), np.concatenate([_HALF[::-1], _HALF])
_SAMPLED_RUNS = 4096


def complete_starts(missing: Spans, n_samples: int, window: int) -> Spans:
    """Runs [start, stop) of positions whose `window` samples are all present.

    Parameters
    ----------
    missing : ndarray of int64, shape (n_runs, 2)
        Sorted, disjoint runs of missing samples.
    n_samples : int
    window : int
        Samples that one term of the sum covers (2 m for a second difference).

    Returns
    -------
    ndarray of int64, shape (n_runs, 2)
    """
    last = n_samples - window + 1
    if last <= 0:
        return np.zeros((0, 2), dtype=np.int64)
    if len(missing) == 0:
        return np.array([[0, last]], dtype=np.int64)
    begins = np.concatenate(([0], missing[:, 1]))
    ends = np.concatenate((missing[:, 0] - window + 1, [last]))
    runs = np.stack([begins, np.minimum(ends, last)], axis=1)
    return np.ascontiguousarray(runs[runs[:, 1] > runs[:, 0]])


def touching_starts(missing: Spans, n_points: int, lag: int, order: int) -> Spans:
    """Runs [start, stop) of positions i whose phase points i, i + lag, ..., i + order*lag are all present.

    For recorded angles: a missing angle spoils only the terms that touch it.
    """
    last = n_points - order * lag
    if last <= 0:
        return np.zeros((0, 2), dtype=np.int64)
    shifted = np.concatenate([missing - j * lag for j in range(order + 1)])
    bad = merge_spans(np.clip(shifted, 0, last))
    edges = np.concatenate(([0], bad.ravel(), [last])).reshape(-1, 2)
    return np.ascontiguousarray(edges[edges[:, 1] > edges[:, 0]])


@dataclass(frozen=True, slots=True)
class LagPairs:
    """Quadrature over window distances for every pair of lags of a record.

    Attributes
    ----------
    lags : ndarray of int64, shape (n_lags,)
    first, second : ndarray of int64, shape (n_pairs,)
        Positions in `lags` of the pair's shorter and longer lag.
    distance : ndarray, shape (n_nodes,)
        k of each node, pairs one after another.
    weight : ndarray, shape (n_nodes,)
        So that sum_k n_k f(k) = sum over nodes of weight * f, divided by M1 M2.
    offset : ndarray of int64, shape (n_pairs + 1,)
        First node of each pair, and the number of nodes.
    """

    lags: NDArray[np.int64]
    first: NDArray[np.int64]
    second: NDArray[np.int64]
    distance: Array
    weight: Array
    offset: NDArray[np.int64]

    def cross(self, term: TermType | PowerLaw, sampling: str) -> Array:
        """r12 of a term at every node (unit sample interval), shape (n_nodes,)."""
        return cross_covariance(term, self.lengths, self.offset, self.distance, sampling)

    def power_laws(self, slopes: Sequence[float]) -> Array:
        """r12 of noise of density f^-slope for several slopes (`PowerLaw`), shape (n_slopes, n_nodes)."""
        return _power_laws(slopes, self.lengths, self.offset, self.distance)

    @property
    def lengths(self) -> Array:
        """m1, m2 of each pair, shape (n_pairs, 2)."""
        return np.stack([self.lags[self.first], self.lags[self.second]], axis=1).astype(np.float64)

    def sum(self, values: Array) -> Array:
        """sum_k n_k f(k)/(M1 M2) of every pair as a symmetric matrix, shape (n_lags, n_lags)."""
        sums = np.add.reduceat(self.weight * values, self.offset[:-1])
        out = np.empty((len(self.lags),) * 2)
        out[self.first, self.second] = sums
        out[self.second, self.first] = sums
        return out


def lag_pairs(
    lags: Sequence[int] | NDArray[np.int64], n_samples: int, starts: Sequence[Spans] | None = None
) -> LagPairs:
    """Quadrature nodes for a record of n_samples; `starts` are each lag's runs of complete windows.

    Cached for records without gaps: simulations ask for the same lengths again and again.
    """
    key = tuple(int(m) for m in lags)
    return _cached_pairs(key, n_samples) if starts is None else _build_pairs(key, n_samples, starts)


@lru_cache(maxsize=64)
def _cached_pairs(lags: tuple[int, ...], n_samples: int) -> LagPairs:
    return _build_pairs(lags, n_samples, None)


def _build_pairs(lags: tuple[int, ...], n_samples: int, starts: Sequence[Spans] | None) -> LagPairs:
    pairs = [(a, b) for a in range(len(lags)) for b in range(a, len(lags))]
    distances, weights = [], []
    for a, b in pairs:
        k, w = distance_nodes(lags[a], lags[b], n_samples)
        if starts is None:
            w = w * _full_pairs(n_samples - 2 * lags[a] + 1, n_samples - 2 * lags[b] + 1, k)
            w /= (n_samples - 2 * lags[a] + 1) * (n_samples - 2 * lags[b] + 1)
        else:
            total = max(_total(starts[a]) * _total(starts[b]), 1)
            w = w * count_pairs(starts[a], starts[b], k) / total
        distances.append(k)
        weights.append(w)
    sizes = np.array([len(k) for k in distances])
    first, second = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    m = np.array(lags, dtype=np.int64)
    return LagPairs(
        lags=m,
        first=first,
        second=second,
        distance=np.concatenate(distances),
        weight=np.concatenate(weights),
        offset=np.concatenate(([0], np.cumsum(sizes))).astype(np.int64),
    )


def _total(runs: Spans) -> int:
    return int((runs[:, 1] - runs[:, 0]).sum())


def _full_pairs(M1: int, M2: int, k: Array) -> Array:
    """n_k without gaps: windows i of the first and i + k of the second, both inside the record."""
    return np.asarray(np.maximum(0.0, np.minimum(M1, M2 - k) - np.maximum(0.0, -k)))


def count_pairs(first: Spans, second: Spans, k: Array) -> Array:
    """n_k with gaps: positions i of `first` with i + k in `second`, linear between whole k.

    With more than 4096 runs every s-th run of `first` stands for its s - 1 neighbours.
    """
    if len(first) == 0 or len(second) == 0:
        return np.zeros_like(k)
    sampled = np.ascontiguousarray(first[:: -(-len(first) // _SAMPLED_RUNS)])
    counts = _kernels.pairs_in_runs(sampled, np.ascontiguousarray(second), k)
    return np.asarray(counts * (_total(first) / _total(sampled)))


def distance_nodes(m1: int, m2: int, n_samples: int) -> tuple[Array, Array]:
    """Distances and weights so that sum over whole k of f = sum of weight * f, f smooth between break points."""
    M1, M2 = n_samples - 2 * m1 + 1, n_samples - 2 * m2 + 1
    low, high = -(M1 - 1), M2 - 1
    breaks = {i * m1 - j * m2 for i in range(3) for j in range(3)} | {0, M2 - M1, low, high}
    edges = sorted(b for b in breaks if low <= b <= high)
    nodes = [np.array(edges, dtype=np.float64)]
    weights = [np.ones(len(edges))]
    for a, b in zip(edges, edges[1:], strict=False):
        k, w = _panel(b - a - 1)
        nodes.append(a + 1 + k)
        weights.append(w)
    return np.concatenate(nodes), np.concatenate(weights)


@lru_cache(maxsize=4096)
def _panel(count: int) -> tuple[Array, Array]:
    """Nodes and weights for a sum over the whole numbers 0..count-1, whose function is least smooth at the ends."""
    if count <= 4 * _EXACT:
        return np.arange(count, dtype=np.float64), np.ones(count)
    near = np.arange(_EXACT, dtype=np.float64)
    a, b = _EXACT - 0.5, count - _EXACT - 0.5
    middle = (a + b) / 2
    edges = [a]
    step = _EXACT / 2
    while edges[-1] + step * _RATIO < middle:
        edges.append(edges[-1] + step)
        step *= _RATIO
    left = np.array([*edges, middle])
    grid = np.concatenate([left, (count - 1) - left[-2::-1]])
    half = np.diff(grid)[:, None] / 2
    k = (grid[:-1, None] + half * (1 + _NODES)).ravel()
    w = (half * _WEIGHTS).ravel()
    # midpoint Euler-Maclaurin: sum = integral - (f'(b) - f'(a))/24, slopes from neighbouring whole numbers
    ends = np.array([a - 0.5, a + 0.5, b - 0.5, b + 0.5])
    nodes = np.concatenate([near, k, (count - 1) - near, ends])
    weights = np.concatenate([np.ones(_EXACT), w, np.ones(_EXACT), np.array([-1, 1, 1, -1]) / 24])
    return nodes, weights


def cross_covariance(
    term: TermType | PowerLaw, lengths: Array, offsets: NDArray[np.int64], distance: Array, sampling: str
) -> Array:
    """r12(k) of one term at unit sample interval, shape (n_distances,).

    Parameters
    ----------
    lengths : ndarray, shape (n_pairs, 2) [samples]
        m1 <= m2 of each pair of windows.
    offsets : ndarray of int64, shape (n_pairs + 1,)
        Where its distances begin, and where the last end.
    distance : ndarray, shape (n_distances,) [samples]
    sampling : "mean" or "point"
    """
    match term:
        case Ramp():
            return np.zeros_like(distance)
        case PowerLaw():
            return np.asarray(_power_laws([term.slope], lengths, offsets, distance)[0])
        case Flicker():
            part = _kernels.power_window_pairs(lengths, offsets, distance, np.zeros(1))[0]
            return np.asarray(term.B**2 / (2 * np.pi) * part)
        case Sinusoid():
            m1, m2 = np.repeat(lengths, np.diff(offsets), axis=0).T
            return _second_differences(term, sampling, m1, m2, distance)
    return _kernels.window_pairs(lengths, offsets, distance, **_phase_parts(term, sampling))


def _power_laws(
    slopes: Sequence[float], lengths: Array, offsets: NDArray[np.int64], distance: Array
) -> Array:
    exponents = np.array([0.0 if abs(slope - 1) < 1e-9 else slope - 1 for slope in slopes])
    covariance = _kernels.power_window_pairs(lengths, offsets, distance, exponents)
    scale = [4 * math.log(2) if e == 0 else 4 * math.expm1(e * math.log(2)) for e in exponents]
    return np.asarray(covariance / np.array(scale)[:, None])


def _phase_parts(term: Quantisation | White | RandomWalk | GaussMarkov, sampling: str) -> dict[str, float]:
    """The generalised covariance of the phase of a term, as the kernel takes it."""
    parts = {"spike": 0.0, "linear": 0.0, "cubic": 0.0, "exponential": 0.0, "rate": 0.0}
    match term:
        case Quantisation():
            return parts | {"spike": term.Q**2}
        case White():
            return parts | {"linear": -(term.N**2) / 2}
        case RandomWalk():
            cubic = term.K**2 / 12
            return parts | {"cubic": cubic, "linear": 0.0 if sampling == "mean" else -cubic}
        case GaussMarkov():
            return parts | term.phase_parts(1.0, sampling)


def _second_differences(term: Sinusoid, sampling: str, m1: Array, m2: Array, k: Array) -> Array:
    total = np.zeros_like(k)
    for i, wi in enumerate((1, -2, 1)):
        for j, wj in enumerate((1, -2, 1)):
            total += wi * wj * term.phase_covariance(k + j * m2 - i * m1, 1.0, sampling)
    return total / (2 * m1 * m2)


def covariance(model: NoiseModel, pairs: LagPairs, dt: float, sampling: str) -> Array:
    """Covariance matrix of OAVAR under a model, shape (n_lags, n_lags), in SI to the fourth power.

    Parameters
    ----------
    model : NoiseModel
    pairs : LagPairs
    dt : float [s]
    sampling : "mean" or "point"
    """
    r = np.zeros_like(pairs.distance)
    slope = 0.0
    for term in (in_samples(t, dt) for t in model.terms):
        r = r + pairs.cross(term, sampling)
        slope += term.R**2 if isinstance(term, Ramp) else 0.0
    total = 2 * pairs.sum(r * r)
    if slope:
        total += 2 * slope * np.outer(pairs.lags, pairs.lags) * pairs.sum(r)
    return total


def edf(
    model: NoiseModel,
    lags: Sequence[int] | NDArray[np.int64],
    n_samples: int,
    dt: float,
    sampling: str,
    starts: Sequence[Spans] | None = None,
) -> Array:
    """Equivalent degrees of freedom 2 E^2/Var of OAVAR at each lag under a model, shape (n_lags,).

    `starts` are the runs of complete windows of each lag where samples are missing.
    """
    out = np.empty(len(lags))
    for i, m in enumerate(lags):
        mean = model.avar_sampled(float(m), dt, sampling)
        pairs = lag_pairs([int(m)], n_samples, None if starts is None else [starts[i]])
        variance = covariance(model, pairs, dt, sampling)[0, 0]
        out[i] = 2 * mean**2 / variance if variance > 0 else np.nan
    return out


def in_samples(term: TermType, dt: float) -> TermType:
    """The same process in units of the sample interval: time in samples, rate as it is."""
    match term:
        case White():
            return White(N=term.N / dt**0.5)
        case Flicker():
            return term
        case RandomWalk():
            return RandomWalk(K=term.K * dt**0.5)
        case GaussMarkov():
            return GaussMarkov(q=term.q * dt**0.5, T=term.T / dt)
        case Quantisation():
            return Quantisation(Q=term.Q / dt, dt=1.0)
        case Ramp():
            return Ramp(R=term.R * dt)
        case Sinusoid():
            return Sinusoid(amplitude=term.amplitude, frequency=term.frequency * dt, phase=term.phase)
