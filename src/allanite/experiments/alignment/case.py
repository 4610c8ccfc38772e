# SPDX-License-Identifier: BSD-3-Clause
"""A record as stands: stretches at rest joined to attitudes, means of both triads, and the turns between them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.alignment.frame import UnitFrame
from allanite.experiments.alignment.geometry import Geometry, ParameterLayout
from allanite.experiments.alignment.known import Sensors
from allanite.experiments.alignment.stands import (
    Blocks,
    StandMeans,
    blocks_of,
    slope_of_temperature,
    stand_means,
)
from allanite.experiments.alignment.turns import StandTurn, calibrated, turn_noise, turns_between
from allanite.experiments.north.circle import half_width
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.span_means import span_covariance
from allanite.quantities.attitude import axes_matrix
from allanite.quantities.earth import EARTH_RATE, normal_gravity
from allanite.quantities.residual_tests import ALARM
from allanite.recording.calibration import ACCELEROMETER, AXES, GYRO
from allanite.recording.records import Recording

__all__ = ["TURNED", "Case"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Rotation from which an attitude is a new one [rad]: the mean over attitudes that differ by less is wrong by its
#: square.
TURNED = math.radians(1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """What a fit needs of a record.

    Attributes
    ----------
    rate : float [Hz]
    frame : UnitFrame
    geometry : Geometry
    gyro, accelerometer : StandMeans
    turn_noise : ndarray, shape (n_turns,) [rad^2]
    spans : ndarray of int64, shape (n_spans, 2) [samples]
    stand_of_span : ndarray of int64, shape (n_spans,)
    lost : int
        Stretches that were left out because no turn connects them.
    """

    rate: float
    frame: UnitFrame = field(repr=False)
    geometry: Geometry = field(repr=False)
    gyro: StandMeans = field(repr=False)
    accelerometer: StandMeans = field(repr=False)
    turn_noise: Array
    spans: Index = field(repr=False)
    stand_of_span: Index = field(repr=False)
    lost: int = 0

    @classmethod
    def of(
        cls,
        recording: Recording,
        spans: Index,
        frame: UnitFrame,
        sensors: Sensors,
        checkpoints: Array | None,
        headings: tuple[Array, float] | None = None,
    ) -> Case:
        """Read the record.

        Parameters
        ----------
        headings : (ndarray, shape (n_spans,), float), optional [rad]
            Of the spans from a common mark, and their standard uncertainty: for turns that the gyros did not see. NaN
            where nobody knows.
        """
        cal = sensors.calibration
        warmer = {
            sensor: slope_of_temperature(recording, cal.errors(sensor).temperature, cal.temperature)
            for sensor in (GYRO, ACCELEROMETER)
        }
        gyro = blocks_of(recording, frame.gyro, spans, frame.models[0], warmer[GYRO])
        acc = blocks_of(recording, frame.accelerometer, spans, frame.models[1], warmer[ACCELEROMETER])
        measured_spans = np.flatnonzero(
            (_time_of_spans(gyro, len(spans)) > 0) & (_time_of_spans(acc, len(spans)) > 0)
        )
        turns, spans_used, lost = _connected(
            recording, spans, measured_spans, frame, sensors, (gyro, acc), warmer, headings
        )
        number = np.full(len(spans), -1, dtype=np.int64)
        number[spans_used] = np.arange(len(spans_used))
        gyro, acc = (_kept(b, number) for b in (gyro, acc))
        connected_spans = spans[spans_used]
        stand, leaving, entering = _stands(connected_spans, turns, frame, sensors, gyro, acc)
        between = np.flatnonzero(np.diff(stand))
        turns = tuple(turns[j] for j in between)
        means = [
            stand_means(b, stand, names, models, times)
            for b, names, models, times in (
                (gyro, frame.gyro, frame.models[0], checkpoints),
                (acc, frame.accelerometer, frame.models[1], None),
            )
        ]
        geometry = _geometry(frame, sensors, turns, means[1].level, _bias(gyro, sensors), leaving, entering)
        return cls(
            rate=recording.rate,
            frame=frame,
            geometry=geometry,
            gyro=means[0],
            accelerometer=means[1],
            turn_noise=_noise(recording, geometry, connected_spans, between, means[0].models, frame),
            spans=connected_spans,
            stand_of_span=stand,
            lost=lost,
        )

    def extents(self) -> list[tuple[float, float, float]]:
        """Beginning and end of each stand, and time at rest in it [s]."""
        out = []
        for k in range(self.geometry.n_stands):
            stand_spans = self.spans[self.stand_of_span == k] / self.rate
            out.append(
                (
                    float(stand_spans[0, 0]),
                    float(stand_spans[-1, 1]),
                    float(np.diff(stand_spans, axis=1).sum()),
                )
            )
        return out


def _kept(blocks: Blocks, number: Index) -> Blocks:
    """Blocks of the stretches that are used, under their new numbers; of the others nothing is left to the noise."""
    span = np.where(blocks.span >= 0, number[blocks.span], -1)
    gone = (span < 0)[:, None]
    return replace(
        blocks, span=span, mean=np.where(gone, np.nan, blocks.mean), part=np.where(gone, 0.0, blocks.part)
    )


def _time_of_spans(blocks: Blocks, n: int) -> Array:
    used = blocks.span >= 0
    return np.asarray(np.bincount(blocks.span[used], blocks.part[used].min(axis=1), n) * blocks.dt)


def _span_means(blocks: Blocks, n: int) -> Array:
    """Plain means, shape (n, 3)."""
    used = blocks.span >= 0
    weight = blocks.part[used].min(axis=1)
    whole = np.maximum(np.bincount(blocks.span[used], weight, n), 1e-9)
    sums = [np.bincount(blocks.span[used], weight * blocks.mean[used, i], n) for i in range(3)]
    return np.stack(sums, axis=1) / whole[:, None]


def _bias(gyro: Blocks, sensors: Sensors) -> dict[str, float]:
    """Biases that are good enough to integrate a turn with: the mean at rest is off by the Earth's rotation."""
    used = gyro.span >= 0
    mean = gyro.mean[used].mean(axis=0)
    names = [f"gyro.bias_{axis}" for axis in AXES]
    if _vague(sensors):
        return dict(zip(names, mean.tolist(), strict=True))
    return {name: sensors.calibration[name][0] for name in names}


