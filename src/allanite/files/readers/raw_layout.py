# SPDX-License-Identifier: BSD-3-Clause
"""How the records of a raw binary file are laid out: a small YAML file, checked as a whole.

    skip: 256
    rate: 200
    frame:
      header: "A5 5A"
      endian: little
      counter: {at: 2, type: u16}
      fields:
        - {name: gyro_z, at: 4, type: i24, unit: deg/s, scale: 1.25e-4}

The words are those of `allanite.files.byte_layout`.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from allanite.errors import FormatError, InputError
from allanite.files.byte_layout import (
    LONGEST,
    TYPE_SIZES,
    AnyType,
    ByteRecord,
    Endian,
    Offset,
    Span,
    wrong_in_record,
    wrong_measured,
)
from allanite.plain_files.yaml_text import read_yaml_lines
from allanite.plain_files.yaml_validation import Entry, Fault, Place, check_entries
from allanite.quantities.units import QuantityKind, parse_unit

__all__ = ["HexLines", "RecordFrame", "RecordLayout", "StampField", "WrittenClock", "read_layout"]


class StampField(Entry):
    """A time stamp in every record."""

    at: Offset
    type: AnyType
    endian: Endian | None = None
    unit: str


class RecordFrame(ByteRecord):
    """A record."""

    length: int | None = Field(default=None, ge=1, le=LONGEST)
    time: StampField | None = None

    @property
    def size(self) -> int:
        """Bytes of a record: `length`, or up to the last byte that is described."""
        if self.length is not None:
            return self.length
        return max(stop for _, _, stop in self.spans())

    def spans(self) -> Iterator[Span]:
        """All that has a place."""
        for i, (field, at) in enumerate(zip(self.fields, self.places, strict=True)):
            yield ("frame", "fields", i), at, at + TYPE_SIZES[field.type]
        for name, part in (("counter", self.counter), ("time", self.time)):
            if part is not None:
                yield ("frame", name), part.at, part.at + TYPE_SIZES[part.type]


class WrittenClock(Entry):
    """A decimal time in a column of every line."""

    column: int = Field(ge=0, le=LONGEST)
    unit: str


class HexLines(Entry):
    """The records are lines of hexadecimal words.

    Attributes
    ----------
    columns : tuple of int or None
        Where the words stand, counted from 0; all but the time by default.
    time : WrittenClock or None
    """

    columns: tuple[Annotated[int, Field(ge=0, le=LONGEST)], ...] | None = Field(default=None, min_length=1)
    time: WrittenClock | None = None


class RecordLayout(Entry):
    """A file of records.

    Attributes
    ----------
    skip : int
        Bytes in front of the first record; lines, where the records are lines.
    lines : HexLines or None
        For a text in which the records are written in hexadecimal.
    rate : float or None [Hz]
        Records per second, where they hold no time.
    frame : RecordFrame
    """

    skip: int = Field(default=0, ge=0)
    rate: float | None = Field(default=None, gt=0, le=1e9, allow_inf_nan=False)
    lines: HexLines | None = None
    frame: RecordFrame


def read_layout(source: str | os.PathLike[str] | Mapping[str, Any]) -> RecordLayout:
    """A layout out of a YAML file, or of plain data.

    Raises
    ------
    InputError
        No such file.
    FormatError
        Not YAML, or something is wrong with it: the message lists every fault with line and place.
    """
    if isinstance(source, Mapping):
        return check_entries(RecordLayout, source, "the layout", {}, _contradictions)
    if not isinstance(source, (str, os.PathLike)):
        raise InputError(f"layout must be a YAML file or a mapping of its entries, not {source!r}")
    place = Path(source)
    entries, lines = read_yaml_lines(place, "layout of records")
    if not isinstance(entries, Mapping):
        raise FormatError(f"{place} is not a layout of records: it has no entries like 'frame:'")
    return check_entries(RecordLayout, entries, str(place), lines, _contradictions)


def _contradictions(layout: RecordLayout) -> Iterator[Fault]:
    frame = layout.frame
    yield from wrong_in_record(frame, frame.spans(), frame.size, where=("frame",), what="record")
    yield from wrong_measured(frame.fields, ("frame", "fields"))
    if frame.time is not None and layout.rate is not None:
        yield ("rate",), "the records have a time: leave out the rate"
    if frame.time is not None:
        yield from _wrong_time(frame.time.unit, ("frame", "time", "unit"))
    if layout.lines is not None:
        yield from _wrong_lines(layout, layout.lines)


def _wrong_time(unit: str, where: Place) -> Iterator[Fault]:
    try:
        parse_unit(unit, QuantityKind.TIME)
    except InputError as error:
        yield where, str(error)


def _wrong_lines(layout: RecordLayout, lines: HexLines) -> Iterator[Fault]:
    frame = layout.frame
    wide = [one for one in frame.fields if TYPE_SIZES[one.type] > 1 and one.endian is None]
    if wide and "endian" not in frame.model_fields_set:
        yield (
            ("frame",),
            "write 'endian: big' if FFE5 means -27, in the usual digit order, or 'endian: little' if E5FF does",
        )
    if lines.time is None:
        return
    yield from _wrong_time(lines.time.unit, ("lines", "time", "unit"))
    if frame.time is not None or layout.rate is not None:
        yield (
            ("lines", "time"),
            "the time is described twice: remove this, the time of the frame, or the rate",
        )
    if lines.time.column in (lines.columns or ()):
        yield ("lines", "columns"), f"column {lines.time.column} is the time"
