# SPDX-License-Identifier: BSD-3-Clause
"""Cells that begin with a number and go on: ``1.23 deg/s``, ``12.3V``, ``-0.1*``, ``0.3%``.

The number is read. What stands behind it is the unit if it is one, and else it is reported: what a mark means, nobody
said. Two units in one column, as meters write that change their range, are refused.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Final

from allanite.errors import FormatError
from allanite.files.readers.headings import is_unit

__all__ = ["NUMBER", "Suffixes", "like_a_unit", "split_suffix", "unit_behind"]

#: A number with a decimal point or a decimal comma.
NUMBER: Final = {
    ".": r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?",
    ",": r"[+-]?\d+(?:,\d+)?(?:[eE][+-]?\d+)?",
}
_CELL = {
    sign: re.compile(rf"(?P<number>{number})(?P<gap>\s*)(?P<suffix>\D.*)") for sign, number in NUMBER.items()
}
_MARK = re.compile(r"[^\w\s.,;:+-]{1,3}|[A-Za-zµΩ°%]{1,8}")
_LIKE_A_UNIT = re.compile(r"[A-Za-zµ°%√][A-Za-z0-9µ°√²³^*/().-]{0,15}")
_HEXADECIMAL = re.compile(r"[A-Fa-f]+")
#: Letters that multiply: 1.2k is 1200.
_FACTORS = frozenset("kMunpµ")

#: Suffix -> how many cells have it, and the line of the first one.
Suffixes = dict[str, tuple[int, int]]


def split_suffix(cell: str, decimal: str) -> tuple[str, str] | None:
    """The number at the beginning of a cell and what follows it; None for a cell of another kind."""
    match = _CELL[decimal].fullmatch(cell)
    if match is None:
        return None
    number, suffix = match["number"], match["suffix"].rstrip()
    if number.isdigit() and not match["gap"] and _HEXADECIMAL.fullmatch(suffix) and suffix != "C":
        return None
    return (number, suffix) if _MARK.fullmatch(suffix) or like_a_unit(suffix) else None


@lru_cache(maxsize=4096)
def like_a_unit(suffix: str) -> bool:
    """True for a unit that may follow a number."""
    return _LIKE_A_UNIT.fullmatch(suffix) is not None and is_unit(suffix)


def unit_behind(suffixes: Mapping[str, tuple[int, int]], stated: str, where: str) -> str:
    """The unit that stands behind the numbers of a column; "" if what stands there is none.

    Parameters
    ----------
    suffixes : mapping
        Those of the column.
    stated : str
        The unit in its heading, or "".
    where : str
        File and column, for messages.

    Raises
    ------
    FormatError
        Two units, a letter that multiplies, or another unit than the heading's.
    """
    units = [s for s in suffixes if like_a_unit(s)]
    factors = [s for s in suffixes if s in _FACTORS]
    lines = {s: f"{s!r} (first in line {line})" for s, (_, line) in suffixes.items()}
    if factors or (units and len(suffixes) > 1):
        unit = " and ".join(lines[s] for s in suffixes)
        raise FormatError(
            f"{where}: {unit} after the numbers: the column has several units. Write it in one unit"
        )
    if units and stated and units[0] != stated:
        raise FormatError(
            f"{where}: the heading says {stated!r}, but {lines[units[0]]} follows the numbers. Remove the wrong one"
        )
    return units[0] if units else ""
