# SPDX-License-Identifier: BSD-3-Clause
"""Three gyros at rest: the length of what they see, the means of the quiet cells, and which parts were quiet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from allanite.experiments.rate_vector import RateSpan, RateVector
from allanite.experiments.rate_vector.verdict import LeftOut
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval
from allanite.recording.records import Recording
from allanite.study.result_document import Overview
from allanite.views.figures.curves import series_colours
from allanite.views.figures.earth import DEG_H, known_rate, level
from allanite.views.figures.panel import (
    Array,
    Axis,
    Curve,
    Envelope,
    Panel,
    ShadedSpan,
    SpanKind,
    around,
    array,
)
from allanite.views.figures.records import clock, overview

__all__ = ["VIEWS", "length_panels", "mean_panels", "overviews_of", "record_panels"]

VIEWS = ("whole", "length", "means", "record")
_PARTS = 400  # of the record: a stretch below half of one would be a hairline


def overviews_of(result: RateVector, recording: Recording | Sequence[Overview] | None) -> Sequence[Overview]:
    """What a picture of each axis needs: of the record, where that is given."""
    if isinstance(recording, Recording):
        return [Overview.from_json(overview(recording, name)) for name in result.channels]
    return recording or ()


# -- length -----------------------------------------------------------------------------------------------


def length_panels(result: RateVector) -> list[Panel]:
    """The length with its interval beside the known rate; nothing where nothing was quiet."""
    if math.isnan(result.length):
        return []
    value, low, high = (array([v]) / DEG_H for v in (result.length, *result.interval))
    words = interval(float(value[0]), float(low[0]), float(high[0]))
    look: dict[str, Any] = {"colour": "z", "style": "none", "marker": "diamond", "bars": True}
    label = f"{words[0]} deg/h [{words[1]}, {words[2]}], {100 * result.confidence:g} %"
    frame = -1.0, 1.0
    known = result.earth_rate / DEG_H
    return [
        Panel(
            title=f"Length of the rate vector: {result.verdict.words}",
            x=Axis(label="", limits=frame, names=((0.0, "bias + Earth, all three axes"),)),
            y=Axis(label="Length [deg/h]", limits=around([known], low, high, room=0.2)),
            curves=(
                Curve(x=array([0.0]), y=value, lower=low, upper=high, label=label, **look),
                known_rate(result.earth_rate, frame),
            ),
            height=0.26,
            key="above",
        )
    ]


# -- means ------------------------------------------------------------------------------------------------


def mean_panels(result: RateVector) -> list[Panel]:
    """The means of the quiet cells, one panel for each axis; nothing where they are not known."""
    quiet_means = result.quiet_means
    if quiet_means is None or not quiet_means.time.size:
        return []
    unit, second = clock(result.duration)
    time, frame = quiet_means.time / second, (0.0, result.duration / second)
    x = Axis(label=f"Time since the first sample [{unit}]", limits=frame)
    dots = f"mean over {duration(quiet_means.joined * result.cell)} at rest"
    panels = []
    for i, (name, colour) in enumerate(_axes(result)):
        mean = quiet_means.means[i] / DEG_H
        marks: dict[str, Any] = {"colour": colour, "style": "none", "marker": "circle"}
        lines = _fitted(result, i, frame)
        panels.append(
            Panel(
                title=name,
                x=x,
                y=Axis(label="Rate [deg/h]", limits=around(mean)),
                curves=(Curve(x=time, y=mean, label=dots, **marks), *lines),
                height=0.2,
                key="above",
            )
        )  # fmt: skip
    return panels


def _fitted(result: RateVector, i: int, frame: tuple[float, float]) -> tuple[Curve, ...]:
    """The fitted rate of an axis as a line; nothing where there is none."""
    value, sd = float(result.vector[i]) / DEG_H, math.sqrt(result.covariance[i, i]) / DEG_H
    if not math.isfinite(value + sd):
        return ()
    text = interval(value, value - sd, value + sd)[0].replace("-", "−")
    return (level(value, frame, f"{text} deg/h, as fitted"),)


# -- record -----------------------------------------------------------------------------------------------


def record_panels(result: RateVector, overviews: Sequence[Overview]) -> list[Panel]:
    """The three axes with what was used and what was not; nothing where the record is not known."""
    whole = result.duration
    unit, second = clock(whole)
    stretches = [
        ShadedSpan(start=start / second, stop=stop / second, kind=kind)
        for start, stop, kind in _stretches(result)
    ]
    panels = []
    for samples, (name, colour) in zip(overviews, _axes(result), strict=False):
        words, factor = display_unit(samples.kind, "sd", samples.unit)
        low, high = samples.low / factor, samples.high / factor
        look = {"label": "lowest and highest sample of each block", "colour": colour}
        panels.append(
            Panel(
                title=name,
                x=Axis(label=f"Time since the first sample [{unit}]", limits=(0.0, whole / second)),
                y=Axis(label=f"Rate [{words}]"),
                envelopes=(Envelope(x=samples.t / second, low=low, high=high, **look),),
                spans=tuple(stretches),
                height=0.2,
                key="above",
            )
        )
    return panels


def _stretches(result: RateVector) -> list[tuple[float, float, SpanKind]]:
    """Runs of quiet and of disturbed as far as a picture can tell them apart: what most of each of its parts is."""
    edges = np.linspace(0.0, result.duration, _PARTS + 1)
    kinds: dict[SpanKind, Array] = {}
    for s in (*result.used, *result.left_out):
        share = np.clip(edges[1:], s.start, s.stop) - np.clip(edges[:-1], s.start, s.stop)
        kinds[_kind(s)] = kinds.get(_kind(s), np.zeros(_PARTS)) + share
    if not kinds:
        return []
    names = list(kinds)
    most = np.argmax(np.stack(list(kinds.values())), axis=0)
    ends = np.concatenate(([0], np.flatnonzero(np.diff(most)) + 1, [_PARTS])).tolist()
    return [
        (float(edges[a]), float(edges[b]), names[most[a]]) for a, b in zip(ends[:-1], ends[1:], strict=True)
    ]


def _kind(span: RateSpan) -> SpanKind:
    if span.why is None:
        return "quiet"
    return "gap" if span.why is LeftOut.MISSING else "disturbed"


def _axes(result: RateVector) -> Sequence[tuple[str, str]]:
    names = result.channels
    return [(name, colour) for name, (colour, _) in zip(names, series_colours(names), strict=True)]
