# SPDX-License-Identifier: BSD-3-Clause
"""The part of a log between two times, by its stamps as they are: cut before a time grid is made.

So a record whose clock was set, from whose stamps no grid can be built, is cut where it was set. Rows whose stamps lie
elsewhere are left out, wherever they stand in the file.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.files.readers.timebase import Stamps
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import Column
from allanite.recording.sample_columns import View

__all__ = ["ColumnOfRows", "StampsOfRows", "TableRows", "rows_between"]

_ROWS = 1 << 20
_EXACT = 1e-9  # a stamp so close to an end [s] is at the end: decimals are not binary


class Gatherer(Protocol):
    """Some rows of a table."""

    def __len__(self) -> int: ...

    def gathered(self, source: Any, start: int, stop: int) -> NDArray[np.float64]:
        """Values [start, stop) of a column or of stamps, of these rows alone."""


@dataclass(frozen=True, slots=True)
class ColumnOfRows(View):
    """These rows of a column, one after another."""

    rows: Gatherer

    def __len__(self) -> int:
        return len(self.rows)

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        return self.rows.gathered(self.of, start, stop)


@dataclass(frozen=True, slots=True)
class StampsOfRows:
    """The stamps of these rows, less the first of them."""

    of: Stamps
    rows: Gatherer
    first: float

    def __len__(self) -> int:
        return len(self.rows)

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        return self.rows.gathered(self.of, start, stop) - self.first


@dataclass(frozen=True, slots=True, kw_only=True)
class TableRows:
    """Rows of a table.

    Attributes
    ----------
    runs : ndarray of int64, shape (n_runs, 2)
        Rows [a, b).
    edges : ndarray of int64, shape (n_runs + 1,)
        Rows before each run, and in all.
    first, last : float [s]
        Stamps of the first and the last of these rows, since the first of the table.
    """

    runs: NDArray[np.int64]
    edges: NDArray[np.int64]
    first: float
    last: float

    def __len__(self) -> int:
        return int(self.edges[-1])

    def of_column(self, column: Column) -> Column:
        """These rows of a column."""
        return ColumnOfRows(column, self)

    def of_stamps(self, stamps: Stamps) -> Stamps:
        """The stamps of these rows: seconds since the first of them."""
        return StampsOfRows(stamps, self, self.first)

    def gathered(self, source: Any, start: int, stop: int) -> NDArray[np.float64]:
        """Values [start, stop) of a column or of stamps, of these rows alone."""
        stop = min(stop, len(self))
        k = int(np.searchsorted(self.edges, start, side="right")) - 1
        parts = []
        while k < len(self.runs) and self.edges[k] < stop:
            offset = int(self.runs[k, 0] - self.edges[k])
            a, b = max(start, int(self.edges[k])), min(stop, int(self.edges[k + 1]))
            parts.append(source.read(a + offset, b + offset))
            k += 1
        return parts[0] if len(parts) == 1 else np.concatenate(parts or [np.zeros(0)])


def rows_between(stamps: Stamps, start: float | None, stop: float | None) -> TableRows:
    """The rows whose stamps lie in [start, stop), seconds since the first; rows without a stamp go with the one before.

    Raises
    ------
    InputError
        Ends that are no times, or no row between them.
    """
    span = f"from {'the start' if start is None else f'{start:g} s'} to {'the end' if stop is None else f'{stop:g} s'}"
    if not all(math.isfinite(t) for t in (start, stop) if t is not None):
        raise InputError(f"window {span}: both ends must be finite")
    low = -math.inf if start is None else _just_before(start)
    high = math.inf if stop is None else _just_before(stop)
    changes: list[int] = []
    inside, least, most, first, last = False, math.inf, -math.inf, math.nan, math.nan
    for begin in range(0, len(stamps), _ROWS):
        block = stamps.read(begin, min(begin + _ROWS, len(stamps)))
        there = np.isfinite(block)
        known = block[there]
        if not len(known):
            continue
        least, most = min(least, float(known.min())), max(most, float(known.max()))
        index = np.maximum.accumulate(np.where(there, np.arange(len(block)), -1))
        chosen = np.where(index >= 0, ((block >= low) & (block < high))[index], inside)
        changes += (np.flatnonzero(np.diff(chosen, prepend=inside)) + begin).tolist()
        inside = bool(chosen[-1])
        stamps_inside = block[chosen & there]
        if len(stamps_inside):
            first, last = (float(stamps_inside[0]) if math.isnan(first) else first), float(stamps_inside[-1])
    changes += [len(stamps)] if inside else []
    mean = (most - least) / max(len(stamps) - 1, 1)
    if math.isnan(first) or (stop is not None and stop > most + 1.5 * mean):
        raise InputError(
            f"window {span} does not lie inside the record of {most - least + mean:.6g} s, or is empty: its stamps go "
            f"from {least:.6g} to {most:.6g} s"
        )
    runs = np.array(changes, dtype=np.int64).reshape(-1, 2)
    edges = np.concatenate(([0], np.cumsum(runs[:, 1] - runs[:, 0]))).astype(np.int64)
    return TableRows(runs=runs, edges=edges, first=first, last=last)


def _just_before(end: float) -> float:
    return end - _EXACT - 4.0 * float(np.spacing(abs(end)))
