# SPDX-License-Identifier: BSD-3-Clause
"""A record of a unit that turned about one axis: the axis, the angle, and block means along three directions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.experiments.alignment.frame import AlignmentSetting
from allanite.experiments.alignment.stands import slope_of_temperature
from allanite.experiments.alignment.turns import HOLE, calibrated
from allanite.filtering.block_means import longest_block
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.earth import EARTH_RATE
from allanite.recording.calibration import ACCELEROMETER, GYRO
from allanite.recording.records import BLOCK, Recording

__all__ = ["PER_REVOLUTION", "Spin", "basis_of", "spin_of"]

Array = NDArray[np.float64]

#: Blocks in a revolution.
PER_REVOLUTION = 48
#: Revolutions that an alignment needs, and the part of the rotation rate that may lie across the axis.
LEAST, ONE_AXIS = 2.0, 0.05
#: Mean of a rotation rate over its root mean square: below, it turned now and then, or forth and back.
STEADY = 0.5
#: Seconds whose mean tells which end of the axis is up.
FIRST = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Spin:
    """The record in blocks, in the directions p, q and a of the unit.

    Attributes
    ----------
    basis : ndarray, shape (3, 3)
        Columns p, q, a in the axes of the sensor; a along the rotation, which is positive about it.
    dt : float [s]
    time, part : ndarray, shape (n,)
    cosine, sine : ndarray, shape (n,)
        Means over the blocks.
    rate, force : ndarray, shape (n, 3)
        Along p, q, a; NaN where missing.
    angle : (float, float) [rad]
        theta at the beginning and at the end, without what the Earth was taken to turn along the axis.
    along : float [rad/s]
        What it was taken to turn.
    span : (float, float) [s]
        That was used.
    """

    basis: Array
    dt: float
    time: Array = field(repr=False)
    part: Array = field(repr=False)
    cosine: Array = field(repr=False)
    sine: Array = field(repr=False)
    rate: Array = field(repr=False)
    force: Array = field(repr=False)
    angle: tuple[float, float]
    along: float
    span: tuple[float, float]

    @property
    def middle(self) -> float:
        """Time at which theta is without the error of its growth [s]."""
        return 0.5 * (self.span[0] + self.span[1])

    @property
    def revolutions(self) -> float:
        """Turns, whichever way."""
        return abs(self.angle[1] - self.angle[0]) / math.tau


def spin_of(recording: Recording, setting: AlignmentSetting) -> Spin:
    """Axis, angle and block means of a record.

    Raises
    ------
    DataQualityError
        No rotation, or one about more than one axis.
    """
    frame, calibration = setting.frame, setting.sensors.calibration
    errors = {s: calibration.errors(s) for s in (GYRO, ACCELEROMETER)}
    names = {GYRO: frame.gyro, ACCELEROMETER: frame.accelerometer}
    warmer = {
        s: slope_of_temperature(recording, e.temperature, calibration.temperature) for s, e in errors.items()
    }
    dt = 1 / recording.rate

    def read(sensor: str, start: int, stop: int) -> Array:
        force = partial(read, ACCELEROMETER) if sensor == GYRO else None
        return calibrated(recording, names[sensor], errors[sensor], start, stop, warmer[sensor], force)

    start, stop = _longest(recording, lambda a, b: np.asarray(np.isnan(read(GYRO, a, b)).any(axis=1)))
    axis, mean_rate = _axis(lambda a, b: read(GYRO, a, b), start, stop)
    period = math.tau / mean_rate
    if (stop - start) * dt < LEAST * period:
        raise DataQualityError(
            f"the unit was not at rest, and turned {(stop - start) * dt / period:.1f} times without missing samples: "
            f"a rotation needs at least {LEAST:g} revolutions"
        )
    basis = basis_of(axis)
    up = (
        np.nanmean(read(ACCELEROMETER, start, min(stop, start + int(FIRST * recording.rate) + 1)), axis=0)
        @ axis
    )
    along = math.copysign(EARTH_RATE * math.sin(frame.latitude), up * math.sin(frame.latitude))
    given = [m for m in frame.models[0] if m is not None]
    length = min([period / PER_REVOLUTION, *(longest_block(m, period / 2) for m in given)])
    size = max(int(length * recording.rate), 1)
    parts, angle = [], 0.0
    chunk = size * max(BLOCK // size, 1)
    for a in range(start, stop, chunk):
        b = min(a + chunk, stop)
        rate, force = read(GYRO, a, b) @ basis, read(ACCELEROMETER, a, b) @ basis
        part, angle = _blocks(rate, force, angle, size, dt, along)
        parts.append(part)
    joined = [np.concatenate(column) for column in zip(*parts, strict=True)]
    n = len(joined[0])
    return Spin(
        basis=basis,
        dt=size * dt,
        time=start * dt + (np.arange(n, dtype=np.float64) + 0.5) * size * dt,
        part=joined[0],
        cosine=joined[1],
        sine=joined[2],
        rate=joined[3],
        force=joined[4],
        angle=(0.0, angle),
        along=along,
        span=(start * dt, stop * dt),
    )


def _blocks(
    rate: Array, force: Array, angle: float, size: int, dt: float, along: float
) -> tuple[tuple[Array, ...], float]:
    """Means over blocks; theta goes on over missing samples by a straight line."""
    turning = rate[:, 2] - along
    missing = np.asarray(np.isnan(rate).any(axis=1))
    if missing.any():
        at = np.arange(len(turning))
        turning[missing] = np.interp(at[missing], at[~missing], turning[~missing])
    edges = angle + np.concatenate(([0.0], np.cumsum(turning * dt)))
    middle = 0.5 * (edges[1:] + edges[:-1])
    mean = np.sinc(turning * dt / math.tau)  # of cosine and sine over a sample
    n = -(-len(rate) // size)
    pad = n * size - len(rate)
    missing = np.asarray(missing | np.isnan(force).any(axis=1))
    count = np.pad((~missing).astype(np.float64), (0, pad)).reshape(n, size).sum(axis=1)

    def means(values: Array) -> Array:
        kept = np.where(missing if values.ndim == 1 else missing[:, None], 0.0, values)
        shape = (0, pad) if values.ndim == 1 else ((0, pad), (0, 0))
        sums = np.pad(kept, shape).reshape(n, size, *values.shape[1:]).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(sums / (count if values.ndim == 1 else count[:, None]))

    cosine, sine = means(np.cos(middle) * mean), means(np.sin(middle) * mean)
    return (count / size, cosine, sine, means(rate), means(force)), float(edges[-1])


def _longest(recording: Recording, missing: Callable[[int, int], NDArray[np.bool_]]) -> tuple[int, int]:
    """The longest stretch without a hole that is too long to bridge [samples]."""
    n, most = recording.n_samples, HOLE * recording.rate
    gone = np.concatenate([missing(a, min(a + BLOCK, n)) for a in range(0, n, BLOCK)])
    edges = np.flatnonzero(np.diff(np.concatenate(([0], gone.astype(np.int8), [0])))).reshape(-1, 2)
    holes = [(0, 0), *((a, b) for a, b in edges.tolist() if b - a > most or a == 0 or b == n), (n, n)]
    free = [(before[1], after[0]) for before, after in zip(holes[:-1], holes[1:], strict=True)]
    return max(free, key=lambda pair: pair[1] - pair[0])


def _axis(read: Callable[[int, int], Array], start: int, stop: int) -> tuple[Array, float]:
    """Direction of the rotation in the axes of the sensor, and its mean rate.

    Raises
    ------
    DataQualityError
        More than one axis, or hardly any rotation.
    """
    moment, count, total = np.zeros((3, 3)), 0, np.zeros(3)
    for a in range(start, stop, BLOCK):
        rate = read(a, min(a + BLOCK, stop))
        rate = rate[~np.isnan(rate).any(axis=1)]
        moment, count, total = moment + rate.T @ rate, count + len(rate), total + rate.sum(axis=0)
    values, vectors = np.linalg.eigh(moment / max(count, 1))
    size, mean = math.sqrt(max(values[2], 0.0)), float(vectors[:, 2] @ total) / max(count, 1)
    steady = abs(mean) > STEADY * size and math.sqrt(max(values[1], 0.0)) < ONE_AXIS * size
    if not (size > 100 * EARTH_RATE and steady):
        raise DataQualityError(
            "neither at rest nor turning about one axis: an alignment needs stretches at rest, or a steady rotation"
        )
    return vectors[:, 2] * math.copysign(1.0, mean), abs(mean)


def basis_of(axis: Array) -> Array:
    """Columns p, q, a, right-handed; p close to an axis of the sensor."""
    first = np.eye(3)[int(np.argmin(np.abs(axis)))]
    p = first - axis * float(first @ axis)
    p = p / np.linalg.norm(p)
    return np.column_stack([p, np.cross(axis, p), axis])
