# SPDX-License-Identifier: BSD-3-Clause
"""Correlations of estimates as squares: the larger the stronger, filled where positive and hollow where negative."""

from __future__ import annotations

import math
from collections.abc import Sequence

from numpy.typing import ArrayLike

from allanite.views.figures.drawing import Drawing, DrawnShape, Words, box, line
from allanite.views.figures.panel import Panel, array

__all__ = ["correlation", "correlation_panel"]

_WIDTH = 100.0
_KEY = 7.0  # height of the legend
_LARGEST = 4.4  # side of a cell
_CHARACTER = 0.98  # width of a character of size 1
_UNSEEN = 0.03  # smaller ones are no square that can be seen
_EXAMPLES = (0.1, 0.5, 1.0, -0.5)


def correlation_panel(names: Sequence[str], matrix: ArrayLike, *, title: str = "Correlations") -> Panel:
    """A panel of `correlation`."""
    return Panel(title=title, drawing=correlation(names, matrix))


def correlation(names: Sequence[str], matrix: ArrayLike) -> Drawing:
    """The lower triangle of a matrix of correlations on a sheet 100 wide; the name of a row stands at its diagonal.

    Parameters
    ----------
    names : sequence of str
    matrix : array_like, shape (n, n)
        NaN: no square.
    """
    n, r = len(names), array(matrix).reshape(len(names), -1)
    size = 1.0 if n <= 12 else 0.9 if n <= 24 else 0.8
    words = max((_CHARACTER * size * len(name) for name in names), default=0.0) + 2.0
    cell = min((_WIDTH - words) / max(n, 1), _LARGEST)
    left, top = 0.5 * (_WIDTH - n * cell - words), _KEY + n * cell + 1.0
    parts: list[DrawnShape | Words] = []
    for i, name in enumerate(names):
        y = top - (i + 0.5) * cell
        parts += _frame(i, n, left, top, cell)
        parts += [
            square for j in range(i) for square in _square(float(r[i, j]), left + (j + 0.5) * cell, y, cell)
        ]
        parts.append(Words(x=left + (i + 0.35) * cell, y=y, text=name, across="left", size=size))
    parts.append(
        line((left, top - n * cell), (left + (n - 1) * cell, top - n * cell), colour="grid", width=0.7)
    )
    return Drawing(width=_WIDTH, height=top + 1.0, parts=(*parts, *_legend(cell)))


def _frame(i: int, n: int, left: float, top: float, cell: float) -> list[DrawnShape]:
    """Above row i and right of column i, so that the eye finds along them from a square to its two names."""
    y, x = top - i * cell, left + (i + 1) * cell
    across = line((left, y), (left + i * cell, y), colour="grid", width=0.7)
    down = line((x, y - cell), (x, top - n * cell), colour="grid", width=0.7)
    return [across, down] if i < n - 1 else [across]


def _square(r: float, x: float, y: float, cell: float) -> list[DrawnShape]:
    """Its area is the correlation."""
    if not math.isfinite(r) or abs(r) < _UNSEEN:
        return []
    side = 0.86 * cell * math.sqrt(min(abs(r), 1.0))
    if r > 0:
        return [box(x - side / 2, y - side / 2, side, side, colour=None, fill="z", name="positive")]
    width = min(0.12 * cell, 0.25 * side)  # hollow, with its line inside
    inner = side - width
    return [
        box(
            x - inner / 2, y - inner / 2, inner, inner, colour="x", line_width=2.0 * width, name="negative"
        )
    ]  # fmt: skip


def _legend(cell: float) -> list[DrawnShape | Words]:
    x, parts = 20.0, list[DrawnShape | Words]()
    for r in _EXAMPLES:
        parts += _square(r, x, 0.5 * _KEY - 0.5, cell)
        text = f"{r:g}".replace("-", "−")
        parts.append(Words(x=x + 0.5 * cell + 0.8, y=0.5 * _KEY - 0.5, text=text, across="left", size=0.92))
        x += cell + 5.5
    words = "filled: positive, hollow: negative"
    return [
        *parts,
        Words(x=x + 2.0, y=0.5 * _KEY - 0.5, text=words, across="left", size=0.92, colour="guide"),
    ]
