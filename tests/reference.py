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


def theo_squares(y: Floats, m: int, offset: float = 0.0) -> tuple[float, int]:
    """Theo1: sum over the complete windows and d = 1..m/2 of (sum of the last d - sum of the first d samples)²/d."""
    use, x = complete(y, m), phase_of(y, offset)
    total = 0.0
    for d in range(1, m // 2 + 1):
        z = x[: len(x) - m] - x[d : len(x) - m + d] - x[m - d : len(x) - d] + x[m:]
        total += float(np.sum(z[use] ** 2)) / d
    return total, int(use.sum())


def biweight_sums(y: Floats, m: int, scale: float, cut: float, offset: float = 0.0) -> tuple[float, float]:
    """Sums of psi(u) = u (1 - u/cut)⁴ below the cut and of u psi'(u), over the complete windows."""
    u = differences(phase_of(y, offset), 2, m)[complete(y, 2 * m)] ** 2 / scale
    u = u[u < cut]
    t = 1 - u / cut
    return float(np.sum(u * t**4)), float(np.sum(u * t**3 * (t - 4 * u / cut)))


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


def whiten(
    transition: Floats,
    process: Floats,
    output: Floats,
    noise: Floats,
    covariance: Floats,
    state: Floats,
    columns: Floats,
) -> tuple[Floats, float, Floats, Floats]:
    """Innovations / sqrt(S) of each column, sum of ln S, and the last prediction: covariance and states."""
    out, log_det = np.full_like(columns, np.nan), 0.0
    for k, row in enumerate(columns):
        if np.isfinite(noise[k]) and np.all(np.isfinite(row)):
            variance = output @ covariance @ output + noise[k]
            innovation = row - output @ state
            gain = covariance @ output / variance
            state = state + np.outer(gain, innovation)
            covariance = covariance - np.outer(gain, gain) * variance
            out[k], log_det = innovation / np.sqrt(variance), log_det + float(np.log(variance))
        state = transition @ state
        covariance = transition @ covariance @ transition.T + process
    return out, log_det, covariance, state


def decorrelate(noise: Floats, output: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Independent measurements instead of correlated ones: variances, outputs and values, L D L' = noise."""
    root = np.linalg.cholesky(noise)
    unit = root / np.diag(root)
    return np.diag(root) ** 2, np.linalg.solve(unit, output), np.linalg.solve(unit, y)


def kalman_filter(
    transition: Floats,
    process: Floats,
    output: Floats,
    noise: Floats,
    y: Floats,
    drive: Floats,
    state: Floats,
    covariance: Floats,
    diffuse: Floats,
) -> tuple[Floats, Floats, Floats, float, float]:
    """States and covariances after each row, covariance of the diffuse part, and the two sums of logarithms.

    Exact diffuse start with two covariances (Koopman 1997), one scalar at a time (Koopman and Durbin 2000).
    """
    states, covariances, remaining, log_likelihood, log_diffuse = [], [], [], 0.0, 0.0
    for k, row in enumerate(y):
        use = np.isfinite(row)
        rows = decorrelate(noise[k][np.ix_(use, use)], output[k][use], row[use])
        for variance, h, value in zip(*rows, strict=True):
            innovation, m, m_diffuse = value - h @ state, covariance @ h, diffuse @ h
            s, s_diffuse = h @ m + variance, h @ m_diffuse
            if s_diffuse > 1e-9:  # absolute: the kernel must do better
                gain = m_diffuse / s_diffuse
                cross = np.outer(gain, m)
                state = state + gain * innovation
                covariance = covariance + np.outer(gain, gain) * s - cross - cross.T
                diffuse = diffuse - np.outer(gain, gain) * s_diffuse
                log_diffuse += float(np.log(s_diffuse))
            else:
                state = state + m / s * innovation
                covariance = covariance - np.outer(m, m) / s
                log_likelihood -= 0.5 * float(np.log(2 * np.pi * s) + innovation**2 / s)
        states.append(state)
        covariances.append(covariance)
        remaining.append(diffuse)
        state = transition @ state + drive[k]
        covariance = transition @ covariance @ transition.T + process
        diffuse = transition @ diffuse @ transition.T
    return np.array(states), np.array(covariances), np.array(remaining), log_likelihood, log_diffuse


def strand(
    transition: Floats, process: Floats, output: Floats, noise: Floats, y: Floats, guess: Floats
) -> tuple[Floats, Floats, Floats, Floats, float]:
    """A stretch filtered from a guess of its first state: last state and covariance, effect of an error of the guess on
    the state, sums of products of the innovation and its effects over S, sum of ln S.
    """
    n = len(guess)
    state, covariance, effects, moments, logs = (
        guess,
        np.zeros((n, n)),
        np.eye(n),
        np.zeros((n + 1, n + 1)),
        0.0,
    )
    for h, r, value in zip(output, noise, y, strict=True):
        if np.isfinite(value) and np.isfinite(r):
            variance = h @ covariance @ h + r
            gain, seen = covariance @ h / variance, np.append(value - h @ state, h @ effects)
            moments, logs = moments + np.outer(seen, seen) / variance, logs + float(np.log(variance))
            state, effects = state + gain * seen[0], effects - np.outer(gain, seen[1:])
            covariance = covariance - np.outer(gain, gain) * variance
        state, effects = transition @ state, transition @ effects
        covariance = transition @ covariance @ transition.T + process
    return state, covariance, effects, moments, logs


def block_diagonal(blocks: Floats) -> Floats:
    """(k, a, b) to (k a, k b)."""
    k, a, b = blocks.shape
    out = np.zeros((k, a, k, b))
    out[np.arange(k), :, np.arange(k)] = blocks
    return out.reshape(k * a, k * b)


def condition(
    transition: Floats,
    process: Floats,
    output: Floats,
    noise: Floats,
    y: Floats,
    drive: Floats,
    covariance: Floats,
    directions: Floats,
) -> tuple[Floats, Floats]:
    """Means and covariances of all states given all of y: one large Gaussian, generalised least squares.

    The first state is zero + noise of `covariance` + unknown multiples of the rows of `directions`.
    """
    rows, n = len(y), len(transition)
    prior, mean, effects = (
        np.zeros((rows, n, rows, n)),
        np.zeros((rows, n)),
        np.zeros((rows, n, len(directions))),
    )
    effects[0] = directions.T
    for k in range(rows):
        prior[k, :, k] = covariance
        for later in range(k + 1, rows):
            prior[later, :, k] = transition @ prior[later - 1, :, k]
            prior[k, :, later] = prior[later, :, k].T
        if k + 1 < rows:
            covariance = transition @ covariance @ transition.T + process
            mean[k + 1], effects[k + 1] = transition @ mean[k] + drive[k], transition @ effects[k]
    use = np.isfinite(y).ravel()
    h, v = block_diagonal(output)[use], block_diagonal(noise)[np.ix_(use, use)]
    full, effect = prior.reshape(rows * n, rows * n), effects.reshape(rows * n, -1)
    root = np.linalg.cholesky(h @ full @ h.T + v)
    seen, columns = np.linalg.solve(root, h @ full), np.linalg.solve(root, h @ effect)
    residual = np.linalg.solve(root, y.ravel()[use] - h @ mean.ravel())
    q, r = np.linalg.qr(columns)
    per_unit = np.linalg.solve(r.T, (effect - seen.T @ columns).T).T
    smoothed = mean.ravel() + seen.T @ residual + per_unit @ (q.T @ residual)
    spread = (full - seen.T @ seen + per_unit @ per_unit.T).reshape(rows, n, rows, n)
    return smoothed.reshape(rows, n), spread[np.arange(rows), :, np.arange(rows)]
