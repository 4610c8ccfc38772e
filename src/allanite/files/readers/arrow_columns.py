# SPDX-License-Identifier: BSD-3-Clause
"""The columns of an Arrow table, in a file or in memory, as a Table; decoded group by group when they are read.

Units are taken from a field's metadata (``unit`` or ``units``) or its name, the rate from the table's metadata
(``rate``, ``sample_rate``, ``fs``).
"""

from __future__ import annotations

import math
import threading
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError, InputError
from allanite.files.readers.nested_columns import Decode, NumberColumn, number_columns
from allanite.files.readers.packed_values import UNIT_KEYS, as_stored
from allanite.files.readers.stated_rate import StatedRate, Statement, chosen_rate, keyed_statement
from allanite.files.readers.table import Table
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.arrow_numbers import numbers_of, whole_numbers_of
from allanite.plain_files.json_values import parse_plain
from allanite.plain_files.limits import COLUMNS, refuse_more
from allanite.recording.records import Channel, Column
from allanite.recording.sample_columns import Bound, less_base, middle, torn

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["DESCRIPTION", "brief", "table_of_arrow"]

#: Key of the metadata under which `parquet.write` keeps the channels.
DESCRIPTION = b"allanite"
_KEPT_GROUPS, _LARGE = 3, 1 << 20  # groups kept of a column; of larger ones [bytes] only one


class _LazyColumn(Bound):
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
            first = self._checked(0, 0)
            typical = middle(first[np.isfinite(first)])
            if abs(typical) >= 2.0**53:  # integers that far are read relative to where most of them lie
                self.origin = math.nextafter(typical, 0.0)  # itself it may be too large for its type

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
                f"column {self._column.name}, row group {group}: damaged ({brief(error)})"
            ) from None

    def _group(self, group: int) -> NDArray[np.float64]:
        with self._lock:
            kept = self._kept.get(group)
            if kept is None:
                kept = self._checked(group, int(self.origin))
                if self._whole and group == 0 and len(kept) and torn(kept):
                    raise InputError(
                        f"column {self._column.name}: 64-bit integers that span more than 2**53; float64 cannot "
                        "hold them"
                    )
                if len(self._kept) >= (_KEPT_GROUPS if kept.nbytes < _LARGE else 1):
                    self._kept.pop(next(iter(self._kept)))
                self._kept[group] = kept
        return kept


@dataclass(frozen=True, slots=True)
class _ArrowWords:
    """A column of words, decoded where it is read."""

    name: str
    edges: NDArray[np.int64]
    decode: Decode

    def read(self, start: int, stop: int) -> NDArray[np.str_]:
        first = int(np.searchsorted(self.edges, start, side="right")) - 1
        words: list[str] = []
        for group in range(first, int(np.searchsorted(self.edges, stop))):
            offset = int(self.edges[group])
            words += self._group(group, max(start - offset, 0), stop - offset)
        return np.array(words, dtype=np.str_)

    def _group(self, group: int, start: int, stop: int) -> list[str]:
        import pyarrow as pa

        try:
            part = self.decode(group, self.name)
            part.validate(full=True)  # the offsets of a damaged file may point anywhere
            return list(map(str, part[start:stop].to_pylist()))
        except (pa.ArrowException, OSError, ValueError) as error:
            raise FormatError(f"column {self.name}, row group {group}: damaged ({brief(error)})") from None


def _is_word(kind: pa.DataType) -> bool:
    import pyarrow as pa

    t = pa.types
    if t.is_dictionary(kind):
        return _is_word(kind.value_type)
    return bool(t.is_string(kind) or t.is_large_string(kind) or t.is_boolean(kind))


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
    return np.where(missing, np.nan, less_base(values, origin))


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


