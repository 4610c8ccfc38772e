# SPDX-License-Identifier: BSD-3-Clause
"""FleetPopulation: what the units of a fleet have in common, and which of them do not share it."""

from __future__ import annotations

from dataclasses import field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.quantity import Quantity
from allanite.quantities.result import Result
from allanite.stability.fleet.verdict import CapabilityVerdict, FleetVerdict
from allanite.stability.fleet.words import capability_sentence, none_sentence, stand_out_sentence

__all__ = [
    "Capability",
    "CoefficientPopulation",
    "CovariateEffect",
    "FleetPopulation",
    "LotRatio",
    "StandingOut",
    "UnitCorrelation",
    "UnitDensity",
    "UnitDrift",
]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class CovariateEffect(Result):
    """How a coefficient changes with a condition of the logs.

    Attributes
    ----------
    name : str
        Of the column: "temperature", "date", or one that was asked for.
    unit_of_measure : str
        In which the condition counts: "degC", "year", or "1".
    reference : float
        Mean of the condition over the logs, for which the middle is stated; a date as a year.
    change : Quantity
        Of the natural logarithm of the coefficient, for one unit of measure of the condition (unit "1").
    """

    name: str
    unit_of_measure: str
    reference: float
    change: Quantity


@dataclass(frozen=True, slots=True, kw_only=True)
class LotRatio(Result):
    """The middle of one lot over the middle of all lots.

    Attributes
    ----------
    lot : str
        Its name.
    units : int
        Units of the lot.
    ratio : Quantity
        Of the coefficient.
    """

    lot: str
    units: int
    ratio: Quantity


