# SPDX-License-Identifier: BSD-3-Clause
"""What the caller says of time: which column it is, and how its values count (``--time COLUMN[:UNIT]``).

``t:ms``, ``2`` (columns count from 1), ``cnt:1/1000 s`` (a counter, with its step), ``cnt:1us:2^16`` (and where it
begins anew), ``Date:dmy`` (the order of a date), ``none`` (no column is time).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from allanite.errors import InputError
from allanite.files.readers.headings import read_heading
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.units import QuantityKind, parse_unit

__all__ = ["NO_TIME", "ORDERS", "StatedTime", "date_order", "option_text", "parse_step", "stated_time"]

#: No column is time.
NO_TIME: Final = "none"
#: Orders of year, month and day in a date.
ORDERS: Final = ("ymd", "dmy", "mdy", "ydm")
_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_STEP = re.compile(rf"({_NUMBER})(?:\s*/\s*({_NUMBER}))?\s*([^\d\s.].*)")
_TURN = re.compile(r"2\s*(?:\^|\*\*)\s*(\d{1,2})|(\d+)\s*-?\s*bits?|(\d+)")
_FEWEST_BITS, _MOST_BITS = 4, 63


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedTime:
    """The column that the caller names, and what is said of its values.

    Attributes
    ----------
    place : int
        Of the column in the table.
    unit : str
        As it was said; "" where nothing was.
    factor : float or None [s]
        Seconds in one of the column's units; None where that was not said.
    counts : bool
        The unit is the step of a counter.
    turn : float or None
        Count at which it begins anew.
    """

    place: int
    unit: str = ""
    factor: float | None = None
    counts: bool = False
    turn: float | None = None


def stated_time(statement: str, headings: Sequence[str], numbers: Sequence[int], file: str) -> StatedTime:
    """The column that is meant, and its unit.

    Parameters
    ----------
    statement : str
        COLUMN[:UNIT] or COLUMN:STEP[:TURN]; the column by its heading, its name, or its number in the file from 1.
    headings : sequence of str
    numbers : sequence of int
        Of the columns in the file.
    file : str
        For messages.

    Raises
    ------
    InputError
        No such column, or something that is no unit, step or turn.
    """
    parts = statement.split(":")
    for count in range(len(parts), 0, -1):  # a name may hold colons
        place = _place(":".join(parts[:count]).strip(), headings, numbers)
        if place is not None:
            return _counted(place, [p.strip() for p in parts[count:]], statement)
    there = ", ".join(
        f"{number} ({heading.strip()})" if heading.strip() else str(number)
        for number, heading in zip(numbers, headings, strict=True)
    )
    raise InputError(f"{file}: no column {parts[0].strip()!r} for time={statement!r}; there are: {there}")


def date_order(statement: str | None) -> str | None:
    """The order of a date that the caller states, or None."""
    last = (statement or "").rpartition(":")[2].strip().lower()
    return last if last in ORDERS else None


def option_text(heading: str, number: int) -> str:
    """How a message names a column for this option."""
    name = heading.strip()
    return name if name and not re.search(r"[\s:\"'\\$`;|&<>()*?!#]", name) else str(number)


def _place(word: str, headings: Sequence[str], numbers: Sequence[int]) -> int | None:
    for same in (
        lambda heading: heading.strip() == word,
        lambda heading: heading.strip().lower() == word.lower(),
        lambda heading: read_heading(heading).name.lower() == word.lower(),
    ):
        places = [i for i, heading in enumerate(headings) if heading.strip() and same(heading)]
        if places:
            return places[0]
    if word.isdecimal() and int(word) in numbers:
        return list(numbers).index(int(word))
    return None


def _counted(place: int, parts: list[str], statement: str) -> StatedTime:
    """The unit, or the step and the turn, that stand behind a column."""
    if not parts or (len(parts) == 1 and parts[0].lower() in ORDERS):
        return StatedTime(place=place)
    turn = _turn(parts[1], statement) if len(parts) == 2 else None
    unit = parts[0]
    try:
        factor = parse_unit(unit, QuantityKind.TIME).factor
    except InputError:
        step = parse_step(unit)
        if step is None or len(parts) > 2:
            raise InputError(
                f"time={statement!r}: write a column and its unit, t:ms; a counter and its step, cnt:1/1000 s or "
                f"cnt:2us:2^16; or a date and its order, Date:dmy ({', '.join(ORDERS)})"
            ) from None
        return StatedTime(place=place, unit=unit, factor=step, counts=True, turn=turn)
    return StatedTime(place=place, unit=unit, factor=factor, counts=turn is not None, turn=turn)


def parse_step(text: str) -> float | None:
    """Seconds of one count, "1/1000 s", "15.625 us", or one over "32768 Hz"; None for anything else."""
    match = _STEP.fullmatch(text)
    if match is None:
        return None
    size = float(match[1]) / float(match[2] or 1.0) if float(match[2] or 1.0) else 0.0
    if not 0.0 < size < float("inf"):
        return None
    try:
        unit = parse_unit(match[3].strip(), (QuantityKind.TIME, QuantityKind.FREQUENCY))
    except InputError:
        return None
    size *= unit.factor
    return size if unit.quantity is QuantityKind.TIME else 1.0 / size


def _turn(text: str, statement: str) -> float:
    match = _TURN.fullmatch(text)
    bits = int(match[1] or match[2]) if match and (match[1] or match[2]) else None
    if bits is not None and _FEWEST_BITS <= bits <= _MOST_BITS:
        return float(1 << bits)
    if match and match[3] and int(match[3]) > 1:
        return float(int(match[3]))
    raise InputError(
        f"time={statement!r}: {text!r} is not a count at which a counter restarts: write 2^16 or 65536"
    )
