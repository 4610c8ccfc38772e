# SPDX-License-Identifier: BSD-3-Clause
"""Rows of several kinds in one text: ``ACC,t,x,y,z`` among ``GYRO,t,x,y,z``, the word in any column.

One kind is read at a time. All of them are listed, each with its rows in the whole file and its own rate.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from allanite.errors import InputError
from allanite.files.readers.column_look import rises
from allanite.files.readers.contents import FilePart, choose_part, has_channel, listed
from allanite.files.readers.delimited.dates import is_month
from allanite.files.readers.delimited.streams import TextStream
from allanite.files.readers.headings import FITTING, measures, read_heading
from allanite.files.readers.stamp_table import StampTable, TimeChoice
from allanite.files.readers.stamps import choose_time
from allanite.lazy_dataclasses import dataclass
from allanite.recording.channel_names import for_shell
from allanite.recording.records import ArrayColumn

__all__ = ["ChosenKind", "KindsOfRows", "choose_kind", "find_kinds", "is_of_kind", "line_pattern", "word_at"]

_NO_WORDS: Final = frozenset(
    {"nan", "inf", "null", "na", "none", "ovld", "ol", "overload", "undefined", "true", "false", "am", "pm"}
)
_MOST_KINDS, _MOST_COLUMNS = 20, 12
_SHARE = 0.9  # of the lines: so many have the word
_TRIED, _LIKELY = 20, 0.5  # lines that are tried first, and the share of them that must have one
_SENSORS = re.compile(r"gyr|acc|imu|mag|gps|gnss|baro|temp|ang|omega", re.IGNORECASE)
_LINES, _FEW = 400, 6  # lines that are looked at, one after another: kinds take turns
_COMMENT = ("#", "%", "//", "!")
_BLOCK = 16 << 20
_HEAD_ROWS = 400  # of a kind, from which its time is told
_CELL = r"[^,;\t|\"\r\n]*"


@dataclass(frozen=True, slots=True)
class KindsOfRows:
    """The column that holds the kind, -1 for the last, and the kinds that were met."""

    column: int
    kinds: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ChosenKind:
    """The kind of row to read.

    Attributes
    ----------
    name : str
    remarks : list of str
        Why, in words.
    contents : list of str
        All kinds of the file, in words.
    time : str or None
        Column of time and its unit, "2:us", as another kind tells them: all kinds have one clock.
    """

    name: str
    remarks: list[str]
    contents: list[str]
    time: str | None


@lru_cache(maxsize=64)
def _word(column: int) -> re.Pattern[str]:
    """A word in a column of a line."""
    word = r"\s*\"?\s*(\$?[A-Za-z][\w.$-]*)\"?\s*"
    if column < 0:
        return re.compile(rf".*[,;\t|]{word}$")
    if column == 0:
        return re.compile(rf"{word[:-3]}\s*[,;\t| ]")
    return re.compile(rf"\s*(?:\"?{_CELL}\"?[,;\t|]){{{column}}}{word}(?:[,;\t|]|$)")


def word_at(line: str, column: int) -> str | None:
    """The word in a column of a line; None where there is none."""
    match = _word(column).match(line)
    return match[1] if match and match[1].lower() not in _NO_WORDS else None


def is_of_kind(line: str, record: tuple[int, str]) -> bool:
    """True if a line has the word of a kind in its column."""
    return word_at(line, record[0]) == record[1]


def line_pattern(column: int, word: str) -> re.Pattern[bytes]:
    """Whole lines of a kind."""
    gap, cell, sign = rb"[ \t]*\"?[ \t]*", _CELL.encode(), rb"[,;\t|]"
    escaped = re.escape(word.encode()) + rb"(?![\w.$-])"
    if column < 0:
        return re.compile(rb"(?m)^[^\r\n]*" + sign + gap + escaped + rb"\"?[ \t]*(?:\r?\n|\r|\Z)")
    before = (
        rb""
        if column == 0
        else rb"(?:[ \t]*\"?" + cell + rb"\"?" + sign + rb"){" + str(column).encode() + rb"}"
    )
    return re.compile(rb"(?m)^" + before + gap + escaped + rb"[^\r\n]*(?:\r?\n|\r|\Z)")


def find_kinds(head: Sequence[str], rest: Sequence[str]) -> KindsOfRows | None:
    """The kinds of rows, where nearly every line has one of a few words in the same column.

    In the first two columns any words will do; in others (which may hold the words of a status) one must be that of a
    sensor.

    Parameters
    ----------
    head, rest : sequence of str
        Whole lines from the beginning of the file (a header may stand there), and from its middle and end.
    """
    plain = [line for line in head if line.strip() and not line.lstrip().startswith(_COMMENT)]
    late = plain[len(plain) // 3 :] if len(plain) > _FEW else plain
    lines = [*late[:_LINES], *(line for line in rest if line.strip())]
    some = lines[:: max(len(lines) // _TRIED, 1)]
    for column in (0, 1, -1, *range(2, _MOST_COLUMNS)):
        if sum(word_at(line, column) is not None for line in some) < _LIKELY * len(some):
            continue
        words = [word for line in lines if (word := word_at(line, column))]
        kinds = Counter(words)
        often = sum(count for count in kinds.values() if count > 1)  # a rare kind may be met once
        if often < _SHARE * len(lines) or not 2 <= len(kinds) <= _MOST_KINDS:
            continue
        if (column and _are_units(kinds)) or all(map(is_month, kinds)):
            continue  # of the numbers before them, or of a date
        if column in (0, 1) or any(map(_of_sensor, kinds)):
            return KindsOfRows(column, tuple(kinds))
    return None


def _of_sensor(kind: str) -> bool:
    return _SENSORS.search(kind) is not None or read_heading(kind).group in FITTING


def _are_units(kinds: Iterable[str]) -> bool:
    classes = {measures(kind) for kind in kinds}
    return len(classes) == 1 and None not in classes


def choose_kind(
    stream: TextStream, kinds: KindsOfRows, variable: str | None, channels: Sequence[str] | None, name: str
) -> ChosenKind:
    """The kind to read, and what else there is.

    Raises
    ------
    InputError
        No such kind, channels of two kinds, or none of an inertial sensor: which to take is for the caller to say.
    """
    parts, times = _parts(stream, kinds)
    known = {p.name: p for p in parts}
    variable = variable or _kind_of_channels(known, channels or (), name)
    if variable is None and not any(p.rank < _rank("") for p in parts):
        options = ", ".join(f"--variable {for_shell(kind)}" for kind in known)
        raise InputError(
            f"{name}: lines of several types: {'; '.join(listed(parts))}; choose one: {options} (variable= in Python)"
        )
    if variable is not None and variable not in known:
        raise InputError(f"{name}: no lines of kind {variable!r}; there are: {'; '.join(listed(parts))}")
    groups = [word for word in channels or () if any(has_channel(p, word) for p in parts)]
    part, remarks = choose_part(parts, variable, groups or None, file=name, option="variable", what="kind")
    return ChosenKind(name=part.name, remarks=remarks, contents=listed(parts), time=times[part.name])


def _kind_of_channels(kinds: Iterable[str], channels: Sequence[str], name: str) -> str | None:
    """The kind that the names of channels tell: GYRO, or GYRO_x."""
    by_kind: dict[str, str] = {}
    for word in channels:
        fitting = [k for k in kinds if f"{word}_".lower().startswith(f"{k}_".lower())]
        if fitting:
            by_kind.setdefault(max(fitting, key=len), word)
    if len(by_kind) > 1:
        raise InputError(
            f"{name}: the channels {', '.join(by_kind.values())} are in different types of lines, and one "
            f"type is read at a time: {' or '.join(f'--channels {for_shell(word)}' for word in by_kind.values())}"
        )
    return next(iter(by_kind), None)


def _rank(kind: str) -> int:
    group = read_heading(kind).group
    return 0 if group == "gyro" or "imu" in kind.lower() else 1 if group == "acc" else 2


def _parts(stream: TextStream, kinds: KindsOfRows) -> tuple[list[FilePart], dict[str, str | None]]:
    """Every kind of the file with its rows, in the order in which they are met; and the time of each."""
    pattern = re.compile(_word(kinds.column).pattern.encode())
    counts: Counter[str] = Counter()
    heads: dict[str, list[str]] = {}
    last: dict[str, str] = {}
    start, carry = stream.file.tell(), b""
    while block := stream.file.read(_BLOCK):
        lines = (carry + block).splitlines()
        carry = lines.pop() if not block.endswith((b"\n", b"\r")) else b""
        for line in lines:
            match = pattern.match(line)
            if match is None or line.lstrip().startswith((b"#", b"%", b"//", b"!")):
                continue
            kind = match[1].decode(stream.codec, "replace")
            counts[kind] += 1
            if counts[kind] <= _HEAD_ROWS:
                heads.setdefault(kind, []).append(line.decode(stream.codec, "replace"))
            else:
                last[kind] = line.decode(stream.codec, "replace")
    stream.file.seek(start)
    rows = {
        kind: [*heads[kind], *([last[kind]] if kind in last else [])] for kind, n in counts.items() if n > 1
    }
    tables = {kind: _stamp_table(lines) for kind, lines in rows.items()}
    clocks = {kind: _time(table) for kind, table in tables.items()}
    often = sorted(rows, key=lambda k: -counts[k])
    descriptions = {kind: _said(table, clocks[kind]) for kind, table in tables.items()}
    shared = next((descriptions[kind] for kind in often if descriptions[kind]), None)
    times = {
        kind: descriptions[kind] if clocks[kind] else _shared(table, shared) for kind, table in tables.items()
    }
    parts = [
        FilePart(
            name=kind,
            rows=counts[kind],
            columns=(kind,),
            rate=_rate(clocks[kind] or (_time(table, times[kind]) if times[kind] else None), counts[kind]),
            rank=_rank(kind),
            spare=_rank(kind) == _rank(""),
        )
        for kind, table in tables.items()
    ]
    return parts, times


def _stamp_table(lines: Sequence[str]) -> StampTable:
    """Rows of one kind, those of another width left out, as far as they are numbers."""
    signs = re.compile(r"[,;\t|]" if re.search(r"[,;\t|]", lines[0]) else r"\s+")
    cells = [[_number(cell) for cell in signs.split(line.strip())] for line in lines]
    width = Counter(map(len, cells)).most_common(1)[0][0]
    values = np.array([row for row in cells if len(row) == width], dtype=np.float64)
    numeric = [i for i in range(width) if np.isfinite(values[:, i]).all()]
    return StampTable(
        headings=[read_heading("")] * len(numeric),
        raw=[""] * len(numeric),
        columns=[ArrayColumn(np.ascontiguousarray(values[:, i])) for i in numeric],
        numbers=[i + 1 for i in numeric],
        known_units={},
        questions={},
        nominal=None,
        inertial=True,
        rate_said=False,
        file="",
    )


def _time(table: StampTable, stated: str | None = None) -> TimeChoice | None:
    """The time of a kind; None where it cannot be told."""
    try:
        return choose_time(table, stated)
    except InputError:
        return None


def _said(table: StampTable, time: TimeChoice | None) -> str | None:
    """A column of time and its unit, for the option; None for a time of several columns."""
    if time is None or len(time.used) > 1:
        return None
    return f"{table.numbers[time.used[0]]}:{time.unit}"


def _shared(table: StampTable, stated: str | None) -> str | None:
    """The time of another kind, where the column of that number rises here, too."""
    number = int((stated or "0").partition(":")[0])
    fits = number in table.numbers and rises(table.columns[table.numbers.index(number)])
    return stated if fits else None


def _rate(time: TimeChoice | None, count: int) -> float | None:
    """Rows over the time that they span; None where their time cannot be told."""
    n = 0 if time is None else len(time.stamps)
    span = float(time.stamps.read(n - 1, n)[0]) if time is not None and n else 0.0
    return (count - 1) / span if span > 0 else None


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return float("nan")
