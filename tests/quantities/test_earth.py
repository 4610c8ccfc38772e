# SPDX-License-Identifier: BSD-3-Clause
"""Earth rotation and gravity against published values."""

import math

import numpy as np
import pytest

from allanite.errors import InputError
from allanite.quantities.earth import EARTH_RATE, earth_rate_vector, earth_rotation_angle, normal_gravity


def test_r9_earth_rotation_angle_published_value() -> None:
    assert abs(earth_rotation_angle(2400000.5, 54388.0) - 0.4022837240028158102) < 1e-12


def test_r9_earth_rate_is_sidereal_never_fifteen() -> None:
    rate_deg_h = math.degrees(EARTH_RATE) * 3600
    assert abs(rate_deg_h / 15.04106717867032 - 1) < 1e-12
    assert abs(15.0 / rate_deg_h - 1 + 0.0027303) < 1e-6


def test_angle_grows_by_the_rate() -> None:
    day = (earth_rotation_angle(2451545.0, 1.0) - earth_rotation_angle(2451545.0)) % (2 * math.pi)
    assert abs(day - (EARTH_RATE * 86400 - 2 * math.pi)) < 1e-12


# -- gravity ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("degrees", "g"), [(0, 9.7803253359), (45, 9.8061977694), (90, 9.8321849379)])
def test_normal_gravity_published_values(degrees: float, g: float) -> None:
    """WGS 84: equator and poles from the defining constants, 45 deg by Somigliana's formula; to the last digit."""
    for sign in (1, -1):
        assert normal_gravity(sign * math.radians(degrees)) == pytest.approx(g, abs=6e-11)


def test_normal_gravity_falls_with_height() -> None:
    """By the free-air gradient of geodesy, 0.30877 (1 - 0.00142 sin^2) mGal/m less 0.072 mGal/km^2."""
    for latitude, h in ((0.0, 1000.0), (0.7, -300.0), (math.pi / 2, 9000.0)):
        fall = 3.0877e-6 * (1 - 0.00142 * math.sin(latitude) ** 2) * h - 0.72e-12 * h**2
        assert normal_gravity(latitude) - normal_gravity(latitude, h) == pytest.approx(fall, rel=2e-4)


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ((45.0, 0.0), "radians"),
        ((math.nan, 0.0), "radians"),
        ((0.5, 3e4), "20000 m"),
        ((0.5, math.nan), "height"),
    ],
)
def test_b11_places_without_gravity_are_refused(place: tuple[float, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        normal_gravity(*place)


@pytest.mark.parametrize("degrees", [-90, -23.31, 0, 45, 90])
def test_earth_rate_vector(degrees: float) -> None:
    latitude = math.radians(degrees)
    vector = earth_rate_vector(latitude)
    assert np.linalg.norm(vector) == pytest.approx(EARTH_RATE, rel=1e-15)
    # In the north the Earth turns about an axis that points up, in the south down.
    assert vector[2] == pytest.approx(-EARTH_RATE * math.sin(latitude), rel=1e-15)
    assert vector[0] >= 0 and vector[1] == 0
