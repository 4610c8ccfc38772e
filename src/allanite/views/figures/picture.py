# SPDX-License-Identifier: BSD-3-Clause
"""Panels as a still SVG, written without a plotting library: what a report shows on paper and where no script runs.

Sizes are points. Places, line widths and words are those of `allanite.views.figures.matplotlib`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.printable import printable
from allanite.views.figures.drawing import Drawing, DrawnShape, Words
from allanite.views.figures.frames import BOTTOM, CHARACTERS, KEY, LEFT, Box, layout, limits_of
from allanite.views.figures.panel import (
    LIGHT,
    SPAN_LOOKS,
    Array,
    Axis,
    Curve,
    Envelope,
    Guide,
    Label,
    LegendEntry,
    Limit,
    Panel,
    Rug,
    ShadedSpan,
    Sheet,
    array,
    thinned,
)
from allanite.views.figures.ticks import APART, Ticks, ticks_of

__all__ = ["svg"]

_POINTS = 72.0  # in an inch
_FONT = "DejaVu Sans, Verdana, Arial, sans-serif"
_DASHES = {"dashed": (5.0, 2.2), "dotted": (1.0, 2.0), "dashdot": (6.0, 2.0, 1.2, 2.0)}
_WIDTHS = {"solid": 1.1, "thin": 0.8}
#: Outlines of markers of half-width 1: where they begin, and the steps from there.
_OUTLINES = {
    "square": ((-0.9, -0.9), (1.8, 0.0), (0.0, 1.8), (-1.8, 0.0)),
    "triangle": ((0.0, -1.1), (1.05, 1.9), (-2.1, 0.0)),
    "diamond": ((0.0, -1.25), (1.25, 1.25), (-1.25, 1.25), (-1.25, -1.25)),
    "down": ((0.0, 1.1), (1.05, -1.9), (-2.1, 0.0)),
    "cross": ((-0.9, -0.9), (1.8, 1.8), (-1.8, 0.0), (1.8, -1.8)),
}
_OFFSETS = {"above": (0, 7), "below": (0, -7), "right": (7, 0), "left": (-7, 0)}
_LETTER = 0.6  # width of a letter, as a part of the size of its font
_SAMPLE = 20.0  # length of a line in the legend
_FAR = 1e5  # beyond this a coordinate says nothing more
_BASE = 0.35  # from the middle of a letter to its foot


def svg(sheet: Sheet) -> str:
    """A sheet as SVG text; equal sheets give equal texts."""
    size, boxes = layout(sheet)
    width, height = (_POINTS * part for part in size)
    page = _Picture(height, crowded=sheet.columns > 1)
    page.rectangle(0, 0, width, height, "paper")
    labelled = [sheet.labelled(i) for i, row in enumerate(sheet.rows) for _ in row]
    for panel, box, numbered in zip(sheet.panels, boxes, labelled, strict=True):
        page.panel(panel, box, titled=len(sheet.panels) > 1, numbered=numbered)
    if page.crowded:
        page.foot(sheet, width)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_at(width)}pt" height="{_at(height)}pt" '
        f'viewBox="0 0 {_at(width)} {_at(height)}" font-family="{_FONT}" font-size="8.5" fill="none" '
        'stroke-linejoin="round">'
    )
    return printable(head + "".join(page.parts) + "</svg>", lines=True)  # XML holds no control character


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plane:
    """A frame on the page, and where the values of its panel are: points from the upper left corner."""

    left: float
    top: float
    width: float
    height: float
    log: tuple[bool, bool]
    x: tuple[float, float]
    y: tuple[float, float]

    def across(self, values: Array) -> Array:
        return self.left + self.width * _shares(values, self.x, log=self.log[0])

    def up(self, values: Array) -> Array:
        return self.top + self.height * (1.0 - _shares(values, self.y, log=self.log[1]))

    def point(self, x: float, y: float) -> tuple[float, float]:
        return float(self.across(array([x]))[0]), float(self.up(array([y]))[0])

    @property
    def right(self) -> float:
        return self.left + self.width

    @property
    def foot(self) -> float:
        return self.top + self.height


def _shares(values: Array, ends: tuple[float, float], *, log: bool) -> Array:
    """Where values are between the ends; NaN for what a logarithmic axis cannot show."""
    low, high = ends
    if log:
        values = np.log10(np.where(values > 0, values, np.nan))
        low, high = math.log10(low), math.log10(high)
    share = (values - low) / (high - low) if high != low else values - low + 0.5
    return np.asarray(np.clip(share, -_FAR, _FAR))


class _Picture:
    """The text of the picture while it grows."""

    def __init__(self, height: float, *, crowded: bool) -> None:
        self.parts: list[str] = []
        self.crowded = crowded
        self._height, self._count = height, 0

    # -- ink ----------------------------------------------------------------------------------------------------

    def path(
        self,
        way: str,
        colour: str,
        width: float = 1.0,
        style: str = "solid",
        *,
        fill: bool = False,
        opacity: float = 1.0,
        more: str = "",
    ) -> None:
        """A line, or an area where `fill`."""
        if not way:
            return
        dash = (
            f' stroke-dasharray="{" ".join(_at(width * d) for d in _DASHES[style])}"'
            if style in _DASHES
            else ""
        )
        ink = f'fill="{LIGHT[colour]}"' if fill else f'stroke="{LIGHT[colour]}"'
        wide = "" if fill or width == 1.0 else f' stroke-width="{_at(width)}"'
        faint = f' opacity="{_at(opacity)}"' if opacity < 1 else ""
        self.parts.append(f'<path d="{way}" {ink}{wide}{dash}{faint}{more}/>')

    def rectangle(
        self, x: float, y: float, width: float, height: float, colour: str, opacity: float = 1.0
    ) -> None:
        """A filled rectangle."""
        self.path(
            f"M{_at(x)} {_at(y)}h{_at(width)}v{_at(height)}h{_at(-width)}z",
            colour,
            fill=True,
            opacity=opacity,
        )

    def text(
        self,
        x: float,
        y: float,
        words: str,
        colour: str = "ink",
        size: float = 8.5,
        across: str = "middle",
        *,
        bold: bool = False,
        turned: float = 0.0,
        halo: bool = False,
    ) -> None:
        """Words whose foot is at y; lines below one another."""
        look = f' font-size="{_at(size)}"' if size != 8.5 else ""
        look += ' font-weight="bold"' if bold else ""
        look += f' transform="rotate({_at(turned)} {_at(x)} {_at(y)})"' if turned else ""
        if halo:
            look += f' stroke="{LIGHT["paper"]}" stroke-width="2.4" paint-order="stroke"'
        rows = escape(words, quote=False).split("\n")
        lines = rows[0] + "".join(
            f'<tspan x="{_at(x)}" dy="{_at(1.25 * size)}">{row}</tspan>' for row in rows[1:]
        )
        anchor = "" if across == "start" else f' text-anchor="{across}"'
        self.parts.append(
            f'<text x="{_at(x)}" y="{_at(y)}" fill="{LIGHT[colour]}"{anchor}{look}>{lines}</text>'
        )

    # -- panels -------------------------------------------------------------------------------------------------

    def panel(self, panel: Panel, box: Box, *, titled: bool, numbered: bool) -> None:
        """A panel in its box [inch, from the lower left corner of the page]."""
        left, bottom, width, height = (_POINTS * part for part in box)
        top = self._height - bottom - height
        columns, rows = panel.key_grid(round(box[2] * CHARACTERS)) if panel.key == "above" else (1, 0)
        lift = top - (12 if panel.x.landmarks else 3)
        if titled:
            self.text(left, lift - 2 - _POINTS * KEY * rows, panel.title, size=9.5, across="start", bold=True)
        if panel.drawing is not None:
            self._drawing(panel.drawing, left, top, width / panel.drawing.width)
            return
        x, y = limits_of(panel)
        plane = _Plane(
            left=left, top=top, width=width, height=height, log=(panel.x.log, panel.y.log), x=x, y=y
        )
        across, up = ticks_of(panel.x, x, width, APART[0]), ticks_of(panel.y, y, height, APART[1])
        self._grid(plane, across, up)
        self._contents(panel, plane)
        self._frame(panel, plane, across, up, numbered=numbered)
        if rows:
            self._key_above(panel.legend, left, lift - _POINTS * KEY * (rows - 1) - 4, columns, rows)
        elif len(panel.legend) > 1 and panel.curves and not self.crowded:
            self._key_inside(panel, plane)

    def _contents(self, panel: Panel, plane: _Plane) -> None:
        self._count += 1
        name = f"p{self._count}"
        size = f'width="{_at(plane.width)}" height="{_at(plane.height)}"'
        frame = f'<rect x="{_at(plane.left)}" y="{_at(plane.top)}" {size}/>'
        self.parts.append(f'<clipPath id="{name}">{frame}</clipPath><g clip-path="url(#{name})">')
        for span in panel.spans:
            self._span(span, plane)
        for label in panel.labels:
            self._rule(label, plane)
        for guide in panel.guides:
            self.path(_line(plane.across(array(guide.x)), plane.up(array(guide.y))), "guide", 0.7)
        for limit in panel.limits:
            self.path(_line(plane.across(limit.x), plane.up(limit.y)), "limit", 1.1, "dotted")
        for envelope in panel.envelopes:
            self._envelope(envelope, plane)
        for curve in panel.curves:
            self._curve(curve, plane)
        for rug in panel.rugs:
            self._rug(rug, plane)
        self.parts.append("</g>")
        for guide in panel.guides:
            self._guide_name(guide, plane)
        for limit in panel.limits:
            self._limit(limit, plane)
        for label in panel.labels:
            self._label(label, plane)

    def _grid(self, plane: _Plane, across: Ticks, up: Ticks) -> None:
        at = plane.across(array([value for value, _ in across.major])).tolist()
        way = "".join(f"M{_at(x)} {_at(plane.top)}v{_at(plane.height)}" for x in at)
        at = plane.up(array([value for value, _ in up.major])).tolist()
        way += "".join(f"M{_at(plane.left)} {_at(y)}h{_at(plane.width)}" for y in at)
        self.path(way, "grid", 0.6)

    def _frame(self, panel: Panel, plane: _Plane, across: Ticks, up: Ticks, *, numbered: bool) -> None:
        foot, left = plane.foot, plane.left
        major = [
            *zip(plane.across(array([at for at, _ in across.major])).tolist(), across.major, strict=True)
        ]
        sides = [*zip(plane.up(array([at for at, _ in up.major])).tolist(), up.major, strict=True)]
        way = "".join(f"M{_at(x)} {_at(foot)}v3.5" for x, _ in major)
        way += "".join(f"M{_at(left)} {_at(y)}h-3.5" for y, _ in sides)
        way += "".join(f"M{_at(x)} {_at(foot)}v2" for x in plane.across(array(across.minor)).tolist())
        way += "".join(f"M{_at(left)} {_at(y)}h-2" for y in plane.up(array(up.minor)).tolist())
        self.path(way, "guide", 0.7)
        corner = f"M{_at(left)} {_at(plane.top)}h{_at(plane.width)}v{_at(plane.height)}h{_at(-plane.width)}z"
        self.path(corner, "guide", 0.7)
        for y, (_, words) in sides:
            rows = words.count("\n")
            self.text(left - 7, y + 8.5 * (_BASE - 0.6 * rows), words, across="end")
        self.text(
            left - _POINTS * (LEFT - 0.16), plane.top + plane.height / 2, panel.y.label, size=9, turned=-90
        )
        self._landmarks(panel.x, plane)
        if numbered:
            for x, (_, words) in major:
                self.text(x, foot + 14, words)
            rows = max((words.count("\n") for _, words in across.major), default=0)
            self.text(left + plane.width / 2, foot + _POINTS * BOTTOM - 5 + 10 * rows, panel.x.label, size=9)

    def _landmarks(self, axis: Axis, plane: _Plane) -> None:
        for at, name in axis.landmarks:
            x = float(plane.across(array([at]))[0])
            self.text(x, plane.top - 3.5, name, "guide", 7.5)
            self.path(f"M{_at(x)} {_at(plane.top)}v{_at(0.015 * plane.height)}", "guide", 0.8)

    # -- contents -----------------------------------------------------------------------------------------------

    def _curve(self, curve: Curve, plane: _Plane) -> None:
        x, y = plane.across(curve.x), plane.up(curve.y)
        if curve.lower is not None and curve.upper is not None:
            ends = plane.up(curve.lower), plane.up(curve.upper)
            if curve.bars:
                self.path(_strokes(x, *ends), curve.colour)
            else:
                self.path(_area(x, *ends), curve.colour, fill=True, opacity=0.16)
        if curve.style != "none":
            self.path(_line(x, y), curve.colour, _WIDTHS.get(curve.style, 1.3), curve.style)
        if curve.marker is not None:
            self._markers(curve, x, y)

    def _markers(self, curve: Curve, x: Array, y: Array) -> None:
        alone = curve.style == "none"  # then each point counts
        half = 1.6 if self.crowded or (alone and curve.x.size > 60) else 2.0
        hollow = np.zeros(x.size, bool) if curve.hollow is None else curve.hollow
        some = np.arange(x.size) % (1 if alone else thinned(curve.x.size)) == 0
        self._marks(curve.marker or "circle", x[some & ~hollow], y[some & ~hollow], half, curve.colour)
        self._marks(curve.marker or "circle", x[hollow], y[hollow], half, curve.colour, hollow=True)

    def _marks(
        self, marker: str, x: Array, y: Array, half: float, colour: str, *, hollow: bool = False
    ) -> None:
        shape = _mark(marker, half)
        good = np.isfinite(x) & np.isfinite(y)
        way = "".join(
            f"M{_at(a + shape[0])} {_at(b + shape[1])}{shape[2]}" for a, b in _pairs(x[good], y[good])
        )
        line = f' stroke="{LIGHT[colour]}" stroke-width="0.8"'
        if marker == "cross":
            self.path(way, colour, 1.2)
        else:
            self.path(way, "paper" if hollow else colour, fill=True, more=line)

    def _envelope(self, envelope: Envelope, plane: _Plane) -> None:
        way = _area(plane.across(envelope.x), plane.up(envelope.low), plane.up(envelope.high))
        line = f' stroke="{LIGHT[envelope.colour]}" stroke-width="0.3"'
        self.path(way, envelope.colour, fill=True, opacity=0.55, more=line)

    def _span(self, span: ShadedSpan, plane: _Plane) -> None:
        look = SPAN_LOOKS[span.kind]
        start, stop = np.clip(
            plane.across(array([span.start, span.stop])), plane.left - 9, plane.right + 9
        ).tolist()
        high = look.top * plane.height
        if look.hatched:
            self.path(_hatching(start, stop, plane), look.colour, 0.8, opacity=look.opacity)
            return
        wide = max(stop - start, 1.2)  # the shortest can be seen
        self.rectangle(start, plane.foot - high, wide, high, look.colour, look.opacity)

    def _rug(self, rug: Rug, plane: _Plane) -> None:
        at = plane.across(rug.x).tolist()
        self.path(
            "".join(f"M{_at(x)} {_at(plane.foot)}v{_at(-0.06 * plane.height)}" for x in at), rug.colour, 0.6
        )

    def _rule(self, label: Label, plane: _Plane) -> None:
        """The line of a label that is one."""
        x, y = plane.point(label.x, label.y)
        if label.place == "line":
            self.path(f"M{_at(x)} {_at(plane.top)}V{_at(plane.foot)}", label.colour, 0.8, "dashed")
        elif label.place == "level":
            self.path(f"M{_at(plane.left)} {_at(y)}H{_at(plane.right)}", label.colour, 0.9, "dashed")

    def _guide_name(self, guide: Guide, plane: _Plane) -> None:
        x, y = plane.point(guide.name_x, guide.name_y)
        turned = -math.degrees(math.atan(guide.slope))
        self.text(x, y + 7 * _BASE, guide.name, "guide", 7, turned=turned, halo=True)

    def _limit(self, limit: Limit, plane: _Plane) -> None:
        x, y = plane.point(*limit.at)
        self.path(f"M{_at(x)} {_at(y)}v13", "limit", 1.2)
        self.path(f"M{_at(x)} {_at(y + 17)}l-2.4 -5h4.8z", "limit", fill=True)
        self._words((x, y), limit.text, "limit", limit.side, lower=9)

    def _label(self, label: Label, plane: _Plane) -> None:
        x, y = plane.point(label.x, label.y)
        if label.place == "line":
            self.text(
                x - 4, plane.top + 0.98 * plane.height, label.text, label.colour, 7.5, "start", turned=-90
            )
        elif label.place == "level":
            below = 8 if "below" in label.side else -2
            self.text(plane.right - 4, y + below, label.text, label.colour, 7.5, "end", halo=True)
        else:
            self._marks("circle", array([x]), array([y]), 2.1, label.colour, hollow=True)
            self._words((x, y), label.text, label.colour, label.side)

    def _words(self, point: tuple[float, float], text: str, colour: str, side: str, lower: float = 0) -> None:
        dx, dy = (sum(_OFFSETS[word][i] for word in side.split()) for i in (0, 1))
        size = 7.0 if self.crowded else 8.0
        foot = 0.0 if dy > 0 else 0.8 * size if dy < 0 else size * _BASE
        y = point[1] - dy + (lower if dy < 0 else 0) + foot
        across = "start" if dx > 0 else "end" if dx < 0 else "middle"
        self.text(point[0] + dx, y, text, colour, size, across, halo=True)

    # -- drawings -----------------------------------------------------------------------------------------------

    def _drawing(self, drawing: Drawing, left: float, top: float, unit: float) -> None:
        def place(x: float, y: float) -> tuple[float, float]:
            return left + unit * x, top + unit * (drawing.height - y)

        for part in drawing.parts:
            if isinstance(part, Words):
                self._written(part, *place(part.x, part.y))
            else:
                self._shape(part, [place(*point) for point in part.points])

    def _shape(self, shape: DrawnShape, points: Sequence[tuple[float, float]]) -> None:
        way = "M" + "L".join(f"{_at(x)} {_at(y)}" for x, y in points) + ("z" if shape.closed else "")
        if shape.fill:
            self.path(way, shape.fill, fill=True, opacity=shape.opacity)
        if shape.colour:
            more = "" if shape.dashed else ' stroke-linecap="round"'
            self.path(way, shape.colour, shape.width, "dashed" if shape.dashed else "solid", more=more)

    def _written(self, words: Words, x: float, y: float) -> None:
        size, rows = 8.5 * words.size, words.text.count("\n")
        lift = {"bottom": -1.25 * rows, "middle": _BASE - 0.625 * rows, "top": 0.8}[words.up]
        across = {"left": "start", "center": "middle", "right": "end"}[words.across]
        self.text(x, y + lift * size, words.text, words.colour, size, across, bold=words.bold)

    # -- legends ------------------------------------------------------------------------------------------------

    def _entry(self, entry: LegendEntry, x: float, y: float) -> None:
        """A sample whose middle is at y, and its words."""
        if entry.kind == "rug":
            self.path(f"M{_at(x + 10)} {_at(y - 3)}v6", entry.colour)
        elif entry.kind == "hatched":
            self.path("".join(f"M{_at(x + d)} {_at(y + 3)}l6 -6" for d in (0, 5, 10)), entry.colour, 0.8)
        elif entry.kind == "area":
            self.rectangle(x, y - 3, _SAMPLE, 6, entry.colour, entry.opacity)
        elif entry.style != "none":
            self.path(
                f"M{_at(x)} {_at(y)}h{_at(_SAMPLE)}", entry.colour, _WIDTHS.get(entry.style, 1.3), entry.style
            )
        if entry.marker:
            self._marks(entry.marker, array([x + 10]), array([y]), 2.0, entry.colour, hollow=entry.hollow)
        self.text(x + _SAMPLE + 5, y + 8 * _BASE, entry.words, size=8, across="start")

    def _key_above(self, entries: Sequence[LegendEntry], x: float, y: float, columns: int, rows: int) -> None:
        """Column by column."""
        for column in range(columns):
            part = entries[column * rows : (column + 1) * rows]
            for row, entry in enumerate(part):
                self._entry(entry, x, y + _POINTS * KEY * row - 4)
            x += max((_wide(entry.words) for entry in part), default=0.0) + _SAMPLE + 16

    def _key_inside(self, panel: Panel, plane: _Plane) -> None:
        """Where it covers least."""
        entries = panel.legend
        width = max(_wide(entry.words) for entry in entries) + _SAMPLE + 13
        height = 11.5 * len(entries) + 5
        x, y = _emptiest(_points_of(panel, plane), plane, width, height)
        self.rectangle(x, y, width, height, "paper", 0.9)
        for i, entry in enumerate(entries):
            self._entry(entry, x + 4, y + 8.5 + 11.5 * i)

    def foot(self, sheet: Sheet, width: float) -> None:
        """One legend for all panels, below them."""
        titles = {panel.title for panel in sheet.panels}
        entries = {e.words: e for panel in sheet.panels for e in panel.legend if e.words not in titles}
        each = max((_wide(words) for words in entries), default=0.0) + _SAMPLE + 16
        columns = min(4, len(entries))
        for i, entry in enumerate(entries.values()):
            row, column = divmod(i, columns)
            rows = -(-len(entries) // columns)
            y = self._height - 6 - 11 * (rows - 1 - row)
            self._entry(entry, width / 2 + each * (column - columns / 2), y)


# -- ways ---------------------------------------------------------------------------------------------------------


def _at(value: float) -> str:
    """A number to a hundredth of a point."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _pairs(x: Array, y: Array) -> Iterable[tuple[float, float]]:
    return zip(x.tolist(), y.tolist(), strict=True)


