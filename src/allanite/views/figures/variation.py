# SPDX-License-Identifier: BSD-3-Clause
"""Deviation over time and lag: a map of its ratio to the whole record's, and lines of some lags with their bands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby

import numpy as np

from allanite.quantities.number_words import duration, probability
from allanite.stability.variation import ChannelVariation, LagTest
from allanite.stability.variation.words import part_name
from allanite.views.figures.drawing import Drawing, DrawnShape, Words, box, line
from allanite.views.figures.panel import Axis, Curve, Label, Panel, level
from allanite.views.figures.records import clock

__all__ = ["VIEWS", "line_panels", "map_panel"]

VIEWS = ("whole", "map", "lines")

_WIDTH, _LEFT, _RIGHT, _ROW, _FOOT, _HEAD = 100.0, 10.0, 1.0, 3.0, 7.5, 5.0
_LEVELS = 6  # of depth on either side
_LEAST, _MOST = 0.1, math.log(3.0)  # the deepest colour stands for a logarithm of the ratio between these
_PALE = 0.4  # of the depth, where chance makes such a window
_TICKS = (1.0, 2.0, 5.0, 10.0)


def map_panel(channel: ChannelVariation, length: float) -> Panel:
    """Ratio of every window to the whole record as depth of colour, lag over time; significant windows are framed."""
    return Panel(
        title=f"{channel.name}: deviation over that of the whole record", drawing=_map(channel, length)
    )


def _map(channel: ChannelVariation, length: float) -> Drawing:
    lags = channel.lags
    top = _FOOT + _ROW * len(lags)
    deepest = _deepest(lags)
    across = (_WIDTH - _LEFT - _RIGHT) / length
    parts: list[DrawnShape | Words] = []
    for row, lag in enumerate(lags):
        parts += _row(lag, _FOOT + row * _ROW, across, deepest)
    parts += [f for row, lag in enumerate(lags) for f in _frames(lag, _FOOT + row * _ROW, across)]
    parts += _axes(lags, length, across, top)
    for change in channel.changes:
        if change.time is not None:
            x = _LEFT + across * change.time.value
            parts.append(line((x, _FOOT), (x, top + 0.8), dashed=True, name="change"))
            words = f"{part_name(change.symbol)} × {change.ratio.value:.3g}"
            parts.append(
                Words(x=x, y=top + 1.9, text=words, across="right" if x > 0.75 * _WIDTH else "left", size=0.9)
            )
    return Drawing(width=_WIDTH, height=top + _HEAD + 3.0, parts=(*parts, *_key(deepest, top + _HEAD + 1.0)))


def _deepest(lags: Sequence[LagTest]) -> float:
    """Logarithm of the ratio that has the deepest colour: the largest that is no chance."""
    significant = [
        abs(math.log(r))
        for lag in lags
        for r, s in zip(lag.ratio, lag.significant, strict=True)
        if s and r > 0
    ]
    return min(max([_LEAST, *significant]), _MOST)


def _row(lag: LagTest, y: float, across: float, deepest: float) -> list[DrawnShape]:
    """Windows of one lag; neighbours of one depth are one box."""
    level = np.rint(_LEVELS * np.clip(np.log(lag.ratio) / deepest, -1, 1)).astype(int)
    depth = np.where(lag.significant, 1.0, _PALE)
    cells = list(zip(level.tolist(), depth.tolist(), lag.start, lag.stop, strict=True))
    boxes = []
    for (k, pale), members in groupby(cells, key=lambda cell: cell[:2]):
        run = list(members)
        if k:
            left, right = (_LEFT + across * run[i][j] for i, j in ((0, 2), (-1, 3)))
            boxes.append(
                box(
                    left, y, right - left, _ROW, colour=None, fill="x" if k > 0 else "z",
                    opacity=pale * abs(k) / _LEVELS, name="window",
                )
            )  # fmt: skip
    return boxes


def _frames(lag: LagTest, y: float, across: float) -> list[DrawnShape]:
    return [
        box(
            _LEFT + across * a + 0.08, y + 0.15, max(across * (b - a) - 0.16, 0.1), _ROW - 0.3, line_width=0.7,
            name="significant",
        )
        for a, b, s in zip(lag.start, lag.stop, lag.significant, strict=True)
        if s
    ]  # fmt: skip


def _axes(lags: Sequence[LagTest], length: float, across: float, top: float) -> list[DrawnShape | Words]:
    right = _LEFT + across * length
    parts: list[DrawnShape | Words] = [
        box(_LEFT, _FOOT, right - _LEFT, top - _FOOT, colour="guide", line_width=0.7, name="frame")
    ]
    step = max(1, -(-len(lags) // 10))
    for row in range(0, len(lags), step):
        y = _FOOT + (row + 0.5) * _ROW
        parts.append(Words(x=_LEFT - 0.8, y=y, text=duration(lags[row].tau), across="right", size=0.9))
    unit, second = clock(length)
    for value in _round_values(length / second):
        x = _LEFT + across * value * second
        parts.append(line((x, _FOOT), (x, _FOOT - 0.7), colour="guide", width=0.7))
        parts.append(Words(x=x, y=_FOOT - 1.1, text=f"{value:g}", up="top", size=0.9))
    middle = 0.5 * (_LEFT + right)
    parts.append(
        Words(
            x=middle,
            y=1.2,
            text=f"Time since the first sample [{unit}]",
            up="middle",
        )
    )
    parts.append(
        Words(x=_LEFT - 0.8, y=top + 0.4, text="Averaging\ntime", across="right", up="bottom", size=0.9)
    )
    return parts


def _round_values(length: float) -> list[float]:
    size = 10.0 ** math.floor(math.log10(length))
    step = next(t for t in (0.1 * s * size for s in (*_TICKS, 20.0, 50.0, 100.0)) if length / t <= 8)
    return [round(i * step, 12) for i in range(int(length / step + 1e-9) + 1)]


def _key(deepest: float, y: float) -> list[DrawnShape | Words]:
    parts: list[DrawnShape | Words] = []
    x = _LEFT
    for k in (-_LEVELS, -_LEVELS // 2, 0, _LEVELS // 2, _LEVELS):
        fill = None if k == 0 else "x" if k > 0 else "z"
        parts.append(
            box(x, y - 0.9, 2.6, 1.8, colour="guide", line_width=0.5, fill=fill, opacity=abs(k) / _LEVELS)
        )
        parts.append(
            Words(x=x + 3.1, y=y, text=f"× {math.exp(deepest * k / _LEVELS):.3g}", across="left", size=0.9)
        )
        x += 10.5
    parts.append(box(x, y - 0.9, 2.6, 1.8, line_width=0.9))
    caption = "framed: significant; others pale"
    return [*parts, Words(x=x + 3.7, y=y, text=caption, across="left", size=0.9, colour="guide")]


def line_panels(channel: ChannelVariation, length: float, *, most: int = 3) -> list[Panel]:
    """Deviation of the windows of some lags over that of the whole record, with the interval of every window."""
    unit, second = clock(length)
    labels = tuple(
        Label(
            x=change.time.value / second, y=1.0, text=part_name(change.symbol), colour="guide", place="line"
        )
        for change in channel.changes
        if change.time is not None
    )
    return [
        _lag_panel(channel, channel.lags[i], unit, second, length, labels) for i in _told(channel.lags, most)
    ]


def _lag_panel(
    channel: ChannelVariation,
    lag: LagTest,
    unit: str,
    second: float,
    length: float,
    labels: tuple[Label, ...],
) -> Panel:
    ratio, whole = lag.ratio, lag.whole
    low, high = lag.lower / whole, lag.upper / whole
    middle = (lag.start + lag.stop) / 2 / second
    bottom, top = float(min(low.min(), 0.95)), float(max(high.max(), 1.05))
    marks = lag.significant
    curves = [
        Curve(x=middle, y=ratio, lower=low, upper=high, label="window, with its interval", colour="z", marker="circle"),
    ]  # fmt: skip
    if marks.any():
        curves.append(
            Curve(
                x=middle[marks],
                y=ratio[marks],
                label="significant",
                colour="x",
                style="none",
                marker="square",
            )
        )
    return Panel(
        title=f"{channel.name}: over {duration(lag.tau)} ({probability(lag.p)} for constant)",
        x=Axis(label=f"Time since the first sample [{unit}]", limits=(0.0, length / second)),
        y=Axis(
            label="Over whole record", limits=(bottom - 0.02 * (top - bottom), top + 0.02 * (top - bottom))
        ),
        curves=(*curves, level((0.0, length / second), 1.0, "whole record")),
        labels=labels,
        height=0.2,
        key="above",
    )


def _told(lags: Sequence[LagTest], most: int) -> list[int]:
    """The shortest lag, the least constant one, and one in the middle of the longer ones."""
    worst = min(range(len(lags)), key=lambda i: lags[i].p)
    wide = [i for i in range(len(lags)) if len(lags[i].start) >= 8] or [0]
    return sorted(dict.fromkeys((0, worst, wide[len(wide) // 2], wide[-1])))[:most]
