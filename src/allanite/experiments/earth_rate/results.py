# SPDX-License-Identifier: BSD-3-Clause
"""What a measurement of the Earth's rotation says: plain, frozen, serialisable."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.earth_rate import words
from allanite.experiments.earth_rate.checks import RateCheck
from allanite.experiments.earth_rate.quantile import needed_quantile, needs_more
from allanite.experiments.earth_rate.verdict import EarthRateVerdict, NoiseOrigin, RateRemark
from allanite.experiments.reversals import Reversals
from allanite.experiments.reversals.sides import is_vertical, part_seen
from allanite.experiments.reversals.turned_over import TurnedOver
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.earth import DEG_H, EARTH_RATE
from allanite.quantities.quantity import Quantity
from allanite.quantities.result import Result
from allanite.quantities.units import STANDARD_GRAVITY

__all__ = [
    "G_SENSITIVITY",
    "AxisComponent",
    "DwellMean",
    "EarthRateEstimate",
    "RateReading",
    "RunningEstimate",
    "SettlingFit",
    "UndecidedNoise",
]

Array = NDArray[np.float64]

G_SENSITIVITY = "g-sensitivity"
"""Its name in the budget."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RateReading(Result):
    """The Earth rate by one estimator from the means of the dwells.

    Attributes
    ----------
    name : str
        "pairs", the seed's north-south pairs, or "north-south-north", which cancels a drift; "up-down-up" of an axis
        that was turned over.
    rate : float [rad/s]
        What this estimator says.
    sd : float [rad/s]
        Under the noise model.
    scatter : float or None [rad/s]
        Standard error from the scatter of the single values alone, taken for independent; None where they overlap.
    count : int
        Single values.
    """

    name: str
    rate: float
    sd: float
    scatter: float | None
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisComponent(Quantity):
    """A number of the axis itself beside the one that is expected.

    Attributes
    ----------
    value : float
        The estimate.
    lower, upper : float
        At the confidence of the estimate.
    unit : str
        Of SI.
    status : QuantityStatus
        As of any quantity.
    sd, expected : float
        Standard deviation, and the value that is expected.
    """

    sd: float
    expected: float

    @property
    def interval(self) -> tuple[float, float]:
        """Both ends."""
        return self.lower, self.upper