def _line(x: Array, y: Array) -> str:
    """A line through points, interrupted where one is missing."""
    return "".join("M" + "L".join(f"{_at(a)} {_at(b)}" for a, b in _pairs(x[r], y[r])) for r in _runs(x + y))


def _area(x: Array, low: Array, high: Array) -> str:
    """The area between two lines."""
    around = (
        (np.concatenate([x[r], x[r][::-1]]), np.concatenate([low[r], high[r][::-1]]))
        for r in _runs(x + low + high)
    )
    return "".join("M" + "L".join(f"{_at(a)} {_at(b)}" for a, b in _pairs(*way)) + "z" for way in around)


def _strokes(x: Array, low: Array, high: Array) -> str:
    rows = zip(x.tolist(), low.tolist(), high.tolist(), strict=True)
    return "".join(f"M{_at(a)} {_at(b)}V{_at(c)}" for a, b, c in rows if math.isfinite(a + b + c))


def _runs(values: Array) -> list[slice]:
    """Unbroken runs of finite values."""
    good = np.concatenate(([False], np.isfinite(values), [False])).astype(np.int8)
    return [slice(start, stop) for start, stop in np.flatnonzero(np.diff(good)).reshape(-1, 2).tolist()]


def _hatching(start: float, stop: float, plane: _Plane) -> str:
    """Oblique strokes over the whole height, cut at both ends."""
    way, at = "", start - plane.height
    while at < stop:
        left, right = max(at, start), min(at + plane.height, stop)
        if left < right:
            way += (
                f"M{_at(left)} {_at(plane.foot - (left - at))}L{_at(right)} {_at(plane.foot - (right - at))}"
            )
        at += 9.0
    return way


