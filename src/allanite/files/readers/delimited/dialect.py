# SPDX-License-Identifier: BSD-3-Clause
"""The dialect of a text table: delimiter, decimal sign, header, units row, preamble.

A vote decides, over lines from the beginning, the middle and the end: that pair of delimiter and decimal sign
wins which gives the same number of cells in most lines and makes most cells numbers. What cannot be told is
guessed, the guess is written down in words, and `delimiter` and `decimal` settle it.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import lru_cache

from allanite.errors import FormatError, InputError
from allanite.files.readers.curve_shape import names_averaging_times
from allanite.files.readers.delimited.dates import NUMBERS, date_format, packed_format
from allanite.files.readers.delimited.header_rows import names_and_units
from allanite.files.readers.delimited.row_kinds import KindsOfRows, is_of_kind, word_at
from allanite.files.readers.delimited.suffixes import NUMBER, like_a_unit, split_suffix
from allanite.files.readers.headings import is_unit, measures, read_heading
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.limits import COLUMNS, refuse_more
from allanite.recording.channel_names import for_shell

__all__ = ["COMMENT", "MISSING", "OVERLOAD", "Dialect", "column_kind", "detect", "kind_of", "split"]

#: Cells that mean "no value", in lower case; the second set means that the instrument was overloaded.
MISSING = frozenset(
    {"", "nan", "-nan", "+nan", "null", "na", "n/a", "#n/a", "none", "undefined", "-", "--", "nat", "inf", "+inf",
     "-inf", "infinity", "+infinity", "-infinity", "1.#inf", "-1.#inf", "1.#qnan", "-1.#ind"}
)  # fmt: skip
OVERLOAD = frozenset(
    sign + word
    for sign in ("", "+", "-")
    for word in ("ovld", "ol", "o.l", "overload", "overrange", "ovfl", "overflow", "oflow", "ovf")
)
#: What a meter answers out of range (SCPI). Bench software writes it as received between numbers with decimal commas.
_ANSWERED_OVERLOAD = re.compile(r"[-+]?(?:9\.9[01]?0*e\+?37|1(?:\.0*)?e\+?38)")

COMMENT = ("#", "%", "//", "!")
_DELIMITERS = (",", ";", "\t", "|", " ")
_NAMES = {"tab": "\t", "\\t": "\t", "blank": " ", "space": " ", "comma": ",", "semicolon": ";", "": " "}
_NUMERIC_PREAMBLE = 10

_INTEGER = re.compile(r"[+-]?\d+")
_POINT, _COMMA = re.compile(NUMBER["."]), re.compile(NUMBER[","])
_NAME = re.compile(r"[^\W\d_][\w.°µ²√/-]*(?: [\w.-]+){0,2}(?:\s*[\[(][^\[\]()]*(?:\([^()]*\))?[\])])?")
_HEXADECIMAL = re.compile(r"(?:0[xX])?(?:[0-9A-Fa-f]{2}){1,128}")
#: A line of candump: (1700000000.000000) can0 320#2200520021005F
_CAN_FRAME = re.compile(r"\(\d+\.\d+\) \S+ ([0-9A-F]+)#[0-9A-F]*")
_BETWEEN = re.compile(r"[,;\s]+")
_GROUPS = r"[-+]?(?:\d{1,3}(?:\.\d{3})+,\d+|\d{1,3}(?:,\d{3})+\.\d+)"
#: 3.728,01 or 1,234.5 in a cell of its own.
_THOUSANDS = re.compile(
    rf"(?:^|[;\t|\"])[ ]*({_GROUPS})[ ]*[;\t|\"]|[;\t|\"][ ]*({_GROUPS})[ ]*$"
    "|(?<![\\w'\u2019])([-+]?\\d{1,3}(?:['\u2019\u00a0\u202f\u2009]\\d{3})+)(?!\\d)"  # never a decimal sign
)
#: "16,384" among cells whose delimiter is a comma, and any other number with a comma in quotes.
_QUOTED = re.compile(r'"[ ]*([-+]?\d*,[\d,.eE+-]*\d)[ ]*"')
_QUOTED_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+")
#: What MATLAB displays above a matrix.
_COMMON_FACTOR = re.compile(r"(1\.0e[-+]\d+) \*")
#: What may stand before the names of the columns.
_ANNOUNCED = re.compile(r"^\s*(?:columns?|fields?|channels?|header|names?|format)\s*[:=]\s*", re.IGNORECASE)
#: What tells a spreadsheet program the delimiter, in the first line.
_SEPARATOR = re.compile(r'"?sep=.?"?', re.IGNORECASE)
#: Headings of columns that hold units.
_NAMES_UNITS = re.compile(r"unit|einheit|unit[eé]|unidad|\buom\b|dimension", re.IGNORECASE)
#: Different marks behind the numbers of a column; more are words that begin with digits.
_MARKS = 3
#: Different units in a column of units: a meter that changes its range is refused, by name.
_RANGES = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Dialect:
    """How a text table is written.

    Attributes
    ----------
    delimiter : str
        "," ";" "|" tab, " " for any run of blanks and tabs, "" where there is one column only.
    decimal : str
    quoted : bool
        Some cells stand in double quotes.
    kinds : tuple of str
        Per column: "i" whole numbers, "f" numbers, "x" text, "e" empty, or the name of a date format.
    skip : int
        Physical lines before the first row of data.
    headings, units : tuple of str
        One per column, "" where there is none.
    header_lines, preamble : tuple of str
        The header as it stands there (it may be repeated further down), and the other lines before the data.
    record : tuple of int and str, or None
        Only lines with this word in this column are data.
    unit_columns : mapping of int to int
        Column of numbers -> the column behind it, in which the unit stands in each row.
    guesses : tuple of str
    """

    delimiter: str
    decimal: str
    quoted: bool
    kinds: tuple[str, ...]
    skip: int
    headings: tuple[str, ...]
    units: tuple[str, ...]
    header_lines: tuple[str, ...]
    preamble: tuple[str, ...]
    record: tuple[int, str] | None = None
    unit_columns: Mapping[int, int] = field(default_factory=dict)
    guesses: tuple[str, ...] = ()


def detect(
    head: Sequence[str],
    rest: Sequence[str],
    *,
    delimiter: str | None,
    decimal: str | None,
    variable: str | None,
    kinds_of_rows: KindsOfRows | None = None,
    name: str,
) -> Dialect:
    """Find the dialect.

    Parameters
    ----------
    head : sequence of str
        Whole lines from the beginning of the file.
    rest : sequence of str
        Whole lines from the middle and the end.
    delimiter, decimal, variable : str or None
        What the caller says.
    kinds_of_rows : KindsOfRows, optional
        Where rows are of several kinds; `variable` is then the one to read.
    name : str
        The file, for messages.

    Raises
    ------
    FormatError
        No table of numbers, or rows of varying length.
    LimitError
        More than 4096 columns.
    """
    delimiter = _NAMES.get(delimiter, delimiter) if delimiter is not None else None
    _check_options(delimiter, decimal)
    guesses: list[str] = []
    record = None if kinds_of_rows is None else (kinds_of_rows.column, variable or "")
    if record is None:
        voters = _voters(head, rest)
    else:  # before any are left out: kinds may take turns
        of_kind = [[line for line in lines if is_of_kind(line, record)] for lines in (head, rest)]
        voters = _voters(*of_kind)
    if decimal != ".":
        _refuse_thousands(voters, name)
    if decimal is None:
        _refuse_quoted_thousands(voters, name)
    vote = _vote(voters, head, delimiter, decimal, name, guesses)
    quoted = any('"' in line for line in voters)
    rows = [split(line, vote.delimiter, quoted) for line in voters]
    rows = [row for row in rows if len(row) == vote.count]
    # In a short text the header is among the voters: a row without a number says nothing about the columns.
    rows = [row for row in rows if any(kind_of(c, vote.decimal) in "ifs" for c in row)]
    kinds = [column_kind([row[i] for row in rows], vote.decimal) for i in range(vote.count)]
    if not any(k in ("i", "f") for k in kinds):
        raise _no_table(head, name)
    first = _first_row(head, record, kinds, vote, quoted, name)
    skip = _numeric_preamble(head, first, kinds, vote, quoted, guesses)
    before = head[: first if record is None else _first_record(head, record)]
    if record is None:
        _refuse_other_rows(before, vote, quoted, name)
    header, preamble = (
        _header(before, vote, kinds[-1] == "e", quoted) if skip == first else ([], _filled(before))
    )
    headings, units = names_and_units([h.cells for h in header], vote.count)
    return Dialect(
        delimiter=vote.delimiter,
        decimal=vote.decimal,
        quoted=quoted,
        kinds=tuple(kinds),
        skip=skip,
        headings=headings,
        units=units,
        header_lines=tuple(h.line for h in header),
        preamble=(*preamble, *head[first:skip]),
        record=record,
        unit_columns=_unit_columns(rows, kinds, headings),
        guesses=tuple(guesses),
    )


def _check_options(delimiter: str | None, decimal: str | None) -> None:
    if delimiter is not None and delimiter not in _DELIMITERS:
        raise InputError(f"delimiter must be one of , ; | tab blank, not {delimiter!r}")
    if decimal is not None and decimal not in (".", ","):
        raise InputError(f"decimal must be . or , not {decimal!r}")


def _refuse_thousands(lines: Sequence[str], name: str) -> None:
    """A sign between the thousands reads as a decimal sign or as the end of a cell: never guessed."""
    marks = [
        match[1] or match[2] or match[3] for line in lines if (match := _THOUSANDS.search(line.rstrip()))
    ]
    if len(marks) > 0.25 * len(lines):
        raise FormatError(
            f"{name}: {marks[0]!r} has a thousands separator; write the numbers without it, as in "
            f"{_without_thousands(marks[0])!r}"
        )


def _refuse_quoted_thousands(lines: Sequence[str], name: str) -> None:
    """In quotes, "16,384" in every cell with a comma: thousands, or a decimal comma."""
    quoted = [number for line in lines for number in _QUOTED.findall(line)]
    if len(quoted) > 0.25 * len(lines) and all(map(_QUOTED_THOUSANDS.fullmatch, quoted)):
        number = quoted[0]
        raise FormatError(
            f"{name}: {number!r} is {number.replace(',', '')}, or {number.replace(',', '.')} with a "
            "decimal comma. Write it without a thousands separator, or pass --decimal , (decimal= in Python)"
        )


def _without_thousands(number: str) -> str:
    number = re.sub("['\u2019\\s]", "", number)
    return number.replace("." if number.rfind(",") > number.rfind(".") else ",", "")


def _refuse_other_rows(before: Sequence[str], vote: _Vote, quoted: bool, name: str) -> None:
    """Rows of numbers before the table, of another number of cells: samples as well, and no preamble."""
    counts = Counter(
        len(cells)
        for cells in (split(line, vote.delimiter, quoted) for line in before if not _is_comment(line))
        if len(cells) > 1 and all(kind_of(c, vote.decimal) in "ifmod" for c in cells)
    )
    if counts.total() > _NUMERIC_PREAMBLE:
        listed = ", ".join(map(str, sorted({*counts, vote.count})))
        raise FormatError(
            f"{name}: rows of {listed} cells: {counts.total()} rows before the first with {vote.count}. "
            "If the file contains several tables, write each to a separate file"
        )
    for line in before:
        if match := _COMMON_FACTOR.fullmatch(line.strip()):
            raise FormatError(
                f"{name}: the numbers have the common factor {match[1]} of a MATLAB display, and few "
                "digits. Write them with writematrix or save"
            )


# -- cells -------------------------------------------------------------------------------------------------


def split(line: str, delimiter: str, quoted: bool) -> list[str]:
    """Cells of a line, without the blanks around them."""
    if delimiter == " ":
        return line.split()
    if delimiter == "":
        return [line.strip().strip('"')]
    if quoted and '"' in line:
        try:
            return [c.strip() for c in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]
        except (csv.Error, StopIteration):
            return [line]
    return [c.strip() for c in line.split(delimiter)]


@lru_cache(maxsize=8192)
def kind_of(cell: str, decimal: str) -> str:
    """i whole number, f number, m missing, o overload, d date, s number with a suffix, x other text."""
    if _INTEGER.fullmatch(cell):
        return "i"
    if (_POINT if decimal == "." else _COMMA).fullmatch(cell):
        return "f"
    word = cell.lower()
    if word in MISSING:
        return "m"
    if word in OVERLOAD or (decimal == "," and _ANSWERED_OVERLOAD.fullmatch(word)):
        return "o"
    if date_format(cell):
        return "d"
    return "s" if split_suffix(cell, decimal) else "x"


def column_kind(cells: Sequence[str], decimal: str) -> str:
    kinds = Counter(kind_of(c, decimal) for c in cells)
    filled = sum(kinds.values()) - kinds["m"] - kinds["o"]
    if filled == 0:
        return "e" if all(c == "" for c in cells) else "f"
    if kinds["i"] + kinds["f"] == filled:
        packed = packed_format([c for c in cells if kind_of(c, decimal) in "if"])
        if packed:
            return packed
    if kinds["i"] + kinds["f"] >= 0.6 * filled:
        return "f" if kinds["f"] else "i"
    if kinds["i"] + kinds["f"] + kinds["s"] >= 0.6 * filled and _of_few_marks(cells, decimal):
        return "f"
    if kinds["d"] >= 0.6 * filled:
        formats = Counter(f for f in map(date_format, cells) if f)
        return NUMBERS if formats[NUMBERS] and formats["iso8601"] else formats.most_common(1)[0][0]
    return "x"


def _of_few_marks(cells: Sequence[str], decimal: str) -> bool:
    """Numbers with a unit or a mark behind them, not words that begin with digits."""
    parts = [part for part in (split_suffix(cell, decimal) for cell in cells) if part is not None]
    marks = {mark for _, mark in parts}
    return len(marks) <= _MARKS and (len({n for n, _ in parts}) > 1 or all(is_unit(m) for m in marks))


def _unit_columns(rows: Sequence[Sequence[str]], kinds: list[str], headings: Sequence[str]) -> dict[int, int]:
    """Columns of words that hold the unit of the number before: 0.12 deg/s 24.1 °C; V and mV in turn are units, too."""
    places: dict[int, int] = {}
    for i in range(1, len(kinds)):
        if (
            kinds[i] != "x"
            or kinds[i - 1] not in ("i", "f")
            or (headings[i] and not _NAMES_UNITS.search(headings[i]))
        ):
            continue
        words = {row[i] for row in rows} - {""}
        if 1 <= len(words) <= _RANGES and None not in (classes := {measures(word) for word in words}):
            places |= {i - 1: i} if len(classes) == 1 else {}
    named = kinds[-1] in ("i", "f") and kinds.count("x") > len(places) and not any(headings)
    return {} if named else places  # T,24.1,V,1.5: the words are names of the numbers behind them


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(COMMENT)


def _without_comment(line: str) -> str:
    return line.strip().lstrip("#%!/").strip()


# -- the vote ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Vote:
    delimiter: str
    decimal: str
    count: int
    score: float


def _voters(head: Sequence[str], rest: Sequence[str]) -> list[str]:
    """Lines that are likely data: the later ones of the head (a preamble stands in front), and the others."""
    plain = [line for line in head if line.strip() and not _is_comment(line)]
    late = plain[len(plain) // 3 :] if len(plain) > 6 else plain
    step = max(len(late) // 100, 1)
    return late[::step] + [line for line in rest if line.strip() and not _is_comment(line)]


def _vote(
    lines: Sequence[str],
    head: Sequence[str],
    delimiter: str | None,
    decimal: str | None,
    name: str,
    guesses: list[str],
) -> _Vote:
    pairs = [
        (sep, dec)
        for sep in (*_DELIMITERS, "")
        for dec in (".", ",")
        if delimiter in (None, sep) and decimal in (None, dec)
    ]
    votes = _votes(lines, pairs, name)
    if not votes:
        raise _no_table(head, name)
    # Most numbers; then most columns; then the order of the list, in which the decimal point comes first.
    best = max(votes, key=lambda v: (round(v.score, 2), v.count))
    if (
        best.delimiter == ","
        and best.decimal == "."
        and best.count == 2
        and delimiter is None
        and decimal is None
    ):
        single = next((v for v in votes if v.delimiter == "" and v.decimal == ","), None)
        if single is not None and single.score >= best.score and _one_number(lines, head):
            guesses.append(
                "every line has one comma and looks like one number: read as a decimal comma "
                "(delimiter=',' if these are two columns)"
            )
            return single
    if best.count == 1 and best.delimiter:
        best = _Vote("", best.decimal, 1, best.score)
    return best


def _votes(lines: Sequence[str], pairs: Sequence[tuple[str, str]], name: str) -> list[_Vote]:
    """What each delimiter with each decimal mark makes of the lines, where it makes something."""
    quotes = any('"' in line for line in lines)
    # a delimiter that no line holds leaves each line whole: one vote for all of them
    absent = {
        sep for sep in (*_DELIMITERS, "") if sep != " " and not any(sep in line for line in lines if sep)
    }
    whole: dict[str, _Vote | None] = {}
    votes = []
    for sep, dec in pairs:
        if sep == dec and not quotes:
            continue
        if quotes or sep not in absent:
            vote = _score(lines, sep, dec, name, quotes)
        else:
            if dec not in whole:
                whole[dec] = _score(lines, "", dec, name, quotes)
            vote = whole[dec]
        if vote is not None:
            votes.append(replace(vote, delimiter=sep))
    return votes


def _no_table(head: Sequence[str], name: str) -> FormatError:
    filled = [line.strip() for line in head if line.strip()]
    hint = ""
    words = [word for line in filled[-100:] for word in _BETWEEN.split(line)]
    if words and sum(_HEXADECIMAL.fullmatch(word) is not None for word in words) > 0.8 * len(words):
        hint = ". If these are hexadecimal words, a layout with 'lines:' reads them (--layout)"
    elif frame := _CAN_FRAME.match((filled or [""])[0]):
        hint = (
            ". These are frames of a CAN bus. Write those of one identifier as words, in its folder: sed -nE "
            f"'s/^\\(([0-9.]+)\\) \\S+ {frame[1]}#([0-9A-F]+).*/\\1,\\2/p' {for_shell(name)} >frames.txt, and read "
            "frames.txt by a layout with 'lines:' (--layout)"
        )
    return FormatError(
        f"{name}: no table of numbers in this text (it begins {(filled or [''])[0][:60]!r}){hint}"
    )


def _score(lines: Sequence[str], delimiter: str, decimal: str, name: str, quotes: bool) -> _Vote | None:
    rows = [split(line, delimiter, quotes) for line in lines]
    counts = Counter(len(row) for row in rows)
    if not counts:
        return None
    count = max(counts, key=lambda c: (counts[c], c))
    refuse_more(count, COLUMNS, "columns", name, "Write those that are needed to a file of their own")
    fitting = [row for row in rows if len(row) == count]
    kinds = [_kinds_of(row, decimal) for row in fitting]
    useful = [k for k in kinds if not {"i", "f", "s"}.isdisjoint(k)]
    if not useful:
        return None
    numbers = sum(sum(x in "ifmodsu" for x in k) / count for k in useful) / len(useful)
    return _Vote(delimiter, decimal, count, numbers * len(useful) / len(rows))


def _kinds_of(row: Sequence[str], decimal: str) -> list[str]:
    """Kinds of the cells of a row; u for a unit behind its number."""
    kinds = [kind_of(c, decimal) for c in row]
    for i in range(1, len(kinds)):
        if kinds[i] == "x" and kinds[i - 1] in "if" and like_a_unit(row[i]):
            kinds[i] = "u"
    return kinds


def _one_number(lines: Sequence[str], head: Sequence[str]) -> bool:
    """True if "0,0012" is one number: unsigned digits of equal width or with leading zeros after the comma."""
    parts = [line.strip().split(",") for line in lines]
    if any(len(p) != 2 or not p[1].isdecimal() or not _INTEGER.fullmatch(p[0] or "0") for p in parts):
        return False
    first = next((i for i, line in enumerate(head) if line.strip() == lines[0].strip()), 0)
    if any("," in line for line in head[:first] if line.strip() and not _COMMA.fullmatch(line.strip())):
        return False  # a header with two names
    whole = [float(p[0] or 0) for p in parts]
    steps = {b - a for a, b in zip(whole, whole[1:], strict=False)}
    if len(steps) == 1 and steps != {0} and len(whole) > 2:
        return False  # the first part counts: a column of its own
    widths = {len(p[1]) for p in parts}
    return len(widths) == 1 or any(p[1][0] == "0" and len(p[1]) > 1 for p in parts)


# -- where the data begin ----------------------------------------------------------------------------------


def _first_row(
    head: Sequence[str],
    record: tuple[int, str] | None,
    kinds: Sequence[str],
    vote: _Vote,
    quoted: bool,
    name: str,
) -> int:
    for i, line in enumerate(head):
        if not line.strip() or _is_comment(line) or (record is not None and not is_of_kind(line, record)):
            continue
        cells = split(line, vote.delimiter, quoted)
        if len(cells) == vote.count and _fits(cells, kinds, vote.decimal):
            return i
    raise FormatError(f"{name}: the first rows differ from those that follow; is this one table?")


def _first_record(head: Sequence[str], record: tuple[int, str]) -> int:
    """First line of any kind: a word in its place, and numbers."""
    for i, line in enumerate(head):
        if word_at(line, record[0]) and any(c.isdigit() for c in line) and not _is_comment(line):
            return i
    return 0


def _fits(cells: Sequence[str], kinds: Sequence[str], decimal: str) -> bool:
    of_cells = [kind_of(c, decimal) for c in cells]
    # An oscilloscope writes its settings beside its first rows, in columns that are empty from there on.
    wanted = {"i": "ifmos", "f": "ifmos", "x": "ifmodsx", "e": "ifmodsx"}
    return any(f in "ifs" and k in "if" for f, k in zip(of_cells, kinds, strict=True)) and all(
        f in wanted.get(k, "dm") or (k not in wanted and packed_format([cell]) == k)
        for f, k, cell in zip(of_cells, kinds, cells, strict=True)
    )


def _numeric_preamble(
    head: Sequence[str], first: int, kinds: Sequence[str], vote: _Vote, quoted: bool, guesses: list[str]
) -> int:
    """First row of data behind rows of parameters: decimals in front of a table of whole numbers only."""
    if set(kinds) != {"i"}:
        return first
    for skip in range(first, min(first + _NUMERIC_PREAMBLE, len(head))):
        cells = split(head[skip], vote.delimiter, quoted)
        if len(cells) == vote.count and all(kind_of(c, vote.decimal) in "imo" for c in cells):
            if skip > first:
                guesses.append(
                    f"{skip - first} rows with decimals stand before {vote.count} columns of integers: "
                    "treated as parameters, not as samples"
                )
            return skip
    return first


# -- the header --------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _HeaderRow:
    line: str
    cells: list[str]


def _header(
    before: Sequence[str], vote: _Vote, open_end: bool, quoted: bool
) -> tuple[list[_HeaderRow], tuple[str, ...]]:
    """Header rows right before the data, at most three; and all other lines that are not blank."""
    rows: list[_HeaderRow] = []
    taken: set[int] = set()
    parted = False
    for i in range(len(before) - 1, -1, -1):
        line = before[i]
        if not line.strip():
            if rows:
                break
            parted = True
            continue
        cells = None if _SEPARATOR.fullmatch(line.strip()) else _header_cells(line, vote, open_end, quoted)
        if parted and _is_comment(line):  # a comment is a header only right above the data
            cells = None
        if cells is None or len(rows) == 3:
            if rows or not _is_comment(line):
                break
            continue
        rows.insert(0, _HeaderRow(line, cells))
        taken.add(i)
    return rows, _filled([line for i, line in enumerate(before) if i not in taken])


def _filled(lines: Sequence[str]) -> tuple[str, ...]:
    return tuple(line for line in lines if line.strip())


def _header_cells(line: str, vote: _Vote, open_end: bool, quoted: bool) -> list[str] | None:
    """Cells of a header row, or None if the line is none."""
    commented = _is_comment(line)
    text = _ANNOUNCED.sub("", _without_comment(line) if commented else line.strip("\r\n"))
    cells = split(text, vote.delimiter, quoted=True)  # a name may be quoted where no sample is
    if len(cells) != vote.count:
        cells = split(text, vote.delimiter, quoted)
    if vote.delimiter == " " and len(cells) != vote.count:  # names with single blanks in them
        cells = [c.strip() for c in re.split(r"\s{2,}|\t", text.strip())]
    if len(cells) == vote.count + 1 and not cells[-1]:
        cells = cells[:-1]
    if len(cells) == vote.count - 1 and open_end:
        cells = [*cells, ""]  # rows that end in a delimiter, under a header that does not
    if len(cells) != vote.count:
        return _otherwise_separated(text, vote)
    filled = [c for c in cells if c]
    words = sum(kind_of(c, vote.decimal) not in "if" for c in filled)
    if not filled or words < 0.6 * len(filled):
        return None
    if vote.count == 1 and not commented and _is_name(filled[0]):
        return cells
    if (commented or vote.count == 1) and not _recognised(filled):
        return None
    return cells


def _otherwise_separated(text: str, vote: _Vote) -> list[str] | None:
    """Cells of a header with another delimiter than the data: known names, all of them where blanks separate them."""
    for sep in _DELIMITERS if vote.count > 1 else ():
        cells = split(text, sep, quoted=True)
        if len(cells) != vote.count:
            continue
        if all(map(_is_known, cells)) if sep == " " else _recognised(cells):
            return cells
    return None


def _is_name(cell: str) -> bool:
    """True for what names the only column: a word or two that are no sentence and state nothing."""
    return _NAME.fullmatch(cell) is not None and len(cell) <= 40


def _recognised(cells: Sequence[str]) -> bool:
    """True if half of the cells at least are names or units that sensors have (and not words of a sentence)."""
    known = max(sum(map(_is_known, cells)), sum(is_unit(c) for c in cells))
    of_curve = any(names_averaging_times(c) for c in cells)
    return (of_curve or known >= 0.5 * len(cells)) and not any(":" in c or "=" in c for c in cells)


def _is_known(cell: str) -> bool:
    heading = read_heading(cell)
    return bool(heading.group or heading.unit) and len(heading.name) < 40
