# SPDX-License-Identifier: BSD-3-Clause
"""The record itself: lowest and highest value of each of some 1500 blocks, gaps shaded, findings marked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.quantities.display_units import display_unit
from allanite.recording.health.finding import Severity
from allanite.recording.records import Recording
from allanite.study.results import ChannelStudy
from allanite.study.study import Study
from allanite.views.figures.curves import series_colours
from allanite.views.figures.panel import Array, Axis, Envelope, Panel, ShadedSpan, array
from allanite.views.wording.study import ChannelGroup

__all__ = ["clock", "group_record_panels", "overview", "recording_panels"]

Spans = NDArray[np.int64]
_BLOCKS = 1500
_THINNED = 800  # blocks of an overview out of a study: no screen and no paper shows more
_MOST_SPANS = 60
_LOW = 0.1  # height over width of each panel where there are many of them


def group_record_panels(group: ChannelGroup[ChannelStudy], study: Study | None) -> list[Panel]:
    """One panel per channel of a group, on a common time axis; without its study a channel has no gaps and places."""
    looks = series_colours([c.name for c in group.channels])
    many = len(group.channels if study is None else study.channels)
    most = min(_THINNED, 6 * _THINNED // many)
    panels = [_channel_panel(c, study, look[0], most) for c, look in zip(group.channels, looks, strict=True)]
    return [replace(panel, height=_LOW) for panel in panels] if many > 2 else panels


def _channel_panel(channel: ChannelStudy, study: Study | None, colour: str, most: int) -> Panel:
    """The overview of one channel of a study."""
    samples, facts = channel.overview, (channel.name, channel.kind, channel.unit)
    t, low, high = _thinned(samples.t, samples.low, samples.high, most)
    if study is None:
        return _panel(facts, t, low, high, float(max(samples.t, default=1.0)), (), (), colour)
    dt, record = 1.0 / study.recording.rate, study.recording
    places = [
        (a * dt, b * dt, f.message)
        for f in study.findings
        if f.channel in (None, channel.name) and f.severity is not Severity.INFO
        for a, b in f.places
        if (a, b) not in record.gaps
    ]
    gaps = [(a * dt, b * dt) for a, b in record.gaps]
    return _panel(facts, t, low, high, record.duration, gaps, places, colour)


def _thinned(t: Array, low: Array, high: Array, most: int) -> tuple[Array, Array, Array]:
    """Neighbouring blocks joined until there are at most so many."""
    join = -(-t.size // most)
    if join < 2:
        return t, low, high
    rows = (np.pad(part, (0, -part.size % join), mode="edge").reshape(-1, join) for part in (t, low, high))
    middle, lows, highs = rows
    return middle.mean(axis=1), np.fmin.reduce(lows, axis=1), np.fmax.reduce(highs, axis=1)


def recording_panels(recording: Recording, names: Sequence[str] | None = None) -> list[Panel]:
    """The overview of each channel of a `Recording`, read block by block."""
    chosen = recording.names if names is None else tuple(names)
    looks = series_colours(chosen)
    panels = []
    for name, (colour, _) in zip(chosen, looks, strict=True):
        samples = overview(recording, name)
        facts = name, samples["kind"], samples["unit"]
        t, low, high = (array(samples[part]) for part in ("t", "low", "high"))
        panels.append(_panel(facts, t, low, high, recording.duration, samples["gaps"], [], colour))
    return panels


def overview(recording: Recording, name: str) -> dict[str, Any]:
    """What a picture of one channel of a long record needs, as plain data, in SI.

    Returns
    -------
    dict
        "t" [s], "low", "high": lowest and highest sample of each block, None where a block has none; "gaps", the
        longest runs of missing samples [s]; "name", "kind", "unit", "duration" [s].
    """
    channel = recording[name]
    t, low, high, gaps = _extremes(recording, name)
    ends = channel.scale * (np.stack([low, high]) + recording.origin(name))
    low, high = ends.min(axis=0), ends.max(axis=0)  # a negative scale turns them round
    return {
        "name": name,
        "kind": channel.kind.value,
        "unit": channel.unit,
        "duration": recording.duration,
        "t": t.tolist(),
        "low": [v if v == v else None for v in low.tolist()],
        "high": [v if v == v else None for v in high.tolist()],
        "gaps": [list(gap) for gap in gaps],
    }


def _extremes(recording: Recording, name: str) -> tuple[Array, Array, Array, list[tuple[float, float]]]:
    """Block centres [s], lowest and highest sample of each block, and the longest runs of missing samples [s]."""
    size = max(1, -(-recording.n_samples // _BLOCKS))
    low: list[Array] = []
    high: list[Array] = []
    edges: list[Spans] = []
    for start, block in recording.blocks(name, size * max(1, (1 << 18) // size)):
        missing = np.isnan(block)
        edges.append(_changes(start, missing))
        rows = np.full((-(-block.size // size), size), np.nan)
        rows.flat[: block.size] = block
        empty = np.isnan(rows).all(axis=1)
        low.append(np.where(empty, np.nan, np.min(np.where(np.isnan(rows), np.inf, rows), axis=1)))
        high.append(np.where(empty, np.nan, np.max(np.where(np.isnan(rows), -np.inf, rows), axis=1)))
    lows, highs = np.concatenate(low), np.concatenate(high)
    centres = array((np.arange(lows.size) + 0.5) * size * recording.dt)
    runs = _joined(np.concatenate(edges))
    longest = runs[np.argsort(runs[:, 0] - runs[:, 1], kind="stable")[:_MOST_SPANS]]
    return centres, lows, highs, [(a * recording.dt, b * recording.dt) for a, b in longest.tolist()]


def _changes(start: int, missing: NDArray[np.bool_]) -> Spans:
    """Runs [first, last) of missing samples of one block, as positions on the grid."""
    flags = np.concatenate(([False], missing, [False]))
    return start + np.flatnonzero(flags[1:] != flags[:-1]).reshape(-1, 2)


def _joined(runs: Spans) -> Spans:
    """Runs that touch at a block's edge made one."""
    if len(runs) == 0:
        return runs
    new = np.concatenate(([True], runs[1:, 0] > runs[:-1, 1]))
    return np.stack([runs[new, 0], runs[np.append(np.flatnonzero(new)[1:] - 1, len(runs) - 1), 1]], axis=1)


def _panel(
    facts: tuple[str, str, str],
    t: Array,
    low: Array,
    high: Array,
    duration: float,
    gaps: Sequence[tuple[float, float]],
    places: Sequence[tuple[float, float, str]],
    colour: str,
) -> Panel:
    name, kind, shown_in = facts
    unit, factor = display_unit(kind, "sd", shown_in)
    name_of_unit, second = clock(duration)
    spans = [
        ShadedSpan(start=a / second, stop=b / second, kind="gap", text="no samples")
        for a, b in gaps[:_MOST_SPANS]
    ]
    spans += [
        ShadedSpan(start=a / second, stop=b / second, kind="finding", text=text)
        for a, b, text in places[:_MOST_SPANS]
    ]
    return Panel(
        title=name,
        x=Axis(label=f"Time since the first sample [{name_of_unit}]", limits=(0.0, duration / second)),
        y=Axis(label=unit),
        envelopes=(Envelope(x=t / second, low=low / factor, high=high / factor, label=name, colour=colour),),
        spans=tuple(spans),
    )


def clock(duration: float) -> tuple[str, float]:
    """Unit of a time axis and its length in seconds."""
    for text, second in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if duration >= 3 * second:
            return text, second
    return "s", 1.0
