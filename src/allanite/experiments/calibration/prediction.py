# SPDX-License-Identifier: BSD-3-Clause
"""The covariance that a self-calibration will have, before a single sample is taken."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.experiments.calibration.adjustment import OPEN, RESOLVED, earth_prior, nominal_of, plausible_of
from allanite.experiments.calibration.adjustment.design import Observed, State, Triad, layout
from allanite.experiments.calibration.adjustment.interval_noise import Intervals
from allanite.experiments.calibration.adjustment.solution import CalibrationSolution, covariance_at
from allanite.experiments.calibration.adjustment.turning import TurningSamples, constant_rate_turns
from allanite.experiments.calibration.adjustment.weights import weights_of
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.attitude import rotation_vector
from allanite.quantities.earth import EARTH_RATE, earth_rate_vector
from allanite.recording.calibration import ACCELEROMETER, GYRO, Calibration, Frame

__all__ = ["Prediction", "predict"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Direction of the Earth's rotation where the latitude is not told: any that is neither level nor upright [rad].
SOMEWHERE = 0.8


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """What a calibration will know.

    Attributes
    ----------
    names : tuple of str
    covariance : ndarray, shape (k, k)
        In SI: biases in m/s^2 and rad/s, scale factors about 1, misalignments in rad; plausible variance along what the
        positions leave open.
    assumed : tuple of str
        Parameters that the positions leave open.
    earth_sd : float or None [rad/s]
        Largest standard deviation of a component of the Earth's rotation that is looked for; None without gyros.
    earth_resolved : bool
        Its length will be seen, and calibrates the gyros.
    """

    names: tuple[str, ...]
    covariance: Array = field(repr=False)
    assumed: tuple[str, ...]
    earth_sd: float | None
    earth_resolved: bool

    @property
    def sd(self) -> Array:
        """Standard deviations, shape (k,)."""
        return np.sqrt(np.diag(self.covariance))

    def __getitem__(self, name: str) -> float:
        """Standard deviation of one parameter."""
        try:
            return float(self.sd[self.names.index(name)])
        except ValueError:
            raise InputError(f"no parameter {name!r}; there are: {', '.join(self.names)}") from None


def predict(
    attitudes: ArrayLike,
    *,
    dwell: ArrayLike,
    turn: ArrayLike,
    models: Mapping[str, NoiseModel | Sequence[NoiseModel]],
    latitude: float | None = None,
    gravity: float = 9.80665,
    frame: Frame = "z",
    quadratic: bool = False,
    warmer: ArrayLike | None = None,
    turns: ArrayLike | None = None,
    calibration: Calibration | None = None,
    rate: float = 100.0,
) -> Prediction:
    """Standard deviations of the parameters for positions, dwells and turns.

    Parameters
    ----------
    attitudes : array_like, shape (n, 3, 3)
        Of the body in each position, to north, east, down.
    dwell : array_like, shape () or (n,) [s]
        Time at rest in each, all of it usable.
    turn : array_like, shape () or (n - 1,) [s]
        Time from one to the next.
    models : mapping of str to NoiseModel or three of them
        Of "accelerometer", "gyro" or both: the triads of the unit.
    latitude : float, optional [rad]
        As `calibrate` will be told; None: it will not.
    gravity : float [m/s^2]
    frame, quadratic
        As of `calibrate`.
    warmer : array_like, shape (n,) [K], optional
        Temperature in each position less the reference: slopes with temperature are estimated too.
    turns : array_like, shape (n - 1, 3) [rad], optional
        Rotation vectors of the turns in the axes of the body, at a constant rate; the shortest way by default.
    calibration : Calibration, optional
        True errors, in SI; a perfect unit by default.
    rate : float [Hz]
        Of the samples.

    Returns
    -------
    Prediction
        Under the noise alone: scatter beyond it cannot be foreseen.

    Raises
    ------
    InputError
        Shapes that do not fit, times that are not positive, or no model of a triad.

    Notes
    -----
    The same linear algebra as in `calibrate`, at the true values.
    """
    c = np.asarray(attitudes, dtype=np.float64)
    n = len(c)
    if c.ndim != 3 or c.shape[1:] != (3, 3):
        raise InputError(f"attitudes must have shape (n, 3, 3), not {c.shape}")
    rest = np.broadcast_to(np.asarray(dwell, dtype=np.float64), (n,))
    move = np.broadcast_to(np.asarray(turn, dtype=np.float64), (max(n - 1, 0),))
    if not (np.all(rest > 0) and np.all(move > 0) and np.isfinite(rest).all() and np.isfinite(move).all()):
        raise InputError("dwells and turns must take positive times")
    sensors = tuple(s for s in (ACCELEROMETER, GYRO) if s in models)
    if not sensors or set(models) - set(sensors):
        raise InputError("models must be those of 'accelerometer', 'gyro' or both")
    warm = np.zeros(n) if warmer is None else np.asarray(warmer, dtype=np.float64)
    triads = layout(sensors, frame=frame, quadratic=quadratic, temperature=warmer is not None)
    earth = earth_rate_vector(SOMEWHERE if latitude is None else latitude)
    vectors = None if turns is None else np.asarray(turns, dtype=np.float64)
    values = _values(triads, calibration)
    observed = Observed(
        triads=triads,
        means={t.sensor: np.zeros((n, 3)) for t in triads},
        warmer=warm,
        before=np.arange(n - 1) if GYRO in sensors else np.zeros(0, dtype=np.int64),
        after=np.arange(1, n) if GYRO in sensors else np.zeros(0, dtype=np.int64),
        seconds=move if GYRO in sensors else np.zeros(0),
        turning=_turning(triads, values, c, warm, move, vectors),
        gravity=gravity,
    )
    state = State(values=values, attitudes=c, earth=earth)
    return _predicted(observed, state, _models(models, sensors), _times(rest, move, rate), rate, latitude)


def _values(triads: tuple[Triad, ...], calibration: Calibration | None) -> Array:
    names = tuple(n for t in triads for n in t.names)
    values = nominal_of(names)
    if calibration is not None:
        for k, name in enumerate(names):
            if name in calibration.names:
                values[k] = calibration[name][0]
    return values


def _turning(
    triads: tuple[Triad, ...], values: Array, c: Array, warm: Array, move: Array, vectors: Array | None
) -> TurningSamples:
    """What the gyros show on the way, by their own errors."""
    if triads[-1].sensor != GYRO or len(c) < 2:
        return constant_rate_turns(np.zeros((0, 3)), np.zeros(0))
    if vectors is None:
        vectors = rotation_vector(np.swapaxes(c[:-1], -1, -2) @ c[1:])
    if vectors.shape != (len(c) - 1, 3):
        raise InputError(f"turns must have shape ({len(c) - 1}, 3), not {vectors.shape}")
    motion = constant_rate_turns(vectors, move)
    heat = np.repeat((warm[1:] + warm[:-1]) / 2, np.diff(motion.edges))
    errors = triads[-1].errors(values[-len(triads[-1].names) :])
    return replace(motion, y=errors.seen(motion.y, heat), warmer=heat)


def _models(
    models: Mapping[str, NoiseModel | Sequence[NoiseModel]], sensors: tuple[str, ...]
) -> dict[str, list[NoiseModel]]:
    out = {}
    for s in sensors:
        sensor_models = models[s]
        three = [sensor_models] * 3 if isinstance(sensor_models, NoiseModel) else list(sensor_models)
        if len(three) != 3:
            raise InputError(f"the {s} has three axes: give one noise model or three, not {len(three)}")
        out[s] = three
    return out


def _times(rest: Array, move: Array, rate: float) -> tuple[Array, Array]:
    """Starts and stops of the positions [samples]."""
    start = np.concatenate([[0.0], np.cumsum(rest[:-1] + move)])
    return np.round(start * rate), np.round((start + rest) * rate)


def _predicted(
    observed: Observed,
    state: State,
    models: dict[str, list[NoiseModel]],
    times: tuple[Array, Array],
    rate: float,
    latitude: float | None,
) -> Prediction:
    start, stop = times
    spans = _intervals(start, stop, rate, stop[-1])
    n = observed.n
    weights = weights_of(
        models,
        dict.fromkeys(models, 1.0),
        dict.fromkeys(models, spans),
        {s: np.repeat(spans.whole[:, None], 3, axis=1) for s in models},
        {s: np.zeros((3, n, n)) for s in models},
        _intervals(stop[:-1], start[1:], rate, stop[-1]) if observed.m else None,
        np.zeros((3, observed.m)),
    )
    earth = None
    if GYRO in models:
        earth = earth_prior(ACCELEROMETER in models, latitude)
    plausible = plausible_of(observed.names)

    def found(held: bool) -> CalibrationSolution:
        known = earth
        if earth is not None and held:
            known = replace(earth, length=float(np.linalg.norm(earth.free.T @ (state.earth - earth.center))))
        return covariance_at(observed, weights, state, plausible=plausible, earth=known)

    solution, sd, resolved = found(False), None, False
    if earth is not None:
        sd = float(np.sqrt(np.linalg.eigvalsh(solution.earth_covariance)[-1]))
        length = EARTH_RATE if latitude is None else EARTH_RATE * np.cos(latitude)
        resolved = bool(length > RESOLVED * sd)
        solution = found(True) if resolved else solution
    opened = (solution.open**2).sum(axis=1)
    return Prediction(
        names=observed.names,
        covariance=solution.covariance,
        assumed=tuple(n for n, o in zip(observed.names, opened, strict=True) if o > OPEN),
        earth_sd=sd,
        earth_resolved=resolved,
    )


def _intervals(start: Array, stop: Array, rate: float, length: float) -> Intervals:
    return Intervals(
        start=start, stop=stop, whole=stop - start, length=float(length), dt=1 / rate, sampling="mean"
    )
