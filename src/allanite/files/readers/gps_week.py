# SPDX-License-Identifier: BSD-3-Clause
"""GPS week and time of week: two columns that are one clock.

They are told by their names (``week,tow``, ``wn,TOW_ms``) or, without names, by their values: a whole number that
stands still or goes on by one, beside numbers that rise below the 604 800 s of a week and begin anew with it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.column_look import FEWEST, is_even, look
from allanite.files.readers.headings import Heading
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import Column

__all__ = ["WEEK", "GpsClock", "find_gps_clock", "is_slow", "names_time_of_week", "unit_of_week"]

#: Seconds of a week.
WEEK: Final = 604_800.0
_OF_WEEK = re.compile(r"(?:^|_|gps)(?:i?tow|sow|gms)(?:_|$)|of_?w(?:ee)?k", re.IGNORECASE)
_WEEK_NAME = re.compile(
    r"(?:gps|gnss|utc|g)?_?(?:weeks?|wk|wno?|wnum|w)_?(?:no|nr|num|number|count|n)?_?(?:gps)?", re.IGNORECASE
)
_WEEKS: Final = (1000.0, 3000.0)  # of a column without name: March 1999 to July 2037
_MOST_WEEKS: Final = 1e4  # of one with a name
_UNITS: Final = (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9))
_SHORTEST: Final = 5e-5  # interval of a log [s]
_ROWS = 1 << 18


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsClock:
    """The columns of a week and of the time in it.

    Attributes
    ----------
    week, within : int
        Their places.
    unit : str
        Of the time of week.
    factor : float [s]
    steps : bool
        The week goes on where the time of week begins anew; else the week says nothing.
    open : bool
        The unit is not told: seconds of a slow log, or milliseconds of the first minutes of a week.
    """

    week: int
    within: int
    unit: str
    factor: float
    steps: bool
    open: bool


def names_time_of_week(name: str) -> bool:
    """True for tow, iTOW, sow, time_of_week, ..., whatever their unit."""
    return _OF_WEEK.search(name) is not None


def find_gps_clock(
    headings: Sequence[Heading], columns: Sequence[Column], units: Sequence[tuple[str, float]]
) -> GpsClock | None:
    """The week and the time of week of a table; None where it has none.

    Parameters
    ----------
    headings : sequence of Heading
    columns : sequence of Column
    units : sequence of (str, float [s])
        Units of time that the headings name; ("", 1.0) where they name none.
    """
    for week, within in _pairs(headings):
        named = headings[week].name != ""
        if not _is_week(columns[week], named) or not _within(columns[within], named):
            continue
        unit, factor = units[within]
        if not unit:
            unit, factor = unit_of_week(columns[within])
        if not unit or _largest(columns[within]) * factor > WEEK:
            continue
        steps = _goes_on(columns[week], columns[within], factor)
        if steps or (named and names_time_of_week(headings[within].name)):
            unsure = not units[within][0] and is_slow(columns[within], factor)
            return GpsClock(week=week, within=within, unit=unit, factor=factor, steps=steps, open=unsure)
    return None


def unit_of_week(column: Column) -> tuple[str, float]:
    """The coarsest unit in which a time of week is within one, and its rate that of a log; ("", 1.0) where none is."""
    steps = _rising(column)
    step = float(np.median(steps)) if len(steps) else np.inf
    near = (pair for pair in _UNITS if _largest(column) * pair[1] <= WEEK)
    return next((pair for pair in near if step * pair[1] >= _SHORTEST), ("", 1.0))


def is_slow(column: Column, factor: float) -> bool:
    """True for whole seconds that are far apart: they may be milliseconds of the first ten minutes of a week."""
    steps = _rising(column)
    turned = bool((_steps_of(column) < -WEEK / 2).any())
    return factor == 1.0 and not turned and bool((steps % 1 == 0).all()) and float(np.median(steps)) > 1.0


def _steps_of(column: Column) -> NDArray[np.float64]:
    return np.concatenate([np.diff(part[np.isfinite(part)]) for part in look(column)])


def _rising(column: Column) -> NDArray[np.float64]:
    steps = _steps_of(column)
    return steps[steps > 0]


def _pairs(headings: Sequence[Heading]) -> Iterator[tuple[int, int]]:
    """Places that may be those of a week and of the time in it, the likely ones first."""
    places = range(len(headings))
    for week in places:
        name = headings[week].name
        if name and not _WEEK_NAME.fullmatch(name):
            continue
        beside = [i for i in (week + 1, week - 1) if i in places]
        if name:
            clocks = [i for i in places if i != week and headings[i].group == "time"]
            of_week = [i for i in places if i != week and names_time_of_week(headings[i].name)]
            beside = [*of_week, *(i for i in beside if i in clocks), *clocks]
            beside = of_week if name.lower() == "w" else beside  # else it is part of a quaternion
        else:
            beside = [i for i in beside if not headings[i].name]
        yield from ((week, i) for i in dict.fromkeys(beside))


def _is_week(column: Column, named: bool) -> bool:
    """Whole numbers that stand still or go on by one."""
    low, high = (0.0, _MOST_WEEKS) if named else _WEEKS
    for part in look(column):
        known = part[np.isfinite(part)] + column.origin
        if not len(known) or not (known == np.round(known)).all():
            return False
        if not low <= known.min() <= known.max() <= high or not np.isin(np.diff(known), (0.0, 1.0)).all():
            return False
    return True


def _within(column: Column, named: bool) -> bool:
    """Numbers that rise and are not negative; without a name evenly, and not from zero on."""
    parts = [part[np.isfinite(part)] + column.origin for part in look(column)]
    known = np.concatenate(parts)
    if len(known) < 2 or known.min() < 0.0 or not (np.diff(known) > 0).any():
        return False
    if named:
        return True
    first = float(known[0])
    step = float(np.median(np.diff(parts[0]))) if len(parts[0]) > 1 else 0.0
    return len(column) >= FEWEST and step > 0 and first > step and all(is_even(part) for part in parts)


def _largest(column: Column) -> float:
    return max(float(np.nanmax(part, initial=0.0)) for part in look(column)) + column.origin


def _goes_on(week: Column, within: Column, factor: float) -> bool:
    """True if the week goes on exactly where the time of week begins anew."""
    for start in range(0, len(week), _ROWS):
        first, stop = max(start - 1, 0), min(start + _ROWS, len(week))
        weeks, times = np.diff(week.read(first, stop)), np.diff(within.read(first, stop)) * factor
        both = weeks * WEEK + times
        if (np.abs(both[np.isfinite(both)]) > WEEK / 2).any():
            return False
    return True
