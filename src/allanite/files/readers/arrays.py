# SPDX-License-Identifier: BSD-3-Clause
"""From named arrays (.npz, .mat) to a Table: which arrays hold the samples, and what the small ones say.

The samples are all tables of the greatest length; scalars such as ``fs`` or ``dt`` state the rate, and lists of
words such as ``columns`` or ``units`` describe the columns.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.files.readers.headings import is_unit, may_be_time, read_heading, shared_unit
from allanite.files.readers.stated_rate import StatedRate, chosen_rate, keyed_statement
from allanite.files.readers.table import Options, Table
from allanite.plain_files.limits import COLUMNS, refuse_more
from allanite.recording.channel_names import for_shell
from allanite.recording.checked_samples import checked_samples
from allanite.recording.records import ArrayColumn

__all__ = [
    "Shape",
    "chosen_table",
    "left_out",
    "length_of",
    "one_record",
    "other_times",
    "picked",
    "samples_among",
    "table_of",
]

_SMALL = 4096  # elements; smaller arrays may describe the large ones
_MOST_ROWS, _LONGER = 64, 8  # of a matrix whose rows are channels: rows, and how many times longer they are

Shape = tuple[np.dtype[Any], tuple[int, ...]]
Index = tuple[slice | int, ...]

_AXES = ("x", "y", "z")
_INDEXED = re.compile(r"(.*?)\s*([\[(])([^\[\]()]*)[\])]")
_LABEL_NAMES = frozenset({"columns", "names", "channels", "labels", "header", "fields", "channel_names"})
_UNIT_NAMES = frozenset({"unit", "units"})


def samples_among(
    shapes: Mapping[str, Shape], variable: str | None, file: str, time: str | None = None
) -> list[str]:
    """Names of the arrays that hold the samples: the one asked for with its time, or all of one length.

    That length is the greatest one of an array that is not time, or that of the array which `time` names (see
    `allanite.files.readers.stated_time`): each array goes with the time of its own length.

    Raises
    ------
    InputError
        No such array, or none of numbers; the message lists what there is.
    """
    tables = {k: s for k, s in shapes.items() if s[0].kind in "iufMmV" and len(s[1]) in (1, 2)}
    if variable is not None:
        if variable not in shapes:
            raise InputError(f"{file}: no array {variable!r}; there are: {_listed(shapes)}")
        length = length_of(shapes[variable][1])
        times = [k for k, s in tables.items() if _may_be_time(k, time) and length_of(s[1]) == length]
        return [*(k for k in times if k != variable), variable]
    deep = next((k for k, s in shapes.items() if s[0].kind in "iuf" and len(s[1]) == 3), None)
    if not tables or (deep is not None and max(length_of(s[1]) for s in tables.values()) < 2):
        hint = (
            ""
            if deep is None
            else f"; choose a record of three dimensions: --variable {for_shell(f'{deep}[0]')} (variable= in Python)"
        )
        raise InputError(f"{file}: no array of samples; there are: {_listed(shapes) or 'none'}{hint}")
    named = [k for k in tables if time is not None and _named(k, time)]
    samples = [k for k in tables if not may_be_time(k)]
    longest = max(length_of(tables[k][1]) for k in (named or samples or tables))
    return [k for k, s in tables.items() if length_of(s[1]) == longest]


def _may_be_time(name: str, stated: str | None) -> bool:
    return may_be_time(name) or (stated is not None and _named(name, stated))


def _named(name: str, stated: str) -> bool:
    return stated == name or stated.startswith(f"{name}:")


def length_of(shape: Sequence[int]) -> int:
    """Samples of an array: along the first axis, or the second one where the rows are few."""
    return int(shape[1] if _in_rows(shape) else shape[0]) if shape else 0


def _in_rows(shape: Sequence[int]) -> bool:
    """True if the rows of a matrix are channels: few of them, and each far longer than they are many."""
    return len(shape) == 2 and shape[0] <= _MOST_ROWS and shape[1] >= _LONGER * max(shape[0], 1)


def other_times(shapes: Mapping[str, Shape], wanted: Sequence[str]) -> tuple[str, ...]:
    """A sentence about arrays that are called time and are longer or shorter than all samples that are read."""
    if any(may_be_time(k) for k in wanted):
        return ()
    lengths = {k: length_of(s[1]) for k, s in shapes.items() if may_be_time(k)}
    length = length_of(shapes[wanted[0]][1]) if wanted else 0
    return tuple(
        f"array {k} has {n} values, but there are {length} samples: it is not their time"
        for k, n in lengths.items()
        if n > 1
    )


def left_out(shapes: Mapping[str, Shape], wanted: Sequence[str]) -> tuple[str, ...]:
    """A sentence about tables that were not taken, if there are any: those of another length, and all others."""
    others = {k: s for k, s in shapes.items() if k not in wanted and _may_be_samples(k, s)}
    lengths = {length_of(shapes[k][1]) for k in wanted}
    unlike = {k: s for k, s in others.items() if length_of(s[1]) not in lengths}
    alike = {k: s for k, s in others.items() if k not in unlike}
    return tuple(
        f"{what} left out (variable= takes one of them): {_listed(tables)}"
        for what, tables in (("arrays of another length", unlike), ("arrays", alike))
        if tables
    )


def _may_be_samples(name: str, shape: Shape) -> bool:
    kind, size = shape[0].kind, shape[1]
    return kind in "iuf" and len(size) in (1, 2) and max(size) > 16 and not may_be_time(name)


def chosen_table(
    arrays: dict[str, NDArray[Any]],
    options: Options,
    path: Path | str,
    file_format: str,
    more: Sequence[str] = (),
) -> Table:
    """The table that the options choose among arrays in memory: a structure, an array, a record of one, or the longest.

    Raises
    ------
    InputError
        No such array or record, or no table of numbers.
    """
    variable, index = picked(options.variable)
    arrays, variable = _of_structure(arrays, variable)
    if index is not None and variable is not None:
        arrays = one_record(arrays, variable, index, _name_of(path))
    shapes = {k: (a.dtype, a.shape) for k, a in arrays.items()}
    wanted = samples_among(shapes, variable, _name_of(path), options.time)
    small = {k: a for k, a in arrays.items() if k not in wanted and a.size <= _SMALL}
    table = table_of(
        _plain_names({k: arrays[k] for k in wanted}),
        _plain_names(small),
        path,
        file_format,
        (*left_out(shapes, wanted), *other_times(shapes, wanted), *more),
    )
    texts = [
        k for k, (dtype, shape) in shapes.items() if dtype.kind in "USO" and shape == (len(table.columns[0]),)
    ]
    return replace(table, left_out=tuple(texts)) if table.columns else table


def _of_structure(
    arrays: dict[str, NDArray[Any]], variable: str | None
) -> tuple[dict[str, NDArray[Any]], str | None]:
    """If a structure is asked for, its fields, and of what is outside of all structures that describes them."""
    fields = {k: a for k, a in arrays.items() if variable is not None and k.startswith(f"{variable}.")}
    if not fields:
        return arrays, variable
    lengths = {length_of(a.shape) for a in fields.values()}
    inside = {k.rpartition(".")[2] for k in fields}
    describing = {
        k: a
        for k, a in arrays.items()
        if "." not in k
        and k not in inside
        and (a.size == 1 or (may_be_time(k) and length_of(a.shape) in lengths))
    }
    return {**fields, **describing}, None


def _plain_names(arrays: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Fields of a structure under their own name where that is unique: imu.fs states the rate as fs does."""
    short = [k.rpartition(".")[2] for k in arrays]
    return {k if short.count(s) > 1 else s: a for (k, a), s in zip(arrays.items(), short, strict=True)}


