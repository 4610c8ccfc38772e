# SPDX-License-Identifier: BSD-3-Clause
"""What a self-calibration says: plain, frozen, serialisable."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError
from allanite.experiments.calibration import words
from allanite.experiments.calibration.checks import CalibrationCheck
from allanite.experiments.calibration.orientations import half_axes_away
from allanite.experiments.calibration.verdict import (
    CalibrationCheckKind,
    CalibrationNoise,
    CalibrationRemark,
    CalibrationVerdict,
    ParameterNeed,
    ParameterStatus,
)
from allanite.experiments.reversals import PositionsApart
from allanite.experiments.static_spans import SdColumns, StaticSpans
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.result import Result
from allanite.recording.calibration import ACCELEROMETER, GYRO, Calibration

__all__ = [
    "CalibrationEstimate",
    "CalibrationParameter",
    "CalibrationPosition",
    "CalibrationTurn",
    "EarthSeen",
    "GravitySource",
    "GyrosAstray",
    "ObservationScatter",
    "SpansSource",
    "uncovered",
]

Array = NDArray[np.float64]
GravitySource = Literal["given", "latitude", "standard"]
SpansSource = Literal["given", "found", "rows of means"]


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationParameter(Result):
    """One parameter of the calibration.

    Attributes
    ----------
    name : str
        Sensor and error, such as "acc.bias_x", "gyro.scale_z" or "gyro.misalignment_xy".
    unit : str
        "m/s²", "rad/s", "rad", "1" (a scale factor in SI), "rad/s/(m/s²)", "LSB", "LSB/(m/s²)", ...
    value, sd : float
        With the stated uncertainties.
    interval : (float, float)
        At the confidence of the estimate.
    status : ParameterStatus
        "estimated"; "assumed" where the positions leave it open; "not resolved" where no position comes near one of
        the directions that it is the difference or the sum of: value and interval extrapolate; or where so few
        positions hardly tell how far they scatter, and the interval is as wide as what is known of any unit.
    open : float
        Part of it that lies in directions which the positions leave open, 0 to 1.
    dof : float
        Degrees of freedom of the law of the interval; infinite where no scatter had to be estimated. Where they are
        few, the interval is that of the largest scatter which the residuals do not exclude.
    add : tuple of str
        Positions to add so that it can be estimated; empty where it was.
    need : ParameterNeed or None
        What it needs in place of them: "accelerometers", "turns", or "more positions", whichever.
    """

    name: str
    unit: str
    value: float
    sd: float
    interval: tuple[float, float]
    status: ParameterStatus
    open: float
    dof: float
    add: tuple[str, ...] = ()
    need: ParameterNeed | None = None

    @property
    def advice(self) -> tuple[str, ...]:
        """What to add so that it can be estimated."""
        return self.add if self.need is None else (self.need.words,)


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationPosition(Result):
    """One static span.

    Attributes
    ----------
    number : int
        From 1, in the order of time; what `without` takes.
    start, stop : float [s]
        Since the first sample.
    up : ndarray, shape (3,)
        The direction that points up, in the axes of the body.
    words : str
        The same for people: "z up", "on an edge, +x and +y up", ...
    attitude : ndarray, shape (3, 3)
        Body to a level frame (third axis down) in which the first used span has the heading zero.
    heading_known : bool
        Linked by turns to the first used span.
    temperature : float or None
        Mean, in the unit of the channel after its scale.
    excess : float or None [m/s²]
        Length of the calibrated specific force less gravity; None without accelerometers.
    excess_sd : float or None [m/s²]
        Its standard deviation by the noise and the scatter, if the calibration were perfect.
    rate : ndarray or None, shape (3,) [rad/s]
        Calibrated mean rate less the Earth's, along the axes of the body; None without gyros.
    rate_sd : ndarray or None, shape (3,) [rad/s]
        Its standard deviation.
    misfit : float
        Deletion residual: how far the span lies from what all others predict, in standard deviations (root of the
        chi-square over its degrees of freedom). NaN where no other span says anything about it.
    p : float
        Probability of such a misfit or a larger one, for this span alone.
    outlier : bool
        p is below the limit for the worst of all spans and turns.
    used : bool
        It took part.
    why : str
        Why it was not used: "left out" (on request), "samples missing" (of an axis, all of them); "" where it was.
    """

    number: int
    start: float
    stop: float
    up: Array
    words: str
    attitude: Array = field(repr=False)
    heading_known: bool
    temperature: float | None
    excess: float | None
    excess_sd: float | None
    rate: Array | None = field(repr=False)
    rate_sd: Array | None = field(repr=False)
    misfit: float
    p: float
    outlier: bool
    used: bool
    why: str = ""

    @property
    def duration(self) -> float:
        """Length [s]."""
        return self.stop - self.start


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationTurn(Result):
    """The rotation from one used span to the next.

    Attributes
    ----------
    before, after : int
        Numbers of the spans.
    start, stop : float [s]
        Since the first sample.
    angle : float [rad]
        Of the rotation from the one attitude to the other, 0 to pi.
    axis : ndarray, shape (3,)
        In the axes of the body.
    residual : ndarray, shape (3,) [rad]
        Rotation between the integrated rates and the attitudes; NaN where the turn was not used.
    misfit, p : float
        As of a position.
    outlier : bool
        As of a position.
    used : bool
        It took part.
    why : str
        Why it was not used: "samples missing", "clipped", "left out", "no samples between"; "" where it was.
    """

    before: int
    after: int
    start: float
    stop: float
    angle: float
    axis: Array
    residual: Array = field(repr=False)
    misfit: float
    p: float
    outlier: bool
    used: bool
    why: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservationScatter(Result):
    """How one kind of observation scatters, beyond the noise.

    Attributes
    ----------
    what : str
        "accelerometers at rest", "gyros at rest" or "turns".
    unit : str
        "m/s²", "rad/s" or "rad".
    ratio : float
        Scatter over what the noise says; NaN where nothing but the scatter tells the noise.
    chi2, dof : float
        Of the residuals under the noise alone.
    sd : float
        Standard deviation, for each axis of each span or turn, that was added to the noise; 0 where none was needed.
    sd_dof : float
        Degrees of freedom that it was estimated with.
    walk : float
        Random walk of the biases that was added besides, in the unit per root of a second; 0 where none was seen.
    walk_dof : float
        Degrees of freedom that it was estimated with.
    """

    what: str
    unit: str
    ratio: float
    chi2: float
    dof: float
    sd: float
    sd_dof: float
    walk: float = 0.0
    walk_dof: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class EarthSeen(Result):
    """The Earth's rotation as the gyros saw it, in the level frame of the positions.

    Attributes
    ----------
    vector : ndarray, shape (3,) [rad/s]
        Third axis down.
    sd : ndarray, shape (3,) [rad/s]
        Its standard deviation.
    length, length_sd : float [rad/s]
        Of the part that was looked for (the horizontal one where the latitude is known), without the constraint.
    expected : float [rad/s]
        The known rate of that part.
    resolved : bool
        The length is seen: it was then set to the known one, which calibrates the scale of the gyros.
    """

    vector: Array
    sd: Array
    length: float
    length_sd: float
    expected: float
    resolved: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class GyrosAstray(Result):
    """Gyros in another order, with other signs or in another unit than the accelerometers.

    Attributes
    ----------
    miss : float [rad]
        By how much their turns miss those of gravity, in the median.
    order : tuple of str or None
        Their channels in the order that goes with the accelerometers; empty where it is theirs, None where none does.
    turned : tuple of str
        Channels whose sign has to be turned then.
    """

    miss: float
    order: tuple[str, ...] | None = None
    turned: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationEstimate(Result):
    """The calibration of a unit from its positions and turns.

    Attributes
    ----------
    remarks : tuple of CalibrationRemark
        What a reader must know: "standard deviations of the table" (see `sd_columns`), "held in the hand", "standard
        gravity", "no latitude", "headings not known", "biases follow gravity" (`follows_gravity`), "turns not used",
        "positions not used", "noise from the scatter".
    earth_rate : float [rad/s]
        The known rate of the Earth.
    correlation : ndarray, shape (k, k)
        Of the parameters; zero for one without variance.
    verdict : CalibrationVerdict
        "calibrated", "partly calibrated" (some parameters are assumed or not resolved), "inconsistent" (positions, or
        accelerometers and gyros, contradict each other, gravity or the Earth) or "not calibrated".
    calibration : Calibration
        Values, covariance, status: what other programs take. It holds how the biases of the gyros follow gravity where
        they scattered beyond their noise and this explains it.
    parameters : tuple of CalibrationParameter
        In the order of the names of the calibration.
    add : tuple of str
        Positions to add, in this order, which together make every parameter observable that can be.
    checks : tuple of CalibrationCheck
        Questions put to the residuals.
    scatter : tuple of ObservationScatter
        Of each kind of observation.
    positions : tuple of CalibrationPosition
        All static spans, those left out included.
    turns : tuple of CalibrationTurn
        Between the used ones.
    earth : EarthSeen or None
        None without gyros.
    astray : GyrosAstray or None
        Where the gyros do not go with the accelerometers at all; what is fitted means nothing then.
    follows_gravity : float or None [rad/s]
        What 1 g adds at most to the bias of a gyro, where the biases follow gravity.
    in_hand : bool
        The unit was held in the hand while it rested.
    gravity : float [m/s²]
        By which the accelerometers were calibrated.
    gravity_source : "given", "latitude" or "standard"
        What tells it.
    latitude : float or None [rad]
        Where it was recorded.
    stated : mapping of str to float
        Uncertainties as given.
    temperature_span : (float, float) or None
        Lowest and highest mean temperature of the spans.
    models : mapping of str to NoiseModel
        By channel, in the unit of the channel after its scale.
    model_source : CalibrationNoise
        "given" or "this record"; of rows of means also "standard deviations of the table" or "scatter of the
        positions".
    spans_source : "given", "found" or "rows of means"
        What tells when the unit was at rest.
    static_spans : StaticSpans or None
        When the unit was at rest, with what was found of that; None of rows of means.
    sd_columns : SdColumns or None
        Which standard deviations of a table tell the noise of its means.
    apart : PositionsApart or None
        Of positions that were recorded one by one.
    confidence : float
        Of all intervals.
    rate, duration : float [Hz], [s]
        Of the recording.
    source : str
        Of the recording.
    """

    FORMAT: ClassVar[str] = "allanite-calibration-estimate"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("remarks", "earth_rate", "correlation")

    verdict: CalibrationVerdict = CalibrationVerdict.NOT_CALIBRATED
    calibration: Calibration
    parameters: tuple[CalibrationParameter, ...] = field(repr=False)
    add: tuple[str, ...] = ()
    checks: tuple[CalibrationCheck, ...] = field(default=(), repr=False)
    scatter: tuple[ObservationScatter, ...] = field(repr=False)
    positions: tuple[CalibrationPosition, ...] = field(repr=False)
    turns: tuple[CalibrationTurn, ...] = field(repr=False)
    earth: EarthSeen | None = field(repr=False)
    astray: GyrosAstray | None = None
    follows_gravity: float | None = None
    in_hand: bool = False
    gravity: float
    gravity_source: GravitySource
    latitude: float | None
    stated: Mapping[str, float] = field(default_factory=dict)
    temperature_span: tuple[float, float] | None = None
    models: Mapping[str, NoiseModel] = field(repr=False)
    model_source: CalibrationNoise
    spans_source: SpansSource
    static_spans: StaticSpans | None = field(default=None, repr=False)
    sd_columns: SdColumns | None = None
    apart: PositionsApart | None = None
    confidence: float
    rate: float
    duration: float
    source: str

    def __post_init__(self) -> None:
        if tuple(p.name for p in self.parameters) != self.calibration.names:
            raise FormatError("the parameters are not those of the calibration, in their order")

    def __getitem__(self, name: str) -> CalibrationParameter:
        """One parameter by its name."""
        return self.parameters[self.calibration.names.index(name)]

    @property
    def sensors(self) -> tuple[str, ...]:
        """Triads that were calibrated."""
        return self.calibration.sensors

    @property
    def assumed(self) -> tuple[str, ...]:
        """Names of the parameters that the positions leave open."""
        return tuple(p.name for p in self.parameters if p.status is ParameterStatus.ASSUMED)

    @property
    def used(self) -> tuple[CalibrationPosition, ...]:
        """Positions that took part."""
        return tuple(p for p in self.positions if p.used)

    @property
    def outliers(self) -> tuple[str, ...]:
        """Positions and turns that contradict the rest, by name."""
        positions = tuple(f"position {p.number}" for p in self.positions if p.outlier)
        return positions + tuple(f"turn {t.before} to {t.after}" for t in self.turns if t.outlier)

    @property
    def inflated(self) -> bool:
        """True where scatter beyond the noise widens the intervals."""
        return any(s.sd > 0 or s.walk > 0 for s in self.scatter)

    @property
    def earth_rate(self) -> float:
        """The known rate of the Earth [rad/s]."""
        return EARTH_RATE

    @property
    def correlation(self) -> Array:
        """Of the parameters, shape (k, k); zero for one without variance."""
        sd = self.calibration.sd
        safe = np.where(sd > 0, sd, math.inf)
        return np.asarray(self.calibration.covariance / np.outer(safe, safe))

    # -- the verdict ------------------------------------------------------------------------------------------

    @property
    def reason(self) -> str:
        """Why the verdict is what it is, in one or two sentences."""
        return self.judged()[1]

    def judged(self) -> tuple[CalibrationVerdict, str]:
        """The verdict, and why."""
        return self._contradicted() or self._determined()

    def _contradicted(self) -> tuple[CalibrationVerdict, str] | None:
        """What contradicts itself; outliers come before what they do to accelerometers and gyros together."""
        verdict = CalibrationVerdict.INCONSISTENT
        if self.astray is not None:
            return verdict, words.astray(self.astray.miss, self.astray.order, self.astray.turned)
        grave = [c for c in self.checks if not c.passed and not c.widens]
        if earth := [c.says for c in grave if c.kind is CalibrationCheckKind.EARTH]:
            return verdict, earth[0]
        if self.outliers:
            return verdict, words.do_not_go(self.outliers)
        return (verdict, grave[0].says) if grave else None

    def _determined(self) -> tuple[CalibrationVerdict, str]:
        """How much the positions determine."""
        status = [p.status for p in self.parameters]
        used, count, estimated = len(self.used), len(status), status.count(ParameterStatus.ESTIMATED)
        some = words.some_determined(used, estimated, count)
        if not estimated:
            return CalibrationVerdict.NOT_CALIBRATED, words.none_determined(used)
        missing = uncovered(self.positions)
        if missing and ParameterStatus.NOT_RESOLVED in status:
            return CalibrationVerdict.PARTLY, words.uncovered(missing, some)
        if ParameterStatus.NOT_RESOLVED in status:
            return CalibrationVerdict.PARTLY, words.hardly_told(used, estimated, count)
        if ParameterStatus.ASSUMED in status:
            return CalibrationVerdict.PARTLY, f"{some}; the others stay near nominal"
        widened = self.inflated and self.model_source is not CalibrationNoise.SCATTER
        return CalibrationVerdict.CALIBRATED, words.all_determined(used, count, widened=widened)

    # -- advice and remarks -----------------------------------------------------------------------------------

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do, the most pressing first: spans to look at, checks that failed, positions to add."""
        return () if self.astray is not None else tuple(dict.fromkeys(self._advised()))

    def _advised(self) -> Iterator[str]:
        if self.outliers:
            yield words.contradict(self.outliers, self._numbers())
        yield from (c.says for c in self.checks if not c.passed)
        drifts = any(not c.passed and c.of_rests for c in self.checks)
        if self.temperature_span is not None and self.calibration.temperature is None and drifts:
            yield words.temperature_went(*self.temperature_span)
        if self.add:
            yield words.add(self.add)
        elif self.assumed:
            yield from (each for p in self.parameters for each in p.advice)
        if any(p.need is ParameterNeed.POSITIONS for p in self.parameters):
            yield ParameterNeed.POSITIONS.words

    def _numbers(self) -> Iterator[str]:
        """Of what contradicts the rest, as `without` takes them."""
        yield from (str(p.number) for p in self.positions if p.outlier)
        yield from (f"{t.before}-{t.after}" for t in self.turns if t.outlier)

    @property
    def remarks(self) -> tuple[CalibrationRemark, ...]:
        """What a reader must know, beside what was found of the rests."""
        return tuple(dict.fromkeys(code for code, _ in self._remarked()))

    @property
    def notes(self) -> tuple[str, ...]:
        """The same in sentences, with where the time between positions comes from and what was found of the rests."""
        apart = () if self.apart is None else self.apart.says
        rests = () if self.static_spans is None else self.static_spans.findings
        return (*apart, *rests, *(says for _, says in self._remarked()))

    def _remarked(self) -> Iterator[tuple[CalibrationRemark, str]]:
        """The remarks, each with its code."""
        forces, gyros = ACCELEROMETER in self.sensors, GYRO in self.sensors
        turned = any(t.used for t in self.turns)
        for code, holds in (
            (CalibrationRemark.IN_HAND, self.in_hand),
            (CalibrationRemark.NO_LATITUDE, gyros and forces and self.latitude is None),
            (
                CalibrationRemark.NO_HEADINGS,
                gyros and self.earth is None and not turned and len(self.used) > 1,
            ),
        ):
            if holds:
                yield code, words.REMARKS[code]
        if self.sd_columns is not None:
            yield CalibrationRemark.SD, self.sd_columns.says
        if forces and self.gravity_source == "standard":
            yield CalibrationRemark.GRAVITY, words.standard_gravity(self.gravity)
        if self.follows_gravity is not None:
            yield CalibrationRemark.FOLLOWS_GRAVITY, words.follows_gravity(self.follows_gravity)
        yield from self._not_used()
        if self.model_source is CalibrationNoise.SCATTER:
            dofs = ((s.what, s.sd_dof) for s in self.scatter if s.sd > 0)
            yield CalibrationRemark.SCATTER, words.scatter_tells(dofs)

    def _not_used(self) -> Iterator[tuple[CalibrationRemark, str]]:
        """Turns and positions that did not take part, by the reason."""
        for why in dict.fromkeys(t.why for t in self.turns if t.why):
            lost = [f"{t.before} to {t.after}" for t in self.turns if t.why == why]
            every = len(lost) == len(self.turns) > 1
            which = "all turns" if every else f"turn {', '.join(lost)}"
            yield CalibrationRemark.TURNS, words.not_used(which, why)
        for why in dict.fromkeys(p.why for p in self.positions if p.why):
            lost = [str(p.number) for p in self.positions if p.why == why]
            yield CalibrationRemark.POSITIONS, words.not_used(f"position {', '.join(lost)}", why)

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.experiments.calibration.version_1 import upgraded

        return upgraded(data) if data.get("version") == 1 else data


def uncovered(positions: Iterable[CalibrationPosition]) -> tuple[str, ...]:
    """Half axes of the body that no used position comes near with gravity, in words; none without accelerometers."""
    ups = [p.up for p in positions if p.used and p.words]
    return half_axes_away(ups) if ups else ()
