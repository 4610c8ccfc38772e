# SPDX-License-Identifier: BSD-3-Clause
"""Panels on paper, white or dark: Matplotlib figures for PDF, SVG and PNG. Decides nothing but where ink goes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.markers import TICKDOWN, TICKLEFT
from matplotlib.patches import Polygon
from matplotlib.ticker import Locator, NullLocator
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural
from allanite.views.figures.drawing import Drawing, DrawnShape, Words
from allanite.views.figures.frames import CHARACTERS, KEY, LEFT, Box, layout
from allanite.views.figures.panel import (
    DARK,
    LIGHT,
    SPAN_LOOKS,
    Axis,
    Curve,
    Envelope,
    Guide,
    Label,
    Limit,
    Panel,
    Rug,
    ShadedSpan,
    Sheet,
    thinned,
)
from allanite.views.figures.ticks import APART, Ticks, ticks_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["figure", "figure_with"]

_STYLES = {
    "solid": "-",
    "dashed": (0, (5, 2.2)),
    "dotted": (0, (1, 2)),
    "dashdot": (0, (6, 2, 1.2, 2)),
    "thin": "-",
    "none": "none",
}
_WIDTHS = {"solid": 1.1, "thin": 0.8}
_MARKERS = {"circle": "o", "square": "s", "triangle": "^", "diamond": "D", "down": "v", "cross": "X"}
_OFFSETS = {"above": (0, 7), "below": (0, -7), "right": (7, 0), "left": (-7, 0)}
_RC: dict[Any, Any] = {
    "font.family": ["sans-serif"],
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "sans-serif"],
    "font.size": 8.5,
    "axes.labelsize": 9,
    "axes.titlesize": 9.5,
    "axes.titley": 1.0,  # nothing is above the axes that Matplotlib would have to look for
    "legend.fontsize": 8,
    "svg.fonttype": "none",  # words stay words: smaller, and they can be searched
    "svg.hashsalt": "allanite",  # the same study gives the same file
    "pdf.fonttype": 42,
    "axes.unicode_minus": True,
}


@dataclass(frozen=True, slots=True)
class _PanelLook:
    """What holds for all of a panel: its colours, whether there is room for words."""

    colours: Mapping[str, str]
    crowded: bool = False

    def __getitem__(self, colour: str) -> str:
        return self.colours[colour]


def figure(sheet: Sheet, *, dark: bool = False) -> Figure:
    """A Matplotlib figure of a sheet; it belongs to no window and no global state."""
    with mpl.rc_context(_RC):
        size, boxes = layout(sheet)
        crowded = sheet.columns > 1
        look = _PanelLook(DARK if dark else LIGHT, crowded)
        made = Figure(figsize=size, facecolor=look["paper"])
        common: dict[str, Any] = {}
        labelled = [sheet.labelled(i) for i, row in enumerate(sheet.rows) for _ in row]
        for panel, box, numbered in zip(sheet.panels, boxes, labelled, strict=True):
            left, bottom, width, height = box
            axes = made.add_axes((left / size[0], bottom / size[1], width / size[0], height / size[1]))
            axes.set_facecolor(look["paper"])
            _draw(axes, panel, box, look, titled=len(sheet.panels) > 1)
            axes.yaxis.set_label_coords(-(LEFT - 0.16) / width, 0.5)
            if not numbered:
                axes.set_xlabel("")
            if panel.drawing is None:
                _axes_of(axes, look, numbered=numbered)
            common |= _entries(axes, panel)
            common.pop(_plain(panel.title), None)
        if crowded:  # small panels have no room for a legend each: one below says it for all
            _legend(made, common, look, loc="lower center", ncols=4)
    return made


def figure_with(axes: Axes | Sequence[Axes] | NDArray[Any], sheet: Sheet, *, dark: bool = False) -> Figure:
    """The figure of the caller's axes, with the panels of a sheet drawn into them, one into each.

    Raises
    ------
    InputError
        As many axes are needed as there are panels.
    """
    given: list[Axes] = list(np.ravel(np.asarray(axes, dtype=object)))
    panels = list(sheet.panels)
    if len(given) != len(panels):
        raise InputError(
            f"the figure has {plural(len(panels), 'panel')}: give ax= as many axes, not {len(given)}, or choose a part "
            "of it with view= or channels="
        )
    look = _PanelLook(DARK if dark else LIGHT)
    whole: Any = given[0].get_figure(root=True)
    width, height = whole.get_size_inches()
    with mpl.rc_context(_RC):
        for one, panel in zip(given, panels, strict=True):
            left, bottom, wide, high = one.get_position().bounds
            one.set_facecolor(look["paper"])
            _draw(one, panel, (left * width, bottom * height, wide * width, high * height), look, titled=True)
            if panel.drawing is None:
                _axes_of(one, look, numbered=True)
    figure_of_axes: Figure = whole
    return figure_of_axes


def _draw(axes: Axes, panel: Panel, box: Box, look: _PanelLook, *, titled: bool) -> None:
    columns, rows = panel.key_grid(round(box[2] * CHARACTERS)) if panel.key == "above" else (1, 0)
    landmarks = 12 if panel.x.landmarks else 0  # points
    if titled:
        pad = landmarks + (5 if rows or not landmarks else 0) + 72 * KEY * rows
        axes.set_title(_plain(panel.title), loc="left", fontweight="bold", color=look["ink"], pad=pad)
    if panel.drawing is not None:
        _drawing(axes, panel.drawing, look)
        return
    _frame(axes, panel, look)
    for span in panel.spans:
        _span(axes, span, look)
    for rug in panel.rugs:
        _rug(axes, rug, look)
    for guide in panel.guides:
        _guide(axes, guide, look)
    for limit in panel.limits:
        _limit(axes, limit, look)
    for envelope in panel.envelopes:
        _envelope(axes, envelope, look, named=panel.key == "above")
    for curve in panel.curves:
        _curve(axes, curve, look)
    for label in panel.labels:
        _label(axes, label, look)
    _rulers(axes, panel, box, look)
    if panel.key == "above":
        place: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderpad": 0.1}
        place |= {"borderaxespad": 0.15 + landmarks / 8, "columnspacing": 1.4, "labelspacing": 0.3}
        _legend(axes, _entries(axes, panel), look, ncols=columns, least=1, **place)
    elif panel.curves and not look.crowded:
        _legend(axes, _entries(axes, panel), look, loc="best", borderaxespad=0.5)


def _frame(axes: Axes, panel: Panel, look: _PanelLook) -> None:
    for direction, axis in (("x", panel.x), ("y", panel.y)):
        if axis.log:
            getattr(axes, f"set_{direction}scale")("log")
        if axis.limits:
            getattr(axes, f"set_{direction}lim")(*axis.limits)
        getattr(axes, f"set_{direction}label")(_plain(axis.label), color=look["ink"])
    if panel.square:
        axes.set_aspect("equal")
    for side in axes.spines.values():
        side.set(color=look["guide"], linewidth=0.7)
    _landmarks(axes, panel.x, look)


def _axes_of(axes: Axes, look: _PanelLook, *, numbered: bool) -> None:
    """Grid, ticks and their labels."""
    axes.set_axisbelow(True)
    axes.grid(visible=True, color=look["grid"], linewidth=0.6)
    axes.tick_params(which="both", direction="out", color=look["guide"], labelcolor=look["ink"])
    axes.tick_params(labelbottom=numbered)


class _Ruler(Locator):
    """Ticks as in the still pictures, for the part of an axis that is shown."""

    def __init__(
        self, axis: Axis, ends: Callable[[], tuple[float, float]], room: float, apart: float
    ) -> None:
        self._facts = axis, ends, room, apart
        self._names: dict[float, str] = {}

    def ticks(self) -> Ticks:
        axis, ends, room, apart = self._facts
        return ticks_of(axis, ends(), room, apart)

    def __call__(self) -> list[float]:
        self._names = dict(self.ticks().major)
        return [*self._names]

    def name(self, value: float, _position: int | None = None) -> str:
        return _plain(self._names.get(value, ""))


def _rulers(axes: Axes, panel: Panel, box: Box, look: _PanelLook) -> None:
    """Ticks, those between as one line of markers: Matplotlib's own take half the time of a figure."""
    mark: dict[str, Any] = {
        "linestyle": "none",
        "markersize": 2,
        "markeredgewidth": 0.6,
        "color": look["guide"],
    }
    mark |= {"clip_on": False, "scalex": False, "scaley": False, "zorder": 2.01}
    for way, axis, room, apart in zip("xy", (panel.x, panel.y), box[2:], APART, strict=True):
        ruler = _Ruler(axis, getattr(axes, f"get_{way}lim"), 72 * room, apart)
        target = getattr(axes, f"{way}axis")
        target.set_major_locator(ruler)
        target.set_major_formatter(ruler.name)
        target.set_minor_locator(NullLocator())
        place = {"transform": getattr(axes, f"get_{way}axis_transform")()}
        between = np.array(ruler.ticks().minor)
        at = (between, 0 * between) if way == "x" else (0 * between, between)
        axes.plot(*at, marker=TICKDOWN if way == "x" else TICKLEFT, **place, **mark)


