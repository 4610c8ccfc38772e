# Specification: Apache Parquet format 2.x (PAR1) and Arrow columnar format 1.x (IPC file, IPC stream, Feather).
# SPDX-License-Identifier: BSD-3-Clause
"""Parquet, Arrow IPC and Feather files; columns are decoded group by group, so a file may exceed memory.

What they say of units and of the rate is read in `arrow_columns`. `write` stores a Recording so that reading it gives
the same recording back.
"""

from __future__ import annotations

import json
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from allanite.errors import AllaniteError, FormatError, LimitError, StorageError
from allanite.files.readers.arrow_columns import DESCRIPTION, brief, table_of_arrow
from allanite.files.readers.nested_columns import Decode
from allanite.files.readers.table import Options, Table
from allanite.plain_files.arrow_numbers import arrow_of
from allanite.plain_files.limits import COLUMNS, PIECES, refuse_more
from allanite.plain_files.regular_file import open_regular, regular
from allanite.recording.records import BLOCK, Column, Recording

if TYPE_CHECKING:
    import pyarrow as pa

NAME: Final = "Parquet or Arrow"
OPTIONS: Final[frozenset[str]] = frozenset()

_PARQUET, _ARROW, _FEATHER, _STREAM = b"PAR1", b"ARROW1", b"FEA1", b"\xff\xff\xff\xff"
_LARGEST_GROUP = 1 << 27  # rows decoded at once
_REPEATS = 4  # times that a level comes up in a block of few levels


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
        form = "Parquet" if opened is _open_parquet else "Arrow"
        source = {"size_bytes": path.stat().st_size}
        return table_of_arrow(schema, lengths, decode, form=form, name=path.name, source=source)
    except AllaniteError:
        raise
    except (pa.ArrowException, OSError, ValueError) as error:
        raise FormatError(f"{path.name}: damaged or incomplete {NAME} file ({brief(error)})") from None


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


# -- our own -----------------------------------------------------------------------------------------------


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
        metadata={DESCRIPTION: json.dumps(description).encode()},
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