def _vague(sensors: Sensors) -> bool:
    """Are the biases known worse than the Earth turns?"""
    sds = [sensors.calibration[f"gyro.bias_{axis}"][1] for axis in AXES]
    return not sensors.bias_known or max(sds) > EARTH_RATE * sensors.unit(GYRO)


def _geometry(
    frame: UnitFrame,
    sensors: Sensors,
    turns: tuple[StandTurn, ...],
    reading: Array,
    bias: dict[str, float],
    leaving: Array,
    entering: Array,
) -> Geometry:
    return Geometry(
        layout=ParameterLayout.of(len(reading), len(turns), sensors.unit(GYRO), sensors.unit(ACCELEROMETER)),
        mounting=axes_matrix(frame.axes),
        reading=reading,
        values=sensors.values | bias,
        turns=turns,
        leaving=leaving,
        entering=entering,
    )


def _connected(
    recording: Recording,
    spans: Index,
    measured_spans: Index,
    frame: UnitFrame,
    sensors: Sensors,
    blocks: tuple[Blocks, Blocks],
    warmer: Mapping[str, tuple[str, float, Array] | None],
    headings: tuple[Array, float] | None,
) -> tuple[tuple[StandTurn, ...], Index, int]:
    """The turns, and the stretches up to the last that turns connect; how many were lost before them."""
    errors = replace(
        sensors.calibration.errors(GYRO), bias=np.array(list(_bias(blocks[0], sensors).values()))
    )
    force = partial(
        calibrated,
        recording,
        frame.accelerometer,
        sensors.calibration.errors(ACCELEROMETER),
        warmer=warmer[ACCELEROMETER],
    )
    turns = turns_between(recording, frame.gyro, errors, spans[measured_spans], warmer[GYRO], force)
    if headings is not None:
        turns = _stated(turns, headings[0][measured_spans], headings[1])
    holes = np.array([j for j, t in enumerate(turns) if t.still], dtype=np.int64)
    turned = holes[_differ(blocks, spans, measured_spans, holes, frame, sensors, recording)]
    broken = [j for j, t in enumerate(turns) if not (t.known or t.still) or j in turned]
    first = broken[-1] + 1 if broken else 0
    return turns[first:], measured_spans[first:], first


def _stated(turns: tuple[StandTurn, ...], headings: Array, sd: float) -> tuple[StandTurn, ...]:
    """With the headings for the turns that the gyros did not see; nothing connects spans without one."""

    def turned(turn: StandTurn, change: float) -> StandTurn:
        if turn.known or (change == 0.0 and turn.still):
            return turn
        if math.isnan(change):
            return replace(turn, still=False)
        return replace(
            turn, known=True, still=False, stated=math.remainder(change, 2 * math.pi), stated_sd=sd
        )

    return tuple(turned(t, c) for t, c in zip(turns, np.diff(headings).tolist(), strict=True))


