# SPDX-License-Identifier: BSD-3-Clause
"""Numbers as programs print them, written as a table has them.

* Lists, tuples and arrays: (0.1, 0.2), [ 0.1 0.2], 12.5: (0.1, 0.2). Brackets around numbers become blanks, and so does
  what stands between the numbers; words stay where they are.
* The exponents of Fortran, 0.1D-02, and the minus sign of typography.
* Negative numbers of accounting, (0.5) and 0.5-, are refused: whether a bracket is a sign is for the writer to say.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from allanite.errors import FormatError
from allanite.files.readers.delimited.dialect import COMMENT
from allanite.lazy_dataclasses import dataclass

__all__ = ["PrintedNumbers", "find_printed", "refuse_accounting"]

_NUMBER = r"(?:[-+]?\.?\d|(?:nan|[-+]?inf|None)\b)"
#: Before a number, at the beginning of a cell: 0.123(4) is none.
_OPEN = re.compile(rf"(?:^|(?<=[\s,;:=(\[{{]))[(\[{{]+[ \t]*(?={_NUMBER}|[(\[{{])", re.MULTILINE)
#: Behind a number that is the whole cell: [m/s2] is none.
_CLOSE = re.compile(
    r"((?:^|[\s,;])(?:[-+]?[\d.]+(?:[eE][-+]?\d+)?|nan|[-+]?inf|None))[ \t]*[)\]}]+(?=$|[\s,;:)\]}])",
    re.MULTILINE,
)
_BETWEEN = re.compile(r"(?<=[\d.\sfne])[ \t]*[,;][ \t]*|(?<=[\d\s]):[ \t]+")
#: With a point: 12d5 may be a hexadecimal word.
_EXPONENT = re.compile(r"(?<![\w.])([-+]?(?:\d+\.\d*|\.\d+))[dD]([-+]?\d{1,3})(?![\w.])")
_MINUS = re.compile(r"\u2212(?=\.?\d)")
#: 0,1; 0,2: the comma is a decimal sign. 01-Sep-2026 (23:59:59): one date. (1700000000.0) can0 320#22: frames of a bus.
_OTHER = re.compile(r"\d,\d+;|\(\d\d:\d\d:|[\"#]")
_ROW = re.compile(r"[\s\"(]*[-+.]?\d")
#: Parentheses around a number with a sign are no sign themselves.
_SIGNED = re.compile(r"\([ ]*[-+]")
#: Without any of these no row is looked at one by one.
_SUSPECT = re.compile(r"\(|[\d.]-(?![\d.])")
#: A cell that is a number in parentheses or with its sign behind it, between delimiters that are no blanks.
_ACCOUNTING = re.compile(
    r"(?:^|[,;\t|])[ ]*\"?(?P<cell>\([ ]*[$€]?(?:\d[\d.,]*|\.\d+)(?:[eE][-+]?\d+)?[ ]*\)"
    r"|(?:\d+(?:[.,]\d*)?|[.,]\d+)-)\"?[ ]*(?=$|[,;\t|])"
)
#: Share of the rows.
_MOST = 0.6


@dataclass(frozen=True, slots=True)
class PrintedNumbers:
    """How printed numbers become those of a table.

    Attributes
    ----------
    bracketed : bool
        Rows have brackets; then blanks stand between the cells.
    changes : tuple of (pattern, str)
        What takes the place of what.
    codec : str
    """

    bracketed: bool
    changes: tuple[tuple[re.Pattern[str], str], ...]
    codec: str

    def head(self, lines: Sequence[str]) -> list[str]:
        """Lines as the table has them."""
        return [line if _is_comment(line) else self._changed(line) for line in lines]

    def piece(self, piece: bytes) -> bytes:
        """The same for whole lines of bytes."""
        return self._changed(piece.decode(self.codec, "replace")).encode(self.codec, "replace")

    def _changed(self, text: str) -> str:
        for pattern, instead in self.changes:
            text = pattern.sub(instead, text)
        return text


def find_printed(
    lines: Sequence[str], codec: str, *, delimiter: str | None, decimal: str | None
) -> PrintedNumbers | None:
    """How they are read where rows hold such numbers; None for any other text."""
    rows = [line for line in lines if line.strip() and not _is_comment(line)]
    bracketed = delimiter is None and decimal != "," and _bracketed(rows)
    changes = [(_OPEN, " "), (_CLOSE, r"\1 "), (_BETWEEN, " ")] if bracketed else []
    if _most(rows, _EXPONENT, "dD"):
        changes.append((_EXPONENT, r"\1E\2"))
    if any(map(_MINUS.search, rows)):
        changes.append((_MINUS, "-"))
    return PrintedNumbers(bracketed, tuple(changes), codec) if changes else None


def refuse_accounting(lines: Sequence[str], name: str) -> None:
    """Refuse numbers whose sign is a pair of parentheses, or stands behind them.

    Raises
    ------
    FormatError
        It shows the first of them.
    """
    if not _SUSPECT.search("\n".join(lines)):
        return
    rows = [line for line in lines if _ROW.match(line)]
    plain = any(map(_SIGNED.search, rows))
    for line in rows:
        match = _ACCOUNTING.search(line)
        if match and not (plain and match["cell"].startswith("(")):
            raise FormatError(
                f"{name}: the cell {match['cell']!r} in the row {line.strip()[:60]!r} may be a negative number in the "
                "format of accounting. Export the cells as plain numbers, negative ones with a minus sign in front"
            )


def _bracketed(rows: Sequence[str]) -> bool:
    return _most(rows, _OPEN, "([{") and not any(map(_OTHER.search, rows))


def _most(rows: Sequence[str], what: re.Pattern[str], letters: str) -> bool:
    """Whether most rows hold a pattern; rows are looked at one by one only where its letters are often enough."""
    least = _MOST * len(rows)
    text = "".join(rows)
    if sum(map(text.count, letters)) <= least:
        return False
    with_one = [row for row in rows if any(letter in row for letter in letters)]
    return len(with_one) > least and sum(what.search(row) is not None for row in with_one) > least


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(COMMENT)
