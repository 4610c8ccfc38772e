# SPDX-License-Identifier: BSD-3-Clause
"""How a column goes, from its beginning, middle and end: it rises, only grows, counts rows, or is even."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.filled_stamps import Stamps
from allanite.files.readers.stamp_units import EPOCH
from allanite.recording.records import Column

__all__ = [
    "FEWEST",
    "begins_anew",
    "first_finite",
    "is_counter",
    "is_even",
    "is_row_number",
    "look",
    "looked_at",
    "only_grows",
    "rises",
    "roughness",
    "stands_still",
]

#: Rows from which a column without a name is told.
FEWEST = 8
_NO_STAMP = 1e30  # in whatever unit: no clock counts so far, and nanoseconds of it are no number
_LOOK = 2048  # values looked at in each of three places
_FALLS = 0.02  # of the rises: a column that only grows has no more


def look(column: Column | Stamps) -> list[NDArray[np.float64]]:
    """Values at the beginning, in the middle and at the end."""
    return [column.read(a, b) for a, b in looked_at(len(column))]


def looked_at(n: int) -> list[tuple[int, int]]:
    """Rows [a, b) at the beginning, in the middle and at the end of n."""
    starts = sorted({0, max((n - _LOOK) // 2, 0), max(n - _LOOK, 0)})
    return [(a, min(a + _LOOK, n)) for a in starts]


def _finite(part: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values that are there: those of a damaged row are missing."""
    return part[np.isfinite(part)]


def first_finite(column: Column) -> float:
    """The first value that may be a stamp; 0 where there is none."""
    head = column.read(0, min(_LOOK, len(column)))
    finite = head[np.abs(head) < _NO_STAMP]
    return float(finite[0]) if len(finite) else 0.0


def rises(column: Column) -> bool:
    """True if the values rise nearly everywhere that is looked at (equal neighbours are allowed)."""
    parts = look(column)
    steps = [d for d in (np.diff(p[np.isfinite(p)]) for p in parts) if len(d)]
    if not steps:
        return False
    together = np.concatenate(steps)
    ends = [float(p[np.isfinite(p)][-1]) for p in parts if np.isfinite(p).any()]
    return bool((together >= 0).mean() >= 0.9 and (together > 0).any() and ends == sorted(ends))


def only_grows(column: Column) -> bool:
    """True if the values go up again and again and hardly ever down, wherever they are looked at."""
    if len(column) < FEWEST:
        return False
    steps = np.concatenate([np.diff(part) for part in look(column)])
    ups, downs = np.count_nonzero(steps > 0), np.count_nonzero(steps < 0)
    return bool(ups > 2 and downs <= _FALLS * ups and rises(column))


def begins_anew(column: Column) -> bool:
    """True if the values rise in even steps, and now and then fall back far: a clock of a day, a counter that wraps."""
    if len(column) < FEWEST:
        return False
    parts = [_finite(part) for part in look(column)]
    steps = np.concatenate([np.diff(part) for part in parts])
    ups = steps[steps > 0]
    if len(ups) < 0.9 * len(steps) or not (len(ups) and len(parts[0])):
        return False
    middle = float(np.median(ups))
    even = (np.abs(ups - middle) <= 0.5 * middle).mean() > 0.8
    far = (steps[steps < 0] < -10.0 * middle).all()
    return bool(even and far and ((steps < 0).any() or parts[-1][-1] < parts[0][0]))


def is_counter(column: Column) -> bool:
    """True if whole numbers rise by one from row to row (a few may be missing)."""
    for part in map(_finite, look(column)):
        steps = np.diff(part)
        if len(steps) == 0 or not np.all(part == np.round(part)) or (steps == 1).mean() < 0.9:
            return False
        if (steps < 0).any():
            return False
    return True


def roughness(column: Column) -> float:
    """Spread of the differences over their mean: among several time columns the smoothest one is the best."""
    spread = 0.0
    for part in look(column):
        steps = np.diff(part[np.isfinite(part)])
        mean = steps.mean() if len(steps) else 0.0
        spread = max(spread, float(steps.std() / mean) if mean > 0 else math.inf)
    return round(spread, 3)


def is_row_number(column: Column) -> bool:
    """Counts rows, and not the seconds since 1970."""
    return is_counter(column) and not EPOCH[0] <= first_finite(column) + column.origin <= EPOCH[1]


def stands_still(column: Column) -> bool:
    """True if the values are equal wherever they are looked at."""
    return all(len(part) == 0 or bool((part == part[0]).all()) for part in map(_finite, look(column)))


def is_even(part: NDArray[np.float64]) -> bool:
    """True if neighbors are about equally far apart; a value that was lost leaves a longer step."""
    steps = np.diff(part[np.isfinite(part)])
    if len(steps) < 0.5 * len(part) or (steps <= 0).mean() > 0.01:
        return False
    middle = float(np.median(steps))
    return bool((np.abs(steps - middle) <= 0.5 * middle).mean() > 0.8)
