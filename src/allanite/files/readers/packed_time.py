# SPDX-License-Identifier: BSD-3-Clause
"""Time of day and dates packed into numbers: ``120501.25`` for 12:05:01.25 (NMEA 0183), ``20240131``, ``310124``.

Such a time of day passes for seconds until a minute ends, where it jumps by 40 s. It is told by all of its values: they
are times of day, and those jumps are ordinary steps of the clock; or a packed date stands beside it.
"""

from __future__ import annotations

import datetime
from collections.abc import Collection, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.column_look import FEWEST, look, stands_still
from allanite.files.readers.headings import Heading
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import Column

__all__ = ["DAY", "Packed", "find_packed"]

#: Seconds of a day.
DAY: Final = 86_400.0
_SCALES: Final = (1.0, 1000.0, 100.0)  # hhmmss.sss, hhmmssmmm, hhmmsscc
_PLAUSIBLE = 5.0  # typical steps that a minute's end may take
_LEAST, _MOST = 10_101, 20_991_231  # 010101, the last day of 2099
_FEW, _EVEN = 0.2, 0.95  # share of the steps in which a minute ends; of even ones, where that is more
_RARE: Final = 0.05  # of the rows: dates change no more often
_YEARS: Final = (1970, 2100)


@dataclass(frozen=True, slots=True, kw_only=True)
class Packed:
    """A time of day in a column of numbers, and the date beside it.

    Attributes
    ----------
    clock : int
        Place of the time of day.
    seconds : ndarray [s]
        Since midnight of the first day, over all midnights.
    date : int or None
        Place of the column of dates.
    first_day : int or None
        Days since 1970 of the first date; None where there is none, or its order is not told.
    """

    clock: int
    seconds: NDArray[np.float64]
    date: int | None
    first_day: int | None


def find_packed(
    headings: Sequence[Heading], columns: Sequence[Column], known: Collection[int]
) -> Packed | None:
    """The packed time of day of a table, and its date; None where there is none.

    Parameters
    ----------
    headings : sequence of Heading
    columns : sequence of Column
        Those with a name that is not of time are not looked at.
    known : collection of int
        Places of dates that are read already.
    """
    if not columns or len(columns[0]) < FEWEST:
        return None
    open_ = [
        i
        for i, h in enumerate(headings)
        if not h.unit and i not in known and (h.group == "time" or not h.name)
    ]
    dates = [i for i in open_ if _may_be_dates(columns[i])]
    for clock in open_:
        if clock in dates or stands_still(columns[clock]):
            continue
        beside = [i for i in dates if headings[i].name or abs(i - clock) == 1]
        for scale in _SCALES:
            if any(
                np.isnan(_seconds(part + columns[clock].origin, scale)).any()
                for part in _known(columns[clock])
            ):
                continue
            packed = _unpacked(columns, clock, scale, beside[0] if beside else None)
            if packed is not None:
                return packed
    return None


def _known(column: Column) -> list[NDArray[np.float64]]:
    return [part[np.isfinite(part)] for part in look(column)]


def _unpacked(columns: Sequence[Column], clock: int, scale: float, date: int | None) -> Packed | None:
    """The time of day of a whole column, its midnights counted; None where it is none."""
    values = columns[clock].read(0, len(columns[clock])) + columns[clock].origin
    there = np.isfinite(values)
    seconds = _seconds(values, scale)
    if np.isnan(seconds[there]).any():
        return None
    falls = np.zeros(len(seconds))
    steps = np.diff(seconds[there])
    falls[np.flatnonzero(there)[1:]] = steps < -DAY / 2
    whole = seconds + np.cumsum(falls) * DAY
    days = None if date is None else _days(columns[date], falls)
    if date is not None and days is None:
        date = None
    jumps = _jumps(values[there] / scale, whole[there])
    if date is None and not jumps:
        return None
    if days is not None and np.isfinite(days).all():
        whole = seconds + (days - days[0]) * DAY
    sure = jumps or scale != 1.0 or float(values[there].max()) > DAY  # or they may be seconds since midnight
    first = int(days[0]) if sure and days is not None and np.isfinite(days[0]) else None
    return Packed(clock=clock, seconds=whole, date=date, first_day=first)


def _seconds(values: NDArray[np.float64], scale: float) -> NDArray[np.float64]:
    """Seconds since midnight; NaN where a value is no time of day."""
    with np.errstate(invalid="ignore"):
        number = values / scale
        hours, rest = np.divmod(number, 10_000.0)
        minutes, seconds = np.divmod(rest, 100.0)
        sound = (number >= 0) & (hours < 24) & (minutes < 60) & (seconds < 61)
        sound &= (values == np.round(values)) | (scale == 1.0)
    return np.where(sound, np.round((hours * 60 + minutes) * 60 + seconds, 9), np.nan)


def _jumps(numbers: NDArray[np.float64], seconds: NDArray[np.float64]) -> bool:
    """True if the numbers are seconds but jump where minutes end, and the clock goes on there as elsewhere."""
    steps, raw = np.diff(seconds), np.diff(numbers)
    rising = steps[steps > 0]
    if not len(rising):
        return False
    ends = np.abs(raw - steps) > 1.0
    ordinary = (steps[ends] >= 0) & (steps[ends] <= _PLAUSIBLE * float(np.median(rising)))
    few = bool(ends.mean() < _FEW) or _evenness(steps) > _EVEN
    return few and bool(ends.any()) and bool(ordinary.mean() > 0.5) and _evenness(steps) > _evenness(raw)


def _evenness(steps: NDArray[np.float64]) -> float:
    """Share of the steps that are about as long as most."""
    middle = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    return float((np.abs(steps - middle) <= 0.5 * middle).mean())


def _may_be_dates(column: Column) -> bool:
    """Whole numbers that hardly change, and are dates in some order."""
    parts = _known(column)
    changes = sum(int(np.count_nonzero(np.diff(part))) for part in parts)
    known = np.unique(np.concatenate(parts) + column.origin)
    return (
        changes <= _RARE * len(column)
        and len(known) > 0
        and all(value == round(value) and len(_calendar(int(value))) > 0 for value in known)
    )


def _calendar(number: int) -> list[int]:
    """Days since 1970 of a packed date: of yyyymmdd one, of six digits one for each order that makes a date."""
    if not _LEAST <= number <= _MOST:
        return []
    if number > 1_000_000:
        orders = [(number // 10_000, number // 100 % 100, number % 100)]
    else:
        a, b, c = number // 10_000, number // 100 % 100, number % 100
        orders = [(2000 + c, b, a), (2000 + a, b, c), (2000 + c, a, b)]
    days = []
    for year, month, day in orders:
        try:
            day_of_order = datetime.date(year, month, day)
        except ValueError:
            continue
        if _YEARS[0] <= year < _YEARS[1]:
            days.append(day_of_order.toordinal() - 719_163)
    return days


def _days(column: Column, falls: NDArray[np.float64]) -> NDArray[Any] | None:
    """Days since 1970, NaN where their order is not told; None where they do not change with the clock."""
    values = column.read(0, len(column)) + column.origin
    there = np.isfinite(values)
    changes = np.zeros(len(values))
    changes[np.flatnonzero(there)[1:]] = np.diff(values[there]) != 0
    if (falls > changes).sum() > 0:  # a midnight without a new date: this is no date
        return None
    numbers, place = np.unique(np.where(there, values, values[there][0]), return_inverse=True)
    readings = [_calendar(int(number)) for number in numbers]
    days = np.array([days[0] if len(set(days)) == 1 else np.nan for days in readings])[place]
    if np.isnan(days).any() and (changes > falls).any():
        return None
    return days
