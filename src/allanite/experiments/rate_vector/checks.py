# SPDX-License-Identifier: BSD-3-Clause
"""Questions put to the vectors: one length in all poses, the angle to gravity."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_vector.vectors import Vectors
from allanite.quantities.distributions import chi_square_tail
from allanite.quantities.residual_tests import ResidualTest
from allanite.quantities.setup_uncertainty import SetupUncertainty

__all__ = ["angle_between", "latitude_check", "pose_check"]

Array = NDArray[np.float64]

#: A check fails at this probability.
ALARM = 0.01


def pose_check(vectors: Vectors) -> list[ResidualTest]:
    """Is the length the same in all poses? A bias makes it differ."""
    if len(vectors.share) < 2 or vectors.bent:
        return []
    u = vectors.directions
    covariance = np.einsum("ia,aij,ja->ij", u, vectors.covariance, u)
    noise = np.einsum("aii->i", vectors.covariance)
    lengths = np.sqrt(np.maximum((vectors.level**2).sum(axis=1) - noise, 0.0))
    contrast = np.diff(np.eye(len(lengths)), axis=0)
    apart = contrast @ lengths
    statistic = float(apart @ np.linalg.solve(contrast @ covariance @ contrast.T, apart))
    p = chi_square_tail(statistic, len(apart))
    return [
        ResidualTest(
            name="length in each pose",
            statistic=statistic,
            dof=len(apart),
            p=p,
            passed=p >= ALARM,
            says="the length is not the same before and after the sensor was turned, so biases are in it",
        )
    ]


def angle_between(a: Array, b: Array) -> float:
    """Between two vectors, without loss near 0 and 180 deg."""
    return math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))


def latitude_check(
    vectors: Vectors, gravity: Array, latitude: float, stated: SetupUncertainty
) -> ResidualTest:
    """The Earth alone lies 90 deg less the latitude from the vertical."""
    up = gravity / np.linalg.norm(gravity)
    along = vectors.directions[vectors.longest]
    across = up - (up @ along) * along
    size = float(np.linalg.norm(across))
    noise = vectors.covariance_of(vectors.longest)
    variance = float(across @ noise @ across) / size**2 if size > 0 else float(np.diag(noise).max())
    # the angle turns with the part of the vector across, and by the accelerometers
    variance = variance / max(vectors.length, vectors.sd) ** 2 + stated.latitude**2 + stated.tilt**2
    measured_latitude = math.pi / 2 - angle_between(gravity, along)
    statistic = (measured_latitude - latitude) ** 2 / (variance * vectors.stretch**2)
    p = chi_square_tail(statistic, 1)
    return ResidualTest(
        name="latitude",
        statistic=statistic,
        dof=1,
        p=p,
        passed=p >= ALARM,
        says=f"the angle between gravity and the vector means a latitude of {math.degrees(measured_latitude):.2f} "
        f"deg, not {math.degrees(latitude):.2f}",
    )
