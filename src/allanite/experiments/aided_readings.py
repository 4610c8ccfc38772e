# SPDX-License-Identifier: BSD-3-Clause
"""What the filter that is told the rate makes of a record, as documents hold it: it is no measurement."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.reversals import Reversals
from allanite.filtering.kalman import TermSeries
from allanite.filtering.kalman.series import SeriesEnvelope
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.earlier_documents import Entry, entries, first_match, texts
from allanite.quantities.result import Result

__all__ = ["AidedMeans", "AidedReading", "AidedStatement", "AidedTake", "ReadingKind", "RunningMeans"]

Array = NDArray[np.float64]
ReadingKind = Literal["unsigned", "demodulated"]

#: A note of version 1.
_LEFT_OUT = re.compile(r"the filter has no state for (\w+): it is left out")


class AidedStatement:
    """What a reading says of itself."""

    __slots__ = ()
    reading: ReadingKind
    follows: float
    left_out: tuple[str, ...]

    @property
    def measurement(self) -> bool:
        """It is none."""
        return False

    @property
    def statement(self) -> str:
        """What the mean of the corrected samples is, and is not."""
        moved = f"a change of the reference by 1 changes the mean by {self.follows:.2f}"
        if self.reading == "unsigned":
            return (
                "Reference-aided: this does not measure the rate. The filter was given the rate, and the mean of the "
                f"corrected samples follows that reference, not the sensor: {moved}"
            )
        return (
            "Reference-aided: this does not measure the rate. The filter was given the rate, with the sign of each "
            f"heading; the mean comes only partly from the sensor ({moved}), and part of the signal is removed as "
            "flicker. The pairs and the regression estimate the rate without a reference"
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """Terms of the model that the filter has no state for, in sentences."""
        return tuple(f"the filter has no state for {name} and omits it" for name in self.left_out)


@dataclass(frozen=True, slots=True, kw_only=True)
class AidedMeans(Result):
    """Means of one reading.

    Attributes
    ----------
    reading : "unsigned" or "demodulated"
        What the means are taken of: the samples, or the samples times their sign.
    mean_reference, mean_raw, mean_corrected : float [SI]
        Over the whole record: of what was typed in, of the sensor, and of the corrected samples.
    follows : float
        By how much `mean_corrected` moves for each unit that the reference is moved.
    """

    reading: ReadingKind
    mean_reference: float
    mean_raw: float
    mean_corrected: float
    follows: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RunningMeans(Result):
    """Means of the samples so far, at no more instants than a picture needs.

    Attributes
    ----------
    t : ndarray, shape (n_instants,) [s]
        Since the beginning of the record.
    raw, corrected : ndarray, shape (n_instants,) [SI]
        Of the samples, and of the corrected ones; NaN before the first.
    reference : ndarray, shape (n_instants,) [SI]
        What the filter was told at that sample.
    """

    t: Array = field(repr=False)
    raw: Array = field(repr=False)
    corrected: Array = field(repr=False)
    reference: Array = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class AidedReading(AidedStatement, AidedMeans):
    """One reading of a record through the filter that is told the rate.

    Attributes
    ----------
    measurement : bool
        False: it is none.
    rate : float [Hz]
        Samples per second.
    exact : bool
        Exact process noise in place of the paper's first order.
    left_out : tuple of str
        Terms of the model that the filter has no state for.
    corrected : SeriesEnvelope
        Samples less both states.
    running : RunningMeans
        Means so far.
    states : tuple of TermSeries or None
        Flicker and random walk as the filter estimates them; None in the documents of `filter`.
    """

    STATED: ClassVar[tuple[str, ...]] = ("measurement",)

    rate: float
    exact: bool
    left_out: tuple[str, ...] = ()
    corrected: SeriesEnvelope
    running: RunningMeans
    states: tuple[TermSeries, ...] | None = None

    @property
    def duration(self) -> float:
        """Length of the record [s], from the middles of its blocks; the last one may be shorter."""
        t = self.corrected.t
        return float(2 * (t[-1] - (len(t) - 1) * t[0]))


@dataclass(frozen=True, slots=True, kw_only=True)
class AidedTake(Result):
    """A record through the filter that is told the rate, in its readings.

    Attributes
    ----------
    channel : str
        Of the rate sensor.
    readings : tuple of AidedReading
        Unsigned, and demodulated where there are turns.
    model : NoiseModel or None
        Of the sensor; None where only the result of one reading is at hand.
    reversals : Reversals or None
        Turns, which are left out; None as for `model`.
    """

    FORMAT: ClassVar[str] = "allanite-reference-aided"
    VERSION: ClassVar[int] = 2

    channel: str
    readings: tuple[AidedReading, ...]
    model: NoiseModel | None = None
    reversals: Reversals | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """Those of all readings, each once."""
        return tuple(dict.fromkeys(note for reading in self.readings for note in reading.notes))

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        """Version 1 was of one reading, or listed several; it held notes, and corrected samples as an overview."""
        if data.get("version") != 1:
            return data
        readings = entries(data["readings"]) if "readings" in data else [data]
        rest = {name: value for name, value in data.items() if name != "overview"}
        return {**rest, "version": 2, "readings": [_reading(reading) for reading in readings]}


def _reading(reading: Entry) -> dict[str, object]:
    matches = (first_match(_LEFT_OUT, [note]) for note in texts(reading.get("notes")))
    left_out = [match[1] for match in matches if match is not None]
    return {**reading, "corrected": reading.get("overview"), "left_out": left_out}