def picked(variable: str | None) -> tuple[str | None, Index | None]:
    """Name of an array, and which record of it is meant: data[0] as NumPy, data(:, :, 3) as MATLAB counts.

    Raises
    ------
    InputError
        An index that is none.
    """
    match = _INDEXED.fullmatch(variable.strip()) if variable is not None else None
    if variable is None or match is None:
        return variable, None
    name, bracket, inside = match.groups()
    parts = [part.strip() for part in inside.split(",")]
    if not all(part == ":" or part.isdecimal() for part in parts) or all(part == ":" for part in parts):
        raise InputError(f"{variable!r}: write the record as in data[0], data[:, :, 0], or data(:, :, 1)")
    first = 1 if bracket == "(" else 0
    if any(part.isdecimal() and int(part) < first for part in parts):
        raise InputError(f"{variable!r}: in parentheses records are counted from 1, as in MATLAB")
    return name, tuple(slice(None) if part == ":" else int(part) - first for part in parts)


def one_record(
    arrays: Mapping[str, NDArray[Any]], name: str, index: Index, file: str
) -> dict[str, NDArray[Any]]:
    """The arrays with one of them cut down to a record of it.

    Raises
    ------
    InputError
        No such array, or no such record, or one that is no table.
    """
    if name not in arrays:
        shapes = {k: (a.dtype, a.shape) for k, a in arrays.items()}
        raise InputError(f"{file}: no array {name!r}; there are: {_listed(shapes)}")
    array = arrays[name]
    called = f"array {name}" if name else "the array"
    try:
        record = array[index]
    except IndexError:
        raise InputError(f"{file}: {called} has shape {array.shape}: it has no such record") from None
    if not 1 <= record.ndim <= 2:
        raise InputError(
            f"{file}: {called} has shape {array.shape}, and the record that is named {record.shape}; "
            "samples must be a column or a table: give one index more or less"
        )
    return {**arrays, name: record}


