# SPDX-License-Identifier: BSD-3-Clause
"""An alignment: the compass with its arc, what each stand leaves, and the heading as the record grows."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from allanite.experiments.alignment import AlignmentEstimate
from allanite.experiments.alignment.results import NaiveMean
from allanite.quantities.number_words import number
from allanite.views.figures.compass import (
    CENTRE,
    RADIUS,
    beside_card,
    card,
    needle,
    point_on,
    rate_gauge,
    sector,
)
from allanite.views.figures.drawing import Drawing, DrawnShape, Words, line
from allanite.views.figures.earth import DEG_H
from allanite.views.figures.panel import Axis, Curve, Panel, around, array
from allanite.views.figures.records import clock
from allanite.views.wording.north import arcs_words, direction_words

__all__ = ["VIEWS", "compass_panel", "convergence_panels", "residual_panels"]

VIEWS = ("whole", "compass", "convergence", "residuals")
_SETTLED = 0.1  # part of the record after which the band must lie inside the frame


# -- compass ----------------------------------------------------------------------------------------------


def compass_panel(result: AlignmentEstimate) -> Panel:
    """The heading on a compass, north upwards, with what it comes to in words beside it."""
    parts = [
        *card(),
        *_needle(result),
        *_beside(result),
        *rate_gauge(result.horizontal_length, result.expected_rate),
    ]
    when = "" if result.one_attitude else " at the end"
    return Panel(
        title=f"Where the {result.last.heading_axis} axis points{when}",
        drawing=Drawing(width=100.0, height=42.0, parts=tuple(parts)),
    )


def _naive(result: AlignmentEstimate) -> NaiveMean | None:
    """The plain mean, where it points elsewhere."""
    naive = result.naive
    return naive if naive is not None and naive.flagged and not math.isnan(naive.heading) else None


def _needle(result: AlignmentEstimate) -> list[DrawnShape | Words]:
    """The arc that is allowed, the heading, and the naive mean where it is elsewhere."""
    parts = sector(result.interval)
    if naive := _naive(result):
        tip = point_on(math.degrees(naive.heading), RADIUS - 0.4)
        parts.append(line(CENTRE, tip, colour="limit", dashed=True, name="naive mean"))
    return [*parts, *needle(result.heading, "heading", sure=result.resolved)]


def _beside(result: AlignmentEstimate) -> list[DrawnShape | Words]:
    lines = [result.verdict.words, "every direction is possible"]
    if not math.isnan(result.heading):
        percent = f"{100 * result.confidence:g} %"
        arcs = arcs_words([result.interval])
        lines[1:] = [f"heading {direction_words(result.last)}", f"{percent} interval {arcs}"]
    naive = _naive(result)
    if naive is None:
        lines.append(f"signal-to-noise ratio {number(result.signal_to_noise, 2)}")
    else:
        mean = f"mean of the first {naive.duration:.0f} s, {math.degrees(naive.heading):.1f}°"
        lines.append(f"dashed: {mean}")
    return beside_card(lines)


# -- as the record grows ----------------------------------------------------------------------------------


def convergence_panels(result: AlignmentEstimate) -> list[Panel]:
    """The heading, as its distance from the result, with its interval; nothing where none was found."""
    running, at_end = result.running, result.heading
    heading, start, width = running.heading, running.start, running.width
    known = np.isfinite(heading) & (width < 2 * math.pi)
    if math.isnan(at_end) or not known.any():
        return []
    unit, second = clock(result.duration)
    time = running.time / second
    away = np.degrees(_difference(heading, at_end))
    low = np.degrees(_difference(start, at_end))
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
        band_label=f"{100 * result.confidence:g} % interval",
    )
    return [
        Panel(
            title="Heading as the record grows",
            x=Axis(
                label=f"Time since the first sample [{unit}]",
                limits=(0.0, 1.02 * result.duration / second),
            ),
            y=Axis(
                label=f"Heading − {direction_words(result.last)} [deg]",
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


def residual_panels(result: AlignmentEstimate) -> list[Panel]:
    """What each gyro shows in each stand less the fit; nothing for one attitude, which fits by itself."""
    stands = result.stands
    if len(stands) < 2:
        return []
    number_of = np.arange(1, len(stands) + 1, dtype=np.float64)
    residual = np.array([s.residual for s in stands]) / DEG_H
    sds = np.array([s.sd for s in stands]) / DEG_H
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
        for i, ((colour, marker, shift), name) in enumerate(zip(looks, result.channels["gyro"], strict=True))
    )
    zero = Curve(
        x=array([0.4, len(stands) + 0.6]), y=array([0.0, 0.0]), label="", colour="guide", style="thin"
    )
    names = tuple((float(n), f"{n:.0f}") for n in number_of) if len(stands) <= 24 else ()
    return [
        Panel(
            title="Residuals of each stand",
            x=Axis(label="Stand", limits=(0.4, len(stands) + 0.6), names=names),
            y=Axis(label="Rate less the fit [deg/h]", limits=around([0.0], residual - sds, residual + sds)),
            curves=(*curves, zero),
            height=0.3,
            key="above",
        )
    ]
