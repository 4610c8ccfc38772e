# SPDX-License-Identifier: BSD-3-Clause
"""Lines of text as a table of numbers: what the text reader and the reader of spreadsheets share.

A text is opened (`streams`), its dialect told from its first lines (`dialect`, `labels`, `sentences`, `labview`,
`row_kinds`), and its cells are read piece by piece (`cells`, `dates`, `suffixes`).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError, InputError
from allanite.files.readers.delimited.cells import TextColumns
from allanite.files.readers.delimited.dates import HALVES, in_halves, moments_column, unwrap_midnight
from allanite.files.readers.delimited.dialect import Dialect, detect, split
from allanite.files.readers.delimited.flat_messages import named_as_message, named_by_parents
from allanite.files.readers.delimited.labels import Labels, find_labels
from allanite.files.readers.delimited.labview import Lvm, find_lvm
from allanite.files.readers.delimited.preamble import facts_in, rate_in, units_in
from allanite.files.readers.delimited.prefixed_rows import find_prefixed, holds_number
from allanite.files.readers.delimited.printed_numbers import find_printed, refuse_accounting
from allanite.files.readers.delimited.row_kinds import ChosenKind, choose_kind, find_kinds, is_of_kind
from allanite.files.readers.delimited.sentences import Sentences, find_sentences
from allanite.files.readers.delimited.streams import TextStream, head_lines, other_lines, pieces
from allanite.files.readers.delimited.suffixes import unit_behind
from allanite.files.readers.headings import FITTING, is_unit, measures, read_heading, shared_unit
from allanite.files.readers.row_identity import MOST_SENSORS, RowLabels, find_identity
from allanite.files.readers.stated_time import date_order, option_text
from allanite.files.readers.table import Options, Table
from allanite.quantities.units import QuantityKind, parse_unit
from allanite.recording.channel_names import for_shell
from allanite.recording.records import ArrayColumn, Column

__all__ = ["TextStream", "read_stream"]


def read_stream(stream: TextStream, path: Path, options: Options) -> Table:
    """Read a text that was opened, and close it; `path` is the file it comes from."""
    with stream.file:
        lines, others = head_lines(stream, path.name), other_lines(stream)
        lvm = find_lvm(lines, options.variable, stream.codec, path.name)
        if lvm is not None:
            return _of_labview(lvm, stream, path, lines)
        sentences = find_sentences([*lines, *others], options.variable, path.name)
        if sentences is not None:
            others, lines = sentences.head(others), sentences.head(lines)
        elif options.delimiter is None:
            labels = find_labels(
                lines,
                others,
                decimal=options.decimal,
                variable=options.variable,
                codec=stream.codec,
                name=path.name,
            )
            if labels is not None:
                return _labeled(labels, stream, path, options, lines)
        prefixed = printed = None
        if sentences is None:
            prefixed = find_prefixed(
                [*lines, *others], stream.codec, delimiter=options.delimiter, decimal=options.decimal
            )
            if prefixed is not None:
                others, lines = prefixed.head(others), prefixed.head(lines)
            refuse_accounting([*lines, *others], path.name)
            printed = find_printed(
                [*lines, *others], stream.codec, delimiter=options.delimiter, decimal=options.decimal
            )
        if printed is not None:
            others, lines = printed.head(others), printed.head(lines)
        bracketed = printed is not None and printed.bracketed
        kinds = find_kinds(lines, others) if sentences is None and not bracketed else None
        chosen = None
        if kinds is not None:
            chosen = choose_kind(stream, kinds, options.variable, options.channel_names, path.name)
        dialect = detect(
            lines,
            others,
            delimiter="," if sentences else " " if bracketed else options.delimiter,
            decimal="." if sentences or bracketed else options.decimal,
            variable=chosen.name if chosen else None if sentences else options.variable,
            kinds_of_rows=kinds,
            name=path.name,
        )
        keep = None
        if sentences is not None:
            dialect = _of_sentences(dialect, sentences)
        elif chosen is None:
            dialect = named_by_parents(named_as_message(dialect, lines))
            rows = [*lines[dialect.skip :], *others]
            keep = _kept_rows(rows, dialect, options.variable, path.name)
            _refuse_numbers_in_text(rows, dialect, path.name)
        elif dialect.record is not None:
            of_kind = [line for line in (*lines, *others) if is_of_kind(line, dialect.record)]
            _refuse_more_sensors(_whole_rows(of_kind, dialect), dialect, chosen.name, path.name)
        cells = TextColumns(dialect, path.name, stream.codec, keep, date_order(options.time))
        for piece, line in pieces(stream, dialect.skip, path.name):
            for rewritten in (prefixed, sentences or printed):
                piece = piece if rewritten is None else rewritten.piece(piece)
            cells.feed(piece, line)
        columns = cells.finish()
    table = _table(path, stream, lines, dialect, cells, columns)
    if sentences is not None:
        return _with_sums(table, sentences, cells)
    return table if chosen is None else _of_kind(table, chosen)


def _of_labview(lvm: Lvm, stream: TextStream, path: Path, lines: list[str]) -> Table:
    """The table of a LabVIEW measurement file: names, units and clock are those of its header."""
    cells = TextColumns(lvm.dialect, path.name)
    for piece, line in pieces(stream, 0, path.name):
        cells.feed(lvm.piece(piece), line)
    table = _table(path, stream, lines, lvm.dialect, cells, cells.finish())
    facts = {"delimiter": lvm.sign, "decimal": lvm.decimal, "segments": lvm.segments}
    return replace(table, text={**(table.text or {}), **facts}, units_from="metadata", start=lvm.start)


def _labeled(labels: Labels, stream: TextStream, path: Path, options: Options, lines: list[str]) -> Table:
    """The table of a text whose cells are labeled, with what became of its lines in the notes."""
    dialect = labels.dialect
    keep = None
    if not labels.of_kinds:
        keep = _kept_rows(labels.sample, dialect, options.variable, path.name)
    cells = TextColumns(dialect, path.name, keep=keep, order=date_order(options.time))
    for piece, line in pieces(stream, dialect.skip, path.name):
        cells.feed(labels.piece(piece), line)
    columns = cells.finish()
    table = _table(path, stream, lines, dialect, cells, columns)
    facts = {
        "labels_damaged": labels.damaged,
        "failed_rows": cells.damaged_rows,
        "labels_stray": labels.stray,
        "labels_lacking": labels.lacking,
        "labels_absent": dict(labels.absent),
        "labels_unknown": dict(labels.unknown),
    }
    return replace(table, text={**(table.text or {}), **facts})


def _of_sentences(dialect: Dialect, sentences: Sentences) -> Dialect:
    """The dialect with the names of the maker's manual; damaged sentences at the beginning are rows, too."""
    named = any(dialect.headings) or len(sentences.headings) != len(dialect.kinds)
    headings = dialect.headings if named else sentences.headings
    return replace(
        dialect,
        skip=min(dialect.skip, sentences.begins),
        kinds=tuple("e" if h == "-" else k for h, k in zip(headings, dialect.kinds, strict=True)),
        headings=headings,
        guesses=(*dialect.guesses, *sentences.guesses),
    )


