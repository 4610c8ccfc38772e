# Specification: MathWorks, "MAT-File Format", chapter 1: version 5 (level 5) MAT-files; 7.3: see `matlab_hdf5`.
# SPDX-License-Identifier: BSD-3-Clause
"""MATLAB .mat files of version 5 to 7.3, read in a child process: a damaged one can kill its parser.

The sizes that the file declares, and what its compressed elements unpack to, are checked before the child
starts. Version 7.3 is HDF5 and needs h5py. A text table that is only called .mat is text, and goes there.
"""

from __future__ import annotations

import warnings
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError
from allanite.files.readers import matlab_hdf5
from allanite.files.readers.arrays import chosen_table, picked
from allanite.files.readers.matlab_objects import CELL, COMPLEX, STRUCTURES, said_of_objects
from allanite.files.readers.sandbox import run
from allanite.files.readers.spool import refuse_bomb
from allanite.files.readers.table import Options, Table
from allanite.plain_files.extras import require
from allanite.plain_files.limits import PARTS, refuse_more
from allanite.plain_files.regular_file import open_regular, regular

NAME: Final = "MATLAB"
OPTIONS: Final = frozenset({"variable"})

_HEADER = 128
_OBJECT = ("s0", "s1", "s2", "arr")  # what the library makes of an object: its name, system and class
_VERSION_73 = b"MATLAB 7.3"
_COMPRESSED = 15
_PIECE = 1 << 16
_SPARE_MEMORY = 256 << 20
_FEWER = "Save only the needed ones: save('log.mat', 't', 'x', '-v7')"


def sniff(head: bytes, path: Path) -> bool:
    """True for the header of version 5 and later (text, version, endian indicator)."""
    return len(head) >= _HEADER and head[126:128] in (b"IM", b"MI") and head[:6] == b"MATLAB"


def read(path: Path, options: Options) -> Table:
    """Read the numeric arrays of the greatest length, or the variable asked for.

    Raises
    ------
    FormatError
        A damaged file, or one that holds only objects.
    InputError
        No such variable, or none of numbers; version 7.3 without the extra `matlab`.
    LimitError
        It would unpack to far more than its size, or take too long.
    """
    with open_regular(path) as file:
        version73 = file.read(len(_VERSION_73)) == _VERSION_73
    faults, arrays = _version73(path) if version73 else _version5(path)
    variable, _ = picked(options.variable)
    if faults and (not _holds_samples(arrays) or variable in faults):
        listed_faults = [f"{k} {v}" for k, v in faults.items() if variable in (None, k)]
        raise FormatError(f"{path.name}: {'; '.join(listed_faults[:5])}")
    if not arrays:
        raise FormatError(
            f"{path.name}: no plain numeric array in it (objects and tables of MATLAB cannot be read); in MATLAB, "
            "save the samples as matrices: t = data.Time; x = data.Variables; save('log.mat', 't', 'x', '-v7')"
        )
    return chosen_table(arrays, options, path, NAME, [f"not read: {k} {v}" for k, v in faults.items()])


def _holds_samples(arrays: Mapping[str, NDArray[Any]]) -> bool:
    return any(a.dtype.kind in "iuf" and a.size > 1 for a in arrays.values())


_Found = tuple[Mapping[str, str], dict[str, NDArray[Any]]]


def _version5(path: Path) -> _Found:
    with open_regular(path) as file:
        unpacked = _unpacked_size(file, path)
    objects, arrays = run(
        f"{__name__}:arrays_in",
        [str(path)],
        imports=["scipy.io"],
        memory=_SPARE_MEMORY + 4 * unpacked,
        seconds=30 + unpacked / 1e7,
        name=path.name,
    )
    return said_of_objects(objects), arrays


def _version73(path: Path) -> _Found:
    require(
        "h5py",
        "matlab",
        f"{path.name} is a MATLAB file of version 7.3 (HDF5); reading it",
        otherwise="; or in MATLAB: load it, then save('log.mat', ..., '-v7')",
    )
    size = path.stat().st_size
    return run(
        f"{matlab_hdf5.__name__}:arrays_in",
        [str(path)],
        imports=["h5py"],
        memory=2 * _SPARE_MEMORY + 20 * size,
        seconds=30 + size / 5e6,
        name=path.name,
    )


