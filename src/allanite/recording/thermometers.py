# SPDX-License-Identifier: BSD-3-Clause
"""The channel that is taken for the temperature: one of a gyro would fit away what is measured."""

from __future__ import annotations

from collections.abc import Collection

from allanite.errors import InputError
from allanite.recording.channel_names import unit_option
from allanite.recording.records import Kind, Recording

__all__ = ["checked_thermometer"]

#: A thermometer may be in volts, in counts or without a unit.
_NO_TEMPERATURE = (Kind.RATE, Kind.ANGLE, Kind.ACCELERATION, Kind.VELOCITY, Kind.PHASE, Kind.FREQUENCY)


def checked_thermometer(recording: Recording, name: str, measured: Collection[str]) -> str:
    """Its name.

    Raises
    ------
    InputError
        No such channel, one of a gyro or an accelerometer, or one of those that are measured.
    """
    kind = recording[name].kind
    if name in measured:
        raise InputError(f"channel {name!r} is the one that is measured: name another for the temperature")
    if kind in _NO_TEMPERATURE:
        raise InputError(
            f"channel {name!r} holds {kind.value}, not temperature: name another, or state its unit "
            f"({unit_option([name], 'degC')})"
        )
    return name
