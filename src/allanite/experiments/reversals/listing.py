# SPDX-License-Identifier: BSD-3-Clause
"""Small tables with a heading, written by hand: when the sensor was turned, or where it pointed.

Comma, semicolon or tab; ``#`` begins a comment; with a semicolon or a tab the decimal sign may be a comma. Units may
stand in the heading, ``start [min]``; without one, times are seconds and headings degrees.
"""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from allanite.errors import FormatError, InputError, LimitError
from allanite.files.readers.headings import read_heading
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural
from allanite.plain_files.regular_file import read_regular_text
from allanite.quantities.units import QuantityKind, parse_unit
from allanite.recording.records import Recording

__all__ = ["Listing", "read_listing"]

#: A list by hand has no more bytes than this.
MOST = 16 << 20

_QUANTITIES = {"start": QuantityKind.TIME, "stop": QuantityKind.TIME, "heading": QuantityKind.ANGLE}
_UNITS = {"start": "s", "stop": "s", "heading": "deg"}
_TAIL = re.compile(r"_(s|sec|seconds|ms|min|h|deg|rad)$")


@dataclass(frozen=True, slots=True, kw_only=True)
class Listing:
    """Columns of a table: cells with the number of their line, and the factor to SI.

    Attributes
    ----------
    file : str
    lines : tuple of int
    columns : mapping of name to tuple of str
    factors : mapping of name to float
    comma : bool
        The decimal sign may be a comma.
    """

    file: str
    lines: tuple[int, ...]
    columns: Mapping[str, tuple[str, ...]]
    factors: Mapping[str, float]
    comma: bool

    def texts(self, name: str) -> tuple[str, ...]:
        """Cells of a column; empty where there is no such column."""
        return self.columns.get(name) or ("",) * len(self.lines)

    def numbers(self, name: str) -> list[float]:
        """Numbers of a column in SI.

        Raises
        ------
        FormatError
            A cell that is no finite number.
        """
        return [self._number(line, name, c) for line, c in zip(self.lines, self.columns[name], strict=True)]

    def spans(self, recording: Recording, *, default: float | None = None) -> list[tuple[int, int, int]]:
        """Line, first sample and end of each row's stretch of time.

        Parameters
        ----------
        default : float, optional [s]
            Length of a stretch whose stop is not given.

        Raises
        ------
        FormatError
            A cell that is no number.
        InputError
            Stretches that are empty, out of order, overlapping, or outside of the record.
        """
        out: list[tuple[int, int, int]] = []
        before = 0.0
        for line, start, stop in self._times(default):
            where = f"{self.file}, line {line}"
            if not start < stop:
                raise InputError(f"{where}: stop {stop:g} s does not come after start {start:g} s")
            if out and start < before - 0.5 / recording.rate:
                text = "overlaps with" if stop > before else "comes before"
                raise InputError(
                    f"{where}: {start:g} s to {stop:g} s {text} the line above; put one row after another in time"
                )
            if start < -0.5 / recording.rate or start >= recording.duration:
                raise InputError(
                    f"{where}: {start:g} s is outside of the record of {recording.duration:g} s; times count from its "
                    "first sample: shift them all, or remove the rows that are outside"
                )
            if default is None and stop > recording.duration + 0.5 / recording.rate:
                raise InputError(
                    f"{where}: stop {stop:g} s is after the end of the record, {recording.duration:g} s: shift all "
                    "times, or remove the row"
                )
            a = max(round(start * recording.rate), out[-1][2] if out else 0)
            out.append((line, a, min(max(round(stop * recording.rate), a), recording.n_samples)))
            before = stop
        return out

    def _times(self, default: float | None) -> list[tuple[int, float, float]]:
        starts = self.numbers("start")
        stops: list[float] = []
        for i, cell in enumerate(self.texts("stop")):
            if cell or default is None:
                stops.append(self._number(self.lines[i], "stop", cell))
            else:  # as long as a turn, but not into the next
                after = starts[i + 1] if i + 1 < len(starts) else math.inf
                stops.append(min(starts[i] + default, after) if after > starts[i] else starts[i] + default)
        return list(zip(self.lines, starts, stops, strict=True))

    def _number(self, line: int, name: str, cell: str) -> float:
        text = cell.replace(",", ".") if self.comma else cell
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise FormatError(f"{self.file}, line {line}: {name} must be a number, not {cell!r}")
        return value * self.factors[name]