def _with_sums(table: Table, sentences: Sentences, cells: TextColumns) -> Table:
    """The table with what became of the checksums in its notes."""
    facts = {
        "sentence": sentences.kind,
        "checksum": sentences.checksum,
        "sentences_failed": sentences.failed,
        "failed_rows": cells.damaged_rows,
        "stray_lines": sentences.stray if sentences.others else 0,
    }
    guesses = list(table.guesses)
    increments = [h for h in table.headings if h.startswith("delta_")]
    if sentences.named and increments:
        guesses.append(
            f"{', '.join(increments)} are increments over the interval in each row: divide them by it to get rates and "
            "accelerations"
        )
    return replace(table, text={**(table.text or {}), **facts}, guesses=tuple(guesses))


def _of_kind(table: Table, chosen: ChosenKind) -> Table:
    """The rows of one kind: named by it, with the unit of the clock that all kinds have."""
    number, _, unit = (chosen.time or "").partition(":")
    remarks, units = list(chosen.remarks), list(table.units)
    if number and int(number) in table.numbers:
        at = table.numbers.index(int(number))
        if not table.headings[at] and not units[at]:
            units[at] = unit
            remarks.append(f"column {number} is read as time in {unit}, by the rates of all kinds")
    return replace(
        table,
        units=tuple(units),
        guesses=(*remarks, *table.guesses),
        source={**table.source, "contents": chosen.contents},
        prefix=chosen.name,
    )


def _kept_rows(lines: list[str], dialect: Dialect, variable: str | None, name: str) -> tuple[int, str] | None:
    """Which rows are read, where a column names several sensors."""
    rows = _whole_rows(lines, dialect)
    keep = _identity(rows, dialect, variable, name)
    if variable is not None and keep is None:
        raise InputError(f"{name} is one table: variable={variable!r} does not apply to it")
    if keep is not None:
        _refuse_more_sensors([r for r in rows if r[keep[0]] == keep[1]], dialect, keep[1], name)
    return keep


