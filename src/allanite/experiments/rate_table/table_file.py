# SPDX-License-Identifier: BSD-3-Clause
"""A rate table's own record: a CSV of steps, of an encoder, of rates, or of sinusoids.

Comma, semicolon or tab; ``#`` begins a comment; with a semicolon or a tab the decimal sign may be a comma. Units stand
in the heading, ``rate_deg_s`` or ``rate [deg/s]``, or in a row below it; that of rates, angles and amplitudes is never
assumed. Dates, and seconds since 1970, count from the first of them.
"""

from __future__ import annotations

import codecs
import csv
import math
import os
import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError, InputError, LimitError
from allanite.experiments.rate_table.motion import RateSteps, RateTable, Sampled, Sinusoids
from allanite.files.readers.headings import is_unit, read_heading
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural
from allanite.plain_files.regular_file import read_regular
from allanite.quantities.units import QuantityKind, parse_unit

__all__ = ["read_rate_table"]

Array = NDArray[np.float64]

#: A larger file is a log of something else.
MOST = 1 << 28
#: Times beyond this count from an epoch [s]: no table turns for years.
EPOCH = 1e8

_QUANTITIES = {
    "start": QuantityKind.TIME,
    "stop": QuantityKind.TIME,
    "time": QuantityKind.TIME,
    "rate": QuantityKind.ANGLE_RATE,
    "amplitude": QuantityKind.ANGLE_RATE,
    "angle": QuantityKind.ANGLE,
    "phase": QuantityKind.ANGLE,
    "frequency": QuantityKind.FREQUENCY,
}
#: Units that go without saying.
_UNITS = {"start": "s", "stop": "s", "time": "s", "frequency": "Hz", "phase": "deg"}
_OTHERS = {
    "begin": "start",
    "end": "stop",
    "t": "time",
    "timestamp": "time",
    "speed": "rate",
    "position": "angle",
    "omega": "rate",
}
_TAIL = re.compile(r"_(s|sec|seconds|ms|us|min|h|hz|khz|mhz|deg|rad|rev|deg_s|deg_h|dps|rad_s|rpm|rev_s)$")
#: What makes a table, the first that fits: the columns, and those that may stand beside them.
_KINDS: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = (
    (("start", "stop", "amplitude", "frequency"), ("phase",)),
    (("start", "stop", "rate"), ()),
    (("time", "angle"), ()),
    (("time", "rate"), ()),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sheet:
    """Cells of a file with the numbers of their lines."""

    file: str
    heading: tuple[int, list[str]]
    rows: list[tuple[int, list[str]]]
    comma: bool


def read_rate_table(path: str | os.PathLike[str]) -> RateTable:
    """How a rate table turned, from a CSV file.

    Parameters
    ----------
    path : path
        With the columns ``start, stop, rate`` (steps), ``start, stop, amplitude, frequency`` and maybe ``phase``
        (sinusoids), ``time, angle`` (an encoder) or ``time, rate``; others are ignored. Times are those of the
        table's own clock.

    Raises
    ------
    InputError
        No such file; rows that are empty in time or out of order.
    LimitError
        A file too large.
    FormatError
        Columns that are missing or there twice, a cell that is no number, a unit that is missing or does not fit:
        the message names line and column.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     place = Path(folder) / "table.csv"
    ...     _ = place.write_text("start,stop,rate_deg_s\\n0,30,0\\n32,62,100\\n")
    ...     table = read_rate_table(place)
    >>> table.kind, len(table.rate)
    ('steps', 2)
    """
    sheet = _sheet(Path(path))
    units = _columns(sheet)
    for needed, beside in _KINDS:
        if set(needed) <= set(units):
            names = [*needed, *(name for name in beside if name in units)]
            columns = {name: _numbers(sheet, name, *units[name]) for name in names}
            return _made(sheet, _since_the_first(columns))
    has = ", ".join(units) or "none of them"
    raise FormatError(
        f"{sheet.file}, line {sheet.heading[0]}: a table needs the columns start, stop, rate (steps), time, angle (an "
        "encoder), time, rate, or start, stop, amplitude, frequency (sinusoids); the heading "
        f"{', '.join(sheet.heading[1])!r} has {has}"
    )


def _since_the_first(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Times that count from an epoch, less the first of them."""
    times = [name for name in columns if _QUANTITIES[name] is QuantityKind.TIME]
    first = float(columns[times[0]][0])
    return {n: c - first if n in times and abs(first) > EPOCH else c for n, c in columns.items()}


def _made(sheet: _Sheet, columns: Mapping[str, Array]) -> RateTable:
    lines = [line for line, _ in sheet.rows]
    if "time" in columns:
        late = np.flatnonzero(np.diff(columns["time"]) <= 0)
        if len(late):
            line = lines[int(late[0]) + 1]
            raise InputError(
                f"{sheet.file}, line {line}: column 'time' does not grow: put the rows in order of time"
            )
        if len(lines) < 3:
            raise FormatError(
                f"{sheet.file} holds {plural(len(lines), 'sample')}; a sampled table needs at least three"
            )
        if "angle" in columns:
            return Sampled.of_angles(columns["time"], columns["angle"])
        return Sampled.of_rates(columns["time"], columns["rate"])
    start, stop = columns["start"], columns["stop"]
    for i, line in enumerate(lines):
        if not start[i] < stop[i]:
            raise InputError(
                f"{sheet.file}, line {line}: stop {stop[i]:g} s does not come after start {start[i]:g} s"
            )
        if i and start[i] < stop[i - 1] - 1e-9 * max(abs(stop[i - 1]), 1.0):
            raise InputError(
                f"{sheet.file}, line {line}: start {start[i]:g} s comes before the stop of the line above, "
                f"{stop[i - 1]:g} s; put one row after another in time"
            )
    if "rate" in columns:
        return RateSteps(start=start, stop=stop, rate=columns["rate"])
    for name in ("amplitude", "frequency"):
        wrong = np.flatnonzero(columns[name] <= 0)
        if len(wrong):
            raise FormatError(f"{sheet.file}, line {lines[int(wrong[0])]}: {name} must be positive")
    return Sinusoids(**{"phase": np.zeros(len(lines)), **columns})


def _sheet(place: Path) -> _Sheet:
    try:
        if place.stat().st_size > MOST:
            raise LimitError(
                f"{place.name} has over {MOST >> 20} MiB: thin it out, 100 rows a second are enough"
            )
        text = _decoded(read_regular(place))
    except FileNotFoundError:
        raise InputError(f"no such file: {place}") from None
    except (OSError, UnicodeError) as error:
        raise InputError(f"{place} cannot be read: {error}") from None
    kept = [
        (i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and line.lstrip()[0] != "#"
    ]
    if not kept:
        raise FormatError(f"{place.name} is empty; it needs a heading such as start,stop,rate_deg_s")
    delimiter = max(",;\t", key=kept[0][1].count)
    cells = csv.reader([line for _, line in kept], delimiter=delimiter, skipinitialspace=True)
    rows = [(i, [c.strip() for c in row]) for (i, _), row in zip(kept, cells, strict=False)]
    if len(rows) < 2:
        raise FormatError(f"{place.name} holds a heading and no rows")
    line, heading = rows[0]
    if len(rows) > 2 and _is_of_units(rows[1][1]):
        heading = [
            f"{cell} [{unit}]" if unit else cell for cell, unit in zip(heading, rows[1][1], strict=False)
        ]
        rows = rows[1:]
    return _Sheet(file=place.name, heading=(line, heading), rows=rows[1:], comma=delimiter != ",")


def _decoded(raw: bytes) -> str:
    """UTF-8, UTF-16 with its mark, or the single bytes of Western Europe."""
    if raw[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return raw.decode("utf-16")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")


def _is_of_units(cells: Sequence[str]) -> bool:
    return any(cells) and all(is_unit(cell) for cell in cells if cell)


def _columns(sheet: _Sheet) -> dict[str, tuple[int, str]]:
    """Position and unit of the columns that have a meaning."""
    line, cells = sheet.heading
    columns: dict[str, tuple[int, str]] = {}
    for i, cell in enumerate(cells):
        name, unit = _heading(cell)
        if name not in _QUANTITIES:
            continue
        if name in columns:
            raise FormatError(f"{sheet.file}, line {line}: two columns {name!r}")
        columns[name] = i, unit
    return columns


def _heading(cell: str) -> tuple[str, str]:
    """Name and unit; "" where there is none."""
    bracket = re.fullmatch(r"\s*([A-Za-z]+)\s*[\[(](.+)[\])]\s*", cell)
    if bracket:
        name, unit = bracket[1].lower(), bracket[2]
        return _OTHERS.get(name, name), unit
    plain = cell.strip().lower().replace(" ", "_")
    tail = _TAIL.search(plain)
    name, unit = (plain[: tail.start()], tail[1]) if tail else (plain, "")
    if _OTHERS.get(name, name) not in _QUANTITIES:  # as loggers write them
        read = read_heading(cell)
        name, unit = read.name.lower(), read.unit
    return _OTHERS.get(name, name), {"hz": "Hz", "khz": "kHz", "mhz": "mHz"}.get(unit, unit)


def _numbers(sheet: _Sheet, name: str, at: int, unit: str) -> Array:
    """A column in SI."""
    factor = _factor(sheet, name, unit)
    out = np.empty(len(sheet.rows))
    for i, (line, row) in enumerate(sheet.rows):
        if at >= len(row):
            raise FormatError(
                f"{sheet.file}, line {line}: no cell in column {name!r}: {len(row)} cells, where the heading has "
                f"{len(sheet.heading[1])}"
            )
        out[i] = _value(row[at].replace(",", ".") if sheet.comma else row[at], name, factor)
        if not math.isfinite(out[i]):
            raise FormatError(f"{sheet.file}, line {line}, column {name!r}: {row[at]!r} is no number")
    return out


def _value(text: str, name: str, factor: float) -> float:
    """A number in SI, or the time of a date [s]; NaN where it is neither."""
    try:
        return float(text) * factor
    except ValueError:
        pass
    try:
        date = datetime.fromisoformat(text) if _QUANTITIES[name] is QuantityKind.TIME else None
    except ValueError:
        return math.nan
    if date is None:
        return math.nan
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()


def _factor(sheet: _Sheet, name: str, unit: str) -> float:
    where = f"{sheet.file}, line {sheet.heading[0]}, column {name!r}"
    text = unit or _UNITS.get(name, "")
    if not text:
        example = "angle_deg" if name == "angle" else f"{name}_deg_s"
        raise FormatError(f"{where}: no unit, and it is never assumed: write {example} in the heading")
    try:
        return parse_unit(text, _QUANTITIES[name]).factor
    except InputError as error:
        raise FormatError(f"{where}: {error}") from None