def _listed(shapes: Mapping[str, Shape]) -> str:
    return ", ".join(f"{k} {dtype} {shape}" for k, (dtype, shape) in list(shapes.items())[:20])


def table_of(
    arrays: Mapping[str, NDArray[Any]],
    small: Mapping[str, NDArray[Any]],
    path: Path | str,
    file_format: str,
    guesses: tuple[str, ...] = (),
) -> Table:
    """The table of arrays of equal length.

    Parameters
    ----------
    arrays : mapping of name to ndarray, shape (n_samples,) or (n_samples, k)
        Or one-dimensional structured arrays. The name of a single unnamed array is "".
    small : mapping of name to ndarray
        Everything else in the file that is small: rate, labels, units.
    path : Path or str
        The file, or what arrays in memory are called in messages.

    Raises
    ------
    InputError
        An array that is no table of real numbers.
    """
    sideways = [k for k, a in arrays.items() if a.dtype.names is None and _in_rows(a.shape)]
    arrays = {k: a.T if k in sideways else a for k, a in arrays.items()}
    guesses += tuple(
        f"the rows of {k or 'the array'} are taken as channels: they are few and long" for k in sideways
    )
    width = sum(_numbers_in(a.dtype) * math.prod(a.shape[1:]) for a in arrays.values())
    refuse_more(
        width, COLUMNS, "columns", _name_of(path), "Save only the needed ones, or transpose the array"
    )
    labels = _words(small, _LABEL_NAMES)
    headings: list[str] = []
    columns: list[ArrayColumn] = []
    time_units: dict[int, str] = {}
    for name, array in arrays.items():
        for heading, column in _split(name, array, labels, len(arrays) == 1, _name_of(path)):
            if column.dtype.kind in "Mm":
                time_units[len(columns)] = "iso8601" if column.dtype.kind == "M" else "ns"
                column = column.astype(f"{column.dtype.kind}8[ns]").view(np.int64)
            headings.append(heading)
            columns.append(ArrayColumn(column))
    stated = _rate(small)
    units = _words(small, _UNIT_NAMES)
    if len(units) == 1 and is_unit(units[0]):
        remarks: list[str] = []
        units = [*shared_unit(units[0], headings, remarks)]
        guesses += tuple(remarks)
    elif len(units) == 1:
        units = units * len(columns)
    return Table(
        format=file_format,
        headings=tuple(headings),
        columns=tuple(columns),
        units=tuple(units) if len(units) == len(columns) else (),
        units_from="metadata" if units and len(units) == len(columns) else "none",
        time_units=time_units,
        rate=stated.rate,
        rate_from=stated.where,
        rate_doubt=stated.doubt,
        source={**_facts_of(path), "variables": [k for k in arrays if k]},
        guesses=(*guesses, *stated.guesses),
    )


