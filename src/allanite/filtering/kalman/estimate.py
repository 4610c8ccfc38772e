# SPDX-License-Identifier: BSD-3-Clause
"""A filtered channel as documents hold it: level, terms, what the innovations say, and how it was filtered."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from enum import StrEnum
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.filtering.kalman.consistency import Consistency, FilterVerdict
from allanite.filtering.kalman.series import SeriesEnvelope
from allanite.filtering.kalman.version_1 import upgraded
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.result import Result

__all__ = ["FilterConditions", "FilterEstimate", "FilterRemark", "TermSeries", "TestedFilter"]

Array = NDArray[np.float64]

_FAMILIES = {"flicker": "flicker", "gauss-markov": "a Gauss-Markov term"}


class FilterRemark(StrEnum):
    """What is to be known of a filtered channel."""

    LEVEL = "level holds the bias"
    NO_DRIFT = "no drift in the model"
    FLICKER = "flicker as states"
    UNDECIDED = "noise not decided"
    ROUNDING = "square root"
    LEFT_OUT = "rows left out"


@dataclass(frozen=True, slots=True, kw_only=True)
class TermSeries(Result):
    """One part of the noise through the record, at no more instants than a picture needs.

    Attributes
    ----------
    t : ndarray, shape (n_instants,) [s]
        Since the beginning of the record.
    value, sd : ndarray, shape (n_instants,) [SI]
        Estimate and its standard deviation; NaN and infinity before anything is known.
    """

    t: Array = field(repr=False)
    value: Array = field(repr=False)
    sd: Array = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterConditions(Result):
    """How a channel was filtered.

    Attributes
    ----------
    remarks : tuple of FilterRemark
        Codes of what is to be known.
    drifting : bool
        The model holds a drift that can be removed.
    flicker_states : int or None
        Gauss-Markov states that flicker is filtered as; None without flicker.
    families : tuple of str or None
        The family of the model that was filtered, and the other that its record could not tell from it.
    cautious : bool
        Of two families the one that drifts more over half of the record was taken.
    broke : int
        Rows that broke the covariance by rounding, so that the square-root form was used.
    left_out : int
        Rows that differ where the model says that they hold no noise.
    """

    STATED: ClassVar[tuple[str, ...]] = ("remarks",)

    drifting: bool
    flicker_states: int | None = None
    families: tuple[str, str] | None = None
    cautious: bool = True
    broke: int = 0
    left_out: int = 0

    @property
    def remarks(self) -> tuple[FilterRemark, ...]:
        """Codes of what is to be known."""
        return tuple(code for code, _ in self._remarks())

    @property
    def notes(self) -> tuple[str, ...]:
        """The remarks in sentences."""
        return tuple(says for _, says in self._remarks())

    def _remarks(self) -> Iterator[tuple[FilterRemark, str]]:
        yield (
            FilterRemark.LEVEL,
            "the level is the true mean plus the bias: one axis at rest cannot separate them",
        )
        if not self.drifting:
            yield (
                FilterRemark.NO_DRIFT,
                "the model has no drift, so nothing is removed from the samples",
            )
        if self.flicker_states is not None:
            many = self.flicker_states > 1
            form = f"a sum of {self.flicker_states} states" if many else "one Gauss-Markov state"
            yield FilterRemark.FLICKER, f"flicker is filtered as {form}"
        if self.families is not None:
            first, other = (_FAMILIES.get(name, name or "another model") for name in self.families)
            why = ", which drifts more over half of this record" if self.cautious else ""
            open_ = f"the fitted record could not distinguish {first} from {other}"
            yield FilterRemark.UNDECIDED, f"{open_}; this filter models {first}{why}"
        if self.broke:
            yield (
                FilterRemark.ROUNDING,
                f"rounding broke the covariance in {self.broke} rows: the square-root form was used instead",
            )
        if self.left_out:
            yield (
                FilterRemark.LEFT_OUT,
                f"{self.left_out} rows were left out: the model gives them no noise, yet they differ",
            )


class TestedFilter:
    """What a filtered channel says of itself."""

    __slots__ = ()
    consistency: Consistency
    conditions: FilterConditions

    @property
    def verdict(self) -> FilterVerdict:
        """What the innovations say of the model."""
        return self.consistency.verdict

    @property
    def reason(self) -> str:
        """Why."""
        return self.consistency.reason

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know besides."""
        return self.conditions.notes


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterEstimate(TestedFilter, Result):
    """A channel without its drift, of the long series no more than a picture needs.

    Attributes
    ----------
    verdict : FilterVerdict
        "consistent", "not tested", or "the model does not hold".
    channel, kind, unit : str
        Name, kind of the samples in SI, and unit of every number here.
    rate : float [Hz]
        Samples per second.
    samples : int
        Missing ones included.
    smoothed : bool
        The drift at each sample is estimated from the whole record, not from the samples up to it.
    form : str
        "covariance" or "square root".
    states : int
        The level included.
    model : NoiseModel
        The model that was used.
    level, level_sd : float [SI]
        The constant under the drift, and its standard deviation.
    mean_measured, mean_corrected : float [SI]
        Plain means of the samples, before and after.
    log_likelihood : float
        Of the record.
    consistency : Consistency
        Size and whiteness of the innovations.
    conditions : FilterConditions
        How it was filtered.
    terms : mapping of str to TermSeries
        Each slow term by its type, and the level as it becomes known.
    measured, corrected : SeriesEnvelope or None
        Samples before and after; None where an early version did not hold them.
    drift, drift_sd : SeriesEnvelope
        Sum of all slow noise in each sample, and its standard deviation.
    """

    FORMAT: ClassVar[str] = "allanite-filtered"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("verdict",)

    channel: str
    kind: str
    unit: str
    rate: float
    samples: int
    smoothed: bool
    form: str
    states: int
    model: NoiseModel
    level: float
    level_sd: float
    mean_measured: float
    mean_corrected: float
    log_likelihood: float
    consistency: Consistency
    conditions: FilterConditions
    terms: Mapping[str, TermSeries] = field(repr=False)
    measured: SeriesEnvelope | None = field(default=None, repr=False)
    corrected: SeriesEnvelope = field(repr=False)
    drift: SeriesEnvelope = field(repr=False)
    drift_sd: SeriesEnvelope = field(repr=False)

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        return upgraded(data) if data.get("version") == 1 else data
