# SPDX-License-Identifier: BSD-3-Clause
"""Which columns are time, and in what unit: by name, then by monotony, then by magnitude.

A column that counts rows (0, 1, 2, ...) is not time. A guess is never silent: it is written down in words.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.readers.headings import Heading
from allanite.readers.timebase import Stamps
from allanite.recording import Column
from allanite.units import Quantity, parse_unit

__all__ = ["TimeChoice", "choose_time", "is_counter", "rises"]

_WEEK = 604_800.0
_SHORT_NAMES = {1.0: "s", 1e-3: "ms", 1e-6: "us", 1e-9: "ns", 60.0: "min", 3600.0: "h", 86400.0: "d"}
_FACTORS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "0.1 ms": 1e-4}
#: Seconds since 1970 between 2001 and 2128, and the same in ms, µs, ns.
_EPOCH = (1e9, 5e9)
_UNKNOWN_UNIT = re.compile(
    r"[\[({<]_*([^\[\](){}<>]+?)_*[\])}>]$"
)  # at the end of a name: no unit that is known
_NO_STAMP = 1e30  # in whatever unit: no clock counts so far, and nanoseconds of it are no number
_LOOK = 2048  # values looked at in each of three places


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeChoice:
    """The time column(s) of a table.

    Attributes
    ----------
    stamps : Stamps
    source, unit : str
        Name of the column; unit its values are in: s, ms, us, ns, 0.1 ms, iso8601, gps week + s, ...
    start : int or None [ns]
        UTC of the first stamp, where the stamps are absolute.
    used : tuple of int
        Columns that are time (all of them, also those set aside): no channels.
    first_ns : int
        The first stamp in ns, absolute or not: it places one file against another.
    resolution : float or None [s]
        Spacing of the floating-point numbers that hold the stamps, where that is coarse.
    """

    stamps: Stamps
    source: str
    unit: str
    start: int | None
    used: tuple[int, ...]
    first_ns: int
    resolution: float | None = None
    guesses: tuple[str, ...] = field(default=())


@dataclass(frozen=True, slots=True)
class _Scaled:
    """Stamps in a column: seconds since the first one."""

    column: Column
    factor: float
    first: float

    def __len__(self) -> int:
        return len(self.column)

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        with np.errstate(invalid="ignore"):  # an infinite stamp is a missing one
            return (self.column.read(start, stop) - self.first) * self.factor


@dataclass(frozen=True, slots=True)
class _Summed:
    """Stamps in two columns: seconds and nanoseconds, or weeks and seconds."""

    coarse: _Scaled
    fine: _Scaled

    def __len__(self) -> int:
        return len(self.coarse)

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        return self.coarse.read(start, stop) + self.fine.read(start, stop)


def choose_time(
    headings: Sequence[Heading],
    columns: Sequence[Column],
    known_units: dict[int, str],
    nominal: float | None,
) -> TimeChoice | None:
    """The time column of a table, or None.

    Parameters
    ----------
    headings, columns : sequences, one entry per column
    known_units : dict of column number to unit
        Columns that are time beyond doubt (parsed dates, in ns since 1970).
    nominal : float or None [Hz]
        Rate that the file states elsewhere; settles the unit of stamps that could be in several.
    """
    if not columns or len(columns[0]) == 0:
        return None
    named = [i for i, h in enumerate(headings) if h.group == "time" or i in known_units]
    pair = _pair(headings, columns, named)
    if pair is not None:
        return pair
    rising = [i for i in named if rises(columns[i])]
    guesses: list[str] = []
    if rising:
        chosen = min(rising, key=lambda i: (_roughness(columns[i]), i)) if len(rising) > 1 else rising[0]
        others = [headings[i].name for i in rising if i != chosen]
        if others:
            guesses.append(
                f"several time columns: {headings[chosen].name!r} is used, not {', '.join(others)}"
            )
    elif named and not _could_be_temperature(headings, named):
        chosen = named[0]  # not in order: the time grid refuses it with its rows
    else:
        found = _by_monotony(headings, columns)
        if found is None:
            return None
        chosen, named = found, [found]
        guesses.append(f"column {chosen} has no name but rises evenly: read as time")
    return _single(headings, columns, chosen, known_units, nominal, tuple(named), guesses)


def _could_be_temperature(headings: Sequence[Heading], named: list[int]) -> bool:
    return len(named) == 1 and headings[named[0]].name == "T"


def _single(
    headings: Sequence[Heading],
    columns: Sequence[Column],
    chosen: int,
    known_units: dict[int, str],
    nominal: float | None,
    used: tuple[int, ...],
    guesses: list[str],
) -> TimeChoice:
    column, heading = columns[chosen], headings[chosen]
    first = _first_finite(column)
    absolute = first + column.origin
    unit, factor = known_units.get(chosen, ""), 1e-9
    if not unit:
        unit, factor = _stated(heading.unit)
    if not unit:
        unit, factor = _by_magnitude(column, absolute, nominal)
        if not _EPOCH[0] <= absolute * factor <= _EPOCH[1]:
            stated = _UNKNOWN_UNIT.search(heading.name)
            reason = f"the unit {stated[1]!r} is not known" if stated else "no unit given"
            guesses.append(f"time column {heading.name or chosen}: {reason}, read as {unit}")
    first_ns = round(absolute * round(factor * 1e9))
    start = first_ns if _EPOCH[0] <= absolute * factor <= _EPOCH[1] else None
    spacing = None
    if column.dtype.kind == "f" and column.dtype.itemsize < 8:
        last = float(np.abs(column.read(len(column) - 1, len(column))).max())
        spacing = float(np.spacing(column.dtype.type(max(abs(first), last)))) * factor
    return TimeChoice(
        stamps=_Scaled(column, factor, first),
        source=heading.name or f"column {chosen}",
        unit=unit,
        start=start,
        used=used,
        first_ns=first_ns,
        resolution=spacing,
        guesses=tuple(guesses),
    )


def _stated(unit: str) -> tuple[str, float]:
    if not unit:
        return "", 1.0
    try:
        factor = parse_unit(unit, Quantity.TIME).factor
    except InputError:
        return "", 1.0
    return _SHORT_NAMES.get(factor, unit), factor


def _by_magnitude(column: Column, absolute: float, nominal: float | None) -> tuple[str, float]:
    """Unit of stamps that name none."""
    for unit, factor in _FACTORS.items():
        if unit != "0.1 ms" and _EPOCH[0] <= absolute * factor <= _EPOCH[1]:
            return unit, factor
    differences = np.diff(_look(column)[0])
    differences = differences[np.isfinite(differences) & (differences > 0)]
    step = float(differences.mean()) if len(differences) else 1.0
    if nominal is not None:
        for unit, factor in _FACTORS.items():
            if abs(step * factor * nominal - 1.0) < 0.05:
                return unit, factor
    whole = bool(np.all(differences == np.round(differences)))
    if not whole or step < 1.5:
        return "s", 1.0
    unit = "ms" if step < 200.0 else "us" if step < 2e5 else "ns"
    return unit, _FACTORS[unit]


# -- two columns -------------------------------------------------------------------------------------------


def _pair(headings: Sequence[Heading], columns: Sequence[Column], named: list[int]) -> TimeChoice | None:
    """Seconds with nanoseconds, or GPS week with seconds of the week."""
    words = {i: headings[i].name.lower() for i in named}
    week = next((i for i in named if "week" in words[i]), None)
    within = next((i for i in named if i != week and "week" not in words[i]), None)
    if week is not None and within is not None:
        factor = _stated(headings[within].unit)[1]
        return _sum(columns, headings, (week, _WEEK), (within, factor), named, "gps week + s", None)
    fractions = [i for i in named if headings[i].unit == "ns" and not rises(columns[i])]
    seconds = [i for i in named if i not in fractions and rises(columns[i])]
    if fractions and seconds and float(np.nanmax(_look(columns[fractions[0]])[0])) < 1e9:
        s = seconds[0]
        first = _first_finite(columns[s]) + columns[s].origin
        start = round(first) * 10**9 + round(_first_finite(columns[fractions[0]]))
        absolute = start if _EPOCH[0] <= first <= _EPOCH[1] else None
        return _sum(columns, headings, (s, 1.0), (fractions[0], 1e-9), named, "s + ns", absolute)
    return None


def _sum(
    columns: Sequence[Column],
    headings: Sequence[Heading],
    coarse: tuple[int, float],
    fine: tuple[int, float],
    named: list[int],
    unit: str,
    start: int | None,
) -> TimeChoice:
    parts = [_Scaled(columns[i], f, _first_finite(columns[i])) for i, f in (coarse, fine)]
    source = f"{headings[coarse[0]].name} + {headings[fine[0]].name}"
    first_ns = sum(round((p.first + p.column.origin) * round(p.factor * 1e9)) for p in parts)
    return TimeChoice(
        stamps=_Summed(*parts), source=source, unit=unit, start=start, used=tuple(named), first_ns=first_ns
    )


# -- the look of a column ----------------------------------------------------------------------------------


def _look(column: Column) -> list[NDArray[np.float64]]:
    """Values at the beginning, in the middle and at the end."""
    n = len(column)
    starts = sorted({0, max((n - _LOOK) // 2, 0), max(n - _LOOK, 0)})
    return [column.read(a, min(a + _LOOK, n)) for a in starts]


def _first_finite(column: Column) -> float:
    head = column.read(0, min(_LOOK, len(column)))
    finite = head[np.abs(head) < _NO_STAMP]
    return float(finite[0]) if len(finite) else 0.0


def rises(column: Column) -> bool:
    """True if the values rise nearly everywhere that is looked at (equal neighbours are allowed)."""
    parts = _look(column)
    steps = [d for d in (np.diff(p[np.isfinite(p)]) for p in parts) if len(d)]
    if not steps:
        return False
    together = np.concatenate(steps)
    ends = [float(p[np.isfinite(p)][-1]) for p in parts if np.isfinite(p).any()]
    return bool((together >= 0).mean() >= 0.9 and (together > 0).any() and ends == sorted(ends))


def is_counter(column: Column) -> bool:
    """True if whole numbers rise by one from row to row (a few may be missing)."""
    for part in _look(column):
        steps = np.diff(part)
        if len(steps) == 0 or not np.all(part == np.round(part)) or (steps == 1).mean() < 0.9:
            return False
        if (steps < 0).any():
            return False
    return True


def _roughness(column: Column) -> float:
    """Spread of the differences over their mean: among several time columns the smoothest one is the best."""
    spread = 0.0
    for part in _look(column):
        steps = np.diff(part[np.isfinite(part)])
        mean = steps.mean() if len(steps) else 0.0
        spread = max(spread, float(steps.std() / mean) if mean > 0 else math.inf)
    return round(spread, 3)


def _by_monotony(headings: Sequence[Heading], columns: Sequence[Column]) -> int | None:
    """A column without a name, first or last, that rises strictly, beside columns that do not."""
    ends = [0, len(columns) - 1] if len(columns) > 1 else []
    for i in ends:
        if headings[i].name or len(columns[i]) < 8 or is_counter(columns[i]):
            continue
        if all(_strictly_even(p) for p in _look(columns[i])) and rises(columns[i]):
            return i
    return None


def _strictly_even(part: NDArray[np.float64]) -> bool:
    steps = np.diff(part)
    if len(steps) == 0 or not np.isfinite(steps).all() or (steps <= 0).mean() > 0.01:
        return False
    middle = float(np.median(steps))
    return bool((np.abs(steps - middle) <= 0.5 * middle).mean() > 0.8)
