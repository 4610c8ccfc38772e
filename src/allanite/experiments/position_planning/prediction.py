# SPDX-License-Identifier: BSD-3-Clause
"""The covariance of a calibration, quickly: a search asks for it some thousand times.

What `allanite.experiments.calibration.predict` says for any unit, here for a perfect one, whose derivatives are the
signals themselves. The unknowns and observations are those of the calibration: parameters, the attitude of every rest,
the Earth's rotation; the means of the triads at rest, and the turns that the gyros integrate. Slow noise is common to
neighbouring rests and to the turn between them. The tests hold the two together.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.calibration.adjustment import RESOLVED, earth_prior, plausible_of
from allanite.experiments.calibration.adjustment.interval_noise import Intervals, interval_covariance
from allanite.experiments.calibration.adjustment.solution import Earth
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, Quantisation, White
from allanite.quantities.attitude import rotation, rotation_vector, skew
from allanite.quantities.earth import earth_rate_vector
from allanite.recording.calibration import ACCELEROMETER, AXES, GYRO, Frame, parameter_names

__all__ = ["Forecast", "PlannedUnit"]

Array = NDArray[np.float64]

#: Steps into which a turn is divided.
STEPS = 32
#: A parameter that stays at this part of its plausible size is not determined.
OPEN = 0.5
#: Headings are known to this before anything is measured [rad].
ATTITUDE = 3.0
#: Least variance of a turn [rad^2]: what float64 leaves of a product of rotations.
ROUNDING = 1e-26


@dataclass(frozen=True, slots=True, kw_only=True)
class Forecast:
    """What a scheme will tell.

    Attributes
    ----------
    names : tuple of str
    covariance : ndarray, shape (k, k)
        Of the parameters of a calibration; plausible variance where the scheme does not determine them.
    open : tuple of str
        Parameters that the scheme does not determine.
    earth : bool
        The gyros see the Earth's rotation.
    total : float [s]
    """

    names: tuple[str, ...]
    covariance: Array
    open: tuple[str, ...]
    earth: bool
    total: float

    @property
    def sd(self) -> Array:
        """Standard deviations, shape (k,)."""
        return np.sqrt(np.diag(self.covariance))


@dataclass(frozen=True, kw_only=True)
class PlannedUnit:
    """What does not depend on the scheme.

    Attributes
    ----------
    models : mapping of str to tuple of three NoiseModel
        Of the axes of "accelerometer" and "gyro", or of one of them.
    gravity : float [m/s^2]
    latitude : float or None [rad]
        None: the calibration will not know it.
    rate : float [Hz]
    turn : float [s]
        From the end of one rest to the beginning of the next.
    shortest : float [s]
        Rest.
    frame : "z" or "x"
    """

    models: Mapping[str, tuple[NoiseModel, ...]]
    gravity: float
    latitude: float | None
    rate: float
    turn: float
    shortest: float = 5.0
    frame: Frame = "z"

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of all parameters."""
        first = next(s for s in (ACCELEROMETER, GYRO) if s in self.models)
        return tuple(
            name
            for s in (ACCELEROMETER, GYRO)
            if s in self.models
            for name in parameter_names(s, frame=self.frame if s == first else None)
        )

    @cached_property
    def plausible(self) -> Array:
        """Sizes of the parameters that nobody would wonder at."""
        return np.asarray(plausible_of(self.names))

    @property
    def earth_rate(self) -> Array:
        """In north, east, down [rad/s]."""
        return earth_rate_vector(math.pi / 4 if self.latitude is None else self.latitude)

    def forecast(self, attitudes: Array, dwells: Sequence[float]) -> Forecast:
        """Of attitudes, body to north, east, down, shape (n, 3, 3), gone through in this order."""
        rest = np.asarray(dwells, dtype=np.float64)
        start = np.concatenate([[0.0], np.cumsum(rest[:-1] + self.turn)])
        edges = np.round(np.stack([start, start + rest], axis=1) * self.rate)
        observations = _SchemeObservations.of(self, attitudes, edges)
        rows = np.concatenate([b.rows for b in observations.blocks])
        white = np.linalg.solve(np.linalg.cholesky(observations.covariance()), rows)
        earth = earth_prior(ACCELEROMETER in self.models, self.latitude) if GYRO in self.models else None
        covariances, earth_resolved = self._solved(white, earth, observations.fixed), False
        if earth is not None:
            size = earth.sd * math.sqrt(earth.free.shape[1])
            earth_resolved = size > RESOLVED * math.sqrt(float(np.linalg.eigvalsh(covariances[1])[-1]))
            if earth_resolved:
                length = float(np.linalg.norm(earth.free.T @ self.earth_rate))
                covariances = self._solved(white, replace(earth, length=length), observations.fixed)
        sd = np.sqrt(np.diag(covariances[0]))
        open_ = tuple(n for n, s, p in zip(self.names, sd, self.plausible, strict=True) if s > OPEN * p)
        total = float(edges[-1, 1]) / self.rate
        return Forecast(
            names=self.names, covariance=covariances[0], open=open_, earth=earth_resolved, total=total
        )

    def _solved(self, white: Array, earth: Earth | None, fixed: int) -> tuple[Array, Array]:
        """Covariance of the parameters, and of the free part of the Earth's rotation."""
        p = len(self.names)
        values, earth_columns, attitudes = white[:, :p], white[:, p : p + 3], white[:, p + 3 :]
        directions = np.zeros((3, 0)) if earth is None else earth.directions(self.earth_rate)
        k = directions.shape[1]
        table = np.column_stack([values * self.plausible, earth_columns @ directions, attitudes[:, fixed:]])
        prior = np.full(table.shape[1], 1 / ATTITUDE**2)
        prior[:p] = 1.0
        information = table.T @ table
        information[np.diag_indices_from(information)] += prior
        if earth is not None:
            design = earth.rows(self.earth_rate)[0]
            information[p : p + k, p : p + k] += design.T @ design - np.eye(k) / ATTITUDE**2
        scale = 1 / np.sqrt(np.diag(information))
        inverse = np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale)
        return inverse[:p, :p] * np.outer(self.plausible, self.plausible), inverse[p : p + k, p : p + k]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Block:
    """Observations of one kind: derivatives by parameters, Earth and attitudes, three rows for each."""

    rows: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class _SchemeObservations:
    """The observations of a scheme.

    `fixed` columns of the attitudes come first that are so by definition: the heading of the first rest, or all of it.
    `paths` are rotations from the body during each turn to that before it, shape (m, STEPS, 3, 3).
    """

    unit: PlannedUnit
    edges: Array
    blocks: tuple[_Block, ...]
    paths: Array
    fixed: int

    @classmethod
    def of(cls, unit: PlannedUnit, attitudes: Array, edges: Array) -> _SchemeObservations:
        n = len(attitudes)
        blocks = []
        for sensor in (s for s in (ACCELEROMETER, GYRO) if s in unit.models):
            known = np.array([0.0, 0.0, -unit.gravity]) if sensor == ACCELEROMETER else unit.earth_rate
            back = np.swapaxes(attitudes, -1, -2)
            blocks.append(
                _block(
                    _by_parameters(unit.names, sensor, (back @ known)[:, None, :], np.eye(3)[None, None]),
                    back if sensor == GYRO else np.zeros((n, 3, 3)),
                    [(np.arange(n), back @ skew(known))],
                    n,
                )
            )
        paths = np.zeros((0, STEPS, 3, 3))
        if GYRO in unit.models and n > 1:
            vectors = rotation_vector(np.swapaxes(attitudes[:-1], -1, -2) @ attitudes[1:]).reshape(-1, 3)
            parts = (np.arange(STEPS) + 0.5) / STEPS
            paths = rotation(parts[None, :, None] * vectors[:, None, :])
            blocks.append(_turn_block(unit, attitudes, edges, vectors, paths))
        # the third component of the first rest goes first: it alone may be fixed
        order = [2, 0, 1, *range(3, 3 * n)]
        first = len(unit.names) + 3
        moved = tuple(
            _Block(rows=np.column_stack([b.rows[:, :first], b.rows[:, first:][:, order]])) for b in blocks
        )
        fixed = 1 if ACCELEROMETER in unit.models else 3
        return cls(unit=unit, edges=edges, blocks=moved, paths=paths, fixed=fixed)

    # -- noise

    def covariance(self) -> Array:
        """Of all observations."""
        n, m = len(self.edges), len(self.paths)
        sensors = [s for s in (ACCELEROMETER, GYRO) if s in self.unit.models]
        out = np.zeros((3 * (n * len(sensors) + m),) * 2)
        for place, sensor in enumerate(sensors):
            axis_covariances = self._of_models(sensor, self.edges, slow=False)
            for axis, block in enumerate(axis_covariances):
                at = 3 * n * place + axis
                out[at : at + 3 * n : 3, at : at + 3 * n : 3] = block
        if m:
            self._turns(out, 3 * n * sensors.index(GYRO), 3 * n * len(sensors))
        return out

    def _intervals(self, edges: Array) -> Intervals:
        start, stop = edges[:, 0], edges[:, 1]
        length = float(self.edges[-1, 1])
        return Intervals(
            start=start,
            stop=stop,
            whole=stop - start,
            length=length,
            dt=1 / self.unit.rate,
            sampling="mean",
        )

    def _of_models(self, sensor: str, edges: Array, *, slow: bool) -> list[Array]:
        """Covariance of the means over intervals for each axis; computed once where the axes are alike."""
        made: dict[int, Array] = {}
        intervals = self._intervals(edges)
        for model in self.unit.models[sensor]:
            if id(model) not in made:
                terms = model.terms
                if slow:
                    terms = tuple(t for t in terms if not isinstance(t, (White, Quantisation)))
                made[id(model)] = interval_covariance(replace(model, terms=terms), intervals)
        return [made[id(model)] for model in self.unit.models[sensor]]

    def _turns(self, out: Array, gyros: int, turns: int) -> None:
        """Slow noise by the lever of each turn, white noise and noise of the angle by themselves."""
        n, m = len(self.edges), len(self.paths)
        between = np.stack([self.edges[:-1, 1], self.edges[1:, 0]], axis=1)
        seconds = (between[:, 1] - between[:, 0]) / self.unit.rate
        lever = self.paths.mean(axis=1) * seconds[:, None, None]
        place = turns + np.arange(3 * m)
        joints = self._of_models(GYRO, np.concatenate([self.edges, between]), slow=True)
        for axis, (model, joint) in enumerate(zip(self.unit.models[GYRO], joints, strict=True)):
            column = np.zeros((3 * m, m))
            column[np.arange(3 * m), np.arange(3 * m) // 3] = lever[:, :, axis].ravel()
            out[np.ix_(place, place)] += column @ joint[n:, n:] @ column.T
            rest = gyros + 3 * np.arange(n) + axis
            mixed = column @ joint[n:, :n]
            out[np.ix_(place, rest)] += mixed
            out[np.ix_(rest, place)] += mixed.T
            density = sum(t.N**2 for t in model.terms if isinstance(t, White))
            angle = sum(2 * t.Q**2 for t in model.terms if isinstance(t, Quantisation))
            along = self.paths[..., axis]
            white = np.einsum("m,msi,msj->mij", density * seconds / STEPS, along, along)
            white[:, axis, axis] += angle
            for k in range(m):
                at = turns + 3 * k
                out[at : at + 3, at : at + 3] += white[k]
        out[place, place] += ROUNDING


def _by_parameters(names: tuple[str, ...], sensor: str, signal: Array, path: Array) -> Array:
    """Mean of path times the derivative of y, shape (k, 3, p); signals (k, steps, 3), paths (k, steps, 3, 3)."""
    out = np.zeros((len(signal), 3, len(names)))
    for column, name in enumerate(names):
        if not name.startswith(sensor + "."):
            continue
        kind, _, which = name.partition(".")[2].rpartition("_")
        i = AXES.index(which[0])
        size = 1.0 if kind == "bias" else signal[..., AXES.index(which[-1])][..., None]
        out[:, :, column] = (path[..., i] * size).mean(axis=1)
    return out


def _block(
    by_value: Array, by_earth: Array, attitudes: Sequence[tuple[NDArray[np.int64], Array]], n: int
) -> _Block:
    count = len(by_value)
    by_attitude = np.zeros((count, 3, n, 3))
    for which, effect in attitudes:
        by_attitude[np.arange(count), :, which, :] += effect
    parts = [by_value, by_earth, by_attitude.reshape(count, 3, 3 * n)]
    return _Block(rows=np.concatenate(parts, axis=2).reshape(3 * count, -1))


def _turn_block(unit: PlannedUnit, attitudes: Array, edges: Array, vectors: Array, paths: Array) -> _Block:
    """The rotation from rest to rest against inertial space; an error of the rates adds its integral along the path."""
    n, m = len(attitudes), len(vectors)
    seconds = (edges[1:, 0] - edges[:-1, 1]) / unit.rate
    rates = np.repeat((vectors / seconds[:, None])[:, None, :], STEPS, axis=1)
    back = np.swapaxes(attitudes[:-1], -1, -2)
    return _block(
        _by_parameters(unit.names, GYRO, rates, paths) * seconds[:, None, None],
        seconds[:, None, None] * back,
        [(np.arange(1, n), back), (np.arange(m), -back)],
        n,
    )
