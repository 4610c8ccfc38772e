# SPDX-License-Identifier: BSD-3-Clause
"""The shape of a study document, checked when one is read: every fault is reported at once, with its place."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

__all__ = ["StudyDocument", "faults"]

Number = float | None


class _Part(BaseModel):
    model_config = ConfigDict(extra="allow")


class ProvenanceEntry(_Part):
    allanite: str
    created: str
    source: str
    sha256: str | None = None
    command: str | None = None


class ChannelFacts(_Part):
    name: str
    kind: str
    unit: str
    scale: float
    sampling: Literal["mean", "point"]


class RecordingFacts(_Part):
    rate: float
    samples: int
    duration: float
    start: str | None
    missing: int
    missing_because: list[dict[str, Any]] = []
    gaps: list[tuple[int, int]]
    channels: list[ChannelFacts]
    history: list[dict[str, Any]]


class FindingEntry(_Part):
    code: str
    severity: Literal["info", "warning", "fatal"]
    channel: str | None
    message: str
    advice: str
    risk: str
    count: int
    places: list[tuple[int, int]]
    accepted: bool


class CurveEntry(_Part):
    statistic: str
    confidence: float
    dt: float
    n_samples: int
    sampling: Literal["mean", "point"]
    lags: list[int]
    tau: list[float]
    deviation: list[Number]
    lower: list[Number]
    upper: list[Number]
    edf: list[Number]
    count: list[Number]
    used: list[bool]


class EstimateEntry(_Part):
    symbol: str
    value: Number
    lower: Number
    upper: Number
    supported: bool


class ModelEntry(_Part):
    family: str
    verdict: str
    terms: list[dict[str, Any]]
    estimates: list[EstimateEntry]


class ChannelEntry(_Part):
    name: str
    kind: str
    unit: str
    mean: Number
    sd: Number
    overview: dict[str, list[Number]]
    curve: CurveEntry
    spectrum: dict[str, Any]
    models: list[ModelEntry]
    slopes: dict[str, Any]
    advice: list[dict[str, Any]]
    environment: dict[str, Any] | None = None
    aliasing: dict[str, Any] | None = None
    held: dict[str, Any] | None = None
    contamination: dict[str, Any] | None = None
    floor: dict[str, Any] | None = None


class StudyDocument(_Part):
    """study.json, version 1. Fields it does not know are kept."""

    format: Literal["allanite-study"]
    version: Literal[1]
    provenance: ProvenanceEntry
    recording: RecordingFacts
    findings: list[FindingEntry]
    channels: list[ChannelEntry]
    floor: dict[str, Any] | None = None


def faults(document: Mapping[str, Any]) -> list[str]:
    """Everything wrong with a document, "where: what"; empty when it is a study."""
    try:
        StudyDocument.model_validate(document)
    except ValidationError as error:
        return [f"{'.'.join(str(p) for p in e['loc'])}: {e['msg']}" for e in error.errors()]
    return []