@dataclass(frozen=True, slots=True, kw_only=True)
class Capability(Result):
    """A coefficient of all units beside its upper limit.

    Attributes
    ----------
    limit : float [SI]
        Largest value that a unit may have.
    allowed : float
        Share of the units that may lie above the limit.
    share : Quantity
        Of all units, new lots included, that lies above the limit (unit "1").
    index : Quantity
        Distance of the limit from the median over that of the 99.865 % quantile from it, of the natural logarithm
        (unit "1"): 1 where 0.135 % of the units lie above the limit, negative where more than half do.
    """

    STATED: ClassVar[tuple[str, ...]] = ("verdict",)

    limit: float
    allowed: float
    share: Quantity
    index: Quantity

    @property
    def verdict(self) -> CapabilityVerdict:
        """The interval of the share lies below the allowed share, above it, or on both sides."""
        if self.share.upper <= self.allowed:
            return CapabilityVerdict.MEETS
        if self.share.lower > self.allowed:
            return CapabilityVerdict.DOES_NOT_MEET
        return CapabilityVerdict.CANNOT_TELL


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitDensity(Result):
    """Where the units lie in one coefficient; densities are of its natural logarithm.

    Attributes
    ----------
    x : ndarray, shape (n,) [SI]
        Values of the coefficient.
    units : ndarray, shape (n,)
        Density of all units: each by its profile, so that one with an upper limit lies below that.
    population : ndarray, shape (n,)
        Density of the population.
    """

    x: Array = field(repr=False)
    units: Array = field(repr=False)
    population: Array = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitCorrelation(Result):
    """Two coefficients that vary together from unit to unit.

    Attributes
    ----------
    first, second : str
        "N of gyro_x".
    correlation : Quantity
        Of the normal scores of the estimates of the units, over what their lots and conditions let expect (unit "1").
    units : int
        That resolve both.
    left_out : int
        Units that resolve one of the two.
    """

    first: str
    second: str
    correlation: Quantity
    units: int
    left_out: int


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitDrift(Result):
    """A coefficient of one unit that changes over its repeats.

    Attributes
    ----------
    unit, lot : str
        Its name, and that of its lot ("" without lots).
    channel, symbol : str
        The coefficient.
    logs : int
        With dates.
    slope : Quantity
        Of the natural logarithm (unit "1/year"), a change of the whole fleet included.
    p : float
        Probability of such a slope, or a larger one, of a unit that does not drift.
    """

    unit: str
    lot: str
    channel: str
    symbol: str
    logs: int
    slope: Quantity
    p: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CoefficientPopulation(Result):
    """One coefficient of one channel in all units.

    Spreads are standard deviations of the natural logarithm (unit "1").

    Attributes
    ----------
    channel, kind : str
        Its name, and what it measures.
    symbol : str
        Q, N, B, K or R.
    logs, units, lots : int
        That take part; 1 lot where none are told apart.
    resolved : int
        Logs that resolve the coefficient; the others give an upper limit, which counts as such.
    middle : Quantity [SI]
        Median of the population, at the reference of each covariate.
    spread : Quantity
        Between the units of a lot.
    between_lots : Quantity or None
        None with a single lot.
    between_repeats : Quantity or None
        Between logs of one unit, beyond their own uncertainty; None where no unit has two logs, and then part of
        `spread`.
    wide_share : Quantity or None
        Share of the units that spread five times as much; None where the tails are normal.
    next_unit : (float, float) [SI]
        Prediction interval of the true value of the next unit, from a new lot if there are lots.
    content : float
        Share of units within a tolerance bound.
    tolerance : (float, float) [SI]
        That share of all units lies above the first, and that share below the second, each at `confidence`.
    effects : tuple of CovariateEffect
        Of the conditions.
    of_lots : tuple of LotRatio
        In the order of their names.
    capability : Capability or None
        Beside an upper limit, where it has one.
    density : UnitDensity or None
        Of all units; None in a document of an earlier version.
    """

    channel: str
    kind: str
    symbol: str
    logs: int
    units: int
    lots: int
    resolved: int
    middle: Quantity
    spread: Quantity
    between_lots: Quantity | None
    between_repeats: Quantity | None
    wide_share: Quantity | None
    next_unit: tuple[float, float]
    content: float
    tolerance: tuple[float, float]
    effects: tuple[CovariateEffect, ...]
    of_lots: tuple[LotRatio, ...]
    capability: Capability | None = None
    density: UnitDensity | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class StandingOut(Result):
    """A coefficient in which a unit stands out.

    Attributes
    ----------
    unit, lot : str
        Its name, and that of its lot ("" without lots).
    channel, symbol : str
        The coefficient.
    ratio : float
        Of the unit over what is expected of it: the middle for its lot and conditions. NaN where the unit gives a
        limit only.
    deviations : float
        How far that is, in standard deviations of the unit's true value and its uncertainty together; positive where
        the unit is noisier.
    p : float
        Probability of a unit that lies so far off, or farther.
    """

    unit: str
    lot: str
    channel: str
    symbol: str
    ratio: float
    deviations: float
    p: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FleetPopulation(Result):
    """What hundreds of logs say together.

    Attributes
    ----------
    logs, failed, units : int
        Logs of the table, those of them that could not be studied, and their units.
    coefficients : tuple of CoefficientPopulation
        By channel and symbol.
    left_out : tuple of str
        Coefficients that fewer than three units resolve, or whose spread the units do not bound.
    standing_out : tuple of StandingOut
        The farthest unit first.
    false_discovery_rate : float
        Expected share of false alarms among the units that stand out.
    confidence : float
        Of the intervals.
    correlations : tuple of UnitCorrelation
        Pairs whose correlation differs from zero, the strongest first; the chance that any is false is at most one less
        `confidence`.
    pairs : int
        Pairs of coefficients that ten units or more resolve.
    drifts : tuple of UnitDrift
        Units that change over their repeats, at `false_discovery_rate`, the surest first.
    repeated : int
        Coefficients of units that two logs or more resolve, 30 days or more apart.
    turned : tuple of str
        Logs in which the unit was turned (finding `motion`); no part of the population.
    """

    FORMAT: ClassVar[str] = "allanite-fleet"
    STATED: ClassVar[tuple[str, ...]] = ("verdict",)

    logs: int
    failed: int
    units: int
    coefficients: tuple[CoefficientPopulation, ...]
    left_out: tuple[str, ...]
    standing_out: tuple[StandingOut, ...]
    false_discovery_rate: float
    confidence: float
    correlations: tuple[UnitCorrelation, ...] = ()
    pairs: int = 0
    drifts: tuple[UnitDrift, ...] = ()
    repeated: int = 0
    turned: tuple[str, ...] = ()

    @property
    def verdict(self) -> FleetVerdict:
        """Does any unit stand out?"""
        return FleetVerdict.STAND_OUT if self.standing_out else FleetVerdict.NONE_STANDS_OUT

    @property
    def reason(self) -> str:
        """In a sentence."""
        if not self.standing_out:
            return none_sentence(self.units, len(self.coefficients), self.false_discovery_rate)
        return stand_out_sentence(self.names_standing_out, self.units, self.false_discovery_rate)

    @property
    def names_standing_out(self) -> tuple[str, ...]:
        """Of the units."""
        return tuple(dict.fromkeys(s.unit for s in self.standing_out))

    @property
    def capability_verdict(self) -> CapabilityVerdict | None:
        """The worst of all coefficients that have a limit; None where none has."""
        verdicts = {c.capability.verdict for c in self.coefficients if c.capability}
        return next((v for v in CapabilityVerdict if v in verdicts), None)

    @property
    def capability_reason(self) -> str:
        """Which coefficients decide it, in a sentence."""
        worst = self.capability_verdict
        limited = [c for c in self.coefficients if c.capability]
        if worst is None or not limited[0].capability:
            return ""
        names = [
            f"{c.symbol} of {c.channel}" for c in limited if c.capability and c.capability.verdict is worst
        ]
        return capability_sentence(worst.value, names, limited[0].capability.allowed, self.confidence)
