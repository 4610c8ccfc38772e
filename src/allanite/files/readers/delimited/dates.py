# SPDX-License-Identifier: BSD-3-Clause
"""Dates and times of day as logs write them, to nanoseconds since 1970 (UTC where no zone is given).

Where a date is three numbers, their order is told by the whole column (`DateColumn`): by a day above 12, by the stamps
that would fall, or by the midnights at which a record goes on. What stays open is a question, never a choice.
"""

from __future__ import annotations

import datetime
import re
from collections.abc import Iterable, Sequence
from functools import cache, lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.recording.records import ArrayColumn, Column

__all__ = [
    "DATE_FORMATS",
    "HALVES",
    "NUMBERS",
    "DateColumn",
    "date_format",
    "in_halves",
    "is_month",
    "moments_column",
    "packed_format",
    "to_nanoseconds",
    "unwrap_midnight",
]

_CLOCK = r"\(?(?P<H>\d{1,2}):(?P<M>\d\d)(?::(?P<S>\d\d)(?:[.,:](?P<f>\d{1,9}))?)?\)?(?:\s*(?P<p>[AaPp])\.?[Mm]\.?)?"
_SHORT_CLOCK = r"(?P<H>[0-2]\d)(?P<M>[0-5]\d)(?P<S>[0-6]\d)(?:[.,](?P<f>\d{1,9}))?"
#: Without a sign between its numbers, or before what is finer than a second.
_PACKED_CLOCK = r"(?P<H>[01]\d|2[0-3])(?P<M>[0-5]\d)(?P<S>[0-6]\d)(?:[.,]?(?P<f>\d{1,9}))?"
_ZONE = r"\s*(?P<z>Z|UTC|GMT|[+-]\d\d:?\d\d)?"
_BETWEEN = r"(?:[T_ -]\s*|,\s*)"
_THEN_CLOCK = "(?:" + _BETWEEN + _CLOCK + _ZONE + ")?"
_WEEKDAY = r"(?:[A-Za-z]{2,9}\.?,?\s+)?"
#: Three numbers whose order the column tells.
NUMBERS: Final = "date"

#: The half of the day in a column of its own.
HALVES: Final = "am/pm"

#: Name of a format and its patterns; the first that matches counts.
DATE_FORMATS: Final[dict[str, tuple[str, ...]]] = {
    "iso8601": (r"(?P<Y>\d{4})-(?P<m>0?[1-9]|1[0-2])-(?P<d>\d{1,2})(?:[T ]" + _CLOCK + _ZONE + ")?",),
    "dd-mon-yyyy": (
        _WEEKDAY
        + r"(?P<d>\d{1,2})(?:\.\s?|[-/ ])?(?P<b>[A-Za-zä]{3,9})(?:\.?[-/ ,]\s?)?(?P<Y>\d{4}|\d\d)"
        + _THEN_CLOCK,
        _WEEKDAY + r"(?P<b>[A-Za-zä]{3,9})\.?[-/ ](?P<d>\d{1,2})(?:,\s?|[-/ ])(?P<Y>\d{4})" + _THEN_CLOCK,
        r"[A-Za-z]{3} (?P<b>[A-Za-z]{3})\s+(?P<d>\d{1,2}) " + _CLOCK + r" (?P<Y>\d{4})",
        r"(?P<Y>\d{4})[-/ ](?P<b>[A-Za-z]{3,9})[-/ ](?P<d>\d{1,2})" + _THEN_CLOCK,
    ),
    "mon dd hh:mm:ss": (
        r"(?P<b>[A-Za-z]{3,9})\.?\s+(?P<d>\d{1,2})\s+" + _CLOCK,
        r"(?P<d>\d{1,2})\s+(?P<b>[A-Za-z]{3,9})\.?\s+" + _CLOCK,
    ),
    NUMBERS: (
        r"(?P<a>\d{1,4})(?P<x>[-/.])(?P<n>\d{1,2})(?P=x)(?P<c>\d{1,4})" + _THEN_CLOCK,
        _CLOCK + r"[T_ ]\s*(?P<a>\d{1,4})(?P<x>[-/.])(?P<n>\d{1,2})(?P=x)(?P<c>\d{1,4})",
        r"(?P<a>\d\d)(?P<x>)(?P<n>\d\d)(?P<c>(?:19|20)\d\d)[-_T ]" + _CLOCK + _ZONE,
        r"(?P<a>\d\d)(?P<x>)(?P<n>\d\d)(?P<c>\d\d)" + _PACKED_CLOCK.replace("?(?P<f>", "(?P<f>"),
    ),
    "yyyymmdd": (
        r"(?P<Y>(?:19|20)\d\d)(?P<m>0[1-9]|1[0-2])(?P<d>[0-3]\d)[-_T ]" + _CLOCK + _ZONE,
        r"(?P<Y>(?:19|20)\d\d)(?P<m>0[1-9]|1[0-2])(?P<d>[0-3]\d)[-_T ]" + _SHORT_CLOCK + _ZONE,
        r"(?P<Y>(?:19|20)\d\d)(?P<m>0[1-9]|1[0-2])(?P<d>[0-3]\d)" + _PACKED_CLOCK,
    ),
    "hh:mm:ss": (_CLOCK,),
    HALVES: (r"(?P<p>[AaPp])\.?[Mm]\.?",),
}
_KEPT = 256  # characters of a cell that is remembered
_MONTHS = {"jan": 1, "feb": 2, "mar": 3, "apr": 4, "may": 5, "jun": 6, "jul": 7, "aug": 8, "sep": 9, "oct": 10,
           "nov": 11, "dec": 12, "mai": 5, "okt": 10, "dez": 12, "mrz": 3, "mär": 3}  # fmt: skip
