# SPDX-License-Identifier: BSD-3-Clause
"""What an alignment says: plain, frozen, serialisable."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.alignment import words
from allanite.experiments.alignment.checks import AlignmentCheck
from allanite.experiments.alignment.verdict import (
    AlignmentCheckKind,
    AlignmentRemark,
    AlignmentVerdict,
    NoNorth,
)
from allanite.experiments.north import Arc
from allanite.experiments.reversals import PositionsApart
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.distributions import normal_quantile
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.quantities.residual_tests import SEEN, grave
from allanite.quantities.result import Result

__all__ = [
    "UNSEEN_LATITUDE",
    "AlignmentEstimate",
    "AlignmentPrediction",
    "Bias",
    "CoarseAlignment",
    "LevelledAttitude",
    "Mode",
    "NaiveMean",
    "OtherChannels",
    "RunningHeading",
    "Stand",
    "fixed",
    "largest_sd",
]

Array = NDArray[np.float64]
Mode = Literal["static", "positions", "rotation"]

UNSEEN_LATITUDE = Quantity(
    value=math.nan,
    lower=-math.pi / 2,
    upper=math.pi / 2,
    unit="rad",
    status=QuantityStatus.NOT_RESOLVED,
)
"""Where the angle between the vertical and the rotation is not seen."""

#: What one attitude shows beyond this may be a slow, even rotation [rad/s].
SLOW_TURN = math.radians(0.1)
#: Cosine between the downwards of the unit and the true one: below, it lies on its back.
UPSIDE_DOWN = -0.7
#: Motion within the plain mean that is no matter [s].
MOVED = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelledAttitude(Result):
    """Roll, pitch and heading of the body (forward, right, down) at one time, with their uncertainties.

    Attributes
    ----------
    time : float [s]
        Since the first sample; the middle of the stand that was averaged.
    roll, pitch : float [rad]
        Of the body.
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
class Bias(Result):
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
    by_latitude : bool
        The given latitude tells it from the Earth's vertical rate: without the latitude it is much less certain.
    vertical : float
        What the axis shows of the vertical rate that the latitude means, mean of the attitudes; NaN where an early
        document does not have it.
    """

    value: float
    sd: float
    before: float
    separable: bool
    per_unit: float
    by_latitude: bool = False
    vertical: float = math.nan

    def mirrored(self, size: float) -> bool:
        """Is it minus twice the vertical rate, to within the `size` of a bias here, and far from none at all?

        The latitude of the other hemisphere makes that of a bias of zero, and so does an inverted axis.
        """
        return self.by_latitude and abs(self.value + 2 * self.vertical) <= size < abs(self.value) / SEEN


@dataclass(frozen=True, slots=True, kw_only=True)
class CoarseAlignment(Result):
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
class NaiveMean(Result):
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
    away : float [rad]
        From the heading by the stretches at rest, where it lies outside of their interval; else NaN.
    flagged : bool
        Not to be used: the unit moved, or the heading lies outside.
    """

    duration: float
    heading: float
    rate: float
    latitude: float
    moving: float
    away: float
    flagged: bool

    @property
    def says(self) -> str:
        """Why it is not to be used; "" where it agrees and nothing moved."""
        reasons = [words.naive_moved(self.moving, self.duration)] if self.moving > MOVED else []
        if not math.isnan(self.away + self.heading):
            reasons.append(words.naive_points_elsewhere(self.heading, self.away))
        return "; ".join(reasons)


