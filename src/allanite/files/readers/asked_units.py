# SPDX-License-Identifier: BSD-3-Clause
"""Units in a heading that leave open what the column is: an angle, or a rate whose "per second" was lost?"""

from __future__ import annotations

import re

from allanite.errors import InputError
from allanite.files.readers.headings import Heading
from allanite.quantities.units import QuantityKind, parse_unit
from allanite.recording.channel_names import unit_option

__all__ = ["refuse_open_unit"]

#: Names that say that the samples are the running sum, or increments of it.
_SUMMED = re.compile(r"angle|theta|phase|phi|pos|int|inc|delta|sum|vel|turns|position", re.IGNORECASE)
#: Names that say that they are a rate.
_RATE = re.compile(r"rate|freq|speed|omega|spin", re.IGNORECASE)
#: Units of angle that clocks and shafts are counted in: a number of them may be a phase or a frequency.
_COUNTED = re.compile(r"[mµnu]?(?:cycles?|cyc|turns?|revs?|revolutions?)", re.IGNORECASE)


def refuse_open_unit(heading: Heading) -> None:
    """Ask for the unit where the heading's own may be that of the rate or of its sum.

    Raises
    ------
    InputError
        It names both units.
    """
    try:
        quantity = parse_unit(heading.unit).quantity if heading.unit else None
    except InputError:
        return
    if _SUMMED.search(heading.name):
        return
    rate = heading.group == "gyro" or bool(_RATE.search(heading.name))
    if quantity is QuantityKind.ANGLE and rate:
        raise _question(heading, "a gyro measures a rate", "an angle", "a rate")
    if quantity is QuantityKind.ANGLE and heading.group == "" and _COUNTED.fullmatch(heading.unit):
        raise _question(heading, "the file does not show which of the two it is", "a phase", "a frequency")
    if quantity is QuantityKind.VELOCITY and heading.group == "acc":
        raise _question(heading, "an accelerometer measures an acceleration", "a velocity", "an acceleration")


def _question(heading: Heading, why: str, summed: str, rate: str) -> InputError:
    unit, name = heading.unit, heading.name
    return InputError(
        f"channel {name}: the heading says {unit!r}, {summed}, and {why}. If the samples are {rate}, use "
        f"{unit_option([name], f'{unit}/s')} (unit={{{name!r}: {f'{unit}/s'!r}}} in Python); if they are "
        f"{summed}, {unit_option([name], unit)}"
    )
