# SPDX-License-Identifier: BSD-3-Clause
"""A search for north: the compass with its arc, the horizontal rate beside the known one, and both as they grew."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.quantities.number_words import interval, number
from allanite.views.figures.drawing import (
    Drawing,
    DrawnShape,
    Point,
    Words,
    arc,
    arrow,
    box,
    circle,
    line,
    wedge,
)
from allanite.views.figures.earth import DEG_H, level, quantile
from allanite.views.figures.panel import Array, Axis, Curve, Panel, around, array
from allanite.views.figures.records import clock

if TYPE_CHECKING:
    from allanite.experiments.north import Arc, NorthEstimate
    from allanite.quantities.quantity import Quantity

__all__ = [
    "CENTRE",
    "RADIUS",
    "VIEWS",
    "beside_card",
    "card",
    "compass",
    "compass_panel",
    "needle",
    "point_on",
    "rate_gauge",
    "running_panels",
    "sector",
]

_Parts = list[DrawnShape | Words]

VIEWS = ("whole", "compass", "running")
CENTRE: Point = (22.0, 21.0)
RADIUS = 15.0
_WORDS = 47.0  # where the words begin
_SETTLED = 0.2  # part of the record after which the bands must lie inside the frame


def compass_panel(north: NorthEstimate) -> Panel:
    """The compass, north upwards, with what was found in words beside it."""
    return Panel(title="Azimuth of the mark of the table", drawing=compass(north))


def compass(north: NorthEstimate) -> Drawing:
    """Directions of the table's mark that the record allows, on a sheet of 100 by 42."""
    parts = [
        *card(),
        *_arcs(north),
        *_needles(north),
        *_said(north),
        *rate_gauge(north.horizontal, north.expected_rate),
    ]
    return Drawing(width=100.0, height=42.0, parts=tuple(parts))


def card() -> _Parts:
    """The card: a circle with its marks."""
    parts: _Parts = [circle(CENTRE, RADIUS, fill="gap", opacity=0.1, colour="guide", name="card")]
    for degrees in range(0, 360, 10):
        long = 1.6 if degrees % 90 == 0 else 1.0 if degrees % 30 == 0 else 0.5
        parts.append(line(point_on(degrees, RADIUS - long), point_on(degrees, RADIUS), colour="guide"))
    for degrees, name in ((0, "N"), (90, "E"), (180, "S"), (270, "W")):
        x, y = point_on(degrees, RADIUS + 2.4)
        parts.append(Words(x=x, y=y, text=name, bold=True, size=1.1))
    for degrees in (30, 60, 120, 150, 210, 240, 300, 330):
        x, y = point_on(degrees, RADIUS + 2.4)
        parts.append(Words(x=x, y=y, text=f"{degrees}", colour="guide", size=0.85))
    return parts


def _arcs(north: NorthEstimate) -> _Parts:
    """The directions that are allowed: a sector each, with a bold line along the card."""
    parts: _Parts = []
    for allowed in north.interval:
        parts += sector(allowed)
    return parts


def sector(allowed: Arc) -> _Parts:
    """Directions on the card: a sector with a bold line along its rim."""
    start = _turned(allowed.start)
    stop = start - allowed.width
    return [
        wedge(CENTRE, RADIUS, start, stop, fill="z", opacity=0.22, name="arc"),
        line(*arc(CENTRE, RADIUS, start, stop), colour="z", width=3.0, name="rim"),
    ]


def _needles(north: NorthEstimate) -> _Parts:
    """The mark's direction; dashed where there are two that the record cannot tell apart."""
    if north.anywhere:
        return needle(math.nan)
    if not math.isnan(north.azimuth):
        return needle(north.azimuth, "mark", sure=north.found)
    return [
        line(CENTRE, point_on(math.degrees(azimuth), RADIUS - 0.4), dashed=True, name="candidate")
        for azimuth in north.candidates
    ]


def needle(direction: float, name: str = "", *, sure: bool = False) -> _Parts:
    """An arrow from the centre, in ink where it is a result; the centre alone where there is no direction."""
    colour = "ink" if sure else "guide"
    tip = point_on(math.degrees(direction), RADIUS - 0.4)
    hand = [] if math.isnan(direction) else arrow(CENTRE, tip, colour=colour, width=1.8, name=name)
    return [*hand, circle(CENTRE, 0.8, fill=colour, colour=None)]


def _said(north: NorthEstimate) -> _Parts:
    """The direction and its interval in words."""
    return beside_card(
        [north.verdict.words, *_direction(north), f"signal-to-noise ratio {number(north.signal_to_noise, 2)}"]
    )


def beside_card(lines: Sequence[str]) -> _Parts:
    """Words to the right of the card, the first of them in bold; in another ink where they explain what is dashed."""
    return [
        Words(
            x=_WORDS, y=37.5 - 3.1 * i, text=text, bold=i == 0, across="left", size=1.15 if i == 0 else 1.0,
            colour="limit" if text.startswith("dashed") else "ink",
        )
        for i, text in enumerate(lines)
    ]  # fmt: skip


def _direction(north: NorthEstimate) -> list[str]:
    percent = f"{100 * north.confidence:g} %"
    arcs = north.interval
    if north.anywhere:
        return [f"{percent} interval: every direction", "the record does not determine north"]
    digits = min((_digits(a.width) for a in arcs), default=1)
    intervals = [f"{math.degrees(a.start):.{digits}f} to {math.degrees(a.stop):.{digits}f} deg" for a in arcs]
    if not intervals:
        return ["no direction explains the record"]
    if math.isnan(north.azimuth):
        return ["only one component is resolved", *(f"{percent} interval {text}" for text in intervals)]
    return [
        f"azimuth of the mark {math.degrees(north.azimuth):.{digits}f} deg",
        f"{percent} interval {intervals[0]}",
    ]


