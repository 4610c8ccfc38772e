# SPDX-License-Identifier: BSD-3-Clause
"""Time in several columns: year, month, day, hour, minute and second, and what is finer than a second.

Columns are parts of a date by their names and their values: ``Year,Month,Day,Hour,Minute,Second``,
``YYYY,MM,DD,hh,mm,ss``, ``year,doy,hour,minute,second``, ``hour,minute,second,ms``. MM behind an hour is minutes,
elsewhere months.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import Column
from allanite.recording.sample_columns import Calculated

__all__ = ["Parts", "find_parts", "is_fraction", "part_places"]

Looked = Sequence[NDArray[np.float64]]

_WORDS: Final = {
    "year": r"y{4}|yy|years?|yr|jahr|ann[ée]e",
    "month": r"month|mon|mnth|monat|mois",
    "doy": r"doy|day_?of_?year|y_?day|j_?day|julian_?day|ddd",
    "day": r"day|dd|dom|m_?day|day_?of_?month|tag|jour",
    "hour": r"hours?|hr|hrs|hh|stunde|heure",
    "minute": r"minutes?|mins?|mn",
    "second": r"seconds?|secs?|ss|ss_?[sf]+|sekunde|seconde",
    "ms": r"ms|m_?secs?|milli_?seconds?|millis|milli|sss",
    "us": r"[uµμ]s|[uµμ]_?secs?|micro_?seconds?|micros|micro",
    "ns": r"ns|n_?secs?|nano_?seconds?|nanos|nano|nano_?sec",
}
_PATTERNS = {part: re.compile(pattern, re.IGNORECASE) for part, pattern in _WORDS.items()}
_WHOSE = re.compile(
    r"^(?:utc|gps|gmt|local|date|time|rtc|clock|sys|system|host|pc)_|_(?:utc|gps|gmt|local|h|min|s|d|[muµn]s)$",
    re.IGNORECASE,
)
#: Letters of which three in a row are a date or a time of day.
_LETTERS = (("y", "m", "d"), ("year", "month", "day")), (("h", "m", "s"), ("hour", "minute", "second"))
_SECONDS: Final = {
    "day": 86_400.0,
    "hour": 3600.0,
    "minute": 60.0,
    "second": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "ns": 1e-9,
}
_TOP: Final = {"month": (1, 13), "day": (1, 32), "doy": (1, 367), "minute": (0, 60), "second": (0, 61)}
_FINE = ("ms", "us", "ns")
_CENTURY = 69  # of years of two digits, as in POSIX


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """Columns that together are time.

    Attributes
    ----------
    places : tuple of int
        Of the columns, the largest part first.
    column : Column [s]
        Seconds since midnight of the first day, or of the clock's own beginning.
    epoch : int or None [s]
        UTC of that midnight, where the year is known.
    turn : float or None [s]
        Where the clock begins anew, as nothing counts the days (hours, minutes).
    """

    places: tuple[int, ...]
    column: Column
    epoch: int | None
    turn: float | None


def is_fraction(coarse: Looked, fine: Looked, factor: float) -> bool:
    """True if a column goes on between the whole seconds of another one, and begins anew with each.

    Parameters
    ----------
    coarse, fine : sequence of ndarray
        The same rows of both, whole seconds in the former.
    factor : float [s]
        Unit of the finer one.
    """
    falls = lonely = 0
    for whole, part in zip(coarse, fine, strict=True):
        known = np.isfinite(whole) & np.isfinite(part)
        whole, part = whole[known], part[known]
        if len(part) and not 0.0 <= part.min() <= part.max() < 1.0 / factor:
            return False
        down = np.diff(part) < 0
        falls += int(down.sum())
        lonely += int((down & (np.diff(whole) == 0)).sum())
    return lonely <= 0.02 * falls


def find_parts(
    raw: Sequence[str], columns: Sequence[Column], look: Callable[[int], Looked], file: str
) -> Parts | None:
    """The columns that are parts of a date or of a time of day; None where they do not make one.

    Parameters
    ----------
    raw : sequence of str
        Headings as they stand in the file.
    columns : sequence of Column
    look : callable
        Values of a column at the beginning, in the middle and at the end.
    file : str
        For messages.
    """
    places = _named_parts(raw)
    if "second" not in places or not (places.keys() & {"minute", "ms"}):
        return None
    looked = {place: look(place) for place in places.values()}
    places = {part: place for part, place in places.items() if _in_range(part, looked[place])}
    chain = _chain(places)
    if len(chain) < 2:
        return None
    whole = all(bool((part[np.isfinite(part)] % 1 == 0).all()) for part in looked[places["second"]])
    if whole:
        chain += _fine(places, looked)
    if chain == ["second"]:
        return None
    dated = chain[0] in ("year", "doy", "month", "day")
    column = _Parted(tuple(chain), tuple(columns[places[part]] for part in chain), file, 0)
    first = column.days(0, 1)
    base = int(first[0]) if len(first) and np.isfinite(first[0]) else 0
    turn = None if dated else {"hour": 86_400.0, "minute": 3600.0, "second": 60.0}[chain[0]]
    return Parts(
        places=tuple(places[part] for part in chain),
        column=_Parted(column.parts, column.columns, file, base),
        epoch=base * 86_400 if chain[0] == "year" else None,
        turn=turn,
    )


def part_places(raw: Sequence[str]) -> frozenset[int]:
    """Columns that are parts of a date or of a time of day by their headings."""
    return frozenset(_named_parts(raw).values())


def _named_parts(raw: Sequence[str]) -> dict[str, int]:
    """Which column is which part, by name; none that two columns claim."""
    names = [re.sub(r"[^A-Za-zµμé]+", "_", text).strip("_") for text in raw]
    claims: dict[str, list[int]] = {}
    for i, name in enumerate(names):
        bare = _WHOSE.sub("", _WHOSE.sub("", name)) or name
        part = next(
            (p for p, pattern in _PATTERNS.items() if pattern.fullmatch(name) or pattern.fullmatch(bare)),
            None,
        )
        if bare.lower() == "mm":
            hours = i > 0 and _PATTERNS["hour"].fullmatch(_WHOSE.sub("", names[i - 1]) or "-")
            part = "minute" if hours else "month"
        if part is not None:
            claims.setdefault(part, []).append(i)
    for letters, parts in _LETTERS:
        for i in range(len(names) - 2):
            if tuple(name.lower() for name in names[i : i + 3]) == letters:
                for k, part in enumerate(parts):
                    claims.setdefault(part, []).append(i + k)
    return {part: places[0] for part, places in claims.items() if len(places) == 1}


def _in_range(part: str, looked: Looked) -> bool:
    low, high = _TOP.get(part, (0, np.inf))
    known = [values[np.isfinite(values)] for values in looked]
    whole = part == "second" or all(bool((values % 1 == 0).all()) for values in known)
    return whole and all(len(v) == 0 or (low <= v.min() and v.max() < high) for v in known)


def _chain(places: Mapping[str, int]) -> list[str]:
    """Parts down to the second, without a hole."""
    clock = ["second"] if "second" in places else []
    for part in ("minute", "hour"):
        if not clock or clock[0] != {"minute": "second", "hour": "minute"}[part] or part not in places:
            break
        clock.insert(0, part)
    if clock[:1] != ["hour"]:
        return clock if len(clock) > 1 or "ms" in places else []
    for date in (("year", "month", "day"), ("year", "doy"), ("month", "day"), ("doy",), ("day",)):
        if all(part in places for part in date):
            return [*date, *clock]
    return clock


def _fine(places: Mapping[str, int], looked: Mapping[int, Looked]) -> list[str]:
    """Parts of a second; microseconds of a whole second stand for the milliseconds beside them."""
    fine: list[str] = []
    for part in _FINE:
        if part in places and is_fraction(looked[places["second"]], looked[places[part]], _SECONDS[part]):
            largest = max((float(np.nanmax(v, initial=0.0)) for v in looked[places[part]]), default=0.0)
            fine = [one for one in fine if largest * _SECONDS[part] < _SECONDS[one]] + [part]
    return fine


@dataclass(frozen=True, slots=True)
class _Parted(Calculated):
    """Seconds since a day, out of the parts of a date."""

    parts: tuple[str, ...]
    columns: tuple[Column, ...]
    file: str
    base: int

    def __len__(self) -> int:
        return len(self.columns[0])

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        seconds = (self.days(start, stop) - self.base) * 86_400.0
        for part, column in zip(self.parts, self.columns, strict=True):
            if part in _SECONDS and part != "day":
                seconds += (column.read(start, stop) + column.origin) * _SECONDS[part]
        return seconds

    def days(self, start: int, stop: int) -> NDArray[np.float64]:
        """Days since 1970, or since the first of January of no known year.

        Raises
        ------
        InputError
            Numbers that are no date.
        """
        of = {
            part: column.read(start, stop) + column.origin
            for part, column in zip(self.parts, self.columns, strict=True)
            if part in ("year", "month", "day", "doy")
        }
        if not of:
            return np.zeros(min(stop, len(self)) - start)
        known = np.logical_and.reduce([np.isfinite(values) for values in of.values()])
        days = np.full(len(known), np.nan)
        whole = {part: values[known].astype(np.int64) for part, values in of.items()}
        days[known] = self._dates(whole, np.flatnonzero(known) + start)
        return days

    def _dates(self, of: dict[str, NDArray[np.int64]], rows: NDArray[np.int64]) -> NDArray[np.int64]:
        within = of.get("doy", of.get("day", 0)) - np.int64(1)
        if "month" not in of and "year" not in of:
            return np.asarray(within)
        year = of.get("year", np.full(len(rows), 2001, dtype=np.int64))
        year = np.where(year < 100, year + np.where(year >= _CENTURY, 1900, 2000), year)
        month = of.get("month", np.ones(len(rows), dtype=np.int64))
        bad = (month < 1) | (month > 12) | (year < 1678) | (year > 2261)
        months = np.where(bad, 0, (year - 1970) * 12 + month - 1).astype("datetime64[M]")
        dates = months.astype("datetime64[D]") + within.astype("timedelta64[D]")
        span = "datetime64[M]" if "day" in of else "datetime64[Y]"
        bad |= dates.astype(span) != months.astype(span)
        if bad.any():
            at = int(bad.argmax())
            date = ", ".join(f"{part} {int(values[at])}" for part, values in of.items())
            raise InputError(
                f"{self.file}: row {int(rows[at])}: {date} is not a date. Correct the row, name another "
                "time column (--time), or pass the rate and no time (--time none --rate RATE)"
            )
        return np.asarray(dates.astype(np.int64))
