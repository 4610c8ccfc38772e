# SPDX-License-Identifier: BSD-3-Clause
"""The standard deviations of an alignment, from covariance alone: no sample is needed."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.experiments.alignment.directions import answers_of
from allanite.experiments.alignment.frame import AlignmentSetting, UnitFrame
from allanite.experiments.alignment.geometry import Geometry, ParameterLayout
from allanite.experiments.alignment.known import Sensors, knowledge_of
from allanite.experiments.alignment.results import AlignmentPrediction
from allanite.experiments.alignment.rotation import Rotating
from allanite.experiments.alignment.solution import solve
from allanite.experiments.alignment.spin import PER_REVOLUTION, Spin, basis_of
from allanite.experiments.alignment.stands import Blocks, stand_means
from allanite.experiments.alignment.turns import StandTurn, turn_noise, turn_of
from allanite.filtering.block_means import longest_block
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, White
from allanite.noise.given_models import models_of
from allanite.quantities.attitude import attitude_of, axes_matrix, rotation, rotation_vector
from allanite.quantities.earth import EARTH_RATE, checked_latitude, earth_rate_vector, normal_gravity
from allanite.quantities.residual_tests import SEEN
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.recording.calibration import ACCELEROMETER, AXES, GYRO, Calibration
from allanite.recording.records import Kind

__all__ = ["AlignmentPlan", "predict_alignment"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignmentPlan:
    """How the unit will stand, and for how long.

    Attributes
    ----------
    attitudes : tuple of (float, float, float) [rad]
        Roll, pitch, heading of each position; of a rotation, that of the start.
    dwell : float [s]
        Time in each position; for a rotation, the whole time.
    turn : float [s]
        Time from one position to the next.
    rate : float [rad/s]
        Rate of a continuous rotation about the vertical, positive from north to east; 0 for positions.
    """

    attitudes: tuple[tuple[float, float, float], ...]
    dwell: float
    turn: float = 5.0
    rate: float = 0.0

    @classmethod
    def static(cls, duration: float, *, heading: float = 0.0) -> AlignmentPlan:
        """One position."""
        return cls(attitudes=((0.0, 0.0, heading),), dwell=duration)

    @classmethod
    def positions(cls, headings: ArrayLike, *, dwell: float, turn: float = 5.0) -> AlignmentPlan:
        """Level, at these headings [rad]."""
        return cls(attitudes=tuple((0.0, 0.0, float(h)) for h in np.ravel(headings)), dwell=dwell, turn=turn)

    @classmethod
    def two(cls, duration: float, *, turn: float = 5.0, heading: float = 0.0) -> AlignmentPlan:
        """Two positions, half a turn apart; `duration` is that of all, turn included."""
        return cls.positions([heading, heading + math.pi], dwell=(duration - turn) / 2, turn=turn)

    @classmethod
    def rotation(cls, rate: float, duration: float, *, heading: float = 0.0) -> AlignmentPlan:
        """Turning all the time."""
        return cls(attitudes=((0.0, 0.0, heading),), dwell=duration, rate=rate)

    @property
    def duration(self) -> float:
        """All of it [s]."""
        return len(self.attitudes) * self.dwell + (len(self.attitudes) - 1) * self.turn


def predict_alignment(
    *,
    model: NoiseModel | Mapping[str, NoiseModel],
    plan: AlignmentPlan,
    latitude: float,
    rate: float = 100.0,
    calibration: Calibration | None = None,
    bias_repeatability: tuple[float | None, float | None] | None = None,
    stated: SetupUncertainty | None = None,
    axes: str = "FLU",
) -> AlignmentPrediction:
    """Standard deviations of heading, roll and pitch that `align` will state for a plan.

    Parameters
    ----------
    model : NoiseModel or mapping
        Noise models of the gyros; "gyro" and "accelerometer", or by channel of the calibration. Without one of the
        accelerometers their noise is left out.
    plan : AlignmentPlan
        Plan of the attitudes.
    latitude : float [rad]
        Latitude of the place.
    rate : float [Hz]
        Sample rate.
    calibration, bias_repeatability, stated, axes
        As for `align`.

    Returns
    -------
    AlignmentPrediction

    Raises
    ------
    InputError
        A latitude at a pole, no model of the gyros, a plan without time.
    """
    checked_latitude(latitude)
    if not (plan.dwell > 0 and plan.turn >= 0 and plan.attitudes):
        raise InputError("a plan needs at least one attitude, and time to stand there")
    stated = stated or SetupUncertainty()
    frame = UnitFrame(
        gyro=tuple(f"gyro_{a}" for a in "xyz"),
        accelerometer=tuple(f"acc_{a}" for a in "xyz"),
        axes=axes.upper(),
        latitude=latitude,
        models=tuple(_models(model, calibration, sensor) for sensor in (GYRO, ACCELEROMETER)),  # type: ignore[arg-type]
    )
    setting = AlignmentSetting(
        frame=frame,
        sensors=Sensors.of(calibration, bias_repeatability, stated),
        stated=stated,
        height=0.0,
        confidence=0.95,
    )
    return _rotating(plan, setting) if plan.rate else _standing(plan, setting, rate)


#: Noise of accelerometers that are left out: far below all others [SI].
_NONE = NoiseModel.of(White(N=1e-12), kind="acceleration")
#: Samples of a turn: its axis does not move.
_STEPS = 64


def _models(
    model: NoiseModel | Mapping[str, NoiseModel], calibration: Calibration | None, sensor: str
) -> list[NoiseModel]:
    """Of the three axes of a triad."""
    named = tuple((calibration.channels if calibration else {}).get(sensor, ()))
    names = named or tuple(f"{sensor}_{axis}" for axis in AXES)
    kind = Kind.RATE if sensor == GYRO else Kind.ACCELERATION
    models_by_channel = models_of(
        model, dict.fromkeys(names, kind), roles={sensor: names}, needed=sensor == GYRO
    )
    return [models_by_channel.get(name, _NONE) for name in names]


def _standing(plan: AlignmentPlan, setting: AlignmentSetting, rate: float) -> AlignmentPrediction:
    """One position or several."""
    frame, sensors, n = setting.frame, setting.sensors, len(plan.attitudes)
    mounting = axes_matrix(frame.axes)
    body = np.stack([attitude_of(*a) @ mounting for a in plan.attitudes])  # sensor to north, east, down
    start = np.arange(n) * (plan.dwell + plan.turn)
    spans = np.stack([start, start + plan.dwell], axis=1)
    means = [_covariance(spans, models) for models in frame.models]  # type: ignore[arg-type]
    up = -body[:, 2] * normal_gravity(frame.latitude)
    turns = tuple(_turn(a, b, plan.turn, frame.latitude) for a, b in zip(body[:-1], body[1:], strict=True))
    geometry = Geometry(
        layout=ParameterLayout.of(n, len(turns), sensors.unit(GYRO), sensors.unit(ACCELEROMETER)),
        mounting=mounting,
        reading=sensors.calibration.errors(ACCELEROMETER).seen(up),
        values=sensors.values,
        turns=turns,
        leaving=np.zeros(n),
        entering=np.zeros(n),
    )
    samples = np.round(spans * rate).astype(np.int64)
    noise = (
        np.array(
            [
                turn_noise(t, -body[k, 2], samples[k], samples[k + 1], frame.models[0], 1 / rate, "mean")  # type: ignore[arg-type]
                for k, t in enumerate(turns)
            ]
        ).reshape(-1)
        / sensors.unit(GYRO) ** 2
    )
    known = knowledge_of(geometry.layout, sensors, frame.latitude, setting.stated, means[1], noise)
    p, h = known[0].copy(), EARTH_RATE * math.cos(frame.latitude)
    azimuth = _level_heading(geometry, body[0])
    p[:2] = h * math.cos(azimuth), -h * math.sin(azimuth)
    solution = solve(geometry, known[1], geometry.gyros(p), means[0], p)
    _, end = answers_of(solution, (0.0, plan.duration), setting.confidence, 1.0, setting.stated.heading)
    last, direction = end.attitude, end.direction
    at = geometry.layout.index("gyro.bias_")
    sds = np.sqrt(np.diag(solution.covariance(solution.gradient(lambda q: q[..., at])))) / sensors.unit(GYRO)
    return AlignmentPrediction(
        heading_sd=last.heading_sd,
        roll_sd=last.roll_sd,
        pitch_sd=last.pitch_sd,
        budget=end.budget,
        bias_sds=sds,
        signal_to_noise=direction.signal_to_noise,
        resolves=direction.signal_to_noise >= SEEN and not direction.arc.full,
        duration=plan.duration,
    )


def _covariance(spans: Array, models: list[NoiseModel]) -> Array:
    """Of the means of an axis in each span [s], shape (3, n, n)."""
    dwell = float(np.diff(spans[0])[0])
    dt = min(longest_block(m, dwell) for m in models)
    gap = float(spans[1, 0] - spans[0, 1]) if len(spans) > 1 else math.inf
    dt = min(dt, max(gap, dwell / 120))
    edges = np.arange(math.ceil(spans[-1, 1] / dt - 1e-9) + 1) * dt
    inside = np.maximum(
        np.minimum(edges[1:, None], spans[:, 1]) - np.maximum(edges[:-1, None], spans[:, 0]), 0.0
    )
    part, span = inside.max(axis=1) / dt, inside.argmax(axis=1)
    blocks = Blocks(
        dt=dt,
        mean=np.zeros((len(part), 3)),
        part=np.repeat(np.minimum(part, 1.0)[:, None], 3, axis=1),
        span=np.where(part > 1e-9, span, -1),
        time=0.5 * (edges[1:] + edges[:-1]),
        sampling="mean",
    )
    return stand_means(blocks, np.arange(len(spans)), ("x", "y", "z"), models).covariance


def _turn(before: Array, after: Array, duration: float, latitude: float) -> StandTurn:
    """The shortest way from one attitude to another, about one axis, while the Earth turns."""
    time = max(duration, 1e-9)
    vector = rotation_vector(before.T @ after)
    middle = before @ rotation(np.linspace(0, 1, 2 * _STEPS + 1)[1::2, None] * vector)
    earth = earth_rate_vector(latitude) * (duration / time)
    return turn_of(vector / time + middle.transpose(0, 2, 1) @ earth, time / _STEPS)


def _level_heading(geometry: Geometry, body: Array) -> float:
    """Heading of the x axis of the level frame of the first stand."""
    x = body @ geometry.chain(geometry.begin).level[0, 0]
    return math.atan2(x[1], x[0])


def _rotating(plan: AlignmentPlan, setting: AlignmentSetting) -> AlignmentPrediction:
    """A rotation about the vertical through the attitude of the start."""
    frame = setting.frame
    body = attitude_of(*plan.attitudes[0]) @ axes_matrix(frame.axes)
    axis = body[2] * math.copysign(1.0, plan.rate)
    basis, speed = basis_of(axis), abs(plan.rate)
    period = math.tau / speed
    length = min(period / PER_REVOLUTION, *(longest_block(m, period / 2) for m in frame.models[0] if m))
    n = max(round(plan.dwell / length), 1)
    dt = plan.dwell / n
    time = (np.arange(n, dtype=np.float64) + 0.5) * dt
    shrink = np.sinc(speed * dt / math.tau)
    cosine, sine = np.cos(speed * time) * shrink, np.sin(speed * time) * shrink
    ground = body @ basis  # p, q, a at the start, in north, east, down
    earth, up = earth_rate_vector(frame.latitude) @ ground, np.array([0.0, 0.0, -1.0]) @ ground
    force = up * normal_gravity(frame.latitude)
    along = math.copysign(EARTH_RATE * math.sin(frame.latitude), up[2] * math.sin(frame.latitude))

    def seen(vector: Array) -> Array:
        p = vector[0] * cosine + vector[1] * sine
        q = vector[1] * cosine - vector[0] * sine
        return np.stack([p, q, np.full(n, vector[2])], axis=1)

    spin = Spin(
        basis=basis, dt=dt, time=time, part=np.ones(n), cosine=cosine, sine=sine,
        rate=seen(earth) + np.array([0.0, 0.0, speed]), force=seen(force), angle=(0.0, speed * plan.dwell),
        along=along, span=(0.0, plan.dwell),
    )  # fmt: skip
    whole = Rotating.of(spin, setting)
    last, direction, budget = whole.attitude(1, setting, 1.0)
    return AlignmentPrediction(
        heading_sd=last.heading_sd,
        roll_sd=last.roll_sd,
        pitch_sd=last.pitch_sd,
        budget=budget,
        bias_sds=np.full(3, np.inf),
        signal_to_noise=direction.signal_to_noise,
        resolves=direction.signal_to_noise >= SEEN and not direction.arc.full,
        duration=plan.duration,
    )
