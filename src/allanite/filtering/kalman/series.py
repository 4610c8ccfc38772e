# SPDX-License-Identifier: BSD-3-Clause
"""Series as long as a record: in memory while they are short, else in an unnamed temporary file that is mapped."""

from __future__ import annotations

import tempfile
from dataclasses import field
from typing import IO

import numpy as np
from numpy.typing import NDArray

from allanite.errors import StorageError
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.result import Result
from allanite.recording.sample_columns import ArrayColumn

__all__ = ["IN_MEMORY", "POINTS", "BlockSeries", "SeriesEnvelope", "envelope", "instants"]

Array = NDArray[np.float64]

#: Bytes of one series before it goes to a file.
IN_MEMORY = 64 << 20
#: Points of a picture of a whole record.
POINTS = 1500


class BlockSeries:
    """A series that is written block by block, in any order, and read as one array.

    Parameters
    ----------
    rows : int
    """

    def __init__(self, rows: int) -> None:
        self._rows = rows
        self._array: Array | None = np.empty(rows) if 8 * rows <= IN_MEMORY else None
        self._file: IO[bytes] | None = None

    def put(self, start: int, values: Array) -> None:
        """Write rows from `start` on.

        Raises
        ------
        StorageError
            The disk is full.
        """
        if self._array is not None:
            self._array[start : start + len(values)] = values
            return
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(prefix="allanite-")  # noqa: SIM115  (finish closes it)
            self._file.seek(8 * start)
            self._file.write(np.ascontiguousarray(values).data)
        except OSError as error:
            raise StorageError(
                f"temporary file in {tempfile.gettempdir()}: {error.strerror}; free some space, or set TMPDIR to a "
                "larger disk"
            ) from None

    def finish(self) -> Array:
        """The whole series, read-only."""
        if self._file is not None:
            self._file.flush()
            self._array = np.memmap(self._file, dtype=np.float64, mode="r", shape=(self._rows,))
            self._file.close()
        assert self._array is not None  # noqa: S101  (rows were written)
        self._array.flags.writeable = False
        return self._array


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
