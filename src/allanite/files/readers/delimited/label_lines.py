# SPDX-License-Identifier: BSD-3-Clause
"""One line of labeled values, ``T:0 GX:-0.017``, ``gx=0,01;gy=-0,02`` or ``{"t": 0.01, "gx": 1.2}``, taken apart.

A label is followed by ``:``, ``=``, ``->`` or ``=>`` and by one value or several (``acc: 0.1 0.2 9.8``). What stands
before the first label, such as the time at which the line was received, is kept as cells. Nothing is judged here: which
labels a log has, and which lines break with it, is for `allanite.files.readers.delimited.labels`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any, Final

from allanite.files.readers.delimited.dates import date_format
from allanite.files.readers.delimited.dialect import MISSING, OVERLOAD
from allanite.files.readers.delimited.suffixes import NUMBER, split_suffix
from allanite.files.readers.headings import is_unit
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.limits import DEPTH

__all__ = ["LabeledLine", "read_json", "read_labels", "series_of"]

_LETTERS = r"[^\s:=,;|\"'{}]{0,40}"  # bounded: a line of letters costs no more than its length
_WORD = rf"[^\W\d]{_LETTERS}"
_MORE = rf"(?:[(\[]?[^\W\d]{_LETTERS}|\d{{1,2}}(?:[(\[]{_LETTERS})?)"
_LABEL = re.compile(
    rf"(?<![\w.°%/²³√^*])[\"']?(?P<label>[ΔΣ∆]?{_WORD}(?:[ ]{_MORE}){{0,3}})[\"']?\s*(?::=|=>|->|[:=])(?![:=])"
)
#: Labels that begin with a digit, as in "0: 0.1 1: 0.2" or "3V3 = 3.29"; a blank parts them from times of day.
_DIGITS = re.compile(rf"(?<![\w.#-])(?P<label>#?\d{_LETTERS})(?:\s*=\s*|\s*:\s+)(?![:=])")
#: The line protocol of time-series data bases: "imu,host=a gx=0.1,n=3i 1700000000000000000", the stamp last.
_SERIES = re.compile(
    r"(?P<series>[^\s,=]+(?:,[^\s,=]+=[^\s,=]+)*)[ ]"
    r"(?P<fields>[^\s,=]+=[^\s,=]+(?:,[^\s,=]+=[^\s,=]+)*)[ ](?P<stamp>\d{9,19})"
)
_LONGEST_LABEL = 60
_LONGEST_LINE = 1 << 16
_NUMBERS = {sign: re.compile(number) for sign, number in NUMBER.items()}
#: What stands between values; a comma between digits belongs to the number where commas are decimal signs.
_BETWEEN = {
    ".": re.compile(r"[\s,;|()\[\]{}\"']+"),
    ",": re.compile(r"(?:[\s;|()\[\]{}\"']|,(?!\d)|(?<!\d),)+"),
}
_EDGES: Final = " \t\"'[](){}<>,;:|=-"
_BEFORE = {".": re.compile(r"[\s,;|()\[\]]+"), ",": re.compile(r"(?:[\s;|()\[\]]|,(?!\d))+")}
_NO_VALUE = MISSING | OVERLOAD


@dataclass(frozen=True, slots=True)
class LabeledLine:
    """A line taken apart.

    Attributes
    ----------
    before : tuple of str
        Cells in front of the first label.
    pairs : tuple of (str, tuple of str)
        Labels with their values as they are written, a unit behind its number; without any where nothing follows.
    """

    before: tuple[str, ...]
    pairs: tuple[tuple[str, tuple[str, ...]], ...]

    @property
    def values(self) -> list[str]:
        """All cells in their order."""
        return [*self.before, *(value for _, values in self.pairs for value in values)]


def series_of(line: str) -> tuple[str, tuple[str, ...]] | None:
    """The measurement with its tags, and the names of the fields, of a line of the line protocol."""
    match = _SERIES.fullmatch(line.strip())
    return match and (match["series"], tuple(field.partition("=")[0] for field in match["fields"].split(",")))


def read_labels(line: str, decimal: str) -> LabeledLine | None:
    """The labels of a line and their values; None for a line without a label."""
    if len(line) > _LONGEST_LINE:
        return None
    if series := _SERIES.fullmatch(line.strip()):
        fields = (field.split("=") for field in series["fields"].split(","))
        values = [(label, (re.sub(r"(?<=\d)[iu]$", "", value),)) for label, value in fields]
        return LabeledLine((), (*values, ("timestamp", (series["stamp"],))))
    matches = [m for m in _LABEL.finditer(line) if len(m["label"]) <= _LONGEST_LABEL]
    if not matches:
        matches = list(_DIGITS.finditer(line))
        if len(matches) < 2:  # one may be the number of the line
            return None
    ends = [*(m.start() for m in matches[1:]), len(line)]
    tails = [line[m.end() : end] for m, end in zip(matches, ends, strict=True)]
    units_last = bool(re.search(r"\d\s*[A-Za-zµ°%][^\s\d]*\s*$", tails[-1]))
    labels = [matches[0]["label"]]
    for k, match in enumerate(matches[1:]):
        front, label = _peeled(match["label"], units_last, bool(tails[k].strip()))
        tails[k] += " " + front
        labels.append(label)
    pairs = tuple((label, _values(tail, decimal)) for label, tail in zip(labels, tails, strict=True))
    return LabeledLine(_cells_before(line[: matches[0].start()], decimal), pairs)


def _peeled(label: str, units_last: bool, valued: bool) -> tuple[str, str]:
    """What of a label of several words is the value before it ("nan GY") or its unit ("deg/s GY"), and the rest."""
    words = label.split(" ")
    taken = 0
    while taken < len(words) - 1:
        word = words[taken]
        unit = valued and taken == 0 and is_unit(word) and (len(word) > 1 or units_last)
        if not (unit or word.lower() in _NO_VALUE or (taken and word.isdigit())):
            break
        taken += 1
    return " ".join(words[:taken]), " ".join(words[taken:])


def _values(text: str, decimal: str) -> tuple[str, ...]:
    """Numbers and words for "no value", each with what follows it; anything else is one cell of text."""
    values: list[str] = []
    for word in filter(None, _BETWEEN[decimal].split(text)):
        if _NUMBERS[decimal].fullmatch(word) or word.lower() in _NO_VALUE or split_suffix(word, decimal):
            values.append(word)
        elif (
            values
            and _NUMBERS[decimal].fullmatch(values[-1])
            and split_suffix(f"{values[-1]} {word}", decimal)
        ):
            values[-1] += " " + word
        else:
            return (text.strip(_EDGES),)
    return tuple(values)


def _cells_before(text: str, decimal: str) -> tuple[str, ...]:
    """Cells in front of the labels; a date with its time of day is one."""
    plain = text.strip(_EDGES)
    if not plain or date_format(plain):
        return (plain,) if plain else ()
    blanks = plain.split()
    for count in range(min(3, len(blanks)), 0, -1):
        date = " ".join(blanks[:count]).strip(_EDGES)
        if date_format(date):
            return (date, *_cells_before(" ".join(blanks[count:]), decimal))
    cells = (cell.strip(_EDGES) for cell in _BEFORE[decimal].split(plain))
    return tuple(cell for cell in cells if cell)


def read_json(line: str) -> LabeledLine | None:
    """The members of the object in a line, numbers as they are written; None for a line that holds none.

    Members of objects inside are called after both, those of lists are several values.
    """
    try:
        members = json.loads(
            line.strip().rstrip(","), parse_float=str, parse_int=str, parse_constant=str, object_pairs_hook=tuple
        )  # fmt: skip
        pairs = tuple(_members(members, "", 0)) if isinstance(members, tuple) else ()
    except (ValueError, RecursionError):
        return None
    return LabeledLine((), pairs) if pairs else None


def _members(pairs: Any, prefix: str, depth: int) -> Iterator[tuple[str, tuple[str, ...]]]:
    if depth > DEPTH:
        raise ValueError(f"objects more than {DEPTH} deep")
    for key, value in pairs:
        name = f"{prefix}_{key}" if prefix else str(key)
        if len(name) > _LONGEST_LABEL:
            continue
        if isinstance(value, tuple):
            yield from _members(value, name, depth + 1)
        elif not isinstance(value, list):
            yield name, (_written(value),)
        elif not any(isinstance(inner, (list, tuple)) for inner in value):
            yield name, tuple(_written(inner) for inner in value)


def _written(value: Any) -> str:
    """A value of JSON as a cell, without what ends or hides a row."""
    if isinstance(value, bool):
        return str(value).lower()
    return "" if value is None else re.sub(r"\s+", " ", str(value)).strip().lstrip("#%!/")