def _landmarks(axes: Axes, axis: Axis, look: _PanelLook) -> None:
    for at, name in axis.landmarks:
        axes.annotate(
            name,
            xy=(at, 1.0),
            xycoords=axes.get_xaxis_transform(),
            xytext=(0, 3.5),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=7.5,
            color=look["guide"],
        )
        axes.plot(
            [at, at], [0.985, 1.0], transform=axes.get_xaxis_transform(), color=look["guide"], linewidth=0.8
        )


def _curve(axes: Axes, curve: Curve, look: _PanelLook) -> None:
    colour = look[curve.colour]
    data = curve.marker is not None
    (line,) = axes.plot(
        curve.x,
        curve.y,
        color=colour,
        linestyle=_STYLES[curve.style],
        linewidth=_WIDTHS.get(curve.style, 1.3),
        label=_plain(curve.label) or "_nolegend_",
        zorder=3 if data else 3.5,
    )
    if curve.marker is not None:
        alone = curve.style == "none"  # then each point counts
        size = 3.2 if look.crowded or (alone and curve.x.size > 60) else 4.0
        line.set(
            marker=_MARKERS[curve.marker],
            markersize=size,
            markevery=1 if alone else thinned(curve.x.size),
            markeredgewidth=0.8,
        )
        _hollow(axes, curve, colour, size, look)
    if curve.lower is not None and curve.upper is not None:
        if curve.bars:
            axes.vlines(curve.x, curve.lower, curve.upper, color=colour, linewidth=1.0, zorder=2.9)
            return
        band: dict[str, Any] = {"color": colour, "alpha": 0.16, "linewidth": 0}
        axes.fill_between(curve.x, curve.lower, curve.upper, label=curve.band_label or "_nolegend_", **band)


