# SPDX-License-Identifier: BSD-3-Clause
"""How a run was recorded, and what is missing in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from allanite.quantities.number_words import duration

if TYPE_CHECKING:
    from allanite.study.results import MissingSamples

__all__ = ["missing_lines", "record_facts"]

Json = Mapping[str, Any]

_SHOWN_SETTINGS = 40


def missing_lines(entries: Iterable[MissingSamples], rate: float) -> list[tuple[str, str, str, str, str]]:
    """What is missing and why: reason, gaps, samples, the longest, where the first begins."""
    return [
        (
            e.reason,
            "–" if e.gaps is None else str(e.gaps),
            str(e.samples),
            "–" if e.longest is None else duration(e.longest / rate),
            "–" if e.first is None else duration(e.first / rate),
        )
        for e in entries
    ]


def record_facts(history: Iterable[Json]) -> list[tuple[str, str]]:
    """How a run was recorded, of each run that a recording is made of: names and values."""
    return [fact for step in history if step.get("step") == "record" for fact in _recorded(step)]


def _recorded(step: Json) -> Iterable[tuple[str, str]]:
    named = (step["instrument"].get(key) for key in ("maker", "model", "serial"))
    firmware = step["instrument"].get("firmware")
    text = " ".join(str(part) for part in named if part) or "not known"
    yield "instrument", text + (f", firmware {firmware}" if firmware else "")
    yield "run", f"{step['run']}: {step['status']}, by allanite {step['software']}"
    if step.get("aperture"):
        yield "aperture", duration(step["aperture"])
    if step.get("scale_date"):
        yield "scale factor of", str(step["scale_date"])
    settings = [f"{key} {_value(value)}" for key, value in sorted(step["settings"].items())]
    if settings:
        more = ", …" if len(settings) > _SHOWN_SETTINGS else ""
        yield "settings", ", ".join(settings[:_SHOWN_SETTINGS]) + more


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, float):
        return f"{value:.9g}"
    if isinstance(value, list):
        return "/".join(_value(v) for v in value)
    return str(value)