def _digits(width: float) -> int:
    """Decimals of a degree that tell the ends of an arc apart."""
    return min(max(1 - math.floor(math.log10(math.degrees(width))), 0), 5) if width > 0 else 3


def rate_gauge(horizontal: Quantity, expected: float) -> _Parts:
    """The horizontal rate on a scale from zero, beside the one that the Earth has at this latitude [rad/s]."""
    measured, low, high = (v / DEG_H for v in (horizontal.value, horizontal.lower, horizontal.upper))
    known = expected / DEG_H
    ends = [v for v in (1.25 * known, 1.1 * high, 1.1 * measured) if math.isfinite(v)]
    most, left, right, y = max(ends), _WORDS, 95.0, 11.0

    def place(rate: float) -> float:
        return left + (right - left) * min(max(rate / most, 0.0), 1.0)

    parts: _Parts = [
        Words(x=left, y=19.5, text="Horizontal rate [deg/h]", bold=True, across="left"),
        line((left, y), (right, y), colour="guide", name="scale"),
        line((left, y - 0.8), (left, y + 0.8), colour="guide"),
        Words(x=left, y=y - 2.4, text="0", colour="guide", size=0.9),
        line((place(known), y - 2.2), (place(known), y + 2.2), colour="x", width=1.6, name="known rate"),
        Words(x=place(known), y=y - 4.0, text=f"expected here {number(known, 4)}", colour="x", size=0.95),
    ]
    if math.isfinite(low) and math.isfinite(high):
        bar = box(
            place(low), y - 0.7, max(place(high) - place(low), 0.3), 1.4, fill="z", opacity=0.3, colour="z"
        )
        parts.append(bar)
    if math.isfinite(measured):
        text = interval(measured, low, high)
        parts.append(circle((place(measured), y), 0.9, fill="z", colour=None, name="measured"))
        words = f"{text[0]} [{text[1]}, {text[2]}]"
        parts.append(Words(x=(left + right) / 2, y=y + 4.2, text=words, colour="z", size=0.95))
    return parts


def _turned(azimuth: float) -> float:
    """Angle from the right and upwards, for one from north over east."""
    return math.pi / 2 - azimuth


def point_on(degrees: float, radius: float) -> Point:
    """Where a direction from north over east lies on the sheet, so far from the centre."""
    angle = _turned(math.radians(degrees))
    return CENTRE[0] + radius * math.cos(angle), CENTRE[1] + radius * math.sin(angle)


# -- as the record grows ----------------------------------------------------------------------------------


def running_panels(north: NorthEstimate) -> list[Panel]:
    """Azimuth, as its distance from the result, and horizontal rate as the record grows."""
    running, wide = north.running, quantile(north.confidence)
    unit, second = clock(north.duration)
    time = running.time / second
    frame = 0.0, 1.02 * north.duration / second
    axis = Axis(label=f"Time since the first sample [{unit}]", limits=frame)
    panels = [_rate_panel(north, time, axis, frame)] if _any(running.horizontal_rate) else []
    if not math.isnan(north.azimuth) and _any(running.azimuth):
        away = np.degrees(_difference(running.azimuth, north.azimuth))
        half = wide * np.degrees(np.where(np.isfinite(running.sd), running.sd, np.nan))
        panels.insert(0, _azimuth_panel(north, time, away, half, axis))
    return panels


def _any(values: Array) -> bool:
    return bool(np.isfinite(values).any())


def _azimuth_panel(north: NorthEstimate, time: Array, away: Array, half: Array, axis: Axis) -> Panel:
    late = time >= _SETTLED * time[-1] if time.size else np.zeros(0, dtype=np.bool_)
    percent = f"{100 * north.confidence:g} %"
    curve = Curve(
        x=time,
        y=away,
        lower=away - half,
        upper=away + half,
        label="azimuth so far",
        colour="z",
        band_label=f"{percent} band by the noise, linear",
    )
    low, high = around([0.0], away[late], (away - half)[late], (away + half)[late])
    result = f"{math.degrees(north.azimuth):.2f} deg"
    return Panel(
        title="Running estimate of the azimuth",
        x=axis,
        y=Axis(label=f"Azimuth − {result} [deg]", limits=(max(low, -180.0), min(high, 180.0))),
        curves=(curve,),
        height=0.34,
        key="above",
    )


def _rate_panel(north: NorthEstimate, time: Array, axis: Axis, frame: tuple[float, float]) -> Panel:
    rate = north.running.horizontal_rate / DEG_H
    known = north.expected_rate / DEG_H
    curves = [Curve(x=time, y=rate, label="horizontal rate so far", colour="z")]
    ends = array(north.horizontal_interval) / DEG_H
    if north.horizontal.resolved:
        look: dict[str, Any] = {"colour": "ink", "style": "none", "marker": "diamond"}
        at, y = array([frame[1] / 1.02]), array([north.horizontal_rate]) / DEG_H
        label = f"result, {100 * north.confidence:g} % interval"
        curves.append(Curve(x=at, y=y, lower=ends[:1], upper=ends[1:], bars=True, label=label, **look))
    late = time >= _SETTLED * time[-1] if time.size else np.zeros(0, dtype=np.bool_)
    return Panel(
        title="Running estimate of the horizontal rate",
        x=axis,
        y=Axis(label="Horizontal rate [deg/h]", limits=around([known], ends, rate[late])),
        curves=(*curves, level(known, frame, f"expected here {known:.3f} deg/h")),
        height=0.34,
        key="above",
    )


def _difference(angle: Array, other: float) -> Array:
    """Of two directions, -pi to pi."""
    return np.asarray((angle - other + math.pi) % (2 * math.pi) - math.pi)