_DAY = 86_400_000_000_000
_HALF = _DAY // 2
_NO_YEAR = "1972"  # of dates without a year: a leap year, before those of any log
_DIGITS = re.compile(r"\d{12}(?:\d\d)?(?:[.,]\d{1,9})?|\d{17}|\d{20}")
_FEW = 2  # different cells that a column of stamps has at least
_LONGEST_EXACT = 1 << 52  # nanoseconds that float64 tells apart: 52 days
_CENTURY = 69  # of years of two digits: 69 is 1969, 68 is 2068, as in POSIX


@cache
def _patterns(name: str) -> tuple[re.Pattern[str], ...]:
    """Compiled on first use: most logs hold no dates."""
    return tuple(map(re.compile, DATE_FORMATS[name]))


def date_format(cell: str) -> str | None:
    """Name of the format of a cell, or None."""
    if cell[-1:] in "Mm." and len(cell) <= 4 and _patterns(HALVES)[0].fullmatch(cell):
        return HALVES
    if len(cell) < 5 or not (set("-:/. T") & set(cell) or (cell[0].isdigit() and cell[-5].isalpha())):
        return None
    return _name_of(cell) if len(cell) <= _KEPT else _name_of.__wrapped__(cell)


@lru_cache(maxsize=4096)  # the first lines of a log are split in a dozen ways, and mostly into the same cells
def _name_of(cell: str) -> str | None:
    match = _matched(cell)
    return match[0] if match else None


def is_month(word: str) -> bool:
    """True for the name of a month, in full or its beginning."""
    return word[:3].lower() in _MONTHS


def packed_format(cells: Sequence[str]) -> str | None:
    """The format of dates with their time of day that are written as one number, such as 20240131120501.25.

    Parameters
    ----------
    cells : sequence of str
        All cells of a column that hold something: every one of them must be such a date.
    """
    if not cells or len(set(cells)) < min(len(cells), _FEW) or not _DIGITS.fullmatch(cells[0]):
        return None
    matched = [_matched(cell) for cell in cells if _DIGITS.fullmatch(cell)]
    formats = {match[0] if match else None for match in matched}
    if len(matched) < len(cells) or len(formats) > 1:
        return None
    keys = {(m["a"], m["n"], m["c"]) for match in matched if match and "a" in (m := match[1].groupdict())}
    dated = not keys or any(all(_calendar(key, order) for key in keys) for order in _PLACES)
    return formats.pop() if dated else None


def _matched(cell: str) -> tuple[str, re.Match[str]] | None:
    for name in DATE_FORMATS:
        for pattern in _patterns(name):
            match = pattern.fullmatch(cell)
            if match is None or not _sound(match):
                continue
            return name, match
    return None


def _sound(match: re.Match[str]) -> bool:
    """A month that there is; of three numbers, one that may be a year."""
    part = match.groupdict()
    if part.get("b") and not is_month(str(part["b"])):
        return False
    if part.get("a"):
        first, last = len(str(part["a"])), len(str(part["c"]))
        return last in {1: (2, 4), 2: (1, 2, 4), 4: (1, 2)}.get(first, ())
    return True


def to_nanoseconds(cells: Iterable[str | None], name: str) -> NDArray[np.int64] | NDArray[np.float64]:
    """Cells of one format in nanoseconds; float64 with NaN if some cells are None.

    Raises
    ------
    ValueError
        A cell that is not of the format, or no date; the second argument of the error is its position.
    """
    return _converted(cells, name, _nanoseconds)