def read_listing(
    path: str | os.PathLike[str],
    needed: Mapping[str, Sequence[str]],
    optional: Mapping[str, Sequence[str]],
    *,
    texts: Sequence[str] = (),
) -> Listing:
    """Read a table.

    Parameters
    ----------
    needed, optional : mapping of column name to other names of it
    texts : sequence of str
        Optional columns that are not numbers.

    Raises
    ------
    InputError
        No such file.
    LimitError
        A file too large for a list.
    FormatError
        No heading, a column that is missing or there twice, a row with too few cells, a unit that does not fit.
    """
    place = Path(path)
    rows = _rows(place)
    if not rows:
        raise FormatError(f"{place.name} is empty; it needs the columns {', '.join(needed)}")
    delimiter = max(",;\t", key=rows[0][1].count)
    cells = [(line, _cells(text, delimiter)) for line, text in rows]
    line, heading = cells[0]
    names = {**needed, **optional, **dict.fromkeys(texts, ())}
    column_numbers: dict[str, int] = {}
    factors: dict[str, float] = {}
    for i, cell in enumerate(heading):
        name, unit = _heading(cell, names)
        if name in column_numbers:
            raise FormatError(f"{place.name}, line {line}: two columns {name!r}")
        if name:
            column_numbers[name] = i
            if name not in texts:
                factors[name] = _factor(place.name, line, name, unit)
    missing = [n for n in needed if n not in column_numbers]
    if missing:
        raise FormatError(
            f"{place.name}, line {line}: no column {' and no column '.join(map(repr, missing))}; the heading must name "
            f"{', '.join(needed)}, and holds {', '.join(heading)!r}"
        )
    body = cells[1:]
    if not body:
        raise FormatError(f"{place.name} holds a heading and no rows")
    least = 1 + max(column_numbers[n] for n in needed)
    for number, row in body:
        if len(row) < least:
            raise FormatError(
                f"{place.name}, line {number}: {plural(len(row), 'cell')}, where the heading has {len(heading)}"
            )
    columns = {n: tuple(row[i] if i < len(row) else "" for _, row in body) for n, i in column_numbers.items()}
    return Listing(
        file=place.name,
        lines=tuple(n for n, _ in body),
        columns=columns,
        factors=factors,
        comma=delimiter != ",",
    )


def _rows(place: Path) -> list[tuple[int, str]]:
    """Lines that are neither empty nor comments, with their numbers."""
    try:
        if place.stat().st_size > MOST:
            raise LimitError(f"{place.name} has over {MOST >> 20} MiB: that is a log, not a list of turns")
        text = read_regular_text(place)
    except FileNotFoundError:
        raise InputError(f"no such file: {place}") from None
    except (OSError, UnicodeError) as error:
        raise InputError(f"{place} cannot be read: {error}") from None
    return [
        (i, line)
        for i, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]


def _cells(line: str, delimiter: str) -> list[str]:
    return [c.strip() for c in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]


def _heading(cell: str, names: Mapping[str, Sequence[str]]) -> tuple[str, str]:
    """Column name ("" for a strange one) and unit of a heading."""
    read = read_heading(cell)
    name, unit = read.name.lower(), read.unit
    tail = _TAIL.search(name)
    if not unit and tail:
        name, unit = name[: tail.start()], tail[1]
    for known, others in names.items():
        if name == known or name in others:
            return known, unit
    return "", unit


def _factor(file: str, line: int, name: str, unit: str) -> float:
    try:
        return parse_unit(unit or _UNITS[name], _QUANTITIES[name]).factor
    except InputError as error:
        raise FormatError(f"{file}, line {line}: column {name!r}: {error}") from None
