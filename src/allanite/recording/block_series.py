# SPDX-License-Identifier: BSD-3-Clause
"""Series as long as a record: in memory while they are short, else in an unnamed temporary file that is mapped."""

from __future__ import annotations

from collections.abc import Callable
from typing import IO

import numpy as np
from numpy.typing import NDArray

from allanite.errors import StorageError
from allanite.recording.records import BLOCK
from allanite.recording.sample_columns import ArrayColumn

__all__ = ["IN_MEMORY", "BlockSeries", "made_by_blocks", "no_room", "temporary_file"]

Array = NDArray[np.float64]

#: Bytes of one series before it goes to a file.
IN_MEMORY = 64 << 20


def temporary_file() -> IO[bytes]:
    """An unnamed file, which the caller closes.

    Raises
    ------
    StorageError
        No folder for it, or its disk is full.
    """
    import tempfile

    try:
        return tempfile.TemporaryFile(prefix="allanite-")
    except OSError as error:
        raise no_room(error) from None


def no_room(error: OSError) -> StorageError:
    """What to do where a temporary file cannot be written."""
    import tempfile

    place = tempfile.tempdir or "any folder"
    return StorageError(
        f"temporary file in {place}: {error.strerror}; free some space, or set TMPDIR to a larger disk"
    )


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
                self._file = temporary_file()
            self._file.seek(8 * start)
            self._file.write(np.ascontiguousarray(values).data)
        except OSError as error:
            raise no_room(error) from None

    def finish(self) -> Array:
        """The whole series, read-only."""
        if self._file is not None:
            self._file.flush()
            self._array = np.memmap(self._file, dtype=np.float64, mode="r", shape=(self._rows,))
            self._file.close()
        assert self._array is not None  # noqa: S101  (rows were written)
        self._array.flags.writeable = False
        return self._array


def made_by_blocks(make: Callable[..., Array], *parts: Array) -> Array:
    """A series whose every value is made of those of others at its place.

    Examples
    --------
    >>> made_by_blocks(np.subtract, np.array([3.0, 5.0]), np.array([1.0, 1.0])).tolist()
    [2.0, 4.0]
    """
    columns, rows = [ArrayColumn(part) for part in parts], len(parts[0])  # their maps are not kept in memory
    made = BlockSeries(rows)
    for start in range(0, rows, BLOCK):
        made.put(start, make(*(column.read(start, start + BLOCK) for column in columns)))
    return made.finish()
