# SPDX-License-Identifier: BSD-3-Clause
"""What a sensor would show without noise: the Earth on a turned axis, the turning itself, bias, warm-up, temperature.

measured = (1 + scale error) (Earth + rotation) + bias, then noise, then the converter's full scale.

Notes
-----
In the frame of the table (north, east, up; the table leans by the angle b towards the heading B), the Earth rate is
R^T Omega (cos latitude, 0, sin latitude), R being the smallest rotation that takes the vertical into the table's
axis. A sensitive axis at heading a and elevation e over the table sees

    cos e (w_north cos a + w_east sin a) + sin e w_up.                                                    (1)

The elevation thus adds a constant, while the lean changes w_north itself, by -b tan(latitude) cos B of its value.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.filtering.simulation.course import Course, mean_decay
from allanite.filtering.simulation.motion import Motion
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.earth import EARTH_RATE
from allanite.recording.records import Channel, Kind, Sampling

__all__ = ["Signal", "SimulatedEffects", "Temperature", "earth_on_table"]

Array = NDArray[np.float64]
#: One value for all channels, or one for each.
PerChannel = float | Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Temperature:
    """The temperature of a sensor and its effect.

    T(t) = start + drift t + rise (1 - exp(-t/time_constant)) + swing sin(2 pi t/period)

    Attributes
    ----------
    start : float [°C]
        Temperature at the start.
    drift : float [K/s]
        Linear drift.
    rise, time_constant : float [K], [s]
        Warm-up; t counts from the first sample.
    swing, period : float [K], [s]
        Daily cycle, or cycle of a chamber.
    coefficient : float [rad/s/K]
        Bias per kelvin above `reference`.
    reference : float or None [°C]
        Reference temperature; None: `start`.
    noise : float [K]
        Standard deviation of one reading of the thermometer.
    channel : str or None
        Name of the channel that the readings are written to; None: they are not.
    """

    start: float = 25.0
    drift: float = 0.0
    rise: float = 0.0
    time_constant: float = 1200.0
    swing: float = 0.0
    period: float = 86_400.0
    coefficient: float = 0.0
    reference: float | None = None
    noise: float = 0.0
    channel: str | None = "temperature"

    def __post_init__(self) -> None:
        for name in ("start", "drift", "rise", "time_constant", "swing", "period", "coefficient", "noise"):
            object.__setattr__(self, name, finite(f"temperature: {name}", getattr(self, name)))
        if self.reference is not None:
            object.__setattr__(self, "reference", finite("temperature: reference", self.reference))
        if self.time_constant <= 0 or self.period <= 0 or self.noise < 0:
            raise InputError(
                "temperature: time_constant and period must be positive [s], noise not negative [K]"
            )

    def over(self, t: Array, span: float) -> Array:
        """Means over `span` seconds from t on; values at t where it is 0 [°C]."""
        gone = decayed(t, span, self.time_constant)
        turn = 2 * np.pi / self.period
        swing = self.swing * np.sinc(span / self.period) * np.sin(turn * (t + span / 2))
        return np.asarray(self.start + self.drift * (t + span / 2) + self.rise * (1 - gone) + swing)

    def bias(self, t: Array, span: float) -> Array:
        """The same of the bias that it makes [rad/s]."""
        zero = self.start if self.reference is None else self.reference
        return np.asarray(self.coefficient * (self.over(t, span) - zero))


@dataclass(frozen=True, slots=True, kw_only=True)
class Signal:
    """One channel without its noise, as a function of the sample number, in SI.

    Attributes
    ----------
    dt : float [s]
    sampling : "mean" or "point"
    course : Course or None
    north, east : float [rad/s]
        Factors of the cosine and the sine of the table's heading.
    gain : float
        Factor of the rotation about the axis.
    constant : float [rad/s]
    warm_up : (float, float) or None [rad/s], [s]
        Amplitude at the first sample and time constant.
    temperature : Temperature or None
    """

    dt: float
    sampling: Sampling
    course: Course | None
    north: float
    east: float
    gain: float
    constant: float
    warm_up: tuple[float, float] | None
    temperature: Temperature | None

    def samples(self, first: int, count: int) -> Array:
        """Samples [first, first + count)."""
        t: Array = np.arange(first, first + count + 1, dtype=np.float64) * self.dt
        span = self.dt if self.sampling == "mean" else 0.0
        total = np.full(count, self.constant)
        if self.course is not None:
            felt = self.course.means(t) if span else self.course.values(t[:-1])
            total += self.north * felt.cos + self.east * felt.sin + self.gain * felt.rate
        if self.warm_up is not None:
            amplitude, constant = self.warm_up
            total += amplitude * decayed(t[:-1], span, constant)
        if self.temperature is not None:
            total += self.temperature.bias(t[:-1], span)
        return total


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedEffects:
    """All that a simulation was asked for besides noise; attributes are the arguments of `simulate`."""

    motion: Motion | None = None
    latitude: float | None = None
    scale_error: PerChannel = 0.0
    turn_on_bias: PerChannel = 0.0
    warm_up: tuple[float, float] | None = None
    temperature: Temperature | None = None

    def __post_init__(self) -> None:
        _check_types(self.motion, self.temperature)
        if self.latitude is not None:
            _check_latitude(self.latitude, self.motion)
        if self.warm_up is not None:
            object.__setattr__(self, "warm_up", _warm_up(self.warm_up))

    @property
    def empty(self) -> bool:
        """Nothing but noise was asked for."""
        return self == SimulatedEffects()

    def signal(self, channel: Channel, count: int, course: Course | None, dt: float) -> Signal:
        """The signal of one of `count` channels.

        Raises
        ------
        InputError
            The channel cannot show it: not a rate, no heading for its axis, no value for it.
        """
        gain = 1 + self._value("scale_error", channel.name)
        north = east = constant = 0.0
        if self.motion is not None:
            if channel.kind is not Kind.RATE:
                raise InputError(
                    f"channel {channel.name!r} is of {channel.kind.value}: a motion turns gyros only"
                )
            axis = self.motion.axis(channel.name, count)
            north, east, constant = self._by_heading(axis, gain)
        return Signal(
            dt=dt,
            sampling=channel.sampling,
            course=course,
            north=north,
            east=east,
            gain=gain,
            constant=constant + self._value("turn_on_bias", channel.name),
            warm_up=self.warm_up,
            temperature=self.temperature,
        )

    def to_json(self, course: Course | None) -> dict[str, Any]:
        """What was asked for and, of the motion, what it became: plain data."""
        data: dict[str, Any] = {}
        if self.motion is not None and course is not None:
            data["motion"] = {**course.to_json(), "parameters": self.motion.to_json()}
        if self.latitude is not None:
            data["latitude"] = float(self.latitude)
        for name in ("scale_error", "turn_on_bias"):
            value = getattr(self, name)
            if value != 0.0:
                data[name] = dict(value) if isinstance(value, Mapping) else float(value)
        if self.warm_up is not None:
            data["warm_up"] = list(self.warm_up)
        if self.temperature is not None:
            data["temperature"] = asdict(self.temperature)
        return data

    def _value(self, name: str, channel: str) -> float:
        given = getattr(self, name)
        if isinstance(given, Mapping):
            if channel not in given:
                raise InputError(f"{name} has no value for channel {channel!r}; it has: {', '.join(given)}")
            given = given[channel]
        return finite(name, given)

    def _by_heading(self, axis: float, gain: float) -> tuple[float, float, float]:
        """Factors of cos and sin of the table's heading, and constant: eq. (1), and the coherent bias."""
        motion = self.motion
        assert motion is not None  # noqa: S101 - for the type checker
        north, east, up = earth_on_table(self.latitude, motion.table_tilt, motion.table_tilt_heading)
        level = gain * math.cos(motion.elevation)
        b, towards = motion.coherent_bias, motion.coherent_heading
        c, s = level * north + b * math.cos(towards), level * east + b * math.sin(towards)
        # c cos(h + axis) + s sin(h + axis), h being the heading of the table
        cos, sin = _turned(c, s, axis)
        return cos, sin, gain * math.sin(motion.elevation) * up


