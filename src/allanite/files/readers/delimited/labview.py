# Specification: NI, "Specification for the LabVIEW Measurement File (.lvm)", 2022.
# SPDX-License-Identifier: BSD-3-Clause
"""LabVIEW measurement files (.lvm): a header of tags for the file, one for each segment, and rows of samples.

The header names the channels (``X_Value``, name, name, ..., ``Comment``), their units (``Y_Unit_Label``), the decimal
sign, and the clock: ``X0`` and ``Delta_X`` from the ``Date`` and ``Time`` of the segment. Rows are handed on with time
as their first cell, in seconds since the first segment began, and without comments.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import field
from typing import Final

from allanite.errors import FormatError, InputError
from allanite.files.readers.delimited.dates import date_format, to_nanoseconds
from allanite.files.readers.delimited.dialect import Dialect
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.units import QuantityKind, parse_unit
from allanite.recording.channel_names import for_shell

__all__ = ["Lvm", "find_lvm"]

_FIRST: Final = "LabVIEW Measurement"
_END: Final = "***End_of_Header***"
_SPECIAL: Final = ("***Start_Special***", "***End_Special***")
_CLOSE = 1e-9  # relative, of intervals that are the same


@dataclass(frozen=True, slots=True, kw_only=True)
class _LabviewSegment:
    """The header of a segment.

    Attributes
    ----------
    names, units : tuple of str
        Of the channels.
    values, times : tuple of int
        Cells of a row that hold the samples, and the X value of each channel; -1 where rows hold none.
    x0, delta : tuple of float [s]
        Of each channel.
    moment : int or None [ns]
        Since 1970, as the clock of the computer showed it.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: tuple[int, ...]
    times: tuple[int, ...]
    x0: tuple[float, ...]
    delta: tuple[float, ...]
    moment: int | None

    def only(self, places: Sequence[int]) -> _LabviewSegment:
        """The segment with some of its channels."""
        return _LabviewSegment(
            names=tuple(self.names[i] for i in places),
            units=tuple(self.units[i] for i in places),
            values=tuple(self.values[i] for i in places),
            times=tuple(self.times[i] for i in places),
            x0=tuple(self.x0[i] for i in places),
            delta=tuple(self.delta[i] for i in places),
            moment=self.moment,
        )


