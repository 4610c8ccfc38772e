# SPDX-License-Identifier: BSD-3-Clause
"""Panels on paper: Matplotlib figures for PDF, SVG and PNG. Decides nothing but where ink goes."""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.figures.panel import (
    LIGHT,
    Axis,
    Curve,
    Envelope,
    Guide,
    Label,
    Limit,
    Panel,
    Sheet,
    Span,
    decades,
    thinned,
)
from allanite.figures.slim_svg import slim

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["figure", "svg"]

# Sizes in inches. The layout is computed here rather than found by drawing twice: figures take half the time, and
# equal decades are square because the axes are made so.
_WIDTH = 6.9  # the text width of A4 and letter paper
_LEAST = 4.9  # a panel in a row of several
_LEFT, _RIGHT, _BOTTOM = 0.74, 0.14, 0.46
_LANDMARKS, _TITLE, _TIGHT = 0.2, 0.2, 0.1
_FOOT = 0.36  # a legend for all panels

_STYLES = {
    "solid": "-",
    "dashed": (0, (5, 2.2)),
    "dotted": (0, (1, 2)),
    "dashdot": (0, (6, 2, 1.2, 2)),
    "thin": "-",
}
_WIDTHS = {"solid": 1.1, "thin": 0.8}
_MARKERS = {"circle": "o", "square": "s", "triangle": "^", "diamond": "D", "down": "v", "cross": "X"}
_HOLLOW = "not in the fit"
_LAST = ("95 % interval", _HOLLOW)
_OFFSETS = {"above": (0, 7), "below": (0, -7), "right": (7, 0), "left": (-7, 0)}
_RC: dict[Any, Any] = {
    "font.family": ["sans-serif"],
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "sans-serif"],
    "font.size": 8.5,
    "axes.labelsize": 9,
    "axes.titlesize": 9.5,
    "legend.fontsize": 8,
    "svg.fonttype": "none",  # words stay words: smaller, and they can be searched
    "svg.hashsalt": "allanite",  # the same study gives the same file
    "pdf.fonttype": 42,
    "axes.unicode_minus": True,
}


def figure(sheet: Sheet) -> Figure:
    """A Matplotlib figure of a sheet; it belongs to no window and no global state."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(_RC):
        size, boxes = _layout(sheet)
        made = Figure(figsize=size, facecolor=LIGHT["paper"])
        crowded = sheet.columns > 1
        common: dict[str, Any] = {}
        for panel, (left, bottom, width, height) in zip(sheet.panels, boxes, strict=True):
            axes = made.add_axes((left / size[0], bottom / size[1], width / size[0], height / size[1]))
            _draw(axes, panel, crowded=crowded, titled=len(sheet.panels) > 1)
            axes.yaxis.set_label_coords(-(_LEFT - 0.16) / width, 0.5)
            if panel.envelopes and panel not in sheet.rows[-1]:  # under one another: words only at the lowest
                axes.set_xlabel("")
                axes.tick_params(labelbottom=False)
            common |= {name: handle for name, handle in _entries(axes).items() if name != _plain(panel.title)}
        if crowded:  # small panels have no room for a legend each: one below says it for all
            _legend(made, common, loc="lower center", ncols=4)
    return made


def svg(sheet: Sheet) -> str:
    """A sheet as SVG text, without a date, so that equal studies give equal files."""
    import matplotlib as mpl

    made = figure(sheet)
    target = io.StringIO()
    with mpl.rc_context(_RC):
        made.savefig(target, format="svg", metadata={"Date": None, "Creator": "allanite"})
    return slim(target.getvalue())


def _layout(sheet: Sheet) -> tuple[tuple[float, float], list[tuple[float, float, float, float]]]:
    """Size of the figure, and left, bottom, width and height of each panel's axes."""
    width = max(_WIDTH, _LEAST * sheet.columns) if sheet.columns > 1 else _WIDTH
    each = width / sheet.columns - _LEFT - _RIGHT
    titled = len(sheet.panels) > 1
    boxes = []
    y = _FOOT if sheet.columns > 1 else 0.0
    for row in reversed(sheet.rows):
        y += _BOTTOM if row is sheet.rows[-1] or not row[0].envelopes else _TIGHT
        height = max(panel.aspect for panel in row) * each
        boxes.append([(_LEFT + i * width / sheet.columns, y, each, height) for i in range(len(row))])
        y += (
            height + (_TITLE if titled else 0.0) + (_LANDMARKS if any(p.x.landmarks for p in row) else _TIGHT)
        )
    return (width, y), [box for row_boxes in reversed(boxes) for box in row_boxes]


