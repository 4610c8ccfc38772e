# SPDX-License-Identifier: BSD-3-Clause
"""Records of known noise for the tests of health: plain NumPy, so that they share nothing with the code they test."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.recording.records import Recording

Samples = NDArray[np.float64]


def white(rng: np.random.Generator, n: int) -> Samples:
    """White noise, standard deviation 1."""
    return rng.standard_normal(n)


def walk(rng: np.random.Generator, n: int, step: float) -> Samples:
    """Random walk by cumulative sum."""
    return np.cumsum(rng.standard_normal(n)) * step


def flicker(rng: np.random.Generator, n: int) -> Samples:
    """1/f noise: white noise shaped by |2 sin(pi f)|^(-1/2), the middle half of a record twice as long."""
    f = np.fft.rfftfreq(2 * n)
    spectrum = np.fft.rfft(rng.standard_normal(2 * n))
    spectrum[0] = 0.0
    spectrum[1:] *= (2.0 * np.sin(np.pi * f[1:])) ** -0.5
    return np.fft.irfft(spectrum)[n // 2 : n // 2 + n]


def record(samples: NDArray[np.generic], *, unit: str = "m/s^2", rate: float = 100.0) -> Recording:
    """A recording of one channel called "signal" (or x, y, z)."""
    return Recording.from_rate(samples, rate=rate, unit=unit)


def binomial_bound(trials: int, chance: float, confidence: float = 0.999) -> int:
    """Largest count that chance exceeds with probability below 1 - confidence."""
    below, k = 0.0, -1
    while below < confidence:
        k += 1
        below += math.comb(trials, k) * chance**k * (1.0 - chance) ** (trials - k)
    return k
