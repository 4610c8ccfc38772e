# SPDX-License-Identifier: BSD-3-Clause
"""The Earth as a reference of rotation. Every constant with its source.

References
----------
.. [1] IERS Conventions (2010), IERS Technical Note 36, section 5.4.4, eq. 5.15 (Earth rotation angle).
.. [2] N. Capitaine, B. Guinot, D. McCarthy, "Definition of the celestial ephemeris origin and of UT1 in the
   international celestial reference frame", A&A 355 (2000) 398.
"""

from __future__ import annotations

import math

from allanite.errors import InputError

__all__ = ["DEG_H", "EARTH_RATE", "checked_latitude", "earth_rotation_angle"]

#: Turns of the Earth per day of UT1, less one [1, eq. 5.15].
EXTRA_TURNS_PER_DAY = 0.00273781191135448
#: Sidereal rotation rate of the Earth [rad/s] that follows from it: 15.04106717867032 deg/h, not 15.
EARTH_RATE = 2 * math.pi * (1 + EXTRA_TURNS_PER_DAY) / 86400.0

#: One degree per hour [rad/s].
DEG_H = math.pi / 180 / 3600
#: A horizontal axis sees the Earth by the cosine of the latitude: nothing from here to the pole [rad].
POLE = math.radians(89.999)

_AT_J2000 = 0.7790572732640
_J2000 = 2451545.0


def earth_rotation_angle(jd1: float, jd2: float = 0.0) -> float:
    """Earth rotation angle [rad], 0 to 2 pi.

    Parameters
    ----------
    jd1, jd2 : float [day]
        UT1 as a Julian date in two parts, which keeps its digits: for example 2400000.5 and the modified Julian date.

    Notes
    -----
    theta = 2 pi (0.7790572732640 + 1.00273781191135448 Tu), Tu = JD(UT1) - 2451545.0 [1, eq. 5.15]; whole days are
    taken out before the multiplication.
    """
    high, low = max(jd1, jd2), min(jd1, jd2)
    days = low + (high - _J2000)
    part = math.fmod(high, 1.0) + math.fmod(low, 1.0)
    turns = part + _AT_J2000 + EXTRA_TURNS_PER_DAY * days + 1.0
    return 2 * math.pi * (turns % 1.0)


def checked_latitude(latitude: float) -> float:
    """A latitude [rad] at which a horizontal axis sees something of the Earth's rotation.

    Raises
    ------
    InputError
        Not a number, beyond 90 deg, or at a pole.
    """
    if not (math.isfinite(latitude) and abs(latitude) < POLE):
        raise InputError(
            f"undefined at latitude {math.degrees(latitude):g} deg: a horizontal axis sees the Earth by the cosine of "
            "the latitude, nothing at a pole; from Python the latitude is in radians"
        )
    return float(latitude)
