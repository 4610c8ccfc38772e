# Specification: R Internals, section 1.8 "Serialization Formats" (versions 2 and 3), as saved by save() and saveRDS().
# SPDX-License-Identifier: BSD-3-Clause
"""R data, .rda (.RData) and .rds, through rdata, in a child process: nothing in the file is ever run as R.

Read are vectors, matrices, data frames (tibbles, data.table) and lists of them; dates and times of class POSIXct are
time. Objects of class imu (package simts) state their rate. Missing values (NA) are gaps.
"""

from __future__ import annotations

import bz2
import lzma
import warnings
import zlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError
from allanite.files.readers.arrays import chosen_table
from allanite.files.readers.sandbox import run
from allanite.files.readers.spool import refuse_bomb
from allanite.files.readers.table import Options, Table
from allanite.plain_files.extras import require
from allanite.plain_files.limits import PARTS, refuse_more
from allanite.plain_files.regular_file import open_regular

NAME: Final = "R"
OPTIONS: Final = frozenset({"variable"})

_BEGINNINGS: Final = (b"RDX2\n", b"RDX3\n", b"RDA2\n", b"RDA3\n", b"X\n\0\0\0", b"A\n2\n", b"A\n3\n")
_SPARE_MEMORY: Final = 1 << 30
_PIECE: Final = 1 << 20
_DEEPEST: Final = 3

Arrays = dict[str, NDArray[Any]]


def sniff(head: bytes, path: Path) -> bool:
    """True for the beginnings of serialized R objects, also packed with gzip, bzip2 or xz."""
    if head.startswith(b"BZh"):  # a block gives nothing before it is whole
        with open_regular(path) as file:
            head = file.read(_PIECE)
    return _unpacked_head(head).startswith(_BEGINNINGS)


def _unpacked_head(head: bytes) -> bytes:
    try:
        return _unpacker(head)(head)[:16]
    except (OSError, EOFError, ValueError, lzma.LZMAError, zlib.error):
        return b""


def _unpacker(head: bytes) -> Callable[[bytes], bytes]:
    """What unpacks a stream piece by piece."""
    if head.startswith(b"\x1f\x8b"):
        return zlib.decompressobj(31).decompress
    if head.startswith(b"BZh"):
        return bz2.BZ2Decompressor().decompress
    if head.startswith(b"\xfd7zXZ"):
        return lzma.LZMADecompressor().decompress
    return bytes


def read(path: Path, options: Options) -> Table:
    """Read the columns of the greatest length, or those of the object asked for.

    Raises
    ------
    FormatError
        A damaged file, or one of a class that holds no plain numbers.
    InputError
        No such object, or none of numbers; the extra `r` is not installed.
    LimitError
        It would unpack to far more than its size, or take too long.
    """
    require(
        "rdata",
        "r",
        f"{path.name} is a file of R; reading it",
        otherwise='; or in R: write.csv(log, "log.csv", row.names = FALSE)',
    )
    unpacked = _unpacked_size(path)
    facts, by_number = run(
        f"{__name__}:arrays_in",
        [str(path)],
        imports=["rdata"],
        memory=_SPARE_MEMORY + 12 * unpacked,
        seconds=60 + unpacked / 1e6,
        name=path.name,
    )
    arrays: Arrays = {facts["names"][key]: array for key, array in by_number.items()}
    if not arrays:
        raise FormatError(
            f"{path.name}: no vector, matrix or data frame of numbers in it; in R, write the samples as a table: "
            'write.csv(log, "log.csv", row.names = FALSE)'
        )
    return chosen_table(arrays, options, path, NAME)


def _unpacked_size(path: Path) -> int:
    """Bytes that the file unpacks to; nothing of it is kept."""
    size, written = path.stat().st_size, 0
    with open_regular(path) as file:
        piece = file.read(_PIECE)
        unpack = _unpacker(piece)
        try:
            while piece:
                for at in range(0, len(piece), 1 << 12):  # a small piece cannot unpack to much
                    written += len(unpack(piece[at : at + (1 << 12)]))
                    refuse_bomb(size, written, path.name)
                piece = file.read(_PIECE)
        except EOFError:
            pass  # what follows the end of the packed stream is not read
        except (OSError, ValueError, lzma.LZMAError, zlib.error) as error:
            raise FormatError(f"{path.name}: the packed data are damaged ({error})") from None
    return written


# -- in the child ------------------------------------------------------------------------------------------


