# SPDX-License-Identifier: BSD-3-Clause
"""Records of a unit of three gyros and three accelerometers that is moved by hand or by a table on the Earth.

    sample = sensor errors (true vector along the body) + noise                                              (1)

The true rotation rate is the Earth's and the unit's own, the true specific force that of standing still on the Earth:
g, upwards. Both are exact means over the interval of a sample (`unit_course`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.filtering.simulation.record import (
    MOTION_STREAM,
    THERMOMETER_STREAM,
    checked_seed,
    readings_of,
    simulate,
    stream_of,
)
from allanite.filtering.simulation.signal import Temperature, finite
from allanite.filtering.simulation.unit_course import UnitCourse
from allanite.filtering.simulation.unit_motion import UnitMotion
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.attitude import axes_matrix
from allanite.quantities.earth import earth_rate_vector, normal_gravity
from allanite.recording.calibration import ACCELEROMETER, AXES, GYRO, Calibration, TriadErrors
from allanite.recording.checked_samples import checked_rate
from allanite.recording.records import ArrayColumn, Channel, Recording, Sampling

__all__ = ["simulate_unit", "true_attitudes"]

Array = NDArray[np.float64]
Progress = Callable[[float], None]

#: Names of the channels, as a bag of ROS gives them.
CHANNELS = {
    GYRO: tuple(f"gyro_{a}" for a in AXES),
    ACCELEROMETER: tuple(f"acc_{a}" for a in AXES),
}
_UNITS = {GYRO: "rad/s", ACCELEROMETER: "m/s²"}
#: Samples whose truth is made at once.
BLOCK = 1 << 14


def simulate_unit(
    models: Mapping[str, NoiseModel],
    *,
    rate: float,
    motion: UnitMotion,
    latitude: float,
    height: float = 0.0,
    gravity: float | None = None,
    calibration: Calibration | None = None,
    seed: int | np.random.Generator,
    axes: str = "FRD",
    sampling: Sampling = "mean",
    temperature: Temperature | None = None,
    start: int | None = None,
    progress: Progress | None = None,
) -> Recording:
    """A record of a unit on the Earth: channels gyro_x, gyro_y, gyro_z, acc_x, acc_y, acc_z, in SI.

    Parameters
    ----------
    models : mapping of str to NoiseModel
        Noise of "gyro" and "accelerometer", or of one of them alone; or of each channel by its name. Axes are
        independent.
    rate : float [Hz]
        Sample rate.
    motion : UnitMotion
        Motion of the unit, which sets the length of the record.
    latitude : float [rad]
        Geodetic, poles included.
    height : float [m]
        Above the ellipsoid: for the normal gravity.
    gravity : float, optional [m/s^2]
        Local gravity, in place of normal gravity.
    calibration : Calibration, optional
        The true errors of the sensors; a triad that it does not hold has none. Where it says that the channels count,
        the samples are counts, and so are the coefficients of the noise.
    seed : int or Generator
        As for `simulate`: the same seed gives the same samples.
    axes : str
        Directions of the axes x, y, z of the sensors in the unit, whose roll, pitch and heading the motion sets.
    sampling : "mean" or "point"
        Whether a sample is the mean over its interval or a point value.
    temperature : Temperature, optional
        Moves the biases by the slopes of the calibration, from its temperature on (from the reference or the start of
        `temperature` where it says none); its readings are a channel of their own.
    start : int, optional [ns]
        UTC of the first sample.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    Recording
        The last step of its history holds the truth: "motion" with positions (start, stop [s], roll, pitch, heading
        [rad], attitude), turns and rotations, and the parameters; latitude, gravity, axes, the calibration, the noise
        models and the seed.

    Raises
    ------
    InputError
        Models of other channels, or of an axis but not of its triad; a latitude, height or temperature that makes no
        sense.

    Notes
    -----
    A sample of a gyro is the mean of the rotation rate over its interval, which is what a gyro gives, and not the
    rotation over the interval divided by it: the sum of samples differs from the rotation by coning, which here is of
    the order of the Earth rate times the turn in one interval, and of the square of a hand's tremor. Errors of the
    sensors act on the means. The unit stands where it turns: no lever arm.

    Examples
    --------
    >>> from allanite.noise import NoiseModel, White
    >>> quiet = {"gyro": NoiseModel.of(White(N=1e-6)), "accelerometer": NoiseModel.of(White(N=1e-5))}
    >>> simulate_unit(quiet, rate=10.0, motion=UnitMotion.faces(dwell=30.0, turn=2.0), latitude=0.8, seed=1)
    <Recording gyro_x, gyro_y, gyro_z, acc_x, acc_y, acc_z: 1900 samples at 10 Hz, 190 s>
    """
    rate, seed = checked_rate(rate), checked_seed(seed)
    if not isinstance(motion, UnitMotion):
        raise InputError(
            f"motion must be made by UnitMotion.faces(...) or another of its kind, not {motion!r}"
        )
    by_channel = _by_channel(models)
    course = motion.draw(stream_of(seed, MOTION_STREAM))
    signals = _UnitSignals(
        course=course,
        place=_UnitPlace.of(latitude, height, gravity),
        mounting=axes_matrix(axes),
        dt=1 / rate,
        point=sampling == "point",
        temperature=_checked(temperature),
        calibration=calibration,
    )
    noise = simulate(
        by_channel,
        rate=rate,
        duration=course.duration,
        seed=seed,
        sampling=sampling,
        unit=_units(by_channel, calibration),
        start=start,
        progress=progress,
    )
    step = {
        **noise.history[-1],
        "motion": {**course.to_json(), "parameters": motion.to_json()},
        "axes": axes.upper(),
        "calibration": None if calibration is None else calibration.to_json(),
        **asdict(signals.place),
    }
    unit = replace(noise, columns=_moved(noise, signals), history=(step,))
    return unit if temperature is None else _with_readings(unit, temperature, seed, sampling)


def _moved(noise: Recording, signals: _UnitSignals) -> tuple[ArrayColumn, ...]:
    """Samples with what the triads show added to their noise."""
    sensors = tuple(s for s in CHANNELS if CHANNELS[s][0] in noise.names)
    columns = [column.read(0, len(column)) for column in noise.columns]
    for first in range(0, noise.n_samples, BLOCK):
        truth = signals.seen(first, min(BLOCK, noise.n_samples - first), sensors)
        for channel, column, x in zip(noise.channels, columns, truth, strict=True):
            column[first : first + len(x)] += x / channel.scale
    return tuple(ArrayColumn(c) for c in columns)


def _with_readings(unit: Recording, temperature: Temperature, seed: int, sampling: Sampling) -> Recording:
    step = {**unit.history[-1], "temperature": asdict(temperature)}
    if temperature.channel is None:
        return replace(unit, history=(step,))
    stream = stream_of(seed, THERMOMETER_STREAM)
    readings = ArrayColumn(readings_of(temperature, unit.n_samples, unit.dt, sampling, stream))
    channel = Channel.of(temperature.channel, "°C", sampling=sampling)
    return replace(
        unit, channels=(*unit.channels, channel), columns=(*unit.columns, readings), history=(step,)
    )


def true_attitudes(recording: Recording, t: ArrayLike) -> Array:
    """Attitudes of a simulated unit at instants: forward, right, down to north, east, down.

    Parameters
    ----------
    recording : Recording
        Recording made by `simulate_unit`.
    t : array_like, shape (n,) [s]
        Times from the first sample.

    Returns
    -------
    ndarray, shape (n, 3, 3)

    Raises
    ------
    InputError
        Not a record of `simulate_unit`.
    """
    try:
        step = next(s for s in recording.history if s["step"] == "simulate")
        motion = UnitMotion(**step["motion"]["parameters"])
    except (StopIteration, KeyError, TypeError):
        raise InputError("only a record of a simulated unit knows its true attitudes") from None
    return motion.draw(stream_of(step["seed"], MOTION_STREAM)).attitudes(
        np.atleast_1d(np.asarray(t, dtype=np.float64))
    )


# -- what was asked for -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _UnitPlace:
    latitude: float
    height: float
    gravity: float

    @classmethod
    def of(cls, latitude: float, height: float, gravity: float | None) -> _UnitPlace:
        """Latitude and height are checked by the gravity that they have, whether or not another is given."""
        normal = normal_gravity(finite("latitude", latitude), finite("height", height))
        given = normal if gravity is None else finite("gravity", gravity)
        if not given > 0:
            raise InputError(f"gravity must be positive [m/s^2], not {gravity!r}")
        return cls(latitude=float(latitude), height=float(height), gravity=given)


@dataclass(frozen=True, slots=True, kw_only=True)
class _UnitSignals:
    """What the triads show without noise."""

    course: UnitCourse
    place: _UnitPlace
    mounting: Array
    dt: float
    point: bool
    temperature: Temperature | None
    calibration: Calibration | None

    def seen(self, first: int, count: int, sensors: tuple[str, ...]) -> list[Array]:
        """Samples [first, first + count) of each channel."""
        t: Array = np.arange(first, first + count + 1, dtype=np.float64) * self.dt
        earth, force = earth_rate_vector(self.place.latitude), np.array([0.0, 0.0, -self.place.gravity])
        course = self.course
        sensed = course.values(t[:-1], earth, force) if self.point else course.means(t, earth, force)
        warmer = self._warmer(t[:-1])
        out: list[Array] = []
        for sensor in sensors:
            force = sensed.force @ self.mounting
            true = sensed.rate @ self.mounting if sensor == GYRO else force
            errors = self._errors(sensor)
            out += list((true if errors is None else errors.seen(true, warmer, force)).T)
        return out

    def _errors(self, sensor: str) -> TriadErrors | None:
        calibration = self.calibration
        return (
            None if calibration is None or sensor not in calibration.sensors else calibration.errors(sensor)
        )

    def _warmer(self, t: Array) -> Array:
        """Than the temperature to which the biases belong [K]."""
        if self.temperature is None:
            return np.zeros(len(t))
        zero = None if self.calibration is None else self.calibration.temperature
        if zero is None:
            zero = (
                self.temperature.start if self.temperature.reference is None else self.temperature.reference
            )
        return self.temperature.over(t, 0.0 if self.point else self.dt) - zero


def _by_channel(models: Mapping[str, NoiseModel]) -> dict[str, NoiseModel]:
    """Gyros first, whatever the order given."""
    out: dict[str, NoiseModel] = {}
    for sensor, names in CHANNELS.items():
        given = {n: models[n] for n in names if n in models}
        if given and (len(given) < 3 or sensor in models):
            raise InputError(
                f"noise of {sensor}: give one model for {sensor!r}, or all of {', '.join(names)}"
            )
        out |= dict.fromkeys(names, models[sensor]) if sensor in models else given
    strange = sorted(set(models) - set(out) - set(CHANNELS))
    if strange or not out:
        what = f"not of {strange[0]!r}" if strange else "and there are none"
        raise InputError(
            f"noise models are those of 'gyro', of 'accelerometer' or of channels like gyro_x, {what}"
        )
    return out


def _units(channels: Mapping[str, NoiseModel], calibration: Calibration | None) -> dict[str, str]:
    given = {} if calibration is None else calibration.units
    return {n: given.get(s) or _UNITS[s] for s, names in CHANNELS.items() for n in names if n in channels}


def _checked(temperature: Temperature | None) -> Temperature | None:
    if temperature is not None and not isinstance(temperature, Temperature):
        raise InputError(f"temperature must be a Temperature(start=..., drift=...), not {temperature!r}")
    if temperature is not None and temperature.coefficient:
        raise InputError(
            "the slopes of a unit's biases are its calibration's: gyro.bias_temperature_x and so on; "
            "leave the coefficient of the temperature at 0"
        )
    return temperature