def _name_of(path: Path | str) -> str:
    return path.name if isinstance(path, Path) else path


def _facts_of(path: Path | str) -> dict[str, Any]:
    return {"size_bytes": path.stat().st_size} if isinstance(path, Path) else {}


def _split(
    name: str, array: NDArray[Any], labels: list[str], alone: bool, file: str
) -> Iterator[tuple[str, NDArray[Any]]]:
    """Pairs of heading and column: fields of a structured array, columns of a table."""
    if _is_time(array):
        yield name or "time", array
        return
    try:
        if array.dtype.names:
            for heading, field in _fields(array):
                if _is_time(field):
                    yield heading, field
                    continue
                table = checked_samples(field.reshape(len(field), -1))
                yield from zip(_headings(heading, table.shape[1], [], False), table.T, strict=True)
            return
        table = checked_samples(array)
    except (InputError, IndexError) as error:
        raise InputError(f"{file}{':' if name else ''}{name}: {error}") from None
    yield from zip(_headings(name, table.shape[1], labels, alone), table.T, strict=True)


def _is_time(array: NDArray[Any]) -> bool:
    """Moments or durations of NumPy."""
    return array.dtype.kind in "Mm" and array.ndim == 1


def _fields(array: NDArray[Any]) -> Iterator[tuple[str, NDArray[Any]]]:
    """Name and numbers of each field of a structured array, those of fields in fields, too."""
    for name in array.dtype.names or ():
        if array[name].dtype.names:
            yield from ((f"{name}_{inner}", values) for inner, values in _fields(array[name]))
        else:
            yield name, array[name]


def _numbers_in(dtype: np.dtype[Any]) -> int:
    """Numbers in one sample of a type: a field may hold several, or fields of its own."""
    base, shape = dtype.subdtype or (dtype, ())
    inside = sum(_numbers_in(base[name]) for name in base.names) if base.names else 1
    return inside * math.prod(shape)


def _headings(name: str, count: int, labels: list[str], alone: bool) -> Sequence[str]:
    """Headings of the columns of one array: its labels, x y z of a triad, or numbers."""
    heading = read_heading(name)
    if len(labels) == count and (alone or count > 1):
        return labels
    if count == 1:
        return [name]
    if alone and heading.group == "":  # a table of anything: its name is not that of a quantity
        return [""] * count
    unit = f" ({heading.unit})" if heading.unit else ""
    ends = _AXES if count == 3 else tuple(map(str, range(count)))
    return [f"{heading.name}_{end}{unit}" for end in ends]


def _words(small: Mapping[str, NDArray[Any]], names: frozenset[str]) -> list[str]:
    for key, array in small.items():
        if key.lower() in names and array.dtype.kind in "US" and array.ndim <= 1:
            return [
                w.decode("utf-8", "replace") if isinstance(w, bytes) else str(w) for w in np.atleast_1d(array)
            ]
    return []


def _rate(small: Mapping[str, NDArray[Any]]) -> StatedRate:
    numbers = {k: float(a.reshape(())) for k, a in small.items() if a.size == 1 and a.dtype.kind in "iuf"}
    return chosen_rate(keyed_statement(key, value, "array") for key, value in numbers.items())