def _converted(
    cells: Iterable[str | None], name: str, convert: Any
) -> NDArray[np.int64] | NDArray[np.float64]:
    values: list[int | None] = []
    patterns = _patterns(name)
    for i, cell in enumerate(cells):
        if cell is None:
            values.append(None)
            continue
        text = cell.strip()
        match = next((m for m in (p.fullmatch(text) for p in patterns) if m), None)
        if match is None:
            raise ValueError(f"{cell!r} is not of the form {name}", i)
        try:
            values.append(convert(match.groupdict()))
        except ValueError as error:
            raise ValueError(f"{cell!r}: {error}", i) from None
    if None in values:
        return np.array([np.nan if v is None else float(v) for v in values])
    return np.array(values, dtype=np.int64)


def _nanoseconds(part: dict[str, str | None]) -> int:
    total = 0
    if part.get("Y") or part.get("b"):
        month = part.get("m") or str(_MONTHS.get(str(part.get("b"))[:3].lower(), 0))
        total = _days(_year(part.get("Y") or _NO_YEAR), int(month), int(str(part["d"]))) * _DAY
    total += _clock(part)
    if not -(1 << 63) <= total < 1 << 63:
        raise ValueError("nanoseconds since 1970 reach from 1678 to 2262")
    return total


def _clock(part: dict[str, str | None]) -> int:
    """Time of day in nanoseconds, in UTC where a zone is given."""
    total = 0
    if part.get("H"):
        hour = int(str(part["H"]))
        if part.get("p"):
            if not 1 <= hour <= 12:
                raise ValueError(f"{hour} is not an hour of a 12-hour clock")
            hour = hour % 12 + (12 if str(part["p"]) in "Pp" else 0)
        seconds = (hour * 60 + int(str(part["M"]))) * 60 + int(part.get("S") or 0)
        total += seconds * 10**9 + int((part.get("f") or "0").ljust(9, "0"))
    elif part.get("p"):
        total += _HALF if str(part["p"]) in "Pp" else 0
    zone = part.get("z")
    if zone and zone[0] in "+-":
        minutes = int(zone[1:3]) * 60 + int(zone[-2:])
        total -= (minutes if zone[0] == "+" else -minutes) * 60 * 10**9
    return total


def _year(text: str) -> int:
    return int(text) if len(text) > 2 else int(text) + (1900 if int(text) >= _CENTURY else 2000)


@lru_cache(maxsize=512)
def _days(year: int, month: int, day: int) -> int:
    return datetime.date(year, month, day).toordinal() - 719_163  # the ordinal of 1970-01-01


# -- three numbers -----------------------------------------------------------------------------------------

_PLACES = {"ymd": (0, 1, 2), "dmy": (2, 1, 0), "mdy": (2, 0, 1), "ydm": (0, 2, 1)}
_STRIDE = 4 * _DAY  # between codes of dates: a zone takes a time of day into the next date or the one before
_MONTH = 20 * _DAY  # a midnight that is so long, read in another order, is none


