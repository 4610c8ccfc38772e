# Specification: NumPy enhancement proposal 1 and numpy.lib.format (.npy 1.0 to 3.0); .npz is a zip of .npy files.
# SPDX-License-Identifier: BSD-3-Clause
"""NumPy .npy and .npz files, memory-mapped.

This reader is the example to imitate. A reader is one module with four facts about its format and one
function, and one line in the registry of `allanite.files.readers`:

* line 1 cites the specification;
* ``NAME`` names the format in messages;
* ``OPTIONS`` are the options of `allanite.files.readers.read` that mean something here, beyond those that all formats
  share;
* ``sniff(head, path)`` says from the content, never from the suffix, whether a file is ours;
* ``read(path, options)`` returns a `Table`: columns as they stand in the file and what the file says about them.
  What is time, what is a channel, which unit applies and where the samples lie on the grid is decided in
  `allanite.files.readers.assembly`, once for all formats.

A reader trusts nothing: sizes are compared with the file before memory is spent, and nothing in a file is ever
executed. Heavy imports stand inside functions.
"""

from __future__ import annotations

import ast
import math
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import AllaniteError, FormatError, InputError
from allanite.files.readers.arrays import left_out, one_record, other_times, picked, samples_among, table_of
from allanite.files.readers.spool import ZIP_ERRORS, refuse_bomb, to_file
from allanite.files.readers.table import Options, Table
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.limits import COLUMNS, PARTS, refuse_more
from allanite.plain_files.regular_file import open_regular, regular

NAME: Final = "NumPy"
OPTIONS: Final = frozenset({"variable"})

_MAGIC = b"\x93NUMPY"
_ZIP = b"PK\x03\x04"
_LONGEST_HEADER = 16384
_MOST_DIMENSIONS = 32
#: What the header of an array makes Python and NumPy raise that is none.
_UNREADABLE = (
    ValueError,
    SyntaxError,
    TypeError,
    LookupError,
    AttributeError,
    ArithmeticError,
    MemoryError,
    RecursionError,
)
_PIECE = 1 << 20


def sniff(head: bytes, path: Path) -> bool:
    """True for the magic string of .npy, and for a zip whose members are .npy files."""
    if head.startswith(_MAGIC):
        return True
    if not head.startswith(_ZIP):
        return False
    try:
        with zipfile.ZipFile(regular(path)) as archive:
            return any(name.endswith(".npy") for name in archive.namelist())
    except ZIP_ERRORS:
        return path.suffix.lower() == ".npz"  # a broken one: `read` says what is wrong


def read(path: Path, options: Options) -> Table:
    """Read an array, or the arrays of an archive that are equally long.

    Raises
    ------
    FormatError
        A header that does not fit the file, a pickle, a broken zip.
    InputError
        An array that is no table of samples, or several that could be meant.
    LimitError
        A member that unpacks to far more than its size.
    """
    with open_regular(path) as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            return _read_archive(path, options)
        name, index = picked(options.variable)
        if name or (index is None and name is not None):
            raise InputError(
                f"{path.name} is a single array: variable={options.variable!r} does not apply to it; a "
                "record of three dimensions is '[0]' or '[:, :, 0]'"
            )
        file.seek(0)
        array = _mapped(file, _read_header(file, path.name), path.stat().st_size, path.name)
    arrays = {"": array}
    if index is not None:
        arrays = one_record(arrays, "", index, path.name)
    elif array.ndim == 3:
        raise InputError(
            f"{path.name}: an array of shape {array.shape}: choose a record, --variable '[0]' or --variable "
            "'[:, :, 0]' (variable= in Python)"
        )
    return table_of(arrays, {}, path, NAME)


# -- .npy ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Header:
    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    fortran: bool
    offset: int  # of the first sample, from the beginning of the .npy

    @property
    def n_bytes(self) -> int:
        return math.prod(self.shape) * self.dtype.itemsize


