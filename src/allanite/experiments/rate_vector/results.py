# SPDX-License-Identifier: BSD-3-Clause
"""What a measurement of the rate vector says: plain, frozen, serialisable."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.plain_files.json_values import plain
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.residual_tests import ResidualTest

__all__ = ["RateSpan", "RateVector"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class RateSpan:
    """A part of the record.

    Attributes
    ----------
    start, stop : float [s]
        Since the first sample.
    why : str
        Why it was left out; "" for one that was used.
    pose : int
        Attitude of the sensor in a span that was used, counted from 0; -1 in one that was not.
    """

    start: float
    stop: float
    why: str = ""
    pose: int = -1

    @property
    def duration(self) -> float:
        """Length [s]."""
        return self.stop - self.start


@dataclass(frozen=True, slots=True, kw_only=True)
class RateVector:
    """The rotation vector of a sensor at rest, bias and Earth together.

    Attributes
    ----------
    vector : ndarray, shape (3,) [rad/s]
        In the axes of the sensor, of the longest pose; NaN where nothing is quiet.
    covariance : ndarray, shape (3, 3) [rad^2/s^2]
        Of the vector, by the noise.
    length : float [rad/s]
        From all poses, without the part that noise adds to the length of a mean; 0 where that is all of it.
    sd : float [rad/s]
        Standard deviation of the length by the noise.
    total_sd : float [rad/s]
        With the stated uncertainties.
    interval : (float, float) [rad/s]
        For the length, at `confidence`.
    confidence : float
    verdict : str
        "resolved", "not resolved", "inconsistent" or "inconsistent with Earth".
    reason : str
        One or two sentences.
    advice : tuple of str
    statement : str
        What the length contains.
    budget : dict of str to float [rad/s]
        Standard uncertainties of the length by source.
    checks : tuple of ResidualTest
    gravity_angle : float or None [rad]
        Between the mean specific force, which points up, and the vector: 90 deg less the latitude for the Earth alone.
        None without accelerometers.
    latitude : float or None [rad]
        As given.
    turns : ndarray, shape (n_poses,) [rad]
        How far the sensor had turned from the pose before when each began; zero for the first, NaN where unknown.
    used, left_out : tuple of RateSpan
        Stretches of the record.
    duration : float [s]
        Of the record.
    cell : float [s]
        Length of the cells in which rest was looked for.
    model_source : str
        "given", or "this record".
    channels : tuple of str
    source : str
    """

    vector: Array
    covariance: Array = field(repr=False)
    length: float
    sd: float
    total_sd: float
    interval: tuple[float, float]
    confidence: float
    verdict: str = ""
    reason: str = ""
    advice: tuple[str, ...] = ()
    statement: str = field(repr=False)
    budget: dict[str, float] = field(default_factory=dict)
    checks: tuple[ResidualTest, ...] = ()
    gravity_angle: float | None = None
    latitude: float | None = None
    turns: Array = field(repr=False)
    used: tuple[RateSpan, ...] = field(repr=False)
    left_out: tuple[RateSpan, ...] = field(repr=False)
    duration: float
    cell: float
    model_source: str
    channels: tuple[str, ...]
    source: str

    @property
    def deviation(self) -> float:
        """Distance of the length from the known rate of the Earth, in total standard deviations."""
        return (self.length - EARTH_RATE) / self.total_sd

    @property
    def resolved(self) -> bool:
        """True when the length may be the Earth's rotation."""
        return self.verdict == "resolved"

    @property
    def turned(self) -> bool:
        """True when the sensor was turned, so that the vector is that of one pose only."""
        return len(self.turns) > 1

    @property
    def quiet(self) -> float:
        """Time that was used [s]."""
        return sum(s.duration for s in self.used)

    @property
    def share(self) -> float:
        """Part of the record that was used, 0 to 1."""
        return self.quiet / self.duration

    @property
    def latitude_found(self) -> float | None:
        """Latitude that the angle to gravity means if the vector is the Earth's [rad]."""
        return None if self.gravity_angle is None else math.pi / 2 - self.gravity_angle

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; numbers that do not exist are null."""
        return {
            "format": "allanite-rate-vector",
            "version": 1,
            **{
                name: plain(getattr(self, name))
                for name in (
                    "source", "channels", "verdict", "reason", "advice", "statement", "vector", "covariance", "length",
                    "sd", "total_sd", "interval", "confidence", "budget", "checks", "gravity_angle", "latitude_found",
                    "latitude", "turns", "used", "left_out", "quiet", "duration", "cell", "model_source",
                )
            },
            "earth_rate": EARTH_RATE,
        }  # fmt: skip
