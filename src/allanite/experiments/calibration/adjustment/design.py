# SPDX-License-Identifier: BSD-3-Clause
"""The unknowns of a self-calibration, what they predict, and how the predictions depend on them.

Unknown are the parameters of the accelerometers and of the gyros, the attitude C_i of every static span (body to a
level frame, third axis down), and the Earth's rotation e in that frame. Observed are, at rest,

    the mean of the accelerometers     seen(C_i' (0, 0, -g)),
    the mean of the gyros              seen(C_i' e), and G C_i' (0, 0, -g) where their biases follow gravity,

and between span i and span j the rotation that the gyros integrate, against inertial space, over the time t,

    D = C_i' exp(e t) C_j.

Attitudes change by small rotations of the level frame: C becomes exp(psi) C. The heading of the first span is zero by
definition; without accelerometers the whole attitude of the first span is.
"""

from __future__ import annotations

from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.calibration.adjustment.turning import Moments, Turning
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.attitude import rotation, rotation_vector, skew
from allanite.recording.calibration import (
    ACCELEROMETER,
    AXES,
    GYRO,
    Frame,
    TriadErrors,
    errors_of,
    parameter_names,
)

__all__ = ["SENSITIVITY", "Observed", "Predicted", "State", "Triad", "layout", "linearise"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: How the bias of each gyro follows the specific force along each axis, row by row.
SENSITIVITY = parameter_names(GYRO, gravity_sensitivity=True)[-9:]


@dataclass(frozen=True, slots=True, kw_only=True)
class Triad:
    """The parameters of one triad: names, and y as a function of them."""

    sensor: str
    names: tuple[str, ...]

    @classmethod
    def of(cls, sensor: str, *, frame: Frame | None, quadratic: bool, temperature: bool) -> Triad:
        names = parameter_names(sensor, frame=frame, quadratic=quadratic, temperature=temperature)
        return cls(sensor=sensor, names=names)

    def errors(self, values: Array) -> TriadErrors:
        """Equation (1) of `allanite.recording.calibration` with these values."""
        return errors_of(dict(zip(self.names, values.tolist(), strict=True)), self.sensor)

    def derivatives(self, values: Array, true: Array, warmer: Array, force: Array) -> Array:
        """Of y by the parameters at true vectors and specific forces, shape (n, 3, p)."""
        e = self.errors(values)
        scale = np.array([values[self.names.index(f"{self.sensor}.scale_{a}")] for a in AXES])
        bent = true + e.quadratic * true**2
        out = np.zeros((len(true), 3, len(self.names)))
        for k, name in enumerate(self.names):
            kind, which = _parts(name)
            i = AXES.index(which[0])
            if kind == "bias":
                out[:, i, k] = 1.0
            elif kind == "scale":
                out[:, i, k] = bent @ e.matrix[i] / scale[i]
            elif kind == "misalignment":
                out[:, i, k] = scale[i] * bent[:, AXES.index(which[1])]
            elif kind == "quadratic":
                out[:, :, k] = e.matrix[:, i] * true[:, i, None] ** 2
            elif kind == "bias_temperature":
                out[:, i, k] = warmer
            elif kind == "gravity_sensitivity":
                out[:, i, k] = force[:, AXES.index(which[1])]
        return out

    @property
    def following_gravity(self) -> Triad:
        """The gyros with biases that follow gravity."""
        return replace(self, names=self.names + SENSITIVITY)

    @property
    def follows_gravity(self) -> bool:
        """Whether these are among the parameters."""
        return SENSITIVITY[0] in self.names

    def turn_derivatives(self, values: Array, moments: Moments) -> Array:
        """Of the rotation vector of each turn, equation (1) of `turning`, by y's parameters, shape (m, 3, p).

        Raising a parameter raises y; the rotation by the same samples falls. This is the rise of y.
        """
        e = self.errors(values)
        scale = np.array([values[self.names.index(f"{self.sensor}.scale_{a}")] for a in AXES])
        inverse = np.linalg.inv(e.matrix)
        by_rate = np.einsum("mabc,bi->maic", moments.rate, inverse)
        by_level, by_warmth = moments.first @ inverse, moments.warm @ inverse
        by_force = np.einsum("mabc,bi->maic", moments.force, inverse)
        out = np.zeros((len(moments.rotation), 3, len(self.names)))
        for k, name in enumerate(self.names):
            kind, which = _parts(name)
            i = AXES.index(which[0])
            if kind == "bias":
                out[:, :, k] = by_level[:, :, i]
            elif kind == "scale":
                out[:, :, k] = by_rate[:, :, i, :] @ e.matrix[i] / scale[i]
            elif kind == "misalignment":
                out[:, :, k] = scale[i] * by_rate[:, :, i, AXES.index(which[1])]
            elif kind == "bias_temperature":
                out[:, :, k] = by_warmth[:, :, i]
            elif kind == "gravity_sensitivity":
                out[:, :, k] = by_force[:, :, i, AXES.index(which[1])]
        return out


def _parts(name: str) -> tuple[str, str]:
    kind, _, which = name.split(".")[1].rpartition("_")
    return kind, which


def layout(
    sensors: tuple[str, ...], *, frame: Frame, quadratic: bool, temperature: bool
) -> tuple[Triad, ...]:
    """The triads of a unit; the accelerometers define the body, or the gyros alone."""
    return tuple(
        Triad.of(
            s,
            frame=frame if s == ACCELEROMETER or ACCELEROMETER not in sensors else None,
            quadratic=quadratic and s == ACCELEROMETER,
            temperature=temperature,
        )
        for s in sensors
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Observed:
    """What was measured, each axis over its nominal scale factor, so that all is nearly SI.

    Attributes
    ----------
    triads : tuple of Triad
    means : dict of str to ndarray, shape (n, 3)
        Of the spans, by triad.
    warmer : ndarray, shape (n,) [K]
        Temperature of the spans less the reference.
    before, after : ndarray of int64, shape (m,)
        Spans that each turn links.
    seconds : ndarray, shape (m,) [s]
        Length of each turn.
    turning : Turning
        The turns; none where nothing is linked.
    gravity : float [m/s^2]
    """

    triads: tuple[Triad, ...]
    means: dict[str, Array]
    warmer: Array
    before: Index
    after: Index
    seconds: Array
    turning: Turning = field(repr=False)
    gravity: float

    @property
    def n(self) -> int:
        """Number of spans."""
        return len(self.warmer)

    @property
    def m(self) -> int:
        """Number of turns."""
        return len(self.before)

    @property
    def names(self) -> tuple[str, ...]:
        """Of all parameters."""
        return tuple(name for t in self.triads for name in t.names)

    def force(self, attitudes: Array) -> Array:
        """Specific force at rest along the axes of the body, shape (n, 3)."""
        return np.asarray(-self.gravity * attitudes[:, 2])

    def triad(self, sensor: str) -> Triad | None:
        """Of this name, or None."""
        return next((t for t in self.triads if t.sensor == sensor), None)

    @property
    def gyro(self) -> Triad:
        """The gyros, which are the last triad."""
        return self.triads[-1]

    def place(self, sensor: str) -> slice:
        """Where its parameters are among all."""
        start = 0
        for t in self.triads:
            if t.sensor == sensor:
                return slice(start, start + len(t.names))
            start += len(t.names)
        return slice(start, start)


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """Values of all unknowns.

    Attributes
    ----------
    values : ndarray, shape (p,)
    attitudes : ndarray, shape (n, 3, 3)
    earth : ndarray, shape (3,) [rad/s]
    """

    values: Array
    attitudes: Array
    earth: Array

    def moved(self, values: Array, earth: Array, turns: Array) -> State:
        """The state after a step; `turns` has shape (n, 3)."""
        return replace(
            self,
            values=self.values + values,
            earth=self.earth + earth,
            attitudes=rotation(turns) @ self.attitudes,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Predicted:
    """Residuals (measured less predicted) and the derivatives of the predictions.

    Rows: accelerometers of every span, gyros of every span, turns; three each. What a unit does not have has no rows.

    Attributes
    ----------
    residual : ndarray, shape (r,)
    by_value : ndarray, shape (r, p)
    by_earth : ndarray, shape (r, 3)
    by_attitude : ndarray, shape (r, 3 n)
    lever : ndarray, shape (m, 3, 3) [s]
        What a constant error of y of each gyro adds to each turn.
    """

    residual: Array
    by_value: Array
    by_earth: Array
    by_attitude: Array
    lever: Array


def linearise(observed: Observed, state: State) -> Predicted:
    """Predictions at a state."""
    blocks = [_at_rest(observed, state, t) for t in observed.triads]
    lever = np.zeros((0, 3, 3))
    if observed.m:
        turned, lever = _turned(observed, state)
        blocks.append(turned)
    residual, by_value, by_earth, by_attitude = (np.concatenate(b) for b in zip(*blocks, strict=True))
    return Predicted(
        residual=residual, by_value=by_value, by_earth=by_earth, by_attitude=by_attitude, lever=lever
    )


Block = tuple[Array, Array, Array, Array]


def _at_rest(observed: Observed, state: State, triad: Triad) -> Block:
    n, p = observed.n, len(state.values)
    place = observed.place(triad.sensor)
    values = state.values[place]
    back = np.swapaxes(state.attitudes, -1, -2)
    accelerometer = triad.sensor == ACCELEROMETER
    up = np.array([0.0, 0.0, -observed.gravity])
    known = up if accelerometer else state.earth
    true, force = back @ known, observed.force(state.attitudes)
    errors = triad.errors(values)
    slope = errors.matrix[None] * (1 + 2 * errors.quadratic * true)[:, None, :]
    by_value = np.zeros((n, 3, p))
    by_value[:, :, place] = triad.derivatives(values, true, observed.warmer, force)
    by_attitude = np.zeros((n, 3, n, 3))
    turned = slope @ back @ skew(known) + errors.gravity_sensitivity @ back @ skew(up)
    by_attitude[np.arange(n), :, np.arange(n), :] = turned
    by_earth = np.zeros((n, 3, 3)) if accelerometer else slope @ back
    residual = observed.means[triad.sensor] - errors.seen(true, observed.warmer, force)
    return (
        residual.ravel(),
        by_value.reshape(3 * n, p),
        by_earth.reshape(3 * n, 3),
        by_attitude.reshape(3 * n, -1),
    )


def _turned(observed: Observed, state: State) -> tuple[Block, Array]:
    n, m, p = observed.n, observed.m, len(state.values)
    gyro, turning = observed.gyro, observed.turning
    place = observed.place(GYRO)
    values = state.values[place]
    moments = turning.integrate(gyro.errors(values), force=gyro.follows_gravity)
    back = np.swapaxes(state.attitudes[observed.before], -1, -2)
    carried = back @ rotation(state.earth * observed.seconds[:, None])
    expected = carried @ state.attitudes[observed.after]
    residual = rotation_vector(moments.rotation @ np.swapaxes(expected, -1, -2))
    # residual = log(exp(a) D exp(-b)): before and after a rotation that is not small, small ones count so
    half = skew(residual) / 2
    ahead, behind = np.eye(3) - half, np.eye(3) + half
    by_value = np.zeros((m, 3, p))
    by_value[:, :, place] = ahead @ gyro.turn_derivatives(values, moments)
    by_attitude = np.zeros((m, 3, n, 3))
    rows = np.arange(m)
    by_attitude[rows, :, observed.after, :] += behind @ carried
    by_attitude[rows, :, observed.before, :] -= behind @ back
    by_earth = observed.seconds[:, None, None] * behind @ back
    lever = moments.first @ np.linalg.inv(gyro.errors(values).matrix)
    block = (
        residual.ravel(),
        by_value.reshape(3 * m, p),
        by_earth.reshape(3 * m, 3),
        by_attitude.reshape(3 * m, -1),
    )
    return block, lever
