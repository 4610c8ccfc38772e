# SPDX-License-Identifier: BSD-3-Clause
"""What three axes show of a true vector, and back: bias, scale factors, misalignments, with their covariance.

    y = S (I + E) (x + q x^2) + b + a (T - T_0) + G f,   S = diag(scale),  E the misalignments (zero diagonal),  (1)

y being the samples in the unit of the channel after its nominal scale (SI, or counts), x the true vector in SI along
the axes of the body. E_xy is what y adds to the x axis: the angle [rad] by which the sensitive axis x leans towards y.
G is of gyros alone, whose biases may follow the true specific force f along the axes of the body (g-sensitivity).

The body needs a definition, for a common rotation of all axes moves it. With frame "z" the z axis of the accelerometers
is that of the body and their y axis lies in its plane of y and z: E is upper triangular. With frame "x" their x axis is
that of the body and their y axis lies in the plane of x and y: E is lower triangular. The gyros are referred to the
same body and have all six misalignments; alone they define it in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import FormatError, InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.json_values import load_plain, plain
from allanite.recording.records import Kind, Recording, scaled_samples
from allanite.recording.sample_columns import Calculated, Column

__all__ = ["ACCELEROMETER", "AXES", "GYRO", "Calibration", "Frame", "TriadErrors", "parameter_names"]

Array = NDArray[np.float64]
Frame = Literal["z", "x"]


AXES = "xyz"
ACCELEROMETER, GYRO = "accelerometer", "gyro"
_ALL_PAIRS = tuple(a + b for a in AXES for b in AXES)
_PAIRS = tuple(p for p in _ALL_PAIRS if p[0] != p[1])
_OF_FRAME = {"z": ("xy", "xz", "yz"), "x": ("yx", "zx", "zy")}


def parameter_names(
    sensor: str,
    *,
    frame: Frame | None = None,
    quadratic: bool = False,
    temperature: bool = False,
    gravity_sensitivity: bool = False,
) -> tuple[str, ...]:
    """Names of the parameters of a triad: "gyro.bias_x", "gyro.scale_x", "gyro.misalignment_xy", ...

    Parameters
    ----------
    sensor : "accelerometer" or "gyro"
    frame : "z" or "x", optional
        Of a triad that defines the body: only three misalignments. Without it all six.
    quadratic, temperature : bool
        With "quadratic_x" [1/SI] and "bias_temperature_x" [SI/K].
    gravity_sensitivity : bool
        With "gravity_sensitivity_xx", "_xy", ... [rad/s/(m/s^2)]: what the force along the second axis adds to the
        first. Accelerometers have none.
    """
    kinds: dict[str, Sequence[str]] = {
        "bias": AXES,
        "scale": AXES,
        "misalignment": _PAIRS if frame is None else _OF_FRAME[frame],
        "quadratic": AXES if quadratic else (),
        "bias_temperature": AXES if temperature else (),
        "gravity_sensitivity": _ALL_PAIRS if gravity_sensitivity and sensor == GYRO else (),
    }
    return tuple(f"{sensor}.{kind}_{which}" for kind, places in kinds.items() for which in places)


@dataclass(frozen=True, slots=True, kw_only=True)
class TriadErrors:
    """Equation (1) of one triad, or of many at once: then all have the leading axes of what they are asked for.

    Attributes
    ----------
    bias : ndarray, shape (3,)
        In the unit of y.
    matrix : ndarray, shape (3, 3)
        S (I + E).
    quadratic : ndarray, shape (3,) [1/SI]
    temperature : ndarray, shape (3,)
        Slope of the bias, in the unit of y per kelvin.
    gravity_sensitivity : ndarray, shape (3, 3)
        G, in the unit of y per m/s^2; zero for accelerometers.
    """

    bias: Array
    matrix: Array
    quadratic: Array = field(default_factory=lambda: np.zeros(3))
    temperature: Array = field(default_factory=lambda: np.zeros(3))
    gravity_sensitivity: Array = field(default_factory=lambda: np.zeros((3, 3)))

    def seen(self, true: ArrayLike, warmer: ArrayLike = 0.0, force: ArrayLike | None = None) -> Array:
        """y of true vectors, shape (..., 3).

        Parameters
        ----------
        true : array_like, shape (..., 3)
        warmer : array_like, shape (...) [K]
            Than the reference.
        force : array_like, shape (..., 3) [m/s^2]
            True specific force along the axes of the body; needed where the biases follow it.

        Raises
        ------
        InputError
            The biases follow the force, which is not given.
        """
        x = np.asarray(true, dtype=np.float64)
        return np.asarray((x + self.quadratic * x**2) @ self.matrix.mT + self._level(warmer, force))

    def true(self, measured: ArrayLike, warmer: ArrayLike = 0.0, force: ArrayLike | None = None) -> Array:
        """The true vectors of y: the inverse of `seen`, with its parameters.

        The quadratic is solved for the root that is there without it, in the form that loses no digits.
        """
        y = np.asarray(measured, dtype=np.float64)
        z = (y - self._level(warmer, force)) @ np.linalg.inv(self.matrix).mT
        return np.asarray(2 * z / (1 + np.sqrt(1 + 4 * self.quadratic * z)))

    def _level(self, warmer: ArrayLike, force: ArrayLike | None) -> Array:
        """y where x is zero."""
        level = self.bias + np.asarray(warmer, dtype=np.float64)[..., None] * self.temperature
        if not self.gravity_sensitivity.any():
            return np.asarray(level)
        if force is None:
            raise InputError(_FORCELESS)
        return np.asarray(level + np.asarray(force, dtype=np.float64) @ self.gravity_sensitivity.mT)


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """The errors of a unit of three accelerometers, three gyros or both, with their covariance.

    Attributes
    ----------
    names : tuple of str
        Names of the parameters, see `parameter_names`.
    values : ndarray, shape (k,)
        Biases in the unit of the channels, scale factors in that unit per SI unit (about 1 where it is SI),
        misalignments in rad.
    covariance : ndarray, shape (k, k)
        Covariance of the values; for parameters that no measurement determined, the assumed one.
    status : tuple of str
        Status of each: "estimated"; "assumed", not determined by the measurement and at its nominal value; "held",
        given.
    frame : "z" or "x"
        Axes that define the body.
    channels : dict of str to tuple of str
        Names of the three channels of "accelerometer" and "gyro".
    units : dict of str to str
        "m/s²", "rad/s" or the unit that the channels count in.
    temperature : float or None
        Temperature at which the biases apply, in the unit of the temperature channel after its scale; None: not
        considered.
    gravity : float or None [m/s^2]
        Gravity by which the accelerometers were calibrated: their scale factors are proportional to its inverse.
    date : str
        Date of the measurement, ISO 8601; "" if unknown.
    source : str
        Origin of the calibration.
    """

    names: tuple[str, ...]
    values: Array
    covariance: Array = field(repr=False)
    status: tuple[str, ...] = field(repr=False)
    frame: Frame = "z"
    channels: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict, repr=False)
    temperature: float | None = None
    gravity: float | None = None
    date: str = field(default="", repr=False)
    source: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        k = len(self.names)
        if self.values.shape != (k,) or self.covariance.shape != (k, k) or len(self.status) != k:
            raise InputError(f"a calibration of {k} parameters needs {k} values, their covariance and status")
        if len(set(self.names)) != k or not set(self.names) <= set(_ALL):
            odd = sorted(set(self.names) - set(_ALL)) or "a name twice"
            raise InputError(f"a calibration does not know these parameters: {odd}")
        if not (np.isfinite(self.values).all() and np.isfinite(self.covariance).all()):
            raise InputError("the values and covariance of a calibration must be finite numbers")

    @classmethod
    def nominal(cls, *sensors: str, channels: Mapping[str, tuple[str, ...]] | None = None) -> Calibration:
        """Perfect sensors without uncertainty, as assumed for a unit without a calibration."""
        names = tuple(n for s in sensors for n in parameter_names(s))
        values = np.array([1.0 if ".scale_" in n else 0.0 for n in names])
        k = len(names)
        held: tuple[str, ...] = ("held",) * k
        return cls(
            names=names,
            values=values,
            covariance=np.zeros((k, k)),
            status=held,
            channels=dict(channels or {}),
        )

    @property
    def sd(self) -> Array:
        """Standard deviations, shape (k,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def sensors(self) -> tuple[str, ...]:
        """Calibrated triads: "accelerometer", "gyro"."""
        return tuple(s for s in (ACCELEROMETER, GYRO) if any(n.startswith(s + ".") for n in self.names))

    def __getitem__(self, name: str) -> tuple[float, float]:
        """Value and standard deviation of one parameter."""
        try:
            i = self.names.index(name)
        except ValueError:
            raise InputError(f"no parameter {name!r}; there are: {', '.join(self.names)}") from None
        return float(self.values[i]), float(self.sd[i])

    def errors(self, sensor: str) -> TriadErrors:
        """Equation (1) of one triad.

        Raises
        ------
        InputError
            The calibration does not hold this triad.
        """
        if sensor not in self.sensors:
            raise InputError(
                f"this calibration is of {' and '.join(self.sensors) or 'nothing'}, not of the {sensor}"
            )
        return errors_of(dict(zip(self.names, self.values.tolist(), strict=True)), sensor)

    def with_values(self, values: ArrayLike) -> Calibration:
        """The same with other values: for derivatives by the parameters, and draws from their covariance."""
        return replace(self, values=np.asarray(values, dtype=np.float64))

    def with_repeatability(self, sds: Mapping[str, float]) -> Calibration:
        """With further standard deviations added to parameters, e.g. of a bias from one switching-on to the next.

        Parameters
        ----------
        sds : mapping of str to float
            Standard deviations by parameter ("gyro.bias_x") or by kind ("gyro.bias": all three axes).
        """
        extra = np.zeros(len(self.names))
        for key, sd in sds.items():
            hit = np.array(
                [
                    n == key or (n.startswith(key + "_") and n[len(key) + 1 :] in (*AXES, *_ALL_PAIRS))
                    for n in self.names
                ]
            )
            if not hit.any():
                raise InputError(f"no parameter {key!r}; there are: {', '.join(self.names)}")
            if not (math.isfinite(sd) and sd >= 0):
                raise InputError(
                    f"the standard deviation of {key} must be finite and not negative, not {sd!r}"
                )
            extra[hit] += sd**2
        return replace(self, covariance=self.covariance + np.diag(extra))

    def apply(self, recording: Recording) -> Recording:
        """A recording of true rates and accelerations in SI along the axes of the body.

        Samples are combined as they are read, block by block. A sample with any of its three axes missing is missing;
        of gyros that follow gravity, also one with any of the accelerometers missing.

        Raises
        ------
        InputError
            Channels that the recording does not have, biases that depend on temperature, or gyros that follow gravity
            without the accelerometers.
        """
        columns, channels = list(recording.columns), list(recording.channels)
        for sensor in self.sensors:
            triad = self._calibrated(recording, sensor)
            for axis, name in enumerate(self.channels[sensor]):
                i = recording.index(name)
                columns[i] = _Axis(triad=triad, axis=axis)
                kind, unit = _TRUE[sensor]
                channels[i] = replace(channels[i], kind=kind, scale=1.0, unit=unit)
        step = {
            "step": "calibrate",
            "source": self.source,
            "names": list(self.names),
            "values": plain(self.values),
        }
        return replace(
            recording, columns=tuple(columns), channels=tuple(channels), history=(*recording.history, step)
        )

    def _calibrated(self, recording: Recording, sensor: str) -> _Triad:
        """The true vectors of a triad in a recording."""
        names = self.channels.get(sensor, ())
        if len(names) != 3:
            raise InputError(f"this calibration does not name the three channels of its {sensor}")
        errors = self.errors(sensor)
        if errors.temperature.any():
            raise InputError(
                "biases that depend on temperature cannot be removed sample by sample; align and calibrate do so"
            )
        force = None
        if errors.gravity_sensitivity.any():
            if ACCELEROMETER not in self.sensors:
                raise InputError(_FORCELESS)
            force = self._calibrated(recording, ACCELEROMETER)
        places = [recording.index(n) for n in names]
        sources = tuple((recording.columns[i], recording.channels[i].scale) for i in places)
        return _Triad(sources=sources, errors=errors, force=force)

    # -- files ------------------------------------------------------------------------------------------------

    def to_json(self) -> dict[str, Any]:
        """Plain data, version 1; `from_json` is its inverse."""
        return {
            "format": "allanite-calibration",
            "version": 1,
            **{
                name: plain(getattr(self, name))
                for name in (
                    "source", "date", "frame", "channels", "units", "temperature", "gravity", "names", "values",
                    "covariance", "status",
                )
            },
        }  # fmt: skip

    @classmethod
    def from_json(cls, data: Any) -> Calibration:
        """Read a calibration from its plain data, or from a document that has one under "calibration".

        Raises
        ------
        FormatError
            Not the data of a calibration, or of a later version.
        """
        if isinstance(data, Mapping) and isinstance(data.get("calibration"), Mapping):
            data = data["calibration"]
        if not isinstance(data, Mapping) or data.get("format") != "allanite-calibration":
            raise FormatError("this is no calibration: expected what `allanite calibrate --out` writes")
        if data.get("version") != 1:
            raise FormatError(
                f"this calibration is of version {data.get('version')!r}; this program reads version 1"
            )
        try:
            return cls(
                names=tuple(data["names"]),
                values=np.array(data["values"], dtype=np.float64),
                covariance=np.array(data["covariance"], dtype=np.float64),
                status=tuple(data["status"]),
                frame=data["frame"],
                channels={k: tuple(v) for k, v in data["channels"].items()},
                units=dict(data["units"]),
                **{k: data[k] for k in ("temperature", "gravity", "date", "source")},
            )
        except (KeyError, TypeError, ValueError, AttributeError, InputError) as error:
            raise FormatError(f"the calibration is damaged: {error}") from None

    @classmethod
    def load(cls, path: str | Path) -> Calibration:
        """Read a calibration from a file.

        Raises
        ------
        InputError
            No such file.
        FormatError
            Not a calibration.
        """
        return cls.from_json(
            load_plain(path, "a calibration, calibration.json of 'allanite calibrate LOG --out FOLDER'")
        )


_ALL = tuple(
    n
    for s in (ACCELEROMETER, GYRO)
    for n in parameter_names(s, quadratic=True, temperature=True, gravity_sensitivity=True)
)


def errors_of(values: Mapping[str, float], sensor: str) -> TriadErrors:
    """Equation (1) of one triad from its parameters by name; what is not there is zero, or one for a scale factor."""

    def row(kind: str, default: float = 0.0) -> Array:
        return np.array([values.get(f"{sensor}.{kind}_{a}", default) for a in AXES])

    lean = np.eye(3)
    for pair in _PAIRS:
        lean[AXES.index(pair[0]), AXES.index(pair[1])] = values.get(f"{sensor}.misalignment_{pair}", 0.0)
    return TriadErrors(
        bias=row("bias"),
        matrix=row("scale", 1.0)[:, None] * lean,
        quadratic=row("quadratic"),
        temperature=row("bias_temperature"),
        gravity_sensitivity=np.reshape(
            [values.get(f"{sensor}.gravity_sensitivity_{pair}", 0.0) for pair in _ALL_PAIRS], (3, 3)
        ),
    )


@dataclass(frozen=True, slots=True)
class _Triad:
    """The true vectors of three columns; `force` is that of the accelerometers, where it is needed."""

    sources: Sequence[tuple[Column, float]]
    errors: TriadErrors
    force: _Triad | None

    def read(self, start: int, stop: int) -> Array:
        """Shape (n, 3), NaN where missing."""
        readings = np.stack(
            [scaled_samples(column, scale, start, stop) for column, scale in self.sources], axis=-1
        )
        force = None if self.force is None else self.force.read(start, stop)
        return self.errors.true(readings, force=force)


@dataclass(frozen=True, slots=True)
class _Axis(Calculated):
    """One axis of the true vectors, as a column."""

    triad: _Triad
    axis: int

    def __len__(self) -> int:
        return len(self.triad.sources[0][0])

    def read(self, start: int, stop: int) -> Array:
        return np.asarray(self.triad.read(start, stop)[:, self.axis])


_FORCELESS = (
    "the biases of these gyros follow gravity: what they show depends on the specific force, so the accelerometers are "
    "needed, too"
)
#: What true vectors are.
_TRUE = {ACCELEROMETER: (Kind.ACCELERATION, "m/s²"), GYRO: (Kind.RATE, "rad/s")}