@dataclass(frozen=True, slots=True, kw_only=True)
class SettlingFit(Result):
    """A rotation that settles after each turn, fitted beside the rate.

    Attributes
    ----------
    T : float [s]
        Its time constant.
    rate, sd : float [rad/s]
        The Earth rate beside it.
    """

    T: float
    rate: float
    sd: float

    @property
    def says(self) -> str:
        """What it means and what to do, where it brings the rate back to that of the Earth."""
        return (
            "a rotation that settles after each turn may be the cause, though the residuals alone do not show it: with "
            f"a settling of {self.T:.2g} s in the fit the rate is {self.rate / DEG_H:.2f} deg/h (standard deviation "
            f"{self.sd / DEG_H:.2g}). Leave out more time after each turn (--dead-time), or fit it (--settling)"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class UndecidedNoise(Result):
    """Two families of noise models between which the record at rest does not decide.

    Attributes
    ----------
    family, other : str
        The one that was used, whose interval is wider, and the other.
    narrower : float
        Part by which the interval of the other is narrower.
    """

    family: str
    other: str
    narrower: float

    @property
    def says(self) -> str:
        """Which of them the interval is of, and what the other would make of it."""
        return (
            f"the record at rest does not decide between {self.family} and {self.other}; the interval is that of "
            f"{self.family}, the wider one: with {self.other} it would be {100 * self.narrower:.0f} % narrower"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class DwellMean(Result):
    """One dwell.

    Attributes
    ----------
    start, stop : float [s]
        Usable part, since the beginning of the record.
    sign : int
        +1 north or up, -1 south or down, 0 unknown.
    mean : float [rad/s]
        Of its usable samples.
    sd : float [rad/s]
        Of its white noise.
    residual : float [rad/s]
        Mean less bias, drift-free part and Earth: what is left of it after the fit.
    """

    start: float
    stop: float
    sign: int
    mean: float
    sd: float
    residual: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RunningEstimate(Result):
    """The estimate as the record grows: one entry at the end of dwells.

    Attributes
    ----------
    time : ndarray, shape (n,) [s]
        Since the beginning of the record.
    rate, sd : ndarray, shape (n,) [rad/s]
        By regression; NaN and infinity until rate and bias can be told apart.
    pairs : ndarray, shape (n,) [rad/s]
        Mean of the pairs so far, NaN before the first.
    """

    time: Array
    rate: Array
    sd: Array
    pairs: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class EarthRateEstimate(Result):
    """The Earth's rotation as one axis saw it, with what speaks for and against the number.

    Attributes
    ----------
    remarks : tuple of RateRemark
        What is to be known or done, beside the checks that did not pass: "turn the sensor", "state the turns", "get
        more dwells"; "state the g-sensitivity"; "state the first direction", "was turned over" (see `turned_over`),
        "perhaps turned over" (`rate_if_up`); "perhaps a settling" (`settling`); "noise family undecided" (`undecided`).
    component : AxisComponent [rad/s]
        What the axis saw of the Earth where it points north, or up.
    g_sensitivity : AxisComponent or None [rad/s/(m/s^2)]
        Of a vertical axis, under the known rate of the Earth.
    earth_rate : float [rad/s]
        The known rate of the Earth.
    verdict : EarthRateVerdict
        "resolved", "not resolved", "inconsistent", "inconsistent with Earth" or "not separable"; "not separable from
        g-sensitivity" for a vertical axis whose g-sensitivity nobody stated.
    rotation : Quantity [rad/s]
        The Earth's rotation rate with its interval at `confidence`, from `total_sd`; "not resolved" where it is not
        seen to differ from zero, NaN where rate and bias cannot be told apart.
    sd : float [rad/s]
        Standard deviation by the noise, multiplied by `inflation`.
    total_sd : float [rad/s]
        With the stated uncertainties.
    confidence : float
        Of all intervals.
    inflation : float
        1, or the factor by which excess scatter or noise widens the interval.
    bias : (float, float) [rad/s]
        The constant of the record at its beginning, and its standard deviation; where the record has no reversals,
        the constant is bias and Earth together.
    nuisances : mapping of str to (float, float)
        Other coefficients that were fitted, with their standard deviations.
    budget : mapping of str to float [rad/s]
        Standard uncertainties by source; 0 where nothing is stated.
    readings : tuple of RateReading
        Simple estimators beside it.
    running : RunningEstimate
        The estimate as the record grows.
    dwells : tuple of DwellMean
        All of them.
    checks : tuple of RateCheck
        Questions put to the residuals.
    dead_times : ndarray, shape (n, 3) [s, rad/s, rad/s]
        The estimate and its standard deviation for other times left out after each turn.
    latitude : float [rad]
        Where it was measured.
    first : str
        "north", "south", "up", "down", or "unknown": then the sign of the rate is a choice.
    model : NoiseModel
        Of the sensor at rest.
    model_source : NoiseOrigin
        "given", or "this record": then fitted to it.
    reversals : Reversals
        When the sensor was turned.
    duration : float [s]
        Of the record.
    block : float [s]
        Length of the means that were regressed.
    channel, source : str
        Of the record.
    turned_over : TurnedOver or None
        What accelerometers beside the gyro show of its turns.
    rate_if_up : float or None [rad/s]
        Rate of an axis that pointed up at first, down has the other sign; where a level one contradicts the Earth and
        that one does not.
    settling : SettlingFit or None
        One that the residuals do not show, where it would explain why the rate is not that of the Earth.
    undecided : UndecidedNoise or None
        Where the record at rest leaves two families of noise models open.
    """

    FORMAT: ClassVar[str] = "allanite-earth-rate"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("remarks", "component", "g_sensitivity", "earth_rate")

    verdict: EarthRateVerdict
    rotation: Quantity
    sd: float
    total_sd: float
    confidence: float
    inflation: float
    bias: tuple[float, float]
    nuisances: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    budget: Mapping[str, float] = field(default_factory=dict)
    readings: tuple[RateReading, ...] = ()
    running: RunningEstimate = field(repr=False)
    dwells: tuple[DwellMean, ...] = field(repr=False)
    checks: tuple[RateCheck, ...] = ()
    dead_times: Array = field(repr=False)
    latitude: float
    first: str
    model: NoiseModel = field(repr=False)
    model_source: NoiseOrigin
    reversals: Reversals = field(repr=False)
    duration: float
    block: float
    channel: str
    source: str
    turned_over: TurnedOver | None = None
    rate_if_up: float | None = None
    settling: SettlingFit | None = None
    undecided: UndecidedNoise | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "dead_times", np.reshape(self.dead_times, (-1, 3)))

    @property
    def rate(self) -> float:
        """The Earth's rotation rate [rad/s]; NaN where rate and bias cannot be told apart."""
        return self.rotation.value

    @property
    def interval(self) -> tuple[float, float]:
        """Of the rate, at `confidence` [rad/s]."""
        return self.rotation.lower, self.rotation.upper

    @property
    def reason(self) -> str:
        """Why the verdict is what it is, in one or two sentences."""
        match self.verdict:
            case EarthRateVerdict.NOT_SEPARABLE if self.one_sided:
                return words.one_direction(self.reversals)
            case EarthRateVerdict.NOT_SEPARABLE:
                return words.constant(self.bias, self.model_source, self.first, self.latitude)
            case EarthRateVerdict.INCONSISTENT:
                return words.contradicted(self.checks)
            case EarthRateVerdict.CONTRADICTS:
                needed = self.g_sensitivity
                cause = "" if needed is None else words.gravity(needed.value, needed.sd)
                if self.rotation.lower <= -EARTH_RATE <= self.rotation.upper:
                    cause += words.other_way(self.first)
                if self.hides_earth:
                    cause += words.not_turned(vertical=is_vertical(self.first))
                return words.excluded(self.interval, self.deviation, cause)
        far = words.distance(self.rate, self.total_sd, self.inflation)
        if self.verdict is EarthRateVerdict.NOT_RESOLVED:
            few = needs_more(self.model_source, self.n_pairs)
            return words.too_small(far, self.checks, few=few)
        return words.resolved(far, with_gravity=self.verdict is EarthRateVerdict.WITH_GRAVITY)

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do, or to know: what the checks that did not pass say, then the remarks."""
        separable = self.verdict is not EarthRateVerdict.NOT_SEPARABLE
        failed = words.of_failures(self.checks) if separable else []
        return (*failed, *(says for _, says in self._remarked()))

    @property
    def remarks(self) -> tuple[RateRemark, ...]:
        """What is to be known or done, beside the checks that did not pass."""
        return tuple(code for code, _ in self._remarked())

    def _remarked(self) -> Iterator[tuple[RateRemark, str]]:
        """The remarks, each with its code."""
        if self.verdict is EarthRateVerdict.NOT_SEPARABLE:
            yield from words.of_turns(self.reversals, self.first, one_sided=self.one_sided)
        elif self.bounds_sum:
            yield RateRemark.WITH_GRAVITY, words.WITH_GRAVITY
        if self.reversals.turns and not is_vertical(self.first):
            yield from words.of_the_first(self.first, self.turned_over, self.rate_if_up)
        if self.settling is not None:
            yield RateRemark.SETTLING, self.settling.says
        if self.undecided is not None:
            yield RateRemark.UNDECIDED, self.undecided.says

    @property
    def earth_rate(self) -> float:
        """The known rate of the Earth [rad/s]."""
        return EARTH_RATE

    @property
    def deviation(self) -> float:
        """Distance from the known rate of the Earth, in total standard deviations."""
        return (self.rate - EARTH_RATE) / self.total_sd

    @property
    def hides_earth(self) -> bool:
        """No rate is seen, though the Earth's would be: it differs from this one by what makes a rate seen."""
        if self.rotation.resolved:
            return False
        return abs(self.deviation) >= needed_quantile(self.model_source, self.n_pairs)

    @property
    def projection(self) -> float:
        """Part of the Earth's rotation along the axis where it points north, or up."""
        return part_seen(self.first, self.latitude)

    @property
    def component(self) -> AxisComponent:
        """What the axis saw of the Earth where it points north, or up [rad/s]; the latitude is no part of it."""
        sd = self._sd_without("latitude") * abs(self.projection)
        return self._of_axis(self.rate * self.projection, sd, EARTH_RATE * self.projection, "rad/s")

    @property
    def g_sensitivity(self) -> AxisComponent | None:
        """Of a vertical axis [rad/s/(m/s^2)], under the known rate of the Earth; None for a level axis."""
        if not is_vertical(self.first):
            return None
        along = self.projection / STANDARD_GRAVITY
        sd = self._sd_without(G_SENSITIVITY) * abs(along)
        return self._of_axis((self.rate - EARTH_RATE) * along, sd, 0.0, "rad/s/(m/s^2)")

    @property
    def bounds_sum(self) -> bool:
        """True where the rate is that of the Earth and a g-sensitivity that nobody stated, together."""
        return is_vertical(self.first) and not self.budget.get(G_SENSITIVITY)

    @property
    def one_sided(self) -> bool:
        """True where turns leave no two directions to compare."""
        return bool(self.reversals.turns) and len({d.sign for d in self.reversals.dwells} - {0}) < 2

    @property
    def n_pairs(self) -> int:
        """Pairs of dwells."""
        return next((r.count for r in self.readings if r.name == "pairs"), 0)

    @property
    def resolved(self) -> bool:
        """True when the rate is a measurement of the Earth's rotation."""
        return self.verdict is EarthRateVerdict.RESOLVED

    def _sd_without(self, source: str) -> float:
        return math.sqrt(sum(v**2 for k, v in self.budget.items() if k != source))

    def _of_axis(self, value: float, sd: float, expected: float, unit: str) -> AxisComponent:
        half = sd * (self.rotation.upper - self.rotation.lower) / 2 / self.total_sd
        return AxisComponent(
            value=value,
            lower=value - half,
            upper=value + half,
            unit=unit,
            status=self.rotation.status,
            sd=sd,
            expected=expected,
        )

    def reading(self, name: str) -> RateReading | None:
        """One of the simple estimators, or None where the record does not allow it."""
        return next((r for r in self.readings if r.name == name), None)

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.experiments.earth_rate.version_1 import upgraded

        return upgraded(data) if data.get("version") == 1 else data
