# SPDX-License-Identifier: BSD-3-Clause
"""Attitudes: rotations as matrices, turns added up, and two directions seen from two frames.

A matrix takes the components of a vector in the body to those in the reference frame. The reference frame is north,
east, down; the body frame of roll, pitch and heading is forward, right, down. Other arrangements of the sensor's axes
are named by three letters: "FLU" is x forward, y left, z up (the convention of ROS, REP 103).

References
----------
.. [1] M. D. Shuster, "A survey of attitude representations", J. Astronautical Sciences 41 (1993) 439.
.. [2] H. D. Black, "A passive system for determining the attitude of a satellite", AIAA Journal 2 (1964) 1350 (TRIAD).
.. [3] M. D. Shuster, S. D. Oh, "Three-axis attitude determination from vector observations", J. Guidance and Control 4
   (1981) 70 (QUEST; Davenport's matrix, eq. 30 and 63).
.. [4] J. E. Bortz, "A new mathematical formulation for strapdown inertial navigation", IEEE Trans. Aerospace and
   Electronic Systems 7 (1971) 61, eq. 6: the rotation vector; to the second order in the increment.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError

__all__ = [
    "accumulated",
    "angles_of",
    "attitude_of",
    "axes_matrix",
    "quest",
    "rotation",
    "rotation_vector",
    "skew",
    "triad",
    "with_coning",
]

Array = NDArray[np.float64]

_LETTERS = {"F": (0, 1.0), "B": (0, -1.0), "R": (1, 1.0), "L": (1, -1.0), "D": (2, 1.0), "U": (2, -1.0)}
#: Below this angle [rad] sines are replaced by their series, which then has no error in float64.
_SMALL = 1e-4
_UNIT = np.eye(3)


def skew(vector: ArrayLike) -> Array:
    """Matrices S with S u = vector x u, shape (..., 3, 3)."""
    v = np.asarray(vector, dtype=np.float64)
    out = np.zeros((*v.shape, 3))
    out[..., 2, 1], out[..., 0, 2], out[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    return out - np.swapaxes(out, -1, -2)


def rotation(vector: ArrayLike) -> Array:
    """Matrices that rotate about `vector` by its length [rad], shape (..., 3, 3) (Rodrigues; [1, eq. 98])."""
    v = np.asarray(vector, dtype=np.float64)
    square = (v**2).sum(axis=-1)
    angle = np.sqrt(square)
    small = angle < _SMALL
    safe = np.where(small, 1.0, angle)
    first, second = np.sin(safe) / safe, 2 * (np.sin(safe / 2) / safe) ** 2
    if small.any():
        first = np.where(small, 1 - square / 6, first)
        second = np.where(small, 0.5 - square / 24, second)
    s = skew(v)
    return np.asarray(_UNIT + first[..., None, None] * s + second[..., None, None] * (s @ s))


def rotation_vector(matrix: ArrayLike) -> Array:
    """Axis times angle [rad], 0 to pi, of rotation matrices: the inverse of `rotation`, shape (..., 3)."""
    c = np.asarray(matrix, dtype=np.float64)
    q = _quaternion(c)
    q = np.where(q[..., :1] < 0, -q, q)
    length = np.linalg.norm(q[..., 1:], axis=-1)
    angle = 2 * np.arctan2(length, q[..., 0])
    factor = np.where(length < _SMALL, 2 + length**2 / 3, angle / np.where(length < _SMALL, 1.0, length))
    return np.asarray(factor[..., None] * q[..., 1:])


def _quaternion(c: Array) -> Array:
    """Scalar first; from the largest of its four components, so that no digits are lost (Shepperd)."""
    d0, d1, d2 = c[..., 0, 0], c[..., 1, 1], c[..., 2, 2]
    squares = np.stack([1 + d0 + d1 + d2, 1 + d0 - d1 - d2, 1 - d0 + d1 - d2, 1 - d0 - d1 + d2], axis=-1)
    a, b, e = c[..., 2, 1] - c[..., 1, 2], c[..., 0, 2] - c[..., 2, 0], c[..., 1, 0] - c[..., 0, 1]
    f, g, h = c[..., 1, 0] + c[..., 0, 1], c[..., 2, 0] + c[..., 0, 2], c[..., 2, 1] + c[..., 1, 2]
    rows = np.stack(
        [
            np.stack([squares[..., 0], a, b, e], axis=-1),
            np.stack([a, squares[..., 1], f, g], axis=-1),
            np.stack([b, f, squares[..., 2], h], axis=-1),
            np.stack([e, g, h, squares[..., 3]], axis=-1),
        ],
        axis=-2,
    )
    best = np.take_along_axis(rows, squares.argmax(axis=-1)[..., None, None], axis=-2)[..., 0, :]
    return np.asarray(best / np.linalg.norm(best, axis=-1, keepdims=True))


def attitude_of(roll: float, pitch: float, heading: float) -> Array:
    """Body (forward, right, down) to north, east, down; heading from north over east. All [rad], shape (3, 3)."""
    (cr, sr), (cp, sp), (ch, sh) = ((math.cos(a), math.sin(a)) for a in (roll, pitch, heading))
    return np.array(
        [
            [cp * ch, sr * sp * ch - cr * sh, cr * sp * ch + sr * sh],
            [cp * sh, sr * sp * sh + cr * ch, cr * sp * sh - sr * ch],
            [-sp, sr * cp, cr * cp],
        ]
    )


def angles_of(matrix: ArrayLike) -> tuple[float, float, float]:
    """Roll, pitch, heading [rad] of an attitude, the inverse of `attitude_of`; heading 0 to 2 pi.

    With the nose straight up or down roll and heading are one angle: all of it is given as heading.
    """
    c = np.asarray(matrix, dtype=np.float64)
    level = math.hypot(c[2, 1], c[2, 2])
    pitch = math.atan2(-c[2, 0], level)
    if level < 1e-9:
        return 0.0, pitch, math.atan2(-c[0, 1], c[1, 1]) % (2 * math.pi)
    return math.atan2(c[2, 1], c[2, 2]), pitch, math.atan2(c[1, 0], c[0, 0]) % (2 * math.pi)


def axes_matrix(axes: str) -> Array:
    """Components along the axes of the sensor to forward, right, down, shape (3, 3).

    Parameters
    ----------
    axes : str
        Where x, y and z point: F or B, R or L, D or U. "FLU": forward, left, up.

    Raises
    ------
    InputError
        Not three letters of three different directions, or a left-handed arrangement.
    """
    out = np.zeros((3, 3))
    if len(axes) != 3 or any(letter not in _LETTERS for letter in axes.upper()):
        raise InputError(
            f"axes {axes!r}: state the directions of x, y and z by three of the letters F B R L D U, like FLU"
        )
    for column, letter in enumerate(axes.upper()):
        row, sign = _LETTERS[letter]
        out[row, column] = sign
    if round(float(np.linalg.det(out))) != 1:
        raise InputError(
            f"axes {axes!r} are not a right-handed set of three directions, like FLU, FRD or RFU"
        )
    return out


def accumulated(turns: ArrayLike) -> Array:
    """The rotations from the body after 0, 1, ... n turns to the body before the first, shape (n + 1, 3, 3).

    Parameters
    ----------
    turns : array_like, shape (n, 3) [rad]
        Rotation vectors in the axes of the body, one after the other.

    Notes
    -----
    A running product, by doubling: log2(n) products of all matrices at once.
    """
    steps = rotation(np.asarray(turns, dtype=np.float64).reshape(-1, 3))
    out = np.concatenate([np.eye(3)[None], steps])
    reach = 1
    while reach < len(out):
        out[reach:] = out[:-reach] @ out[reach:]
        reach *= 2
    return out


def with_coning(increments: ArrayLike, edges: ArrayLike | None = None) -> Array:
    """The rotation vectors of increments, each the integral of the rate over a sample, shape (n, 3) [rad].

    While the axis moves, the rotation over a sample is not the integral of the rate. What is missing follows from the
    samples before and after, to second order [4]; the first and the last of a turn have none on one side, and stay.

    Parameters
    ----------
    increments : array_like, shape (n, 3) [rad]
    edges : array_like, shape (m + 1,), optional
        Where each of several turns begins, and where the last one ends.
    """
    steps = np.asarray(increments, dtype=np.float64)
    change = np.zeros_like(steps)
    change[1:-1] = steps[2:] - steps[:-2]
    bounds = np.asarray([0, len(steps)] if edges is None else edges, dtype=np.int64)
    if len(steps):
        change[bounds[:-1]] = change[bounds[1:] - 1] = 0.0
    x, y, z = steps.T
    dx, dy, dz = change.T
    return np.asarray(steps + np.stack([y * dz - z * dy, z * dx - x * dz, x * dy - y * dx], axis=-1) / 24)


def triad(first: ArrayLike, second: ArrayLike, first_known: ArrayLike, second_known: ArrayLike) -> Array:
    """Attitude from two directions seen in the body and known in the reference frame [2], shape (3, 3).

    The first direction is met exactly; of the second only the part across it counts. Lengths play no part.

    Raises
    ------
    InputError
        Directions of no length, or parallel.
    """
    return _frame(first_known, second_known) @ _frame(first, second).T


def _frame(first: ArrayLike, second: ArrayLike) -> Array:
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    across = np.cross(a, b)
    sizes = float(np.linalg.norm(a)), float(np.linalg.norm(across))
    if not sizes[0] > 0 or not sizes[1] > 1e-12 * sizes[0] * float(np.linalg.norm(b)):
        raise InputError("two parallel directions, or a zero vector, do not determine the attitude")
    x, y = a / sizes[0], across / sizes[1]
    return np.column_stack([x, y, np.cross(x, y)])


def quest(measured: ArrayLike, known: ArrayLike, weights: ArrayLike) -> Array:
    """Attitude from any number of directions, by least squares (Wahba's problem), shape (3, 3).

    Parameters
    ----------
    measured, known : array_like, shape (n, 3)
        Directions in the body and in the reference frame; lengths play no part.
    weights : array_like, shape (n,)
        Inverse variances of the directions.

    Notes
    -----
    The eigenvector of Davenport's matrix with the largest eigenvalue [3, eq. 63], which QUEST finds by iteration, here
    by the eigenvalues of a symmetric 4 x 4 matrix.

    Raises
    ------
    InputError
        All directions parallel.
    """
    b, r = (np.asarray(v, dtype=np.float64) for v in (measured, known))
    b, r = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (b, r))
    profile = np.einsum("k,ki,kj->ij", np.asarray(weights, dtype=np.float64), r, b)
    davenport = np.empty((4, 4))
    davenport[0, 0] = np.trace(profile)
    davenport[0, 1:] = davenport[1:, 0] = [
        profile[2, 1] - profile[1, 2], profile[0, 2] - profile[2, 0], profile[1, 0] - profile[0, 1]
    ]  # fmt: skip
    davenport[1:, 1:] = profile + profile.T - np.trace(profile) * np.eye(3)
    values, vectors = np.linalg.eigh(davenport)
    if values[3] - values[2] < 1e-12 * abs(values[3]):
        raise InputError("parallel directions do not determine the attitude")
    w, x, y, z = vectors[:, 3]
    v = np.array([x, y, z])
    return np.asarray((w**2 - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * skew(v))
