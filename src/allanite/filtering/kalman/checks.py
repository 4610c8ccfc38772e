# SPDX-License-Identifier: BSD-3-Clause
"""What a filter accepts: every refusal says what, where, and what to do."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.noise import StateSpace

__all__ = ["checked_matrix", "checked_row", "checked_shape", "checked_space"]

Array = NDArray[np.float64]

#: Negative eigenvalues of a covariance scaled to unit diagonal that rounding alone explains.
ROUNDING = 1e-10


def checked_space(space: StateSpace) -> StateSpace:
    """The same model with contiguous float64 arrays.

    Raises
    ------
    InputError
        Wrong shapes, numbers that are not finite, negative variance of the samples, or a covariance that is none.
    """
    if not isinstance(space, StateSpace):
        raise InputError(
            f"the model of a filter is a StateSpace, as model.state_space(dt) gives it, not {space!r}"
        )
    n = np.size(space.output)
    made = replace(
        space,
        transition=checked_matrix(space.transition, (n, n), "transition"),
        process=checked_covariance(space.process, n, "process"),
        initial=checked_covariance(space.initial, n, "initial"),
        output=checked_matrix(space.output, (n,), "output"),
        rate=checked_matrix(space.rate, (n,), "rate"),
    )
    if np.shape(space.diffuse) != (n,) or len(space.labels) != n:
        raise InputError(f"diffuse and labels of a model of {n} states must have {n} entries")
    noise = space.noise
    if isinstance(noise, bool) or not isinstance(noise, (int, float, np.floating, np.integer)):
        raise InputError(
            f"noise, the variance of v, must be one number, not {noise!r}; variances per row are noise="
        )
    if not (math.isfinite(noise) and noise >= 0):
        raise InputError(f"noise is the variance of v: finite and not negative, not {noise!r}")
    diffuse = np.asarray(space.diffuse, dtype=np.bool_)
    return replace(made, noise=float(noise), diffuse=diffuse)


def checked_shape(value: ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    """An array of numbers of this shape."""
    array = _numbers(value, name)
    if array.shape != shape:
        raise InputError(f"{name} must have shape {shape}, not {array.shape}")
    return array


def checked_matrix(value: ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    """An array of finite numbers of this shape."""
    array = checked_shape(value, shape, name)
    with np.errstate(over="ignore", invalid="ignore"):
        sound = math.isfinite(array.sum())  # one pass without a copy; large numbers may overflow it
    if not (sound or np.isfinite(array).all()):
        raise InputError(f"{name} holds numbers that are not finite")
    return array


def checked_covariance(value: ArrayLike, n: int, name: str) -> Array:
    """A symmetric, positive semidefinite matrix; both judged after scaling to unit diagonal.

    Raises
    ------
    InputError
        Not a covariance.
    """
    matrix = checked_matrix(value, (n, n), name)
    variances = np.diag(matrix)
    if (variances < 0).any():
        raise InputError(
            f"{name} is no covariance: variance {variances.min():g} of state {variances.argmin()}"
        )
    size = np.where(variances > 0, np.sqrt(variances), 1.0)
    unit = matrix / size / size[:, None]
    if n and np.abs(unit - unit.T).max() > ROUNDING:
        raise InputError(f"{name} is no covariance: it is not symmetric")
    if n and (np.abs(unit[variances == 0]).any() or np.linalg.eigvalsh(unit)[0] < -ROUNDING * n):
        raise InputError(
            f"{name} is no covariance: it is not positive semidefinite, some combination of states would have a "
            "negative variance"
        )
    return matrix


def checked_row(value: ArrayLike, name: str) -> Array:
    """Samples along one axis; the kernels take infinities for missing, as NaN."""
    array = _numbers(value, name)
    if array.ndim != 1:
        raise InputError(f"{name} must have shape (rows,), not {array.shape}; filter one channel at a time")
    return array


def _numbers(value: ArrayLike, name: str) -> Array:
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise InputError(f"{name} cannot be read as an array of numbers: {error}") from None
    if array.dtype.kind not in "iuf":
        raise InputError(f"{name} must hold real numbers, not {array.dtype}")
    return np.ascontiguousarray(array, dtype=np.float64)
