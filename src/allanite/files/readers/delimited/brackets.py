# SPDX-License-Identifier: BSD-3-Clause
"""Rows as programs print lists, tuples and arrays: (0.1, 0.2), [ 0.1 0.2], 12.5: (0.1, 0.2).

Brackets around numbers are blanks, and so is what stands between the numbers; words stay where they are.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from allanite.files.readers.delimited.dialect import COMMENT

__all__ = ["Brackets", "find_brackets"]

_NUMBER = r"[-+]?\.?\d"
#: Before a number, at the beginning of a cell: 0.123(4) is none.
_OPEN = rf"(?:^|(?<=[\s,;:=(\[{{]))[(\[{{]+[ \t]*(?={_NUMBER}|[(\[{{])"
_CLOSE = r"(?<=[\d.)\]}])[ \t]*[)\]}]+(?=$|[\s,;:)\]}])"
_BETWEEN = r"(?<=[\d.)\]}\s])[ \t]*[,;][ \t]*|(?<=[\d)\]}]):[ \t]+"
_AROUND = re.compile(rf"{_OPEN}|{_CLOSE}", re.MULTILINE)
_MARKS = re.compile(rf"{_OPEN}|{_CLOSE}|{_BETWEEN}".encode(), re.MULTILINE)
_TEXT = re.compile(_MARKS.pattern.decode(), re.MULTILINE)
#: 0,1; 0,2: the comma is a decimal sign.
_COMMA = re.compile(r"\d,\d+;")
#: Share of the rows.
_MOST = 0.6


@dataclass(frozen=True, slots=True)
class Brackets:
    """How rows of printed numbers are read."""

    def head(self, lines: Sequence[str]) -> list[str]:
        """Lines as the table has them."""
        return [line if line.lstrip().startswith(COMMENT) else _TEXT.sub(" ", line) for line in lines]

    def piece(self, piece: bytes) -> bytes:
        """The same for whole lines of bytes."""
        return _MARKS.sub(b" ", piece)


def find_brackets(lines: Sequence[str]) -> Brackets | None:
    """How they are read where most rows have brackets around numbers; None for any other text."""
    rows = [line for line in lines if line.strip() and not line.lstrip().startswith(COMMENT)]
    if any('"' in line or _COMMA.search(line) for line in rows):
        return None
    bracketed = sum(_AROUND.search(line) is not None for line in rows)
    return Brackets() if bracketed > _MOST * len(rows) else None
