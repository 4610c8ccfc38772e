# Specification: Apache Parquet format 2.x (PAR1) and Arrow columnar format 1.x (IPC file, IPC stream, Feather).
# SPDX-License-Identifier: BSD-3-Clause
"""Parquet, Arrow IPC and Feather files; columns are decoded group by group, so a file may exceed memory.

Units are taken from a field's metadata (key ``unit``) or its name, the rate from the file's metadata (``rate``,
``sample_rate``, ``fs``). `write` stores a Recording so that reading it gives the same recording back.
"""

from __future__ import annotations

import json
import math
import threading
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import AllaniteError, FormatError, InputError, LimitError, StorageError
from allanite.files.readers.nested_columns import Decode, NumberColumn, number_columns
from allanite.files.readers.table import Options, Table
from allanite.plain_files.arrow_numbers import arrow_of, numbers_of, whole_numbers_of
from allanite.plain_files.json_values import parse_plain
from allanite.plain_files.limits import COLUMNS, PIECES, refuse_more
from allanite.plain_files.regular_file import open_regular, regular
from allanite.recording.records import BLOCK, Channel, Column, Recording

if TYPE_CHECKING:
    import pyarrow as pa

NAME: Final = "Parquet or Arrow"
OPTIONS: Final[frozenset[str]] = frozenset()

_PARQUET, _ARROW, _FEATHER, _STREAM = b"PAR1", b"ARROW1", b"FEA1", b"\xff\xff\xff\xff"
_LARGEST_GROUP = 1 << 27  # rows decoded at once
_KEPT_GROUPS, _LARGE = 3, 1 << 20  # groups kept of a column; of larger ones [bytes] only one
_REPEATS = 4  # times that a level comes up in a block of few levels
_OURS = b"allanite"  # key of the file's metadata under which `write` keeps the channels
_RATE_KEYS = (b"rate", b"sample_rate", b"sampling_rate", b"fs")


def sniff(head: bytes, path: Path) -> bool:
    """True for the magic strings of Parquet, Arrow files and Feather, and for a plausible Arrow stream."""
    if head.startswith(_STREAM):
        return 0 < int.from_bytes(head[4:8], "little") < 1 << 20 and b"\x00" in head[8:64]
    return head.startswith((_PARQUET, _ARROW, _FEATHER))


def read(path: Path, options: Options) -> Table:
    """Read the numeric columns of a file, lazily.

    Raises
    ------
    FormatError
        A damaged file.
    InputError
        No column of numbers, or several of one name.
    LimitError
        A group of more than 134 million rows, too many groups or columns.
    """
    import pyarrow as pa

    with open_regular(path) as file:
        magic = file.read(8)
    opened = _open_parquet if magic.startswith(_PARQUET) else _open_arrow
    try:
        schema, lengths, decode = opened(path, magic)
        if lengths and max(lengths) > _LARGEST_GROUP:
            raise LimitError(
                f"{path.name}: a row group of {max(lengths)} rows; write it in groups of at most a million"
            )
        return _table(path, magic, schema, lengths, decode)
    except AllaniteError:
        raise
    except (pa.ArrowException, OSError, ValueError) as error:
        raise FormatError(f"{path.name}: damaged or incomplete {NAME} file ({_brief(error)})") from None


def _brief(error: Exception) -> str:
    return str(error).strip().splitlines()[0][:200] if str(error).strip() else type(error).__name__


# -- opening -----------------------------------------------------------------------------------------------