def _read_header(file: IO[bytes], name: str) -> _Header:
    magic = file.read(len(_MAGIC) + 2)
    if len(magic) < 8 or not magic.startswith(_MAGIC) or magic[6] not in (1, 2, 3):
        raise FormatError(f"{name}: this is not a .npy file of version 1 to 3")
    width = 2 if magic[6] == 1 else 4
    length = int.from_bytes(file.read(width), "little")
    if length > _LONGEST_HEADER:
        raise FormatError(f"{name}: a header of {length} bytes; an array of samples needs about 100")
    text = file.read(length).decode("utf-8" if magic[6] == 3 else "latin-1", errors="replace")
    try:
        header = ast.literal_eval(text)
        descr, fortran, shape = header["descr"], header["fortran_order"], header["shape"]
        dtype = np.lib.format.descr_to_dtype(descr)
        sound = isinstance(shape, tuple) and all(type(n) is int and 0 <= n < 1 << 63 for n in shape)
    except _UNREADABLE as error:
        raise FormatError(f"{name}: the .npy header cannot be read ({type(error).__name__})") from None
    if not sound or len(header) != 3 or not isinstance(fortran, bool):
        raise FormatError(f"{name}: the .npy header is damaged (its shape, or the text after it)")
    if len(shape) > _MOST_DIMENSIONS:
        raise FormatError(f"{name}: an array of {len(shape)} dimensions; samples have one or two")
    if dtype.hasobject:
        raise FormatError(
            f"{name}: holds a pickle (dtype object), which can run code and is never opened; save numbers with "
            "np.save(..., array.astype(float))"
        )
    return _Header(dtype, shape, fortran, 8 + width + length)


def _mapped(file: IO[bytes], header: _Header, size: int, name: str, at: int = 0) -> NDArray[Any]:
    """Memory map of the array that begins at byte `at` and whose .npy is `size` bytes long."""
    spare = size - header.offset - header.n_bytes
    if spare:
        raise FormatError(
            f"{name}: the header declares shape {header.shape} of {header.dtype} ({header.n_bytes} bytes), but "
            + (
                f"{spare} bytes follow after it"
                if spare > 0
                else f"{-spare} bytes are missing: the file is truncated"
            )
        )
    if header.n_bytes == 0:  # a length beyond that of any array may stand beside one of zero
        return np.zeros([min(n, COLUMNS) for n in header.shape], dtype=header.dtype)
    order: Any = "F" if header.fortran else "C"
    return np.memmap(
        file, dtype=header.dtype, mode="r", offset=at + header.offset, shape=header.shape or (1,), order=order
    ).reshape(header.shape, order=order)


# -- .npz ----------------------------------------------------------------------------------------------------


def _read_archive(path: Path, options: Options) -> Table:
    try:
        with zipfile.ZipFile(regular(path)) as archive:
            refuse_more(len(archive.namelist()), PARTS, "arrays", path.name, "Save fewer in one file")
            members = {
                i.filename.removesuffix(".npy"): i for i in archive.infolist() if i.filename.endswith(".npy")
            }
            for member in members.values():
                refuse_bomb(member.compress_size, member.file_size, f"{path.name}:{member.filename}")
            headers = {k: _member_header(archive, m, path.name) for k, m in members.items()}
            name, index = picked(options.variable)
            shapes = {k: (h.dtype, h.shape) for k, h in headers.items()}
            record: dict[str, NDArray[Any]] = {}
            if index is not None and name is not None:
                whole = {name: _member(archive, members[name], path)} if name in members else {}
                record = one_record(whole, name, index, path.name)
                shapes[name] = (record[name].dtype, record[name].shape)
            wanted = samples_among(shapes, name, path.name, options.time)
            small = {
                k: _member(archive, m, path)
                for k, m in members.items()
                if k not in wanted and m.file_size < _PIECE
            }
            arrays = {k: record[k] if k in record else _member(archive, members[k], path) for k in wanted}
    except AllaniteError:  # some of them are errors of a value, too
        raise
    except ZIP_ERRORS as error:
        raise FormatError(f"{path.name}: broken or unsupported zip archive ({error})") from None
    return table_of(arrays, small, path, NAME, (*left_out(shapes, wanted), *other_times(shapes, wanted)))


def _member_header(archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str) -> _Header:
    with archive.open(member) as file:
        return _read_header(file, f"{name}:{member.filename}")


def _member(archive: zipfile.ZipFile, member: zipfile.ZipInfo, path: Path) -> NDArray[Any]:
    """One array: mapped where it lies in the archive if it is stored plainly, else from a temporary file."""
    name = f"{path.name}:{member.filename}"
    if member.compress_type == zipfile.ZIP_STORED:
        with open_regular(path) as file:
            file.seek(member.header_offset + 26)
            lengths = file.read(4)
            at = (
                member.header_offset
                + 30
                + int.from_bytes(lengths[:2], "little")
                + int.from_bytes(lengths[2:], "little")
            )
            file.seek(at)
            header = _read_header(file, name)
            if at + member.file_size > path.stat().st_size:
                raise FormatError(f"{name}: the archive is truncated")
            return _mapped(file, header, member.file_size, name, at)
    with to_file(_unpacked(archive, member, name)) as file:
        return _mapped(file, _read_header(file, name), member.file_size, name)


def _unpacked(archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str) -> Iterator[bytes]:
    written = 0
    with archive.open(member) as file:
        while piece := file.read(_PIECE):
            written += len(piece)
            refuse_bomb(member.compress_size, written, name)
            yield piece
