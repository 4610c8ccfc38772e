# SPDX-License-Identifier: BSD-3-Clause
"""Dates and times of day as logs write them, to nanoseconds since 1970 (UTC where no zone is given)."""

from __future__ import annotations

import datetime
import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["DATE_FORMATS", "date_format", "to_nanoseconds", "unwrap_midnight"]

_CLOCK = r"\(?(?P<H>\d{1,2}):(?P<M>\d\d)(?::(?P<S>\d\d)(?:[.,:](?P<f>\d{1,9}))?)?\)?"
_ZONE = r"\s*(?P<z>Z|UTC|[+-]\d\d:?\d\d)?"
_BETWEEN = r"(?:[T_ -]\s*)"

#: Name of a format and its pattern; the first that matches counts.
DATE_FORMATS: dict[str, re.Pattern[str]] = {
    name: re.compile(pattern)
    for name, pattern in {
        "iso8601": r"(?P<Y>\d{4})-(?P<m>\d\d)-(?P<d>\d\d)(?:[T ]" + _CLOCK + _ZONE + ")?",
        "yyyy/mm/dd": r"(?P<Y>\d{4})[/.](?P<m>\d{1,2})[/.](?P<d>\d{1,2})(?:"
        + _BETWEEN
        + _CLOCK
        + _ZONE
        + ")?",
        "dd-mon-yyyy": r"(?P<d>\d{1,2})[-/ ](?P<b>[A-Za-z]{3,9})[-/ ](?P<Y>\d{4})(?:"
        + _BETWEEN
        + _CLOCK
        + _ZONE
        + ")?",
        "dd.mm.yyyy": r"(?P<d>\d{1,2})\.(?P<m>\d{1,2})\.(?P<Y>\d{4})(?:" + _BETWEEN + _CLOCK + _ZONE + ")?",
        "mm/dd/yyyy": r"(?P<m>\d{1,2})/(?P<d>\d{1,2})/(?P<Y>\d{4})(?:" + _BETWEEN + _CLOCK + _ZONE + ")?",
        "yyyymmdd": r"(?P<Y>(?:19|20)\d\d)(?P<m>0[1-9]|1[0-2])(?P<d>[0-3]\d)[-_T ]" + _CLOCK + _ZONE,
        "mmddyyyy": r"(?P<m>0[1-9]|1[0-2])(?P<d>[0-3]\d)(?P<Y>(?:19|20)\d\d)[-_T ]" + _CLOCK + _ZONE,
        "hh:mm:ss": _CLOCK,
    }.items()
}
_MONTHS = {"jan": 1, "feb": 2, "mar": 3, "apr": 4, "may": 5, "jun": 6, "jul": 7, "aug": 8, "sep": 9, "oct": 10,
           "nov": 11, "dec": 12}  # fmt: skip
_DAY = 86_400_000_000_000


def date_format(cell: str) -> str | None:
    """Name of the format of a cell, or None."""
    if len(cell) < 5 or not ("-" in cell or ":" in cell or "/" in cell or "." in cell):
        return None
    for name, pattern in DATE_FORMATS.items():
        if pattern.fullmatch(cell):
            return name
    return None


def to_nanoseconds(cells: Iterable[str | None], name: str) -> NDArray[np.int64] | NDArray[np.float64]:
    """Cells of one format in nanoseconds; float64 with NaN if some cells are None.

    Raises
    ------
    ValueError
        A cell that is not of the format, or no date; the second argument of the error is its position.
    """
    pattern = DATE_FORMATS[name]
    values: list[int | None] = []
    for i, cell in enumerate(cells):
        if cell is None:
            values.append(None)
            continue
        match = pattern.fullmatch(cell.strip())
        if match is None:
            raise ValueError(f"{cell!r} is not of the form {name}", i)
        try:
            values.append(_nanoseconds(match.groupdict()))
        except ValueError as error:
            raise ValueError(f"{cell!r}: {error}", i) from None
    if None in values:
        return np.array([np.nan if v is None else float(v) for v in values])
    return np.array(values, dtype=np.int64)


def _nanoseconds(part: dict[str, str | None]) -> int:
    total = 0
    if part.get("Y"):
        month = part.get("m") or str(_MONTHS.get(str(part.get("b"))[:3].lower(), 0))
        total = _days(int(str(part["Y"])), int(month), int(str(part["d"]))) * _DAY
    if part.get("H"):
        seconds = (int(str(part["H"])) * 60 + int(str(part["M"]))) * 60 + int(part.get("S") or 0)
        total += seconds * 10**9 + int((part.get("f") or "0").ljust(9, "0"))
    zone = part.get("z")
    if zone and zone[0] in "+-":
        minutes = int(zone[1:3]) * 60 + int(zone[-2:])
        total -= (minutes if zone[0] == "+" else -minutes) * 60 * 10**9
    if not -(1 << 63) <= total < 1 << 63:
        raise ValueError("nanoseconds since 1970 reach from 1678 to 2262")
    return total


@lru_cache(maxsize=512)
def _days(year: int, month: int, day: int) -> int:
    return datetime.date(year, month, day).toordinal() - 719_163  # the ordinal of 1970-01-01


def unwrap_midnight(nanoseconds: NDArray[Any]) -> NDArray[Any]:
    """Times of day that pass midnight, made to rise: a fall by more than half a day is a new day."""
    falls = np.diff(nanoseconds) < -_DAY // 2
    return np.asarray(nanoseconds + np.concatenate(([0], np.cumsum(falls))) * _DAY)
