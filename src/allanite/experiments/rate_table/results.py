# SPDX-License-Identifier: BSD-3-Clause
"""What a run on a rate table says: plain, frozen, serialisable."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.earth_rate.verdict import NoiseOrigin
from allanite.experiments.rate_table import words
from allanite.experiments.rate_table.checks import TableCheck
from allanite.experiments.rate_table.verdict import TableRemark, TableVerdict
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.quantities.result import Result

__all__ = [
    "Aided",
    "Clipping",
    "FrequencyPoint",
    "RateTableEstimate",
    "ResponseParameter",
    "ResponsePoint",
    "StepResult",
    "TableMotion",
    "TableUncertainty",
]

Array = NDArray[np.float64]

#: The clocks are known so much worse than the edges are: the steps leave gaps.
BETWEEN = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseAtRate(Result):
    """The noise between neighboring blocks at one rate, without its sign.

    Attributes
    ----------
    rate : float [rad/s]
        Of the table.
    ratio : float
        Over that of the model.
    chi2, dof : float, int
        Of the differences, and its expectation.
    p : float
        Of so much noise or more, for the number of rates that were looked at.
    """

    rate: float
    ratio: float
    chi2: float
    dof: int
    p: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TableUncertainty:
    """Standard uncertainties of the table, which no record shows.

    Attributes
    ----------
    scale : float
        Relative standard uncertainty of the table's rate.
    misalignment : float [rad]
        Standard uncertainty of the angle between the sensitive axis and the table's axis.
    """

    scale: float = 0.0
    misalignment: float = 0.0

    def __post_init__(self) -> None:
        for name in ("scale", "misalignment"):
            value = getattr(self, name)
            if not (isinstance(value, (int, float)) and math.isfinite(value) and value >= 0):
                raise InputError(
                    f"the stated uncertainty of {name} must be finite and not negative, not {value!r}"
                )

    def budget(self) -> dict[str, float]:
        """What each contributes to the scale factor, relative to it. A misalignment is of second order, theta^2/2."""
        return {"table rate": self.scale, "misalignment": math.sqrt(3) / 2 * self.misalignment**2}


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseParameter(Quantity):
    """One number of the response.

    Attributes
    ----------
    limit : float or None
        Where it is not resolved, it is no larger than this, at the confidence of the interval.
    name : str
        "scale factor", "bias", "quadratic", ...
    sd : float
        By the noise, widened.
    total_sd : float
        With what is stated, too.
    value : float
        NaN where the record cannot tell it from others.
    lower, upper : float
        Ends of the interval.
    unit : str
        In SI; "1" for ratios.
    status : QuantityStatus
        "resolved": three standard deviations from zero or more; else "upper limit", or "not resolved" where the record
        cannot tell it.
    """

    STATED: ClassVar[tuple[str, ...]] = ("limit",)

    name: str
    sd: float
    total_sd: float

    @property
    def interval(self) -> tuple[float, float]:
        """Both ends."""
        return self.lower, self.upper

    @property
    def limit(self) -> float | None:
        """Where it is not resolved, it is no larger than this."""
        return max(map(abs, self.interval)) if self.status is QuantityStatus.UPPER_LIMIT else None


@dataclass(frozen=True, slots=True, kw_only=True)
class StepResult(Result):
    """One step of the table.

    Attributes
    ----------
    start, stop : float [s]
        Used part, by the record's clock; of a step that is not used the whole of it.
    rate : float [rad/s]
        Of the table.
    mean, residual, sd : float [SI of the channel]
        Mean, what the fit leaves of it, and the standard deviation of that by the noise model.
    corrected : float [SI of the channel]
        What is left after the slow noise was removed against the table; NaN where that was not done.
    used : bool
        It takes part.
    why : str
        Why it is not used.
    """

    start: float
    stop: float
    rate: float
    mean: float
    residual: float
    sd: float
    corrected: float
    used: bool
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponsePoint(Result):
    """The response at one rate, less its best straight line, over full scale.

    Attributes
    ----------
    rate : float [rad/s]
        Of the table.
    deviation, sd : float
        Relative to the scale factor times the largest rate.
    direction : int
        +1 where the rate came from below, -1 from above, 0 of both.
    """

    rate: float
    deviation: float
    sd: float
    direction: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FrequencyPoint(Result):
    """The response to one sinusoid.

    Attributes
    ----------
    frequency : float [Hz]
        Of the table.
    amplitude : float [rad/s]
        Of the table.
    gain, gain_sd : float [SI of the channel per rad/s]
        Output over the rate of the table.
    phase, phase_sd : float [rad]
        Of the output before the table; a clock that is late by d adds -2 pi f d.
    """

    frequency: float
    amplitude: float
    gain: float
    gain_sd: float
    phase: float
    phase_sd: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Aided(Result):
    """The reference-aided filter of the seed paper, told the fitted response: noise removal, no measurement.

    Attributes
    ----------
    time : ndarray, shape (n,) [s]
        Since the first sample.
    drift : ndarray, shape (n,) [SI of the channel]
        The slow noise that it took off.
    raw, corrected : float [SI of the channel]
        Root mean square of what the fit leaves of the steps, before and after; NaN without steps.
    scale : float [SI of the channel per rad/s]
        Slope of the corrected samples by plain least squares. It was told the fitted one, and agrees with it.
    scale_raw : float
        The same of the samples as they are: told nothing.
    """

    time: Array = field(repr=False)
    drift: Array = field(repr=False)
    raw: float
    corrected: float
    scale: float
    scale_raw: float

    @property
    def statement(self) -> str:
        """What it is."""
        return words.AIDED


@dataclass(frozen=True, slots=True, kw_only=True)
class Clipping(Result):
    """What is left out because the sensor is at the end of its range.

    Attributes
    ----------
    ends : tuple of float [SI of the channel]
        Values at which the record stops, one or two.
    steps : int
        Steps that are left out whole; 0 of a rate that changes all the time.
    rates : tuple of float [rad/s]
        Rates of these steps, each once; else those beyond which samples are left out.
    """

    ends: tuple[float, ...]
    steps: int
    rates: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class TableMotion(Result):
    """How the table turned.

    Attributes
    ----------
    kind : str
        "steps", "samples" or "sinusoids".
    start, stop : ndarray [s]
        Of each step or sinusoid, by the clock of the table; of samples the first and the last.
    rate : ndarray or None, shape (n,) [rad/s]
        Of the steps.
    amplitude, frequency, phase : ndarray or None, shape (n,) [rad/s], [Hz], [rad]
        Of the sinusoids.
    quantity : str
        "angle" or "rate", of samples; else "".
    samples : int
        Their number.
    interval : float [s]
        From one to the next.
    """

    kind: str
    start: Array
    stop: Array
    rate: Array | None = None
    amplitude: Array | None = None
    frequency: Array | None = None
    phase: Array | None = None
    quantity: str = ""
    samples: int = 0
    interval: float = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class RateTableEstimate(Result):
    """The response of one channel to a rate table, with what speaks for and against it.

    Attributes
    ----------
    remarks : tuple of TableRemark
        What is to be known or done, beside the checks that did not pass: "record at more rates", "fit a lower degree";
        "clipped" (see `clipped`), "clocks compared" (`parameters`), "motion repeats itself"
        (`other_offsets`), "not settled", "Earth in the bias" (`earth`), "turns are not whole" (`not_whole`), "steps of
        the encoder" (`steps`), "lowest frequency" (`table`), "counts the other way".
    channel, source : str
        Of the record.
    kind, unit : str
        Of the channel; `unit` is the one in which its samples are written.
    channel_scale : float
        SI value of one of them.
    verdict : TableVerdict
        "resolved", "not resolved", "inconsistent" or "not separable".
    parameters : tuple of ResponseParameter
        "scale factor", "bias" and the rest, by name in `__getitem__`.
    confidence : float
        Of the intervals.
    inflation : float
        1, or the factor by which excess scatter widens the intervals.
    budget : mapping of str to float
        Standard uncertainties of the scale factor by source, relative to it; 0 where nothing is stated.
    nonlinearity : str
        Degree of the polynomial, "1" to "5", or "sign".
    nominal : float or None
        Scale factor that the channel's unit says it has [1], where it says one.
    full_scale, span : float [rad/s]
        Largest rate, and largest less smallest.
    checks : tuple of TableCheck
        Questions put to the residuals.
    steps : tuple of StepResult
        Empty for a rate that changes all the time.
    points : tuple of ResponsePoint
        The response less its best straight line.
    fitted : ndarray, shape (n, 3)
        Rate over full scale, fitted deviation from the straight line, and its standard deviation.
    frequencies : tuple of FrequencyPoint
        Of several sinusoids.
    noise_by_rate : tuple of NoiseAtRate
        Between neighboring blocks.
    aided : Aided or None
        What the filter of the seed paper leaves; None where it was not tried.
    table : TableMotion
        How the table turned.
    clock : str
        "found", "given" or "not seen".
    clipped : Clipping or None
        None where nothing is left out for the range.
    other_offsets : tuple of float [s]
        Offsets of the clocks at which the motion of the table fits as well, the nearest first.
    either_sign : bool
        At some of them the scale factor has the other sign.
    loop_alike : bool
        A hysteresis of the sweep would look like an offset of the clocks.
    settled : bool
        The sensor and the table settle within half of a step.
    not_whole : int
        Steps that do not turn by whole revolutions, where the Earth across the axis matters.
    dead_time, guard : float [s]
        Left out after a step begins, and before it ends.
    axis : str
        Of the table: "vertical", "up", "down", "horizontal" or "unknown".
    earth : float or None [rad/s]
        Part of the Earth's rotation that a sensor on this axis sees all the time; None where it is not known.
    model : NoiseModel
        Of the sensor.
    model_source : NoiseOrigin
        "given", or "this record".
    duration, block : float [s]
        Of the record, and of the means that were regressed.
    """

    FORMAT: ClassVar[str] = "allanite-rate-table"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("remarks",)

    channel: str
    source: str
    kind: str
    unit: str
    channel_scale: float
    verdict: TableVerdict
    parameters: tuple[ResponseParameter, ...]
    confidence: float
    inflation: float
    budget: Mapping[str, float]
    nonlinearity: str
    nominal: float | None
    full_scale: float
    span: float
    checks: tuple[TableCheck, ...] = ()
    steps: tuple[StepResult, ...] = field(default=(), repr=False)
    points: tuple[ResponsePoint, ...] = field(default=(), repr=False)
    fitted: Array = field(repr=False)
    frequencies: tuple[FrequencyPoint, ...] = ()
    noise_by_rate: tuple[NoiseAtRate, ...] = ()
    aided: Aided | None = None
    table: TableMotion = field(repr=False)
    clock: str
    clipped: Clipping | None = None
    other_offsets: tuple[float, ...] = ()
    either_sign: bool = False
    loop_alike: bool = False
    settled: bool = True
    not_whole: int = 0
    dead_time: float
    guard: float
    axis: str
    earth: float | None
    model: NoiseModel = field(repr=False)
    model_source: NoiseOrigin
    duration: float
    block: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "fitted", np.reshape(self.fitted, (-1, 3)))

    def __getitem__(self, name: str) -> ResponseParameter:
        """One of the parameters.

        Raises
        ------
        InputError
            No such parameter; the message lists those there are.
        """
        parameter = next((p for p in self.parameters if p.name == name), None)
        if parameter is None:
            raise InputError(
                f"no parameter {name!r}; there are: {', '.join(p.name for p in self.parameters)}"
            )
        return parameter

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(p.name for p in self.parameters)

    @property
    def resolved(self) -> bool:
        """True when the scale factor is one of this sensor."""
        return self.verdict is TableVerdict.RESOLVED

    @property
    def full_output(self) -> float:
        """Output at full scale, in SI of the channel; 0 where it is not known."""
        value = self["scale factor"].value
        return 0.0 if math.isnan(value) else abs(value) * self.full_scale

    @property
    def failed(self) -> list[TableCheck]:
        """Checks that did not pass."""
        return [c for c in self.checks if not c.passed]

    @property
    def _rates(self) -> int:
        """How many rates the steps have."""
        return len({s.rate for s in self.steps if s.used})

    @property
    def asymmetry_unknown(self) -> str:
        """Why the slopes at positive and negative rates cannot be told apart, where they cannot."""
        rates = np.array([s.rate for s in self.steps if s.used] or self.fitted[:, 0].tolist() or [math.nan])
        if (rates >= 0).all():
            return words.NO_SIGN["negative"]
        return words.NO_SIGN["positive"] if (rates <= 0).all() else words.FEW_RATES

    @property
    def _more_rates(self) -> TableRemark:
        both = self._one_rate or self.nonlinearity == "sign"
        return TableRemark.RATES if both else TableRemark.DEGREE

    @property
    def _one_rate(self) -> bool:
        return math.isnan(self["scale factor"].value) and self._rates < 2

    @property
    def reason(self) -> str:
        """Why the verdict is what it is, in one or two sentences."""
        scale = self["scale factor"]
        match self.verdict:
            case TableVerdict.NOT_SEPARABLE:
                if self._one_rate:
                    return words.ONE_RATE
                if self.nonlinearity == "sign":
                    return f"asymmetry {self.asymmetry_unknown}"
                return words.degree_too_high(self._rates)
            case TableVerdict.NOT_RESOLVED:
                return words.too_small(scale.value, scale.total_sd)
            case TableVerdict.INCONSISTENT:
                return words.contradicted(next(c for c in self.checks if c.grave))
        return words.known_to(scale.total_sd / abs(scale.value), self.inflation, self.failed)

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do."""
        if self.verdict is TableVerdict.NOT_SEPARABLE:
            return (words.REMARKS[self._more_rates],)
        return tuple(c.says for c in self.failed)

    @property
    def notes(self) -> tuple[str, ...]:
        """What there is to know of the clocks, the table and the channel."""
        return tuple(says for _, says in self._noted())

    @property
    def remarks(self) -> tuple[TableRemark, ...]:
        """What is to be known or done, beside the checks that did not pass."""
        codes = tuple(code for code, _ in self._noted())
        if self.verdict is not TableVerdict.NOT_SEPARABLE:
            return codes
        return (self._more_rates, *codes)

    def _noted(self) -> Iterator[tuple[TableRemark, str]]:
        """The notes, each with its code."""
        if self.clipped is not None:
            ends = [f"{end / self.channel_scale:.6g} {self.unit}".strip() for end in self.clipped.ends]
            yield TableRemark.CLIPPED, words.clipped(ends, self.clipped.rates, self.clipped.steps)
        if clocks := self._clocks():
            yield TableRemark.CLOCKS, clocks
        if self.other_offsets:
            yield TableRemark.REPEATS, words.repeats(self.other_offsets, either_sign=self.either_sign)
        if not self.settled:
            yield TableRemark.UNSETTLED, words.REMARKS[TableRemark.UNSETTLED]
        if earth := words.earth_in_bias(self.earth, self.axis, relative=self.kind == "rate"):
            yield TableRemark.EARTH, earth
        if self.not_whole:
            used = sum(step.used for step in self.steps)
            yield TableRemark.NOT_WHOLE, words.not_whole(self.not_whole, used)
        if self.table.kind == "samples" and self.steps:
            yield TableRemark.PLATEAUS, words.plateaus(len(self.steps))
        frequency = self.table.frequency
        if frequency is not None and (frequency > frequency.min() * (1 + 1e-9)).any():
            yield TableRemark.LOWEST, words.lowest(float(frequency.min()))
        if self.kind == "rate" and self["scale factor"].value < 0:
            yield TableRemark.REVERSED, words.REMARKS[TableRemark.REVERSED]

    def _clocks(self) -> str:
        """How the clocks were compared; "" where they were not."""
        if self.clock == "not seen":
            return words.ONE_CLOCK
        if "delay" in self.names:
            delay = self["delay"]
            half = (delay.upper - delay.lower) / 2
            return words.before_or_behind(delay.value, half) if delay.resolved else ""
        if "clock offset" not in self.names:
            return ""
        offset = self["clock offset"]
        half = (offset.upper - offset.lower) / 2
        return words.offset_of_clocks(
            offset.value,
            half,
            self["clock drift"].value if "clock drift" in self.names else None,
            between=self.table.kind == "steps" and half > BETWEEN * (self.dead_time + offset.sd),
            loop_alike=self.loop_alike,
        )

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.experiments.rate_table.version_1 import upgraded

        return upgraded(data) if data.get("version") == 1 else data
