# SPDX-License-Identifier: BSD-3-Clause
"""The seed paper's filter, which is told the rate: what it makes of the samples, and what its mean follows.

Everything is drawn from the plain document of a `ReferenceAided`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from allanite.views.figures.panel import Array, Axis, Curve, Envelope, Label, Panel, Style, around, array
from allanite.views.figures.records import clock

__all__ = [
    "DEG",
    "MILLI",
    "MILLI_NAME",
    "corrected_panel",
    "document_of",
    "means_panel",
    "raw_panel",
    "states_panel",
]

Json = Mapping[str, Any]

#: One degree per second [rad/s], and a thousandth of it: rates of the size of the Earth's are compared in these.
DEG = math.radians(1)
MILLI = DEG / 1000
MILLI_NAME = "10⁻³ deg/s"
_POINTS = 1200  # of the states
_LOOKS: tuple[tuple[str, Style, str], ...] = (
    ("z", "solid", "circle"),
    ("x", "dashed", "square"),
    ("y", "dashdot", "triangle"),
)
_STATES = ("flicker as one Gauss-Markov term", "random walk")


def document_of(aided: Any) -> Json:
    """The plain document of a `ReferenceAided`, with its states where the result itself is given."""
    if isinstance(aided, Mapping):
        return aided
    rows = np.unique(np.linspace(0, len(aided.states) - 1, _POINTS).round().astype(np.int64))
    parts = {"t": (rows + 0.5) / aided.rate}
    for i in range(len(_STATES)):
        parts[f"value_{i}"], parts[f"sd_{i}"] = aided.states[rows, i], aided.states_sd[rows, i]
    return {**aided.to_json(), "states": parts}


# -- panels -----------------------------------------------------------------------------------------------


def corrected_panel(document: Json) -> Panel:
    """The corrected samples and their cumulative mean."""
    axis, second = _axis(document)
    t, low, high = (array(document["overview"][part]) for part in ("t", "low", "high"))
    low, high = low / DEG, high / DEG
    known = np.isfinite(low)
    middle = float(np.median((low + high)[known])) / 2 if known.any() else 0.0
    reach = 1.2 * float(np.median((high - low)[known])) if known.any() else 1.0
    time, mean = _line(document, "corrected")
    return Panel(
        title="Reference-aided, not a measurement: corrected samples",
        x=axis,
        y=Axis(label="Corrected [deg/s]", limits=(middle - reach, middle + reach)),
        envelopes=(
            Envelope(x=t / second, low=low, high=high, label="corrected, lowest and highest", colour="guide"),
        ),
        curves=(Curve(x=time / second, y=mean / DEG, label="cumulative mean", colour="x"),),
        height=0.22,
        key="above",
    )


def means_panel(documents: Sequence[Json]) -> Panel:
    """The cumulative mean for each rate that was typed in, and that rate: one reading, one or more results."""
    axis, second = _axis(documents[0])
    references = [document["mean_reference"] / MILLI for document in documents]
    curves, late = [], []
    for document, (colour, style, marker), rate in zip(documents, _LOOKS, references, strict=False):
        time, mean = _line(document, "corrected")
        words = f"told {rate / 1000:.6f} deg/s".replace("-", "−")
        look: dict[str, Any] = {"colour": colour, "style": style, "marker": marker}
        curves.append(Curve(x=time / second, y=mean / MILLI, label=words, **look))
        late.append((mean / MILLI)[time > 0.1 * _duration(document)])
    lines = [
        Label(x=0.0, y=rate, text="", colour=look[0], place="level")
        for rate, look in zip(references, _LOOKS, strict=False)
    ]
    reading, follows = documents[0]["reading"], documents[0]["follows"]
    moved = "–" if follows is None else f"{follows:.2f}"
    return Panel(
        title=f"Reference-aided, {reading}: a unit typed in moves the mean by {moved}",
        x=axis,
        y=Axis(label=f"Mean so far [{MILLI_NAME}]", limits=around(references, [0.0], *late, room=0.14)),
        curves=tuple(curves),
        labels=tuple(lines),
        height=0.3,
        key="above",
    )


def raw_panel(document: Json, others: Sequence[Curve] = ()) -> Panel:
    """The cumulative mean of the samples as they were measured."""
    axis, second = _axis(document)
    time, mean = _line(document, "raw")
    signed = ", with the sign of the heading" if document["reading"] == "demodulated" else ""
    late = (mean / MILLI)[time > 0.03 * _duration(document)]
    return Panel(
        title=f"Mean of the measured samples, turns left out{signed}",
        x=axis,
        y=Axis(
            label=f"Mean so far [{MILLI_NAME}]", limits=around(late, [0.0], *(c.y for c in others), room=0.15)
        ),
        curves=(
            Curve(x=time / second, y=mean / MILLI, label="mean of the samples so far", colour="x"),
            *others,
        ),
        height=0.3,
        key="above",
    )


def states_panel(document: Json) -> Panel:
    """Both states of the filter with their bands: what it takes off the samples."""
    axis, second = _axis(document)
    states = {name: array(part) for name, part in document["states"].items()}
    curves, late = [], []
    for i, (name, look) in enumerate(zip(_STATES, _LOOKS, strict=False)):
        y, half = states[f"value_{i}"] / DEG, 2 * states[f"sd_{i}"] / DEG
        late.append(y[states["t"] > 0.02 * _duration(document)])
        curves.append(
            Curve(
                x=states["t"] / second,
                y=y,
                lower=y - half,
                upper=y + half,
                label=name,
                colour=look[0],
                style=look[1],
                band_label="" if i else "± 2 sd",
            )
        )
    return Panel(
        title="What the filter removes",
        x=axis,
        y=Axis(label="State [deg/s]", limits=around([0.0], *late, room=0.3)),
        curves=tuple(curves),
        height=0.3,
        key="above",
    )


def _line(document: Json, name: str) -> tuple[Array, Array]:
    return array(document["running"]["t"]), array(document["running"][name])


def _duration(document: Json) -> float:
    """Length of the record [s], from the middles of the blocks of its overview; the last one may be shorter."""
    t = document["overview"]["t"]
    return float(2 * (t[-1] - (len(t) - 1) * t[0]))


def _axis(document: Json) -> tuple[Axis, float]:
    duration = _duration(document)
    unit, second = clock(duration)
    return Axis(label=f"Time since the first sample [{unit}]", limits=(0.0, duration / second)), second