def _draw(axes: Axes, panel: Panel, *, crowded: bool, titled: bool) -> None:
    _frame(axes, panel)
    for span in panel.spans:
        _span(axes, span)
    for guide in panel.guides:
        _guide(axes, guide)
    for limit in panel.limits:
        _limit(axes, limit, crowded)
    for envelope in panel.envelopes:
        _envelope(axes, envelope)
    for curve in panel.curves:
        _curve(axes, curve, crowded)
    for label in panel.labels:
        _label(axes, label, crowded)
    if titled:
        pad = 5 if not panel.x.landmarks else 12
        axes.set_title(_plain(panel.title), loc="left", fontweight="bold", color=LIGHT["ink"], pad=pad)
    if panel.curves and not crowded:
        _legend(axes, _entries(axes), loc="best", borderaxespad=0.5)


def _frame(axes: Axes, panel: Panel) -> None:
    for direction, axis in (("x", panel.x), ("y", panel.y)):
        if axis.log:
            getattr(axes, f"set_{direction}scale")("log")
        if axis.limits:
            getattr(axes, f"set_{direction}lim")(*axis.limits)
        getattr(axes, f"set_{direction}label")(_plain(axis.label))
        _ticks(getattr(axes, f"{direction}axis"), axis)
    if panel.square:
        axes.set_aspect("equal")
    axes.grid(visible=True, color=LIGHT["grid"], linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(which="both", direction="out", color=LIGHT["guide"], labelcolor=LIGHT["ink"])
    for side in axes.spines.values():
        side.set(color=LIGHT["guide"], linewidth=0.7)
    _landmarks(axes, panel.x)


def _ticks(target: Any, axis: Axis) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, ScalarFormatter

    if axis.log:
        target.set_major_locator(LogLocator(10, numticks=20))
        target.set_minor_locator(LogLocator(10, subs=tuple(range(2, 10)), numticks=20))
        target.set_major_formatter(FuncFormatter(_power_of_ten))
        few = axis.limits is not None and decades(axis.limits) < 2
        target.set_minor_formatter(FuncFormatter(_two_and_five) if few else NullFormatter())
        return
    plain = ScalarFormatter(useOffset=False)
    plain.set_powerlimits((-4, 5))
    target.set_major_formatter(plain)


def _power_of_ten(value: float, _position: int | None = None) -> str:
    power = round(math.log10(value)) if value > 0 else 0
    return f"{value:g}" if -3 <= power <= 3 else f"$10^{{{power}}}$"


def _two_and_five(value: float, _position: int | None = None) -> str:
    first = round(value / 10 ** math.floor(math.log10(value) + 1e-9))
    return f"{value:g}" if first in (2, 5) else ""


def _landmarks(axes: Axes, axis: Axis) -> None:
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
            color=LIGHT["guide"],
        )
        axes.plot(
            [at, at], [0.985, 1.0], transform=axes.get_xaxis_transform(), color=LIGHT["guide"], linewidth=0.8
        )


def _curve(axes: Axes, curve: Curve, crowded: bool) -> None:
    colour = LIGHT[curve.colour]
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
        size = 3.2 if crowded else 4.0
        line.set(
            marker=_MARKERS[curve.marker],
            markersize=size,
            markevery=thinned(curve.x.size),
            markeredgewidth=0.8,
        )
        _hollow(axes, curve, colour, size)
    if curve.lower is not None and curve.upper is not None:
        band: dict[str, Any] = {"color": colour, "alpha": 0.16, "linewidth": 0}
        axes.fill_between(curve.x, curve.lower, curve.upper, label=curve.band_label or "_nolegend_", **band)


