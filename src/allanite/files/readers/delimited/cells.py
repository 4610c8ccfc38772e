# SPDX-License-Identifier: BSD-3-Clause
"""From lines of text to columns of numbers, piece by piece.

A piece of whole lines goes through the CSV parser of Arrow, many megabytes at a time. A piece that it refuses is
cut into smaller ones, and only the lines around the fault are read cell by cell: there a row of the wrong length
becomes a row of missing samples, and anything that is neither a number nor a known word for "missing" is an error
that names line and column.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError, InputError
from allanite.files.readers.delimited.dates import NUMBERS, DateColumn, moments_column, to_nanoseconds
from allanite.files.readers.delimited.dialect import COMMENT, MISSING, OVERLOAD, Dialect, kind_of, split
from allanite.files.readers.delimited.row_kinds import line_pattern
from allanite.files.readers.delimited.sentences import DAMAGED
from allanite.files.readers.delimited.suffixes import NUMBER, Suffixes, split_suffix
from allanite.files.readers.headings import unbracketed
from allanite.files.readers.spool import GrowingColumn
from allanite.plain_files.arrow_numbers import numbers_of
from allanite.recording.records import Column

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["TextColumns"]

_PART = 1 << 15  # bytes; a piece of this size is read cell by cell
_HEXADECIMAL = re.compile(r"(?:0[xX])?(?:[0-9A-Fa-f]{4}){1,4}")
_HINT = "; hexadecimal words are read by a layout with 'lines:' (--layout)"
_LISTED = 5
_MARKS = 8  # different suffixes of a column; more are words that begin with digits
_LONGEST_WHOLE = 100  # digits, zeros in front included; Python refuses to convert thousands
_LONGEST_SHOWN = 40
_COMMENT_LINES = re.compile(rb"(?m)^[ \t]*(?:#|%|//|!)[^\r\n]*(?:\r?\n|\r|\Z)")
_COMMENT_SIGNS = (b"#", b"%", b"/", b"!")  # single bytes: found fast
_IN_NUMBERS = b"0123456789+-.,;:eE \t"
_OVERLOAD_WORDS = re.compile(
    rb"(?i)(?<![^,;\t| \r\n\"])(?:"
    + b"|".join(re.escape(w).encode() for w in sorted(OVERLOAD))
    + rb")(?![^,;\t| \r\n\"])"
)
_NULLS = sorted(
    {
        v
        for w in MISSING | OVERLOAD
        for v in (w, w.upper(), w.title(), w.capitalize(), w.replace("nan", "NaN"))
    }
)


class TextColumns:
    """Columns that grow as pieces of the text are fed in.

    Attributes
    ----------
    rows : int
        Samples so far.
    ragged : int
        Rows with a wrong number of cells; each is a row of missing samples. `ragged_rows` lists the first.
    suffixes : dict of column to Suffixes
        What stands behind the numbers, in their cells or in those of a column of units.
    damaged_rows : list of int
        The first rows of missing samples in place of sentences that failed their checksum.
    missing, overload : int
        Cells without a value, and among the words those that mean overload (not counted as missing).
    """

    def __init__(
        self,
        dialect: Dialect,
        name: str,
        codec: str = "utf-8",
        keep: tuple[int, str] | None = None,
        order: str | None = None,
    ) -> None:
        self.dialect = dialect
        self.name = name
        self.keep = keep  # (column, value): only these rows are samples
        self.kinds = list(dialect.kinds)
        self.used = [i for i, k in enumerate(self.kinds) if k not in ("x", "e")]
        comma = dialect.decimal == ","
        self.dates = {i: DateColumn(order, comma) for i, k in enumerate(self.kinds) if k == NUMBERS}
        self.unit_columns = dialect.unit_columns
        self.growing = [GrowingColumn(beside=len(self.used)) for _ in self.used]
        self.rows = self.missing = self.overload = self.ragged = 0
        self.ragged_rows: list[int] = []
        self.damaged_rows: list[int] = []
        self.suffixes: dict[int, Suffixes] = {}
        self.ragged_counts: set[int] = set()
        self._headers = [
            line.strip().encode(codec, "replace") for line in dialect.header_lines if line.strip()
        ]
        self._marked_headers = [(header, _mark_of(header)) for header in self._headers]
        self._record = self._record_pattern()

    def feed(self, piece: bytes, line: int) -> None:
        """Take whole lines.

        Parameters
        ----------
        piece : bytes
            Whole lines, NUL bytes removed.
        line : int
            Number of the first of them in the file, from 1.

        Raises
        ------
        FormatError
            A cell that is neither a number nor a known word, or a number too large for a float.
        InputError
            A whole number beyond 64 bits.
        """
        columns = self._fast(piece)
        if columns is None:
            parts = list(_parts(piece, line)) if len(piece) > _PART else []
            if len(parts) > 1:  # one line may be longer than a part
                self.feed(*parts[0])
                rest = self._fast(piece[len(parts[0][0]) :])  # what it held for the first time is known now
                if rest is not None:
                    self._append(rest)
                    return
                for part, number in parts[1:]:
                    self.feed(part, number)
                return
            columns = self._slow(piece, line)
        self._append(columns)

    def finish(self) -> list[Column]:
        """The columns of numbers and dates, in the order of `used`."""
        if self.ragged > 0.2 * max(self.rows, 1):
            counts = sorted({*self.ragged_counts, len(self.kinds)})
            raise FormatError(
                f"{self.name}: rows of {', '.join(map(str, counts))} cells: {self.ragged} of {self.rows} rows do "
                f"not have {len(self.kinds)}. Does a record span several lines, or does the file contain "
                "several tables?"
            )
        return [self._finished(g, i) for g, i in zip(self.growing, self.used, strict=True)]

    def _finished(self, growing: GrowingColumn, column: int) -> Column:
        if self.kinds[column] in ("i", "f"):
            return growing.finish()
        moments = growing.finish_array()
        if column in self.dates and self.rows:
            try:
                moments = self.dates[column].finish(moments)
            except ValueError as error:
                raise FormatError(f"{self.name}, {self._label(column)}: {error.args[0]}") from None
        return moments_column(moments)

    def _append(self, columns: Sequence[NDArray[Any]]) -> None:
        for growing, column in zip(self.growing, columns, strict=True):
            growing.append(column)
        self.rows += len(columns[0]) if columns else 0

    def _record_pattern(self) -> re.Pattern[bytes] | None:
        return None if self.dialect.record is None else line_pattern(*self.dialect.record)

    # -- the fast path -----------------------------------------------------------------------------------

    def _fast(self, piece: bytes) -> list[NDArray[Any]] | None:
        """Columns of a piece, or None if the parser of Arrow refuses it."""
        import pyarrow as pa
        from pyarrow import csv

        piece = self._tidied(piece)
        if not piece or piece.isspace():
            return [np.zeros(0, dtype=np.int64) for _ in self.used]
        names = [str(i) for i in range(len(self.kinds))]
        beside = [*([self.keep[0]] if self.keep else []), *self.unit_columns.values()]
        wanted = [*self.used, *(i for i in dict.fromkeys(beside) if i not in self.used)]
        types = {str(i): self._type(i) for i in wanted}
        delimiter = self.dialect.delimiter or ("\t" if self.dialect.decimal == "," else ",")
        try:
            table = csv.read_csv(
                pa.BufferReader(piece),
                read_options=csv.ReadOptions(column_names=names, block_size=4 << 20),
                parse_options=csv.ParseOptions(
                    delimiter=delimiter,
                    quote_char='"' if self.dialect.quoted else False,
                    ignore_empty_lines=len(names) > 1,
                ),
                convert_options=csv.ConvertOptions(
                    include_columns=[str(i) for i in wanted],
                    column_types=types,
                    null_values=_NULLS,
                    strings_can_be_null=True,
                    decimal_point=self.dialect.decimal,
                ),
            )
            units = {i: self._units_of(table, i) for i in self.unit_columns}
            columns = [self._converted(table.column(str(i)), i) for i in self.used]
        except (pa.ArrowInvalid, ValueError):
            return None
        if any(c.dtype.kind == "f" and np.isinf(c).any() for c in columns):
            return None  # a number too large: named by the slow path
        for i, counts in units.items():
            for unit, count in counts.items():
                self._note_suffix(i, unit, count, 0)
        self._count_missing(table, piece)
        return self._kept(columns, table)

    def _tidied(self, piece: bytes) -> bytes:
        """Without comments, repeated headers, other records and runs of blanks."""
        if self._record is not None:
            piece = b"".join(self._record.findall(piece))
        if any(sign in piece for sign in _COMMENT_SIGNS):
            piece = _COMMENT_LINES.sub(b"", piece)
        for header, mark in self._marked_headers:
            if mark in piece and header in piece:
                piece = re.sub(rb"(?m)^[ \t]*" + re.escape(header) + rb"[ \t]*(?:\r?\n|\r|\Z)", b"", piece)
        if self.dialect.delimiter == " ":
            piece = piece.replace(b"\t", b" ")
            while b"  " in piece:
                piece = piece.replace(b"  ", b" ")
            piece = piece.replace(b"\n ", b"\n").replace(b" \n", b"\n").replace(b" \r", b"\r").strip(b" ")
        return piece

    def _type(self, column: int) -> pa.DataType:
        import pyarrow as pa

        if column in self.suffixes and column not in self.unit_columns:
            return pa.string()
        return {"i": pa.int64(), "f": pa.float64()}.get(self.kinds[column], pa.string())

    def _converted(self, column: pa.ChunkedArray, i: int) -> NDArray[Any]:
        import pyarrow as pa

        kind = self.kinds[i]
        if i in self.suffixes and i not in self.unit_columns:
            return self._without_suffix(column, i)
        if kind in ("i", "f"):
            return numbers_of(column)
        if kind == "iso8601" and column.null_count == 0:
            try:
                zoned = len(column) > 0 and (str(column[0])[-1:] in "Zz" or "+" in str(column[0]))
                moments = column.cast(pa.timestamp("ns", "UTC" if zoned else None))
                return numbers_of(moments.cast(pa.int64()))
            except pa.ArrowInvalid:
                pass  # other zones, a decimal comma: cell by cell
        return self._moments(column.to_pylist(), i)

    def _moments(self, cells: Sequence[str | None], column: int) -> NDArray[Any]:
        """Dates in nanoseconds, or in codes where their order is not known yet."""
        if column in self.dates:
            return self.dates[column].codes(cells)
        return to_nanoseconds(cells, self.kinds[column])

    def _without_suffix(self, column: pa.ChunkedArray, i: int) -> NDArray[Any]:
        """Numbers of a column with suffixes; a ValueError sends those with a new one cell by cell."""
        import pyarrow as pa
        from pyarrow import compute

        pattern = rf"^(?P<number>{NUMBER[self.dialect.decimal]})\s*(?P<suffix>.*?)\s*$"
        parts = compute.extract_regex(compute.utf8_trim_whitespace(column), pattern)
        if parts.null_count > column.null_count:
            raise ValueError("a cell that does not begin with a number")
        counts = {
            str(c["values"]): c["counts"].as_py()
            for c in compute.struct_field(parts, "suffix").value_counts()
        }
        marks = {suffix: n for suffix, n in counts.items() if suffix not in ("", "None")}
        if not marks.keys() <= self.suffixes[i].keys():
            raise ValueError("a suffix for the first time")
        numbers = compute.replace_substring(compute.struct_field(parts, "number"), ",", ".")
        values = numbers_of(compute.cast(numbers, pa.float64()))
        for suffix, n in marks.items():
            self._note_suffix(i, suffix, n, 0)
        return values

    def _units_of(self, table: pa.Table, column: int) -> dict[str, int]:
        """Units beside the numbers of a column; a ValueError sends a piece with a new one cell by cell."""
        cells = table.column(str(self.unit_columns[column]))
        if self.keep is not None:
            from pyarrow import compute

            cells = cells.filter(compute.equal(table.column(str(self.keep[0])), self.keep[1]))
        counted = ((_bare(str(c["values"])), c["counts"].as_py()) for c in cells.value_counts())
        counts = {unit: count for unit, count in counted if unit}
        if not counts.keys() <= self.suffixes.get(column, {}).keys():
            raise ValueError("a unit for the first time")
        return counts

    def _note_suffix(self, column: int, suffix: str, count: int, line: int) -> None:
        counts = self.suffixes.setdefault(column, {})
        before, first = counts.get(suffix, (0, line))
        counts[suffix] = (before + count, first)

    def _count_missing(self, table: pa.Table, piece: bytes) -> None:
        nulls = sum(table.column(str(i)).null_count for i in self.used)
        if nulls:
            overload = len(_OVERLOAD_WORDS.findall(piece))
            self.overload += overload
            self.missing += max(nulls - overload, 0)

    def _kept(self, columns: list[NDArray[Any]], table: pa.Table) -> list[NDArray[Any]]:
        if self.keep is None:
            return columns
        values = np.array([str(v) for v in table.column(str(self.keep[0])).to_pylist()])
        return [c[values == self.keep[1]] for c in columns]

    # -- the slow path -----------------------------------------------------------------------------------

    def _slow(self, piece: bytes, line: int) -> list[NDArray[Any]]:
        """Columns of a piece, cell by cell."""
        rows: list[list[float | int | None]] = []
        for number, cells in self._lines(piece, line):
            if cells == [DAMAGED.decode()]:
                if len(self.damaged_rows) < _LISTED:
                    self.damaged_rows.append(self.rows + len(rows))
                rows.append([None] * len(self.used))
            elif len(cells) != len(self.kinds):
                self.ragged += 1
                self.ragged_counts.add(len(cells))
                if len(self.ragged_rows) < _LISTED:
                    self.ragged_rows.append(self.rows + len(rows))
                rows.append([None] * len(self.used))
            elif self.keep is None or cells[self.keep[0]] == self.keep[1]:
                rows.append([self._value(cells[i], i, number) for i in self.used])
                for i, beside in self.unit_columns.items():
                    if unit := _bare(cells[beside]):
                        self._note_suffix(i, unit, 1, number)
        return [_column([row[k] for row in rows], self.kinds[i]) for k, i in enumerate(self.used)]

    def _lines(self, piece: bytes, line: int) -> Iterator[tuple[int, list[str]]]:
        one = len(self.kinds) == 1
        lines = re.split(rb"\r\n|\n|\r", piece)
        if lines and not lines[-1]:
            lines.pop()
        for k, raw in enumerate(lines):
            stripped = raw.strip()
            if (
                (not stripped and not one)
                or stripped.decode("latin-1").startswith(COMMENT)
                or stripped in self._headers
            ):
                continue
            if self._record is not None and not self._record.match(raw):
                continue
            yield line + k, split(raw.decode("utf-8", "replace"), self.dialect.delimiter, self.dialect.quoted)

    def _value(self, cell: str, column: int, line: int) -> float | int | None:
        kind, where = kind_of(cell, self.dialect.decimal), f"{self.name}, line {line}, {self._label(column)}"
        if kind == "m":
            self.missing += 1
            return None
        if kind == "o":
            self.overload += 1
            return None
        wanted = self.kinds[column]
        if wanted not in ("i", "f"):
            try:
                return int(self._moments([cell], column)[0])
            except ValueError as error:
                raise FormatError(f"{where}: {error.args[0]}") from None
        if kind == "i" and wanted == "i":
            if len(cell) > _LONGEST_WHOLE or abs(int(cell)) >= 1 << 63:
                raise InputError(f"{where}: {_shown(cell)} does not fit into 64 bits")
            return int(cell)
        if kind in ("i", "f"):
            value = float(cell.replace(",", "."))
            if np.isinf(value):
                raise FormatError(f"{where}: {_shown(cell)} is too large for a number in double precision")
            if wanted == "i":
                self.kinds[column] = "f"
            return value
        part = split_suffix(cell, self.dialect.decimal)
        if part is not None and len(self.suffixes.get(column, ())) < _MARKS:
            self._note_suffix(column, part[1], 1, line)
            self.kinds[column] = "f"
            value = float(part[0].replace(",", "."))
            if np.isfinite(value):
                return value
        hint = _HINT if _HEXADECIMAL.fullmatch(cell) else ""
        raise FormatError(f"{where}: {_shown(cell)!r} is not a number{hint}")

    def _label(self, column: int) -> str:
        heading = self.dialect.headings[column]
        return f"column {column + 1}" + (f" ({heading})" if heading else "")


def _mark_of(header: bytes) -> bytes:
    """A byte that rows of numbers have not, where there is one: a single byte is found faster than a header."""
    return next((header[i : i + 1] for i in range(len(header)) if header[i] not in _IN_NUMBERS), header[:1])


def _bare(unit: str) -> str:
    """The text of a cell of units; "" where it holds none."""
    bare = unbracketed(unit)
    return "" if bare.lower() in MISSING else bare


def _shown(cell: str) -> str:
    """A cell in a message."""
    return cell if len(cell) <= _LONGEST_SHOWN else f"{cell[:_LONGEST_SHOWN]}…"


def _column(values: list[float | int | None], kind: str) -> NDArray[Any]:
    if kind == "i" and not any(v is None or isinstance(v, float) for v in values):
        return np.array(values, dtype=np.int64)
    if kind not in ("i", "f") and None not in values:
        return np.array(values, dtype=np.int64)
    return np.array([np.nan if v is None else float(v) for v in values], dtype=np.float64)


def _parts(piece: bytes, line: int) -> Iterator[tuple[bytes, int]]:
    """A piece in about eight parts of whole lines, each with the number of its first line."""
    step = max(len(piece) // 8, _PART // 2)
    end_of_line = b"\n" if b"\n" in piece else b"\r"
    start = 0
    while start < len(piece):
        stop = piece.find(end_of_line, start + step) + 1 or len(piece)
        part = piece[start:stop]
        yield part, line
        line += part.count(end_of_line)
        start = stop
