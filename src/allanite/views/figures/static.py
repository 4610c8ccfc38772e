# SPDX-License-Identifier: BSD-3-Clause
"""A hand-moved log with its static spans: how much it moves, its rates, its accelerations, the spans numbered.

Everything is drawn from the plain document of a `StaticSpans`, with "overviews" of the channels beside it where the
record is given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from allanite.quantities.display_units import display_unit
from allanite.recording.records import Recording
from allanite.views.figures.curves import series_colours
from allanite.views.figures.panel import Axis, Curve, Envelope, Panel, ShadedSpan, array
from allanite.views.figures.records import clock, overview

__all__ = ["VIEWS", "document_of", "level_panels", "record_panels"]

Json = Mapping[str, Any]

VIEWS = ("whole", "level", "record")
_APART = 0.012  # width of a digit over a span, as a part of the panel
_LOWEST = 1e-2  # of the threshold: what moves less is of no interest


def document_of(spans: Any, recording: Recording | None) -> Json:
    """The document of `StaticSpans`, with the overviews of its channels where their record is given."""
    document: Json = spans if isinstance(spans, Mapping) else spans.to_json()
    if recording is None:
        return document
    names = [*document["gyro"], *document["accelerometer"]] or list(recording.names)
    return {**document, "overviews": [overview(recording, name) for name in names]}


def level_panels(document: Json) -> list[Panel]:
    """How much the unit moves against the threshold; nothing for spans that were given."""
    level = document.get("level")
    if level is None:
        return []
    _, second = clock(document["duration"])
    ratio = array(level["ratio"])
    curve = Curve(
        x=array(level["time"]) / second,
        y=np.where(ratio > 0, np.maximum(ratio, _LOWEST), np.where(np.isnan(ratio), np.nan, _LOWEST)),
        label="largest of all axes and lengths",
        colour="z",
        style="thin",
    )
    frame = 0.0, document["duration"] / second
    threshold = Curve(x=array(frame), y=array([1.0, 1.0]), label="threshold", colour="limit", style="dashed")
    return [
        Panel(
            title=_title(document),
            x=_time(document),
            y=Axis(label="Motion / threshold", log=True),
            curves=(curve, threshold),
            spans=_spans(document),
            height=0.2,
            key="above",
        )
    ]


def record_panels(document: Json) -> list[Panel]:
    """The rates and the accelerations; nothing without the record."""
    overviews = document.get("overviews", [])
    n = len(document["gyro"])
    parts: tuple[tuple[str, Sequence[Json]], ...]
    parts = (
        (("Rates", overviews[:n]), ("Accelerations", overviews[n:]))
        if document["gyro"] + document["accelerometer"]
        else (("Record", overviews),)
    )
    return [_triad_panel(title, part, document) for title, part in parts if part]


def _triad_panel(title: str, overviews: Sequence[Json], document: Json) -> Panel:
    _, second = clock(document["duration"])
    unit, factor = display_unit(overviews[0]["kind"], "sd", overviews[0]["unit"])
    looks = series_colours([one["name"] for one in overviews])
    envelopes = tuple(
        Envelope(
            x=array(one["t"]) / second,
            low=array(one["low"]) / factor,
            high=array(one["high"]) / factor,
            label=one["name"],
            colour=colour,
        )
        for one, (colour, _) in zip(overviews, looks, strict=True)
    )
    return Panel(
        title=title,
        x=_time(document),
        y=Axis(label=f"[{unit}]"),
        envelopes=envelopes,
        spans=_spans(document),
        height=0.26,
        key="above",
    )


def _title(document: Json) -> str:
    n = len(document["spans"])
    share = f"{100 * document['share']:.3g} % of the record"
    return "Nothing at rest" if n == 0 else f"{n} static span{'s' * (n != 1)}, {share}"


def _time(document: Json) -> Axis:
    unit, second = clock(document["duration"])
    return Axis(
        label=f"Time since the first sample [{unit}]",
        limits=(0.0, document["duration"] / second),
        landmarks=_numbers(document, second),
    )


def _numbers(document: Json, second: float) -> tuple[tuple[float, str], ...]:
    """The number of each span, or its label, over its middle, where it does not touch the one before."""
    room, named = _APART * document["duration"] / second, []
    free = -room
    for i, span in enumerate(document["spans"], 1):
        middle = 0.5 * (span["start_s"] + span["stop_s"]) / second
        text = span["label"] or str(i)
        half = 0.5 * room * max(len(text), 1)
        if middle - half >= free:
            named.append((middle, text))
            free = middle + half
    return tuple(named)


def _spans(document: Json) -> tuple[ShadedSpan, ...]:
    _, second = clock(document["duration"])
    spans = [
        ShadedSpan(
            start=s["start_s"] / second, stop=s["stop_s"] / second, kind="quiet", text=f"static span {i}"
        )
        for i, s in enumerate(document["spans"], 1)
    ]
    rate = document["rate"] * second
    kinds = {
        "missing": "gap",
        "frozen": "disturbed",
        "turning": "disturbed",
        "held": "disturbed",
        "smooth": "disturbed",
    }
    for part in document["moving"]:
        if part["why"] in kinds:
            kind: Any = kinds[part["why"]]
            spans.append(
                ShadedSpan(start=part["start"] / rate, stop=part["stop"] / rate, kind=kind, text=part["why"])
            )
    return tuple(spans)