def _open_parquet(path: Path, magic: bytes) -> tuple[pa.Schema, list[int], Decode]:
    import pyarrow.parquet as pq

    from allanite.files.store.compaction import parquet_place

    # Channels are read by several threads, but one reader serves one of them at a time: two at once can block for ever.
    # Not mapped into memory: pages of the file would stay in the process beside the numbers decoded from them.
    file = pq.ParquetFile(parquet_place(path), pre_buffer=False)
    _refuse_wide(path, len(file.schema), file.metadata.num_row_groups)
    one_at_a_time = threading.Lock()
    lengths = [file.metadata.row_group(g).num_rows for g in range(file.metadata.num_row_groups)]

    def decode(group: int, name: str) -> pa.ChunkedArray:
        with one_at_a_time:
            return file.read_row_group(group, columns=[name], use_threads=False).column(0)

    return file.schema_arrow, lengths, decode


def _open_arrow(path: Path, magic: bytes) -> tuple[pa.Schema, list[int], Decode]:
    import pyarrow as pa
    import pyarrow.feather as feather

    if magic.startswith(_ARROW):
        file = pa.ipc.open_file(pa.memory_map(str(regular(path))))
        _refuse_wide(path, len(file.schema), file.num_record_batches)
        # Lengths only: what a batch holds is not touched before it is asked for.
        lengths = [file.get_batch(g).num_rows for g in range(file.num_record_batches)]
        one_at_a_time = threading.Lock()

        def decode(group: int, name: str) -> pa.ChunkedArray:
            with one_at_a_time:
                return pa.chunked_array([file.get_batch(group).column(name)])

        return file.schema, lengths, decode
    if magic.startswith(_FEATHER):
        table = feather.read_table(regular(path), memory_map=True)
        _refuse_wide(path, table.num_columns, 1)
    else:
        stream = pa.ipc.open_stream(pa.memory_map(str(regular(path))))
        _refuse_wide(path, len(stream.schema), 1)
        table = stream.read_all()
    return table.schema, [table.num_rows], lambda _, name: table.column(name)


def _refuse_wide(path: Path, columns: int, groups: int) -> None:
    refuse_more(columns, COLUMNS, "columns", path.name, "Write only the needed ones to a separate file")
    refuse_more(groups, PIECES, "row groups", path.name, "Write it in groups of a million rows")


# -- columns -----------------------------------------------------------------------------------------------


class _LazyColumn:
    """A column that is decoded group by group; the groups read last are kept."""

    __slots__ = ("_column", "_decode", "_edges", "_kept", "_lock", "_whole", "dtype", "origin")

    def __init__(
        self,
        column: NumberColumn,
        dtype: np.dtype[Any],
        edges: NDArray[np.int64],
        decode: Decode,
        whole: bool,
    ) -> None:
        self._column, self._edges, self._decode, self._whole = column, edges, decode, whole
        self._lock = threading.Lock()
        self._kept: dict[int, NDArray[np.float64]] = {}
        self.dtype = dtype
        self.origin = 0.0
        if whole and dtype.itemsize == 8 and edges[-1] > 0:
            first = float(self._checked(0, 0)[0])
            if (
                abs(first) >= 2.0**53
            ):  # integers that far are read relative to a number just below the first one
                self.origin = math.nextafter(first, 0.0)  # the first one itself may be too large for its type

    def __len__(self) -> int:
        return int(self._edges[-1])

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        stop = min(stop, len(self))
        group = int(np.searchsorted(self._edges, start, side="right")) - 1
        parts = []
        while start < stop:
            offset, end = int(self._edges[group]), min(stop, int(self._edges[group + 1]))
            parts.append(self._group(group)[start - offset : end - offset])
            start, group = end, group + 1
        if len(parts) == 1:
            return parts[0]
        return np.concatenate(parts) if parts else np.zeros(0)

    def _checked(self, group: int, origin: int) -> NDArray[np.float64]:
        import pyarrow as pa

        try:
            numbers = _decoded(_as_numbers(self._column.decoded(self._decode, group)), origin)
            if len(numbers) != self._edges[group + 1] - self._edges[group]:
                raise ValueError(f"{len(numbers)} values")
            return numbers
        except (pa.ArrowException, OSError, ValueError) as error:
            raise FormatError(
                f"column {self._column.name}, row group {group}: damaged ({_brief(error)})"
            ) from None

    def _group(self, group: int) -> NDArray[np.float64]:
        with self._lock:
            kept = self._kept.get(group)
            if kept is None:
                kept = self._checked(group, int(self.origin))
                if self._whole and len(kept) and np.nanmax(np.abs(kept), initial=0.0) >= 2.0**53:
                    raise InputError(
                        f"column {self._column.name}: 64-bit integers that span more than 2**53; float64 cannot "
                        "hold them"
                    )
                if len(self._kept) >= (_KEPT_GROUPS if kept.nbytes < _LARGE else 1):
                    self._kept.pop(next(iter(self._kept)))
                self._kept[group] = kept
        return kept


