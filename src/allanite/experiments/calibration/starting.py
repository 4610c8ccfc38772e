# SPDX-License-Identifier: BSD-3-Clause
"""A first idea of scale factors, biases and attitudes, from which the least squares converge.

Raw counts say nothing by themselves: the accelerometers of at least four positions lie on a sphere, whose centre is the
bias and whose radius is gravity; the gyros turn by a number of counts from one direction of gravity to the next.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.experiments.calibration.adjustment.turning import TurningSamples
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural
from allanite.quantities.attitude import rotation

__all__ = ["Arrangement", "attitudes_of", "best_arrangement", "disagreement", "gyro_scale", "sphere"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Least singular value of the sphere's equations over the largest: positions that leave it open lie near one plane.
SPREAD = 0.02
#: Steps of a turn that the search for a scale factor works on, a power of two; turns by which gravity moves by less
#: [rad] are left out of it.
COARSE, LEAST_TURN = 64, 0.3
#: Lowest scale factor that is tried, over the highest that the turns allow, and the step from one to the next.
LOWEST, STEP = 0.1, 1.04


def sphere(means: Array, gravity: float) -> tuple[Array, float]:
    """Bias and scale factor of accelerometers from their means in several positions, in their own unit.

    Raises
    ------
    DataQualityError
        Fewer than four positions, or all of them near one plane.
    """
    center = means.mean(axis=0)
    size = float(np.sqrt(((means - center) ** 2).sum(axis=1).mean()))
    text = (
        "accelerometers in counts need at least four positions that do not lie in one plane, like x up, y up, z up and "
        "z down. If there were more, the unit was not at rest in them: look at the log, or say when it rested "
        "(--spans); or state their unit with a scale factor (--scale-factor)"
    )
    if len(means) < 4 or not size > 0:
        raise DataQualityError(f"{plural(len(means), 'position')}: {text}")
    z = (means - center) / size
    table = np.column_stack([2 * z, np.ones(len(z))])
    values = np.linalg.svd(table, compute_uv=False)
    if values[-1] < SPREAD * values[0]:
        raise DataQualityError(f"these {len(means)} positions do not determine the scale factors: {text}")
    coefficients = np.linalg.lstsq(table, (z**2).sum(axis=1), rcond=None)[0]
    radius = math.sqrt(float(coefficients[3] + coefficients[:3] @ coefficients[:3]))
    return center + size * coefficients[:3], size * radius / gravity


def attitudes_of(down: Array | None, n: int, before: Index, after: Index, turns: Array) -> Array:
    """Body to level frame of each span: gravity by the accelerometers, heading by the gyros, shape (n, 3, 3).

    Parameters
    ----------
    down : ndarray, shape (n, 3), or None
        In the axes of the body; None without accelerometers.
    n : int
    before, after : ndarray of int64, shape (m,)
        Spans that are linked.
    turns : ndarray, shape (m, 3, 3)
        From the body after to the body before.
    """
    links = {int(j): (int(i), turns[k]) for k, (i, j) in enumerate(zip(before, after, strict=True))}
    out = np.empty((n, 3, 3))
    for j in range(n):
        if j in links:
            i, turn = links[j]
            guess = out[i] @ turn
        else:
            guess = np.eye(3)
        out[j] = guess if down is None else _onto_vertical(guess @ down[j]) @ guess
    return out


def _onto_vertical(v: Array) -> Array:
    """The smallest rotation that takes v to the third axis."""
    axis = np.cross(v, [0.0, 0.0, 1.0])
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        return np.eye(3) if v[2] > 0 else np.diag([1.0, -1.0, -1.0])
    return rotation(axis / length * math.atan2(length, float(v[2])))


# -- gyros against gravity ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Coarse:
    """Turns in a few long steps each.

    Attributes
    ----------
    steps : ndarray, shape (m, COARSE, 3)
        Integrals of the samples.
    before, after : ndarray, shape (m, 3)
        Gravity in the axes of the body.
    """

    steps: Array
    before: Array
    after: Array

    def misses(self, matrix: Array) -> Array:
        """Angles between gravity as carried by the gyros and as seen, shape (m,) [rad]."""
        turns = rotation(self.steps @ np.linalg.inv(matrix).T)
        while turns.shape[1] > 1:
            turns = turns[:, ::2] @ turns[:, 1::2]
        met = np.einsum("mi,mij,mj->m", self.before, turns[:, 0], self.after)
        return np.asarray(np.arccos(np.clip(met, -1, 1)))


def _coarse(motion: TurningSamples, bias: Array, down: Array, before: Index, after: Index) -> _Coarse | None:
    """Turns by which gravity moves much, their samples joined."""
    angle = np.arccos(np.clip((down[before] * down[after]).sum(axis=1), -1, 1))
    use = np.flatnonzero(angle > LEAST_TURN)
    if len(use) == 0:
        return None
    steps = np.zeros((len(use), COARSE, 3))
    for k, turn in enumerate(use):
        part = slice(motion.edges[turn], motion.edges[turn + 1])
        y = (motion.y[part] - bias) * motion.dt[turn]
        if motion.weight is not None:
            y = y * motion.weight[part, None]
        np.add.at(steps[k], np.arange(len(y)) * COARSE // len(y), y)
    return _Coarse(steps=steps, before=down[before[use]], after=down[after[use]])


def gyro_scale(motion: TurningSamples, bias: Array, down: Array, before: Index, after: Index) -> float | None:
    """Counts per rad/s that carry gravity best from span to span; None where it never moves much.

    A turn is at least as long as gravity moves, which bounds the scale factor from above; from there it is searched
    for in small steps, since a turn by a wrong amount may meet the right direction by chance.
    """
    coarse = _coarse(motion, bias, down, before, after)
    if coarse is None:
        return None
    path = np.linalg.norm(coarse.steps, axis=2).sum(axis=1)
    moved = np.arccos(np.clip((coarse.before * coarse.after).sum(axis=1), -1, 1))
    highest = 1.1 * float(np.min(path / moved))
    tried = highest * STEP ** -np.arange(0, math.log(1 / LOWEST) / math.log(STEP))
    miss = [float(np.mean(coarse.misses(s * np.eye(3)) ** 2)) for s in tried]
    best = float(tried[int(np.argmin(miss))])
    near = best * np.linspace(1 / STEP, STEP, 9)
    return float(near[int(np.argmin([np.mean(coarse.misses(s * np.eye(3)) ** 2) for s in near]))])


def disagreement(motion: TurningSamples, bias: Array, down: Array, before: Index, after: Index) -> float:
    """Median angle between gravity as carried by the gyros and as seen [rad]; 0 where it never moves much."""
    coarse = _coarse(motion, bias, down, before, after)
    return 0.0 if coarse is None else float(np.median(coarse.misses(np.eye(3))))


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrangement:
    """Which gyro lies along which accelerometer.

    Attributes
    ----------
    order : tuple of int
        Of the gyros, along x, y and z of the accelerometers.
    turned : tuple of int
        Gyros that show the opposite.
    miss : float [rad]
        Median angle that is left.
    """

    order: tuple[int, ...]
    turned: tuple[int, ...]
    miss: float


def best_arrangement(
    motion: TurningSamples, bias: Array, down: Array, before: Index, after: Index
) -> Arrangement | None:
    """The order and the signs of the gyros that go best with the accelerometers."""
    coarse = _coarse(motion, bias, down, before, after)
    if coarse is None:
        return None
    best = Arrangement(order=(), turned=(), miss=math.inf)
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[order, np.arange(3)] = signs
            miss = float(np.median(coarse.misses(matrix)))
            if miss < best.miss:
                turned = tuple(order[k] for k in range(3) if signs[k] < 0)
                best = Arrangement(order=order, turned=turned, miss=miss)
    return best