def earth_on_table(latitude: float | None, tilt: float, towards: float) -> tuple[float, float, float]:
    """Earth rate along north, east and up of a leaning table [rad/s]; none where there is no latitude."""
    if latitude is None:
        return 0.0, 0.0, 0.0
    north, up = EARTH_RATE * math.cos(latitude), EARTH_RATE * math.sin(latitude)
    along, across = north * math.cos(towards), -north * math.sin(towards)  # the lean lies along `towards`
    along, up = along * math.cos(tilt) - up * math.sin(tilt), along * math.sin(tilt) + up * math.cos(tilt)
    c, s = math.cos(towards), math.sin(towards)
    return along * c - across * s, along * s + across * c, up


def _turned(c: float, s: float, axis: float) -> tuple[float, float]:
    return c * math.cos(axis) + s * math.sin(axis), s * math.cos(axis) - c * math.sin(axis)


def decayed(t: Array, span: float, constant: float) -> Array:
    """Mean of exp(-t/constant) over `span` seconds from t on; its value at t where that is 0."""
    return np.asarray(np.exp(-t / constant) * float(mean_decay(np.asarray(span / constant))))


# -- checks -----------------------------------------------------------------------------------------------


def finite(name: str, value: object) -> float:
    """A finite number as float.

    Raises
    ------
    InputError
        Anything else.
    """
    number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not (number and math.isfinite(value)):  # type: ignore[arg-type]
        raise InputError(f"{name} must be a finite number, not {value!r}")
    return float(value)  # type: ignore[arg-type]


def _check_types(motion: object, temperature: object) -> None:
    if motion is not None and not isinstance(motion, Motion):
        raise InputError(
            f"motion must be made by Motion.reversals(...), .positions, .rotation or .still, not {motion!r}"
        )
    if temperature is not None and not isinstance(temperature, Temperature):
        raise InputError(
            f"temperature must be a Temperature(start=..., drift=..., coefficient=...), not {temperature!r}"
        )


def _check_latitude(latitude: float, motion: Motion | None) -> None:
    if abs(finite("latitude", latitude)) > math.pi / 2:
        raise InputError(
            f"latitude is an angle from -pi/2 to pi/2 [rad], not {latitude!r}; "
            f"were it degrees, it would be {math.radians(latitude):.6g} rad"
        )
    if motion is None:
        raise InputError(
            "the Earth rate on an axis depends on its heading: give motion=Motion.still(heading) or another"
        )


def _warm_up(given: object) -> tuple[float, float]:
    if not isinstance(given, (tuple, list)) or len(given) != 2:
        raise InputError(f"warm_up is a pair (amplitude [rad/s], time constant [s]), not {given!r}")
    amplitude, constant = finite("warm_up amplitude", given[0]), finite("warm_up time constant", given[1])
    if constant <= 0:
        raise InputError(f"the time constant of warm_up must be positive [s], not {constant!r}")
    return amplitude, constant