@dataclass(frozen=True, slots=True, kw_only=True)
class OtherChannels(Result):
    """A triad whose channels are not those of the calibration.

    Attributes
    ----------
    calibrated, taken : tuple of str
        Its channels in the calibration, and in the record, in the same order.
    """

    calibrated: tuple[str, ...]
    taken: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stand(Result):
    """A stretch at one attitude.

    Attributes
    ----------
    start, stop : float [s]
        Since the first sample.
    rest : float [s]
        Of it at rest, which was used.
    roll, pitch : float [rad]
        Of the body.
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
class RunningHeading(Result):
    """The heading as the record grows.

    Attributes
    ----------
    time : ndarray, shape (n,) [s]
        Since the first sample.
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
class AlignmentEstimate(Result):
    """Attitude of a unit at rest, or turned from rest to rest, from gravity and the Earth's rotation.

    Attributes
    ----------
    remarks : tuple of AlignmentRemark
        What is to be known or done, beside the checks that did not pass: "turn the unit", "calibrate the biases",
        "state the rotation", "rest longer and warm up", "record for longer", "turn faster", "question latitude and
        gyros", "state the biases"; "channels of the calibration" (see `other_channels`), "stretches left out" (`lost`),
        "plain mean is wrong" (`naive`), "upside down" (`axes`), "state the headings" (`apart`), "perhaps the other
        hemisphere" (`biases`).
    earth_rate : float [rad/s]
        The known rate of the Earth.
    verdict : AlignmentVerdict
        "resolved", "bias not known", "no north", "inconsistent" or "inconsistent with Earth".
    no_north : NoNorth or None
        Why there is no heading: "biases not told from the Earth", "Earth is hidden" by something larger, "widened by a
        check", "uncertainty too large" (see `largest_source`), "Earth not seen" by sensors that could; None where there
        is one.
    last, first : LevelledAttitude
        At the end of the record and at its beginning.
    mode : "static", "positions" or "rotation"
        How the unit stood.
    confidence : float
        Of all intervals.
    inflation : float
        1, or the factor by which excess scatter or noise widens everything.
    horizontal : ndarray, shape (2,) [rad/s]
        The Earth's rotation along the heading axis and to the right of it, leveled, at the end. NaN where unseen.
    horizontal_covariance : ndarray, shape (2, 2) [rad^2/s^2]
        Infinite on the diagonal where it cannot be told from the biases.
    horizontal_length : Quantity [rad/s]
        Its length; "not resolved" where it cannot be told from the biases.
    expected_rate : float [rad/s]
        The Earth's rate times the cosine of the latitude.
    signal_to_noise : float
        Length of the horizontal vector in standard deviations.
    measured_latitude : Quantity [rad]
        From the angle between the vertical and the rotation, without the given latitude; "not resolved" where it is
        not seen.
    latitude_sd : float [rad]
        Its standard deviation.
    gravity : float [m/s^2]
        Length of the mean specific force of the first stand; NaN in counts without calibration.
    expected_gravity : float [m/s^2]
        WGS 84, at the latitude and height.
    apparent_rate : float [rad/s]
        Length of what the gyros show in the longest stand; NaN of a rotation.
    apparent_bias : float [rad/s]
        Of one attitude: size of the biases by the length and the vertical part of the rotation; NaN of several.
    largest_source : str
        Of the budget of the heading, where there is none.
    coarse : tuple of CoarseAlignment
        Answers from two vectors alone.
    naive : NaiveMean or None
        None where the unit was turned on purpose, and means say nothing.
    running : RunningHeading
        The heading as the record grows.
    biases : mapping of str to Bias
        By gyro channel.
    budget : mapping of str to float [rad]
        Standard uncertainties of the heading at the end by source; "together" is no sum of their squares where the
        parameters of the calibration are correlated.
    checks : tuple of AlignmentCheck
        Questions put to the residuals.
    lost : int
        Stretches at the beginning that no turn connects, and that are left out.
    other_channels : tuple of OtherChannels
        Triads whose channels are not those of the calibration.
    apart : PositionsApart or None
        Of positions that were recorded one by one.
    stands : tuple of Stand
        Attitudes in the order of time; one in a rotation.
    spans : tuple of (float, float) [s]
        Stretches at rest that were used.
    revolutions : float
        In a rotation; 0 otherwise.
    tilt : float [rad]
        Of the axis of rotation from the vertical; NaN without a rotation.
    latitude : float [rad]
        Where it was measured.
    height : float [m]
        Above the ellipsoid.
    axes : str
        Where x, y and z of the sensor point.
    channels : mapping of str to tuple of str
        "gyro" and "accelerometer".
    models : mapping of str to NoiseModel
        By channel; those whose noise came from the record are missing.
    calibrated : bool
        A calibration was given.
    calibration_source : str
        Where it comes from.
    duration : float [s]
        Of the record.
    source : str
        Of the record.
    """

    FORMAT: ClassVar[str] = "allanite-alignment"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("remarks", "earth_rate")

    verdict: AlignmentVerdict = AlignmentVerdict.NO_NORTH
    no_north: NoNorth | None = None
    last: LevelledAttitude
    first: LevelledAttitude
    mode: Mode
    confidence: float
    inflation: float
    horizontal: Array
    horizontal_covariance: Array = field(repr=False)
    horizontal_length: Quantity
    expected_rate: float
    signal_to_noise: float
    measured_latitude: Quantity
    latitude_sd: float
    gravity: float
    expected_gravity: float
    apparent_rate: float = math.nan
    apparent_bias: float = math.nan
    largest_source: str = "gyro noise"
    coarse: tuple[CoarseAlignment, ...] = field(default=(), repr=False)
    naive: NaiveMean | None = field(default=None, repr=False)
    running: RunningHeading = field(repr=False)
    biases: Mapping[str, Bias] = field(default_factory=dict)
    budget: Mapping[str, float] = field(default_factory=dict)
    checks: tuple[AlignmentCheck, ...] = ()
    lost: int = 0
    other_channels: tuple[OtherChannels, ...] = ()
    apart: PositionsApart | None = None
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
        return self.verdict is AlignmentVerdict.RESOLVED

    @property
    def earth_rate(self) -> float:
        """The known rate of the Earth [rad/s]."""
        return EARTH_RATE

    @property
    def horizontal_rate(self) -> float:
        """Length of the Earth's horizontal rotation, as measured [rad/s]."""
        return self.horizontal_length.value

    @property
    def horizontal_interval(self) -> tuple[float, float]:
        """Of the length, at `confidence` [rad/s]."""
        return self.horizontal_length.lower, self.horizontal_length.upper

    @property
    def latitude_found(self) -> float:
        """From the angle between the vertical and the rotation [rad]; NaN where it is not seen."""
        return self.measured_latitude.value

    @property
    def latitude_interval(self) -> tuple[float, float]:
        """Of that latitude, at `confidence` [rad]."""
        return self.measured_latitude.lower, self.measured_latitude.upper

    @property
    def one_attitude(self) -> bool:
        """The unit was not turned."""
        return self.mode == "static"

    @property
    def contradictions(self) -> list[AlignmentCheck]:
        """Checks that take the result away; turns that gravity contradicts are only less certain."""
        return grave([c for c in self.checks if c.kind is not AlignmentCheckKind.TURNS])

    @property
    def largest_sd(self) -> float:
        """Standard deviation of the horizontal rotation along the worse direction [rad/s]."""
        known = np.isfinite(self.horizontal_covariance).all()
        return largest_sd(self.horizontal_covariance) if known else math.inf

    @property
    def expected_signal(self) -> float:
        """The Earth's horizontal rate in standard deviations of the worse direction: what these sensors can tell.

        A vector of noise alone is long enough at times. Whether a heading is given depends on the sensors, not on luck.
        """
        return self.expected_rate / self.largest_sd if self.largest_sd > 0 else math.inf

    @property
    def statement(self) -> str:
        """What the heading contains that the record cannot show; "" where there is nothing of that kind."""
        assumed = self.verdict is AlignmentVerdict.BIAS_UNKNOWN
        parts = [*([words.NO_BIAS] if assumed else []), *([] if self.calibrated else [words.NOMINAL])]
        return "; ".join(parts)

    @property
    def reason(self) -> str:
        """Why the verdict is what it is, in one or two sentences."""
        rate = *self.horizontal_interval, self.expected_rate
        match self.verdict:
            case AlignmentVerdict.INCONSISTENT:
                check = self.contradictions[0]
                return f"{check.name}: {check.says}"
            case AlignmentVerdict.CONTRADICTS:
                return words.not_earth(*rate)
            case AlignmentVerdict.BIAS_UNKNOWN:
                return words.if_small(self.heading, self.apparent_bias)
            case AlignmentVerdict.RESOLVED:
                return words.resolved(self.signal_to_noise)
        match self.no_north:
            case NoNorth.HIDDEN if self.one_attitude:
                return words.biases_hide(self.apparent_bias, self.expected_rate)
            case NoNorth.HIDDEN:
                return words.something_hides(*rate)
            case NoNorth.TORN:
                return f"{self.contradictions[0].says}; this leaves {self._left}"
            case NoNorth.WEAK:
                return f"{words.of_source(self.largest_source)[0]} {self._left}"
            case NoNorth.UNSEEN:
                return words.unseen(self.signal_to_noise, self.expected_signal)
        return words.inseparable(self.apparent_rate, one_attitude=self.one_attitude)

    @property
    def _left(self) -> str:
        return words.leaves(self.largest_sd, self.expected_rate)

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do, or to know: of the verdict, of the checks that did not pass, then the remarks."""
        first, more = [*self._of_verdict()], [*self._remarked()]
        reason = self.reason
        failed = (c.says for c in self.checks if not c.passed and c.says not in reason)
        between = () if self.apart is None else self.apart.says
        return (*(words.REMARKS[code] for code in first), *failed, *(says for _, says in more), *between)

    @property
    def remarks(self) -> tuple[AlignmentRemark, ...]:
        """What is to be known or done, beside the checks that did not pass."""
        return (*self._of_verdict(), *(code for code, _ in self._remarked()))

    def _of_verdict(self) -> Iterator[AlignmentRemark]:
        both = (AlignmentRemark.TURN, AlignmentRemark.CALIBRATE)
        if self.verdict is AlignmentVerdict.BIAS_UNKNOWN:
            yield from (AlignmentRemark.STATE_BIAS, AlignmentRemark.TURN)
        elif self.verdict in (AlignmentVerdict.INCONSISTENT, AlignmentVerdict.CONTRADICTS):
            yield from [AlignmentRemark.TURN] if self.one_attitude else []
        elif self.verdict is AlignmentVerdict.NO_NORTH:
            match self.no_north:
                case NoNorth.HIDDEN:
                    yield from both if self.one_attitude else [AlignmentRemark.WARM_UP]
                case NoNorth.WEAK:
                    yield from words.of_source(self.largest_source)[1]
                case NoNorth.UNSEEN:
                    yield AlignmentRemark.DOUBT
                case NoNorth.BIASES:
                    yield from both
                    if self.one_attitude and self.apparent_rate > SLOW_TURN:
                        yield AlignmentRemark.ROTATING

    def _remarked(self) -> Iterator[tuple[AlignmentRemark, str]]:
        """What is to be known besides, each with its code."""
        for triad in self.other_channels:
            yield AlignmentRemark.CHANNELS, words.other_channels(triad.calibrated, triad.taken)
        if self.lost:
            yield AlignmentRemark.LOST, words.lost(self.lost)
        naive = self.naive
        if naive is not None and naive.flagged and not math.isnan(naive.heading):
            says = words.naive_is_wrong(naive.duration, naive.heading, naive.says)
            yield AlignmentRemark.NAIVE, says
        if self.stands and all(math.cos(s.roll) * math.cos(s.pitch) < UPSIDE_DOWN for s in self.stands):
            yield AlignmentRemark.UPSIDE_DOWN, words.upside_down(self.axes)
        for name, bias in self.biases.items():
            if bias.mirrored(self._bias_size(bias)):
                yield AlignmentRemark.MIRRORED, words.mirrored(name, bias.value, -2 * bias.vertical)
        if self.apart is not None and not self.apart.headed and self.apart.count > 1:
            yield AlignmentRemark.STATE_HEADINGS, words.HEADINGS[self.apart.rows]

    def _bias_size(self, bias: Bias) -> float:
        """How large a bias is here: half its interval, or what the axes show that do not need the latitude."""
        half = normal_quantile(0.5 + 0.5 * self.confidence) * bias.sd
        shown = (abs(b.value) for b in self.biases.values() if not b.by_latitude and math.isfinite(b.value))
        return max(half, *shown, 0.0)

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.experiments.alignment.version_1 import upgraded

        return upgraded(data) if data.get("version") == 1 else data


def largest_sd(covariance: Array) -> float:
    """Standard deviation along the worst direction."""
    return math.sqrt(max(float(np.linalg.eigvalsh(covariance)[-1]), 0.0))


def fixed(values: Array) -> Array:
    """A read-only copy."""
    copy = np.array(values, dtype=np.float64)
    copy.flags.writeable = False
    return copy


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignmentPrediction(Result):
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

    FORMAT: ClassVar[str] = "allanite-alignment-prediction"

    heading_sd: float
    roll_sd: float
    pitch_sd: float
    budget: Mapping[str, float]
    bias_sds: Array
    signal_to_noise: float
    resolves: bool
    duration: float
