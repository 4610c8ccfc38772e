# SPDX-License-Identifier: BSD-3-Clause
"""The covariance of everything that was observed, under the noise model of each axis.

Slow noise is common to neighbouring spans and to the turn between them. So for each axis the means over all spans and
over all turns have one joint covariance; a turn takes from it what its lever makes of a constant error. White noise of
a turn is integrated exactly; turns share it where they share samples, and it is independent of all else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.calibration.adjustment.design import Observed, Predicted, State
from allanite.experiments.calibration.adjustment.interval_noise import (
    Intervals,
    about_mean,
    interval_covariance,
)
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, Quantisation, RandomWalk, White
from allanite.recording.calibration import ACCELEROMETER, GYRO

__all__ = ["DRIFT", "GROUPS", "Weights", "groups_of", "weights_of"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

TURNS = "turns"
#: Kinds of observations: the names of the triads, for their means at rest, and the turns.
GROUPS = (ACCELEROMETER, GYRO, TURNS)
#: What the observations of a triad may hold beyond the noise besides scatter: a random walk of its biases.
DRIFT = {ACCELEROMETER: "drift of the accelerometer", GYRO: "drift of the gyro"}

#: Least standard deviation of a turn [rad]: what the second order leaves of the integral of its samples.
ROUNDING = 5e-9


def groups_of(observed: Observed) -> dict[str, Index]:
    """Rows of each kind of observation."""
    out: dict[str, Index] = {}
    start = 0
    counts = {t.sensor: 3 * observed.n for t in observed.triads}
    if observed.m:
        counts[TURNS] = 3 * observed.m
    for name, count in counts.items():
        out[name] = np.arange(start, start + count)
        start += count
    return out


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """Noise of the observations, in the units of `Observed`.

    Attributes
    ----------
    at_rest : dict of str to ndarray, shape (3, n, n)
        Of the means of the spans, for each axis of a triad.
    slow : ndarray, shape (3, n + m, n + m)
        Of the slow noise of the gyros over spans and turns; in it that of the spans is that of `at_rest`.
    density : ndarray, shape (3,)
        N^2 of the gyros.
    angle : ndarray, shape (m, 3) [rad^2]
        Variance that noise of the angle and steps of the converter add to the integral of y over each turn.
    walk : dict of str to ndarray, shape (n, n) or (n + m, n + m)
        Covariance of the means over spans, and for gyros over turns too, of a random walk of unit size.
    beyond : dict of str to float
        Sizes of what is there beyond the noise: by kind of observation, a standard deviation of every row; by `DRIFT`,
        a random walk.
    relative : dict of str to ndarray, shape (n,)
        Variances of the scatter of the spans of a triad over that of the usual one; missing where all are alike.
    """

    at_rest: dict[str, Array]
    slow: Array
    density: Array
    angle: Array
    walk: dict[str, Array]
    beyond: Mapping[str, float]
    relative: Mapping[str, Array] = field(default_factory=dict)

    def with_beyond(self, beyond: Mapping[str, float]) -> Weights:
        """The same with something else beyond the noise."""
        return replace(self, beyond=dict(beyond))

    def covariance(self, observed: Observed, state: State, predicted: Predicted) -> Array:
        """Of all rows of `Predicted`."""
        groups = groups_of(observed)
        out = np.zeros((len(predicted.residual),) * 2)
        for sensor, blocks in self.at_rest.items():
            for axis in range(3):
                rows = groups[sensor][axis::3]
                out[np.ix_(rows, rows)] = blocks[axis]
        if TURNS in groups:
            self._add_turns(out, groups, observed, state, predicted)
        for name, size in self.beyond.items():
            out += size**2 * self.shape(name, observed, predicted)
        return out

    def shape(self, name: str, observed: Observed, predicted: Predicted) -> Array:
        """Covariance of all rows of something beyond the noise, of unit size."""
        groups = groups_of(observed)
        out = np.zeros((len(predicted.residual),) * 2)
        if name in groups:
            out[groups[name], groups[name]] = (
                np.repeat(self.relative[name], 3) if name in self.relative else 1.0
            )
            return out
        sensor = next(s for s, drift in DRIFT.items() if drift == name)
        joint, n = self.walk[sensor], observed.n
        for axis in range(3):
            rows = groups[sensor][axis::3]
            out[np.ix_(rows, rows)] = joint[:n, :n]
        if sensor == GYRO and TURNS in groups:
            _add_levered(out, groups, observed, predicted, np.stack([joint] * 3))
        return out

    def _add_turns(
        self, out: Array, groups: dict[str, Index], observed: Observed, state: State, predicted: Predicted
    ) -> None:
        _add_levered(out, groups, observed, predicted, self.slow)
        errors = observed.gyro.errors(state.values[observed.place(GYRO)])
        inverse = np.linalg.inv(errors.matrix)
        turns = groups[TURNS]
        out[np.ix_(turns, turns)] += observed.turning.white(errors, self.density)
        for link, block in enumerate((inverse * self.angle[:, None, :]) @ inverse.T):
            rows = turns[3 * link : 3 * link + 3]
            out[np.ix_(rows, rows)] += block
        out[turns, turns] += ROUNDING**2


def _add_levered(
    out: Array, groups: dict[str, Index], observed: Observed, predicted: Predicted, joint: Array
) -> None:
    """What turns owe to slow noise, and share with the spans; joint has shape (3, n + m, n + m)."""
    n, turns, gyros = observed.n, groups[TURNS], groups[GYRO]
    for axis in range(3):
        column = np.zeros((len(turns), observed.m))
        column[np.arange(len(turns)), np.arange(len(turns)) // 3] = predicted.lever[:, :, axis].ravel()
        out[np.ix_(turns, turns)] += column @ joint[axis, n:, n:] @ column.T
        mixed = column @ joint[axis, n:, :n]
        out[np.ix_(turns, gyros[axis::3])] += mixed
        out[np.ix_(gyros[axis::3], turns)] += mixed.T


def weights_of(
    models: Mapping[str, Sequence[NoiseModel]],
    gains: Mapping[str, float],
    spans: Mapping[str, Intervals],
    whole: Mapping[str, Array],
    coarse: Mapping[str, Array],
    turns: Intervals | None,
    held: Array,
    relative: Mapping[str, Array] | None = None,
) -> Weights:
    """Noise of the observations.

    Parameters
    ----------
    models : mapping of str to three NoiseModel
        Of the axes of each triad.
    gains : mapping of str to float
        Units of the models per unit of `Observed`.
    spans : mapping of str to Intervals
        The spans, for each triad.
    whole : mapping of str to ndarray, shape (n, 3)
        Samples that were measured in each span, for each axis.
    coarse : mapping of str to ndarray, shape (3, n, n)
        Covariance of the means besides, in the square of the unit of the models.
    turns : Intervals or None
    held : ndarray, shape (3, m)
        Variance of the integral of each gyro over each turn besides, in the same unit times seconds.
    relative : mapping of str to ndarray, shape (n,), optional
        See `Weights`.
    """
    at_rest, walk, slow = {}, {}, np.zeros((3, 0, 0))
    unit_walk = NoiseModel.of(RandomWalk(K=1.0))
    density, angle = np.zeros(3), np.zeros((0, 3))
    for sensor, three in models.items():
        axis_spans = [replace(spans[sensor], whole=whole[sensor][:, axis]) for axis in range(3)]
        unit = gains[sensor] ** 2
        both = list(zip(three, axis_spans, strict=True))
        at_rest[sensor] = (np.stack([interval_covariance(m, i) for m, i in both]) + coarse[sensor]) / unit
        walk[sensor] = about_mean(unit_walk, spans[sensor])
        if sensor == GYRO and turns is not None:
            walk[sensor] = about_mean(unit_walk, _both(spans[sensor], turns))
            slow = np.stack([_joint(m, i, turns) / unit for m, i in both])
            density = np.array([sum(t.N**2 for t in m.terms if isinstance(t, White)) for m in three]) / unit
            noisy = np.array([sum(2 * t.Q**2 for t in m.terms if isinstance(t, Quantisation)) for m in three])
            angle = (held.T + noisy) / unit
    return Weights(
        at_rest=at_rest,
        slow=slow,
        density=density,
        angle=angle,
        walk=walk,
        beyond={},
        relative=relative or {},
    )


def _joint(model: NoiseModel, spans: Intervals, turns: Intervals) -> Array:
    """Slow noise over spans and turns."""
    slow = replace(model, terms=tuple(t for t in model.terms if not isinstance(t, (White, Quantisation))))
    return interval_covariance(slow, _both(spans, turns))


def _both(spans: Intervals, turns: Intervals) -> Intervals:
    return replace(
        spans,
        start=np.concatenate([spans.start, turns.start]),
        stop=np.concatenate([spans.stop, turns.stop]),
        whole=np.concatenate([spans.whole, turns.whole]),
    )
