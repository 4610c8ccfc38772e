# SPDX-License-Identifier: BSD-3-Clause
"""The frames of panels: the ends of their axes, and where they are on a sheet of paper."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from allanite.views.figures.panel import Array, Axis, Panel, Sheet, array

__all__ = ["BOTTOM", "CHARACTERS", "KEY", "LEFT", "Box", "layout", "limits_of"]

Box = tuple[float, float, float, float]

# Sizes in inches. The layout is computed rather than found by drawing twice, and equal decades are square because the
# axes are made so.
_WIDTH = 6.9  # the text width of A4 and letter paper
_LEAST = 4.9  # a panel in a row of several
LEFT, _RIGHT, BOTTOM = 0.74, 0.14, 0.46
_LANDMARKS, _TITLE, _TIGHT = 0.2, 0.2, 0.1
_FOOT = 0.36  # a legend for all panels
KEY = 0.19  # a row of a legend above a panel
CHARACTERS = 17.0  # of a legend in an inch
_ROOM = 0.05  # between data and the ends of an axis without limits


def layout(sheet: Sheet) -> tuple[tuple[float, float], list[Box]]:
    """Size of the figure, and left, bottom, width and height of each panel's axes [inch]."""
    width = max(_WIDTH, _LEAST * sheet.columns) if sheet.columns > 1 else _WIDTH
    share = width / sheet.columns
    boxes = []
    y = _FOOT if sheet.columns > 1 else 0.0
    for number, row in reversed(list(enumerate(sheet.rows))):
        drawn = all(panel.drawing is not None for panel in row)
        left, right = (_TIGHT, _TIGHT) if drawn else (LEFT, _RIGHT)
        each = share - left - right
        y += _TIGHT if drawn or not sheet.labelled(number) else BOTTOM
        height = max(panel.aspect for panel in row) * each
        boxes.append([(left + i * share, y, each, height) for i in range(len(row))])
        y += height + _above(row, each, titled=len(sheet.panels) > 1)
    return (width, y), [box for row_boxes in reversed(boxes) for box in row_boxes]


def _above(row: tuple[Panel, ...], width: float, *, titled: bool) -> float:
    """Room over a row: for landmarks, a legend, a title."""
    landmarks = any(p.x.landmarks for p in row)
    keys = max(p.key_grid(round(width * CHARACTERS))[1] if p.key == "above" else 0 for p in row)
    return (_TITLE if titled else 0.0) + (_LANDMARKS if landmarks else _TIGHT) + KEY * keys


def limits_of(panel: Panel) -> tuple[tuple[float, float], tuple[float, float]]:
    """The ends of both axes: as stated, otherwise a little outside all that is shown."""
    across = [curve.x for curve in panel.curves] + [e.x for e in panel.envelopes]
    across += [array(guide.x) for guide in panel.guides] + [limit.x for limit in panel.limits]
    across += [array([s.start, s.stop]) for s in panel.spans] + [rug.x for rug in panel.rugs]
    across += [array([label.x]) for label in panel.labels if label.place != "level"]
    return _ends(panel.x, across), _ends(panel.y, _heights(panel))


def _heights(panel: Panel) -> list[Array]:
    """Everything that has a height."""
    up = [part for c in panel.curves for part in (c.y, c.lower, c.upper) if part is not None]
    up += [part for e in panel.envelopes for part in (e.low, e.high)]
    up += [array(guide.y) for guide in panel.guides] + [limit.y for limit in panel.limits]
    return up + [array([label.y]) for label in panel.labels if label.place != "line"]


def _ends(axis: Axis, parts: Iterable[Array]) -> tuple[float, float]:
    if axis.limits:
        return axis.limits
    values = np.concatenate([np.zeros(0), *parts])
    values = values[np.isfinite(values) & ((values > 0) | (not axis.log))]
    if not values.size:
        return (1.0, 10.0) if axis.log else (0.0, 1.0)
    low, high = float(values.min()), float(values.max())
    if axis.log:
        margin = (high / low) ** _ROOM if high > low else math.sqrt(10.0)
        return low / margin, high * margin
    room = _ROOM * (high - low) or _ROOM * abs(low) or _ROOM
    return low - room, high + room