def _as_numbers(array: pa.ChunkedArray) -> pa.ChunkedArray:
    """Moments and durations as nanoseconds, decimals as floats."""
    import pyarrow as pa

    array.validate()  # a file may state more values than its buffers hold
    if pa.types.is_timestamp(array.type):
        return array.cast(pa.timestamp("ns", array.type.tz)).cast(pa.int64())
    if pa.types.is_duration(array.type):
        return array.cast(pa.duration("ns")).cast(pa.int64())
    return array.cast(pa.float64()) if pa.types.is_decimal(array.type) else array


def _decoded(array: pa.ChunkedArray, origin: int) -> NDArray[np.float64]:
    if not origin:
        return numbers_of(array, copy=False).astype(np.float64, copy=False)
    values, missing = whole_numbers_of(array)
    away = (values - values.dtype.type(origin)).view(np.int64)
    return np.where(missing, np.nan, away.astype(np.float64))


def _numeric(kind: pa.DataType) -> bool:
    import pyarrow as pa

    t = pa.types
    return bool(t.is_integer(kind) or t.is_floating(kind) or t.is_decimal(kind) or _is_time(kind))


def _is_time(kind: pa.DataType) -> bool:
    import pyarrow as pa

    return bool(pa.types.is_timestamp(kind) or pa.types.is_duration(kind))


def _dtype(kind: pa.DataType) -> np.dtype[Any]:
    import pyarrow as pa

    if _is_time(kind):
        return np.dtype(np.int64)
    return np.dtype(np.float64) if pa.types.is_decimal(kind) else np.dtype(kind.to_pandas_dtype())


def _table(path: Path, magic: bytes, schema: pa.Schema, lengths: list[int], decode: Decode) -> Table:
    edges = np.concatenate(([0], np.cumsum(lengths))).astype(np.int64)
    used = number_columns(schema, len(lengths), decode, _numeric)
    refuse_more(len(used), COLUMNS, "columns", path.name, "Write only the needed ones to a separate file")
    if not used:
        raise InputError(
            f"{path.name}: no column of numbers; there are: {', '.join(map(str, schema.names)) or 'none'}"
        )
    names = [f.name for f in used]
    twice = sorted(name for name, count in Counter(names).items() if count > 1)
    if twice:  # columns are decoded by their name
        raise InputError(
            f"{path.name}: several columns have the name {', '.join(map(repr, twice[:5]))}; give each a "
            "different name"
        )
    columns: list[Column] = []
    time_units: dict[int, str] = {}
    for f in used:
        if _is_time(f.type):
            time_units[len(columns)] = "iso8601"
        dtype = _dtype(f.type)
        columns.append(_LazyColumn(f, dtype, edges, decode, dtype.kind in "iu"))
    units = tuple(f.metadata.get(b"unit", b"").decode("utf-8", "replace") for f in used)
    ours = _ours(schema.metadata or {}, path.name)
    rate, key = _rate(schema.metadata or {})
    dropped = [n for n in schema.names if n not in {f.source for f in used}]
    return Table(
        format="Parquet" if magic.startswith(_PARQUET) else "Arrow",
        headings=tuple(names),
        columns=tuple(columns),
        units=units,
        units_from="metadata" if any(units) else "none",
        time_units=time_units,
        rate=ours.get("rate", rate),
        rate_from="metadata" if ours or key else "",
        start=ours.get("start"),
        source={"size_bytes": path.stat().st_size},
        guesses=(f"columns without numbers left out: {', '.join(dropped)}",) if dropped else (),
        channels=ours.get("channels"),
        history=ours.get("history", ()),
    )


