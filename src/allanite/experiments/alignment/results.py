# SPDX-License-Identifier: BSD-3-Clause
"""What an alignment says: plain, frozen, serialisable."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.north import Arc
from allanite.noise import NoiseModel
from allanite.plain_files.json_values import plain
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.residual_tests import ResidualTest

__all__ = [
    "AlignmentEstimate",
    "AlignmentPrediction",
    "Bias",
    "CoarseAlignment",
    "LevelledAttitude",
    "Mode",
    "NaiveMean",
    "RunningHeading",
    "Stand",
    "fixed",
]

Array = NDArray[np.float64]
Mode = Literal["static", "positions", "rotation"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelledAttitude:
    """Roll, pitch and heading of the body (forward, right, down) at one time, with their uncertainties.

    Attributes
    ----------
    time : float [s]
        Since the first sample; the middle of the stand that was averaged.
    roll, pitch : float [rad]
    roll_sd, pitch_sd : float [rad]
        Of a pitch near 90 deg the roll is not told from the heading: infinite.
    heading : float [rad]
        From north over east, 0 to below 2 pi; NaN where it was not found.
    heading_sd : float [rad]
        Linear, with everything in the budget; infinite where nothing is known. The interval is not made of it: the
        two agree where the sd is small.
    interval : Arc
        Headings that the record does not contradict; the whole circle where none was found.
    heading_axis : str
        Whose heading it is: "forward", or "down" or "up" where the forward axis is within 10 deg of the vertical.
    """

    time: float
    roll: float
    pitch: float
    roll_sd: float
    pitch_sd: float
    heading: float
    heading_sd: float
    interval: Arc
    heading_axis: str = "forward"


@dataclass(frozen=True, slots=True, kw_only=True)
class Bias:
    """The bias of one gyro axis, in the unit of its channel after its scale (rad/s).

    Attributes
    ----------
    value, sd : float
        After the alignment; NaN and infinity where it cannot be told from the Earth's rotation.
    before : float
        Standard deviation beforehand: by the calibration and its repeatability; infinite where nothing was known.
    separable : bool
        The turns tell it from the Earth: the record, and not what was known beforehand, determines it.
    per_unit : float [rad]
        What one unit more of it would add to the heading at the end if the bias were held at its value.
    """

    value: float
    sd: float
    before: float
    separable: bool
    per_unit: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CoarseAlignment:
    """An answer from two vectors alone: without noise model, without interval.

    Attributes
    ----------
    name : str
        "TRIAD" or "QUEST".
    roll, pitch, heading : float [rad]
        Of the first stand.
    """

    name: str
    roll: float
    pitch: float
    heading: float


@dataclass(frozen=True, slots=True, kw_only=True)
class NaiveMean:
    """What the plain mean over the beginning of the record would have said, whatever happened in it.

    Attributes
    ----------
    duration : float [s]
        How much was averaged: the first 300 s, or all of a shorter record.
    heading : float [rad]
        By TRIAD; NaN where there is no north.
    rate : float [rad/s]
        Length of the mean rate.
    latitude : float [rad]
        From the angle between the means.
    moving : float [s]
        Of it, not at rest.
    flagged : bool
    says : str
        Why; "" where it agrees and nothing moved.
    """

    duration: float
    heading: float
    rate: float
    latitude: float
    moving: float
    flagged: bool
    says: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Stand:
    """A stretch at one attitude.

    Attributes
    ----------
    start, stop : float [s]
    rest : float [s]
        Of it at rest, which was used.
    roll, pitch : float [rad]
    turned : float [rad]
        Azimuth less that of the first stand, by the turns between them.
    residual : ndarray, shape (3,) [rad/s]
        Mean rate of each gyro less what the fit says.
    sd : ndarray, shape (3,) [rad/s]
        Standard deviation of the means by the noise.
    """

    start: float
    stop: float
    rest: float
    roll: float
    pitch: float
    turned: float
    residual: Array
    sd: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class RunningHeading:
    """The heading as the record grows.

    Attributes
    ----------
    time : ndarray, shape (n,) [s]
    heading, sd : ndarray, shape (n,) [rad]
        At the end of the record, from the samples until then; NaN and infinity until it can be told.
    start, width : ndarray, shape (n,) [rad]
        Of the interval at that time: an arc; width 2 pi, the whole circle.
    """

    time: Array
    heading: Array
    sd: Array
    start: Array
    width: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignmentEstimate:
    """Attitude of a unit at rest, or turned from rest to rest, from gravity and the Earth's rotation.

    Attributes
    ----------
    last, first : LevelledAttitude
        At the end of the record and at its beginning.
    verdict : str
        "resolved", "bias not known", "no north", "inconsistent" or "inconsistent with Earth".
    reason : str
    advice : tuple of str
    statement : str
        What the heading contains that the record cannot show; "" where there is nothing of that kind.
    mode : "static", "positions" or "rotation"
        How the unit stood.
    confidence : float
    inflation : float
        1, or the factor by which excess scatter or noise widens everything.
    horizontal : ndarray, shape (2,) [rad/s]
        The Earth's rotation along the heading axis and to the right of it, levelled, at the end. NaN where unseen.
    horizontal_covariance : ndarray, shape (2, 2) [rad^2/s^2]
        Infinite on the diagonal where it cannot be told from the biases.
    horizontal_rate : float [rad/s]
        Its length.
    horizontal_interval : (float, float) [rad/s]
    expected_rate : float [rad/s]
        The Earth's rate times the cosine of the latitude.
    signal_to_noise : float
        Length of the horizontal vector in standard deviations.
    latitude_found : float [rad]
        From the angle between the vertical and the rotation, without the given latitude; NaN where it is not seen.
    latitude_sd : float [rad]
    latitude_interval : (float, float) [rad]
    gravity : float [m/s^2]
        Length of the mean specific force of the first stand; NaN in counts without calibration.
    expected_gravity : float [m/s^2]
        WGS 84, at the latitude and height.
    coarse : tuple of CoarseAlignment
    naive : NaiveMean or None
        None where the unit was turned on purpose, and means say nothing.
    running : RunningHeading
    biases : dict of str to Bias
        By gyro channel.
    budget : dict of str to float [rad]
        Standard uncertainties of the heading at the end by source; "together" is no sum of their squares where the
        parameters of the calibration are correlated.
    checks : tuple of ResidualTest
    stands : tuple of Stand
        Attitudes in the order of time; one in a rotation.
    spans : tuple of (float, float) [s]
        Stretches at rest that were used.
    revolutions : float
        In a rotation; 0 otherwise.
    tilt : float [rad]
        Of the axis of rotation from the vertical; NaN without a rotation.
    latitude, height : float [rad], [m]
    axes : str
        Where x, y and z of the sensor point.
    channels : dict of str to tuple of str
        "gyro" and "accelerometer".
    models : dict of str to NoiseModel
        By channel; those whose noise came from the record are missing.
    calibrated : bool
    calibration_source : str
    duration : float [s]
    source : str
    """

    last: LevelledAttitude
    first: LevelledAttitude
    verdict: str = ""
    reason: str = ""
    advice: tuple[str, ...] = ()
    statement: str = ""
    mode: Mode
    confidence: float
    inflation: float
    horizontal: Array
    horizontal_covariance: Array = field(repr=False)
    horizontal_rate: float
    horizontal_interval: tuple[float, float]
    expected_rate: float
    signal_to_noise: float
    latitude_found: float
    latitude_sd: float
    latitude_interval: tuple[float, float]
    gravity: float
    expected_gravity: float
    coarse: tuple[CoarseAlignment, ...] = field(default=(), repr=False)
    naive: NaiveMean | None = field(default=None, repr=False)
    running: RunningHeading = field(repr=False)
    biases: Mapping[str, Bias] = field(default_factory=dict)
    budget: Mapping[str, float] = field(default_factory=dict)
    checks: tuple[ResidualTest, ...] = ()
    stands: tuple[Stand, ...] = field(default=(), repr=False)
    spans: tuple[tuple[float, float], ...] = field(default=(), repr=False)
    revolutions: float = 0.0
    tilt: float = math.nan
    latitude: float
    height: float
    axes: str
    channels: Mapping[str, tuple[str, ...]]
    models: Mapping[str, NoiseModel] = field(default_factory=dict, repr=False)
    calibrated: bool
    calibration_source: str = ""
    duration: float
    source: str

    @property
    def heading(self) -> float:
        """Heading at the end [rad]; NaN where it was not found."""
        return self.last.heading

    @property
    def heading_sd(self) -> float:
        """Linear standard deviation of the heading at the end [rad]."""
        return self.last.heading_sd

    @property
    def interval(self) -> Arc:
        """Of the heading at the end."""
        return self.last.interval

    @property
    def resolved(self) -> bool:
        """True when the heading is a measurement."""
        return self.verdict == "resolved"

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; numbers that do not exist are null."""
        names = (
            "source", "verdict", "reason", "advice", "statement", "mode", "confidence", "inflation", "horizontal",
            "horizontal_covariance", "horizontal_rate", "horizontal_interval", "expected_rate", "signal_to_noise",
            "latitude_found", "latitude_sd", "latitude_interval", "gravity", "expected_gravity", "coarse", "naive",
            "running", "biases", "budget", "checks", "stands", "spans", "revolutions", "tilt", "latitude", "height",
            "axes", "channels", "calibrated", "calibration_source", "duration",
        )  # fmt: skip
        return {
            "format": "allanite-alignment",
            "version": 1,
            **{name: _attitude_json(getattr(self, name)) for name in ("last", "first")},
            **{name: plain(getattr(self, name)) for name in names},
            "earth_rate": EARTH_RATE,
            "models": {name: model.to_json() for name, model in self.models.items()},
        }


