# SPDX-License-Identifier: BSD-3-Clause
"""Rows of a table picked one by one, and the columns and stamps of these rows alone.

One bit per row is kept, so that a log larger than memory can be picked from; a block is read whole and then picked.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.part import ColumnOfRows, StampsOfRows
from allanite.files.readers.stamp_table import TimeChoice
from allanite.files.readers.timebase import Stamps
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import Column

__all__ = ["KeptRows"]

_Floats = NDArray[np.float64]
_CHUNK: Final = 1 << 13  # rows that are picked from together: a multiple of the 8 bits of a byte


@dataclass(frozen=True, slots=True, kw_only=True)
class KeptRows:
    """Some of the rows of a table.

    Attributes
    ----------
    bits : ndarray of uint8
        A bit for each row, set where the row is kept.
    edges : ndarray of int64
        Kept rows before each chunk of rows, and in all.
    total : int
        Rows of the table.
    """

    bits: NDArray[np.uint8]
    edges: NDArray[np.int64]
    total: int

    @classmethod
    def of(cls, masks: Iterable[NDArray[np.bool_]]) -> KeptRows:
        """The rows that are True in masks of consecutive blocks, each but the last a multiple of 8192 rows long."""
        bits, counts, total = list[NDArray[np.uint8]](), list[NDArray[np.int64]](), 0
        for mask in masks:
            bits.append(np.packbits(mask))
            counts.append(np.add.reduceat(mask, np.arange(0, len(mask), _CHUNK), dtype=np.int64))
            total += len(mask)
        edges = np.concatenate(([0], np.cumsum(np.concatenate(counts)))).astype(np.int64)
        return cls(bits=np.concatenate(bits), edges=edges, total=total)

    def __len__(self) -> int:
        return int(self.edges[-1])

    def mask(self, start: int, stop: int) -> NDArray[np.bool_]:
        """Which of the rows [start, stop) are kept; `start` is a multiple of 8."""
        part = np.unpackbits(self.bits[start // 8 : -(-stop // 8)])
        return part[: stop - start].view(np.bool_)

    def gathered(self, source: Column | Stamps, start: int, stop: int) -> _Floats:
        """Values [start, stop) of a column or of stamps, these rows alone."""
        stop = min(stop, len(self))
        if start >= stop:
            return np.zeros(0)
        first = int(np.searchsorted(self.edges, start, side="right")) - 1
        last = int(np.searchsorted(self.edges, stop, side="left"))
        a, b = first * _CHUNK, min(last * _CHUNK, self.total)
        offset = int(self.edges[first])
        return source.read(a, b)[self.mask(a, b)][start - offset : stop - offset]

    def of_column(self, column: Column) -> Column:
        """These rows of a column."""
        return ColumnOfRows(column, self)

    def of_time(self, time: TimeChoice) -> TimeChoice:
        """The time of these rows: seconds since the first stamp among them."""
        first = self._first(time.stamps)
        later = round(first * 1e9)
        return replace(
            time,
            stamps=StampsOfRows(time.stamps, self, first),
            start=None if time.start is None else time.start + later,
            first_ns=time.first_ns + later,
        )

    def _first(self, stamps: Stamps) -> float:
        for start in range(0, len(self), _CHUNK):
            block = self.gathered(stamps, start, start + _CHUNK)
            known = block[np.isfinite(block)]
            if len(known):
                return float(known[0])
        return 0.0
