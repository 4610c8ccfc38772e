# SPDX-License-Identifier: BSD-3-Clause
"""From the horizontal rate of the Earth to headings, their arcs and their budget, at the end and as the record grows.

With the rate (h_1, h_2) along x and y of the level frame of a stand, the heading of its x axis is the direction of
(h_1, -h_2). The azimuth of the turns is in the covariance of that vector: an error of it moves the vector across.
"""

from __future__ import annotations

import math
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.alignment.case import Case
from allanite.experiments.alignment.results import LevelledAttitude, RunningHeading, largest_sd
from allanite.experiments.alignment.solution import RANK, AlignmentSolution
from allanite.experiments.north.circle import CIRCLE, Arc, direction_set, half_width, length_interval, wrapped
from allanite.lazy_dataclasses import dataclass

__all__ = [
    "Direction",
    "StandAnswer",
    "answers_of",
    "direction_of",
    "excludes",
    "length_of",
    "packed",
    "running_of",
]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Direction:
    """A heading out of a horizontal vector.

    Attributes
    ----------
    vector, covariance : ndarray, shape (2,), (2, 2)
        Along x and y of the level frame [rad/s].
    heading, sd : float [rad]
        NaN and infinite where the vector cannot be told from the biases.
    arc : Arc
    signal_to_noise : float
    """

    vector: Array
    covariance: Array = field(repr=False)
    heading: float
    sd: float
    arc: Arc
    signal_to_noise: float

    @property
    def length(self) -> float:
        """Of the vector [rad/s]."""
        return float(np.hypot(*self.vector))

    @property
    def along(self) -> float:
        """Standard deviation of the length by the noise [rad/s]."""
        u = self.vector / self.length
        return math.sqrt(float(u @ self.covariance @ u))


