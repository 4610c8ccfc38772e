# SPDX-License-Identifier: BSD-3-Clause
"""Three gyros at rest: the length of what they see, the means of the quiet cells, and which parts were quiet.

Everything is drawn from the plain document of a `RateVector` with two things beside it that only the record tells:
"overviews", one of each axis, and "quiet_means".
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from allanite.quantities.display_units import display_unit
from allanite.recording.records import Recording
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
from allanite.views.wording import duration, interval

__all__ = ["VIEWS", "document_of", "length_panels", "mean_panels", "quiet_means", "record_panels"]

Json = Mapping[str, Any]

VIEWS = ("whole", "length", "means", "record")
_MOST_MEANS = 400
_PARTS = 400  # of the record: a stretch below half of one would be a hairline


def document_of(vector: Any, recording: Recording | None) -> Json:
    """The document of a `RateVector`, with what its record adds where that is given."""
    document: Json = vector if isinstance(vector, Mapping) else vector.to_json()
    if recording is None:
        return document
    overviews = [overview(recording, name) for name in document["channels"]]
    return {**document, "overviews": overviews, "quiet_means": quiet_means(recording, document)}


def quiet_means(recording: Recording, document: Json) -> dict[str, Any]:
    """Means of the quiet cells of each axis, as plain data, in SI; neighbours joined where there are many.

    Returns
    -------
    dict
        "time" [s], "means" (one list for each axis), "joined": cells in each mean.
    """
    from allanite.experiments.rate_vector.stretches import cut

    cells = cut(recording, document["channels"], lambda part: None)
    used = np.zeros(cells.count, dtype=np.bool_)
    for span in document["used"]:
        used[round(span["start"] / cells.dt) : round(span["stop"] / cells.dt)] = True
    chosen = np.flatnonzero(used & cells.whole)
    join = max(1, -(-len(chosen) // _MOST_MEANS))
    parts = [chosen[i : i + join] for i in range(0, len(chosen), join)]
    return {
        "time": [float((part.mean() + 0.5) * cells.dt) for part in parts],
        "means": [[float(cells.mean[part, axis].mean()) for part in parts] for axis in range(cells.mean.shape[1])],
        "joined": join,
    }  # fmt: skip


# -- length -----------------------------------------------------------------------------------------------


def length_panels(document: Json) -> list[Panel]:
    """The length with its interval beside the known rate; nothing where nothing was quiet."""
    if document["length"] is None or None in document["interval"]:
        return []
    value, low, high = (array([v]) / DEG_H for v in (document["length"], *document["interval"]))
    words = interval(float(value[0]), float(low[0]), float(high[0]))
    look: dict[str, Any] = {"colour": "z", "style": "none", "marker": "diamond", "bars": True}
    label = f"{words[0]} deg/h [{words[1]}, {words[2]}], {100 * document['confidence']:g} %"
    frame = -1.0, 1.0
    known = document["earth_rate"] / DEG_H
    return [
        Panel(
            title=f"Length of the rate vector: {document['verdict']}",
            x=Axis(label="", limits=frame, names=((0.0, "bias + Earth, all three axes"),)),
            y=Axis(label="Length [deg/h]", limits=around([known], low, high, room=0.2)),
            curves=(
                Curve(x=array([0.0]), y=value, lower=low, upper=high, label=label, **look),
                known_rate(document["earth_rate"], frame),
            ),
            height=0.26,
            key="above",
        )
    ]


# -- means ------------------------------------------------------------------------------------------------


def mean_panels(document: Json) -> list[Panel]:
    """The means of the quiet cells, one panel for each axis; nothing where they are not known."""
    quiet_means = document.get("quiet_means")
    if not quiet_means or not quiet_means["time"]:
        return []
    unit, second = clock(document["duration"])
    time, frame = array(quiet_means["time"]) / second, (0.0, document["duration"] / second)
    x = Axis(label=f"Time since the first sample [{unit}]", limits=frame)
    dots = f"mean over {duration(quiet_means['joined'] * document['cell'])} at rest"
    panels = []
    for i, (name, colour) in enumerate(_axes(document)):
        mean = array(quiet_means["means"][i]) / DEG_H
        marks: dict[str, Any] = {"colour": colour, "style": "none", "marker": "circle"}
        lines = _fitted(document, i, frame)
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


def _fitted(document: Json, i: int, frame: tuple[float, float]) -> tuple[Curve, ...]:
    """The fitted rate of an axis as a line; nothing where there is none."""
    rate, variance = document["vector"][i], document["covariance"][i][i]
    if rate is None or variance is None:
        return ()
    value, sd = rate / DEG_H, math.sqrt(variance) / DEG_H
    text = interval(value, value - sd, value + sd)[0].replace("-", "−")
    return (level(value, frame, f"{text} deg/h, as fitted"),)


# -- record -----------------------------------------------------------------------------------------------


def record_panels(document: Json) -> list[Panel]:
    """The three axes with what was used and what was not; nothing where the record is not known."""
    whole = document["duration"]
    unit, second = clock(whole)
    stretches = [
        ShadedSpan(start=start / second, stop=stop / second, kind=kind)
        for start, stop, kind in _stretches(document)
    ]
    panels = []
    for samples, (name, colour) in zip(document.get("overviews", ()), _axes(document), strict=False):
        words, factor = display_unit(samples["kind"], "sd", samples["unit"])
        t, low, high = (array(samples[part]) for part in ("t", "low", "high"))
        look = {"label": "lowest and highest sample of each block", "colour": colour}
        panels.append(
            Panel(
                title=name,
                x=Axis(label=f"Time since the first sample [{unit}]", limits=(0.0, whole / second)),
                y=Axis(label=f"Rate [{words}]"),
                envelopes=(Envelope(x=t / second, low=low / factor, high=high / factor, **look),),
                spans=tuple(stretches),
                height=0.2,
                key="above",
            )
        )
    return panels


def _stretches(document: Json) -> list[tuple[float, float, SpanKind]]:
    """Runs of quiet and of disturbed as far as a picture can tell them apart: what most of each of its parts is."""
    edges = np.linspace(0.0, document["duration"], _PARTS + 1)
    kinds: dict[SpanKind, Array] = {}
    for s in (*document["used"], *document["left_out"]):
        share = np.clip(edges[1:], s["start"], s["stop"]) - np.clip(edges[:-1], s["start"], s["stop"])
        kinds[_kind(s)] = kinds.get(_kind(s), np.zeros(_PARTS)) + share
    if not kinds:
        return []
    names = list(kinds)
    most = np.argmax(np.stack(list(kinds.values())), axis=0)
    ends = np.concatenate(([0], np.flatnonzero(np.diff(most)) + 1, [_PARTS])).tolist()
    return [
        (float(edges[a]), float(edges[b]), names[most[a]]) for a, b in zip(ends[:-1], ends[1:], strict=True)
    ]


def _kind(span: Json) -> SpanKind:
    if not span["why"]:
        return "quiet"
    return "gap" if span["why"] == "samples missing" else "disturbed"


def _axes(document: Json) -> Sequence[tuple[str, str]]:
    names = document["channels"]
    return [(name, colour) for name, (colour, _) in zip(names, series_colours(names), strict=True)]
