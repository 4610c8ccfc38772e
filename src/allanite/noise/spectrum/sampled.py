# SPDX-License-Identifier: BSD-3-Clause
"""Density of the samples of a noise model: folded at the Nyquist frequency, as a spectrum estimated from them is.

For interval means the continuous density is multiplied by sinc^2(f Ts) before it is folded; for point samples it is
folded as it is. White noise stays N^2 in both.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, RandomWalk, TermType, White
from allanite.noise.terms import sinh_minus
from allanite.recording.records import Sampling

__all__ = ["sampled_psd"]

Array = NDArray[np.float64]


def sampled_psd(model: NoiseModel, f: ArrayLike, dt: float, sampling: Sampling = "mean") -> Array:
    """Two-sided density at 0 < f <= 1/(2 dt) of samples of a model.

    Parameters
    ----------
    model : NoiseModel
    f : array_like [Hz]
    dt : float [s]
        Sample interval.
    sampling : "mean" or "point"

    Returns
    -------
    ndarray, shape of `f` [SI^2/Hz]
        Sinusoids and ramps add nothing: they have lines, and no density.
    """
    x = np.asarray(f, dtype=np.float64) * dt
    total = np.zeros_like(x)
    for term in model.terms:
        total = total + _density(term, x, dt, sampling == "mean")
    return total


def _density(term: TermType, x: Array, dt: float, means: bool) -> Array:
    """Density of the samples of one term at x = f dt."""
    sine, cosine = np.sin(np.pi * x), np.cos(2 * np.pi * x)
    match term:
        case White():
            return np.full_like(x, term.N**2)
        case Quantisation():
            return np.asarray((2 * sine * term.Q) ** 2 / dt)
        case RandomWalk():
            walk = (term.K * dt / (2 * sine)) ** 2
            return np.asarray(walk * (2 + cosine) / 3 if means else walk)
        case GaussMarkov():
            return _gauss_markov(term, sine, dt, means)
        case Flicker():  # interval means in both conventions
            return np.asarray(term.B**2 * dt * sine**2 / (2 * math.pi**3) * _folded_cubes(x))
    return np.zeros_like(x)


def _gauss_markov(term: GaussMarkov, sine: Array, dt: float, means: bool) -> Array:
    """Points: the AR(1) form. Means: from r_0 and r_k = r_1 phi^(k-1), in a form in which slow terms do not cancel."""
    a = dt / term.T
    phi, rest = math.exp(-a), -math.expm1(-a)
    denominator = rest**2 + 4 * phi * sine**2  # 1 - 2 phi cos + phi^2
    if not means:
        return np.asarray(term.sigma**2 * dt * rest * (1 + phi) / denominator)
    bend = phi * sinh_minus(a) if a < 1 else -math.expm1(-2 * a) / 2 - a * phi
    return np.asarray(term.sigma**2 * dt * (2 * rest**2 / a - 8 * sine**2 * bend / a**2) / denominator)


def _folded_cubes(x: Array) -> Array:
    """Sum of |x + k|^-3 over all whole k, for 0 < x < 1: eight terms of each sign, and Euler-Maclaurin for the rest."""
    total = np.zeros_like(x)
    for side in (x, 1 - x):
        for k in range(8):
            total = total + (side + k) ** -3.0
        far = side + 8
        total = total + 1 / (2 * far**2) + 1 / (2 * far**3) + 1 / (4 * far**4) - 1 / (12 * far**6)
    return total
