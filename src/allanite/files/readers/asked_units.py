# SPDX-License-Identifier: BSD-3-Clause
"""Units in a heading that leave open what the column is: an angle, or a rate whose "per second" was lost?"""

from __future__ import annotations

import re

from allanite.errors import InputError
from allanite.files.readers.headings import FITTING, Heading, measures
from allanite.quantities.units import QuantityKind
from allanite.recording.channel_names import unit_option

__all__ = ["is_of_sensor", "refuse_open_unit", "refuse_unit_of_no_sensor"]

#: Names that say that the samples are the running sum.
_SUMMED = re.compile(r"angle|theta|phase|phi|pos|(?:^|_)int(?:_|$)|integ|sum|turns", re.IGNORECASE)
#: Of an accelerometer: its sum is a velocity. Of a gyro the word belongs to a rate, angular velocity.
_VELOCITY = re.compile(r"vel", re.IGNORECASE)
#: An increment, or the inclination.
_INC = re.compile(r"(?:^|_)inc(?:_|$)", re.IGNORECASE)
#: Names that say that they are a rate.
_RATE = re.compile(r"rate|freq|speed|omega|spin", re.IGNORECASE)
#: Units of angle that clocks and shafts are counted in: a number of them may be a phase or a frequency.
_COUNTED = re.compile(r"[mµnu]?(?:cycles?|cyc|turns?|revs?|revolutions?)", re.IGNORECASE)


#: What samples of a sensor may be in, and its temperature.
_OF_SENSORS = FITTING["gyro"] | FITTING["acc"] | {QuantityKind.TEMPERATURE}
_INERTIAL = (QuantityKind.ANGLE_RATE, QuantityKind.ACCELERATION)
#: An axis of a sensor, rather than a setting (gyro_odr) or an accuracy (hAcc).
_AXIS = re.compile(
    r"[xyz]_?\d*$|^(?:(?:roll|pitch|yaw)_?(?:rate|vel\w*|speed)|gyro?(?:scope)?|omega)$", re.IGNORECASE
)
_SENSOR = re.compile(r"gyr|omega|acc|rate|vel|^w", re.IGNORECASE)


def refuse_open_unit(heading: Heading) -> None:
    """Ask for the unit where the heading's own may be that of the rate or of its sum.

    Raises
    ------
    InputError
        It names both units.
    """
    quantity = measures(heading.unit) if heading.unit else None
    rate = bool(_RATE.search(heading.name))
    gyro = heading.group == "gyro" or rate
    if quantity is QuantityKind.ANGLE and _INC.search(heading.name):
        why = "'inc' may be an increment or an inclination"
        raise _question(heading, why, "an angle", "increments", "/sample")
    if _SUMMED.search(heading.name) and not rate:
        return
    if quantity is QuantityKind.ANGLE and gyro:
        raise _question(heading, "a gyro measures a rate", "an angle", "a rate")
    if quantity is QuantityKind.ANGLE and heading.group == "" and _COUNTED.fullmatch(heading.unit):
        raise _question(heading, "the file does not show which of the two it is", "a phase", "a frequency")
    if quantity is QuantityKind.VELOCITY and heading.group == "acc" and not _VELOCITY.search(heading.name):
        raise _question(heading, "an accelerometer measures an acceleration", "a velocity", "an acceleration")


def refuse_unit_of_no_sensor(heading: Heading, unit: str) -> None:
    """Refuse a frequency, a ratio or the like as the unit of an axis of a gyro or an accelerometer.

    Raises
    ------
    InputError
        It names the unit, and the option that states another one.
    """
    quantity = measures(unit) if unit and heading.group in FITTING else None
    if quantity is None or quantity in _OF_SENSORS:
        return
    per_second = quantity is QuantityKind.FREQUENCY and heading.group == "gyro" and "hz" not in unit.lower()
    if not per_second and not _is_axis(heading):
        return
    sensor, wanted = ("a gyro", "deg/s") if heading.group == "gyro" else ("an accelerometer", "m/s^2")
    why = ""
    if per_second:
        wanted, why = "rad/s", "; in SI, 1/s of a gyro is rad/s"
    raise InputError(
        f"channel {heading.name}: {unit!r} is a unit of {quantity.value}, not of {sensor}{why}. State that of the "
        f"samples: {unit_option([heading.name], wanted)} (unit={{{heading.name!r}: {wanted!r}}} in Python)"
    )


def is_of_sensor(heading: Heading) -> bool:
    """True for a heading that states the unit of a gyro or an accelerometer, or names an axis of one."""
    quantity = measures(heading.unit) if heading.unit else None
    return quantity in _INERTIAL or (heading.group in FITTING and _is_axis(heading))


def _is_axis(heading: Heading) -> bool:
    return bool(_SENSOR.search(heading.name) and _AXIS.search(heading.name))


def _question(heading: Heading, why: str, summed: str, rate: str, per: str = "/s") -> InputError:
    unit, name = heading.unit, heading.name
    return InputError(
        f"channel {name}: the heading says {unit!r}, {summed}, and {why}. If the samples are {rate}, use "
        f"{unit_option([name], f'{unit}{per}')} (unit={{{name!r}: {f'{unit}{per}'!r}}} in Python); if they are "
        f"{summed}, {unit_option([name], unit)}"
    )