@dataclass(slots=True, kw_only=True)
class Lvm:
    """A file of this kind, from its first segment.

    Attributes
    ----------
    first : _LabviewSegment
    unit : str
        Of the X values.
    segments : int
        Met so far.
    """

    name: str
    codec: str
    sign: str
    decimal: str
    columns: str
    variable: str | None
    first: _LabviewSegment
    unit: str
    segments: int = 0
    _begin: float = 0.0
    _x0: float = 0.0
    _row: int = 0
    _last: float = -math.inf
    _header: list[str] | None = field(default_factory=list)
    _special: bool = False

    @property
    def start(self) -> int | None:
        """When the first sample was taken [ns since 1970], as the clock of the computer showed it."""
        moment = self.first.moment
        return None if moment is None else moment + round(self.first.x0[0] * 1e9)

    @property
    def dialect(self) -> Dialect:
        """That of the rows which `piece` makes."""
        count = len(self.first.names) + 1
        return Dialect(
            delimiter="\t",
            decimal=".",
            quoted=False,
            kinds=("f",) * count,
            skip=0,
            headings=("time", *self.first.names),
            units=("s", *self.first.units),
            header_lines=(),
            preamble=(),
        )

    def piece(self, piece: bytes) -> bytes:
        """Whole lines of the text as rows; blank ones in place of the headers."""
        lines = re.split(r"\r\n|\n|\r", piece.decode(self.codec, "replace"))
        return "\n".join(map(self._line, lines)).encode()

    def _line(self, line: str) -> str:
        word = line.split(self.sign, 1)[0].strip()
        if word in _SPECIAL:
            self._special = word == _SPECIAL[0]
        elif self._special or not line.strip():
            pass
        elif word == "Channels":
            self._header = [line]
        elif self._header is not None:
            self._header.append(line)
            if len(self._header) > 1 and self._header[-2].startswith(_END) and "X_Value" in line:
                self._begun(self._header)
                self._header = None
        else:
            return self._row_of(line.split(self.sign))
        return ""

    def _begun(self, header: list[str]) -> None:
        """Place a segment behind the one before: by its date, or by X values that go on."""
        segment = _segment(header, self.sign, self.decimal, self.columns, self.unit, self.name)
        segment = _chosen(segment, self.variable, self.name)
        same = (segment.names, segment.units) == (self.first.names, self.first.units)
        if not same or abs(segment.delta[0] - self.first.delta[0]) > _CLOSE * self.first.delta[0]:
            raise FormatError(
                f"{self.name}: segment {self.segments + 1} differs from the first one in channels, units "
                "or interval; write segments of one kind to a separate file"
            )
        if self.segments and segment.x0[0] <= self._last and None not in (segment.moment, self.first.moment):
            self._begin = ((segment.moment or 0) - (self.first.moment or 0)) * 1e-9
        self.segments, self._row = self.segments + 1, 0
        self._x0 = segment.x0[0]

    def _row_of(self, cells: list[str]) -> str:
        at = self.first.times[0]
        if at < 0:
            time = self._x0 + self._row * self.first.delta[0]
        else:
            time = _number(cells[at] if at < len(cells) else "", self.decimal) * _factor(self.unit)
        self._row += 1
        self._last = time if time == time else self._last
        samples = [cells[i].strip() if i < len(cells) else "" for i in self.first.values]
        if self.decimal == ",":
            samples = [cell.replace(",", ".") for cell in samples]
        return "\t".join([repr(round(self._begin + time, 12)), *samples])


def find_lvm(lines: Sequence[str], variable: str | None, codec: str, name: str) -> Lvm | None:
    """The file that these first lines begin; None for any other text.

    Raises
    ------
    FormatError
        No header of a segment, or an axis that is no time.
    InputError
        Channels with clocks of their own, of which the caller names one.
    """
    if not lines or not lines[0].startswith(_FIRST):
        return None
    sign = "," if lines[0][len(_FIRST) :].startswith(",") else "\t"
    tags = _tags(lines[: next((i for i, line in enumerate(lines) if line.startswith(_END)), 0)], sign)
    decimal = "," if tags.get("Decimal_Separator", [""])[0] == "," or _has_comma(lines, sign) else "."
    columns = tags.get("X_Columns", ["One"])[0]
    at = next((i for i, line in enumerate(lines) if line.split(sign)[0] == "Channels"), None)
    end = None if at is None else next((i for i in range(at, len(lines)) if lines[i].startswith(_END)), None)
    if at is None or end is None or end + 1 >= len(lines):
        raise FormatError(
            f"{name}: a LabVIEW measurement file without the header of a segment (Channels, ..., {_END}); "
            "delete its first lines to read the rest as a plain table"
        )
    header = list(lines[at : end + 2])
    unit = _unit_of_x(_tags(header, sign), name)
    first = _segment(header, sign, decimal, columns, unit, name)
    return Lvm(
        name=name,
        codec=codec,
        sign=sign,
        decimal=decimal,
        columns=columns,
        variable=variable,
        first=_chosen(first, variable, name),
        unit=unit,
    )


def _tags(lines: Sequence[str], sign: str) -> dict[str, list[str]]:
    """What stands behind each tag."""
    cells = ([cell.strip() for cell in line.split(sign)] for line in lines)
    return {row[0]: row[1:] or [""] for row in cells if row[0]}