def _rate(metadata: Mapping[bytes, bytes]) -> tuple[float | None, str]:
    for key in _RATE_KEYS:
        if key in metadata:
            try:
                value = float(metadata[key])
            except ValueError:
                continue
            if math.isfinite(value) and value > 0:
                return value, key.decode()
    return None, ""


# -- our own -----------------------------------------------------------------------------------------------


def _ours(metadata: Mapping[bytes, bytes], name: str) -> dict[str, Any]:
    if _OURS not in metadata:
        return {}
    try:
        stored = parse_plain(metadata[_OURS])
        return {
            "rate": float(stored["rate"]),
            "start": None if stored["start"] is None else int(stored["start"]),
            "channels": tuple(Channel.from_json(c) for c in stored["channels"]),
            "history": tuple(dict(step) for step in stored["history"]),
        }
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError) as error:
        raise FormatError(f"{name}: the description of the channels is damaged ({_brief(error)})") from None


def write(recording: Recording, path: Path) -> None:
    """Store a recording as Parquet, block by block; missing samples are nulls.

    Parameters
    ----------
    recording : Recording
    path : Path
        Overwritten if it is there.

    Raises
    ------
    StorageError
        The disk is full or the path cannot be written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    description = {
        "rate": recording.rate,
        "start": recording.start,
        "channels": [c.to_json() for c in recording.channels],
        "history": [dict(h) for h in recording.history],
    }
    schema = pa.schema(
        [
            pa.field(c.name, pa.from_numpy_dtype(_stored(column)), metadata={"unit": c.unit})
            for c, column in zip(recording.channels, recording.columns, strict=True)
        ],
        metadata={_OURS: json.dumps(description).encode()},
    )
    few_levels = _of_few_levels(recording)
    try:
        with pq.ParquetWriter(path, schema, compression="zstd", use_dictionary=few_levels) as writer:
            for start in range(0, recording.n_samples, BLOCK):
                stop = min(start + BLOCK, recording.n_samples)
                arrays = [_stored_block(c, start, stop) for c in recording.columns]
                writer.write_table(pa.table(arrays, schema=schema), row_group_size=BLOCK)
    except OSError as error:
        raise StorageError(f"{path} cannot be written: {error}") from None


def _of_few_levels(recording: Recording) -> list[str]:
    """Channels of integers, and of floats that repeat one another in the first block.

    For the others a dictionary of levels would be built and thrown away in each block, which takes four times as long
    as writing them.
    """
    first = min(BLOCK, recording.n_samples)
    return [
        name
        for name, column in zip(recording.names, recording.columns, strict=True)
        if _stored(column).kind != "f" or len(_stored_block(column, 0, first).unique()) <= first // _REPEATS
    ]


def _stored(column: Column) -> np.dtype[Any]:
    return (
        column.dtype.newbyteorder("=")
        if column.dtype.kind in "iu" or column.dtype.itemsize <= 8
        else np.dtype(np.float64)
    )


def _stored_block(column: Column, start: int, stop: int) -> pa.Array:
    block, dtype = column.read(start, stop), _stored(column)
    if dtype.kind == "f":
        return arrow_of(block.astype(dtype))
    missing = np.isnan(block)
    # float64 has 53 bits, the samples may have 64
    wide = np.dtype(np.uint64 if dtype.kind == "u" else np.int64)
    whole = np.where(missing, 0.0, block).astype(np.int64).astype(wide) + wide.type(int(column.origin))
    return arrow_of(whole.astype(dtype), missing)
