# SPDX-License-Identifier: BSD-3-Clause
"""The latitude by the angle between gravity and the Earth's rotation, with a set that holds at every signal to noise.

The rotation is a vector of three noisy numbers, two level and one vertical. Attitudes that differ by turns about the
vertical alone hardly tell the vertical one from the bias of a gyro: its standard deviation then is thousands of degrees
per hour, and the angle, an arctangent, has no slope there. So the latitudes are those of all directions, in the plane
of the vertical and the measured horizontal rate, that the vector may have (`direction_set`). The measured length of the
horizontal rate is never below zero: near the poles noise lengthens it, which is taken off, and a length that may be
zero leaves the pole in the set.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.alignment.results import UNSEEN_LATITUDE, largest_sd
from allanite.experiments.north.circle import direction_set, length_interval
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.quantity import Quantity
from allanite.quantities.residual_tests import SEEN

__all__ = ["latitude_distance", "measured_latitude"]

Array = NDArray[np.float64]

#: Part of a rate that float64 does not hold: a covariance of less is none.
ROUNDING = 1e-14


def measured_latitude(rate: Array, covariance: Array, confidence: float) -> tuple[Quantity, float]:
    """The latitude and its linear standard deviation [rad].

    Not resolved, with an infinite standard deviation, unless the rate of the Earth would be seen in every direction:
    that depends on sensors and attitudes, not on how the noise fell.

    Parameters
    ----------
    rate : ndarray, shape (3,) [rad/s]
        Two level components, then the one downwards.
    covariance : ndarray, shape (3, 3)
    confidence : float
    """
    if not (np.isfinite(covariance).all() and EARTH_RATE >= SEEN * largest_sd(covariance)):
        return UNSEEN_LATITUDE, math.inf
    plane, noise = _in_plane(rate, covariance)
    latitude = math.atan2(plane[1], plane[0])
    turned = np.array([-math.sin(latitude), math.cos(latitude)]) / math.hypot(*plane)
    sd = math.sqrt(float(turned @ noise @ turned))
    return Quantity.of(latitude, _ends(rate, covariance, confidence), "rad"), sd


def latitude_distance(rate: Array, covariance: Array, latitude: float, latitude_sd: float) -> float:
    """Chi-square with one degree of freedom, of the vector's distance from the direction that a latitude means."""
    plane, noise = _in_plane(rate, covariance)
    across = np.array([-math.sin(latitude), math.cos(latitude)])
    variance = float(across @ noise @ across) + (EARTH_RATE * latitude_sd) ** 2
    return float(across @ plane) ** 2 / variance


def _in_plane(rate: Array, covariance: Array) -> tuple[Array, Array]:
    """Length of the level part and the part upwards, and their covariance."""
    level, length = rate[:2], float(np.hypot(*rate[:2]))
    along = level / length if length > 0 else np.array([1.0, 0.0])
    basis = np.array([[*along, 0.0], [0.0, 0.0, -1.0]])
    rounding = (ROUNDING * max(float(np.linalg.norm(rate)), EARTH_RATE)) ** 2
    return basis @ rate, basis @ covariance @ basis.T + rounding * np.eye(2)


def _ends(rate: Array, covariance: Array, confidence: float) -> tuple[float, float]:
    """Lowest and highest latitude that the rate does not contradict."""
    plane, noise = _in_plane(rate, covariance)
    length, sd = float(plane[0]), math.sqrt(float(noise[0, 0]))
    worst = max(largest_sd(covariance[:2, :2]), sd)
    shortest = worst * length_interval(length / worst, confidence)[0]
    if shortest > 0:  # noise across makes it longer on the average
        across = max(float(np.trace(covariance[:2, :2])) - sd**2, 0.0)
        plane = np.array([max(length - across / (2 * length), shortest), plane[1]])
    arc = direction_set(plane, noise, confidence)
    half = math.pi / 2
    if arc.full:
        return -half, half
    low = math.remainder(arc.start, math.tau)
    low, high = max(low, -half), min(low + arc.width, half)
    if shortest > 0:
        return low, high
    return (low, half) if plane[1] > 0 else (-half, high)
