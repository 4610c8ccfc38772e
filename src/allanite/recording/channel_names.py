# SPDX-License-Identifier: BSD-3-Clause
"""What the names of channels say of their sensors, and the options that give these channels a unit.

Advice is made of the names that the record has, so that it runs when it is copied. Which unit is right, no name says:
deg/s stands for a gyro and m/s^2 for an accelerometer, as the unit that its reader puts in place of it.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable, Sequence
from typing import Literal, Protocol, TypeVar

from allanite.errors import InputError
from allanite.recording.increment_names import increment_unit, names_increments

__all__ = [
    "Sensor",
    "channel_called",
    "for_shell",
    "scale_option",
    "sensor_called",
    "unit_option",
    "ways_to_units",
]

Sensor = Literal["gyro", "accelerometer", "temperature", ""]


class _Named(Protocol):
    @property
    def name(self) -> str: ...


N = TypeVar("N", bound=_Named)

# First match wins: gyro_temp is a temperature.
_SENSORS: tuple[tuple[Sensor, re.Pattern[str]], ...] = (
    ("temperature", re.compile(r"te?mp|therm|^t_?\d*$|degc|celsius", re.IGNORECASE)),
    ("gyro", re.compile(r"gyr|omega|rate|^[gw]_?[xyz\d]$", re.IGNORECASE)),
    ("accelerometer", re.compile(r"acc|^[af]_?[xyz\d]$", re.IGNORECASE)),
)
_UNITS: dict[Sensor, str] = {
    "gyro": "deg/s",
    "accelerometer": "m/s^2",
    "temperature": "degC",
    "": "deg/s",
}
_FACTORS: dict[tuple[str, Sensor], str] = {
    ("counts", "accelerometer"): "16384 LSB/g",
    ("counts", "gyro"): "131 LSB/(deg/s)",
    ("voltage", "accelerometer"): "300 mV/g",
    ("voltage", "gyro"): "24 mV/(deg/s)",
}
_PLAIN = re.compile(r"[\w@%+=:,./^-]+")


def channel_called(name: str, channels: Sequence[N]) -> N:
    """What a result says of the channel of this name.

    Raises
    ------
    InputError
        No such channel.
    """
    for channel in channels:
        if channel.name == name:
            return channel
    raise InputError(f"no channel {name!r}; there are: {', '.join(c.name for c in channels)}")


def sensor_called(name: str) -> Sensor:
    """The sensor that a channel of this name is of, where the name tells."""
    return next((sensor for sensor, pattern in _SENSORS if pattern.search(name)), "")


def unit_option(names: Iterable[str], unit: str = "") -> str:
    """``--unit`` for each of these channels, as a shell takes it: this unit, or one that fits the name.

    >>> unit_option(["gx", "acc_x", "die temp", "delta_velocity_0"])
    "--unit 'gx=deg/s,acc_x=m/s^2,die temp=degC,delta_velocity_0=m/s'"
    """
    return _by_name("--unit", [(name, unit or _likely_unit(name)) for name in names])


def _likely_unit(name: str) -> str:
    return increment_unit(name) if names_increments(name) else _UNITS[sensor_called(name)]


def scale_option(channels: Iterable[tuple[str, str]]) -> str:
    """``--scale-factor`` with the kind of number that a data sheet gives for each channel in counts or volts.

    Parameters
    ----------
    channels : iterable of (str, str)
        Name and kind. Thermometers are left out, as are channels of other kinds; "" where none is left.
    """
    of_sensors = [(name, kind, sensor_called(name) or "gyro") for name, kind in channels]
    factors = [
        (name, _FACTORS[kind, sensor]) for name, kind, sensor in of_sensors if (kind, sensor) in _FACTORS
    ]
    return _by_name("--scale-factor", factors) if factors else ""


def ways_to_units(channels: Sequence[tuple[str, str]]) -> str:
    """What is to be said of channels (name, kind) so that it is known what they measure; "" where all of it is known.

    >>> ways_to_units([("gx", "unknown"), ("t", "temperature")])
    'state the unit of the samples, as in --unit gx=deg/s (or, of raw counts, their scale factor)'
    """
    unknown = [name for name, kind in channels if kind == "unknown"]
    factors, counted = scale_option(channels), "(or, of raw counts, their scale factor)"
    ways = [f"state the unit of the samples, as in {unit_option(unknown)} {counted}"] if unknown else []
    ways += [f"give the scale factor of the data sheet, as in {factors}"] if factors else []
    return "; ".join(ways)


def for_shell(word: str) -> str:
    """A word as a shell takes it: in quotes only where it needs them."""
    return word if _PLAIN.fullmatch(word) else shlex.quote(word)


def _by_name(option: str, parts: Sequence[tuple[str, str]]) -> str:
    """A comma or an equals sign ends a name here: what stands before it is a beginning that the option takes."""
    settings = ",".join(f"{re.split('[,=]', name)[0]}={value}" for name, value in parts)
    return f"{option} {for_shell(settings)}"
