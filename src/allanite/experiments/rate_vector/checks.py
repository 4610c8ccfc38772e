# SPDX-License-Identifier: BSD-3-Clause
"""Questions put to the vectors: the size of the noise, one length in all poses, the angle to gravity."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_vector.vectors import Vectors
from allanite.experiments.rate_vector.verdict import VectorCheckKind
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_tail
from allanite.quantities.residual_tests import CheckResult
from allanite.quantities.setup_uncertainty import SetupUncertainty

__all__ = ["VectorCheck", "angle_between", "latitude_check", "pose_check", "size_checks"]

Array = NDArray[np.float64]

#: A check fails at this probability.
ALARM = 0.01
#: A level part of so many standard deviations has a direction that noise does not choose.
CLEAR = 6.0


@dataclass(frozen=True, slots=True, kw_only=True)
class VectorCheck(CheckResult):
    """One question put to the vectors.

    Attributes
    ----------
    kind : VectorCheckKind
        "size" of the noise of an axis, "length in each pose", "latitude".
    channel : str
        Of the size of the noise; else "".
    latitude, expected : float [rad]
        Of the latitude: what gravity and the vector mean, and what was given; NaN of the others.
    """

    kind: VectorCheckKind
    channel: str = ""
    latitude: float = math.nan
    expected: float = math.nan

    @property
    def name(self) -> str:
        """What was asked."""
        return f"size of the noise, {self.channel}" if self.kind is VectorCheckKind.SIZE else self.kind

    @property
    def says(self) -> str:
        """What it means, when it did not pass."""
        match self.kind:
            case VectorCheckKind.SIZE:
                return (
                    f"the quiet stretches of {self.channel} scatter {self.ratio:.2f} times as much as the model "
                    "predicts: the interval comes from their own noise"
                )
            case VectorCheckKind.POSES:
                return "the magnitude is not the same before and after the sensor was turned, so biases are in it"
            case VectorCheckKind.LATITUDE:
                means, not_ = (math.degrees(x) for x in (self.latitude, self.expected))
                return f"the angle between gravity and the vector means a latitude of {means:.2f} deg, not {not_:.2f}"


def size_checks(tests: Iterable[tuple[str, CheckResult]]) -> list[VectorCheck]:
    """Those of the axes by their channels."""
    return [VectorCheck.of(VectorCheckKind.SIZE, test, channel=name) for name, test in tests]


def pose_check(vectors: Vectors) -> list[VectorCheck]:
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
    return [_asked(VectorCheckKind.POSES, statistic, len(apart))]


def angle_between(a: Array, b: Array) -> float:
    """Between two vectors, without loss near 0 and 180 deg."""
    return math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))


def latitude_check(
    vectors: Vectors, gravity: Array, latitude: float, stated: SetupUncertainty, bias: float
) -> VectorCheck:
    """The Earth alone lies 90 deg less the latitude from the vertical.

    Asked of the distance of the vector from that direction, which is normal at every signal to noise; the angle is not.

    Parameters
    ----------
    bias : float [rad/s]
        Standard uncertainty of the bias of each axis, which is part of the vector.
    """
    up = gravity / np.linalg.norm(gravity)
    rate = vectors.level[vectors.longest]
    level = rate - (rate @ up) * up
    size = float(np.linalg.norm(level))
    level = level / size if size > 0 else np.linalg.svd(up[None])[2][1]
    across = math.sin(latitude) * level - math.cos(latitude) * up
    covariance = vectors.covariance_of(vectors.longest) * vectors.stretch**2 + bias**2 * np.eye(3)
    turned = float(rate @ rate) * (stated.latitude**2 + stated.tilt**2)
    statistic = float(across @ rate) ** 2 / (float(across @ covariance @ across) + turned)
    # at a pole noise moves the vector away from the vertical in two directions
    dof = 1 if size > CLEAR * math.sqrt(float(level @ covariance @ level)) else 2
    measured_latitude = math.pi / 2 - angle_between(gravity, rate)
    return _asked(VectorCheckKind.LATITUDE, statistic, dof, latitude=measured_latitude, expected=latitude)


def _asked(
    kind: VectorCheckKind, statistic: float, dof: int, latitude: float = math.nan, expected: float = math.nan
) -> VectorCheck:
    p = chi_square_tail(statistic, dof)
    return VectorCheck(
        kind=kind,
        statistic=statistic,
        dof=dof,
        p=p,
        passed=p >= ALARM,
        latitude=latitude,
        expected=expected,
    )
