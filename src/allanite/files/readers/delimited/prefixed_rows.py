# SPDX-License-Identifier: BSD-3-Clause
"""A stamp in front of a row that an arrow, a colon or blanks alone part from the first number, as monitors print it.

10:00:00.000 -> 0.535,-0.218,0.233 has a time and three numbers: what stands between becomes one more delimiter.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from allanite.files.readers.delimited.dates import date_format
from allanite.files.readers.delimited.dialect import COMMENT, kind_of
from allanite.lazy_dataclasses import dataclass

__all__ = ["PrefixedRows", "find_prefixed", "holds_number"]

#: What parts a stamp from a number, and the number.
_ARROW = r"(?:[ \t]*(?:->|=>|\|)[ \t]*|:?[ \t]+)"
_NUMBER = r"[-+]?(?:\d+{mark}?\d*|{mark}\d+)(?:[eE][-+]?\d+)?"
_DECIMALS = {",": r"\.", ";": "[.,]", "\t": "[.,]"}
#: Rows that are looked at, and the share of them that decides.
_ROWS, _MOST = 200, 0.6
#: A number with a decimal point behind other text, in a cell.
_BEHIND = re.compile(r"\S(?:[ \t]+|[ \t]*(?:->|=>|[=|>\]])[ \t]*|:[ \t]+)[-+]?\d*\.\d+(?:[eE][-+]?\d+)?$")


@dataclass(frozen=True, slots=True)
class PrefixedRows:
    """How such rows become those of a table.

    Attributes
    ----------
    pattern : re.Pattern
        From the beginning of a row to its first number, with the stamp and the number as groups.
    instead : str
    codec : str
    """

    pattern: re.Pattern[str]
    instead: str
    codec: str

    def head(self, lines: Sequence[str]) -> list[str]:
        """Lines as the table has them."""
        return [self.pattern.sub(self.instead, line) for line in lines]

    def piece(self, piece: bytes) -> bytes:
        """The same for whole lines of bytes."""
        text = piece.decode(self.codec, "replace")
        return self.pattern.sub(self.instead, text).encode(self.codec, "replace")


def find_prefixed(
    lines: Sequence[str], codec: str, *, delimiter: str | None, decimal: str | None
) -> PrefixedRows | None:
    """How they are read where most rows begin so; None for any other text."""
    rows = [line for line in lines if line.strip() and not line.lstrip().startswith(COMMENT)]
    rows = rows[:: -(-len(rows) // _ROWS)] if rows else rows
    for sign in _DECIMALS if delimiter is None else {delimiter} & {*_DECIMALS}:
        mark = r"\." if decimal == "." else _DECIMALS[sign]
        pattern = _pattern(sign, mark)
        first = [match for row in rows if (match := pattern.match(row))]
        if len(first) > _MOST * len(rows) and _varies(first) and not _is_one_cell(rows, sign):
            return PrefixedRows(pattern, rf"\g<stamp>{sign}\g<number>", codec)
    return None


def holds_number(cells: Sequence[str]) -> bool:
    """Whether most cells of a column of text end in a number that changes."""
    ends = [match[0] for cell in cells if (match := _BEHIND.search(cell))]
    return len(ends) > _MOST * len(cells) and len(set(ends)) > 1


def _pattern(sign: str, mark: str) -> re.Pattern[str]:
    stamp = rf"[ \t]*[\[(]?(?P<stamp>[^{sign}\n\[\]()]*?[^{sign}\s\[\]()>|-])[\])]?"
    number = rf"(?P<number>{_NUMBER.format(mark=mark)})"
    return re.compile(rf"^{stamp}{_ARROW}{number}[ \t]*(?={sign})", re.MULTILINE)


def _varies(first: Sequence[re.Match[str]]) -> bool:
    """Numbers with decimals or signs that change: the year at the end of a date does not."""
    numbers = {match["number"] for match in first}
    return len(numbers) > 1 and any(set(number) & set(".,-+eE") for number in numbers)


def _is_one_cell(rows: Sequence[str], sign: str) -> bool:
    """Whether the first cells are dates or numbers as they are."""
    cells = [row.partition(sign)[0].strip() for row in rows]
    known = [cell for cell in cells if date_format(cell) or kind_of(cell, ".") != "x"]
    return len(known) >= (1 - _MOST) * len(cells)