def arrays_in(path: str) -> tuple[dict[str, Any], Arrays]:
    """Numeric, time and word arrays of a file by number, and their names; columns of a frame as "frame.column"."""
    from rdata.conversion import convert
    from rdata.parser import parse_data

    with open_regular(path) as file:
        content = file.read()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of classes that it does not know: their numbers are read
        parsed = parse_data(content, expand_altrep=True)
        plain = convert(parsed, constructor_dict=_CLASSES, default_encoding="utf-8")
    names: dict[str, str] = {}
    arrays: Arrays = {}
    for name, array in _flat("", plain, 0):
        key = f"a{len(names)}"
        names[key], arrays[key] = name, array
        refuse_more(len(names), PARTS, "objects and columns", Path(path).name, "Save only the needed ones")
    return {"names": names}, arrays


def _times(values: Any, attributes: Mapping[str, Any]) -> Any:
    """POSIXct: seconds since 1970."""
    seconds = np.asarray(values, dtype=np.float64)
    whole = np.floor(seconds)
    known = np.isfinite(seconds) & (np.abs(seconds) < 9e9)
    stamps = np.full(seconds.shape, np.datetime64("NaT"), dtype="datetime64[ns]")
    stamps[known] = (whole[known] * 1e9).astype(np.int64).astype("datetime64[ns]")
    stamps[known] += np.round((seconds - whole)[known] * 1e9).astype("timedelta64[ns]")
    return stamps


def _words(values: Any, attributes: Mapping[str, Any]) -> Any:
    """A factor: its levels."""
    levels = np.append(np.asarray(attributes["levels"], dtype=str), "")
    codes = np.ma.filled(np.ma.asarray(values), 0).astype(np.int64)
    return levels[np.where((codes > 0) & (codes < len(levels)), codes, 0) - 1]


def _imu(values: Any, attributes: Mapping[str, Any]) -> Any:
    """An imu of simts: a matrix, its rate, and names of sensors and axes."""
    members: dict[str, Any] = {"imu": _bare(values)}
    if "freq" in attributes:
        members["fs"] = np.asarray(attributes["freq"], dtype=np.float64)
    sensors, axes = (np.atleast_1d(attributes.get(k, [])).astype(str) for k in ("sensor", "axis"))
    count = members["imu"].shape[-1] if np.ndim(members["imu"]) == 2 else 1
    if len(sensors) == len(axes) == count:
        members["columns"] = np.array([f"{s}_{a}" for s, a in zip(sensors, axes, strict=True)])
    return members


_CLASSES: Final[dict[str | bytes, Any]] = {
    "POSIXct": _times,
    "factor": _words,
    "ordered": _words,
    "imu": _imu,
}


def _flat(name: str, value: Any, depth: int) -> Iterator[tuple[str, NDArray[Any]]]:
    if isinstance(value, Mapping) and depth < _DEEPEST:
        for key, one in value.items():
            yield from _flat(f"{name}.{key}" if name else str(key), one, depth + 1)
        return
    columns = _named_columns(value)
    if columns is not None:
        yield f"{name}.columns" if name else "columns", columns
    array = _bare(value)
    if array is not None:
        yield name, array


def _named_columns(value: Any) -> NDArray[Any] | None:
    """Names of the columns of a matrix that has them."""
    coordinates = getattr(value, "coords", None)
    dims: Any = getattr(value, "dims", ())
    if coordinates is None or len(dims) != 2 or dims[1] not in coordinates:
        return None
    return np.asarray(coordinates[dims[1]].values).astype(str)


def _bare(value: Any) -> Any:
    """A plain array of numbers, times or words; None of anything else. Masked values (NA) are NaN."""
    if isinstance(value, (dict, list, type(None))):
        return None
    array = getattr(value, "values", value) if hasattr(value, "dims") else value
    if isinstance(array, np.ma.MaskedArray):
        array = np.ma.filled(array.astype(np.float64), np.nan) if array.mask.any() else array.data
    array = np.asarray(array)
    if array.dtype.kind == "O" and all(
        isinstance(w, (str, bytes, type(None))) for w in array.reshape(-1)[:100]
    ):
        array = array.astype(str)
    if array.dtype.kind == "b":
        array = array.astype(np.uint8)
    if array.dtype.kind not in "iufMU" or array.size == 0:
        return None
    return array.reshape(-1) if array.ndim == 0 else array