def _mark(marker: str, half: float) -> tuple[float, float, str]:
    """Where the outline of a marker begins, and its way from there."""
    if marker == "circle":
        arc = f"a{_at(half)} {_at(half)} 0 1 0"
        return -half, 0.0, f"{arc} {_at(2 * half)} 0{arc} {_at(-2 * half)} 0"
    (x, y), *steps = _OUTLINES[marker]
    crossed = marker == "cross"  # two strokes
    pens = "lml" if crossed else "llll"
    way = "".join(
        f"{pen}{_at(half * dx)} {_at(half * dy)}" for pen, (dx, dy) in zip(pens, steps, strict=False)
    )
    return half * x, half * y, way + ("" if crossed else "z")


def _wide(words: str) -> float:
    """Width of words in a legend."""
    return 8 * _LETTER * len(words)


def _points_of(panel: Panel, plane: _Plane) -> NDArray[np.float64]:
    """Places that a legend should not cover, shape (n, 2)."""
    parts = [(c.x, y) for c in panel.curves for y in (c.y, c.lower, c.upper) if y is not None]
    parts += [(e.x, y) for e in panel.envelopes for y in (e.low, e.high)]
    parts += [(array([label.x]), array([label.y])) for label in panel.labels if label.place == "point"]
    parts += [(array([limit.at[0]]), array([limit.at[1]])) for limit in panel.limits]
    places = [np.column_stack([_dense(plane.across(x)), _dense(plane.up(y))]) for x, y in parts]
    return np.concatenate([np.zeros((0, 2)), *places])


def _dense(values: Array) -> Array:
    """A few points along each piece of a line: lines of two points are covered as well."""
    n = values.size
    return np.interp(np.linspace(0, n - 1, max(n, 60)), np.arange(n), values) if 1 < n < 60 else values


def _emptiest(points: NDArray[np.float64], plane: _Plane, width: float, height: float) -> tuple[float, float]:
    """The corner or side whose box covers the fewest points."""
    across = (plane.right - width - 5, plane.left + 5, plane.left + (plane.width - width) / 2)
    up = (plane.top + 5, plane.foot - height - 5, plane.top + (plane.height - height) / 2)
    places = [(x, y) for y in up for x in across]

    def covered(place: tuple[float, float]) -> int:
        x, y = points[:, 0] - place[0], points[:, 1] - place[1]
        return int(np.count_nonzero((x > -4) & (x < width + 4) & (y > -4) & (y < height + 4)))

    return min(places, key=covered)
