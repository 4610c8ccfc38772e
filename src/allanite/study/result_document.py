# SPDX-License-Identifier: BSD-3-Clause
"""A result as a document: with the record it comes from, what was found in that, and what made it.

The document on disk is that of the result, with "provenance", "recording", "findings", "model_name" and, where a report
draws the record, "overview" beside its own fields; with "files" where each position has one. Reports, tables and
pictures are made from it alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.json_values import plain
from allanite.quantities.result import Result
from allanite.recording.health.finding import Finding
from allanite.recording.records import Channel, Recording

__all__ = [
    "Origin",
    "Overview",
    "PositionFile",
    "Provenance",
    "RecordFacts",
    "Reportable",
    "ResultDocument",
    "read_document",
]

Array = NDArray[np.float64]

R = TypeVar("R", bound=Result, covariant=True)
K = TypeVar("K", bound=Result)


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance(Result):
    """What made a result, and when.

    Attributes
    ----------
    allanite, python, numpy : str
        Versions.
    created : str
        UTC.
    source : str
        Name of the record.
    sha256 : str or None
        SHA-256 of its file.
    command : str or None
        Command as typed.
    """

    allanite: str
    created: str
    source: str
    sha256: str | None
    command: str | None
    python: str
    numpy: str


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordFacts(Result):
    """The record that a result comes from.

    Attributes
    ----------
    rate : float [Hz]
        Samples per second.
    samples : int
        Of each channel.
    duration : float [s]
        From the first sample to the end of the last.
    channels : tuple of Channel
        Name, kind and unit of each.
    history : tuple of mapping
        What was done to it, step by step.
    """

    rate: float
    samples: int
    duration: float
    channels: tuple[Channel, ...]
    history: tuple[Mapping[str, object], ...]

    @classmethod
    def of(cls, recording: Recording) -> RecordFacts:
        """Those of a recording."""
        return cls(
            rate=recording.rate,
            samples=recording.n_samples,
            duration=recording.duration,
            channels=recording.channels,
            history=recording.history,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Overview(Result):
    """What a picture of one channel of the record needs.

    Attributes
    ----------
    name, kind, unit : str
        Of the channel.
    t : ndarray, shape (n,) [s]
        Middle of each block, since the first sample.
    low, high : ndarray, shape (n,) [SI unit of the channel]
        Lowest and highest sample of each block; NaN where it has none.
    gaps : tuple of (float, float) [s]
        The longest runs of missing samples.
    duration : float [s]
        Of the record; 0 where an early version did not state it.
    """

    name: str
    kind: str
    unit: str
    t: Array
    low: Array
    high: Array
    gaps: tuple[tuple[float, float], ...]
    duration: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionFile(Result):
    """A file of one position.

    Attributes
    ----------
    file : str
        Its name as it was given.
    sha256 : str or None
        Its digest.
    heading : float or None [rad]
        From the mark; None where nobody gave it.
    """

    file: str
    sha256: str | None
    heading: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin(Result):
    """The parts of a document beside the fields of its result.

    Attributes
    ----------
    provenance : Provenance or None
        None where the result was never written.
    recording : RecordFacts or None
        None where there is no record.
    findings : tuple of Finding or None
        None where nobody looked.
    model_name : str
        Of the noise model that was given; "" for none.
    overview : Overview or None
        Of the channel whose record the report draws; None where it draws none.
    overviews : tuple of Overview or None
        Of the channels, where the report draws several; None where it does not.
    files : tuple of PositionFile or None
        Of positions that were recorded one by one; None of one log.
    """

    provenance: Provenance | None = None
    recording: RecordFacts | None = None
    findings: tuple[Finding, ...] | None = None
    model_name: str = ""
    overview: Overview | None = None
    overviews: tuple[Overview, ...] | None = None
    files: tuple[PositionFile, ...] | None = None


class Reportable(Protocol):
    """A result with where it comes from: a `ResultDocument`, or a `Study`, which holds that itself."""

    @property
    def result(self) -> Result:
        """The result."""

    @property
    def provenance(self) -> Provenance | None:
        """What made it."""

    @property
    def recording(self) -> RecordFacts | None:
        """Its record."""

    @property
    def findings(self) -> tuple[Finding, ...] | None:
        """What was found in that."""

    def to_json(self) -> dict[str, object]:
        """Plain data."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ResultDocument(Origin, Generic[R]):
    """A result with everything that a report of it needs.

    Attributes
    ----------
    result : Result
        The rest is its `Origin`.
    """

    result: R

    def to_json(self) -> dict[str, object]:
        """Plain data, SI units; what nobody knows is left out."""
        origin = {f.name: plain(getattr(self, f.name)) for f in fields(Origin)}
        return {
            **self.result.to_json(),
            **{name: value for name, value in origin.items() if value is not None},
        }


def read_document(kind: type[K], data: Mapping[str, object]) -> ResultDocument[K]:
    """The document of a result of one kind, out of plain data.

    Raises
    ------
    FormatError
        As for `Result.from_json`.
    """
    present = kind._upgraded(data)
    origin = Origin.from_json(present)
    return ResultDocument(
        result=kind.from_json(present), **{f.name: getattr(origin, f.name) for f in fields(Origin)}
    )
