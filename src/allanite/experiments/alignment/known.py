# SPDX-License-Identifier: BSD-3-Clause
"""What is known of the sensors before an alignment: one vector of parameters, and its covariance."""

from __future__ import annotations

import math
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.alignment.geometry import ParameterLayout
from allanite.experiments.alignment.solution import Knowledge
from allanite.experiments.alignment.turns import StandTurn
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.recording.calibration import ACCELEROMETER, AXES, GYRO, Calibration

__all__ = ["SOURCES", "Sensors", "knowledge_of"]

Array = NDArray[np.float64]

#: Sources of the budget, and the parameters that make them.
SOURCES = {
    "gyro bias": ("gyro.bias_", "gyro.gravity_sensitivity_"),
    "gyro scale and misalignment": ("gyro.scale_", "gyro.misalignment_", "gyro.quadratic_"),
    "accelerometer noise": ("reading_",),
    "accelerometer calibration": ("accelerometer.",),
    "turns": ("turn.",),
    "tilt": ("tilt_",),
    "latitude": ("vertical",),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensors:
    """Both triads as they are known beforehand.

    Attributes
    ----------
    calibration : Calibration
        Of both triads, its covariance with the repeatability of the biases and the stated scale factor.
    bias_known : bool
        False where nothing is known of the biases of the gyros.
    calibrated : tuple of str
        Triads that were calibrated: "gyro", "accelerometer".
    """

    calibration: Calibration = field(repr=False)
    bias_known: bool
    calibrated: tuple[str, ...]

    @classmethod
    def of(
        cls,
        calibration: Calibration | None,
        repeatability: tuple[float | None, float | None] | None,
        stated: SetupUncertainty,
    ) -> Sensors:
        """Nominal where there is no calibration.

        Raises
        ------
        InputError
            A repeatability that makes no sense.
        """
        gyro, acc = _checked(repeatability or (None, None))
        whole = _both(calibration)
        scale = {s: abs(whole[f"{s}.scale_x"][0]) for s in (GYRO, ACCELEROMETER)}
        extra = {
            "gyro.bias": (gyro or 0.0) * scale[GYRO],
            "accelerometer.bias": (acc or 0.0) * scale[ACCELEROMETER],
            "gyro.scale": stated.scale * scale[GYRO],
        }
        known = gyro is not None or (calibration is not None and GYRO in calibration.sensors)
        return cls(
            calibration=whole.with_repeatability(extra),
            bias_known=known,
            calibrated=() if calibration is None else calibration.sensors,
        )

    @property
    def given(self) -> bool:
        """There was a calibration."""
        return bool(self.calibrated)

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name."""
        return dict(zip(self.calibration.names, self.calibration.values.tolist(), strict=True))

    def unit(self, sensor: str) -> float:
        """Samples per SI unit."""
        return abs(self.calibration[f"{sensor}.scale_x"][0])

    def with_bias(self, sd: float) -> Sensors:
        """The same with biases of the gyros known to so much [unit of the channels]."""
        return replace(
            self, calibration=self.calibration.with_repeatability({"gyro.bias": sd}), bias_known=True
        )


def _checked(repeatability: tuple[float | None, float | None]) -> tuple[float | None, float | None]:
    for name, value in zip(("gyros", "accelerometers"), repeatability, strict=True):
        if value is not None and not (math.isfinite(value) and value >= 0):
            raise InputError(
                f"the repeatability of the biases of the {name} must be finite and not negative, not {value!r}"
            )
    return repeatability


def _both(calibration: Calibration | None) -> Calibration:
    """With nominal parameters of a triad that it does not hold."""
    if calibration is None:
        return Calibration.nominal(ACCELEROMETER, GYRO)
    lacking = [s for s in (ACCELEROMETER, GYRO) if s not in calibration.sensors]
    if not lacking:
        return calibration
    more = Calibration.nominal(*lacking)
    n, k = len(calibration.names), len(more.names)
    covariance = np.zeros((n + k, n + k))
    covariance[:n, :n] = calibration.covariance
    return replace(
        calibration,
        names=calibration.names + more.names,
        values=np.concatenate([calibration.values, more.values]),
        covariance=covariance,
        status=calibration.status + more.status,
    )


def knowledge_of(
    layout: ParameterLayout,
    sensors: Sensors,
    latitude: float,
    stated: SetupUncertainty,
    reading: Array,
    turn_variance: Array,
    *free: str,
) -> tuple[Array, Knowledge]:
    """The parameters beforehand, and what is known of them.

    Parameters
    ----------
    reading : ndarray, shape (3, n_stands, n_stands)
        Covariance of the means of the accelerometers.
    turn_variance : ndarray, shape (n_turns,) [rad^2]
    free : str
        Names, or beginnings of names, of further parameters without a prior.
    """
    place = {name: i for i, name in enumerate(layout.names)}
    start, covariance = np.zeros(len(place)), np.zeros((len(place), len(place)))
    calibration_places = np.array([place[n] for n in sensors.calibration.names if n in place])
    kept = [i for i, n in enumerate(sensors.calibration.names) if n in place]
    start[calibration_places] = sensors.calibration.values[kept]
    covariance[np.ix_(calibration_places, calibration_places)] = sensors.calibration.covariance[
        np.ix_(kept, kept)
    ]
    start[place["vertical"]] = -EARTH_RATE * math.sin(latitude)
    covariance[place["vertical"], place["vertical"]] = (
        EARTH_RATE * math.cos(latitude) * stated.latitude
    ) ** 2
    for axis, letter in enumerate(AXES):
        at = layout.index(f"reading_{letter}.")
        covariance[np.ix_(at, at)] = reading[axis]
        covariance[place[f"tilt_{letter}"], place[f"tilt_{letter}"]] = stated.tilt**2
    turns = layout.index("turn.")
    covariance[turns, turns] = turn_variance
    open_ = ("north.", *free) if sensors.bias_known else ("north.", "gyro.bias_", *free)
    sources = {name: layout.index(*starts) for name, starts in SOURCES.items()}
    return start, Knowledge.of(layout.index(*open_), covariance, sources)


def bias_sds(sensors: Sensors) -> Array:
    """Standard deviations of the biases of the gyros beforehand, shape (3,); infinite where nothing is known."""
    if not sensors.bias_known:
        return np.full(3, np.inf)
    return np.array([sensors.calibration[f"gyro.bias_{a}"][1] for a in AXES])


def uncertain(turns: tuple[StandTurn, ...], noise: Array, excess: float = 0.0) -> Array:
    """Variance of each turn [rad^2]: its noise and, of those that turned, what gravity found of them."""
    moved = np.array([t.known and t.size > math.radians(1.0) for t in turns], dtype=np.float64)
    return np.asarray(noise + moved * excess)