def _hollow(axes: Axes, curve: Curve, colour: str, size: float, look: _PanelLook) -> None:
    if curve.hollow is None or not curve.hollow.any() or curve.marker is None:
        return
    axes.plot(
        curve.x[curve.hollow],
        curve.y[curve.hollow],
        linestyle="none",
        marker=_MARKERS[curve.marker],
        markersize=size,
        markerfacecolor=look["paper"],
        markeredgecolor=colour,
        markeredgewidth=0.9,
        zorder=3.2,
        label=curve.hollow_label or "_nolegend_",
    )


def _envelope(axes: Axes, envelope: Envelope, look: _PanelLook, *, named: bool) -> None:
    colour = look[envelope.colour]
    area: dict[str, Any] = {"color": colour, "alpha": 0.55, "linewidth": 0.3}
    name = _plain(envelope.label) if named else "_nolegend_"
    axes.fill_between(envelope.x, envelope.low, envelope.high, label=name, **area)


def _guide(axes: Axes, guide: Guide, look: _PanelLook) -> None:
    axes.plot(guide.x, guide.y, color=look["guide"], linewidth=0.7, zorder=2)
    axes.text(
        guide.name_x,
        guide.name_y,
        guide.name,
        rotation=math.degrees(math.atan(guide.slope)),
        rotation_mode="anchor",
        ha="center",
        va="center",
        fontsize=7,
        color=look["guide"],
        zorder=2.1,
        bbox={"facecolor": look["paper"], "edgecolor": "none", "pad": 0.6},
    )


def _limit(axes: Axes, limit: Limit, look: _PanelLook) -> None:
    colour = look["limit"]
    axes.plot(limit.x, limit.y, color=colour, linestyle=_STYLES["dotted"], linewidth=1.1, zorder=2.2)
    axes.annotate(  # the head is the text's end, so the arrow is drawn backwards: from its foot, with "<|-"
        "",
        xy=limit.at,
        xytext=(0, -17),
        textcoords="offset points",
        arrowprops={"arrowstyle": "<|-", "color": colour, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0},
        zorder=4,
    )
    _words(axes, limit.at, limit.text, colour, limit.side, look, lower=9)


def _label(axes: Axes, label: Label, look: _PanelLook) -> None:
    colour = look[label.colour]
    if label.place == "line":
        axes.axvline(label.x, color=colour, linewidth=0.8, linestyle=_STYLES["dashed"], zorder=1.5)
        axes.annotate(
            _plain(label.text),
            xy=(label.x, 0.02),
            xycoords=axes.get_xaxis_transform(),
            xytext=(-4, 0),
            textcoords="offset points",
            rotation=90,
            ha="right",
            va="bottom",
            fontsize=7.5,
            color=colour,
        )
        return
    if label.place == "level":
        axes.axhline(label.y, color=colour, linewidth=0.9, linestyle=_STYLES["dashed"], zorder=2.6)
        axes.annotate(
            _plain(label.text),
            xy=(1.0, label.y),
            xycoords=axes.get_yaxis_transform(),
            xytext=(-4, -2 if "below" in label.side else 2),
            textcoords="offset points",
            ha="right",
            va="top" if "below" in label.side else "bottom",
            fontsize=7.5,
            color=colour,
            zorder=5,
            bbox={"facecolor": look["paper"], "edgecolor": "none", "alpha": 0.75, "pad": 0.4},
        )
        return
    axes.plot(
        [label.x], [label.y], marker="o", markersize=4.2, color=look["paper"], mec=colour, mew=1.0, zorder=4
    )
    _words(axes, (label.x, label.y), label.text, colour, label.side, look)


