# SPDX-License-Identifier: BSD-3-Clause
"""A NumPy twin of every kernel: the shortest form that is plainly right. Slow, and the oracle of the C++.

Phase in sample units: n samples, n + 1 points, ``x[0] = 0``, ``x[k] = sum over i < k of (y[i] - offset)``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def missing(y: Floats) -> NDArray[np.bool_]:
    """NaN, infinite, or an overload word."""
    with np.errstate(invalid="ignore"):
        return ~(np.abs(y) < 9.9e37)


def integrate(block: Floats, offset: float, start: float) -> Floats:
    """Phase after each sample; a missing one adds nothing."""
    steps = np.where(missing(block), 0.0, block - offset)
    return np.cumsum(np.concatenate([[start], steps]))[1:]


def phase_of(y: Floats, offset: float = 0.0) -> Floats:
    """All n + 1 phase points."""
    return np.concatenate([[0.0], integrate(y, offset, 0.0)])


def runs_where(flags: NDArray[np.bool_]) -> Integers:
    """Half-open runs of True, shape (k, 2)."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    return np.stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)], axis=1)


def complete(y: Floats, window: int) -> NDArray[np.bool_]:
    """For each start: are all samples of its window present?"""
    if window > len(y):
        return np.zeros(0, dtype=bool)
    seen = np.concatenate([[0], np.cumsum(missing(y))])
    return seen[window:] == seen[:-window]


def differences(x: Floats, order: int, m: int) -> Floats:
    """Second or third differences of the phase at spacing m, one per start."""
    for _ in range(order):
        x = x[m:] - x[:-m]
    return x


def difference_squares(y: Floats, order: int, m: int, offset: float = 0.0) -> tuple[float, int]:
    """Sum of squared differences over the complete windows, and their number."""
    use = complete(y, order * m)
    return float(np.sum(differences(phase_of(y, offset), order, m)[use] ** 2)), int(use.sum())


def modified_squares(y: Floats, m: int, offset: float = 0.0) -> tuple[float, int]:
    """Sum of (mean of m adjacent second differences)², and their number."""
    use = complete(y, 3 * m - 1)
    means = np.convolve(differences(phase_of(y, offset), 2, m), np.full(m, 1 / m), "valid")
    return float(np.sum(means[use] ** 2)), int(use.sum())


def total_squares(y: Floats, m: int, offset: float = 0.0) -> float:
    """Sum of squared second differences of the reflected phase, over the centres 1..n-1."""
    x, n = phase_of(y, offset), len(y)
    x = np.concatenate([2 * x[0] - x[:0:-1], x, 2 * x[-1] - x[-2::-1]])
    centre = n + np.arange(1, n)
    return float(np.sum((x[centre - m] - 2 * x[centre] + x[centre + m]) ** 2))


def online_squares(
    y: Floats, order: int, m: int, positions: int = 64, offset: float = 0.0
) -> tuple[float, int]:
    """As `difference_squares`, over every 2**k-th start, k the level of the lag."""
    stride = 1
    while m // stride >= 2 * positions:
        stride *= 2
    use = complete(y, order * m)[::stride]
    return float(np.sum(differences(phase_of(y, offset), order, m)[::stride][use] ** 2)), int(use.sum())


def markov_noise(
    normals: Floats, phi: Floats, step_sd: Floats, weight_now: Floats, weight_next: Floats, state: Floats
) -> tuple[Floats, Floats]:
    """What is added to each sample, and the last state."""
    states = [state]
    for row in normals:
        states.append(phi * states[-1] + step_sd * row)
    s = np.array(states)
    return s[:-1] @ weight_now + s[1:] @ weight_next, s[-1]