def table_of_arrow(
    schema: pa.Schema, lengths: Sequence[int], decode: Decode, *, form: str, name: str, source: dict[str, Any]
) -> Table:
    """The columns of numbers in a table of Arrow.

    Parameters
    ----------
    schema : pyarrow.Schema
    lengths : sequence of int
        Rows of each group.
    decode : callable
        Gives a column of a group by the number of the group and the name of the column.
    form, name : str
        Name of the format, and of the file or object, for messages.
    source : dict
        Facts about the file.

    Raises
    ------
    InputError
        No column of numbers, or several of one name.
    LimitError
        Too many columns.
    FormatError
        A description of the channels that is damaged.
    """
    edges = np.concatenate(([0], np.cumsum(lengths))).astype(np.int64)
    used = number_columns(schema, len(lengths), decode, _numeric)
    refuse_more(len(used), COLUMNS, "columns", name, "Write only the needed ones to a separate file")
    if not used:
        raise InputError(
            f"{name}: no column of numbers; there are: {', '.join(map(str, schema.names)) or 'none'}"
        )
    names = [f.name for f in used]
    twice = sorted(one for one, count in Counter(names).items() if count > 1)
    if twice:  # columns are decoded by their name
        raise InputError(
            f"{name}: several columns have the name {', '.join(map(repr, twice[:5]))}; give each a "
            "different name"
        )
    columns: list[Column] = []
    time_units: dict[int, str] = {}
    for f in used:
        if _is_time(f.type):
            time_units[len(columns)] = "iso8601"
        dtype = _dtype(f.type)
        columns.append(_LazyColumn(f, dtype, edges, decode, dtype.kind in "iu"))
    stored = [_as_stored(f) for f in used]
    units = tuple(unit for unit, _ in stored)
    ours = _ours(schema.metadata or {}, name)
    stated = _rate(schema.metadata or {})
    dropped = [n for n in schema.names if n not in {f.source for f in used}]
    left_out = (f"columns without numbers left out: {', '.join(dropped)}",) if dropped else ()
    return Table(
        format=form,
        headings=tuple(names),
        columns=tuple(columns),
        units=units,
        units_from="metadata" if any(units) else "none",
        time_units=time_units,
        rate=ours.get("rate", stated.rate),
        rate_from="metadata" if ours else stated.where,
        rate_doubt=None if ours else stated.doubt,
        start=ours.get("start"),
        source=source,
        guesses=(*left_out, *stated.guesses, *(note for _, notes in stored for note in notes)),
        left_out=tuple(dropped),
        channels=ours.get("channels"),
        history=ours.get("history", ()),
        words=tuple(
            _ArrowWords(f.name, edges, decode)
            for f in schema
            if f.name in dropped and schema.names.count(f.name) == 1 and _is_word(f.type)
        ),
    )


def _as_stored(column: NumberColumn) -> tuple[str, list[str]]:
    words = {
        key.decode("utf-8", "replace"): value.decode("utf-8", "replace")
        for key, value in column.metadata.items()
    }
    unit = next((words[key] for key in UNIT_KEYS if words.get(key)), "")
    if _is_time(column.type):
        return unit, []
    numbers = {key: number for key, text in words.items() if (number := _number(text)) is not None}
    return as_stored(column.name, _dtype(column.type), numbers, unit, applied=())


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _rate(metadata: Mapping[bytes, bytes]) -> StatedRate:
    return chosen_rate(_statement(key, text) for key, text in metadata.items())


def _statement(key: bytes, text: bytes) -> Statement | None:
    try:
        return keyed_statement(key.decode("utf-8", "replace"), float(text), "metadata")
    except ValueError:
        return None


def _ours(metadata: Mapping[bytes, bytes], name: str) -> dict[str, Any]:
    if DESCRIPTION not in metadata:
        return {}
    try:
        stored = parse_plain(metadata[DESCRIPTION])
        return {
            "rate": float(stored["rate"]),
            "start": None if stored["start"] is None else int(stored["start"]),
            "channels": tuple(Channel.from_json(c) for c in stored["channels"]),
            "history": tuple(dict(step) for step in stored["history"]),
        }
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError) as error:
        raise FormatError(f"{name}: the description of the channels is damaged ({brief(error)})") from None


def brief(error: Exception) -> str:
    """The first line of a fault of Arrow."""
    return str(error).strip().splitlines()[0][:200] if str(error).strip() else type(error).__name__