def _refuse_more_sensors(rows: list[list[str]], dialect: Dialect, chosen: str, name: str) -> None:
    """Ask for a file of each where the rows that were chosen are still those of several sensors or axes."""
    places = find_identity(_labels(rows, dialect))
    if places:
        raise InputError(
            f"{name}: among the rows of {chosen!r}, {_columns(places, dialect)} distinguishes several sensors or axes; "
            "write the rows of each to a separate file"
        )


def _identity(
    rows: list[list[str]], dialect: Dialect, variable: str | None, name: str
) -> tuple[int, str] | None:
    """A column that names the sensor and holds several values: one of them is read."""
    leading = [column for column in range(min(2, len(dialect.kinds))) if _may_identify(dialect, column)]
    named = next((c for c in leading if _names_several(rows, c)), None)
    places = find_identity(_labels(rows, dialect)) if named is None else (named,)
    if not places:
        return None
    values = {c: list(dict.fromkeys(r[c] for r in rows if r[c])) for c in places}
    column = next((c for c in places if variable in values[c]), places[0])
    listing = ", ".join(values[column])
    if variable is None:
        raise InputError(
            f"{name}: {_columns(places, dialect)} distinguishes several sensors or records: {listing}; choose one, as "
            f"in --variable {for_shell(values[column][0])} (variable= in Python)"
        )
    if variable not in values[column]:
        raise InputError(f"{name}: no {variable!r} in column {column + 1}; there are: {listing}")
    return column, variable


def _whole_rows(lines: list[str], dialect: Dialect) -> list[list[str]]:
    rows = [split(line, dialect.delimiter, dialect.quoted) for line in lines]
    return [r for r in rows if len(r) == len(dialect.kinds)]


def _columns(places: Sequence[int], dialect: Dialect) -> str:
    return " with ".join(f"column {c + 1} ({dialect.headings[c] or 'no name'})" for c in places)


def _names_several(rows: list[list[str]], column: int) -> bool:
    values = {r[column] for r in rows if r[column]}
    return 2 <= len(values) <= MOST_SENSORS and len(rows) >= 3 * len(values)


def _labels(rows: list[list[str]], dialect: Dialect) -> dict[int, RowLabels]:
    """All columns but those of units and the empty ones, for the search for an identity."""
    if len(rows) < 2:
        return {}
    return {
        i: RowLabels.of(
            read_heading(dialect.headings[i]), np.array([r[i] for r in rows]), clock=kind not in "ifx"
        )
        for i, kind in enumerate(dialect.kinds)
        if kind != "e" and i not in dialect.unit_columns.values()
    }


def _refuse_numbers_in_text(lines: list[str], dialect: Dialect, name: str) -> None:
    """A column of text that is left out must not take a measured number with it."""
    unnamed = [
        i
        for i, (kind, heading) in enumerate(zip(dialect.kinds, dialect.headings, strict=True))
        if kind == "x" and not heading and i not in dialect.unit_columns.values()
    ]
    for i in unnamed:
        rows = (split(line, dialect.delimiter, dialect.quoted) for line in lines)
        cells = [row[i] for row in rows if len(row) == len(dialect.kinds)]
        if holds_number(cells):
            sign = {" ": "blanks", "\t": "a tab"}.get(dialect.delimiter, f"'{dialect.delimiter}'")
            raise FormatError(
                f"{name}: column {i + 1} holds a number behind other text, as in {cells[0]!r}; separate them by {sign}"
            )


def _may_identify(dialect: Dialect, column: int) -> bool:
    """Whether a column holds words, or whole numbers under the name of an identity; no column of units does."""
    if column in dialect.unit_columns.values():
        return False
    kind = dialect.kinds[column]
    return kind == "x" or (kind == "i" and read_heading(dialect.headings[column]).group == "identity")


# -- the table ---------------------------------------------------------------------------------------------


