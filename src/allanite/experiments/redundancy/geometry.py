# SPDX-License-Identifier: BSD-3-Clause
"""Where the sensors point: axes, parity matrix, best weights, and which sensors no parity can tell apart.

References
----------
.. [1] J. E. Potter, M. C. Suman, "Thresholdless redundancy management with arrays of skewed instruments", AGARDograph
   224 (1977): the parity matrix.
.. [2] A. C. Aitken, "On least squares and linear combination of observations", Proc. R. Soc. Edinburgh 55 (1935) 42:
   the weights.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError

__all__ = ["best_weights", "checked_directions", "parity_matrix", "twins"]

Array = NDArray[np.float64]

#: Axes this close to a plane or a line do not measure what is across it: ratio of singular values.
FLAT = 1e-3
#: Columns of the parity matrix this close to parallel belong to sensors that cannot be told apart.
PARALLEL = 1e-6


def checked_directions(directions: ArrayLike | None, count: int) -> Array:
    """Sensitive axes, shape (count, 3) or, where all lie along one, (count, 1).

    Raises
    ------
    InputError
        No redundancy, axes that are not of length one, or all in one plane.
    """
    h = np.ones((count, 1)) if directions is None else np.asarray(directions, dtype=np.float64)
    if h.shape not in ((count, 3), (count, 1)):
        raise InputError(f"directions of {count} sensors have shape ({count}, 3), not {h.shape}")
    length = np.linalg.norm(h, axis=1)
    if not (np.isfinite(h).all() and np.abs(length - 1).max() < 0.01):
        raise InputError(f"sensitive axes are unit vectors; their lengths are {np.round(length, 3).tolist()}")
    h = h / length[:, None]
    m = h.shape[1]
    if count <= m:
        need = "two sensors of one axis" if m == 1 else "four sensors of three axes"
        raise InputError(f"{count} sensors are not redundant: {need}, or more")
    values = np.linalg.svd(h, compute_uv=False)
    if values[-1] < FLAT * values[0]:
        raise InputError(
            "the sensitive axes lie in one plane or along one line and do not measure what is across it: leave "
            "directions out for sensors along one axis"
        )
    return np.asarray(h)


def parity_matrix(directions: Array) -> Array:
    """V with V H = 0 and V V' = 1 [1], shape (n - m, n); row by row, its first element is not negative."""
    left = np.linalg.svd(directions)[0][:, directions.shape[1] :].T
    lead = left[np.arange(len(left)), np.argmax(np.abs(left) > 1e-9, axis=1)]
    return np.asarray(left * np.where(lead < 0, -1.0, 1.0)[:, None])


def best_weights(directions: Array, covariance: Array) -> Array:
    """(H' C^-1 H)^-1 H' C^-1: unbiased with the smallest variance along every axis [2], shape (m, n)."""
    solved = np.linalg.solve(covariance, directions)
    return np.asarray(np.linalg.solve(directions.T @ solved, solved.T))


def twins(parity: Array) -> tuple[tuple[int, ...], ...]:
    """Groups of sensors whose faults look alike in the parity: those with parallel columns of V."""
    columns = parity / np.linalg.norm(parity, axis=0)
    alike = np.abs(columns.T @ columns) > 1 - PARALLEL
    groups = {tuple(np.flatnonzero(row).tolist()) for row in alike}
    return tuple(sorted(group for group in groups if len(group) > 1))