def direction_of(vector: Array, covariance: Array, confidence: float, more: float = 0.0) -> Direction:
    """The heading with its arc; `more` is a further standard uncertainty of it [rad]."""
    if not np.isfinite(covariance).all():
        return Direction(
            vector=np.full(2, np.nan), covariance=covariance, heading=math.nan, sd=math.inf, arc=CIRCLE,
            signal_to_noise=0.0,
        )  # fmt: skip
    mirror = np.array([1.0, -1.0])
    mirrored, mirrored_covariance = vector * mirror, covariance * np.outer(mirror, mirror)
    length = float(np.hypot(*mirrored))
    across = np.array([-mirrored[1], mirrored[0]]) / length if length > 0 else np.array([0.0, 1.0])
    sd = math.sqrt(float(across @ mirrored_covariance @ across)) / length if length > 0 else math.inf
    return Direction(
        vector=vector,
        covariance=covariance,
        heading=wrapped(math.atan2(mirrored[1], mirrored[0])),
        sd=math.hypot(sd, more),
        arc=direction_set(mirrored, mirrored_covariance, confidence, more),
        signal_to_noise=math.sqrt(float(mirrored @ np.linalg.solve(mirrored_covariance, mirrored))),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class StandAnswer:
    """What is asked for of a stand.

    Attributes
    ----------
    attitude : LevelledAttitude
    direction : Direction
    budget : dict of str to float [rad]
        Standard uncertainties of the heading by source; empty where it is not told from the biases.
    gradient : ndarray, shape (2, n_unknown)
        Of the horizontal rate.
    """

    attitude: LevelledAttitude
    direction: Direction
    budget: dict[str, float]
    gradient: Array = field(repr=False)


def answers_of(
    solution: AlignmentSolution,
    times: tuple[float, float],
    confidence: float,
    inflation: float,
    stated: float,
) -> tuple[StandAnswer, StandAnswer]:
    """Roll, pitch and heading of the first stand and of the last.

    Parameters
    ----------
    times : (float, float) [s]
        Of the two.
    inflation : float
    stated : float [rad]
        Uncertainty of the heading axis in the unit.
    """
    values, gradient = solution.answers
    axes = solution.geometry.heading_axes
    first, last = (
        _answer(solution, k, values[rows], gradient[rows], axes[k], time, confidence, inflation, stated)
        for rows, k, time in zip((slice(0, 4), slice(4, 8)), (0, -1), times, strict=True)
    )
    return first, last


def _answer(
    solution: AlignmentSolution,
    stand: int,
    values: Array,
    gradient: Array,
    axis: str,
    time: float,
    confidence: float,
    inflation: float,
    stated: float,
) -> StandAnswer:
    h1, h2, roll, pitch = values
    level = gradient[:2]
    covariance = solution.covariance(level) * inflation**2
    direction = direction_of(np.array([h1, h2]), covariance, confidence, stated)
    sds = np.sqrt(np.maximum(np.diag(gradient[2:] @ solution.inverse @ gradient[2:].T), 0.0))
    attitude = LevelledAttitude(
        time=time,
        roll=float(roll),
        pitch=float(pitch),
        roll_sd=float(sds[0]) if axis == "forward" else math.inf,
        pitch_sd=float(sds[1]) if axis == "forward" else _lean(solution, stand),
        heading=direction.heading,
        heading_sd=direction.sd,
        interval=direction.arc,
        heading_axis=axis,
    )
    turned = np.array([h2, -h1]) @ level / (h1**2 + h2**2)
    return StandAnswer(
        attitude=attitude,
        direction=direction,
        budget=_budget(solution, turned, inflation, stated),
        gradient=level,
    )


def _lean(solution: AlignmentSolution, stand: int) -> float:
    """Standard deviation of the vertical in the direction where it is largest: of the pitch of a nose up or down [rad].

    There the pitch is as large as it can be, whichever way the nose leans: its derivative says nothing.
    """
    gradient = solution.gradient(lambda p: solution.geometry.chain(p).down[..., stand, :])
    return largest_sd(gradient @ solution.inverse @ gradient.T)


def _budget(solution: AlignmentSolution, turned: Array, inflation: float, stated: float) -> dict[str, float]:
    budget = {name: inflation * sd for name, sd in solution.budget(turned).items()}
    if not budget:
        return {}
    total = inflation * math.sqrt(float(turned @ solution.inverse @ turned))
    if stated:
        budget["heading"] = stated
    return {**budget, "together": math.hypot(total, stated)}


def excludes(direction: Direction, reference: float, expected: float, confidence: float) -> bool:
    """Is the horizontal rate something else than expected, at this confidence?"""
    low, high = length_of(direction, reference, confidence)
    return not low <= expected <= high


def length_of(direction: Direction, reference: float, confidence: float) -> tuple[float, float]:
    """Interval of the horizontal rate: of the noise, its two sides joined with what the reference is uncertain by."""
    if not math.isfinite(direction.length):
        return 0.0, math.inf
    z, noise, length = half_width(confidence), direction.along, direction.length
    low, high = (x * noise for x in length_interval(length / noise, confidence))
    below, above = math.hypot(length - low, z * reference), math.hypot(high - length, z * reference)
    return max(length - below, 0.0), length + above


# -- as the record grows ---------------------------------------------------------------------------------


def running_of(
    case: Case,
    solution: AlignmentSolution,
    answer: StandAnswer,
    times: Array,
    confidence: float,
    inflation: float,
    more: float,
) -> RunningHeading:
    """The heading at the end of the record, from what was measured until each time; linear about the final fit."""
    geometry, p = case.geometry, solution.parameters
    slopes, gradient = solution.slopes, answer.gradient
    expected, vector = geometry.gyros(p), geometry.answers(p)[4:6]
    prior, unknown = solution.rows[solution.n_data :], solution.residual[solution.n_data :]
    directions = []
    for stand_mask, level, covariance in case.gyro.running:
        if not stand_mask.any():
            directions.append(_nothing(confidence))
            continue
        rows, residual = [prior], [unknown]
        for i in range(3):
            factor = np.linalg.cholesky(covariance[i])
            rows.append(np.linalg.solve(factor, slopes[stand_mask, i]))
            residual.append(np.linalg.solve(factor, level[i] - expected[stand_mask, i]))
        change, change_covariance = _linear(np.concatenate(rows), np.concatenate(residual), gradient)
        directions.append(direction_of(vector + change, change_covariance * inflation**2, confidence, more))
    return packed(times, [*directions[:-1], answer.direction])


def _nothing(confidence: float) -> Direction:
    return direction_of(np.full(2, np.nan), np.full((2, 2), np.inf), confidence)


def _linear(rows: Array, residual: Array, gradient: Array) -> tuple[Array, Array]:
    """Change and covariance of the horizontal vector by linear least squares; infinite where it is not told."""
    lengths = np.linalg.norm(rows, axis=0)
    scale = np.where(lengths > 0, lengths, 1.0)
    values, vectors = np.linalg.eigh((rows / scale).T @ (rows / scale))
    keep = values > RANK
    sized = gradient / scale
    hidden = np.linalg.norm(sized @ vectors[:, ~keep], axis=1) > 1e-6 * np.linalg.norm(sized, axis=1)
    if hidden.any():
        return np.full(2, np.nan), np.full((2, 2), np.inf)
    half = sized @ vectors[:, keep] / np.sqrt(values[keep])
    change = half @ ((vectors[:, keep].T @ ((rows / scale).T @ residual)) / np.sqrt(values[keep]))
    return change, half @ half.T


def packed(times: Array, directions: list[Direction]) -> RunningHeading:
    """Directions at times as arrays."""
    width = np.array([f.arc.width for f in directions])
    columns = {
        "time": np.asarray(times, dtype=np.float64),
        "heading": np.array([f.heading for f in directions]),
        "sd": np.array([f.sd for f in directions]),
        "start": np.array([f.arc.start if not math.isnan(f.heading) else math.nan for f in directions]),
        "width": width,
    }
    for column in columns.values():
        column.flags.writeable = False
    return RunningHeading(**columns)
