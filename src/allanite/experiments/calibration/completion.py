# SPDX-License-Identifier: BSD-3-Clause
"""What to add so that every parameter can be estimated: positions, chosen one after the other among 26.

Each candidate is reached from the last position by the shortest turn and observed with the noise of the record. What it
would tell is added to what is known, and the one is taken that leaves the fewest directions open.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.calibration.adjustment import OPEN, Adjustment, plausible_of
from allanite.experiments.calibration.adjustment.design import Observed, State, linearise
from allanite.experiments.calibration.adjustment.turning import constant_rate_turns
from allanite.experiments.calibration.adjustment.weights import TURNS
from allanite.experiments.calibration.orientations import ORIENTATIONS, words_of
from allanite.experiments.calibration.verdict import ParameterNeed
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.attitude import rotation
from allanite.recording.calibration import ACCELEROMETER, GYRO

__all__ = ["Completion", "complete"]

Array = NDArray[np.float64]

#: Most positions that are asked for.
MOST = 8
#: A direction is determined when its standard deviation falls below this part of the plausible size.
ENOUGH = 0.2
#: Time of a planned turn [s] where the record has none.
TURN_TIME = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Completion:
    """Positions to add, and which of them each parameter waits for.

    Attributes
    ----------
    add : tuple of str
        In words, in their order.
    by_name : dict of str to tuple of str
    needs : dict of str to ParameterNeed
        Of parameters that no position helps.
    """

    add: tuple[str, ...] = ()
    by_name: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    needs: Mapping[str, ParameterNeed] = field(default_factory=dict)


def complete(fit: Adjustment) -> Completion:
    """Positions that cure what the fit leaves open."""
    names = fit.observed.names
    waiting = {n for n, o in zip(names, (fit.solution.open**2).sum(axis=1), strict=True) if o > OPEN}
    if ACCELEROMETER not in fit.rows:
        return Completion(needs=dict.fromkeys(waiting, ParameterNeed.FORCE))
    by_name: dict[str, tuple[str, ...]] = {}
    needs: dict[str, ParameterNeed] = {}
    if GYRO in fit.rows and not _linked(fit):
        needs = {name: ParameterNeed.TURNS for name in waiting if name.startswith(GYRO)}
        waiting -= set(needs)
    known = _Known.of(fit)
    there = {words_of(-attitude[2]) for attitude in fit.solution.state.attitudes}
    added: list[str] = []
    for _ in range(MOST if waiting else 0):
        words, better = _best(fit, known, there | set(added))
        if better.score <= known.score + 1e-6:
            break
        known = better
        added.append(words)
        cured = {n for n in waiting if not known.open[names.index(n)] > OPEN}
        by_name.update(dict.fromkeys(cured, tuple(added)))
        waiting -= cured
        if not waiting:
            break
    return Completion(add=tuple(added), by_name=by_name, needs=needs)


def _linked(fit: Adjustment) -> bool:
    """Whether turns lead from position to position: those that are missing would be recorded as these were."""
    return GYRO in fit.rows and (fit.observed.m > 0 or fit.observed.n == 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Known:
    """Information on the parameters in plausible sizes and on the attitude of the last position.

    Attributes
    ----------
    information : ndarray, shape (p + 3, p + 3)
    attitude : ndarray, shape (3, 3)
    """

    information: Array
    attitude: Array

    @classmethod
    def of(cls, fit: Adjustment) -> _Known:
        """After the record: gravity has levelled the last position, whose heading is its origin."""
        plausible = plausible_of(fit.observed.names)
        solution, p = fit.solution, len(plausible)
        inside = np.eye(p) - solution.open @ solution.open.T
        scaled = solution.covariance / np.outer(plausible, plausible)
        information = inside @ np.linalg.pinv(inside @ scaled @ inside, rcond=1e-14, hermitian=True) @ inside
        level = np.diag([1e8, 1e8, 1.0])
        out = np.zeros((p + 3, p + 3))
        out[:p, :p], out[p:, p:] = information, level
        return cls(information=out, attitude=solution.state.attitudes[-1])

    @property
    def _values(self) -> tuple[Array, Array]:
        p = len(self.information) - 3
        parameter_block, mixed, last = (
            self.information[:p, :p],
            self.information[:p, p:],
            self.information[p:, p:],
        )
        values, vectors = np.linalg.eigh(parameter_block - mixed @ np.linalg.solve(last, mixed.T))
        return np.maximum(values, 0.0), vectors

    @property
    def score(self) -> float:
        """Directions that are determined, and in what part the others are."""
        return float(np.minimum(self._values[0] * ENOUGH**2, 1.0).sum())

    @property
    def open(self) -> Array:
        """Part of each parameter in directions that are not determined, shape (p,)."""
        values, vectors = self._values
        return np.asarray((vectors[:, values * ENOUGH**2 < 1.0] ** 2).sum(axis=1))


def _best(fit: Adjustment, known: _Known, there: Collection[str]) -> tuple[str, _Known]:
    """The position that tells most, a new one where any tells something: one that is there tells of the turn alone."""
    last_up = -known.attitude[2]
    candidates = []
    for words, direction in ORIENTATIONS.items():
        up = np.array(direction, dtype=np.float64) / math.hypot(*direction)
        if up @ last_up < 1 - 1e-3:
            candidates.append((words, _with(fit, known, up)))
    new = [pair for pair in candidates if pair[0] not in there and pair[1].score > known.score + 1e-6]
    # ties go to the first: faces before edges, edges before corners
    return max(new or candidates, key=lambda pair: round(pair[1].score, 3))


def _with(fit: Adjustment, known: _Known, up: Array) -> _Known:
    """What would be known after one more position with this direction up."""
    turn = _shortest(up, -known.attitude[2])
    observed, state = _two(fit, known.attitude, known.attitude @ rotation(turn), turn)
    design = linearise(observed, state)
    sd = _noise(fit, observed)
    plausible = plausible_of(observed.names)
    table = np.column_stack([design.by_value * plausible, design.by_attitude]) / sd[:, None]
    rows = np.concatenate([np.arange(3 * k + 3, 3 * k + 6) for k in range(0, 2 * len(observed.triads), 2)])
    rows = np.concatenate([rows, np.arange(6 * len(observed.triads), len(sd))])
    p = len(plausible)
    total = np.zeros((p + 6, p + 6))
    total[: p + 3, : p + 3] = known.information
    total += table[rows].T @ table[rows] + np.diag(np.append(np.zeros(p + 3), np.full(3, 0.1)))
    order = np.concatenate([np.arange(p), np.arange(p + 3, p + 6)])
    gone = np.arange(p, p + 3)
    mixed = total[np.ix_(order, gone)]
    left = total[np.ix_(order, order)] - mixed @ np.linalg.solve(total[np.ix_(gone, gone)], mixed.T)
    return _Known(information=(left + left.T) / 2, attitude=state.attitudes[1])


def _shortest(a: Array, b: Array) -> Array:
    """Rotation vector that takes one direction to another the shortest way; over x or y where they are opposite."""
    axis = np.cross(a, b)
    length = float(np.linalg.norm(axis))
    if length < 1e-6:
        axis = np.cross(a, [1.0, 0.0, 0.0] if abs(a[0]) < 0.9 else [0.0, 1.0, 0.0])
        return np.asarray(axis / np.linalg.norm(axis) * math.pi)
    return np.asarray(axis / length * math.atan2(length, float(a @ b)))


def _two(fit: Adjustment, before: Array, after: Array, turn: Array) -> tuple[Observed, State]:
    """The last position and the next, as the gyros would see the way."""
    observed, state = fit.observed, fit.solution.state
    linked = _linked(fit)
    seconds = np.array([float(np.median(observed.seconds)) if observed.m else TURN_TIME])
    turning = constant_rate_turns(np.zeros((0, 3)), np.zeros(0))
    if linked:
        errors = observed.gyro.errors(state.values[observed.place(GYRO)])
        turning = constant_rate_turns(turn[None], seconds)
        turning = replace(turning, force=np.zeros_like(turning.y))  # of a turn that is only planned
        turning = replace(turning, y=errors.seen(turning.y, force=turning.force))
    none = np.zeros(0, dtype=np.int64)
    two = replace(
        observed,
        means={t.sensor: np.zeros((2, 3)) for t in observed.triads},
        warmer=np.full(2, float(np.mean(observed.warmer))),
        before=np.array([0]) if linked else none,
        after=np.array([1]) if linked else none,
        seconds=seconds if linked else np.zeros(0),
        turning=turning,
    )
    return two, replace(state, attitudes=np.stack([before, after]))


def _noise(fit: Adjustment, observed: Observed) -> Array:
    """Standard deviation of each row, as typical of the record."""
    sizes = np.sqrt(np.diag(fit.solution.noise))
    parts = [np.full(6, float(np.median(sizes[fit.rows[t.sensor]]))) for t in observed.triads]
    if observed.m:
        turns = float(np.median(sizes[fit.rows[TURNS]])) if TURNS in fit.rows else 1e-3
        parts.append(np.full(3, turns))
    return np.concatenate(parts)