def _table(
    path: Path,
    stream: TextStream,
    lines: list[str],
    dialect: Dialect,
    cells: TextColumns,
    columns: list[Column],
) -> Table:
    stated = rate_in(dialect.preamble, dialect.decimal if "f" in dialect.kinds else None)
    guesses = [*dialect.guesses, *stated.guesses]
    headings = dialect.headings if any(dialect.headings) else _words_beside(lines, dialect)
    units, units_from = _units(dialect, guesses)
    units, units_from, marks = _with_suffixes(cells, headings, units, units_from)
    used = list(cells.used)
    time_units: dict[int, str] = {}
    kinds = [cells.dates[i].format if i in cells.dates else dialect.kinds[i] for i in used]
    _join_halves(kinds, used, columns, [read_heading(headings[i]).name for i in used])
    _join_dates(
        kinds,
        used,
        columns,
        time_units,
    )
    questions = {
        used.index(i): question for i, question in _questions(path.name, headings, cells).items() if i in used
    }
    if cells.keep is not None and cells.keep[0] in used:
        at = used.index(cells.keep[0])
        used.pop(at), columns.pop(at)
        time_units = {k - (k > at): v for k, v in time_units.items()}
        questions = {k - (k > at): v for k, v in questions.items()}
    of_kind = -1 if dialect.record is None else dialect.record[0] % len(dialect.kinds)
    places_without_words = (of_kind, *dialect.unit_columns.values())
    words = [
        headings[i] or f"column {i + 1}"
        for i, k in enumerate(dialect.kinds)
        if k == "x" and i not in places_without_words
    ]
    if words:
        guesses.append(f"text columns left out: {', '.join(words)}")
    source: dict[str, Any] = {"size_bytes": path.stat().st_size}
    source |= {"packed": stream.packed} if stream.packed else {}
    source |= facts_in(dialect.preamble)
    return Table(
        format="text",
        headings=tuple(headings[i] for i in used),
        columns=tuple(columns),
        numbers=tuple(i + 1 for i in used),
        units=tuple(units[i] for i in used),
        units_from=units_from,
        time_units=time_units,
        questions=questions,
        rate=stated.rate,
        rate_from=stated.where,
        rate_doubt=stated.doubt,
        text=_facts(stream, dialect, cells) | ({"suffixes": marks} if marks else {}),
        source=source,
        guesses=tuple(guesses),
        left_out=tuple(words),
    )


def _with_suffixes(
    cells: TextColumns, headings: tuple[str, ...], units: tuple[str, ...], units_from: str
) -> tuple[tuple[str, ...], str, dict[str, dict[str, int]]]:
    """Units of the columns where those behind the numbers count, too; and all that stands there, by column."""
    result, suffixes_of = list(units), dict[str, dict[str, int]]()
    for i, suffixes in cells.suffixes.items():
        name = headings[i] or f"column {i + 1}"
        stated = units[i] or read_heading(headings[i]).unit
        result[i] = unit_behind(suffixes, stated, f"{cells.name}, {name}") or units[i]
        suffixes_of[name] = {suffix: count for suffix, (count, _) in suffixes.items()}
    return tuple(result), "cells" if units_from == "none" and any(result) else units_from, suffixes_of


def _facts(stream: TextStream, dialect: Dialect, cells: TextColumns) -> dict[str, Any]:
    return {
        "delimiter": dialect.delimiter,
        "decimal": dialect.decimal,
        "encoding": stream.encoding,
        "header_rows": len(dialect.header_lines),
        "preamble_lines": len(dialect.preamble),
        "ragged": cells.ragged,
        "ragged_rows": cells.ragged_rows,
        "missing_cells": cells.missing,
        "overload_words": cells.overload,
        "unterminated_last_line": stream.unterminated,
        "bom": stream.bom,
        "nul_bytes": stream.nul_bytes,
    }


def _words_beside(lines: list[str], dialect: Dialect) -> tuple[str, ...]:
    """Without a header, words that stand beside their numbers in every row name them: gx,0.1,gy,0.2."""
    rows = [
        split(line, dialect.delimiter, dialect.quoted) for line in lines[dialect.skip : dialect.skip + 100]
    ]
    rows = [r for r in rows if len(r) == len(dialect.kinds)]
    names = [""] * len(dialect.kinds)
    for i, kind in enumerate(dialect.kinds[:-1]):
        beside = i not in dialect.unit_columns.values()
        if kind == "x" and beside and dialect.kinds[i + 1] in ("i", "f") and len({r[i] for r in rows}) == 1:
            names[i + 1] = rows[0][i] if rows[0][i][:1].isalpha() else ""
    return tuple(names) if sum(map(bool, names)) > 1 else dialect.headings


