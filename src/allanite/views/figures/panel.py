# SPDX-License-Identifier: BSD-3-Clause
"""What a figure shows, stated without a plotting library: on paper, as a still picture and on screen.

All coordinates are in the units of the axis labels. Colours are names; `LIGHT` and `DARK` give their values.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.views.figures.drawing import Drawing

__all__ = [
    "DARK",
    "LIGHT",
    "MARKERS",
    "SERIES",
    "SPAN_LOOKS",
    "Axis",
    "Curve",
    "Envelope",
    "Guide",
    "Label",
    "LegendEntry",
    "Limit",
    "Panel",
    "Rug",
    "ShadedSpan",
    "Sheet",
    "SpanLook",
    "around",
    "array",
    "decades",
    "legend_entry",
    "level",
    "positive_range",
    "thinned",
]

Array = NDArray[np.float64]
_KEY_MARK = 8  # characters that the line or marker before the words of a legend takes
Style = Literal["solid", "dashed", "dotted", "dashdot", "thin", "none"]

#: Colours and markers of the channels of one panel. The first three are X, Y, Z: red, green and blue of Okabe and
#: Ito's palette, which colour-blind eyes tell apart; the markers tell them apart in a black and white print.
SERIES = ("x", "y", "z", "purple", "orange", "sky")
MARKERS = ("circle", "square", "triangle", "diamond", "down", "cross")
LIGHT = {
    "x": "#c8442c",
    "y": "#00855f",
    "z": "#0868ac",
    "purple": "#a3578a",
    "orange": "#b97a00",
    "sky": "#3f93c4",
    "ink": "#1b1f24",
    "model": "#1b1f24",
    "other": "#8a4fa0",
    "guide": "#7d858f",
    "limit": "#8a6d1f",
    "gap": "#9aa3ad",
    "finding": "#d08b00",
    "grid": "#dfe3e8",
    "paper": "#ffffff",
}
DARK = {
    "x": "#f0806a",
    "y": "#3cc79b",
    "z": "#64b0ea",
    "purple": "#d291bf",
    "orange": "#e8b04a",
    "sky": "#8cc8ea",
    "ink": "#e6e9ed",
    "model": "#f2f4f6",
    "other": "#c79adb",
    "guide": "#929ba6",
    "limit": "#d8b968",
    "gap": "#616a75",
    "finding": "#e0a93a",
    "grid": "#2c333b",
    "paper": "#14181d",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """One axis.

    Attributes
    ----------
    label : str
        With the unit in brackets.
    log : bool
    limits : (float, float) or None
        None: as the data need.
    landmarks : tuple of (float, str)
        Named places at the opposite edge: 3600 s is "1 h".
    names : tuple of (float, str)
        Words in place of the numbers at the ticks; none: numbers.
    """

    label: str
    log: bool = False
    limits: tuple[float, float] | None = None
    landmarks: tuple[tuple[float, str], ...] = ()
    names: tuple[tuple[float, str], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """A line through points, with its band; points alone where the style is "none".

    Attributes
    ----------
    x, y : ndarray, shape (n,)
    lower, upper : ndarray, shape (n,), or None
        The band.
    bars : bool
        The band is drawn as a bar at each point.
    hollow : ndarray of bool, shape (n,), or None
        Points drawn hollow: not used in the fit.
    marker : str or None
    axis : str
        The channel that it belongs to, in a panel of several: a page can show and hide what belongs to one.
    """

    x: Array
    y: Array
    label: str
    colour: str
    axis: str = ""
    style: Style = "solid"
    marker: str | None = None
    lower: Array | None = None
    upper: Array | None = None
    bars: bool = False
    hollow: NDArray[np.bool_] | None = None
    hollow_label: str = "not in the fit"
    band_label: str = ""


def level(ends: tuple[float, float], y: float, label: str, colour: str = "guide") -> Curve:
    """A horizontal line that the legend names: words at its end would stand on the data."""
    return Curve(x=array(ends), y=np.full(2, y), label=label, colour=colour, style="dashed")


def legend_entry(label: str, colour: str = "model", style: Style = "dashed") -> Curve:
    """What the legend says of lines that belong to several axes: it stays when one of them is hidden."""
    return Curve(x=array([math.nan]), y=array([math.nan]), label=label, colour=colour, style=style)


@dataclass(frozen=True, slots=True, kw_only=True)
class Envelope:
    """Lowest and highest value of each block of a long record."""

    x: Array
    low: Array
    high: Array
    label: str
    colour: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Guide:
    """A straight line of known slope on two logarithmic axes, named along the line at `name_x`."""

    x: tuple[float, float]
    y: tuple[float, float]
    name: str
    name_x: float
    slope: float

    @property
    def name_y(self) -> float:
        """Height of the line at `name_x`."""
        return float(self.y[0] * (self.name_x / self.x[0]) ** self.slope)


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """A point with its words; `side` is where the words stand: "above right", "below", ... of the point.

    `place` is "point" for a reading point, "line" for a vertical line at x, "level" for a horizontal line at y.
    """

    x: float
    y: float
    text: str
    colour: str
    side: str = "above right"
    place: Literal["point", "line", "level"] = "point"


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """An upper limit: a dotted line with an arrow down at (x[at], y[at])."""

    x: Array
    y: Array
    at: tuple[float, float]
    text: str
    side: str = "below right"


SpanKind = Literal["gap", "finding", "quiet", "turn", "dead", "disturbed", "unknown"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ShadedSpan:
    """A stretch of the horizontal axis; `SPAN_LOOKS` says how its kind is drawn."""

    start: float
    stop: float
    kind: SpanKind
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SpanLook:
    """Colour, opacity, height as a part of the panel, hatching, and words for the legend ("" for none)."""

    colour: str
    opacity: float
    top: float = 1.0
    hatched: bool = False
    words: str = ""


#: A finding is a bar at the foot, all others go over the whole height.
SPAN_LOOKS: Mapping[SpanKind, SpanLook] = MappingProxyType(
    {
        "gap": SpanLook(colour="gap", opacity=0.35),
        "finding": SpanLook(colour="finding", opacity=0.9, top=0.05),
        "quiet": SpanLook(colour="y", opacity=0.16, words="at rest, used"),
        "turn": SpanLook(colour="purple", opacity=0.3, words="turn"),
        "dead": SpanLook(colour="gap", opacity=0.3, words="dead time, not used"),
        "disturbed": SpanLook(colour="finding", opacity=0.4, words="disturbed, not used"),
        "unknown": SpanLook(colour="guide", opacity=0.8, hatched=True, words="direction not known"),
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rug:
    """Places on the horizontal axis, each a short stroke at the foot: for more of them than spans could show."""

    x: Array
    label: str
    colour: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LegendEntry:
    """A name in the legend and what it stands for.

    Attributes
    ----------
    kind : "line", "area", "hatched" or "rug"
    hollow : bool
        The marker is not filled.
    axis : str
        The channel of the curve, as in `Curve`.
    """

    words: str
    colour: str
    kind: Literal["line", "area", "hatched", "rug"]
    style: Style = "none"
    marker: str | None = None
    hollow: bool = False
    opacity: float = 1.0
    axis: str = ""


_LAST = ("95 % interval", "not in the fit")


def _rank(words: str) -> int:
    return _LAST.index(words) if words in _LAST else -1


def _entries_of(curve: Curve) -> list[LegendEntry]:
    """The curve, its band, its hollow points."""
    line = LegendEntry(
        words=curve.label,
        colour=curve.colour,
        kind="line",
        style=curve.style,
        marker=curve.marker,
        axis=curve.axis,
    )
    entries = [line]
    if curve.lower is not None and not curve.bars:
        entries.append(LegendEntry(words=curve.band_label, kind="area", opacity=0.18, colour=curve.colour))
    if curve.hollow is not None and curve.hollow.any():
        entries.append(replace(line, words=curve.hollow_label, style="none", hollow=True, axis=""))
    return entries


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """One pair of axes and everything in it.

    Attributes
    ----------
    square : bool
        One decade is as long upwards as to the right (needs limits and two logarithmic axes).
    height : float or None
        Height over width of the axes; None: as the kind of axes suggests.
    key : "inside" or "above"
        Where the legend stands: where it covers least, or in a row of its own above the panel.
    drawing : Drawing or None
        Fills the panel in place of axes and all that belongs to them.
    """

    title: str
    x: Axis = Axis(label="")
    y: Axis = Axis(label="")
    curves: tuple[Curve, ...] = ()
    envelopes: tuple[Envelope, ...] = ()
    guides: tuple[Guide, ...] = ()
    labels: tuple[Label, ...] = ()
    limits: tuple[Limit, ...] = ()
    spans: tuple[ShadedSpan, ...] = ()
    rugs: tuple[Rug, ...] = ()
    square: bool = False
    height: float | None = None
    key: Literal["inside", "above"] = "inside"
    drawing: Drawing | None = None

    @property
    def aspect(self) -> float:
        """Height over width of the axes."""
        if self.drawing is not None:
            return self.drawing.height / self.drawing.width
        if self.square and self.x.limits and self.y.limits:
            return decades(self.y.limits) / decades(self.x.limits)
        return self.height or (0.52 if self.x.log else 0.22)

    @property
    def explained(self) -> tuple[SpanLook, ...]:
        """Kinds of span that need an entry in the legend, in the order of the table."""
        present = {span.kind for span in self.spans}
        return tuple(look for kind, look in SPAN_LOOKS.items() if kind in present and look.words)

    @property
    def entries(self) -> tuple[str, ...]:
        """What the legend says."""
        return tuple(entry.words for entry in self.legend)

    @property
    def legend(self) -> tuple[LegendEntry, ...]:
        """Entries of the legend, each name once; last those that hold for several curves."""
        looks = [
            LegendEntry(
                words=k.words, colour=k.colour, kind="hatched" if k.hatched else "area", opacity=k.opacity
            )
            for k in self.explained
        ]
        rugs = [LegendEntry(words=rug.label, colour=rug.colour, kind="rug") for rug in self.rugs]
        # Inside a panel, the envelope of a record is its only content.
        areas = [
            LegendEntry(words=e.label, colour=e.colour, kind="area", opacity=0.55)
            for e in self.envelopes
            if self.key == "above"
        ]
        curves = [entry for curve in self.curves for entry in _entries_of(curve)]
        unique: dict[str, LegendEntry] = {}
        for entry in (*looks, *rugs, *areas, *curves):
            if entry.words:
                unique.setdefault(entry.words, entry)
        return tuple(sorted(unique.values(), key=lambda entry: _rank(entry.words)))

    def key_grid(self, room: int) -> tuple[int, int]:
        """Columns and rows of the legend above the panel, where so many characters have room beside one another."""
        widths = [len(name) + _KEY_MARK for name in self.entries]
        for columns in range(len(widths), 1, -1):
            rows = -(-len(widths) // columns)
            if sum(max(widths[i : i + rows]) for i in range(0, len(widths), rows)) <= room:
                return -(-len(widths) // rows), rows
        return 1, len(widths)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """Panels in rows."""

    rows: tuple[tuple[Panel, ...], ...]

    @property
    def panels(self) -> tuple[Panel, ...]:
        """All panels, row by row."""
        return tuple(panel for row in self.rows for panel in row)

    @property
    def columns(self) -> int:
        """Panels in the longest row."""
        return max(len(row) for row in self.rows)

    def labelled(self, number: int) -> bool:
        """Whether a row says what its horizontal axis is: not where the row below says the same of the same axis."""
        if number + 1 >= len(self.rows) or self.columns > 1:
            return True
        above, below = self.rows[number][0], self.rows[number + 1][0]
        return above.x.log or above.drawing is not None or above.x != below.x


def array(values: ArrayLike | Sequence[float | None]) -> Array:
    """Values as float64; null is NaN."""
    return np.asarray(values, dtype=np.float64)


def decades(limits: tuple[float, float]) -> float:
    """Decades between two limits."""
    return math.log10(limits[1]) - math.log10(limits[0])


def around(*parts: ArrayLike, room: float = 0.08) -> tuple[float, float]:
    """Limits a little outside all finite values; (-1, 1) where there are none."""
    values = np.concatenate([np.ravel(array(part)) for part in parts])
    good = values[np.isfinite(values)]
    if not good.size:
        return -1.0, 1.0
    low, high = float(good.min()), float(good.max())
    margin = room * (high - low) or abs(low) or 1.0
    return low - margin, high + margin


def positive_range(*parts: ArrayLike) -> tuple[float, float]:
    """Smallest and largest of all finite positive values; (1, 10) where there are none."""
    joined = np.concatenate([np.ravel(array(p)) for p in parts]) if parts else np.zeros(0)
    good = joined[np.isfinite(joined) & (joined > 0)]
    return (float(good.min()), float(good.max())) if good.size else (1.0, 10.0)


def thinned(n: int, most: int = 60) -> int:
    """Every how many points carry a marker, so that markers stay apart."""
    return max(1, math.ceil(n / most))
