# SPDX-License-Identifier: BSD-3-Clause
"""The axes of a still picture, drawn without Matplotlib's ticks.

A tick of Matplotlib is five artists, so that a window may zoom; they cost a fifth of the time of a picture. Here an
axis has one path for its grid, one line of markers for its ticks, and one text that goes from label to label. Places,
words and distances are Matplotlib's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.lines import Line2D
from matplotlib.markers import TICKDOWN, TICKLEFT
from matplotlib.text import Text
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.backend_bases import RendererBase

__all__ = ["rule"]

_SETTINGS: Any = mpl.rcParams
_OFFSET = 3.0  # points between an axis and its power of ten


def rule(axes: Axes, *, ink: str, guide: str, grid: str, numbered: bool) -> None:
    """Put rulers in the place of the two axes.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Its locators, formatters and labels are read when it is drawn.
    ink, guide, grid : str
        Colors of the labels, of the ticks and of the grid.
    numbered : bool
        Whether the ticks of x have labels; else the panel below has them.
    """
    axes.add_artist(_Ruler(axes, "x", (ink, guide, grid), numbered=numbered))
    axes.add_artist(_Ruler(axes, "y", (ink, guide, grid), numbered=True))


class _Ruler(Artist):
    """One axis of a panel: its grid, its ticks with their labels, and its own label."""

    def __init__(self, axes: Axes, direction: str, colours: tuple[str, str, str], *, numbered: bool) -> None:
        super().__init__()
        self.axes = axes
        self._panel: Any = axes
        self._is_x, self._colours, self._numbered = direction == "x", colours, numbered
        self._axis: Any = getattr(axes, f"{direction}axis")
        self._axis.set_visible(False)
        self.set_zorder(self._axis.get_zorder())
        self.set_in_layout(False)

    def draw(self, renderer: RendererBase) -> None:
        """Draw what the axis would."""
        point: Any = renderer.points_to_pixels(1.0)
        lowest = min(self._ticks(renderer, "major"), self._ticks(renderer, "minor"))
        offset = self._axis.get_major_formatter().get_offset() if self._numbered else ""
        if offset:
            words = self._axis.get_offset_text()
            words.set(text=offset, color=self._colours[0])
            words.set_y(lowest - _OFFSET * point if self._is_x else self._panel.bbox.y1 + _OFFSET * point)
            words.draw(renderer)
        label = self._axis.label
        if self._is_x:
            label.set_y(lowest - self._axis.labelpad * point)
        label.draw(renderer)
        self.stale = False

    def _ticks(self, renderer: RendererBase, which: str) -> float:
        """Draw ticks of a kind; the lowest pixel of their labels, or of the axes."""
        at, labels = self._places(which)
        if not at.size:
            return float(self._panel.bbox.y0)
        size, width, pad = (
            _SETTINGS[f"{self._axis.axis_name}tick.{which}.{name}"] for name in ("size", "width", "pad")
        )
        if which == "major":
            self._grid(at).draw(renderer)
        marker: Any = TICKDOWN if self._is_x else TICKLEFT
        mark = Line2D(
            *self._oriented(at, np.zeros(at.size)),
            linestyle="none",
            marker=marker,
            markersize=size,
            markeredgewidth=width,
            color=self._colours[1],
        )
        self._placed(mark, "tick1").draw(renderer)
        return self._labels(renderer, at, labels, size + pad)

    def _places(self, which: str) -> tuple[NDArray[np.float64], list[str]]:
        """Ticks of a kind within the view, and their labels."""
        at = np.asarray(getattr(self._axis, f"get_{which}ticklocs")(), dtype=np.float64)
        labels = getattr(self._axis, f"get_{which}_formatter")().format_ticks(at)
        scaled = self._axis.get_transform()
        low, high = np.sort(scaled.transform(np.asarray(self._axis.get_view_interval())))
        slack = 1e-10 * (high - low)
        where = scaled.transform(at)
        inside = (where >= low - slack) & (where <= high + slack)
        return at[inside], [words for words, shown in zip(labels, inside, strict=True) if shown]

    def _grid(self, at: NDArray[np.float64]) -> Line2D:
        along = np.repeat(at, 3)
        across = np.tile([0.0, 1.0, np.nan], at.size)
        return self._placed(
            Line2D(*self._oriented(along, across), color=self._colours[2], linewidth=0.6), "grid"
        )

    def _oriented(self, along: object, across: object) -> tuple[Any, Any]:
        return (along, across) if self._is_x else (across, along)

    def _placed(self, line: Line2D, which: Any) -> Line2D:
        """A line in the coordinates of the axis, clipped if it is of the grid."""
        axes = self._panel
        line.set_figure(axes.get_figure())
        line.axes = axes
        line.set_transform(axes.get_xaxis_transform(which) if self._is_x else axes.get_yaxis_transform(which))
        if which == "grid":
            line.set_clip_path(axes.patch)
        return line

    def _labels(
        self, renderer: RendererBase, at: NDArray[np.float64], labels: list[str], distance: float
    ) -> float:
        axes = self._panel
        if not self._numbered:
            return float(axes.bbox.y0)
        lowest = float(axes.bbox.y0 - renderer.points_to_pixels(distance))
        place = axes.get_xaxis_text1_transform if self._is_x else axes.get_yaxis_text1_transform
        transform, up, across = place(distance)
        text = Text(
            va=up,
            ha=across,
            color=self._colours[0],
            fontsize=_SETTINGS[f"{self._axis.axis_name}tick.labelsize"],
            transform=transform,
        )
        text.set_figure(axes.get_figure())
        text.axes = axes
        for value, words in zip(at.tolist(), labels, strict=True):
            if words:
                text.set(text=words, position=self._oriented(value, 0.0))
                text.draw(renderer)
                if self._is_x:
                    lowest = min(lowest, text.get_window_extent(renderer).y0)
        return lowest
