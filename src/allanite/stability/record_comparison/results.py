# SPDX-License-Identifier: BSD-3-Clause
"""Comparison: what several records say of one another, and of the kind of sensor behind them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.plain_files.json_values import plain

__all__ = [
    "DIFFER",
    "SAME",
    "ChannelComparison",
    "ComparedCurve",
    "ComparedRecord",
    "Comparison",
    "Equality",
    "Outlier",
    "ParameterComparison",
    "RecordParameter",
    "SensorSpread",
]

Array = NDArray[np.float64]

SAME, DIFFER = "no difference seen", "the records differ"


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparedRecord:
    """One of the records.

    Attributes
    ----------
    name, source : str
    sha256 : str or None
    rate : float [Hz]
    duration : float [s]
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
class RecordParameter:
    """A parameter of one record [SI].

    Attributes
    ----------
    value : float or None
        None where the record gives only a limit.
    lower, upper : float
        Ends of its interval; `upper` may be infinite.
    supported : bool
        The interval is bounded on both sides.
    """

    value: float | None
    lower: float
    upper: float
    supported: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Equality:
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
class Outlier:
    """The record that differs most from the others.

    Attributes
    ----------
    record : str
    p : float
        Probability of a record that differs so much, adjusted for the number looked at.
    looked_at : int
    rest_p : float
        Equality of the others without it.
    """

    record: str
    p: float
    looked_at: int
    rest_p: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSpread:
    """Middle and spread of the kind of sensor [SI].

    Attributes
    ----------
    resolved : int
        Records that resolve the parameter.
    mean, lower, upper : float
        Of a parameter that cannot be negative: the median of the population.
    spread, spread_lower, spread_upper : float
        Standard deviation between records: of the natural logarithm, or [SI] for a bias; 0 to `spread_upper` where
        none is seen.
    next_lower, next_upper : float or None
        Interval of the true value of the next record.
    """

    resolved: int
    mean: float
    lower: float
    upper: float
    spread: float
    spread_lower: float
    spread_upper: float
    next_lower: float | None
    next_upper: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterComparison:
    """One parameter in all records.

    Attributes
    ----------
    symbol : str
        Q, N, B, B_equiv, T, q, K, R, or "mean" for the bias.
    records : tuple of RecordParameter
    equality : Equality or None
        None where fewer than two records say anything of it.
    common : RecordParameter
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
    records: tuple[RecordParameter, ...]
    equality: Equality | None
    common: RecordParameter
    detectable: float | None
    population: SensorSpread | None
    worst: str | None
    worst_p: float | None
    outlier: Outlier | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparedCurve:
    """The Allan curve of one record.

    Attributes
    ----------
    tau, deviation, lower, upper : ndarray, shape (n,)
    used : ndarray of bool, shape (n,)
        Lags that are compared.
    """

    tau: Array
    deviation: Array
    lower: Array
    upper: Array
    used: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelComparison:
    """One channel in all records.

    Attributes
    ----------
    name, kind, unit : str
    channels : tuple of str
        Its name in each record.
    family : "flicker" or "gauss-markov"
        Under which the parameters are compared.
    families : tuple of str
        What each record supports by itself: one of the two, "both" or "neither".
    curves : tuple of ComparedCurve
    tau : ndarray [s]
        Lags that are compared.
    lag_p, lag_p_adjusted : ndarray
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
    bias : ParameterComparison or None
        Of the means; None where they are not known.
    model : dict
        One noise model for all records, as plain data.
    """

    name: str
    kind: str
    unit: str
    channels: tuple[str, ...]
    family: str
    families: tuple[str, ...]
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
    model: Mapping[str, Any] = field(repr=False)

    def __getitem__(self, symbol: str) -> ParameterComparison:
        """One parameter."""
        for p in (*self.parameters, *([self.bias] if self.bias else [])):
            if p.symbol == symbol:
                return p
        raise KeyError(symbol)


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Several records: equal or not, and how much they scatter.

    Attributes
    ----------
    records : tuple of ComparedRecord
    channels : tuple of ChannelComparison
    level : float
        Of the tests: records of one noise are called different so often at most.
    confidence : float
    remarks : tuple of str
        What a reader must know besides.
    """

    records: tuple[ComparedRecord, ...]
    channels: tuple[ChannelComparison, ...]
    level: float
    confidence: float
    remarks: tuple[str, ...] = ()

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
    def verdict(self) -> str:
        """ "no difference seen" or "the records differ", of the noise; the bias is told apart."""
        return DIFFER if self.p < self.level else SAME

    @property
    def reason(self) -> str:
        """Which channels differ, and in what; or what was looked at."""
        if self.verdict == SAME:
            many = f"{len(self.channels)} channels" if len(self.channels) > 1 else "the curves and parameters"
            return f"{many} of {len(self.records)} records agree within their intervals (p = {self.p:.2g})"
        limit = self.level / len(self.channels)
        return "; ".join(self._difference(c) for c in self.channels if c.p < limit)

    def _difference(self, c: ChannelComparison) -> str:
        what = [p.symbol for p in c.parameters if p.equality and p.equality.p_adjusted < self.level]
        words = f"{c.name} in {', '.join(what)}" if what else f"{c.name} in its curve"
        if c.outlier is not None and c.outlier.p < self.level:
            agree = "agree" if c.outlier.rest_p >= self.level else "differ, too"
            words += f"; {c.outlier.record} stands out, the others {agree}"
        return words

    def to_json(self) -> dict[str, Any]:
        """Plain data, SI units; null for what does not exist, and for infinity."""
        names = ("verdict", "reason", "p", "level", "confidence", "records", "channels", "remarks")
        return {
            "format": "allanite-comparison",
            "version": 1,
            **{name: plain(getattr(self, name)) for name in names},
        }
