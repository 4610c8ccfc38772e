# SPDX-License-Identifier: BSD-3-Clause
"""Numbers between Arrow and NumPy, by their buffers.

``pyarrow.array``, ``pyarrow.scalar``, ``to_numpy`` and ``numpy.asarray`` of an Arrow array import pandas wherever it is
installed, which takes longer than reading most logs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["arrow_of", "numbers_of", "whole_numbers_of"]


def numbers_of(array: pa.Array | pa.ChunkedArray, *, copy: bool = True) -> NDArray[Any]:
    """Numbers; those that are missing are NaN, and integers among them float64.

    Parameters
    ----------
    array : pyarrow.Array or pyarrow.ChunkedArray, shape (n,)
        Integers or floats of any width.
    copy : bool
        False: numbers of which none is missing may stay in the memory of the array, read-only.

    Returns
    -------
    ndarray, shape (n,)
        Of the type of the array; float64 for integers of which some are missing.

    Raises
    ------
    pyarrow.ArrowInvalid
        A buffer is shorter than the array says; it is a ValueError.
    """
    parts = _parts_of(array)
    if array.null_count == 0:
        return parts[-1] if len(parts) == 2 and not copy else np.concatenate(parts)
    values, missing = whole_numbers_of(array)
    values = values if values.dtype.kind == "f" else values.astype(np.float64)
    values[missing] = np.nan
    return values


def whole_numbers_of(array: pa.Array | pa.ChunkedArray) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Copy numbers in the type of the array, with a mask of those that are missing; their values mean nothing."""
    values = np.concatenate(_parts_of(array))
    return values, np.concatenate([np.zeros(0, bool), *map(_missing, _chunks(array))])


def _parts_of(array: pa.Array | pa.ChunkedArray) -> list[NDArray[Any]]:
    """An empty array of its type, and the numbers of each chunk in the memory of it."""
    array.validate()  # a file may state more values than its buffers hold
    dtype = np.dtype(array.type.to_pandas_dtype())
    return [np.zeros(0, dtype), *(_values(chunk, dtype) for chunk in _chunks(array))]


def _chunks(array: pa.Array | pa.ChunkedArray) -> list[pa.Array]:
    import pyarrow as pa

    return array.chunks if isinstance(array, pa.ChunkedArray) else [array]


def _values(chunk: pa.Array, dtype: np.dtype[Any]) -> NDArray[Any]:
    data = chunk.buffers()[1]
    if data is None or len(chunk) == 0:
        return np.zeros(len(chunk), dtype)
    return np.frombuffer(data, dtype, len(chunk), chunk.offset * dtype.itemsize)


def _missing(chunk: pa.Array) -> NDArray[np.bool_]:
    if chunk.null_count == 0:
        return np.zeros(len(chunk), bool)
    stop = chunk.offset + len(chunk)
    packed = np.frombuffer(chunk.buffers()[0], np.uint8, -(-stop // 8))
    valid: NDArray[np.uint8] = np.unpackbits(packed, count=stop, bitorder="little")
    return np.asarray(valid[chunk.offset :] == 0)


def arrow_of(values: NDArray[Any], missing: NDArray[np.bool_] | None = None) -> pa.Array:
    """Make an Arrow array of numbers; those under the mask are null.

    Parameters
    ----------
    values : ndarray, shape (n,)
        In the byte order of this machine.
    missing : ndarray of bool, shape (n,), or None
    """
    import pyarrow as pa

    valid = None if missing is None else pa.py_buffer(np.packbits(~missing, bitorder="little"))
    data = pa.py_buffer(np.ascontiguousarray(values))
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [valid, data])
