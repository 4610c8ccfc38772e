# SPDX-License-Identifier: BSD-3-Clause
"""Clocks that begin anew: counters of so many bits, microseconds of a processor, seconds of a day or of a GPS week.

Where they do is told by the whole column: it climbs to just below a known turn, falls by nearly that much, and goes on.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import ArrayColumn, Column

__all__ = ["UnwrappedColumn", "unwrapped"]

_BITS = (8, 12, 16, 20, 24, 31, 32, 48)
_TICKS = (1.0, 1e-3, 1e-6, 1e-9)  # of a counter of 32 bits whose stamps are kept in seconds [s]
_SPANS = (1.0, 60.0, 3600.0, 86_400.0, 604_800.0)  # seconds, minutes, hours, days, weeks
_NEAR = 3.0  # steps by which the last stamp before a turn, and the first after it, miss it
_ROWS = 1 << 18


@dataclass(frozen=True, slots=True)
class UnwrappedColumn:
    """A column that goes on where it began anew.

    Attributes
    ----------
    column : Column
    turn : float
        Where it began anew, in its own unit.
    times : int
    """

    column: Column
    turn: float
    times: int


def unwrapped(column: Column, factor: float | None, turn: float | None = None) -> UnwrappedColumn | None:
    """A column of stamps that begin anew, made to rise; None where they do not.

    Parameters
    ----------
    column : Column
    factor : float or None [s]
        Seconds in a unit of the column; None for counts.
    turn : float, optional
        Where the stamps begin anew, if that is known; else it is told from them.
    """
    falls, before, after = _falls(column)
    step = _typical_step(column) if len(falls) else 0.0
    if not step > 0:
        return None
    turn = _turn(before, after, step, factor, _first(column)) if turn is None else turn
    if turn is None:
        return None
    count = before - after > turn / 2
    if not count.any():
        return None
    values = column.read(0, len(column))
    gained = np.zeros(len(values))
    gained[falls[count]] = turn
    return UnwrappedColumn(ArrayColumn(values + column.origin + np.cumsum(gained)), turn, int(count.sum()))


def _falls(column: Column) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Rows at which the values fall, the values before and there."""
    rows, before, after = [], [], []
    for first, part in _parts(column):
        at = np.flatnonzero(part[1:] < part[:-1])
        rows.append(at + first + 1)
        before.append(part[at])
        after.append(part[at + 1])
    origin = column.origin
    return (
        np.concatenate(rows).astype(np.int64) if rows else np.zeros(0, dtype=np.int64),
        np.concatenate(before) + origin if before else np.zeros(0),
        np.concatenate(after) + origin if after else np.zeros(0),
    )


def _typical_step(column: Column) -> float:
    """The typical step of the values that rise; 0 where none does."""
    steps: list[float] = []
    for _, part in _parts(column):
        difference = np.diff(part)
        rising = difference[difference > 0]
        if len(rising):
            steps.append(float(np.median(rising)))
    return float(np.median(steps)) if steps else 0.0


def _parts(column: Column) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Parts of a column that share a row with the one before, each with its first row."""
    for start in range(0, len(column), _ROWS):
        first = max(start - 1, 0)
        yield first, column.read(first, min(start + _ROWS, len(column)))


def _turn(
    before: NDArray[np.float64], after: NDArray[np.float64], step: float, factor: float | None, first: float
) -> float | None:
    """The turn that the falls tell: each typical one begins just below it, and ends just above zero."""
    deep = before - after > 0.5 * float((before - after).max())
    top, bottom = float(np.median(before[deep])), float(np.median(after[deep]))
    if not 0.0 <= bottom <= _NEAR * step:
        return None
    turns = [2.0**k for k in _BITS]
    if factor is not None:
        if first > _NEAR * step:  # one that begins at zero may be two records of that length
            turns += [span / factor for span in _SPANS]
        turns += [2.0**32 * tick / factor for tick in _TICKS]
    else:
        turns += [10.0**k for k in range(2, 10)]
    near = [t for t in turns if t >= float(before.max()) and t - top <= _NEAR * step]
    return min(near, default=None)


def _first(column: Column) -> float:
    return float(column.read(0, 1)[0]) + column.origin
