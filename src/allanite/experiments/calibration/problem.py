# SPDX-License-Identifier: BSD-3-Clause
"""From what was gathered to the unknowns: nominal scale factors, biases and attitudes to start from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.experiments.calibration.adjustment import nominal_of
from allanite.experiments.calibration.adjustment.design import Observed, State, layout
from allanite.experiments.calibration.adjustment.turning import TurningSamples, constant_rate_turns
from allanite.experiments.calibration.adjustment.weights import Weights, weights_of
from allanite.experiments.calibration.gathering import Gathered
from allanite.experiments.calibration.results import GyrosAstray
from allanite.experiments.calibration.starting import (
    attitudes_of,
    best_arrangement,
    disagreement,
    gyro_scale,
    sphere,
)
from allanite.lazy_dataclasses import dataclass
from allanite.recording.calibration import ACCELEROMETER, GYRO, Frame
from allanite.recording.records import Kind, Recording

__all__ = ["CalibrationProblem", "problem_of"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Accelerometers in SI whose mean length at rest differs by more than this factor are in another unit.
FOREIGN = 1.5
#: From this median angle on [rad] the gyros do not go with the accelerometers.
ASTRAY = 0.35


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationProblem:
    """Observations over their nominal scale factors, and where to start.

    `astray` is there where the gyros do not go with the accelerometers; `gains` are y per SI unit, one for each triad;
    `offsets` nominal biases in y, removed before.
    """

    observed: Observed
    weights: Weights
    start: State
    gains: dict[str, float]
    offsets: dict[str, Array]
    astray: GyrosAstray | None


def problem_of(
    data: Gathered,
    recording: Recording,
    gravity: float,
    frame: Frame,
    quadratic: bool,
    reference: float | None,
) -> CalibrationProblem:
    sensors = tuple(data.axes)
    triads = layout(sensors, frame=frame, quadratic=quadratic, temperature=reference is not None)
    gains: dict[str, float] = {}
    offsets: dict[str, Array] = {}
    down = None
    if ACCELEROMETER in data.axes:
        si = recording[data.axes[ACCELEROMETER][0]].kind is Kind.ACCELERATION
        offsets[ACCELEROMETER], gains[ACCELEROMETER] = _accelerometers(data, gravity, si)
        force = data.means[ACCELEROMETER] - offsets[ACCELEROMETER]
        down = -force / np.linalg.norm(force, axis=1, keepdims=True)
    astray = None
    motion = None
    if GYRO in data.axes:
        si = recording[data.axes[GYRO][0]].kind is Kind.RATE
        gains[GYRO], offsets[GYRO] = _gyros(data, down, si)
        motion = _scaled_motion(data.motion, gains, offsets, reference)
        level = (data.means[GYRO].mean(axis=0) - offsets[GYRO]) / gains[GYRO]
        astray = _astray(data, motion, level, down)
    warmer = np.zeros(len(data.edges))
    if reference is not None and data.temperature is not None:
        warmer = data.temperature - reference
    observed = Observed(
        triads=triads,
        means=_levelled({s: (data.means[s] - offsets[s]) / gains[s] for s in data.axes}, data, gains),
        warmer=warmer,
        before=data.before,
        after=data.after,
        seconds=data.seconds,
        turning=motion or constant_rate_turns(np.zeros((0, 3)), np.zeros(0)),
        gravity=gravity,
    )
    return CalibrationProblem(
        observed=observed,
        weights=weights_of(
            {s: [data.models[n] for n in three] for s, three in data.axes.items()},
            gains,
            {s: data.spans(s) for s in data.axes},
            data.whole,
            data.coarse,
            data.turns() if motion is not None else None,
            data.held,
            data.relative,
        ),
        start=_start(observed, down),
        gains=gains,
        offsets=offsets,
        astray=astray,
    )


def _levelled(means: dict[str, Array], data: Gathered, gains: dict[str, float]) -> dict[str, Array]:
    """Means of the accelerometers at the mean attitude of each span.

    A unit that wanders by the small rotation psi about it shows f + 1/2 mean([psi]^2) f in the mean, with
    [psi]^2 = psi psi' - |psi|^2: less than gravity.
    """
    if not (data.in_hand and len(means) == 2):
        return means
    products = data.wander / gains[GYRO] ** 2
    square = products - np.trace(products, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    force = means[ACCELEROMETER]
    return {**means, ACCELEROMETER: force - np.einsum("nij,nj->ni", square, force) / 2}


def _accelerometers(data: Gathered, gravity: float, si: bool) -> tuple[Array, float]:
    """Nominal bias and scale factor, in the unit of the channels."""
    means = data.means[ACCELEROMETER]
    if not si:
        return sphere(means, gravity)
    length = float(np.median(np.linalg.norm(means, axis=1)))
    if not 1 / FOREIGN < length / gravity < FOREIGN:
        raise DataQualityError(
            f"the accelerometers show {length:.4g} m/s² at rest, not gravity: are they in this unit, are these the "
            "right channels?"
        )
    return np.zeros(3), 1.0


def _gyros(data: Gathered, down: Array | None, si: bool) -> tuple[float, Array]:
    """Nominal scale factor and bias."""
    means = data.means[GYRO]
    if si:
        return 1.0, np.zeros(3)
    bias = means.mean(axis=0)
    scale = None
    if down is not None and data.motion is not None:
        scale = gyro_scale(data.motion, bias, down, data.before, data.after)
    if scale is None:
        raise DataQualityError(
            "the scale factor of gyros in counts needs accelerometers and turns about a horizontal axis between "
            "positions; or state their unit with a scale factor"
        )
    return scale, bias


def _scaled_motion(
    motion: TurningSamples | None, gains: dict[str, float], offsets: dict[str, Array], reference: float | None
) -> TurningSamples | None:
    if motion is None:
        return None
    warmer = np.zeros(len(motion.y)) if reference is None else motion.warmer - reference
    force = motion.force
    if force is not None:
        force = (force - offsets[ACCELEROMETER]) / gains[ACCELEROMETER]
    return replace(motion, y=(motion.y - offsets[GYRO]) / gains[GYRO], warmer=warmer, force=force)


def _astray(
    data: Gathered, motion: TurningSamples | None, bias: Array, down: Array | None
) -> GyrosAstray | None:
    """Gyros in another order, with other signs or in another unit than the accelerometers."""
    if motion is None or down is None:
        return None
    miss = disagreement(motion, bias, down, data.before, data.after)
    if miss < ASTRAY:
        return None
    best = best_arrangement(motion, bias, down, data.before, data.after)
    if best is None or best.miss >= ASTRAY / 3:
        return GyrosAstray(miss=miss)
    names, same = data.axes[GYRO], best.order == (0, 1, 2)
    return GyrosAstray(
        miss=miss,
        order=() if same else tuple(names[i] for i in best.order),
        turned=tuple(names[i] for i in sorted(best.turned)),
    )


def _start(observed: Observed, down: Array | None) -> State:
    values = nominal_of(observed.names)
    gyro = observed.triad(GYRO)
    turns = np.zeros((0, 3, 3))
    if gyro is not None:
        place = observed.place(GYRO)
        values[place.start : place.start + 3] = observed.means[GYRO].mean(axis=0)
        if observed.m:
            turns = observed.turning.integrate(gyro.errors(values[place])).rotation
    attitudes = attitudes_of(down, observed.n, observed.before, observed.after, turns)
    return State(values=values, attitudes=attitudes, earth=np.zeros(3))
