# SPDX-License-Identifier: BSD-3-Clause
"""Positions on a sphere: which way was up, in the axes of the sensor. Both halves of the sphere, so that none hides.

The sphere is seen from a point between +x, +y and +z, and from the opposite one, so that no axis and none of the
directions halfway between two of them falls on the rim. The map is Lambert's of equal area: a gap that looks large is
large.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.views.figures.drawing import Drawing, DrawnShape, Point, Words, circle, line
from allanite.views.figures.panel import Panel

__all__ = ["SPOT_LOOKS", "Spot", "SpotLook", "sphere", "sphere_panel"]

Array = NDArray[np.float64]
_Box = tuple[float, float, float, float]
SpotKind = Literal["used", "outlier", "left out", "proposed"]

_WIDTH, _HEIGHT = 100.0, 49.0
_RADIUS = 19.0
_CENTRES: tuple[Point, Point] = ((25.5, 25.0), (74.5, 25.0))
_KEY = 2.2  # height of the legend
_DOT = 0.95
_SIZE = 0.82  # of the numbers
_CHARACTER, _LINE = 1.0, 2.1  # room of words of size 1
_TOGETHER = 1.2  # dots so close share one number
_MOST_SAID = 3  # numbers at one place
_VIEW = np.array([0.80, 0.52, 0.28])
_AXES = (("x", (1.0, 0.0, 0.0)), ("y", (0.0, 1.0, 0.0)), ("z", (0.0, 0.0, 1.0)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Spot:
    """A position.

    Attributes
    ----------
    up : tuple of float, shape (3,)
        Direction of up in the axes of the sensor, of any length: along it an accelerometer at rest reads +g.
    label : str
        Its number.
    kind : "used", "outlier", "left out" or "proposed"
    """

    up: tuple[float, float, float]
    label: str = ""
    kind: SpotKind = "used"


@dataclass(frozen=True, slots=True, kw_only=True)
class SpotLook:
    """Colour, form and words for the legend. The forms differ as well: colour alone tells nobody anything."""

    colour: str
    corners: int  # 0: a circle
    filled: bool
    words: str
    size: float = 1.0


SPOT_LOOKS: Mapping[SpotKind, SpotLook] = MappingProxyType(
    {
        "used": SpotLook(colour="z", corners=0, filled=True, words="position"),
        "outlier": SpotLook(colour="x", corners=4, filled=True, words="outlier", size=1.5),
        "left out": SpotLook(colour="guide", corners=0, filled=False, words="left out"),
        "proposed": SpotLook(colour="limit", corners=3, filled=False, words="proposed", size=1.5),
    }
)


def sphere_panel(
    spots: Sequence[Spot],
    *,
    title: str = "Direction of up, in the axes of the sensor",
    words: Mapping[str, str] | None = None,
) -> Panel:
    """A panel of `sphere`."""
    return Panel(title=title, drawing=sphere(spots, words=words))


def sphere(spots: Sequence[Spot], *, words: Mapping[str, str] | None = None) -> Drawing:
    """Positions on both halves of the sphere, on a sheet of 100 by 49.

    Parameters
    ----------
    spots : sequence of Spot
    words : mapping of str to str, optional
        Words of the legend, by kind, in place of the usual ones.
    """
    parts: list[DrawnShape | Words] = []
    for side, centre in zip((1.0, -1.0), _CENTRES, strict=True):
        globe = _Globe(centre, side, spots)
        parts += [*globe.ground(), *globe.axes(), *globe.marks(), *globe.numbers()]
    return Drawing(width=_WIDTH, height=_HEIGHT, parts=(*parts, *_legend(spots, words or {})))


class _Globe:
    """One half of the sphere, seen from outside, z upwards."""

    def __init__(self, centre: Point, side: float, spots: Sequence[Spot]) -> None:
        self.centre, self.side = centre, side
        self.view = side * _VIEW / np.linalg.norm(_VIEW)
        up = np.array([0.0, 0.0, 1.0]) - self.view[2] * self.view
        self.up = up / np.linalg.norm(up)
        self.right = np.cross(self.up, self.view)
        places = [(self.place(spot.up), spot) for spot in spots]
        self.here = [(point, spot) for point, spot in places if point is not None]
        # What words must not cover.
        self.taken = [_around(point, _DOT * SPOT_LOOKS[spot.kind].size) for point, spot in self.here]
        self.lines: list[_Box] = []

    def place(self, direction: ArrayLike) -> Point | None:
        """Where a direction stands on the sheet; None on the other half, or for no direction."""
        d = np.asarray(direction, dtype=np.float64)
        length = float(np.linalg.norm(d))
        if not (math.isfinite(length) and length > 0):
            return None
        d = d / length
        depth = float(d @ self.view)
        if depth < 0:
            return None
        across, up = float(d @ self.right), float(d @ self.up)
        flat = math.hypot(across, up)
        far = _RADIUS * math.sqrt(1 - depth) / flat if flat > 0 else 0.0  # Lambert's map of equal area
        return self.centre[0] + far * across, self.centre[1] + far * up

    # -- the sphere itself

    def ground(self) -> list[DrawnShape | Words]:
        """The rim, and the three circles in which two axes lie."""
        x, y = self.centre
        corner = "+x, +y and +z" if self.side > 0 else "−x, −y and −z"
        parts: list[DrawnShape | Words] = [
            circle(self.centre, _RADIUS, fill="gap", opacity=0.1, colour="guide", name="globe"),
            Words(x=x, y=y + _RADIUS + 2.3, text=f"seen from between {corner}", colour="guide", size=0.92),
        ]
        for (_, first), (_, second) in zip(_AXES, (*_AXES[1:], _AXES[0]), strict=True):
            parts += self._great_circle(np.array(first), np.array(second))
        return parts

    def _great_circle(self, first: Array, second: Array) -> list[DrawnShape]:
        angles = np.radians(np.arange(0.0, 361.0, 3.0))
        points = [self.place(math.cos(a) * first + math.sin(a) * second) for a in angles]
        runs: list[list[Point]] = [[]]
        for point in points:
            if point is None:
                runs.append([])
            else:
                runs[-1].append(point)
        self.lines += [_around(point, 0.1) for run in runs for point in run]
        return [line(*run, colour="guide", width=0.6, name="plane") for run in runs if len(run) > 1]

    def axes(self) -> list[DrawnShape | Words]:
        """The ends of the axes with their names."""
        parts: list[DrawnShape | Words] = []
        for name, axis in _AXES:
            end = self.place(self.side * np.array(axis))
            if end is None:
                continue
            text = ("+" if self.side > 0 else "−") + name
            x, y = min((self._crowd(_box(*at, text, 1.0)), at) for at in _ring(end, 2.2))[1]
            self.taken += [_around(end, 0.5), _box(x, y, text, 1.0)]
            parts.append(circle(end, 0.45, colour=None, fill="guide", name="axis"))
            parts.append(Words(x=x, y=y, text=text, bold=True, colour="guide"))
        return parts

    def _crowd(self, box: _Box) -> int:
        """How much words would cover there: marks count more than lines."""
        return sum(10 * _overlap(box, other) for other in self.taken) + sum(
            _overlap(box, other) for other in self.lines
        )

    # -- positions

    def marks(self) -> list[DrawnShape | Words]:
        """A mark for each position on this half."""
        return [_mark(point, spot.kind) for point, spot in self.here]

    def numbers(self) -> list[DrawnShape | Words]:
        """Their numbers; positions that fall together share one place. Those that stand out come first."""
        groups = sorted(_groups(self.here), key=lambda g: all(spot.kind == "used" for _, spot in g))
        return [words for group in groups for words in self._number(group)]

    def _number(self, group: Sequence[tuple[Point, Spot]]) -> list[Words]:
        """The numbers of one place, where they cover nothing; left away where there is no room and no need."""
        labels = [spot.label for _, spot in group if spot.label]
        if not labels:
            return []
        more = len(labels) - _MOST_SAID
        text = ", ".join(labels[:_MOST_SAID]) + (f" +{more}" if more > 0 else "")
        x, y = (sum(point[i] for point, _ in group) / len(group) for i in (0, 1))
        needed = any(spot.kind != "used" for _, spot in group)
        colour = next((SPOT_LOOKS[s.kind].colour for _, s in group if s.kind == "outlier"), "ink")
        half = 0.5 * _CHARACTER * _SIZE * len(text)
        free = next(
            (
                at
                for far in (0.0, 1.6, 3.2)
                for at in _ring((x, y), _DOT + 0.7 + far, half)
                if not any(_overlap(_box(*at, text, _SIZE), other) for other in self.taken)
            ),
            None,
        )
        if free is None and not needed:
            return []
        place = free or (x, y + 2.2)
        self.taken.append(_box(*place, text, _SIZE))
        return [Words(x=place[0], y=place[1], text=text, colour=colour, size=_SIZE, bold=colour != "ink")]


# -- marks and words --------------------------------------------------------------------------------------


def _mark(point: Point, kind: SpotKind) -> DrawnShape:
    look = SPOT_LOOKS[kind]
    edge, fill = ("paper", look.colour) if look.filled else (look.colour, "paper")
    size, width = _DOT * look.size, 0.8 if look.filled else 1.2
    if not look.corners:
        return circle(point, size, width=width, name=kind, colour=edge, fill=fill)
    angles = [math.pi / 2 + 2 * math.pi * i / look.corners for i in range(look.corners)]
    points = tuple((point[0] + size * math.cos(a), point[1] + size * math.sin(a)) for a in angles)
    return DrawnShape(points=points, closed=True, width=width, name=kind, colour=edge, fill=fill)


def _legend(spots: Sequence[Spot], words: Mapping[str, str]) -> list[DrawnShape | Words]:
    """Forms that occur, in a row below."""
    present = [kind for kind in SPOT_LOOKS if any(spot.kind == kind for spot in spots)]
    texts = [words.get(kind, SPOT_LOOKS[kind].words) for kind in present]
    widths = [4.0 + 0.95 * len(text) for text in texts]
    x = 0.5 * (_WIDTH - sum(widths))
    parts: list[DrawnShape | Words] = []
    for kind, text, width in zip(present, texts, widths, strict=True):
        parts.append(_mark((x, _KEY), kind))
        parts.append(Words(x=x + 1.9, y=_KEY, text=text, across="left", size=0.92))
        x += width
    return parts


def _groups(here: Sequence[tuple[Point, Spot]]) -> Iterable[list[tuple[Point, Spot]]]:
    """Positions that fall together on the sheet."""
    groups: list[list[tuple[Point, Spot]]] = []
    for point, spot in here:
        near = next((g for g in groups if math.dist(g[0][0], point) < _TOGETHER), None)
        if near is None:
            groups.append([(point, spot)])
        else:
            near.append((point, spot))
    return groups


def _ring(point: Point, far: float, half: float = 0.0) -> list[Point]:
    """Places for words around a point; `half` is half their width."""
    high = far + 0.2 + 0.5 * _LINE * _SIZE if half else far
    angles = np.radians([0, 180, 60, 120, 240, 300, 90, 270])
    return [(point[0] + (far + half) * math.cos(a), point[1] + high * math.sin(a)) for a in angles]


def _around(point: Point, half: float) -> _Box:
    return point[0] - half, point[1] - half, point[0] + half, point[1] + half


def _box(x: float, y: float, text: str, size: float) -> _Box:
    half, up = 0.5 * _CHARACTER * size * len(text), 0.5 * _LINE * size
    return x - half, y - up, x + half, y + up


def _overlap(one: _Box, other: _Box) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]
