# SPDX-License-Identifier: BSD-3-Clause
"""The samples of a raw binary file that a layout describes.

Samples are taken out of the mapped file as they are read: nothing is copied, and nothing foreign parses it, so there is
no child process. Where records begin with a header, garbage between them is passed over and counted.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.files.byte_layout import TYPE_SIZES, ByteField
from allanite.files.readers.raw_layout import RecordFrame, RecordLayout
from allanite.files.readers.raw_lines import written_records
from allanite.files.readers.record_chain import follow_chain
from allanite.files.readers.spool import GrowingColumn
from allanite.files.readers.table import Table
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.regular_file import open_regular
from allanite.recording.records import ArrayColumn, Channel, Column, Sampling
from allanite.recording.sample_columns import Calculated

__all__ = ["table_of_records"]

_WINDOW = 16 << 20  # bytes looked at at once
_BLOCK = 1 << 18  # records looked at at once


def table_of_records(path: Path, layout: RecordLayout, file_format: str, sampling: Sampling) -> Table:
    """The records of a file as columns that are decoded as they are read.

    Raises
    ------
    DataQualityError
        There is no whole record, or none where the layout has them.
    """
    frame, size = layout.frame, path.stat().st_size
    raw, guesses, stamps = _written(path, layout) if layout.lines is not None else _mapped(path, layout)
    headings, columns, units = list[str](), list[Column](), list[str]()
    if stamps is not None and layout.lines is not None and layout.lines.time is not None:
        headings, columns, units = ["timestamp"], [stamps], [layout.lines.time.unit]
    if frame.time is not None:
        column, remarks = _clock(raw, frame)
        headings, columns, units, guesses = ["timestamp"], [column], [frame.time.unit], [*guesses, *remarks]
    if frame.counter is not None:
        column, remarks = _counter(raw, frame)
        headings, columns, units = [*headings, "counter"], [*columns, column], [*units, ""]
        guesses += remarks
    for field, at in zip(frame.fields, frame.places, strict=True):
        headings.append(field.name)
        columns.append(_column(raw, field, at, field.endian or frame.endian))
        units.append(field.unit)
    return Table(
        format=file_format,
        headings=tuple(headings),
        columns=tuple(columns),
        units=tuple(units),
        units_from="layout" if any(f.unit for f in frame.fields) else "none",
        rate=layout.rate,
        rate_from="layout" if layout.rate is not None else "",
        source={
            "size_bytes": size,
            "layout": layout.model_dump(mode="json", exclude_defaults=True),
            "records": raw.n,
        },
        guesses=tuple(guesses),
        channels=_channels(frame, sampling),
    )


def _mapped(path: Path, layout: RecordLayout) -> tuple[_Raw, list[str], Column | None]:
    """The records of a binary file, and what is to be said of them."""
    frame, size = layout.frame, path.stat().st_size
    if size < layout.skip + frame.size:
        raise DataQualityError(
            f"{path.name} has {size} bytes: no complete record of {frame.size} after the first {layout.skip}"
        )
    with open_regular(path) as file:
        data = np.memmap(file, dtype=np.uint8, mode="r", offset=layout.skip)
    raw, guesses = _records(data, frame, path.name)
    return raw, guesses, None


def _written(path: Path, layout: RecordLayout) -> tuple[_Raw, list[str], Column | None]:
    """The records of a text, what is to be said of them, and their time."""
    records, size = written_records(path, layout), layout.frame.size
    raw = _Raw(records.data, size, None, len(records.data) // size, records.damaged)
    return raw, records.guesses, None if records.stamps is None else ArrayColumn(records.stamps)


def _channels(frame: RecordFrame, sampling: Sampling) -> tuple[Channel, ...] | None:
    """Channels in full where a field says its scale factor; else they are told from name and unit as in all files."""
    if all(f.scale_factor is None for f in frame.fields):
        return None
    return tuple(f.channel(sampling) for f in frame.fields)


# -- records -----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Raw:
    """Records by number: all at equal distances, or at places of their own; those that are damaged have no samples."""

    data: NDArray[np.uint8]
    size: int
    places: NDArray[Any] | None
    n: int
    damaged: NDArray[np.bool_] | None = None

    def read(self, start: int, stop: int, at: int, width: int) -> NDArray[np.uint8]:
        """Bytes [at, at + width) of the records [start, stop), shape (n, width)."""
        stop = min(stop, self.n)
        if self.places is None:
            block = np.asarray(self.data[start * self.size : stop * self.size]).reshape(-1, self.size)
            return np.ascontiguousarray(block[:, at : at + width])
        return np.ascontiguousarray(sliding_window_view(self.data, width)[self.places[start:stop] + at])


def _records(data: NDArray[np.uint8], frame: RecordFrame, name: str) -> tuple[_Raw, list[str]]:
    size = frame.size
    n, rest = divmod(len(data), size)
    remarks = [f"the last {rest} bytes are not a complete record of {size}: left out"] if rest else []
    even = _Raw(data, size, None, n)
    if not frame.header or _headed(even, frame.header):
        return even, remarks
    places, skipped, breaks = _found(data, frame)
    if len(places) == 0:
        raise DataQualityError(
            f"{name}: no record of {size} bytes begins with {frame.header.hex(' ').upper()} and is "
            "followed by another one: the layout does not match, or 'skip' is wrong"
        )
    return _Raw(data, size, places, len(places)), [
        f"{skipped} bytes in {breaks} place(s) outside complete records are skipped"
    ]


def _headed(raw: _Raw, header: bytes) -> bool:
    wanted = np.frombuffer(header, dtype=np.uint8)
    return all(
        bool((raw.read(start, start + _BLOCK, 0, len(header)) == wanted).all())
        for start in range(0, raw.n, _BLOCK)
    )


def _found(data: NDArray[np.uint8], frame: RecordFrame) -> tuple[NDArray[Any], int, int]:
    """Places of the records, bytes passed over, and in how many places."""
    size, header, growing = frame.size, frame.header, GrowingColumn()
    at, skipped, breaks = 0, 0, 0
    while at < len(data):
        window = np.asarray(data[at : at + _WINDOW + 2 * size + len(header)])
        last = at + len(window) >= len(data)
        marks = np.flatnonzero(window[: max(len(window) - len(header) + 1, 0)] == header[0])
        for k, byte in enumerate(header[1:], start=1):
            marks = marks[window[marks + k] == byte]
        reach = len(window) if last else _WINDOW
        chain = follow_chain(marks, marks + size, reach=reach, size=len(window), last=last)
        growing.append(marks[chain.keep] + at)
        skipped, breaks, at = skipped + chain.skipped, breaks + chain.breaks, at + chain.end
    return growing.finish_array(), skipped, breaks


# -- columns -----------------------------------------------------------------------------------------------


def _decoded(raw: NDArray[np.uint8], kind: str, endian: str) -> NDArray[Any]:
    """Numbers out of the bytes of a field, shape (n, width) -> (n,)."""
    order = "<" if endian == "little" else ">"
    if kind in ("u24", "i24"):
        wide = np.zeros((len(raw), 4), dtype=np.uint8)
        wide[:, 1:] = raw[:, ::-1] if endian == "little" else raw
        value = wide.view(">u4")[:, 0].astype(np.int64)
        return np.where(value >= 1 << 23, value - (1 << 24), value) if kind == "i24" else value
    return raw.view(f"{order}{kind[0]}{TYPE_SIZES[kind]}")[:, 0]


@dataclass(frozen=True, slots=True)
class _FieldColumn(Calculated):
    """A field of the records, scaled; raw values that mean missing or overload are NaN."""

    raw: _Raw
    field: ByteField
    at: int
    endian: str

    def __len__(self) -> int:
        return self.raw.n

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        field = self.field
        numbers = _decoded(
            self.raw.read(start, stop, self.at, TYPE_SIZES[field.type]), field.type, self.endian
        )
        with np.errstate(invalid="ignore", over="ignore"):
            values = numbers.astype(np.float64) * field.scale + field.offset
        for word in (*field.missing, *field.overload):
            values[numbers == word] = np.nan
        if self.raw.damaged is not None:
            values[self.raw.damaged[start:stop]] = np.nan
        return values


@dataclass(frozen=True, slots=True)
class _PlainColumn(_FieldColumn):
    """A field as it stands in the file."""

    @property
    def dtype(self) -> np.dtype[Any]:
        kind = self.field.type
        return np.dtype(np.int32) if kind in ("u24", "i24") else np.dtype(f"{kind[0]}{TYPE_SIZES[kind]}")


def _column(raw: _Raw, field: ByteField, at: int, endian: str) -> Column:
    plain = field.scale == 1.0 and field.offset == 0.0 and not field.missing and not field.overload
    plain = plain and raw.damaged is None
    if plain and field.type in (
        "u64",
        "i64",
    ):  # more digits than float64 has: read relative to the smallest one
        return ArrayColumn(_whole(raw, at, field.type, endian))
    return (_PlainColumn if plain else _FieldColumn)(raw, field, at, endian)


def _whole(raw: _Raw, at: int, kind: str, endian: str) -> NDArray[Any]:
    growing = GrowingColumn(
        np.dtype(f"{kind[0]}{TYPE_SIZES[kind]}") if kind[1:] != "24" else np.dtype(np.int64)
    )
    for start in range(0, raw.n, _BLOCK):
        growing.append(_decoded(raw.read(start, start + _BLOCK, at, TYPE_SIZES[kind]), kind, endian))
    return growing.finish_array()


def _clock(raw: _Raw, frame: RecordFrame) -> tuple[Column, list[str]]:
    """The stamps; a clock of at most 32 bits that begins anew goes on."""
    assert frame.time is not None  # noqa: S101 - asked for by the caller
    kind = frame.time.type
    stamps = _whole(raw, frame.time.at, kind, frame.time.endian or frame.endian)
    if kind[0] != "u" or TYPE_SIZES[kind] > 4:
        return ArrayColumn(stamps), []
    turn = 256 ** TYPE_SIZES[kind]
    steps = np.diff(stamps.astype(np.int64))
    turns = steps < -turn // 2
    if not turns.any():
        return ArrayColumn(stamps), []
    steps[turns] += turn
    going = np.concatenate(([int(stamps[0])], int(stamps[0]) + np.cumsum(steps)))
    return ArrayColumn(going), [
        f"the clock of {8 * TYPE_SIZES[kind]} bits restarted {int(turns.sum())} time(s): unwrapped"
    ]


def _counter(raw: _Raw, frame: RecordFrame) -> tuple[Column, list[str]]:
    """Number of each record since the first one; jumps are missing records."""
    assert frame.counter is not None  # noqa: S101 - asked for by the caller
    counter = frame.counter
    counts = _whole(raw, counter.at, counter.type, counter.endian or frame.endian)
    numbers = counts.astype(np.uint64).view(np.int64)
    steps = np.diff(numbers)
    if counter.turns_at < 1 << 63:
        steps = steps % counter.turns_at
    ahead = np.round(steps / counter.step).astype(np.int64)
    doubtful = int(np.count_nonzero(ahead * counter.step != steps))
    remarks = (
        [f"the counter increases by other than {counter.step} in {doubtful} records: rounded"]
        if doubtful
        else []
    )
    return ArrayColumn(np.concatenate(([0], np.cumsum(ahead)))), remarks