def _unpacked_size(file: IO[bytes], path: Path) -> int:
    """Bytes that the elements of the file unpack to; refuses what cannot be read before a parser sees it."""
    header = file.read(_HEADER)
    order = "little" if header[126:128] == b"IM" else "big"
    size, total, at, variables = path.stat().st_size, 0, _HEADER, 0
    while at < size:
        variables += 1
        refuse_more(variables, PARTS, "variables", path.name, _FEWER)
        file.seek(at)
        tag = file.read(8)
        kind, length = int.from_bytes(tag[:4], order), int.from_bytes(tag[4:], order)  # type: ignore[arg-type]
        if len(tag) < 8 or at + 8 + length > size:
            raise FormatError(
                f"{path.name}: an element at byte {at} declares {length} bytes, but the file ends before "
                "that: it is truncated or damaged"
            )
        total += length
        if kind == _COMPRESSED:
            total += _inflated(file, length, path.name)
        at += 8 + length
    return total


def _inflated(file: IO[bytes], length: int, name: str) -> int:
    """Size of a compressed element; nothing of it is kept."""
    inflate, read, written = zlib.decompressobj(), 0, 0
    try:
        while read < length and not inflate.eof:
            piece = inflate.unconsumed_tail or file.read(min(_PIECE, length - read))
            if not piece:
                break
            out = inflate.decompress(piece, 1 << 20)
            read += len(piece) - len(inflate.unconsumed_tail)
            written += len(out)
            refuse_bomb(length, written, name)
    except zlib.error as error:
        raise FormatError(f"{name}: a compressed element is damaged ({error})") from None
    return written


# -- in the child ------------------------------------------------------------------------------------------


def arrays_in(path: str) -> tuple[dict[str, str], dict[str, NDArray[Any]]]:
    """What is not read by name and class, and every real numeric or text array, "structure.field" of structures."""
    from scipy.io import loadmat

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of several objects the library keeps one
        content = loadmat(regular(path), struct_as_record=True, chars_as_strings=True)
    objects = dict(map(_class_of, (v for v in content.values() if _is_object(v))))
    content = {k: v for k, v in content.items() if not _is_object(v)}
    arrays: dict[str, NDArray[Any]] = {}
    for name, array in _flat(content, 0):
        kind = _not_read(array)
        if kind:
            objects[name] = kind
            continue
        arrays[name] = array
        refuse_more(len(arrays), PARTS, "variables and fields", Path(path).name, _FEWER)
    return objects, arrays


def _is_object(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.names == _OBJECT


def _class_of(value: NDArray[Any]) -> tuple[str, str]:
    """Name of an object and of its class."""
    name, _, kind = (bytes(value.reshape(-1)[0][k]).decode("utf-8", "replace") for k in _OBJECT[:3])
    return name, kind


def _flat(content: Mapping[str, Any], depth: int) -> Iterator[tuple[str, NDArray[Any]]]:
    for name, value in content.items():
        if name.startswith("__") or not isinstance(value, np.ndarray):
            continue
        if value.dtype.names and value.size == 1 and depth < 3:
            record = value.reshape(-1)[0]
            inner = {f: record[f] for f in value.dtype.names}
            yield from ((f"{name}.{k}", v) for k, v in _flat(inner, depth + 1))
        elif value.dtype.kind in "iuf" and value.size:
            # MATLAB has no vectors: 1 x n and n x 1 are both lists of samples.
            yield name, value.reshape(-1) if value.ndim == 2 and 1 in value.shape else value
        elif value.dtype.kind in "SU":
            yield name, np.char.strip(value.reshape(-1))
        elif value.dtype.kind == "O" and value.size and depth < 3:  # a cell of words
            words = [str(c.reshape(-1)[0]) for c in value.reshape(-1) if getattr(c, "size", 0) == 1]
            if len(words) == value.size:
                yield name, np.array(words)
            else:
                yield name, value
        elif value.size > 1 and (value.dtype.names or value.dtype.kind == "c"):
            yield name, value


def _not_read(value: NDArray[Any]) -> str:
    """What an array is that may hold samples and is not read; "" for arrays that are."""
    if value.dtype.kind == "c":
        return COMPLEX
    if value.dtype.names:
        return STRUCTURES
    return CELL if value.dtype.kind == "O" else ""
