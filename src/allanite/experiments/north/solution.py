# SPDX-License-Identifier: BSD-3-Clause
"""The vector (x, y) = H (cos psi, sin psi) from one axis or several, each in its own noise and with its own bias.

An axis at the heading psi + theta sees H cos(psi + theta) = x cos(theta) - y sin(theta). Each axis is whitened by the
filter of its own noise (`allanite.filtering.regression`), its level is taken out, and the whitened rows of all axes,
being independent, are stacked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.north.tracks import Track
from allanite.filtering.regression import Whitener
from allanite.lazy_dataclasses import dataclass

__all__ = ["NorthSolution", "solve"]

Array = NDArray[np.float64]

#: Of a direction of the plane: information below this part (its root) of what the columns hold is rounding.
RANK = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class NorthSolution:
    """Generalised least squares.

    Attributes
    ----------
    vector : ndarray, shape (2,) [rad/s]
        (x, y); in a direction that the design does not see, zero.
    covariance : ndarray, shape (2, 2)
        Under the noise models; of the observable directions.
    observable : ndarray, shape (rank, 2)
        Unit vectors of the plane that the design sees.
    information : tuple of ndarray, shape (2, 2)
        Of each axis, its level taken out.
    levels : tuple of (float, float) [rad/s]
        Bias of each axis, and its standard deviation.
    chi2, dof : float, int
        Of the whitened residuals.
    drift : float
        Chi-square, with two degrees of freedom, that a vector which changes with time takes off the residuals.
    running : ndarray, shape (n, 2), and (n, 2, 2)
        Vector and covariance from the rows before each checkpoint; NaN while not both components are seen.
    """

    vector: Array
    covariance: Array
    observable: Array
    information: tuple[Array, ...] = field(repr=False)
    levels: tuple[tuple[float, float], ...]
    chi2: float
    dof: int
    drift: float
    running: tuple[Array, Array] = field(repr=False)

    @property
    def rank(self) -> int:
        """Components that the design sees: 0, 1 or 2."""
        return len(self.observable)


@dataclass(frozen=True, slots=True, kw_only=True)
class _White:
    """Whitened rows of an axis: columns (2), the same times time (2), level, samples; zero where missing."""

    rows: Array
    free: Array
    whole: Array
    count: int

    @classmethod
    def of(cls, track: Track) -> _White:
        used, blocks = track.used, track.blocks
        time = 2 * blocks.time / (blocks.size * blocks.dt) - 1
        columns = np.nan_to_num(np.column_stack([track.cosine, -track.sine]))
        y = np.where(used, blocks.mean, 0.0)
        y[used] -= y[used].mean()
        table = np.column_stack([columns, columns * time[:, None], np.ones(blocks.size), y])
        whitener = Whitener.of(
            track.model, dt=blocks.dt, counts=np.where(used, blocks.part, 0.0), sampling=track.sampling
        )
        rows = np.nan_to_num(whitener(table)[0])
        level = rows[:, 4]
        free = rows - np.outer(level, level @ rows) / (level @ level)
        return cls(rows=rows, free=free, whole=np.sqrt((rows[:, :2] ** 2).sum(axis=0)), count=int(used.sum()))


def solve(tracks: Sequence[Track], checkpoints: Sequence[int] = ()) -> NorthSolution:
    """The fit; checkpoints are numbers of blocks."""
    white = [_White.of(track) for track in tracks]
    columns = np.concatenate([w.free[:, :2] for w in white])
    y = np.concatenate([w.free[:, 5] for w in white])
    left, values, right = np.linalg.svd(columns, full_matrices=False)
    keep = values > RANK * max(float(np.hypot(*w.whole)) for w in white)
    left, values, right = left[:, keep], values[keep], right[keep]
    inside = left.T @ y
    vector, half = right.T @ (inside / values), right.T / values
    covariance = half @ half.T
    residual = y - left @ inside
    slow = np.concatenate([w.free[:, 2:4] for w in white])
    return NorthSolution(
        vector=vector,
        covariance=covariance,
        observable=right,
        information=tuple(w.free[:, :2].T @ w.free[:, :2] for w in white),
        levels=tuple(_level(w, t, vector, covariance) for w, t in zip(white, tracks, strict=True)),
        chi2=float(residual @ residual),
        dof=sum(w.count for w in white) - len(white) - len(values),
        drift=_taken_off(residual, slow - left @ (left.T @ slow)),
        running=_running(white, checkpoints),
    )


def _level(white: _White, track: Track, vector: Array, covariance: Array) -> tuple[float, float]:
    level = white.rows[:, 4]
    size = float(level @ level)
    through = level @ white.rows[:, :2] / size
    value = float(level @ white.rows[:, 5]) / size - float(through @ vector)
    first = float(track.blocks.mean[track.used].mean())  # removed before the fit
    return first + value, float(np.sqrt(1 / size + through @ covariance @ through))


def _taken_off(residual: Array, columns: Array) -> float:
    left, values, _ = np.linalg.svd(columns, full_matrices=False)
    inside = (left.T @ residual)[values > 1e-6 * max(float(values[0]), 1e-300)]
    return float(inside @ inside)


def _running(white: Sequence[_White], checkpoints: Sequence[int]) -> tuple[Array, Array]:
    """From sums of products that grow from one checkpoint to the next."""
    vectors, covariances = np.full((len(checkpoints), 2), np.nan), np.full((len(checkpoints), 2, 2), np.nan)
    products, done = np.zeros((len(white), 4, 4)), 0
    for i, stop in enumerate(checkpoints):
        for k, w in enumerate(white):
            part = w.rows[done:stop][:, [0, 1, 4, 5]]
            products[k] += part.T @ part
        done = max(done, stop)
        size = np.where(products[:, 2, 2] > 0, products[:, 2, 2], 1.0)[:, None, None]
        free = (products - products[:, :, 2:3] * products[:, 2:3, :] / size).sum(axis=0)
        values, vectors_of = np.linalg.eigh(free[:2, :2])
        if values[0] > RANK * float(np.trace(products.sum(axis=0)[:2, :2])):
            covariances[i] = (vectors_of / values) @ vectors_of.T
            vectors[i] = covariances[i] @ free[:2, 3]
    return vectors, covariances
