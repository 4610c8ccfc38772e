# SPDX-License-Identifier: BSD-3-Clause
"""Series as long as a record, as a picture needs them."""

from __future__ import annotations

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.result import Result
from allanite.recording.sample_columns import ArrayColumn

__all__ = ["POINTS", "SeriesEnvelope", "envelope", "instants"]

Array = NDArray[np.float64]

#: Points of a picture of a whole record.
POINTS = 1500


def instants(rows: int) -> tuple[int, int]:
    """First row and step of at most `POINTS` rows, evenly spread, that show a slow series."""
    step = max(1, -(-rows // POINTS))
    return step // 2, step


@dataclass(frozen=True, slots=True, kw_only=True)
class SeriesEnvelope(Result):
    """A long series as a picture needs it: at most 1500 blocks.

    Attributes
    ----------
    t : ndarray, shape (n_blocks,) [s]
        Middle of each block, since the first sample.
    low, high : ndarray, shape (n_blocks,) [SI]
        Lowest and highest value of each block; NaN where it holds nothing.
    """

    t: Array = field(repr=False)
    low: Array = field(repr=False)
    high: Array = field(repr=False)

    @classmethod
    def of(cls, rate: float, *parts: Array) -> SeriesEnvelope:
        """That of the sum of series of a rate [Hz]."""
        rows, low, high = envelope(*parts)
        return cls(t=rows / rate, low=low, high=high)


def envelope(*parts: Array) -> tuple[NDArray[np.float64], Array, Array]:
    """Centres [rows], lowest and highest value of at most `POINTS` blocks of a sum of series; NaN in an empty one."""
    columns, rows = [ArrayColumn(part) for part in parts], len(parts[0])  # their maps are not kept in memory
    size = max(1, -(-rows // POINTS))
    chunk = size * max(1, (1 << 18) // size)
    low, high = [], []
    for start in range(0, rows, chunk):
        part = np.sum([column.read(start, start + chunk) for column in columns], axis=0)
        edges = np.arange(0, len(part), size)
        low.append(np.fmin.reduceat(part, edges))
        high.append(np.fmax.reduceat(part, edges))
    blocks = -(-rows // size)
    centres = np.minimum((np.arange(blocks) + 0.5) * size, (np.arange(blocks) * size + rows) / 2)
    empty: Array = np.zeros(0)
    return centres, np.concatenate([empty, *low]), np.concatenate([empty, *high])
