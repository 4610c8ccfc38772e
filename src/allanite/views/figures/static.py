# SPDX-License-Identifier: BSD-3-Clause
"""A hand-moved log with its static spans: how much it moves, its rates, its accelerations, the spans numbered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from allanite.experiments.static_spans import StaticSpans
from allanite.plain_files.counted import plural
from allanite.quantities.display_units import display_unit
from allanite.recording.records import Recording
from allanite.study.result_document import Overview
from allanite.views.figures.curves import series_colours
from allanite.views.figures.panel import Axis, Curve, Envelope, Panel, ShadedSpan, SpanKind, array
from allanite.views.figures.records import clock, overview

__all__ = ["VIEWS", "level_panels", "overviews_of", "record_panels"]

VIEWS = ("whole", "level", "record")
_APART = 0.012  # width of a digit over a span, as a part of the panel
_LOWEST = 1e-2  # of the threshold: what moves less is of no interest
#: How stretches that are no rest are shaded, by the reason; others are not.
_KINDS: Mapping[str, SpanKind] = {
    "missing": "gap", "frozen": "disturbed", "turning": "disturbed", "held": "disturbed", "smooth": "disturbed",
}  # fmt: skip


def overviews_of(spans: StaticSpans, recording: Recording | Sequence[Overview] | None) -> Sequence[Overview]:
    """What a picture of each channel needs: of the record, where that is given."""
    if isinstance(recording, Recording):
        return [Overview.from_json(overview(recording, name)) for name in spans.channels or recording.names]
    return recording or ()


def level_panels(spans: StaticSpans) -> list[Panel]:
    """How much the unit moves against the threshold; nothing for spans that were given."""
    level = spans.level
    if level is None:
        return []
    _, second = clock(spans.duration)
    ratio = level.ratio
    curve = Curve(
        x=level.time / second,
        y=np.where(ratio > 0, np.maximum(ratio, _LOWEST), np.where(np.isnan(ratio), np.nan, _LOWEST)),
        label="largest of all axes and lengths",
        colour="z",
        style="thin",
    )
    frame = 0.0, spans.duration / second
    threshold = Curve(x=array(frame), y=array([1.0, 1.0]), label="threshold", colour="limit", style="dashed")
    return [
        Panel(
            title=_title(spans),
            x=_time(spans),
            y=Axis(label="Motion / threshold", log=True),
            curves=(curve, threshold),
            spans=_spans(spans),
            height=0.2,
            key="above",
        )
    ]


def record_panels(spans: StaticSpans, overviews: Sequence[Overview]) -> list[Panel]:
    """The rates and the accelerations; nothing without the record."""
    n = len(spans.gyro)
    parts = (
        (("Rates", overviews[:n]), ("Accelerations", overviews[n:]))
        if spans.channels
        else (("Record", overviews),)
    )
    return [_triad_panel(title, part, spans) for title, part in parts if part]


def _triad_panel(title: str, overviews: Sequence[Overview], spans: StaticSpans) -> Panel:
    _, second = clock(spans.duration)
    unit, factor = display_unit(overviews[0].kind, "sd", overviews[0].unit)
    looks = series_colours([one.name for one in overviews])
    envelopes = tuple(
        Envelope(
            x=one.t / second,
            low=one.low / factor,
            high=one.high / factor,
            label=one.name,
            colour=colour,
        )
        for one, (colour, _) in zip(overviews, looks, strict=True)
    )
    return Panel(
        title=title,
        x=_time(spans),
        y=Axis(label=f"[{unit}]"),
        envelopes=envelopes,
        spans=_spans(spans),
        height=0.26,
        key="above",
    )


def _title(spans: StaticSpans) -> str:
    share = f"{100 * spans.share:.3g} % of the record"
    return f"{plural(len(spans), 'static span')}, {share}" if len(spans) else "Nothing at rest"


def _time(spans: StaticSpans) -> Axis:
    unit, second = clock(spans.duration)
    return Axis(
        label=f"Time since the first sample [{unit}]",
        limits=(0.0, spans.duration / second),
        landmarks=_numbers(spans, second),
    )


def _numbers(spans: StaticSpans, second: float) -> tuple[tuple[float, str], ...]:
    """The number of each span, or its label, over its middle, where it does not touch the one before."""
    room, named = _APART * spans.duration / second, []
    free = -room
    for i, (span, times) in enumerate(zip(spans.spans, spans.times.tolist(), strict=True), 1):
        middle = 0.5 * sum(times) / second
        text = span.label or str(i)
        half = 0.5 * room * max(len(text), 1)
        if middle - half >= free:
            named.append((middle, text))
            free = middle + half
    return tuple(named)


def _spans(spans: StaticSpans) -> tuple[ShadedSpan, ...]:
    _, second = clock(spans.duration)
    quiet = [
        ShadedSpan(start=a / second, stop=b / second, kind="quiet", text=f"static span {i}")
        for i, (a, b) in enumerate(spans.times.tolist(), 1)
    ]
    rate = spans.rate * second
    moving = [
        ShadedSpan(start=part.start / rate, stop=part.stop / rate, kind=_KINDS[part.why], text=part.why)
        for part in spans.moving
        if part.why in _KINDS
    ]
    return (*quiet, *moving)
