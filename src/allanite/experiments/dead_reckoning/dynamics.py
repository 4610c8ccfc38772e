# SPDX-License-Identifier: BSD-3-Clause
"""The linear error model of an inertial navigator that stands level at rest on the Earth, north, east, down.

Notes
-----
Let phi be the small rotation by which the computed attitude is off, C' = (I - phi x) C, and e, a the errors of gyros
and accelerometers along north, east and down. Then [1, section 12.3]

    phi' = -w_ie x phi + dw_in - e
    dv'  = f x phi + a - 2 w_ie x dv + dg                                                                  (1)
    dr'  = dv

with f = (0, 0, -g), the rate of the navigation frame dw_in that wrong latitude and velocity make,

    dw_in = (-Omega sin L dL + dv_E/N,  -dv_N/M,  -Omega cos L dL - tan L dv_E/N),   dL = dr_N/M,

M and N being the radii of curvature of the ellipsoid in the meridian and across it, and the normal gravity of a wrong
place, dg_D = (dg/dL) dL - (dg/dh) dr_D. Nothing else is of first order where the velocity is zero; Schuler's
oscillation, Foucault's and that of 24 h are in (1), and so is the height, which runs away as exp(sqrt(-dg/dh) t).
Errors beyond `results.LINEAR` are not those of (1).

References
----------
.. [1] D. H. Titterton, J. L. Weston, "Strapdown Inertial Navigation Technology", 2nd ed., IET (2004), chapter 12.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.quantities.earth import (
    ECCENTRICITY2,
    SEMI_MAJOR,
    checked_latitude,
    earth_rate_vector,
    normal_gravity,
)

__all__ = ["ATTITUDE", "HEIGHT", "NAVIGATION", "POSITION", "VELOCITY", "crossing", "error_dynamics", "radii"]

Array = NDArray[np.float64]

#: Rows of the state: position [m], velocity [m/s], attitude [rad], each north, east, down.
POSITION, VELOCITY, ATTITUDE = slice(0, 3), slice(3, 6), slice(6, 9)
NAVIGATION = 9
#: Those of the vertical channel.
HEIGHT = [2, 5]
#: Step of the differences that give the gradients of normal gravity [rad], [m]: its formula is smooth.
_STEP_LATITUDE, _STEP_HEIGHT = 1e-4, 100.0


def crossing(vector: Array) -> Array:
    """The matrix of a cross product, vector x, shape (3, 3)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def radii(latitude: float) -> tuple[float, float]:
    """Radii of curvature of the ellipsoid [m]: in the meridian, and across it."""
    root = math.sqrt(1 - ECCENTRICITY2 * math.sin(latitude) ** 2)
    return SEMI_MAJOR * (1 - ECCENTRICITY2) / root**3, SEMI_MAJOR / root


def error_dynamics(latitude: float, *, held: bool = False) -> Array:
    """A of x' = A x: eq. (1), shape (9, 9); latitude [rad], on the ellipsoid.

    With `held` something else holds the height, and neither it nor the vertical velocity is ever wrong.

    Raises
    ------
    InputError
        At a pole, where there is no heading.
    """
    checked_latitude(latitude)
    meridian, across = radii(latitude)
    earth, gravity = earth_rate_vector(latitude), normal_gravity(latitude)
    a = np.zeros((NAVIGATION, NAVIGATION))
    a[POSITION, VELOCITY] = np.eye(3)
    a[VELOCITY, VELOCITY] = -2 * crossing(earth)
    a[VELOCITY, ATTITUDE] = crossing(np.array([0.0, 0.0, -gravity]))
    a[5, 0] = _by_latitude(latitude) / meridian
    a[5, 2] = -_by_height(latitude)
    a[ATTITUDE, ATTITUDE] = -crossing(earth)
    a[6, 0], a[8, 0] = earth[2] / meridian, -earth[0] / meridian
    a[6, 4], a[7, 3], a[8, 4] = 1 / across, -1 / meridian, -math.tan(latitude) / across
    if held:
        a[HEIGHT, :] = a[:, HEIGHT] = 0.0
    return a


def _by_latitude(latitude: float) -> float:
    """Of normal gravity [m/s^2/rad]; even about a pole."""
    ends = [normal_gravity(_folded(latitude + s * _STEP_LATITUDE)) for s in (1, -1)]
    return (ends[0] - ends[1]) / (2 * _STEP_LATITUDE)


def _folded(latitude: float) -> float:
    return math.copysign(min(abs(latitude), math.pi - abs(latitude)), latitude)


def _by_height(latitude: float) -> float:
    """Of normal gravity [1/s^2]: negative."""
    ends = [normal_gravity(latitude, s * _STEP_HEIGHT) for s in (1, -1)]
    return (ends[0] - ends[1]) / (2 * _STEP_HEIGHT)