class DateColumn:
    """A column of dates of three numbers, as codes until all of them are known.

    A code is the number of the date in the order in which it was met, times four days, plus a day and the time of day.

    Parameters
    ----------
    order : str or None
        "dmy", "mdy", "ymd" or "ydm", where the caller says so.
    comma : bool
        The file writes decimal commas, as those do who never write the month first.

    Attributes
    ----------
    format : str
        Name of the order.
    orders : tuple of str
        Those that stay open; none, or several.
    """

    def __init__(self, order: str | None = None, comma: bool = False) -> None:
        self._order, self._comma = order, comma
        self._dates: dict[tuple[str, str, str], int] = {}
        self._sign = ""
        self.format = NUMBERS
        self.orders: tuple[str, ...] = ()

    def codes(self, cells: Iterable[str | None]) -> NDArray[np.int64] | NDArray[np.float64]:
        """Codes of cells; float64 with NaN if some are None.

        Raises
        ------
        ValueError
            A cell that is no date of three numbers; the second argument of the error is its position.
        """
        return _converted(cells, NUMBERS, self._code)

    def _code(self, part: dict[str, str | None]) -> int:
        key = (str(part["a"]), str(part["n"]), str(part["c"]))
        self._sign = str(part["x"])
        return self._dates.setdefault(key, len(self._dates)) * _STRIDE + _DAY + _clock(part)

    def finish(self, codes: NDArray[Any]) -> NDArray[Any]:
        """Nanoseconds since 1970; sets `format`, and `orders` if several stay open.

        Raises
        ------
        ValueError
            No order makes dates of all numbers.
        """
        there = np.isfinite(codes)
        known = codes[there]
        date, rest = np.divmod(known, _STRIDE)
        clock, date = rest - _DAY, date.astype(np.int64)
        days = {order: np.array(table) for order in self._orders() if (table := self._in(order)) is not None}
        if not days:
            raise ValueError(f"{self._sample()!r} and the others are not dates in any single order")
        fitting = _continuing(days, date, clock)
        self.format, self.orders = self._name(fitting[0]), fitting if len(fitting) > 1 else ()
        moments: NDArray[Any] = days[fitting[0]].astype(np.int64)[date] * _DAY + clock
        if there.all():
            return moments
        whole = np.full(len(codes), np.nan)
        whole[there] = moments
        return whole

    def sample(self, order: str) -> tuple[str, str]:
        """A date of the column that an order leaves open, as it is written and as that order reads it."""
        for key in self._dates:
            numbers = _calendar(key, order)
            if numbers and len({_calendar(key, o) for o in self._orders()}) > 1:
                return self._sign.join(key), datetime.date(*numbers).strftime("%d %B %Y").lstrip("0")
        return self._sample(), order

    def _sample(self) -> str:
        return self._sign.join(next(iter(self._dates)))

    def _orders(self) -> tuple[str, ...]:
        """Orders that the digits allow, the likely ones first."""
        if self._order is not None:
            return (self._order,)
        if all(len(a) == 4 for a, _, _ in self._dates):
            return ("ymd",) if self._in("ymd") is not None else ("ydm",)
        years = all(len(c) == 4 for _, _, c in self._dates)
        orders = ("dmy", "mdy") if years else ("dmy", "mdy", "ymd")
        return tuple(o for o in orders if not (self._comma and o == "mdy"))

    def _in(self, order: str) -> list[int] | None:
        """Days since 1970 of all dates, or None if some are none in this order."""
        days = []
        for key in self._dates:
            numbers = _calendar(key, order)
            if numbers is None:
                return None
            days.append(_days(*numbers))
        return days

    def _name(self, order: str) -> str:
        words = {"y": "yyyy", "m": "mm", "d": "dd"}
        return self._sign.join(words[letter] for letter in order)


def _calendar(key: tuple[str, str, str], order: str) -> tuple[int, int, int] | None:
    """Year, month and day of three numbers, or None if they are no date in this order."""
    year, month, day = (key[i] for i in _PLACES[order])
    if len(year) not in (2, 4):
        return None
    try:
        datetime.date(_year(year), int(month), int(day))
    except ValueError:
        return None
    return _year(year), int(month), int(day)


def _continuing(
    days: dict[str, NDArray[np.int64]], date: NDArray[np.int64], clock: NDArray[Any]
) -> tuple[str, ...]:
    """The orders in which the stamps fall least; of several, those whose midnights do not last for weeks."""
    orders = tuple(days)
    alike = all(np.array_equal(days[orders[0]], days[order]) for order in orders)
    changes = np.flatnonzero(np.diff(date))
    if len(orders) == 1 or alike or not len(changes):
        return orders[:1] if alike else orders
    steps = {
        order: (days[order][date[changes + 1]] - days[order][date[changes]]) * _DAY
        + (clock[changes + 1] - clock[changes])
        for order in orders
    }
    falls = {order: int(np.count_nonzero(step < 0)) for order, step in steps.items()}
    orders = tuple(order for order in orders if falls[order] == min(falls.values()))
    short = tuple(order for order in orders if float(np.abs(steps[order]).max()) < _DAY)
    long = [order for order in orders if float(np.abs(steps[order]).max()) > _MONTH]
    return short if len(short) == 1 and len(long) == len(orders) - 1 else orders


def in_halves(nanoseconds: NDArray[Any], halves: NDArray[Any]) -> NDArray[Any] | None:
    """Moments whose hours begin anew at noon, with 0 or 12 h for the half of the day; None for hours beyond 12."""
    clock = nanoseconds % _DAY
    if (clock[np.isfinite(clock)] >= _HALF + _DAY // 24).any():
        return None
    return np.asarray(nanoseconds - clock + clock % _HALF + halves)


def unwrap_midnight(nanoseconds: NDArray[Any]) -> NDArray[Any]:
    """Times of day that pass midnight, made to rise: a fall by more than half a day is a new day."""
    falls = np.diff(nanoseconds) < -_DAY // 2
    return np.asarray(nanoseconds + np.concatenate(([0], np.cumsum(falls))) * _DAY)


def moments_column(nanoseconds: NDArray[Any]) -> Column:
    """Nanoseconds as a column; as float64, to 256 ns, where their span is too long for exact ones."""
    known = nanoseconds[np.isfinite(nanoseconds)]
    if len(known) and int(known.max()) - int(known.min()) >= _LONGEST_EXACT:
        nanoseconds = nanoseconds.astype(np.float64)
    return ArrayColumn(nanoseconds)
