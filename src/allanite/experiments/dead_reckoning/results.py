# SPDX-License-Identifier: BSD-3-Clause
"""DeadReckoning: standard deviations of attitude, velocity and position over time, by source."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.noise import NoiseModel
from allanite.plain_files.json_values import plain

__all__ = ["QUANTITIES", "DeadReckoning", "InitialErrors", "Source"]

Array = NDArray[np.float64]

#: What is told -> the states whose variances make it. "horizontal" and "tilt" are roots of the sum of two variances.
QUANTITIES: Mapping[str, tuple[int, ...]] = {
    "position_horizontal": (0, 1),
    "position_north": (0,),
    "position_east": (1,),
    "position_down": (2,),
    "velocity_horizontal": (3, 4),
    "velocity_north": (3,),
    "velocity_east": (4,),
    "velocity_down": (5,),
    "tilt": (6, 7),
    "tilt_north": (6,),
    "tilt_east": (7,),
    "heading": (8,),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class InitialErrors:
    """Standard deviations of what is wrong when the dead reckoning begins; all in SI, 0 where not stated.

    Attributes
    ----------
    position, velocity : float [m], [m/s]
        Of each of north, east, down.
    tilt : float [rad]
        About each of north and east.
    heading : float [rad]
    gyro_bias, accelerometer_bias : float [rad/s], [m/s^2]
        Constant from one switching-on to the next (turn-on), of each axis.
    gyro_scale, accelerometer_scale : float
        Relative error of the scale factor of each axis: of the Earth's rotation, and of gravity.
    gyro_misalignment, accelerometer_misalignment : float [rad]
        Of each axis towards each of the other two.
    """

    position: float = 0.0
    velocity: float = 0.0
    tilt: float = 0.0
    heading: float = 0.0
    gyro_bias: float = 0.0
    accelerometer_bias: float = 0.0
    gyro_scale: float = 0.0
    accelerometer_scale: float = 0.0
    gyro_misalignment: float = 0.0
    accelerometer_misalignment: float = 0.0

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            number = isinstance(value, (int, float, np.floating, np.integer)) and not isinstance(value, bool)
            if not (number and math.isfinite(value) and value >= 0):
                raise InputError(
                    f"the initial standard deviation of {name} must be finite and not negative, not {value!r}"
                )
            object.__setattr__(self, name, float(value))


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """One source of error.

    Attributes
    ----------
    name : str
        "gyro N", "accelerometer turn-on bias", "initial heading"; all axes together.
    sensor : "gyro", "accelerometer" or "" (an initial error of the navigation)
    symbol : str
        Letter of the noise term, "GM" for a Gauss-Markov term; "" for what is not noise.
    is_limit : bool
        The record does not resolve the term: `sd` is what the model holds of it, mostly nothing, and `upper` what it
        may be.
    sd, lower, upper : ndarray, shape (n_times, n_quantities)
        One standard deviation, and the ends of its interval; NaN where the model states none, infinite where its end
        is open.
    """

    name: str
    sensor: str
    symbol: str
    is_limit: bool
    sd: Array = field(repr=False)
    lower: Array = field(repr=False)
    upper: Array = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class DeadReckoning:
    """Errors of dead reckoning over time.

    Attributes
    ----------
    times : ndarray, shape (n_times,) [s]
        Since the beginning.
    shown : tuple of float [s]
        Those of the tables.
    quantities : tuple of str
        Columns of all arrays; position in m, velocity in m/s, tilt and heading in rad.
    sources : tuple of Source
        The largest of the horizontal position at the end first.
    sd, lower, upper : ndarray, shape (n_times, n_quantities)
        Of all sources together; the interval at `confidence`, NaN where a model states none.
    confidence : float
    duration, latitude, heading : float [s], [rad], [rad]
    rest : float or None [s]
        At rest before the start, to level the unit and to take the biases of the gyros off.
    vertical : bool
        The mean of the vertical accelerometer at rest, less normal gravity, is removed as well.
    held : bool
        Something else holds the height.
    rate : float [Hz]
    initial : InitialErrors
    sinking : ndarray, shape (n_times,) [m]
        How much lower the unit believes to be on average by the second order of the tilt, g tilt^2/2, which a linear
        model leaves out; it is in no standard deviation. 0 where the height is held.
    linear_until : float or None [s]
        From then on an attitude is wrong by more than the linear model allows; None: it never is.
    says : str
    notes : tuple of str
    models : dict of str to NoiseModel
    """

    times: Array
    shown: tuple[float, ...]
    quantities: tuple[str, ...]
    sources: tuple[Source, ...]
    sd: Array = field(repr=False)
    lower: Array = field(repr=False)
    upper: Array = field(repr=False)
    confidence: float
    duration: float
    latitude: float
    heading: float
    rest: float | None
    held: bool
    vertical: bool
    rate: float
    initial: InitialErrors
    sinking: Array = field(repr=False)
    linear_until: float | None
    says: str
    notes: tuple[str, ...]
    models: Mapping[str, NoiseModel] = field(repr=False)

    def __getitem__(self, quantity: str) -> Array:
        """Standard deviation of one quantity over `times`.

        Raises
        ------
        InputError
            No such quantity.
        """
        return self.sd[:, self._column(quantity)]

    def by_source(self, quantity: str) -> dict[str, Array]:
        """Standard deviation of one quantity over `times`, by name of the source.

        Raises
        ------
        InputError
            No such quantity.
        """
        column = self._column(quantity)
        return {s.name: s.sd[:, column] for s in self.sources}

    def _column(self, quantity: str) -> int:
        if quantity not in self.quantities:
            raise InputError(f"no quantity {quantity!r}; there are: {', '.join(self.quantities)}")
        return self.quantities.index(quantity)

    def table(self) -> list[dict[str, Any]]:
        """One row for each shown time, source and "all", and quantity: sd, lower, upper in SI."""
        rows: list[dict[str, Any]] = []
        for time in self.shown:
            at = int(np.argmin(np.abs(self.times - time)))
            for name, part in [("all", self), *((s.name, s) for s in self.sources)]:
                rows += [
                    {
                        "time_s": time,
                        "source": name,
                        "quantity": quantity,
                        **{end: float(getattr(part, end)[at, i]) for end in ("sd", "lower", "upper")},
                    }
                    for i, quantity in enumerate(self.quantities)
                ]
        return rows

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; null for what is not known or infinite."""
        names = (
            "says", "notes", "confidence", "duration", "latitude", "heading", "rest", "held", "vertical", "rate",
            "linear_until", "quantities", "times", "shown", "sd", "lower", "upper", "sinking", "sources", "initial",
        )  # fmt: skip
        return {
            "format": "allanite-dead-reckoning",
            "version": 1,
            **{name: plain(getattr(self, name)) for name in names},
            "models": {name: model.to_json() for name, model in self.models.items()},
        }
