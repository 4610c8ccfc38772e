# SPDX-License-Identifier: BSD-3-Clause
"""A clock that was set back: which part of the record its stamps still tell alone, and the options that take it.

Behind the step the stamps run through times that were there before. `--from` and `--to` cut by the stamps: only times
that belong to one part can be cut out.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.clock_line import Marks
from allanite.files.readers.filled_stamps import Filled

__all__ = ["between", "longest_alone"]

_MOST = 50  # steps back: more are rows out of order
_MARGIN = 0.05  # intervals beside a stamp of another part


def longest_alone(stamps: Filled, marks: Marks, interval: float) -> dict[str, Any] | None:
    """The longest run of rows whose times no other part of the record has.

    Returns
    -------
    dict or None
        "rows", and "from" and "to" where the run does not begin or end the times [s since the first stamp]; None where
        the clock was not set back for good, or no part has times of its own.
    """
    edges = np.concatenate(([0], marks.shifts + 1, [len(stamps)]))
    if not 2 < len(edges) <= _MOST:
        return None
    firsts = np.array([_stamp(stamps, int(a)) for a in edges[:-1]])
    lasts = np.array([_stamp(stamps, int(b) - 1) for b in edges[1:]])
    runs = [run for i in range(len(firsts)) for run in _alone(i, firsts, lasts)]
    low, high = max(runs, key=lambda run: run[1] - run[0], default=(0.0, 0.0))
    before, after = lasts[lasts <= low].max(initial=-np.inf), firsts[firsts >= high].min(initial=np.inf)
    rows = round((high - low) / interval) + 1 - int(before == low) - int(after == high)
    if rows < 3:
        return None
    near, far = _MARGIN * interval, (1 - _MARGIN) * interval
    cut: dict[str, Any] = {"rows": rows}
    if low > firsts.min():  # beside the first row of the run, or inside it where another part ends there
        cut["from"] = between(max(before + near, low - far), low + (-near if before < low else far))
    if high < lasts.max():
        cut["to"] = between(high + (near if after > high else -far), min(after - near, high + far))
    return cut


def _alone(i: int, firsts: NDArray[np.float64], lasts: NDArray[np.float64]) -> list[tuple[float, float]]:
    """The times of part `i` that no other part has."""
    free = [(float(firsts[i]), float(lasts[i]))]
    for low, high in zip(np.delete(firsts, i), np.delete(lasts, i), strict=True):
        free = [
            (a, b)
            for start, stop in free
            for a, b in ((start, min(stop, low)), (max(start, high), stop))
            if b > a
        ]
    return free


def _stamp(stamps: Filled, row: int) -> float:
    return float(stamps.read(row, row + 1)[0])


def between(low: float, high: float) -> float:
    """The number with the fewest digits between two others."""
    middle = (low + high) / 2
    return next((v for d in range(1, 17) if low < (v := float(f"{middle:.{d}g}")) < high), middle)
