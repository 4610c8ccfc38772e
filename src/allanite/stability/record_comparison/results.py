# SPDX-License-Identifier: BSD-3-Clause
"""Comparison: what several records say of one another, and of the kind of sensor behind them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.quantity import Quantity
from allanite.quantities.result import Result
from allanite.stability.record_comparison.verdict import ComparisonVerdict
from allanite.stability.record_comparison.words import agreement_sentence, difference_words

__all__ = [
    "ChannelComparison",
    "ComparedCurve",
    "ComparedRecord",
    "Comparison",
    "Equality",
    "FamilyEvidence",
    "FamilyName",
    "Outlier",
    "ParameterComparison",
    "SensorSpread",
]

Array = NDArray[np.float64]
FamilyName = Literal["flicker", "gauss-markov"]
FamilyEvidence = Literal["flicker", "gauss-markov", "both", "neither"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparedRecord(Result):
    """One of the records.

    Attributes
    ----------
    name, source : str
        What it is called, and the log behind it.
    sha256 : str or None
        Of that log.
    rate : float [Hz]
        Samples per second.
    duration : float [s]
        Of the record.
    sampling : str
        "mean" or "point".
    """

    name: str
    source: str
    sha256: str | None
    rate: float
    duration: float
    sampling: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Equality(Result):
    """A test that something is the same in all records.

    Attributes
    ----------
    statistic, dof : float
        Chi-square and its expectation if they are the same.
    p : float
        Probability of a larger one, if they are.
    p_adjusted : float
        For the number of tests of its kind (Holm).
    """

    statistic: float
    dof: float
    p: float
    p_adjusted: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Outlier(Result):
    """The record that differs most from the others.

    Attributes
    ----------
    record : str
        Its name.
    p : float
        Probability of a record that differs so much, adjusted for the number looked at.
    looked_at : int
        Records and parameters among which it is the one that differs most.
    rest_p : float
        Equality of the others without it.
    """

    record: str
    p: float
    looked_at: int
    rest_p: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSpread(Result):
    """Middle and spread of the kind of sensor.

    Attributes
    ----------
    resolved : int
        Records that resolve the parameter.
    middle : Quantity
        The mean of the population; of a parameter that cannot be negative, its median.
    spread : Quantity
        Standard deviation between records: of the natural logarithm (unit "1"), or of a bias; an upper limit where
        none is seen.
    next_sensor : (float, float) or None [SI]
        Interval of the true value of the next record; None where fewer than three resolve the parameter.
    """

    resolved: int
    middle: Quantity
    spread: Quantity
    next_sensor: tuple[float, float] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterComparison(Result):
    """One parameter in all records.

    Attributes
    ----------
    symbol : str
        Q, N, B, B_equiv, T, q, K, R, or "mean" for the bias.
    records : tuple of Quantity
        Value of each record; an upper limit, or not resolved, where it gives no more.
    equality : Equality or None
        None where fewer than two records say anything of it.
    common : Quantity
        The one value, if it is the same in all.
    detectable : float or None
        Relative change of one record that the test would see in four of five cases; for a bias [SI].
    population : SensorSpread or None
        None where fewer than two records resolve it.
    worst : str or None
        The record with the largest value; None for times, and where none is resolved.
    worst_p : float or None
        Probability of so large a lead over the next, if both were equal.
    outlier : Outlier or None
        With three records or more.
    """

    symbol: str
    records: tuple[Quantity, ...]
    equality: Equality | None
    common: Quantity
    detectable: float | None
    population: SensorSpread | None
    worst: str | None
    worst_p: float | None
    outlier: Outlier | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparedCurve(Result):
    """The Allan curve of one record.

    Attributes
    ----------
    tau : ndarray, shape (n,) [s]
        Averaging time.
    deviation, lower, upper : ndarray, shape (n,) [SI unit of the rate or acceleration]
        With the interval at each lag.
    used : ndarray of bool, shape (n,)
        Lags that are compared.
    """

    tau: Array
    deviation: Array
    lower: Array
    upper: Array
    used: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelComparison(Result):
    """One channel in all records.

    Attributes
    ----------
    name, kind, unit : str
        Of the channel.
    channels : tuple of str
        Its name in each record.
    family : "flicker" or "gauss-markov"
        Under which the parameters are compared.
    families : tuple of str
        What each record supports by itself: one of the two, "both" or "neither".
    unexplained : tuple of str
        Records whose curve no sum of noise terms explains.
    apertures_differ : bool
        Records average over different parts of a sample.
    scale_uncertainty : float or None
        Largest relative standard uncertainty of the scale factors; None where none is stated. No test and no interval
        holds it: whether the records share its error is unknown.
    curves : tuple of ComparedCurve
        Of each record.
    tau : ndarray, shape (n_lags,) [s]
        Lags that are compared.
    lag_p, lag_p_adjusted : ndarray, shape (n_lags,)
        Equality at each lag, alone and adjusted for their number.
    curve : Equality
        Of all lags together.
    joint : Equality
        Of all parameters together.
    p : float
        Of the channel: of these two, adjusted for their number.
    outlier : Outlier or None
        By the curves.
    parameters : tuple of ParameterComparison
        Those that a record resolves, and always N, B and K.
    bias : ParameterComparison or None
        Of the means; None where they are not known.
    model : NoiseModel
        One for all records.
    """

    name: str
    kind: str
    unit: str
    channels: tuple[str, ...]
    family: FamilyName
    families: tuple[FamilyEvidence, ...]
    unexplained: tuple[str, ...] = ()
    apertures_differ: bool = False
    scale_uncertainty: float | None = None
    curves: tuple[ComparedCurve, ...] = field(repr=False)
    tau: Array = field(repr=False)
    lag_p: Array = field(repr=False)
    lag_p_adjusted: Array = field(repr=False)
    curve: Equality
    joint: Equality
    p: float
    outlier: Outlier | None
    parameters: tuple[ParameterComparison, ...]
    bias: ParameterComparison | None
    model: NoiseModel = field(repr=False)

    @property
    def every_parameter(self) -> tuple[ParameterComparison, ...]:
        """The parameters, and the bias where it is known."""
        return (*self.parameters, *([] if self.bias is None else [self.bias]))

    def __getitem__(self, symbol: str) -> ParameterComparison:
        """One parameter."""
        for p in self.every_parameter:
            if p.symbol == symbol:
                return p
        raise KeyError(symbol)


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison(Result):
    """Several records: equal or not, and how much they scatter.

    Attributes
    ----------
    verdict : ComparisonVerdict
        "differ" or "no difference", of the noise; the bias is judged apart.
    p : float
        Probability of noise that differs so much, if it is the same in all records and channels.
    records : tuple of ComparedRecord
        In their order.
    channels : tuple of ChannelComparison
        Those that are compared.
    level : float
        Of the tests: records of one noise are called different so often at most.
    confidence : float
        Of the intervals.
    """

    FORMAT: ClassVar[str] = "allanite-comparison"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("verdict", "p")

    records: tuple[ComparedRecord, ...]
    channels: tuple[ChannelComparison, ...]
    level: float
    confidence: float

    def __getitem__(self, name: str) -> ChannelComparison:
        """One channel."""
        for c in self.channels:
            if c.name == name:
                return c
        raise KeyError(name)

    @property
    def p(self) -> float:
        """Probability of noise that differs so much, if it is the same in all records and channels."""
        return min(min(c.p for c in self.channels) * len(self.channels), 1.0)

    @property
    def verdict(self) -> ComparisonVerdict:
        """Of the noise; the bias is judged apart."""
        return ComparisonVerdict.DIFFER if self.p < self.level else ComparisonVerdict.NO_DIFFERENCE

    @property
    def reason(self) -> str:
        """Which channels differ, and in what; or what was looked at."""
        if self.verdict is ComparisonVerdict.NO_DIFFERENCE:
            return agreement_sentence(len(self.records), len(self.channels), self.p)
        limit = self.level / len(self.channels)
        return "; ".join(self._difference(c) for c in self.channels if c.p < limit)

    def _difference(self, c: ChannelComparison) -> str:
        symbols = [p.symbol for p in c.parameters if p.equality and p.equality.p_adjusted < self.level]
        outlier = c.outlier if c.outlier is not None and c.outlier.p < self.level else None
        record, agree = ("", True) if outlier is None else (outlier.record, outlier.rest_p >= self.level)
        return difference_words(c.name, symbols, record, agree=agree)

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        from allanite.stability.record_comparison.version_1 import upgraded

        return upgraded(data) if data.get("version") == 1 else data
