# SPDX-License-Identifier: BSD-3-Clause
"""Noise by other formulas than those of `allanite.simulate`: a second witness for whatever is checked by simulation.

A power law is drawn from its spectrum with all its aliases on a circle many records long; Gauss-Markov noise and random
walks advance by the exact joint law of their value and their integral over an interval. Nothing here imports the
package. Samples are interval means at a unit interval.

References
----------
.. [1] C. Dietrich, G. Newsam, "Fast and exact simulation of stationary Gaussian processes through circulant embedding
   of the covariance matrix", SIAM J. Sci. Comput. 18 (1997) 1088.
.. [2] D. Gillespie, "Exact numerical simulation of the Ornstein-Uhlenbeck process and its integral", Phys. Rev. E 54
   (1996) 2084.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.special import zeta

__all__ = ["flicker", "gauss_markov", "power_law", "random_walk", "telegraph"]

Samples = NDArray[np.float64]

_CIRCLE = 16  # records on the circle: what comes back around it is slower than any lag of a record


def power_law(rng: np.random.Generator, n: int, density: float, slope: float) -> Samples:
    """Noise of two-sided density `density` / f^slope, 0 <= slope < 2, shape (n,).

    The interval mean multiplies the density by (sin(pi f) / (pi f))^2, and sampling adds it up over f + j for all whole
    j: sums of Hurwitz's zeta function. The mean of the circle is zero, so a record keeps its level within the circle.
    """
    size = 2 ** math.ceil(math.log2(_CIRCLE * n))
    f = np.arange(1, size // 2 + 1) / size
    amplitude = np.concatenate([[0.0], np.sin(np.pi * f) / np.pi * np.sqrt(density * _aliased(size, slope))])
    around: Samples = np.fft.irfft(np.fft.rfft(rng.standard_normal(size)) * amplitude, size)
    return around[:n]


@lru_cache(maxsize=2)
def _aliased(size: int, slope: float) -> Samples:
    """The sums of one size and slope: many records are drawn of the same law."""
    f = np.arange(1, size // 2 + 1) / size
    return np.asarray(zeta(slope + 2, f) + zeta(slope + 2, 1 - f))


def flicker(rng: np.random.Generator, n: int, B: float) -> Samples:
    """1/f noise of density B^2 / (2 pi f)."""
    return power_law(rng, n, B**2 / (2 * math.pi), 1.0)


def gauss_markov(rng: np.random.Generator, n: int, sigma: float, T: float) -> Samples:
    """Stationary Gauss-Markov noise of deviation sigma and correlation time T [samples], by [2]."""
    decay, forgotten = math.exp(-1 / T), -math.expm1(-1 / T)
    step = sigma**2 * -math.expm1(-2 / T)
    area = sigma**2 * T**2 * (2 / T - 2 * forgotten - forgotten**2)
    steps, areas = _joint(rng, n, step, area, sigma**2 * T * forgotten**2)
    start = sigma * rng.standard_normal()
    values = np.concatenate([[start], lfilter([1.0], [1.0, -decay], steps, zi=[decay * start])[0][:-1]])
    return np.asarray(T * forgotten * values + areas)


def random_walk(rng: np.random.Generator, n: int, K: float) -> Samples:
    """A random walk that grows by K^2 in variance each interval."""
    steps, areas = _joint(rng, n, K**2, K**2 / 3, K**2 / 2)
    return np.asarray(np.concatenate([[0.0], np.cumsum(steps)[:-1]]) + areas)


def telegraph(rng: np.random.Generator, n: int, size: float, dwell: float) -> Samples:
    """Random telegraph (popcorn) noise: two levels `size` apart, dwells exponential with mean `dwell`.

    Its spectrum is that of a Gauss-Markov term with T = dwell / 2; its law is as far from normal as can be.
    """
    switches = np.cumsum(rng.exponential(dwell, int(3 * n / dwell) + 20))
    switches = switches[switches < n]
    edges = np.union1d(np.arange(n + 1), switches)
    level = size * ((np.searchsorted(switches, edges[:-1], side="right") + rng.integers(2)) % 2 - 0.5)
    area = np.concatenate([[0.0], np.cumsum(level * np.diff(edges))])
    return np.asarray(np.diff(area[np.searchsorted(edges, np.arange(n + 1))]))


def _joint(
    rng: np.random.Generator, n: int, first: float, second: float, both: float
) -> tuple[Samples, Samples]:
    """Pairs of normal numbers with these variances and this covariance, each of shape (n,)."""
    u, v = rng.standard_normal((2, n))
    root = math.sqrt(first)
    return root * u, both / root * u + math.sqrt(max(second - both**2 / first, 0.0)) * v
