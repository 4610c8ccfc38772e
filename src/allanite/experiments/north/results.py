# SPDX-License-Identifier: BSD-3-Clause
"""What a search for north and a null test say: plain, frozen, serialisable."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.north import words
from allanite.experiments.north.checks import NorthCheck
from allanite.experiments.north.circle import Arc
from allanite.experiments.north.tracks import Rotation
from allanite.experiments.north.verdict import NorthRemark, NorthVerdict, NullVerdict
from allanite.experiments.reversals import PositionsApart, Reversals
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.quantity import Quantity
from allanite.quantities.result import Result

__all__ = ["EastWestNull", "NorthEstimate", "RunningNorth"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunningNorth(Result):
    """The estimate as the record grows.

    Attributes
    ----------
    time : ndarray, shape (n,) [s]
        Since the first sample.
    azimuth, sd : ndarray, shape (n,) [rad]
        NaN and infinity until both components are seen; 0 to below 2 pi.
    horizontal_rate : ndarray, shape (n,) [rad/s]
        Length of the vector so far.
    """

    time: Array
    azimuth: Array
    sd: Array
    horizontal_rate: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class NorthEstimate(Result):
    """Where north is, as one horizontal axis or two saw it.

    Attributes
    ----------
    remarks : tuple of NorthRemark
        What is to be done, beside the checks that did not pass: "turn the table", "add an axis or a position", "record
        for longer".
    earth_rate : float [rad/s]
        The known rate of the Earth.
    verdict : NorthVerdict
        "north found", "no north", "not resolved", "inconsistent" or "inconsistent with Earth".
    azimuth : float [rad]
        Of the table's mark, from north over east, 0 to below 2 pi; NaN where the design cannot tell it.
    sd : float [rad]
        Linear standard deviation by the noise, multiplied by `inflation`. The interval is not made of it: the two
        agree where the sd is small.
    total_sd : float [rad]
        With the stated uncertainties.
    interval : tuple of Arc
        Directions that the record does not contradict, at `confidence`: one arc, the whole circle, or, where one
        component alone is seen, two arcs (none where even the known rate of the Earth does not explain it).
    confidence : float
        Of all intervals.
    inflation : float
        1, or the factor by which excess scatter or noise widens everything.
    signal_to_noise : float
        Length of the measured vector in standard deviations.
    horizontal : Quantity [rad/s]
        Length of the measured vector; "not resolved" where one component alone is seen.
    horizontal_sd : float [rad/s]
        With the stated uncertainties.
    expected_rate : float [rad/s]
        The Earth's rate times the cosine of the latitude.
    candidates : tuple of float [rad]
        The azimuth; the two under the known rate where one component alone is seen.
    biases : mapping of str to (float, float) [rad/s]
        Level of each axis, and its standard deviation.
    budget : mapping of str to float [rad]
        Standard uncertainties of the azimuth by source; 0 where nothing is stated.
    running : RunningNorth
        The estimate as the record grows.
    checks : tuple of NorthCheck
        Questions put to the residuals.
    latitude : float [rad]
        Where it was measured.
    axes : mapping of str to float [rad]
        Channels, and the heading of each less that of the first.
    models : mapping of str to NoiseModel
        Of the sensors at rest.
    reversals : Reversals or None
        The positions.
    rotation : Rotation or None
        Of a table that turned all the time.
    apart : PositionsApart or None
        Of positions that were recorded one by one.
    duration, block : float [s]
        Of the record, and of the means that were regressed.
    source : str
        Of the record.
    """

    FORMAT: ClassVar[str] = "allanite-north"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("remarks", "earth_rate")

    verdict: NorthVerdict
    azimuth: float
    sd: float
    total_sd: float
    interval: tuple[Arc, ...]
    confidence: float
    inflation: float
    signal_to_noise: float
    horizontal: Quantity
    horizontal_sd: float
    expected_rate: float
    candidates: tuple[float, ...]
    biases: Mapping[str, tuple[float, float]]
    budget: Mapping[str, float] = field(default_factory=dict)
    running: RunningNorth = field(repr=False)
    checks: tuple[NorthCheck, ...] = ()
    latitude: float
    axes: Mapping[str, float]
    models: Mapping[str, NoiseModel] = field(repr=False)
    reversals: Reversals | None = field(default=None, repr=False)
    rotation: Rotation | None = None
    apart: PositionsApart | None = None
    duration: float
    block: float
    source: str

    @property
    def found(self) -> bool:
        """True when the azimuth is a measurement of north."""
        return self.verdict is NorthVerdict.RESOLVED

    @property
    def earth_rate(self) -> float:
        """The known rate of the Earth [rad/s]."""
        return EARTH_RATE

    @property
    def horizontal_rate(self) -> float:
        """Length of the measured vector [rad/s]."""
        return self.horizontal.value

    @property
    def horizontal_interval(self) -> tuple[float, float]:
        """Of the length, at `confidence` [rad/s]; without an upper end where one component alone is seen."""
        return self.horizontal.lower, self.horizontal.upper

    @property
    def components(self) -> int:
        """How many of the two components of the Earth's horizontal rotation the design sees."""
        if not math.isnan(self.azimuth):
            return 2
        return 1 if self.candidates or not self.interval else 0

    @property
    def anywhere(self) -> bool:
        """The record does not exclude a single direction."""
        return any(arc.full for arc in self.interval)

    @property
    def excludes_earth(self) -> bool:
        """The interval of the horizontal rate does not hold that of the Earth."""
        return not self.horizontal.lower <= self.expected_rate <= self.horizontal.upper

    @property
    def reason(self) -> str:
        """Why the verdict is what it is, in one or two sentences."""
        if self.components == 0:
            return words.KEPT_DIRECTION
        if self.components == 1:
            return words.two_azimuths(self.candidates) if self.interval else words.BEYOND_EARTH
        distance = self.signal_to_noise, self.inflation
        match self.verdict:
            case NorthVerdict.INCONSISTENT:
                return words.contradicted(self.checks)
            case NorthVerdict.CONTRADICTS:
                return words.excluded(*self.horizontal_interval, self.expected_rate)
            case NorthVerdict.NO_NORTH:
                most = self.horizontal.upper
                return words.nowhere(*distance, most, self.expected_rate, excludes=self.excludes_earth)
            case NorthVerdict.NOT_RESOLVED:
                return words.too_small(*distance)
            case NorthVerdict.RESOLVED:
                return words.resolved(*distance)

    @property
    def remarks(self) -> tuple[NorthRemark, ...]:
        """What is to be done, beside the checks that did not pass."""
        match self.components:
            case 0:
                return (NorthRemark.TURN,)
            case 1:
                return (NorthRemark.SECOND_AXIS,)
        weak = self.verdict is NorthVerdict.NO_NORTH and not self.excludes_earth
        return (NorthRemark.LONGER,) if weak else ()

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do, or to know: what the checks that did not pass say, the remarks, the time between positions."""
        failed = (c.says for c in self.checks if not c.passed)
        between = () if self.apart is None else self.apart.says
        return (*failed, *(words.REMARKS[code] for code in self.remarks), *between)

    def contains(self, azimuth: float) -> bool:
        """Does the interval hold this azimuth [rad]?"""
        return any(arc.contains(azimuth) for arc in self.interval)

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.experiments.north.version_1 import upgraded

        return upgraded(data) if data.get("version") == 1 else data


@dataclass(frozen=True, slots=True, kw_only=True)
class EastWestNull(Result):
    """The rate that turning between east and west seems to show, where the Earth shows none.

    Attributes
    ----------
    limit : float [rad/s]
        The larger end of the interval, without its sign: a bias beyond it is excluded.
    error_of_rate : float [rad/s]
        What such a bias would add to an Earth rate measured between north and south, at most.
    verdict : NullVerdict
        "no bias that follows the turns", "a bias follows the turns", "inconsistent" or "not separable".
    following : Quantity [rad/s]
        Bias that follows the turns: + pointing east, - pointing west. NaN where it cannot be told from the level.
    sd : float [rad/s]
        By the noise, multiplied by `inflation`.
    total_sd : float [rad/s]
        With the stated uncertainties: heading and tilt let some of the Earth in.
    confidence : float
        Of the interval.
    inflation : float
        1, or the factor by which excess scatter or noise widens the interval.
    bias : (float, float) [rad/s]
        The level, and its standard deviation.
    budget : mapping of str to float [rad/s]
        Standard uncertainties by source; 0 where nothing is stated.
    checks : tuple of NorthCheck
        Questions put to the residuals.
    latitude : float [rad]
        Where it was measured.
    model : NoiseModel or None
        Of the sensor at rest; None where an early document does not have it.
    reversals : Reversals or None
        The positions; None likewise.
    channel, source : str
        Of the record.
    """

    FORMAT: ClassVar[str] = "allanite-east-west-null"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("limit", "error_of_rate")

    verdict: NullVerdict
    following: Quantity
    sd: float
    total_sd: float
    confidence: float
    inflation: float
    bias: tuple[float, float]
    budget: Mapping[str, float] = field(default_factory=dict)
    checks: tuple[NorthCheck, ...] = ()
    latitude: float
    model: NoiseModel | None = field(default=None, repr=False)
    reversals: Reversals | None = field(default=None, repr=False)
    channel: str
    source: str

    @property
    def value(self) -> float:
        """Bias that follows the turns [rad/s]; NaN where it cannot be told from the level."""
        return self.following.value

    @property
    def interval(self) -> tuple[float, float]:
        """Of the bias, at `confidence` [rad/s]."""
        return self.following.lower, self.following.upper

    @property
    def limit(self) -> float:
        """The larger end of the interval, without its sign [rad/s]."""
        return max(map(abs, self.interval))

    @property
    def error_of_rate(self) -> float:
        """What such a bias would add to an Earth rate measured between north and south, at most [rad/s]."""
        return self.limit / math.cos(self.latitude)

    @property
    def reason(self) -> str:
        """Why the verdict is what it is."""
        match self.verdict:
            case NullVerdict.NOT_SEPARABLE:
                return words.NO_TURNS
            case NullVerdict.INCONSISTENT:
                return words.contradicted(self.checks)
            case NullVerdict.NONE:
                return words.no_bias(self.value, self.total_sd, self.limit)
            case NullVerdict.FOLLOWS:
                return words.follows(self.value, self.total_sd, self.error_of_rate)

    @property
    def advice(self) -> tuple[str, ...]:
        """What the checks that did not pass say."""
        return tuple(c.says for c in self.checks if not c.passed)

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.experiments.north.version_1 import upgraded_null

        return upgraded_null(data) if data.get("version") == 1 else data
