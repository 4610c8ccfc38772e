# SPDX-License-Identifier: BSD-3-Clause
"""From all parameters of an alignment to what each gyro shows in each stand: levelling, and the chain of azimuths.

The level frame of a stand has z down and x along the horizontal part of its heading axis: the forward axis or, where
that is nearly vertical, one that is not. A turn that took the sensor from the level frame L to the next one obeys

    R(azimuth) L_next = exp(-Earth T) L Q,

Q being the rotation in inertial space that the gyros saw. Its azimuth is the rotation about the vertical that comes
closest; what is left, a tilt, is a check of the gyros against gravity.

All functions of the parameters take many sets of them as well: leading axes of the parameters, "..." in the shapes, are
those of the results. Derivatives are taken in one pass so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.alignment.turns import StandTurn
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.attitude import rotation, skew
from allanite.quantities.earth import EARTH_RATE
from allanite.recording.calibration import ACCELEROMETER, AXES, GYRO, TriadErrors, parameter_names

__all__ = [
    "Geometry",
    "ParameterLayout",
    "StandAttitudes",
    "angles_of_down",
    "derivative",
    "levelled",
    "named_axis",
]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: A forward axis closer to the vertical than this leaves the heading to another axis [rad].
STEEP = math.radians(10.0)
#: Scale of the derivatives: all that is in them is smooth over a thousandth.
SMALL = 1e-3
#: Places of the misalignments in the order of their names: xy, xz, yx, yz, zx, zy.
_OFF_DIAGONAL = ([0, 0, 1, 1, 2, 2], [1, 2, 0, 2, 0, 1])
#: Nominal gravity: only a size for the steps of derivatives [m/s^2].
_G = 9.8


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterLayout:
    """Where each parameter stands in the vector of all.

    Attributes
    ----------
    names : tuple of str
        "north.1", "north.2": e, along x and y of the level frame of the first stand [rad/s]; "vertical" [rad/s], down;
        those of the calibration; "reading_x.0", ...: noise of the accelerometer means; "turn.0", ... [rad]; "tilt_x",
        ... [rad].
    steps : ndarray
        For derivatives.
    places : dict
        What `index` found before.
    """

    names: tuple[str, ...]
    steps: Array = field(repr=False)
    places: dict[tuple[str, ...], Index] = field(init=False, repr=False, default_factory=dict)

    @classmethod
    def of(cls, n_stands: int, n_turns: int, unit_gyro: float, unit_acc: float) -> ParameterLayout:
        """The parameters of so many stands; the units are samples per SI unit."""
        steps: dict[str, float] = {"north.1": EARTH_RATE, "north.2": EARTH_RATE, "vertical": EARTH_RATE}
        for sensor, unit, size in ((GYRO, unit_gyro, EARTH_RATE), (ACCELEROMETER, unit_acc, _G)):
            for name in parameter_names(sensor, quadratic=True, gravity_sensitivity=True):
                kind = name.split(".")[1].rsplit("_", 1)[0]
                small = {
                    "bias": unit * size, "scale": unit, "misalignment": 1.0, "quadratic": 0.1 / _G,
                    "gravity_sensitivity": unit * size / _G,
                }[kind]  # fmt: skip
                alike = kind in ("bias", "gravity_sensitivity")
                steps[name] = small * (1.0 if sensor == GYRO and alike else SMALL)
        steps |= {f"reading_{a}.{k}": SMALL * unit_acc * _G for a in AXES for k in range(n_stands)}
        steps |= {f"turn.{k}": SMALL for k in range(n_turns)}
        steps |= {f"tilt_{a}": SMALL for a in AXES}
        return cls(names=tuple(steps), steps=np.array(list(steps.values())))

    def index(self, *starts: str) -> Index:
        """Places of the parameters whose names begin so."""
        if starts not in self.places:  # asked again and again
            self.places[starts] = np.array(
                [i for i, n in enumerate(self.names) if n.startswith(starts)], dtype=np.int64
            )
        return self.places[starts]


@dataclass(frozen=True, slots=True, kw_only=True)
class StandAttitudes:
    """Attitudes of the stands under given parameters.

    Attributes
    ----------
    level : ndarray, shape (..., n_stands, 3, 3)
        Sensor to the level frame of the stand.
    azimuth : ndarray, shape (..., n_stands) [rad]
        Of its x axis in the level frame of the first stand.
    down : ndarray, shape (..., n_stands, 3)
        In forward, right, down.
    tilt : ndarray, shape (..., n_turns, 2) [rad]
        What the turns leave.
    force : ndarray, shape (..., n_stands, 3) [m/s^2]
        In the axes of the sensor.
    """

    level: Array
    azimuth: Array
    down: Array
    tilt: Array
    force: Array

    @property
    def attitude(self) -> Array:
        """Sensor to the level frame of the first stand, shape (..., n_stands, 3, 3)."""
        return np.asarray(_about_down(self.azimuth) @ self.level)


@dataclass(frozen=True, slots=True, kw_only=True)
class Geometry:
    """What stays the same while parameters vary.

    Attributes
    ----------
    layout : ParameterLayout
    mounting : ndarray, shape (3, 3)
        Sensor to forward, right, down.
    reading : ndarray, shape (n_stands, 3)
        Means of the accelerometers.
    values : mapping of str to float
        Parameters of the calibration with which the turns were integrated.
    turns : tuple of StandTurn
        From the last stretch at rest of each stand to the first of the next.
    leaving, entering : ndarray, shape (n_stands,) [rad]
        Azimuth of the last and of the first stretch of a stand less the mean of the stand: below a degree.
    begin : ndarray
        All parameters with the values of the calibration.
    heading_axes : tuple of str
        Whose heading is meant in each stand.
    stacked : tuple of ndarray
        The turns as arrays.
    """

    layout: ParameterLayout
    mounting: Array
    reading: Array
    values: Mapping[str, float] = field(repr=False)
    turns: tuple[StandTurn, ...] = field(repr=False)
    leaving: Array = field(repr=False)
    entering: Array = field(repr=False)
    begin: Array = field(init=False, repr=False)
    heading_axes: tuple[str, ...] = field(init=False)
    stacked: tuple[Array, Array, Array, Array, Array, Array, NDArray[np.bool_]] = field(
        init=False, repr=False
    )

    def __post_init__(self) -> None:
        begin = np.array([self.values.get(n, 0.0) for n in self.layout.names])
        object.__setattr__(self, "begin", begin)
        object.__setattr__(
            self, "heading_axes", tuple(named_axis(d) for d in self._downs(begin, self._forces(begin)))
        )
        if self.turns:
            arrays = (
                np.stack([getattr(t, name) for t in self.turns])
                for name in ("matrix", "sweep", "moment", "force")
            )
            times, stated, known = (
                np.array([getattr(t, name) for t in self.turns]) for name in ("duration", "stated", "known")
            )
            object.__setattr__(self, "stacked", (*arrays, times, stated, known))

    @property
    def n_stands(self) -> int:
        """Attitudes."""
        return len(self.reading)

    def errors(self, p: Array, sensor: str) -> TriadErrors:
        """Equation (1) of a calibration under parameters, which stand in the order of `parameter_names`."""
        sensor_parameters = p[..., self.layout.index(sensor + ".")]
        lean = np.broadcast_to(np.eye(3), (*p.shape[:-1], 3, 3)).copy()
        lean[..., *_OFF_DIAGONAL] = sensor_parameters[..., 6:12]
        follows: Array = np.zeros((3, 3))
        if sensor == GYRO:
            follows = sensor_parameters[..., 15:24].reshape(lean.shape)
        rows = sensor_parameters if p.ndim == 1 else sensor_parameters[..., None, :]  # the same in all stands
        return TriadErrors(
            bias=rows[..., :3],
            matrix=sensor_parameters[..., 3:6, None] * lean,
            quadratic=rows[..., 12:15],
            gravity_sensitivity=follows,
        )

    def _forces(self, p: Array) -> Array:
        """Specific force in the axes of the sensor, shape (..., n_stands, 3)."""
        noise = p[..., self.layout.index("reading_")].reshape(*p.shape[:-1], 3, -1).mT
        return self.errors(p, ACCELEROMETER).true(self.reading - noise)

    def _downs(self, p: Array, force: Array) -> Array:
        """Downwards in forward, right, down; shape (..., n_stands, 3)."""
        up = force / np.linalg.norm(force, axis=-1, keepdims=True)
        lean = rotation(p[..., self.layout.index("tilt_")])
        return np.asarray(-(up @ lean.mT) @ self.mounting.T)

    def chain(self, p: Array) -> StandAttitudes:
        """Attitudes of all stands."""
        force = self._forces(p)
        down = self._downs(p, force)
        level = levelled(down, self.heading_axes) @ self.mounting
        gyro, base = self.errors(p, GYRO), self.errors(self.begin, GYRO)
        inverse = np.linalg.inv(gyro.matrix)
        change = inverse @ base.matrix - np.eye(3)
        shift = ((base.bias - gyro.bias).reshape(*p.shape[:-1], 1, 3) @ inverse.mT)[..., 0, :]
        pulled = inverse @ (base.gravity_sensitivity - gyro.gravity_sensitivity)
        azimuth, tilt = np.zeros((*p.shape[:-1], 1)), np.zeros((*p.shape[:-1], 0, 2))
        if self.turns:
            azimuth, tilt = self._followed(p, level, change, shift, pulled)
        return StandAttitudes(level=level, azimuth=azimuth, down=down, tilt=tilt, force=force)

    def _followed(
        self, p: Array, level: Array, change: Array, shift: Array, pulled: Array
    ) -> tuple[Array, Array]:
        """Azimuth of each stand, and the tilt that each turn leaves."""
        matrix, sweep, moment, force, duration, stated, known = self.stacked
        vector = np.einsum("jilm,...lm->...ji", moment, change) + np.einsum("jil,...l->...ji", sweep, shift)
        turned = rotation(vector + np.einsum("jilm,...lm->...ji", force, pulled)) @ matrix
        step = level[..., :-1, :, :] @ turned @ level[..., 1:, :, :].mT
        earth = rotation(-duration[:, None] * p[..., None, :3])
        extra = p[..., self.layout.index("turn.")]
        azimuth, tilt = [np.zeros(p.shape[:-1])], np.zeros((*p.shape[:-1], len(known), 2))
        for j, moved in enumerate(known.tolist()):
            if not moved:
                azimuth.append(azimuth[j])
                continue
            if math.isfinite(stated[j]):
                azimuth.append(azimuth[j] + stated[j] - extra[..., j])
                continue
            about_down = _about_down(azimuth[j] + self.leaving[j])
            next_attitude = earth[..., j, :, :] @ about_down @ step[..., j, :, :]
            angle = np.arctan2(
                next_attitude[..., 1, 0] - next_attitude[..., 0, 1],
                next_attitude[..., 0, 0] + next_attitude[..., 1, 1],
            )
            azimuth.append(angle - extra[..., j] - self.entering[j + 1])
            tilt[..., j, :] = next_attitude[..., :2, 2]
        return np.stack(azimuth, axis=-1), tilt

    def gyros(self, p: Array) -> Array:
        """Means of the gyros in each stand, shape (..., n_stands, 3)."""
        chain = self.chain(p)
        rate = (p[..., None, None, :3] @ chain.attitude)[..., 0, :]
        return self.errors(p, GYRO).seen(rate, force=chain.force)

    def answers(self, p: Array) -> Array:
        """What is asked for: four numbers of the first stand, four of the last, and the tilt of each turn [rad].

        The four are the horizontal rate of the Earth along x and y of the level frame [rad/s], roll and pitch [rad].
        """
        chain = self.chain(p)
        ends = [_answer(p, chain.azimuth[..., k], chain.down[..., k, :]) for k in (0, -1)]
        return np.concatenate([*ends, chain.tilt.reshape(*p.shape[:-1], -1)], axis=-1)


def _answer(p: Array, azimuth: Array, down: Array) -> Array:
    c, s = np.cos(azimuth), np.sin(azimuth)
    level = c * p[..., 0] + s * p[..., 1], c * p[..., 1] - s * p[..., 0]
    return np.stack([*level, *angles_of_down(down)], axis=-1)


def angles_of_down(down: Array) -> tuple[Array, Array]:
    """Roll and pitch of a body in which downwards is so [rad], each of shape (...)."""
    ahead, right, below = np.moveaxis(down, -1, 0)
    return np.arctan2(right, below), np.arctan2(-ahead, np.hypot(right, below))


def derivative(call: Callable[[Array], Array], p: Array, steps: Array, active: Index) -> Array:
    """Central differences of a function by the active parameters, shape (n, n_active).

    The function is called once, with all sets of parameters, shape (2, n_active, n_parameters).
    """
    away = np.zeros((len(active), len(p)))
    away[np.arange(len(active)), active] = steps[active]
    high, low = call(np.stack([p + away, p - away]))
    return np.asarray(((high - low).reshape(len(active), -1) / (2 * steps[active])[:, None]).T)


def named_axis(down: Array) -> str:
    """Whose heading is meant when downwards is so in forward, right, down."""
    if abs(float(down[0])) < math.cos(STEEP):
        return "forward"
    return "down" if down[0] < 0 else "up"  # nose up: what was down points ahead


#: Heading axes in forward, right, down.
_OWN = {"forward": (1.0, 0.0, 0.0), "down": (0.0, 0.0, 1.0), "up": (0.0, 0.0, -1.0)}


def levelled(down: Array, axes: Sequence[str]) -> Array:
    """Forward, right, down to level frames whose x axis lies along the level part of the heading axis.

    Parameters
    ----------
    down : ndarray, shape (..., n, 3)
    axes : sequence of str, shape (n,)

    Returns
    -------
    ndarray, shape (..., n, 3, 3)
    """
    heading_axes = np.array([_OWN[axis] for axis in axes])
    ahead = heading_axes - down * (heading_axes * down).sum(axis=-1, keepdims=True)
    ahead = ahead / np.sqrt((ahead**2).sum(axis=-1, keepdims=True))
    right = (skew(down) @ ahead[..., None])[..., 0]
    return np.stack([ahead, right, down], axis=-2)


def _about_down(angle: Array) -> Array:
    """Rotations about the vertical, shape (..., 3, 3)."""
    out = np.zeros((*np.shape(angle), 3, 3))
    out[..., 0, 0] = out[..., 1, 1] = np.cos(angle)
    out[..., 1, 0] = np.sin(angle)
    out[..., 0, 1], out[..., 2, 2] = -out[..., 1, 0], 1.0
    return out
