# SPDX-License-Identifier: BSD-3-Clause
"""What a measurement of the rate vector says: plain, frozen, serialisable."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.earth_rate.verdict import EarthRateVerdict, NoiseOrigin
from allanite.experiments.rate_vector import words
from allanite.experiments.rate_vector.checks import VectorCheck
from allanite.experiments.rate_vector.verdict import LeftOut, VectorCheckKind, VectorRemark
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.quantity import Quantity
from allanite.quantities.result import Result

__all__ = ["QuietMeans", "RateSpan", "RateVector"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class RateSpan(Result):
    """A part of the record.

    Attributes
    ----------
    start, stop : float [s]
        Since the first sample.
    why : LeftOut or None
        Why it was left out: "moving", "beside a disturbance", "mean is off" (a slow rotation, or a drift of the bias),
        "samples missing", "too short" between two turns, or for a cell at the "end of the record"; None for one that
        was used.
    pose : int
        Attitude of the sensor in a span that was used, counted from 0; -1 in one that was not.
    """

    start: float
    stop: float
    why: LeftOut | None = None
    pose: int = -1

    @property
    def duration(self) -> float:
        """Length [s]."""
        return self.stop - self.start


@dataclass(frozen=True, slots=True, kw_only=True)
class QuietMeans(Result):
    """Means of the quiet cells, neighbors joined where there are many.

    Attributes
    ----------
    time : ndarray, shape (n,) [s]
        Middle of each.
    means : ndarray, shape (3, n) [rad/s]
        By axis.
    joined : int
        Cells in each mean.
    """

    time: Array
    means: Array
    joined: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RateVector(Result):
    """The rotation vector of a sensor at rest, bias and Earth together.

    Attributes
    ----------
    remarks : tuple of VectorRemark
        What is to be known or done, beside the checks that did not pass: "record longer, undisturbed", "record longer",
        "turn the sensor", "turn by half a turn"; "several poses", of which the vector is that of the longest.
    quiet : float [s]
        Time that was used.
    latitude_found : float or None [rad]
        Latitude that the angle to gravity means if the vector is the Earth's.
    earth_rate : float [rad/s]
        The known rate of the Earth.
    verdict : EarthRateVerdict
        "resolved", "not resolved", "inconsistent" or "inconsistent with Earth".
    magnitude : Quantity [rad/s]
        The length of the vector, from all poses, without the part that noise adds to the length of a mean; 0 where that
        is all of it, NaN where nothing is quiet. "not resolved" where it is not seen to differ from zero.
    vector : ndarray, shape (3,) [rad/s]
        In the axes of the sensor, of the longest pose; NaN where nothing is quiet.
    covariance : ndarray, shape (3, 3) [rad^2/s^2]
        Of the vector, by the noise.
    sd : float [rad/s]
        Standard deviation of the length by the noise.
    total_sd : float [rad/s]
        With the stated uncertainties.
    confidence : float
        Of the interval.
    budget : mapping of str to float [rad/s]
        Standard uncertainties of the length by source; 0 where nothing is stated.
    checks : tuple of VectorCheck
        Questions put to the vectors.
    gravity_angle : float or None [rad]
        Between the mean specific force, which points up, and the vector: 90 deg less the latitude for the Earth alone.
        None without accelerometers.
    latitude : float or None [rad]
        As given.
    restlessness : float
        Where nothing is quiet: how many times as much even the quietest stretches move over seconds as over parts of
        one; NaN where too few of them tell, or some are quiet.
    turns : ndarray, shape (n_poses,) [rad]
        How far the sensor had turned from the pose before when each began; zero for the first, NaN where unknown.
    used, left_out : tuple of RateSpan
        Stretches of the record.
    quiet_means : QuietMeans or None
        For the picture; None where nothing is quiet.
    duration : float [s]
        Of the record.
    cell : float [s]
        Length of the cells in which rest was looked for.
    model_source : NoiseOrigin
        "given", or "this record".
    channels : tuple of str
        The three axes.
    source : str
        Of the record.
    """

    FORMAT: ClassVar[str] = "allanite-rate-vector"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("remarks", "quiet", "latitude_found", "earth_rate")

    verdict: EarthRateVerdict = EarthRateVerdict.NOT_RESOLVED
    magnitude: Quantity
    vector: Array
    covariance: Array = field(repr=False)
    sd: float
    total_sd: float
    confidence: float
    budget: Mapping[str, float] = field(default_factory=dict)
    checks: tuple[VectorCheck, ...] = ()
    gravity_angle: float | None = None
    latitude: float | None = None
    restlessness: float = math.nan
    turns: Array = field(repr=False)
    used: tuple[RateSpan, ...] = field(repr=False)
    left_out: tuple[RateSpan, ...] = field(repr=False)
    quiet_means: QuietMeans | None = field(default=None, repr=False)
    duration: float
    cell: float
    model_source: NoiseOrigin
    channels: tuple[str, ...]
    source: str

    @property
    def length(self) -> float:
        """Of the vector [rad/s]; NaN where nothing is quiet."""
        return self.magnitude.value

    @property
    def interval(self) -> tuple[float, float]:
        """Of the length, at `confidence` [rad/s]."""
        return self.magnitude.lower, self.magnitude.upper

    @property
    def statement(self) -> str:
        """What the length contains."""
        return words.STATEMENT

    @property
    def reason(self) -> str:
        """Why the verdict is what it is, in one or two sentences."""
        if math.isnan(self.length):
            if math.isnan(self.restlessness):
                return words.no_rest(self.quiet, self.duration, self.cell)
            return words.all_moves(self.restlessness)
        match self.verdict:
            case EarthRateVerdict.NOT_RESOLVED:
                return words.too_small(self.length, self.total_sd, self.magnitude.upper)
            case EarthRateVerdict.CONTRADICTS:
                return words.excluded(*self.interval)
            case EarthRateVerdict.INCONSISTENT:
                return f"{self.contradictions[0].says}: the sum of bias and Earth is not the Earth's rotation"
        backed = any(c.kind is VectorCheckKind.LATITUDE and c.passed for c in self.checks)
        return words.resolved(self.length, *self.interval, backed=backed)

    @property
    def contradictions(self) -> list[VectorCheck]:
        """Checks by which the vector is not the Earth's alone."""
        return [c for c in self.checks if not c.passed and c.kind is not VectorCheckKind.SIZE]

    @property
    def remarks(self) -> tuple[VectorRemark, ...]:
        """What is to be known or done, beside the checks that did not pass."""
        return tuple(self._remarked())

    def _remarked(self) -> Iterator[VectorRemark]:
        if math.isnan(self.length):
            yield VectorRemark.UNDISTURBED
        elif self.verdict is not EarthRateVerdict.RESOLVED:
            if self.verdict is EarthRateVerdict.NOT_RESOLVED:
                yield VectorRemark.LONGER
            yield VectorRemark.HALF_TURN if self.turned else VectorRemark.TURN
        if self.turned:
            yield VectorRemark.POSES

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do, or to know: what the checks that did not pass say, then the remarks."""
        remarks = {**words.REMARKS, VectorRemark.POSES: words.in_poses(len(self.turns))}
        failed = (c.says for c in self.checks if not c.passed)
        return (*failed, *(remarks[code] for code in self.remarks))

    @property
    def deviation(self) -> float:
        """Distance of the length from the known rate of the Earth, in total standard deviations."""
        return (self.length - EARTH_RATE) / self.total_sd

    @property
    def earth_rate(self) -> float:
        """The known rate of the Earth [rad/s]."""
        return EARTH_RATE

    @property
    def resolved(self) -> bool:
        """True when the length may be the Earth's rotation."""
        return self.verdict is EarthRateVerdict.RESOLVED

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

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.experiments.rate_vector.version_1 import upgraded

        return upgraded(data) if data.get("version") == 1 else data
