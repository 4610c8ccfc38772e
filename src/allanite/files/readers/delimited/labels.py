# SPDX-License-Identifier: BSD-3-Clause
"""Logs whose cells are labeled, ``T:0 GX:-0.017`` or ``{"t": 0.01, "gx": 1.2}``: handed on as plain rows of cells.

Values go by their label, not by their place: a label may be missing from a line, or stand elsewhere in it. A line that
breaks with the others (a label twice, a value that is no number) becomes a row of missing samples, so that those behind
it keep their place; a line without any label of the log is left out. All of them are counted.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import field
from itertools import accumulate
from typing import Final

from allanite.errors import FormatError, InputError
from allanite.files.readers.delimited.dates import date_format
from allanite.files.readers.delimited.dialect import COMMENT, Dialect, column_kind, kind_of
from allanite.files.readers.delimited.label_lines import LabeledLine, read_json, read_labels, series_of
from allanite.files.readers.delimited.sentences import DAMAGED
from allanite.files.readers.delimited.suffixes import NUMBER, split_suffix
from allanite.files.readers.headings import is_unit, read_heading
from allanite.files.readers.row_identity import MOST_SENSORS
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.limits import COLUMNS, refuse_more
from allanite.recording.channel_names import for_shell

__all__ = ["Labels", "find_labels"]

_MOST = 0.6  # of the lines that are looked at
_FEWEST = 3
_TRIED = 60  # lines from which a plain table is told
_RARE = 0.002  # of the lines: a label that stands in fewer of them is a typing error of the wire
_SAMPLE = 400  # lines whose rows are kept to look for a column that names sensors
_PLANS = 64  # forms of lines that are remembered
_LISTED = 20  # unknown labels that are counted by name
_PARTS_SHOWN = 8
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
#: A label and its number, as in X0.12 or ax=0.1; and lines that end in two of them with nothing between, or hold
#: nothing but numbers that follow their labels without a sign.
_PAIR = re.compile(rf"([A-Za-z_]+)[:=]?({_NUMBER})")
_JOINED = re.compile(
    rf"(?<![\w.+-])(?:[A-Za-z_]+[:=]?{_NUMBER}){{2,}}[A-Za-z/]*\s*$|^\s*(?:[A-Za-z_]+{_NUMBER}[\s,;|]*){{2,}}$"
)
_EXPONENT = re.compile(r"(?<=\d)[eE][-+]?\d+")
_LONGEST = 1000  # characters of a line that are looked at
_JOINED_MOST = 0.8  # of the lines, all with the same labels: hexadecimal words differ
_CELL: Final = str.maketrans("\t\r\n\x18", "    ")

Read = Callable[[str], LabeledLine | None]
Key = tuple[str, int]


@dataclass(slots=True)
class Labels:
    """How the labeled values of a text become rows.

    Attributes
    ----------
    dialect : Dialect
        Of the rows that `piece` gives.
    sample : list of str
        Rows of the lines that were looked at.
    damaged : int
        Lines so far that became a row of missing samples.
    stray : int
        Lines so far that are not blank and hold no label of the log.
    lacking : int
        Lines so far that lack a label; `absent` says which, and how often.
    unknown : Counter
        Labels that were met too seldom, or too late, to be a channel; the first 20.
    """

    dialect: Dialect
    codec: str
    sample: list[str] = field(repr=False)
    damaged: int = 0
    stray: int = 0
    lacking: int = 0
    absent: Counter[str] = field(default_factory=Counter)
    unknown: Counter[str] = field(default_factory=Counter)
    _read: Read = field(repr=False, default=read_json)
    _form: _Form = field(repr=False, kw_only=True)
    _marks: dict[int, set[str]] = field(repr=False, default_factory=dict)
    _plans: dict[tuple[str, ...], _Plan] = field(repr=False, default_factory=dict)

    def piece(self, piece: bytes) -> bytes:
        """Whole lines of the text as rows; `DAMAGED` for one that breaks with the others."""
        sign = self.dialect.decimal
        numbers = re.compile(rf"(?<![\w.{sign}])({NUMBER[sign]})(?![.\d])")
        rows = []
        for line in re.split(r"\r\n|\n|\r", piece.decode(self.codec, "replace")):
            if not line:
                continue
            parts = numbers.split(line)
            plan = self._plans.get(tuple(parts[::2]))
            row = plan.row(parts) if plan else self._row(line, parts)
            if plan and plan.absent:
                self._count_absent(plan.absent)
            if row is not None:
                rows.append(row)
        return "".join(row + "\n" for row in rows).encode()

    def _row(self, line: str, parts: list[str]) -> str | None:
        """The row of a line that is not of a form that is known yet."""
        read = self._read(line)
        cells = None if read is None else self._form.cells(read)
        if read is None or cells is None:
            plain = line.strip()
            self.stray += bool(
                plain.strip("[]{}") and not plain.startswith(COMMENT) and not self._is_other(read)
            )
            return None
        if cells.damaged or not all(self._fits(k, cell) for k, cell in enumerate(cells.row) if cell):
            self.damaged += 1
            return DAMAGED.decode()
        for name in cells.unknown:
            if name in self.unknown or len(self.unknown) < _LISTED:
                self.unknown[name] += 1
        self._count_absent(cells.absent)
        plan = None if cells.unknown else _Plan.of(cells, read.values, parts)
        if plan is not None and len(self._plans) < _PLANS:
            self._plans[tuple(parts[::2])] = plan
        return "\t".join(cells.row).translate(_KEEP_TABS)

    @property
    def of_kinds(self) -> bool:
        """Lines of another kind are passed over."""
        return bool(self._form.others)

    def _is_other(self, read: LabeledLine | None) -> bool:
        return read is not None and any(label in self._form.others for label, _ in read.pairs)

    def _count_absent(self, names: Sequence[str]) -> None:
        self.lacking += bool(names)
        self.absent.update(names)

    def _fits(self, column: int, cell: str) -> bool:
        """A cell is what its column holds: garbage of the wire is not."""
        wanted, decimal = self.dialect.kinds[column], self.dialect.decimal
        if wanted in ("x", "e"):
            return True
        kind = kind_of(cell, decimal)
        if wanted not in ("i", "f"):
            return kind in "mo" or date_format(cell) is not None
        if kind == "s":
            part = split_suffix(cell, decimal)
            return part is not None and (part[1] in self._marks.get(column, ()) or is_unit(part[1]))
        return kind in "ifmo"


_KEEP_TABS = {code: blank for code, blank in _CELL.items() if code != ord("\t")}


@dataclass(frozen=True, slots=True)
class _Cells:
    row: list[str]
    order: list[int]  # column of each value, as they stand in the line
    absent: tuple[str, ...]
    unknown: tuple[str, ...]
    damaged: bool


@dataclass(frozen=True, slots=True)
class _Plan:
    """Which number of a line goes to which column, for lines that differ in their numbers only."""

    numbers: tuple[int, ...]  # by column; -1 for an empty one
    behind: tuple[str, ...]
    absent: tuple[str, ...]

    @classmethod
    def of(cls, cells: _Cells, values: list[str], parts: list[str]) -> _Plan | None:
        """None where the values are not all numbers, or other numbers stand between them."""
        numbers = parts[1::2]
        values = [value for value in values if value]
        if len(values) != len(numbers) or len(cells.order) != len(values):
            return None
        places, behind = [-1] * len(cells.row), [""] * len(cells.row)
        for k, (value, number, column) in enumerate(zip(values, numbers, cells.order, strict=True)):
            if not value.startswith(number):
                return None
            if column >= 0:
                places[column], behind[column] = 2 * k + 1, value[len(number) :]
        if [place < 0 for place in places] != [cell == "" for cell in cells.row]:
            return None
        return cls(tuple(places), tuple(behind) if any(behind) else (), cells.absent)

    def row(self, parts: list[str]) -> str:
        cells = [parts[place] if place >= 0 else "" for place in self.numbers]
        if self.behind:
            cells = [cell + behind for cell, behind in zip(cells, self.behind, strict=True)]
        return "\t".join(cells)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Form:
    """Which label goes where.

    Attributes
    ----------
    groups : frozenset of str
        Labels without a value, before those of their sensor: "Accel: x=0.1 y=0.2".
    places : int
        Cells in front of the labels.
    widths : dict of Key to int
        Values of each label, in the order of the columns. A label may stand twice in each line.
    repeated : dict of str to int
        How often.
    others : frozenset of str
        Labels of lines of another kind.
    starts : dict of Key to int
        First column of each label.
    columns : int
    """

    groups: frozenset[str]
    places: int
    widths: dict[Key, int]
    repeated: dict[str, int]
    others: frozenset[str] = frozenset()
    starts: dict[Key, int] = field(init=False, repr=False)
    columns: int = field(init=False)

    def __post_init__(self) -> None:
        ends = list(accumulate(self.widths.values(), initial=self.places))
        object.__setattr__(self, "starts", dict(zip(self.widths, ends, strict=False)))
        object.__setattr__(self, "columns", ends[-1])

    def cells(self, read: LabeledLine) -> _Cells | None:
        """The row of a line; None where it has no label of the log."""
        named = keyed(read, self.groups)
        mine = [key for key, _ in named if key in self.widths]
        if not mine:
            return None
        counts = Counter(label for label, _ in mine)
        often = Counter(label for (label, _), _ in named if label in counts)
        damaged = any(
            often[label] != self.repeated[label]
            for label in counts
            if often[label] > 1 or self.repeated[label] > 1
        )
        fronted = len(read.before) == self.places
        row = [*(read.before if fronted else [""] * self.places), *[""] * (self.columns - self.places)]
        there = set[Key]()
        for key, values in dict(named).items():  # lines of few labels of a wide log cost what they hold
            start, width = self.starts.get(key, 0), self.widths.get(key)
            if width is None:
                continue
            damaged |= len(values) not in (0, width)
            if any(values):
                there.add(key)
            if len(values) == width:
                row[start : start + width] = values
        absent = tuple(key[0] for key in self.widths if key not in there)
        places = list(range(self.places)) if fronted else [-1] * len(read.before)
        for key, values in named:
            begin = self.starts.get(key)
            places += [-1 if begin is None else begin + k for k, value in enumerate(values) if value]
        unknown = tuple(key[0] for key, _ in named if key not in self.widths)
        return _Cells(row, places, absent, unknown, damaged)

    @property
    def headings(self) -> tuple[str, ...]:
        """Names of the columns: the labels, with an axis or a number where one has several values."""
        names = [""] * self.places
        for (label, occurrence), width in self.widths.items():
            name = label if occurrence == 1 else _beside(label, f"_{occurrence}")
            ends = "xyz" if width == 3 else range(width)
            names += [name] if width == 1 else [_beside(name, f"_{end}") for end in ends]
        return tuple(names)


def _beside(label: str, end: str) -> str:
    """A label with an ending before its unit: GX[deg/s] becomes GX_x [deg/s]."""
    heading = read_heading(label)
    return heading.name + end + (f" [{heading.unit}]" if heading.unit else "")


def keyed(read: LabeledLine, groups: frozenset[str]) -> list[tuple[Key, tuple[str, ...]]]:
    """The labels of a line, called after their group too, and how often each was there before."""
    counts: Counter[str] = Counter()
    group, keys = "", []
    for label, values in read.pairs:
        if label in groups:
            group = f"{label}_"
            continue
        counts[group + label] += 1
        keys.append(((group + label, counts[group + label]), values))
    return keys


# -- finding -----------------------------------------------------------------------------------------------


def _refuse_several_series(lines: Sequence[str], name: str) -> None:
    """Tags of the line protocol tell sensors apart: the same fields under several of them are not one series."""
    by_fields: dict[tuple[str, ...], list[str]] = {}
    for series, fields in filter(None, map(series_of, lines)):
        by_fields.setdefault(fields, []).append(series)
    for lines_of_series in by_fields.values():
        several = list(dict.fromkeys(lines_of_series))
        if 2 <= len(several) <= MOST_SENSORS and len(lines_of_series) >= 3 * len(several):
            raise InputError(
                f"{name}: tags distinguish several sensors or records: {'; '.join(several)}; write the lines of each "
                f"to a separate file, as in grep {for_shell(f'^{several[0]} ')} {for_shell(name)}"
            )


def find_labels(
    head: Sequence[str],
    rest: Sequence[str],
    *,
    decimal: str | None,
    variable: str | None,
    codec: str,
    name: str,
) -> Labels | None:
    """How the labeled values of a text are read; None for a text of another kind.

    Parameters
    ----------
    head, rest : sequence of str
        Whole lines from the beginning of the file, and from its middle and end.
    decimal, variable : str or None
        What the caller says; a label, where lines are of several kinds.
    codec : str
        Of the bytes that `Labels.piece` takes.
    name : str
        The file, for messages.

    Raises
    ------
    InputError
        Lines of several kinds and no word which to take, or commas that may be decimal signs or not.
    LimitError
        More than 4096 columns.
    """
    looked = [line for line in (*head, *rest) if line.strip() and not line.lstrip().startswith(COMMENT)]
    tried = looked[:: max(len(looked) // _TRIED, 1)]
    of_json = sum(line.lstrip(" \t[").startswith(('{"', '{ "')) for line in tried) >= _MOST * len(tried)
    _refuse_joined(tried, name)
    if len(looked) < _FEWEST or not _mostly(tried, read_json if of_json else _of_text(".")):
        return None
    _refuse_several_series(looked, name)
    guesses: list[str] = []
    sign = "." if of_json else _decimal_of(tried, decimal, name, guesses)
    read = read_json if of_json else _of_text(sign)
    lines = [one for one in map(read, looked) if one is not None]
    groups = _groups_of(lines)
    known, others = _chosen(_known(lines, groups, len(looked), name), variable, name)
    form = _form_of(
        [one for one in lines if any(k in known for k, _ in keyed(one, groups))], groups, known, others
    )
    if form is None:
        return None
    refuse_more(
        len(form.headings), COLUMNS, "columns", name, "Write those that are needed to a file of their own"
    )
    return _labels(head, lines, form, sign, read, guesses, codec)


def _refuse_joined(lines: Sequence[str], name: str) -> None:
    """Refuse X0.12Y-0.03 and X0.12,Y-0.03: where a label, a number or a unit ends is for the writer to say."""
    joined = [(line, match[0]) for line in lines if (match := _JOINED.search(line[:_LONGEST]))]
    forms = Counter(tuple(re.findall(r"[A-Za-z_]+", _EXPONENT.sub("0", pairs))) for _, pairs in joined)
    if len(lines) < _FEWEST or not forms or forms.most_common(1)[0][1] < _JOINED_MOST * len(lines):
        return
    pairs = [f"{label}={number}" for label, number in _PAIR.findall(joined[0][1])]
    raise FormatError(
        f"{name}: labels and numbers are not separated in {joined[0][1].strip()[:40]!r}. Write a blank or a comma "
        f"between the pairs and = after each label, as in {' '.join(pairs[:_PARTS_SHOWN])!r}"
    )


def _of_text(decimal: str) -> Read:
    return lambda line: read_labels(line, decimal)


def _mostly(lines: Sequence[str], read: Read) -> bool:
    """Most lines hold numbers with a label, and hardly anything else."""
    good = 0
    for line in lines:
        labeled = read(line)
        values = [value for _, values in labeled.pairs for value in values] if labeled else []
        numbers = sum(kind_of(value, ".") in "ifmos" for value in values)
        bare = sum(kind_of(value, ".") in "if" for value in labeled.before) if labeled else 0
        good += numbers > 0 and numbers >= bare and (2 * numbers >= len(values) or read is read_json)
    return good >= _MOST * len(lines)


def _decimal_of(lines: Sequence[str], stated: str | None, name: str, guesses: list[str]) -> str:
    """The decimal sign; a comma where every label has two whole numbers with a comma between them.

    Raises
    ------
    InputError
        These may be two numbers, too.
    """
    if stated is not None:
        return stated
    vectors = any(re.search(r"\d,(?:[+-]\d|\d+,\d)", line) for line in lines)
    if vectors or not any(re.search(r"\d,\d", line) for line in lines):
        return "."
    point, comma = ([one for one in map(_of_text(sign), lines) if one] for sign in (".", ","))
    values = [value for one in point for _, values in one.pairs for value in values]
    written = [value for one in comma for _, values in one.pairs for value in values if "," in value]
    if not written or sum("." in value for value in values) >= len(written):
        return "."
    if sum(kind_of(value, ",") in "ifmosd" for value in written) < _MOST * len(written):
        return "."
    parts = [match[1] for value in written if (match := re.match(r"[+-]?\d+,(\d+)", value))]
    if len({len(part) for part in parts}) > 1 and not any(len(part) > 1 and part[0] == "0" for part in parts):
        raise InputError(
            f"{name}: a value such as {written[0]!r} is either one number with a decimal comma, or two. "
            "State which: --decimal , or --decimal . (decimal= in Python)"
        )
    guesses.append(
        "every comma is between two digits: read as a decimal comma (--decimal . if it separates two numbers)"
    )
    return ","


def _groups_of(lines: Iterable[LabeledLine]) -> frozenset[str]:
    """Labels that never have a value, and always another label behind them."""
    empty, valued = Counter[str](), set[str]()
    for one in lines:
        for k, (label, values) in enumerate(one.pairs):
            if values or k == len(one.pairs) - 1:
                valued.add(label)
            else:
                empty[label] += 1
    return frozenset(label for label, count in empty.items() if count > 1 and label not in valued)


def _known(lines: Sequence[LabeledLine], groups: frozenset[str], looked: int, name: str) -> list[list[Key]]:
    """Labels that are met again and again, in the order of their first line, and those that share lines together."""
    counts: Counter[Key] = Counter()
    for one in lines:
        counts.update(key for key, values in keyed(one, groups) if values)
    fewest = max(2.0, _RARE * looked)
    count = sum(count >= fewest for count in counts.values())
    refuse_more(count, COLUMNS, "labels", name, "Write those that are needed to a file of their own")
    parts = {key: k for k, key in enumerate(key for key, count in counts.items() if count >= fewest)}
    for one in lines:
        shared = {parts[key] for key, _ in keyed(one, groups) if key in parts}
        if len(shared) > 1:
            first = min(shared)
            parts = {key: first if part in shared else part for key, part in parts.items()}
    return [[key for key in parts if parts[key] == part] for part in dict.fromkeys(parts.values())]


def _chosen(parts: list[list[Key]], variable: str | None, name: str) -> tuple[list[Key], frozenset[str]]:
    """The labels of the lines to read, and those of other lines."""
    if len(parts) < 2:
        return (parts[0] if parts else []), frozenset()
    for part in parts:
        if variable is not None and any(label.casefold() == variable.casefold() for label, _ in part):
            others = {label for other in parts if other is not part for label, _ in other}
            return part, frozenset(others)
    shown = "; ".join(", ".join(label for label, _ in part) for part in parts[:_PARTS_SHOWN])
    more = f"; and {len(parts) - _PARTS_SHOWN} more" if len(parts) > _PARTS_SHOWN else ""
    raise InputError(
        f"{name}: labels that never share a line: {shown}{more}. If these are records of several types, "
        f"choose one by one of its labels, --variable {for_shell(parts[0][0][0])} (variable= in Python); "
        "if a sample spans several lines, write it to one line"
    )


def _form_of(
    lines: Sequence[LabeledLine], groups: frozenset[str], known: Sequence[Key], others: frozenset[str]
) -> _Form | None:
    if len(lines) < _FEWEST or not known:
        return None
    widths: dict[Key, Counter[int]] = {key: Counter() for key in known}
    often: dict[str, Counter[int]] = {label: Counter() for label, _ in known}
    for one in lines:
        named = keyed(one, groups)
        for key, values in named:
            if key in widths and values:
                widths[key][len(values)] += 1
        for label, count in Counter(label for (label, _), _ in named).items():
            if label in often:
                often[label][count] += 1
    repeated = {label: counts.most_common(1)[0][0] for label, counts in often.items()}
    return _Form(
        groups=groups,
        places=Counter(len(one.before) for one in lines).most_common(1)[0][0],
        widths={key: c.most_common(1)[0][0] for key, c in widths.items() if key[1] <= repeated[key[0]]},
        repeated=repeated,
        others=others,
    )


def _labels(
    head: Sequence[str],
    lines: Sequence[LabeledLine],
    form: _Form,
    decimal: str,
    read: Read,
    guesses: Sequence[str],
    codec: str,
) -> Labels | None:
    """The reader of a form, with what its columns hold."""
    columns = _columns(lines, form)
    kinds = tuple(column_kind(column, decimal) for column in columns)
    if not any(kind in ("i", "f") for kind in kinds):
        return None
    begins = next((i for i, line in enumerate(head) if (one := read(line)) and form.cells(one)), len(head))
    dialect = Dialect(
        delimiter="\t",
        decimal=decimal,
        quoted=False,
        kinds=kinds,
        skip=begins,
        headings=form.headings,
        units=("",) * len(kinds),
        header_lines=(),
        preamble=tuple(line for line in head[:begins] if line.strip()),
        guesses=tuple(guesses),
    )
    marks = {i: _marks(column, decimal) for i, column in enumerate(columns) if kinds[i] == "f"}
    cells = [form.cells(one) for one in lines[:_SAMPLE]]
    sample = ["\t".join(one.row) for one in cells if one is not None and not one.damaged]
    return Labels(dialect, codec, sample, _read=read, _form=form, _marks=marks)


def _columns(lines: Sequence[LabeledLine], form: _Form) -> list[list[str]]:
    """The cells of each column that hold something."""
    columns: list[list[str]] = [[] for _ in form.headings]
    starts, start = dict[Key, int](), form.places
    for key, width in form.widths.items():
        starts[key] = start
        start += width
    for one in lines:
        placed = [(0, one.before)] if len(one.before) == form.places else []
        placed += [
            (starts[key], values)
            for key, values in keyed(one, form.groups)
            if key in starts and len(values) == form.widths[key]
        ]
        for first, values in placed:
            for k, value in enumerate(values, first):
                if value:
                    columns[k].append(value)
    return columns


def _marks(cells: Sequence[str], decimal: str) -> set[str]:
    """What stands behind the numbers of a column more than once."""
    marks = Counter(part[1] for cell in cells if (part := split_suffix(cell, decimal)))
    return {mark for mark, count in marks.items() if count > 1}
