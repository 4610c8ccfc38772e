# SPDX-License-Identifier: BSD-3-Clause
"""Turns of the sensor between quiet stretches, from the rotation that the gyros saw across the disturbed ones.

People who enter a vehicle tilt it by hundredths of a degree: the mean of a vector that turned by less than a degree
is shorter by less than 1 - cos(0.5 deg) = 4e-5. Beyond that the stretches are different poses, each with its own
vector; the length is the same in all of them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_vector.stretches import MOVING, QUIET, SHORT, AxisCells

__all__ = ["find_poses", "without_short"]

Array = NDArray[np.float64]
States = NDArray[np.int64]

#: Rotation from which a pose is a new one [rad].
TURNED = math.radians(1.0)
#: Cells that a pose needs for its direction.
LEAST = 3


def find_poses(cells: AxisCells, state: States) -> tuple[States, Array]:
    """The pose of each cell, and the turns between poses.

    Returns
    -------
    pose : ndarray of int64, shape (n,)
        Counted from 0; -1 where the cell is not quiet.
    turn : ndarray, shape (n_poses,) [rad]
        How far the sensor had turned since the beginning of the pose before; zero for the first, NaN where samples
        were missing while it moved.
    """
    pose = np.full(cells.count, -1, dtype=np.int64)
    quiet = np.flatnonzero(state == QUIET)
    if len(quiet) == 0:
        return pose, np.zeros(0)
    number, since, turns = 0, np.zeros(cells.mean.shape[1]), [0.0]
    pose[quiet[0]] = 0
    for a, b in zip(quiet[:-1], quiet[1:], strict=True):
        if b - a > 1:
            since = since + _rotation(cells, state, int(a), int(b))
            angle = float(np.linalg.norm(since))
            if not angle <= TURNED:
                number, since = number + 1, np.zeros_like(since)
                turns.append(angle)
        pose[b] = number
    return pose, np.array(turns)


def _rotation(cells: AxisCells, state: States, a: int, b: int) -> Array:
    """Rotation between two quiet cells, beyond what both of them show as rate [rad].

    Samples that are missing while nothing moves beside them are taken for a sensor at rest.
    """
    between = cells.mean[a + 1 : b] - 0.5 * (cells.mean[a] + cells.mean[b])
    whole = cells.whole[a + 1 : b]
    if not whole.all() and not (state[a + 1 : b] == MOVING).any():
        between = between[whole]
    elif not whole.all():
        return np.full(cells.mean.shape[1], np.nan)
    return np.asarray(between.sum(axis=0) * cells.dt)


def without_short(state: States, pose: States) -> States:
    """The states with SHORT for quiet cells of a pose that has too few."""
    quiet = state == QUIET
    counts = np.bincount(pose[quiet], minlength=int(pose.max(initial=-1)) + 1)
    few = np.flatnonzero(counts < LEAST)
    return np.asarray(np.where(quiet & np.isin(pose, few), SHORT, state), dtype=np.int64)
