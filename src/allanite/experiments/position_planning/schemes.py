# SPDX-License-Identifier: BSD-3-Clause
"""Positions of a unit: the 26 that a box can be set to, the way from one to the next, and the usual schemes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.experiments.calibration.orientations import ORIENTATIONS, words_of
from allanite.quantities.attitude import rotation

__all__ = ["CANDIDATES", "STANDARD", "attitudes_along", "candidates_of", "words_of"]

Array = NDArray[np.float64]

#: Directions that point up, unit vectors in the axes of the body: 6 faces, 12 edges, 8 corners.
CANDIDATES: Array = np.array([np.array(v) / np.linalg.norm(v) for v in ORIENTATIONS.values()])
#: How many of them a box, a box with a wedge, and one with a corner can be set to.
_COUNTS = {"faces": 6, "edges": 18, "all": 26}
_FACES = ((0, 0, 1), (0, 1, 0), (0, 0, -1), (0, -1, 0), (1, 0, 0), (-1, 0, 0))
_EDGES = ((0, 1, 1), (1, 0, 1), (1, 1, 0))


def candidates_of(which: str) -> Array:
    """Directions that may be chosen: "faces", "edges" (with the faces) or "all", shape (n, 3).

    Raises
    ------
    InputError
        Another word.
    """
    if which not in _COUNTS:
        raise InputError(f"candidates must be {', '.join(_COUNTS)}, not {which!r}")
    return CANDIDATES[: _COUNTS[which]]


def attitudes_along(ups: ArrayLike) -> Array:
    """Body to north, east, down along a way on which each turn is the shortest, shape (n, 3, 3).

    Parameters
    ----------
    ups : array_like, shape (n, 3)
        What points up, in the axes of the body.
    """
    directions = np.asarray(ups, dtype=np.float64)
    out = [_first(directions[0])]
    for before, after in zip(directions[:-1], directions[1:], strict=True):
        out.append(out[-1] @ rotation(-_shortest(before, after)))
    return np.stack(out)


def _first(up: Array) -> Array:
    """An attitude in which `up` points up: by the shortest way from z down."""
    return np.asarray(rotation(-_shortest(np.array([0.0, 0.0, -1.0]), up)))


def _shortest(before: Array, after: Array) -> Array:
    """Rotation vector in the body that takes `before` to `after`; half a turn goes about the axis most across."""
    across = np.cross(before, after)
    sine, cosine = float(np.linalg.norm(across)), float(before @ after)
    if sine > 1e-9:
        return np.asarray(across / sine * math.atan2(sine, cosine))
    if cosine > 0:
        return np.zeros(3)
    axis = np.eye(3)[int(np.argmin(np.abs(before)))]
    axis = axis - (axis @ before) * before
    return np.asarray(math.pi * axis / np.linalg.norm(axis))


def _nineteen() -> Array:
    """Nineteen positions joined by quarter turns about the axes of the body, each both ways."""
    turns = [
        *[(1, 1)] * 3,
        *[(1, -1)] * 3,
        (2, 1),
        *[(0, 1)] * 3,
        *[(0, -1)] * 3,
        *[(2, 1)] * 2,
        *[(2, -1)] * 3,
    ]
    out = [np.eye(3)]
    for axis, sense in turns:
        out.append(out[-1] @ rotation(sense * math.pi / 2 * np.eye(3)[axis]))
    return np.stack(out)


def _along(vectors: Sequence[tuple[int, int, int]]) -> Array:
    return attitudes_along([np.array(v) / np.linalg.norm(v) for v in vectors])


#: Attitudes of the usual schemes, by name.
STANDARD: dict[str, Array] = {
    "6 faces": _along(_FACES),
    "9: faces and 3 edges": _along((*_FACES, *_EDGES)),
    "19 quarter turns": _nineteen(),
}
