# SPDX-License-Identifier: BSD-3-Clause
"""Earth rotation against published values."""

import math

from allanite.earth import EARTH_RATE, earth_rotation_angle


def test_r9_earth_rotation_angle_published_value() -> None:
    assert abs(earth_rotation_angle(2400000.5, 54388.0) - 0.4022837240028158102) < 1e-12


def test_r9_earth_rate_is_sidereal_never_fifteen() -> None:
    rate_deg_h = math.degrees(EARTH_RATE) * 3600
    assert abs(rate_deg_h / 15.04106717867032 - 1) < 1e-12
    assert abs(15.0 / rate_deg_h - 1 + 0.0027303) < 1e-6


def test_angle_grows_by_the_rate() -> None:
    day = (earth_rotation_angle(2451545.0, 1.0) - earth_rotation_angle(2451545.0)) % (2 * math.pi)
    assert abs(day - (EARTH_RATE * 86400 - 2 * math.pi)) < 1e-12