def fixed(values: Array) -> Array:
    """A read-only copy."""
    copy = np.array(values, dtype=np.float64)
    copy.flags.writeable = False
    return copy


def _attitude_json(attitude: LevelledAttitude) -> dict[str, Any]:
    return {**plain(attitude), "interval": attitude.interval.to_json()}


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignmentPrediction:
    """How well an alignment will be known, from covariance alone.

    Attributes
    ----------
    heading_sd : float [rad]
        At the end; infinite where the plan does not tell the biases from the Earth.
    roll_sd, pitch_sd : float [rad]
        At the end.
    budget : dict of str to float [rad]
        Of the heading, by source.
    bias_sds : ndarray, shape (3,) [rad/s]
        Of the gyros, after the alignment; infinite where they cannot be told from the Earth.
    signal_to_noise : float
        Length of the horizontal rate of the Earth in standard deviations.
    resolves : bool
        A heading can be expected.
    duration : float [s]
        Of the plan, turns included.
    """

    heading_sd: float
    roll_sd: float
    pitch_sd: float
    budget: Mapping[str, float]
    bias_sds: Array
    signal_to_noise: float
    resolves: bool
    duration: float

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; infinity is null."""
        return {
            "format": "allanite-alignment-prediction",
            "version": 1,
            **{name: plain(getattr(self, name)) for name in self.__dataclass_fields__},
        }