def _differ(
    blocks: tuple[Blocks, Blocks],
    spans: Index,
    measured_spans: Index,
    holes: Index,
    frame: UnitFrame,
    sensors: Sensors,
    recording: Recording,
) -> NDArray[np.bool_]:
    """Where samples are missing between two stretches: do their means show that the unit was turned meanwhile?

    By more than the noise, and by more than a new attitude would: a drift of the sensors is no turn.
    """
    out = np.zeros(len(holes), dtype=np.bool_)
    if not len(holes):
        return out
    limit = half_width(1 - ALARM / (6 * len(holes)))
    horizontal = EARTH_RATE * math.cos(frame.latitude)
    before, after = measured_spans[holes], measured_spans[holes + 1]
    for triad_blocks, sensor, size, models in zip(
        blocks, (GYRO, ACCELEROMETER), (horizontal, normal_gravity(frame.latitude)), frame.models, strict=True
    ):
        change = np.abs(np.diff(_span_means(triad_blocks, len(spans))[np.stack([before, after])], axis=0)[0])
        sds = [
            [
                _sd_of_change(triad_blocks, i, spans[[a, b]], (a, b), model, recording)
                for i, model in enumerate(models)
            ]
            for a, b in zip(before.tolist(), after.tolist(), strict=True)
        ]
        least = TURNED * size * sensors.unit(sensor)
        out |= (change > np.maximum(limit * np.array(sds), least)).any(axis=1)
    return out


def _sd_of_change(
    blocks: Blocks,
    axis: int,
    pair: Index,
    numbers: tuple[int, int],
    model: NoiseModel | None,
    recording: Recording,
) -> float:
    """Standard deviation of the difference of two means: by the model, else by how the blocks scatter."""
    if model is not None:
        edges = pair.astype(np.float64)
        covariance = span_covariance(
            model,
            edges[:, 0],
            edges[:, 1],
            np.diff(edges)[:, 0],
            dt=1 / recording.rate,
            sampling=blocks.sampling,
        )
        return math.sqrt(float(covariance[0, 0] + covariance[1, 1] - 2 * covariance[0, 1]))
    means = [blocks.mean[blocks.span == k, axis] for k in numbers]
    steps = np.concatenate([np.diff(m) for m in means])
    if len(steps) < 2:
        return math.inf
    return math.sqrt(0.5 * float(np.mean(steps**2)) * sum(1 / len(m) for m in means))


def _stands(
    spans: Index, turns: tuple[StandTurn, ...], frame: UnitFrame, sensors: Sensors, gyro: Blocks, acc: Blocks
) -> tuple[Index, Array, Array]:
    """Number of the stand of each stretch; azimuth of the last and first stretch of each stand less its mean."""
    n = len(spans)
    each = _geometry(
        frame, sensors, turns, _span_means(acc, n), _bias(gyro, sensors), np.zeros(n), np.zeros(n)
    )
    p = each.begin.copy()
    if not _vague(sensors):  # a bias out of the mean at rest holds the Earth already
        p[2] = -EARTH_RATE * math.sin(frame.latitude)
    chain = each.chain(p)
    attitude, number, out = chain.attitude, 0, []
    first = attitude[0]
    for span_attitude in attitude:
        if not _angle(first.T @ span_attitude) <= TURNED:
            number, first = number + 1, span_attitude
        out.append(number)
    stand = np.array(out, dtype=np.int64)
    length, azimuth = np.diff(spans, axis=1)[:, 0].astype(np.float64), np.unwrap(chain.azimuth)
    mean = np.bincount(stand, length * azimuth) / np.bincount(stand, length)
    starts = np.flatnonzero(np.diff(stand, prepend=-1))
    stops = np.append(starts[1:], n) - 1
    return stand, azimuth[stops] - mean, azimuth[starts] - mean


def _angle(matrix: Array) -> float:
    return math.acos(min(max((float(np.trace(matrix)) - 1) / 2, -1.0), 1.0))


def _noise(
    recording: Recording,
    geometry: Geometry,
    spans: Index,
    between: Index,
    models: tuple[NoiseModel, ...],
    frame: UnitFrame,
) -> Array:
    """Variance of each turn by the noise of the gyros [rad^2]."""
    up = -geometry.chain(geometry.begin).level[:, 2]  # in the axes of the sensor
    unit = np.abs(np.diag(geometry.errors(geometry.begin, GYRO).matrix))
    sampling = recording[frame.gyro[0]].sampling
    size = float(unit.mean()) ** 2
    return np.array(
        [
            turn_noise(t, up[k], spans[j], spans[j + 1], models, 1 / recording.rate, sampling) / size
            if math.isnan(t.stated)
            else 2 * t.stated_sd**2
            for k, (t, j) in enumerate(zip(geometry.turns, between.tolist(), strict=True))
        ]
    )
