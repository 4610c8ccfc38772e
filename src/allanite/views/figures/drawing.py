# SPDX-License-Identifier: BSD-3-Clause
"""Line drawings, said without a plotting library: outlines and words on a plane whose unit is as long up as across.

Everything a drawing needs comes down to two parts, so that a renderer needs no more: an arrow is a line and a filled
triangle, a circle is a polygon. Colours are names, as in `allanite.views.figures.panel`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Literal

from allanite.lazy_dataclasses import dataclass

__all__ = ["Drawing", "DrawnShape", "Point", "Words", "arc", "arrow", "box", "circle", "line", "wedge"]

Point = tuple[float, float]

_STEP = math.radians(3.0)  # of the polygons that stand for circles
_HEAD = 1.5  # length of an arrow's head for a line of width 1
_CORNER = (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi)


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnShape:
    """A line through points, or the area inside them.

    Attributes
    ----------
    points : tuple of (float, float)
    closed : bool
    colour : str or None
        Of the line; None for an area without one.
    fill : str or None
    opacity : float
        Of the fill.
    width : float
        Of the line, 1 for an ordinary one.
    dashed : bool
    name : str
        What it stands for.
    """

    points: tuple[Point, ...]
    closed: bool = False
    colour: str | None = "ink"
    fill: str | None = None
    opacity: float = 1.0
    width: float = 1.0
    dashed: bool = False
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Words:
    """Words at a point; a line break is a line break.

    Attributes
    ----------
    size : float
        1 for ordinary words.
    across : "left", "center" or "right"
        Which part of the words stands at x.
    up : "bottom", "middle" or "top"
    """

    x: float
    y: float
    text: str
    colour: str = "ink"
    size: float = 1.0
    bold: bool = False
    across: Literal["left", "center", "right"] = "center"
    up: Literal["bottom", "middle", "top"] = "middle"


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """Parts in the order in which they are painted, on a sheet from (0, 0) to (width, height)."""

    width: float
    height: float
    parts: tuple[DrawnShape | Words, ...]

    @property
    def words(self) -> tuple[str, ...]:
        """All that is written in it."""
        return tuple(part.text for part in self.parts if isinstance(part, Words))

    def named(self, name: str) -> tuple[DrawnShape, ...]:
        """The shapes of one name."""
        return tuple(part for part in self.parts if isinstance(part, DrawnShape) and part.name == name)


# -- outlines ---------------------------------------------------------------------------------------------


def line(
    *points: Point, colour: str = "ink", width: float = 1.0, dashed: bool = False, name: str = ""
) -> DrawnShape:
    """An open line."""
    return DrawnShape(points=points, colour=colour, width=width, dashed=dashed, name=name)


def box(
    left: float,
    bottom: float,
    width: float,
    height: float,
    *,
    round_: float = 0.0,
    colour: str | None = "ink",
    fill: str | None = None,
    opacity: float = 1.0,
    line_width: float = 1.0,
    name: str = "",
) -> DrawnShape:
    """A rectangle; `round_` is the radius of its corners."""
    right, top, r = left + width, bottom + height, round_
    centres = ((right - r, top - r), (left + r, top - r), (left + r, bottom + r), (right - r, bottom + r))
    points: list[Point] = []
    for centre, start in zip(centres, _CORNER, strict=True):
        points += _round(centre, r, start, start + 0.5 * math.pi) if r > 0 else [centre]
    return DrawnShape(
        points=tuple(points),
        closed=True,
        colour=colour,
        fill=fill,
        opacity=opacity,
        width=line_width,
        name=name,
    )


def circle(
    centre: Point,
    radius: float,
    *,
    flat: float = 1.0,
    colour: str | None = "ink",
    fill: str | None = None,
    opacity: float = 1.0,
    width: float = 1.0,
    name: str = "",
) -> DrawnShape:
    """A circle, or with `flat` < 1 one that is seen from the side."""
    points = tuple(_round(centre, radius, 0.0, 2 * math.pi, flat)[:-1])
    return DrawnShape(
        points=points, closed=True, colour=colour, fill=fill, opacity=opacity, width=width, name=name
    )


def arc(centre: Point, radius: float, start: float, stop: float, *, flat: float = 1.0) -> tuple[Point, ...]:
    """Points of an arc [rad], from `start` to `stop`, counted from the right and upwards."""
    return tuple(_round(centre, radius, start, stop, flat))


def wedge(
    centre: Point,
    radius: float,
    start: float,
    stop: float,
    *,
    fill: str,
    opacity: float = 0.2,
    colour: str | None = None,
    name: str = "",
) -> DrawnShape:
    """A sector of a circle [rad]."""
    points = (centre, *_round(centre, radius, start, stop))
    return DrawnShape(points=points, closed=True, colour=colour, fill=fill, opacity=opacity, name=name)


def arrow(
    *points: Point,
    colour: str = "ink",
    width: float = 1.0,
    both: bool = False,
    head: float | None = None,
    name: str = "",
) -> tuple[DrawnShape, ...]:
    """A line with a head at its last point, and with `both` at its first one too."""
    length = head or _HEAD * (0.5 + 0.5 * width)
    body = list(points)
    heads = []
    for end in (-1, 0) if both else (-1,):
        outline, foot = _head(points, end, length)
        body = [
            p for p in body if math.dist(p, points[end]) >= length
        ]  # a curved line ends where its head begins
        body.insert(len(body) if end == -1 else 0, foot)
        heads.append(
            DrawnShape(
                points=outline, closed=True, colour=None, fill=colour, name=f"{name} head" if name else ""
            )
        )
    return (line(*body, colour=colour, width=width, name=name), *heads)


def _head(points: Sequence[Point], end: int, length: float) -> tuple[tuple[Point, ...], Point]:
    """The triangle at one end of a line, and where the line stops so that its end does not show."""
    tip = points[end]
    before = _before(points if end == -1 else points[::-1], length)
    angle = math.atan2(tip[1] - before[1], tip[0] - before[0])
    sides = [_at(tip, -length, angle + turn) for turn in (0.35, -0.35)]
    return (tip, *sides), _at(tip, -0.8 * length, angle)


def _before(points: Sequence[Point], length: float) -> Point:
    """The last point of a line that lies at least so far from its end: a curved line bends within its head."""
    tip = points[-1]
    far = [p for p in points[:-1] if math.dist(p, tip) >= length]
    return far[-1] if far else points[0]


def _at(point: Point, distance: float, angle: float) -> Point:
    return point[0] + distance * math.cos(angle), point[1] + distance * math.sin(angle)


def _round(centre: Point, radius: float, start: float, stop: float, flat: float = 1.0) -> list[Point]:
    steps = max(2, math.ceil(abs(stop - start) / _STEP))
    angles: Iterable[float] = (start + (stop - start) * i / steps for i in range(steps + 1))
    return [(centre[0] + radius * math.cos(a), centre[1] + flat * radius * math.sin(a)) for a in angles]
