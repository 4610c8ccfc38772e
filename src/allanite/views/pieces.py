# SPDX-License-Identifier: BSD-3-Clause
"""Pieces that every page is made of: figures drawn twice, findings, provenance."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import Any
from urllib.parse import quote

from allanite.lazy_dataclasses import dataclass
from allanite.recording.health.finding import Finding
from allanite.views.figures.panel import Sheet
from allanite.views.figures.picture import svg
from allanite.views.figures.screen import spec
from allanite.views.wording.findings import finding_kinds, own_words
from allanite.views.wording.rates import model_words

__all__ = [
    "Figure",
    "FindingRow",
    "clock",
    "finding_row",
    "finding_rows",
    "origin_rows",
]

Json = Mapping[str, Any]
_MOST_SAID = 12  # entries of a list in the history that are spelled out
_SAFE_IN_URI = " !$&'()*+,-./:;=?@[]^_`{|}~\n"  # leaves an SVG readable, and half as long as base64 would


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A figure of the page: `spec` is drawn by the script, `still` (an SVG as data URI) stands in for it.

    Attributes
    ----------
    id, caption, words : str
        `words` say what is to be seen to those who cannot see it.
    sheet : Sheet
    """

    id: str
    caption: str
    words: str
    sheet: Sheet

    @property
    def spec(self) -> Json:
        """The panels as plain data."""
        return spec(self.sheet)

    @property
    def still(self) -> str:
        """The picture."""
        return "data:image/svg+xml," + quote(svg(self.sheet), safe=_SAFE_IN_URI)


@dataclass(frozen=True, slots=True, kw_only=True)
class FindingRow:
    """A finding as tables show it, in texts; `places` are times."""

    code: str
    severity: str
    advice: str
    risk: str
    count: int
    accepted: bool
    message: str
    channel: str
    places: str


def finding_row(finding: Finding, rate: float) -> FindingRow:
    """A finding; `rate` turns its samples into times."""
    return FindingRow(
        code=finding.code,
        severity=finding.severity.value,
        advice=finding.advice,
        risk=finding.risk,
        count=finding.count,
        accepted=finding.accepted,
        message=own_words(finding),
        channel=finding.channel or "all channels",
        places=_places(finding, rate),
    )


def finding_rows(findings: Iterable[Finding], rate: float) -> list[list[FindingRow]]:
    """Findings of one kind together, the worst first."""
    return [[finding_row(f, rate) for f in kind] for kind in finding_kinds(findings)]


def _places(finding: Finding, rate: float) -> str:
    spans = [f"{clock(a / rate)} to {clock(b / rate)}" for a, b in finding.places]
    covered = sum(b - a for a, b in finding.places)
    return "; ".join(spans) + (" and more" if spans and finding.count > covered else "")


def clock(seconds: float) -> str:
    """Hours, minutes and seconds since the first sample: a place that can be found again."""
    whole = math.floor(seconds)
    part = f"{seconds - whole:.3f}"[1:] if seconds != whole else ""
    return f"{whole // 3600}:{whole % 3600 // 60:02}:{whole % 60:02}{part}"


def origin_rows(
    made: Json, format_: str, version: int, history: Iterable[Json]
) -> list[tuple[str, str | tuple[str, ...]]]:
    """Where a result comes from: file, command, versions, and every step of the record's history.

    Each has its name, and a line for each thing that is known.
    """
    rows = [
        ("File", made.get("source")),
        ("SHA-256", made.get("sha256")),
        ("Command", made.get("command")),
        ("Made", str(made.get("created") or "").replace("T", " ").replace("Z", " UTC")),
        ("allanite", made.get("allanite")),
        ("Python, NumPy", ", ".join(str(v) for v in (made.get("python"), made.get("numpy")) if v)),
        (format_.removeprefix("allanite-").capitalize(), f"{format_} version {version}"),
    ]
    steps = [(f"Step {i}", _step(step)) for i, step in enumerate(history, 1)]
    return [*((name, str(value)) for name, value in rows if value), *steps]


def _step(step: Json) -> tuple[str, ...]:
    """Its name, and a line for each thing that is known of it."""
    known = {key: _said(part) for key, part in step.items() if key != "step"}
    lines = (f"{_spoken(key)}: {words}" for key, words in known.items() if words)
    return (_spoken(str(step.get("step", "step"))), *lines)


def _said(value: Any) -> str:
    """Nested plain data in words."""
    if isinstance(value, Mapping):
        if "terms" in value:
            with suppress(
                LookupError, TypeError, ValueError
            ):  # a history is free-form: anything may be called that
                return model_words(value)
        return ", ".join(f"{key} {words}" for key, part in value.items() if (words := _said(part)))
    if isinstance(value, list | tuple):
        return ", ".join(map(_said, value)) if len(value) <= _MOST_SAID else f"{len(value)} entries"
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _spoken(name: str) -> str:
    return name.replace("_", " ")
