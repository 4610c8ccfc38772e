# SPDX-License-Identifier: BSD-3-Clause
"""A record of a sensor that was turned: the whole of it with its turns marked, and a part of it at closer range."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from allanite.errors import InputError
from allanite.experiments.reversals.sides import direction_of
from allanite.quantities.display_units import display_unit
from allanite.recording.records import Kind, Recording
from allanite.views.figures.panel import Array, Axis, Envelope, Panel, Rug, ShadedSpan, SpanKind, array
from allanite.views.figures.records import clock, overview

__all__ = ["only_rate", "reversals_of", "turned_panel", "turned_panels", "window_panels", "zoom_window"]

Json = Mapping[str, Any]
Limits = tuple[float, float]

_MOST_TURNS = 40  # shown as spans; more than these become strokes at the foot
_MOST_NAMED = 24  # positions that say where the axis pointed
_QUIET = 6.0  # standard deviations of the noise that the closer look leaves around the median


def reversals_of(given: Any) -> Json:
    """The plain document of the turns: of `Reversals`, of an Earth rate estimate, or of the document of either."""
    document = given if isinstance(given, Mapping) else given.to_json()
    document = document.get("reversals", document)
    if not isinstance(document, Mapping) or "turns" not in document:
        raise InputError("no turns to draw: pass Reversals, an EarthRateEstimate, or the document of either")
    return document


def only_rate(recording: Recording, channel: str | None) -> str:
    """The channel that is meant: the one given, or the first one of rates, or the first of all."""
    if channel is not None:
        return channel
    rates = [c.name for c in recording.channels if c.kind is Kind.RATE]
    return rates[0] if rates else recording.names[0]


def turned_panel(record: Recording | Json, reversals: Any, *, channel: str | None = None) -> Panel:
    """The whole record with its turns, from a `Recording` or from the document that `overview` gives."""
    samples = overview(record, only_rate(record, channel)) if isinstance(record, Recording) else record
    duration = float(samples.get("duration") or _length(reversals_of(reversals)))
    return _panel(samples, reversals_of(reversals), (0.0, duration), offset=0.0, close=False)


def turned_panels(
    record: Recording | Json, reversals: Any, *, channel: str | None = None, zoom: int | None = None
) -> list[Panel]:
    """The whole record, or one of its turns (1, 2, ...) at full range and enlarged to the noise.

    Raises
    ------
    InputError
        A turn that is not there, or an overview where samples are needed.
    """
    if zoom is None:
        return [turned_panel(record, reversals, channel=channel)]
    if not isinstance(record, Recording):
        raise InputError("a detail needs the Recording: an overview has no samples")
    return window_panels(record, reversals, zoom_window(record, reversals, zoom), channel=channel)


def zoom_window(recording: Recording, reversals: Any, number: int) -> Limits:
    """Where to look to see one turn: from 8 s before it to 8 s after its dead time."""
    document = reversals_of(reversals)
    turns = document["turns"]
    if not 1 <= number <= len(turns):
        raise InputError(f"no turn {number!r}; there are {len(turns)}, counted from 1")
    turn, rate = turns[number - 1], document["rate"]
    start, stop = turn["start"] / rate - 8.0, turn["stop"] / rate + document["dead_time"] + 8.0
    return max(start, 0.0), min(stop, recording.duration)


def window_panels(
    recording: Recording, reversals: Any, window: Limits, *, channel: str | None = None
) -> list[Panel]:
    """A part of the record, twice: at full range, and enlarged to the noise between the turns."""
    document, name = reversals_of(reversals), only_rate(recording, channel)
    part = recording.window(*window)
    samples = overview(part, name)
    whole = _panel(samples, document, window, offset=window[0], close=True)
    limits = _quiet(part, name, document, window)
    return [whole, _panel(samples, document, window, offset=window[0], close=True, limits=limits)]


def _panel(
    samples: Json,
    document: Json,
    window: Limits,
    *,
    offset: float,
    close: bool,
    limits: Limits | None = None,
) -> Panel:
    unit, factor = display_unit(samples.get("kind", "rate"), "sd", samples.get("unit") or "")
    name, second = clock(window[1] - window[0] if not close else window[1])
    t, low, high = (array(samples[part]) for part in ("t", "low", "high"))
    spans = _spans(document, window, close=close)
    spans += [(a + offset, b + offset, "gap") for a, b in samples.get("gaps", ())]
    turns = [t for t in document["turns"] if _inside(_ends(t, document), window)]
    many = len(turns) > _MOST_TURNS
    if not many:
        spans += [(*_ends(turn, document), "turn") for turn in turns]
    middles = array([sum(_ends(turn, document)) / 2 / second for turn in turns])
    envelope = Envelope(
        x=(t + offset) / second,
        low=low / factor if limits is None else np.clip(low / factor, *_beyond(limits)),
        high=high / factor if limits is None else np.clip(high / factor, *_beyond(limits)),
        label="lowest and highest sample of each block" if t.size > 1000 else "samples",
        colour="z",
    )
    return Panel(
        title=_title(len(turns), closer=limits is not None),
        x=Axis(
            label=f"Time since the first sample [{name}]",
            limits=(window[0] / second, window[1] / second),
            landmarks=_names(document, window, second),
        ),
        y=Axis(label=f"Measured rate [{unit}]" if unit == "deg/s" else f"Measured [{unit}]", limits=limits),
        envelopes=(envelope,),
        spans=tuple(
            ShadedSpan(start=max(a, window[0]) / second, stop=min(b, window[1]) / second, kind=kind)
            for a, b, kind in spans
        ),
        rugs=(Rug(x=middles, label="turns", colour="purple"),) if many else (),
        height=0.26,
        key="above",
    )


def _title(count: int, *, closer: bool) -> str:
    if closer:
        return "Enlarged to the noise"
    return "1 turn" if count == 1 else f"{count} turns" if count else "No turn"


def _beyond(limits: Limits) -> Limits:
    """A little outside the frame: what is cut off there is not seen to be cut."""
    room = limits[1] - limits[0]
    return limits[0] - room, limits[1] + room


def _ends(part: Json, document: Json) -> Limits:
    return part["start"] / document["rate"], part["stop"] / document["rate"]


def _inside(ends: Limits, window: Limits) -> bool:
    return ends[1] > window[0] and ends[0] < window[1]


def _length(document: Json) -> float:
    return float(document["samples"] / document["rate"])


def _spans(document: Json, window: Limits, *, close: bool) -> list[tuple[float, float, SpanKind]]:
    """What is not used and why, within the window."""
    spans: list[tuple[float, float, SpanKind]] = []
    for part in document["disturbed"]:
        spans.append((*_ends(part, document), "gap" if part["kind"] == "missing" else "disturbed"))
    spans += [(*_ends(p, document), "unknown") for p in document["positions"] if _lost(p)]
    if close:
        spans += _unused(document)
    return [span for span in spans if _inside(span[:2], window)]


def _lost(position: Json) -> bool:
    """Neither a direction nor a heading is known."""
    return position["sign"] == 0 and position["heading"] is None


def _unused(document: Json) -> list[tuple[float, float, SpanKind]]:
    """Dead time after the turns and guard before them: what dwells and turns leave."""
    taken: Sequence[Json] = sorted([*document["dwells"], *document["turns"]], key=lambda p: p["start"])
    ends = [_ends(part, document) for part in taken]
    pairs = zip(ends, ends[1:], strict=False)
    return [(a[1], b[0], "dead") for a, b in pairs if b[0] > a[1]]


def _names(document: Json, window: Limits, second: float) -> tuple[tuple[float, str], ...]:
    """N and S, or U and D, over the positions of known direction, where there is room for them."""
    known = [p for p in document["positions"] if p["sign"] in (1, -1) and _inside(_ends(p, document), window)]
    if len(known) > _MOST_NAMED:
        return ()
    ends = [_ends(p, document) for p in known]
    middles = [(max(a, window[0]) + min(b, window[1])) / 2 / second for a, b in ends]
    names = [direction_of(document["first"], p["sign"])[0].upper() for p in known]
    return tuple(zip(middles, names, strict=True))


def _quiet(part: Recording, name: str, document: Json, window: Limits) -> Limits:
    """Limits around the samples that no turn and no disturbance touches, in the unit of the figure."""
    channel = part[name]
    _, factor = display_unit(channel.kind.value, "sd", channel.unit)
    samples: Array = part.scaled(name) / factor
    time = window[0] + np.arange(samples.size) / part.rate
    used = np.zeros(samples.size, dtype=np.bool_)
    for dwell in document["dwells"]:
        a, b = _ends(dwell, document)
        used |= (time >= a) & (time < b)
    left = samples[used & np.isfinite(samples)]
    if left.size < 2:
        return -1.0, 1.0
    middle = float(np.median(left))
    spread = 1.4826 * float(np.median(np.abs(left - middle))) or math.ulp(middle) + 1e-12
    return middle - _QUIET * spread, middle + _QUIET * spread
