# SPDX-License-Identifier: BSD-3-Clause
"""What a figure shows, said without a plotting library: the two renderers draw the same panels.

All coordinates are in the units of the axis labels. Colours are names; `LIGHT` and `DARK` give their values.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "DARK",
    "LIGHT",
    "MARKERS",
    "SERIES",
    "Axis",
    "Curve",
    "Envelope",
    "Guide",
    "Label",
    "Limit",
    "Panel",
    "Sheet",
    "Span",
    "array",
    "decades",
    "positive_range",
    "thinned",
]

Array = NDArray[np.float64]
Style = Literal["solid", "dashed", "dotted", "dashdot", "thin"]

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
    """

    label: str
    log: bool = False
    limits: tuple[float, float] | None = None
    landmarks: tuple[tuple[float, str], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """A line through points, with its band.

    Attributes
    ----------
    x, y : ndarray, shape (n,)
    lower, upper : ndarray, shape (n,), or None
        The band.
    hollow : ndarray of bool, shape (n,), or None
        Points drawn hollow: not used in the fit.
    marker : str or None
    """

    x: Array
    y: Array
    label: str
    colour: str
    style: Style = "solid"
    marker: str | None = None
    lower: Array | None = None
    upper: Array | None = None
    hollow: NDArray[np.bool_] | None = None
    band_label: str = ""


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

    `place` is "point" for a reading point, "line" for a vertical line at x.
    """

    x: float
    y: float
    text: str
    colour: str
    side: str = "above right"
    place: Literal["point", "line"] = "point"


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """An upper limit: a dotted line with an arrow down at (x[at], y[at])."""

    x: Array
    y: Array
    at: tuple[float, float]
    text: str
    side: str = "below right"


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """A stretch of the horizontal axis: "gap" (shaded over the whole height) or "finding" (a bar at the bottom)."""

    start: float
    stop: float
    kind: Literal["gap", "finding"]
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """One pair of axes and everything in it.

    Attributes
    ----------
    square : bool
        One decade is as long upwards as to the right (needs limits and two logarithmic axes).
    """

    title: str
    x: Axis
    y: Axis
    curves: tuple[Curve, ...] = ()
    envelopes: tuple[Envelope, ...] = ()
    guides: tuple[Guide, ...] = ()
    labels: tuple[Label, ...] = ()
    limits: tuple[Limit, ...] = ()
    spans: tuple[Span, ...] = ()
    square: bool = False

    @property
    def aspect(self) -> float:
        """Height over width of the axes."""
        if self.square and self.x.limits and self.y.limits:
            return decades(self.y.limits) / decades(self.x.limits)
        return 0.52 if self.x.log else 0.22


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


def array(values: ArrayLike | Sequence[float | None]) -> Array:
    """Values as float64; null is NaN."""
    return np.asarray(values, dtype=np.float64)


def decades(limits: tuple[float, float]) -> float:
    """Decades between two limits."""
    return math.log10(limits[1]) - math.log10(limits[0])


def positive_range(*parts: ArrayLike) -> tuple[float, float]:
    """Smallest and largest of all finite positive values; (1, 10) where there are none."""
    joined = np.concatenate([np.ravel(array(p)) for p in parts]) if parts else np.zeros(0)
    good = joined[np.isfinite(joined) & (joined > 0)]
    return (float(good.min()), float(good.max())) if good.size else (1.0, 10.0)


def thinned(n: int, most: int = 60) -> int:
    """Every how many points carry a marker, so that markers stay apart."""
    return max(1, math.ceil(n / most))