def _has_comma(lines: Sequence[str], sign: str) -> bool:
    """Decimal commas in the interval, whatever the header says of them."""
    interval = next((line for line in lines if line.startswith(f"Delta_X{sign}")), "")
    return sign != "," and re.search(r"\d,\d", interval) is not None


def _unit_of_x(tags: dict[str, list[str]], name: str) -> str:
    """The unit of the X values, which are times."""
    dimension = next((d for d in tags.get("X_Dimension", []) if d), "Time")
    unit = next((u for u in tags.get("X_Unit_Label", []) if u), "s")
    try:
        parse_unit(unit, QuantityKind.TIME)
    except InputError:
        dimension = dimension if dimension.lower() != "time" else unit
    if dimension.lower() != "time":
        raise FormatError(
            f"{name}: its X axis is {dimension!r}, not time: this is not a log of samples. Save the "
            "samples before the analysis"
        )
    return unit


def _factor(unit: str) -> float:
    return parse_unit(unit, QuantityKind.TIME).factor


def _segment(
    header: list[str], sign: str, decimal: str, columns: str, unit: str, name: str
) -> _LabviewSegment:
    tags = _tags(header[:-1], sign)
    cells = [cell.strip() for cell in header[-1].split(sign)]
    values = tuple(i for i, cell in enumerate(cells) if cell not in ("", "X_Value", "Comment"))
    if not cells or cells[0] != "X_Value" or not values:
        raise FormatError(
            f"{name}: no line of channel names (X_Value, name, ...) after the header of a segment"
        )
    count = len(values)
    times = tuple(-1 if columns == "No" else i - 1 if columns == "Multi" else 0 for i in values)
    delta = [_number(cell, decimal) * _factor(unit) for cell in tags.get("Delta_X", [])[:count]]
    if len(delta) < count or not all(step > 0 for step in delta):
        if columns == "No":
            raise FormatError(
                f"{name}: rows without X values, and no Delta_X for each of the {count} channels"
            )
        delta = [1.0] * count
    x0 = [_number(cell, decimal) * _factor(unit) for cell in tags.get("X0", [])[:count]]
    labels = [*tags.get("Y_Unit_Label", []), *[""] * count][:count]
    return _LabviewSegment(
        names=tuple(cells[i] for i in values),
        units=tuple(labels),
        values=values,
        times=times,
        x0=tuple(x0) if len(x0) == count and all(map(math.isfinite, x0)) else (0.0,) * count,
        delta=tuple(delta),
        moment=_moment(tags, decimal),
    )


def _chosen(segment: _LabviewSegment, variable: str | None, name: str) -> _LabviewSegment:
    """The segment with the channels of one clock."""
    if variable is not None:
        if variable not in segment.names:
            raise InputError(f"{name}: no channel {variable!r}; there are: {', '.join(segment.names)}")
        return segment.only([segment.names.index(variable)])
    clocks = list(zip(segment.x0, segment.delta, strict=True))
    if any(
        not math.isclose(a, b, rel_tol=_CLOSE)
        for clock in clocks
        for a, b in zip(clock, clocks[0], strict=True)
    ):
        ways = ", ".join(
            f"--variable {for_shell(one)} (every {step:g} s)"
            for one, step in zip(segment.names, segment.delta, strict=True)
        )
        raise InputError(f"{name}: channels with separate clocks; read one: {ways}")
    return segment


def _moment(tags: dict[str, list[str]], decimal: str) -> int | None:
    """The date and time of the first channel."""
    day = tags.get("Date", [""])[0].replace("/", "-")
    clock = re.sub(r"(\.\d{9})\d+", r"\1", tags.get("Time", [""])[0].replace(decimal, "."))
    form = date_format(text := f"{day} {clock}")
    if form is None:
        return None
    try:
        return int(to_nanoseconds([text], form)[0])
    except ValueError:
        return None


def _number(cell: str, decimal: str) -> float:
    try:
        return float(cell.strip().replace(decimal, "."))
    except ValueError:
        return math.nan
