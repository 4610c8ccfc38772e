# SPDX-License-Identifier: BSD-3-Clause
"""An alignment: the compass with its arc, what each stand leaves, and the heading as the record grows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from allanite.experiments.north import Arc
from allanite.quantities.quantity import Quantity
from allanite.views.figures.compass import card, point_on, rate_gauge
from allanite.views.figures.drawing import Drawing, DrawnShape, Words, arc, arrow, circle, line, wedge
from allanite.views.figures.earth import DEG_H
from allanite.views.figures.panel import Axis, Curve, Panel, around, array
from allanite.views.figures.records import clock
from allanite.views.wording import arcs_words, direction_words, number

__all__ = ["VIEWS", "compass_panel", "convergence_panels", "residual_panels"]

Json = Mapping[str, Any]
_Parts = list[DrawnShape | Words]

VIEWS = ("whole", "compass", "convergence", "residuals")
_CENTRE, _RADIUS, _WORDS = (22.0, 21.0), 15.0, 47.0
_SETTLED = 0.1  # part of the record after which the band must lie inside the frame


# -- compass ----------------------------------------------------------------------------------------------


def compass_panel(document: Json) -> Panel:
    """The heading on a compass, north upwards, with what was found in words beside it."""
    parts = [
        *card(),
        *_needle(document),
        *_said(document),
        *rate_gauge(_horizontal(document), document["expected_rate"]),
    ]
    return Panel(title=_title(document), drawing=Drawing(width=100.0, height=42.0, parts=tuple(parts)))


def _horizontal(document: Json) -> Quantity:
    rate, ends = document["horizontal_rate"], document["horizontal_interval"]
    value, *both = (math.nan if v is None else v for v in (rate, *ends))
    return Quantity.of(value, (both[0], both[1]), "rad/s")


def _title(document: Json) -> str:
    axis = document["last"]["heading_axis"]
    return f"Where the {axis} axis points" + ("" if document["mode"] == "static" else " at the end")


def _needle(document: Json) -> _Parts:
    """The arc that is allowed, the heading, and the naive mean where it is elsewhere."""
    interval, last = document["last"]["interval"], document["last"]
    start = math.pi / 2 - interval["start"]
    stop = start - interval["width"]
    parts: _Parts = [
        wedge(_CENTRE, _RADIUS, start, stop, fill="z", opacity=0.22, name="arc"),
        line(*arc(_CENTRE, _RADIUS, start, stop), colour="z", width=3.0, name="rim"),
    ]
    naive = document["naive"]
    if naive is not None and naive["flagged"] and naive["heading"] is not None:
        tip = point_on(math.degrees(naive["heading"]), _RADIUS - 0.4)
        parts.append(line(_CENTRE, tip, colour="limit", dashed=True, name="naive mean"))
    if last["heading"] is None:
        return [*parts, circle(_CENTRE, 0.8, fill="guide", colour=None)]
    colour = "ink" if document["verdict"] == "resolved" else "guide"
    tip = point_on(math.degrees(last["heading"]), _RADIUS - 0.4)
    return [
        *parts,
        *arrow(_CENTRE, tip, colour=colour, width=1.8, name="heading"),
        circle(_CENTRE, 0.8, fill=colour, colour=None),
    ]


def _said(document: Json) -> _Parts:
    last, percent = document["last"], f"{100 * document['confidence']:g} %"
    rows = [(document["verdict"], True)]
    if last["heading"] is None:
        rows += [("every direction is possible", False)]
    else:
        rows += [
            (f"heading {direction_words(last)}", False),
            (f"{percent} interval {arcs_words([Arc.from_json(last['interval'])])}", False),
        ]
    naive = document["naive"]
    if naive is not None and naive["flagged"]:
        dashed = f"dashed: mean of the first {naive['duration']:.0f} s, {math.degrees(naive['heading']):.1f}°"
        rows.append((dashed, False))
    else:
        rows.append((f"signal to noise {number(document['signal_to_noise'], 2)}", False))
    return [
        Words(
            x=_WORDS, y=37.5 - 3.1 * i, text=text, bold=bold, across="left", size=1.15 if bold else 1.0,
            colour="limit" if text.startswith("dashed") else "ink",
        )
        for i, (text, bold) in enumerate(rows)
    ]  # fmt: skip


# -- as the record grows ----------------------------------------------------------------------------------


def convergence_panels(document: Json) -> list[Panel]:
    """The heading, as its distance from the result, with its interval; nothing where none was found."""
    running, result = document["running"], document["last"]["heading"]
    heading, start, width = (array(running[name]) for name in ("heading", "start", "width"))
    known = np.isfinite(heading) & (width < 2 * math.pi)
    if result is None or not known.any():
        return []
    unit, second = clock(document["duration"])
    time = array(running["time"]) / second
    away = np.degrees(_difference(heading, result))
    low = np.degrees(_difference(start, result))
    low = np.where(low > away, low - 360, low)
    high = low + np.degrees(width)
    known &= np.isfinite(away)
    late = known & (time >= _SETTLED * time[-1])
    ends = around([0.0], away[late], low[late], high[late])
    curve = Curve(
        x=time[known],
        y=away[known],
        lower=low[known],
        upper=high[known],
        label="heading so far",
        colour="z",
        band_label=f"{100 * document['confidence']:g} % interval",
    )
    return [
        Panel(
            title="Heading as the record grows",
            x=Axis(
                label=f"Time since the first sample [{unit}]",
                limits=(0.0, 1.02 * document["duration"] / second),
            ),
            y=Axis(
                label=f"Heading − {direction_words(document['last'])} [deg]",
                limits=(max(ends[0], -180.0), min(ends[1], 180.0)),
            ),
            curves=(curve,),
            height=0.34,
            key="above",
        )
    ]


def _difference(angle: Any, other: float) -> Any:
    """Of two directions, -pi to pi."""
    return (angle - other + math.pi) % (2 * math.pi) - math.pi


# -- what the stands leave --------------------------------------------------------------------------------


def residual_panels(document: Json) -> list[Panel]:
    """What each gyro shows in each stand less the fit; nothing for one attitude, which fits by itself."""
    stands = document["stands"]
    if len(stands) < 2:
        return []
    number_of = np.arange(1, len(stands) + 1, dtype=np.float64)
    residual = np.array([s["residual"] for s in stands]) / DEG_H
    sds = np.array([s["sd"] for s in stands]) / DEG_H
    looks = (("x", "circle", -0.15), ("y", "square", 0.0), ("z", "triangle", 0.15))
    curves = tuple(
        Curve(
            x=number_of + shift,
            y=residual[:, i],
            lower=residual[:, i] - sds[:, i],
            upper=residual[:, i] + sds[:, i],
            bars=True,
            style="none",
            marker=marker,
            colour=colour,
            label=name,
        )
        for i, ((colour, marker, shift), name) in enumerate(
            zip(looks, document["channels"]["gyro"], strict=True)
        )
    )
    zero = Curve(
        x=array([0.4, len(stands) + 0.6]), y=array([0.0, 0.0]), label="", colour="guide", style="thin"
    )
    names = tuple((float(n), f"{n:.0f}") for n in number_of) if len(stands) <= 24 else ()
    return [
        Panel(
            title="What each stand leaves",
            x=Axis(label="Stand", limits=(0.4, len(stands) + 0.6), names=names),
            y=Axis(label="Rate less the fit [deg/h]", limits=around([0.0], residual - sds, residual + sds)),
            curves=(*curves, zero),
            height=0.3,
            key="above",
        )
    ]