def _hollow(axes: Axes, curve: Curve, colour: str, size: float) -> None:
    if curve.hollow is None or not curve.hollow.any() or curve.marker is None:
        return
    axes.plot(
        curve.x[curve.hollow],
        curve.y[curve.hollow],
        linestyle="none",
        marker=_MARKERS[curve.marker],
        markersize=size,
        markerfacecolor=LIGHT["paper"],
        markeredgecolor=colour,
        markeredgewidth=0.9,
        zorder=3.2,
        label=_HOLLOW,
    )


def _envelope(axes: Axes, envelope: Envelope) -> None:
    colour = LIGHT[envelope.colour]
    axes.fill_between(envelope.x, envelope.low, envelope.high, color=colour, alpha=0.55, linewidth=0.3)


def _guide(axes: Axes, guide: Guide) -> None:
    axes.plot(guide.x, guide.y, color=LIGHT["guide"], linewidth=0.7, zorder=2)
    axes.text(
        guide.name_x,
        guide.name_y,
        guide.name,
        rotation=math.degrees(math.atan(guide.slope)),
        rotation_mode="anchor",
        ha="center",
        va="center",
        fontsize=7,
        color=LIGHT["guide"],
        zorder=2.1,
        bbox={"facecolor": LIGHT["paper"], "edgecolor": "none", "pad": 0.6},
    )


def _limit(axes: Axes, limit: Limit, crowded: bool) -> None:
    colour = LIGHT["limit"]
    axes.plot(limit.x, limit.y, color=colour, linestyle=_STYLES["dotted"], linewidth=1.1, zorder=2.2)
    axes.annotate(  # the head is the text's end, so the arrow is drawn backwards: from its foot, with "<|-"
        "",
        xy=limit.at,
        xytext=(0, -17),
        textcoords="offset points",
        arrowprops={"arrowstyle": "<|-", "color": colour, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0},
        zorder=4,
    )
    _words(axes, limit.at, limit.text, colour, limit.side, crowded, lower=9)


def _label(axes: Axes, label: Label, crowded: bool) -> None:
    colour = LIGHT[label.colour]
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
    axes.plot(
        [label.x], [label.y], marker="o", markersize=4.2, color=LIGHT["paper"], mec=colour, mew=1.0, zorder=4
    )
    _words(axes, (label.x, label.y), label.text, colour, label.side, crowded)


def _words(
    axes: Axes, point: tuple[float, float], text: str, colour: str, side: str, crowded: bool, lower: float = 0
) -> None:
    dx, dy = np.sum([_OFFSETS[word] for word in side.split()], axis=0)
    axes.annotate(
        _plain(text),
        xy=point,
        xytext=(dx, dy - lower * (dy < 0)),
        textcoords="offset points",
        ha="left" if dx > 0 else "right" if dx < 0 else "center",
        va="bottom" if dy > 0 else "top" if dy < 0 else "center",
        fontsize=7 if crowded else 8,
        color=colour,
        zorder=5,
        bbox={"facecolor": LIGHT["paper"], "edgecolor": "none", "alpha": 0.75, "pad": 0.8},
    )


def _span(axes: Axes, span: Span) -> None:
    if span.kind == "gap":
        axes.axvspan(span.start, span.stop, color=LIGHT["gap"], alpha=0.35, linewidth=0.8, zorder=1)
        return
    axes.axvspan(span.start, span.stop, ymax=0.05, color=LIGHT["finding"], linewidth=1.2, zorder=4)


def _entries(axes: Axes) -> dict[str, Any]:
    """Entries of a legend: the curves, their models, and last what holds for all of them."""
    handles, names = axes.get_legend_handles_labels()
    unique = dict(zip(names, handles, strict=True))
    return dict(sorted(unique.items(), key=lambda entry: _LAST.index(entry[0]) if entry[0] in _LAST else -1))


def _legend(target: Axes | Figure, entries: dict[str, Any], **place: Any) -> None:
    if len(entries) > 1:
        look: dict[str, Any] = {
            "framealpha": 0.9,
            "edgecolor": "none",
            "labelcolor": LIGHT["ink"],
            "handlelength": 2.4,
        }
        target.legend(list(entries.values()), list(entries), **look, **place)


def _plain(text: str) -> str:
    """Text that Matplotlib must not read as mathematics."""
    return text.replace("$", r"\$")
