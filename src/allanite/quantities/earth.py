# SPDX-License-Identifier: BSD-3-Clause
"""The Earth as a reference of rotation and of gravity. Every constant with its source.

References
----------
.. [1] IERS Conventions (2010), IERS Technical Note 36, section 5.4.4, eq. 5.15 (Earth rotation angle).
.. [2] N. Capitaine, B. Guinot, D. McCarthy, "Definition of the celestial ephemeris origin and of UT1 in the
   international celestial reference frame", A&A 355 (2000) 398.
.. [3] "Department of Defense World Geodetic System 1984", NGA.STND.0036_1.0.0_WGS84 (2014), section 4.1 (normal
   gravity on the ellipsoid, eq. 4-1; above it, eq. 4-3) and table 3.1, 3.6.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError

__all__ = [
    "DEG_H",
    "EARTH_RATE",
    "checked_latitude",
    "earth_rate_vector",
    "earth_rotation_angle",
    "normal_gravity",
]

#: Turns of the Earth per day of UT1, less one [1, eq. 5.15].
EXTRA_TURNS_PER_DAY = 0.00273781191135448
#: Sidereal rotation rate of the Earth [rad/s] that follows from it: 15.04106717867032 deg/h, not 15.
EARTH_RATE = 2 * math.pi * (1 + EXTRA_TURNS_PER_DAY) / 86400.0

#: One degree per hour [rad/s].
DEG_H = math.pi / 180 / 3600
#: A horizontal axis sees the Earth by the cosine of the latitude: nothing from here to the pole [rad]. A vertical one
#: sees it by the sine: nothing from the equator to here.
POLE, EQUATOR = math.radians(89.999), math.radians(0.001)

#: Ellipsoid of WGS 84 [3, tables 3.1 and 3.6]: semi-major axis [m], flattening, first eccentricity squared, normal
#: gravity at the equator [m/s^2], k and m of the formulas.
SEMI_MAJOR, FLATTENING, ECCENTRICITY2 = 6378137.0, 1 / 298.257223563, 6.694379990141e-3
GRAVITY_EQUATOR, GRAVITY_K, GRAVITY_M = 9.7803253359, 1.931852652458e-3, 3.449786506841e-3
#: Heights for which the formula is good to 1e-6 m/s^2 [m].
HEIGHTS = (-11_000.0, 20_000.0)

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


def checked_latitude(latitude: float, *, vertical: bool = False) -> float:
    """A latitude [rad] at which a horizontal axis, or a vertical one, sees something of the Earth's rotation.

    Raises
    ------
    InputError
        Not a number, beyond 90 deg; at a pole, or at the equator for a vertical axis.
    """
    size = abs(latitude)
    low, high = (EQUATOR, math.pi / 2 * (1 + 1e-12)) if vertical else (-1.0, POLE)
    if not low < size < high:
        why = (
            "a vertical axis senses the Earth's rotation times the sine of the latitude, zero at the "
            "equator: turn a level axis there"
            if vertical
            else "a horizontal axis senses the Earth's rotation times the cosine of the latitude, zero at a pole"
        )
        beyond = "" if size <= math.pi / 2 else "; in Python the latitude is in radians"
        raise InputError(f"undefined at latitude {math.degrees(latitude):g} deg: {why}{beyond}")
    return float(latitude)


def earth_rate_vector(latitude: float) -> NDArray[np.float64]:
    """Rotation of the Earth in north, east, down, shape (3,) [rad/s]; latitude [rad]."""
    return EARTH_RATE * np.array([math.cos(latitude), 0.0, -math.sin(latitude)])


def normal_gravity(latitude: float, height: float = 0.0) -> float:
    """Gravity of the WGS 84 ellipsoid, with the centrifugal part [m/s^2].

    Parameters
    ----------
    latitude : float [rad]
        Geodetic.
    height : float [m]
        Above the ellipsoid.

    Notes
    -----
    Somigliana's formula [3, eq. 4-1] and its series in the height [3, eq. 4-3]. Gravity itself differs from it by
    up to some 1e-3 m/s^2 from place to place (usually 3e-4).

    Raises
    ------
    InputError
        Beyond a pole, or a height outside -11 to 20 km.
    """
    if not (math.isfinite(latitude) and abs(latitude) <= math.pi / 2):
        raise InputError(f"latitude {latitude!r}: it must be from -pi/2 to pi/2; in Python it is in radians")
    if not HEIGHTS[0] <= height <= HEIGHTS[1]:
        raise InputError(f"height {height!r}: gravity is defined from -11000 to 20000 m above the ellipsoid")
    s2 = math.sin(latitude) ** 2
    surface = GRAVITY_EQUATOR * (1 + GRAVITY_K * s2) / math.sqrt(1 - ECCENTRICITY2 * s2)
    part = height / SEMI_MAJOR
    return surface * (1 - 2 * (1 + FLATTENING + GRAVITY_M - 2 * FLATTENING * s2) * part + 3 * part**2)