def _units(dialect: Dialect, guesses: list[str]) -> tuple[tuple[str, ...], str]:
    if any(dialect.units):
        return dialect.units, "units row"
    none = ("",) * len(dialect.kinds)
    if any(h.unit and h.group != "time" for h in map(read_heading, dialect.headings)):
        return none, "none"
    stated = units_in(dialect.preamble)
    if len(set(stated)) > 1:
        units = _units_in_turn(stated, dialect, guesses)
        return units, "preamble" if any(units) else "none"
    unit = stated[0] if stated else ""
    if not is_unit(unit):
        return none, "none"
    if parse_unit(unit, tuple(QuantityKind)).quantity is QuantityKind.TIME:
        guesses.append(
            f"the preamble states the unit {unit}, a time: read as unknown (for a clock: --kind phase --unit {unit})"
        )
        return none, "none"
    return shared_unit(unit, dialect.headings, guesses), "preamble"


def _units_in_turn(stated: list[str], dialect: Dialect, guesses: list[str]) -> tuple[str, ...]:
    """Several units: one for each column of numbers in their order, else the only one that a name allows."""
    numbers = [i for i, kind in enumerate(dialect.kinds) if kind in ("i", "f")]
    units = [""] * len(dialect.kinds)
    if len(stated) == len(numbers):
        for i, unit in zip(numbers, stated, strict=True):
            units[i] = unit if is_unit(unit) else ""
        return tuple(units)
    for i in numbers:
        allowed = FITTING.get(read_heading(dialect.headings[i]).group, set())
        fitting = {unit for unit in stated if measures(unit) in allowed}
        units[i] = fitting.pop() if len(fitting) == 1 else ""
    listed = ", ".join(dict.fromkeys(filter(None, stated)))
    taken = (
        "each is used where the name of a column allows no other" if any(units) else "none is taken (--unit)"
    )
    guesses.append(f"the lines before the table state several units ({listed}): {taken}")
    return tuple(units)


def _questions(name: str, headings: Sequence[str], cells: TextColumns) -> dict[int, str]:
    """By column of the file, what is asked where dates do not tell their order."""
    questions: dict[int, str] = {}
    for i, dates in cells.dates.items():
        if dates.orders:
            option = option_text(headings[i], i + 1)
            ways = " or ".join(
                f"--time {option}:{order} ({dates.sample(order)[1]})" for order in dates.orders
            )
            written = dates.sample(dates.orders[0])[0]
            questions[i] = (
                f"{name}: the dates of column {i + 1} ({headings[i] or 'no name'}), such as {written}, do "
                f"not distinguish day and month. State which: {ways}; in Python time='{option}:{dates.orders[0]}'"
            )
    return questions


def _join_halves(kinds: list[str], used: list[int], columns: list[Column], names: Sequence[str]) -> None:
    """AM and PM in a column of their own belong to the clock before them, or to a column of hours."""
    if HALVES not in kinds:
        return
    at = kinds.index(HALVES)
    dates = [k for k, kind in enumerate(kinds) if kind not in ("i", "f", HALVES)]
    clocks = sorted(dates, key=lambda k: (kinds[k] != "hh:mm:ss", abs(k - at)))
    hours = [k for k, name in enumerate(names) if re.fullmatch(r"(?i)(?:\w+_)?(?:hours?|hrs?|hh?)", name)]
    halves = _all(columns[at])
    if clocks:
        joined = in_halves(_all(columns[clocks[0]]), halves)
        columns[clocks[0]] = columns[clocks[0]] if joined is None else moments_column(joined)
    elif (
        hours
        and float(np.nanmax(hour := columns[hours[0]].read(0, len(halves)) + columns[hours[0]].origin)) <= 12
    ):
        columns[hours[0]] = ArrayColumn(hour % 12 + halves / 3.6e12)
    del kinds[at], used[at], columns[at]


def _join_dates(kinds: list[str], used: list[int], columns: list[Column], time_units: dict[int, str]) -> None:
    """Columns of dates are time; a date and a time of day beside each other are one column."""
    dates = [k for k, kind in enumerate(kinds) if kind not in ("i", "f")]
    for k in dates:
        time_units[k] = kinds[k]
    for k in dates:
        if time_units.get(k) != "hh:mm:ss":
            continue
        clock = _all(columns[k])
        if k - 1 in time_units and time_units[k - 1] != "hh:mm:ss":
            columns[k - 1] = moments_column(_all(columns[k - 1]) + clock)
            del time_units[k], used[k], columns[k]
            return
        columns[k] = moments_column(unwrap_midnight(clock))


def _all(column: Column) -> NDArray[Any]:
    """A whole column of nanoseconds; float64 with NaN if some are missing."""
    values = column.read(0, len(column))
    if np.isnan(values).any():
        return values + column.origin
    return values.astype(np.int64) + int(column.origin)
