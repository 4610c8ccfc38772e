# SPDX-License-Identifier: BSD-3-Clause
"""Decompressed bytes and growing columns go to an unnamed temporary file, so that memory stays small.

A file that unpacks to far more than its own size is a bomb: it is refused while it unpacks, after at most
`BOMB_BYTES`.
"""

from __future__ import annotations

import struct
import zipfile
import zlib
from collections.abc import Iterable, Sequence
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import LimitError
from allanite.recording.block_series import no_room, temporary_file
from allanite.recording.sample_columns import ArrayColumn, Calculated, Column

__all__ = ["BOMB_BYTES", "BOMB_RATIO", "ZIP_ERRORS", "GrowingColumn", "refuse_bomb", "to_file"]

#: Unpacking more than this [bytes] at more than this ratio is refused. Logs of sensors pack 2- to 30-fold.
BOMB_BYTES = 32 << 20
BOMB_RATIO = 200
_IN_MEMORY = 256 << 20  # bytes of one column before it moves to a file
_SMALL = 4 << 20  # bytes of a column that is put together, not kept in pieces
#: How the standard library refuses an archive: broken, of an unknown version or packing, with a password, with names
#: that are no text.
ZIP_ERRORS = (
    zipfile.BadZipFile,
    zipfile.LargeZipFile,
    zlib.error,
    struct.error,
    NotImplementedError,
    EOFError,
    OSError,
    RuntimeError,
    ValueError,
    OverflowError,
)


def refuse_bomb(packed: int, unpacked: int, name: str) -> None:
    """Raise if `packed` bytes have become (or are declared to become) too many.

    Raises
    ------
    LimitError
    """
    if unpacked > BOMB_BYTES and unpacked > BOMB_RATIO * max(packed, 1):
        raise LimitError(
            f"{name}: {packed} bytes unpack to more than {unpacked >> 20} MiB, {BOMB_RATIO} times their size: refused "
            "as a decompression bomb. If you trust the file, unpack it yourself and read the result"
        )


def to_file(pieces: Iterable[bytes], file: IO[bytes] | None = None) -> IO[bytes]:
    """The pieces in an unnamed temporary file (a new one, or at the end of the one given).

    Raises
    ------
    StorageError
        The disk is full.
    """
    made = file is None
    file = file or temporary_file()
    try:
        file.seek(0, 2)
        for piece in pieces:
            file.write(piece)
        file.flush()
    except BaseException as error:
        if made:
            file.close()
        if isinstance(error, OSError):
            raise no_room(error) from None
        raise
    file.seek(0)
    return file


class _Pieces(Calculated):
    """A column of floats in the pieces in which it grew: putting them together would take their memory twice."""

    __slots__ = ("_dtype", "_edges", "_pieces")

    def __init__(self, pieces: Sequence[NDArray[Any]], dtype: np.dtype[Any]) -> None:
        self._pieces, self._dtype = tuple(pieces), dtype
        self._edges = np.concatenate(([0], np.cumsum([len(p) for p in pieces]))).astype(np.int64)

    @property
    def dtype(self) -> np.dtype[Any]:
        return self._dtype

    def __len__(self) -> int:
        return int(self._edges[-1])

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        stop = min(stop, len(self))
        first = int(np.searchsorted(self._edges, start, side="right")) - 1
        last = int(np.searchsorted(self._edges, stop, side="left"))
        parts = [
            piece[max(start - edge, 0) : max(stop - edge, 0)]
            for piece, edge in zip(self._pieces[first:last], self._edges[first:last].tolist(), strict=True)
        ]
        if len(parts) == 1:
            return np.asarray(parts[0], dtype=np.float64)
        return np.concatenate([p.astype(np.float64, copy=False) for p in parts] or [np.zeros(0)])


class GrowingColumn:
    """A column that is built piece by piece: int64 as long as all pieces are, else float64; or of a given type.

    Up to 256 MiB it stays in memory; then it moves to a temporary file that is mapped at the end.

    Parameters
    ----------
    dtype : dtype, optional
        Type of all samples, where it is known beforehand.
    beside : int
        Columns that grow at the same time: together they stay below twice the memory of one.
    """

    def __init__(self, dtype: np.dtype[Any] | None = None, *, beside: int = 1) -> None:
        self._in_memory = min(_IN_MEMORY, 2 * _IN_MEMORY // max(beside, 1))
        self._pieces: list[NDArray[Any]] = []
        self._bytes = 0
        self._file: IO[bytes] | None = None
        self._given = dtype is not None
        self._dtype: np.dtype[Any] = np.dtype(np.int64) if dtype is None else dtype

    def append(self, piece: NDArray[Any]) -> None:
        """Add samples: int64 or float64, or of the given type."""
        if not self._given and piece.dtype.kind == "f" and self._dtype.kind == "i":
            self._to_float()
        self._pieces.append(piece)
        self._bytes += piece.nbytes
        if self._bytes > self._in_memory:
            self._spill()

    def finish(self) -> Column:
        """The column; nothing may be appended after this."""
        if self._file is not None or self._bytes < _SMALL or self._dtype.kind != "f":
            return ArrayColumn(self.finish_array())
        pieces, self._pieces = self._pieces, []
        return _Pieces(pieces, self._dtype)

    def finish_array(self) -> NDArray[Any]:
        """The samples as an array or a memory map; nothing may be appended after this."""
        if self._file is None:
            whole = np.concatenate(self._pieces) if self._pieces else np.zeros(0)
            self._pieces = []
            return whole.astype(self._dtype, copy=False)
        self._spill()
        mapped = np.memmap(self._file, dtype=self._dtype, mode="r")
        self._file.close()
        return mapped

    def _spill(self) -> None:
        pieces = (np.ascontiguousarray(p, dtype=self._dtype).tobytes() for p in self._pieces)
        self._file = to_file(pieces, self._file)
        self._pieces, self._bytes = [], 0

    def _to_float(self) -> None:
        self._dtype = np.dtype(np.float64)
        if self._file is not None and self._file.seek(0, 2):
            mapped = np.memmap(self._file, dtype=np.int64, mode="r+")
            for a in range(0, len(mapped), 1 << 20):  # same width: converted in place
                part = mapped[a : a + (1 << 20)]
                part[:] = part.astype(np.float64).view(np.int64)
            mapped.flush()
