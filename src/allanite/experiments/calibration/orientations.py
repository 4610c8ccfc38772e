# SPDX-License-Identifier: BSD-3-Clause
"""Positions of a unit in words: six faces, twelve edges and eight corners."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.recording.calibration import AXES

__all__ = ["ORIENTATIONS", "half_axes_away", "words_of"]

Array = NDArray[np.float64]

#: A position covers half an axis within 60 deg of it: cosine.
NEAR = 0.5
HALF_AXES = tuple(f"{axis} {way}" for axis in AXES for way in ("up", "down"))


def _all() -> dict[str, tuple[int, ...]]:
    out = {}
    signs = [s for s in itertools.product((1, 0, -1), repeat=3) if any(s)]
    for s in sorted(signs, key=lambda s: sum(map(abs, s))):
        ends = [f"{'+' if v > 0 else '-'}{a}" for a, v in zip(AXES, s, strict=True) if v]
        if len(ends) == 1:
            words = f"{ends[0][1]} {'up' if ends[0][0] == '+' else 'down'}"
        elif len(ends) == 2:
            words = f"on an edge, {ends[0]} and {ends[1]} up"
        else:
            words = f"on a corner, {ends[0]}, {ends[1]} and {ends[2]} up"
        out[words] = s
    return out


#: What points up, in the axes of the body, of each position: a vector of 1, 0 and -1.
ORIENTATIONS: dict[str, tuple[int, ...]] = _all()
_DIRECTIONS = np.array([np.array(v) / np.linalg.norm(v) for v in ORIENTATIONS.values()])


def words_of(up: ArrayLike) -> str:
    """The nearest of the 26 positions in words.

    Parameters
    ----------
    up : array_like, shape (3,)
        The direction that points up, in the axes of the body.
    """
    return list(ORIENTATIONS)[int(np.argmax(_DIRECTIONS @ np.asarray(up, dtype=np.float64)))]


def half_axes_away(ups: ArrayLike, among: Sequence[str] = HALF_AXES) -> tuple[str, ...]:
    """Half axes of the body, "x up", that none of these directions comes near.

    Parameters
    ----------
    ups : array_like, shape (n, 3)
        Unit vectors that point up, in the axes of the body.
    among : sequence of str
        Those that are asked for.
    """
    directions = np.asarray(ups, dtype=np.float64).reshape(-1, 3)
    return tuple(half for half in among if not (directions @ np.array(ORIENTATIONS[half]) >= NEAR).any())