def _words(
    axes: Axes,
    point: tuple[float, float],
    text: str,
    colour: str,
    side: str,
    look: _PanelLook,
    lower: float = 0,
) -> None:
    dx, dy = np.sum([_OFFSETS[word] for word in side.split()], axis=0)
    axes.annotate(
        _plain(text),
        xy=point,
        xytext=(dx, dy - lower * (dy < 0)),
        textcoords="offset points",
        ha="left" if dx > 0 else "right" if dx < 0 else "center",
        va="bottom" if dy > 0 else "top" if dy < 0 else "center",
        fontsize=7 if look.crowded else 8,
        color=colour,
        zorder=5,
        bbox={"facecolor": look["paper"], "edgecolor": "none", "alpha": 0.75, "pad": 0.8},
    )


def _span(axes: Axes, span: ShadedSpan, look: _PanelLook) -> None:
    kind = SPAN_LOOKS[span.kind]
    colour = look[kind.colour]
    paint: dict[str, Any] = {
        "color": colour,
        "alpha": kind.opacity,
        "lw": 0.8,
        "zorder": 4 if kind.top < 1 else 1,
    }
    if kind.hatched:
        paint = {"facecolor": "none", "edgecolor": colour, "hatch": "////", "lw": 0.0}
    axes.axvspan(span.start, span.stop, ymax=kind.top, label=kind.words or "_nolegend_", **paint)


def _rug(axes: Axes, rug: Rug, look: _PanelLook) -> None:
    place: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "zorder": 4}
    axes.vlines(rug.x, 0.0, 0.06, color=look[rug.colour], linewidth=0.6, label=_plain(rug.label), **place)


# -- drawings ---------------------------------------------------------------------------------------------


def _drawing(axes: Axes, drawing: Drawing, look: _PanelLook) -> None:
    axes.set_axis_off()
    axes.set_xlim(0, drawing.width)
    axes.set_ylim(0, drawing.height)
    for order, part in enumerate(drawing.parts, start=2):
        if isinstance(part, Words):
            _written(axes, part, look, order)
        else:
            _shape(axes, part, look, order)


def _shape(axes: Axes, shape: DrawnShape, look: _PanelLook, order: int) -> None:
    axes.add_patch(
        Polygon(
            shape.points,
            closed=shape.closed,
            facecolor=to_rgba(look[shape.fill], shape.opacity) if shape.fill else "none",
            edgecolor=look[shape.colour] if shape.colour else "none",
            linewidth=1.0 * shape.width if shape.colour else 0.0,
            linestyle=_STYLES["dashed"] if shape.dashed else "-",
            joinstyle="round",
            capstyle="round" if not shape.dashed else "butt",
            zorder=order,
        )
    )


def _written(axes: Axes, words: Words, look: _PanelLook, order: int) -> None:
    axes.text(
        words.x,
        words.y,
        _plain(words.text),
        color=look[words.colour],
        fontsize=8.5 * words.size,
        fontweight="bold" if words.bold else "normal",
        ha=words.across,
        va={"middle": "center"}.get(words.up, words.up),
        zorder=order,
        linespacing=1.25,
    )


# -- legends ----------------------------------------------------------------------------------------------


def _entries(axes: Axes, panel: Panel) -> dict[str, Any]:
    """What stands for each name of the legend."""
    handles, names = axes.get_legend_handles_labels()
    shown = dict(zip(names, handles, strict=True))
    return {name: shown[name] for name in map(_plain, panel.entries) if name in shown}


def _legend(
    target: Axes | Figure, entries: dict[str, Any], look: _PanelLook, *, least: int = 2, **place: Any
) -> None:
    if len(entries) >= least:
        frame: dict[str, Any] = {
            "facecolor": look["paper"],
            "framealpha": 0.9,
            "edgecolor": "none",
            "labelcolor": look["ink"],
            "handlelength": 2.4,
        }
        target.legend(list(entries.values()), list(entries), **frame, **place)


def _plain(text: str) -> str:
    """Text that Matplotlib must not read as mathematics."""
    return text.replace("$", r"\$")
