# SPDX-License-Identifier: BSD-3-Clause
"""A column that numbers the samples: jumps of the number are samples that are missing.

A number of a few bits begins anew (0 ... 255, 0 ...), and a logger that keeps every k-th sample goes on by k. Both are
recognised by the whole column, never by its beginning, and said in words. A column of that name that does neither
numbers nothing here, and that is said too.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.column_look import is_counter, look
from allanite.files.readers.headings import Heading
from allanite.files.readers.stamp_units import FACTORS
from allanite.files.readers.timebase import Stamps
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural
from allanite.recording.records import ArrayColumn, Column

__all__ = ["RowNumbering", "clocks_beside", "numbering_of", "unseen_by_stamps"]

#: Where numbers begin anew: after 8, 16, 24, 32 bits, or after some decimal digits.
_TURNS = tuple(sorted([256, 65_536, 1 << 24, 1 << 32, *(10**k for k in range(2, 10))]))
_ROWS = 1 << 18
#: Steps without which values alone do not make a column a number of rows.
_LEAST = 64
#: Least share of equal steps of a column that counts rows without being called so.
_ALIKE = 0.98
#: Two clocks of one time differ by less [relative].
_SAME_RATE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class RowNumbering:
    """The sample numbers of a table.

    Attributes
    ----------
    place : int
        Of the column.
    name : str
    numbers : Column
        One more from row to row where no sample is missing.
    remarks : tuple of str
        What was understood, in words.
    """

    place: int
    name: str
    numbers: Column
    remarks: tuple[str, ...] = ()

    @property
    def missing(self) -> int:
        """Samples between the first and the last number that have no row."""
        n = len(self.numbers)
        span = float(self.numbers.read(n - 1, n)[0]) - float(self.numbers.read(0, 1)[0])
        return round(span) + 1 - n if np.isfinite(span) else 0


def numbering_of(
    headings: Sequence[Heading], columns: Sequence[Column], used: Collection[int], *, timed: bool
) -> tuple[list[RowNumbering], list[str]]:
    """All columns that number the samples, and what is to be said of them.

    A name of its own makes one, and so do whole numbers that go on by the same step from row to row whatever the
    column is called, unless that says what it measures.

    Parameters
    ----------
    used : collection of int
        Columns that are time.
    timed : bool
        There is a clock, which tells more of gaps than numbers do.
    """
    numberings: list[RowNumbering] = []
    unnamed: list[RowNumbering] = []
    remarks: list[str] = []
    for place, (heading, column) in enumerate(zip(headings, columns, strict=True)):
        if heading.group == "counter":
            numbering = _numbering(place, heading.name, column)
            if numbering is not None:
                numberings.append(numbering)
                remarks += [] if timed else numbering.remarks
            elif not timed:
                remarks.append(
                    f"column {heading.name} has the name of a sample number but does not number the rows: "
                    "it is a channel, and does not show gaps"
                )
        elif place not in used and len(columns) > 1 and not heading.group and not heading.unit:
            numbering = _unnamed(place, heading.name, column, timed=timed)
            unnamed += [] if numbering is None else [numbering]
    if len(numberings) + len(unnamed) + len(used) < len(columns):  # else nothing would be left
        numberings += unnamed
        remarks += [text for numbering in unnamed for text in numbering.remarks]
    return sorted(numberings, key=lambda numbering: numbering.place), remarks


def _unnamed(place: int, name: str, column: Column, *, timed: bool) -> RowNumbering | None:
    """A column that numbers the rows by its values alone: nearly all steps are one and the same."""
    if not _steps_alike(column) and (place > 0 or name or not is_counter(column)):
        return None
    numbering = _numbering(place, name or str(place + 1), column)
    if numbering is None:
        return None
    name = numbering.name
    say = f"column {name} counts rows: it is " + (
        "no channel" if timed else f"neither time nor a channel (--time {name}:s if it counts seconds)"
    )
    return replace(numbering, remarks=(say, *numbering.remarks))


def _steps_alike(column: Column) -> bool:
    """Wherever the column is looked at, whole numbers go up by one step, but for a few that are missing."""
    steps = [np.diff(part[np.isfinite(part)]) for part in look(column)]
    together = np.concatenate(steps)
    if len(together) < _LEAST or not np.array_equal(together, np.round(together)):
        return False
    usual = float(np.median(together))
    return usual > 0 and bool((together == usual).mean() >= _ALIKE)


def clocks_beside(
    stamps: Stamps,
    headings: Sequence[Heading],
    columns: Sequence[Column],
    used: Collection[int],
    guesses: list[str],
) -> set[int]:
    """Columns that say the same time once more, in any unit of time; what is left out is said."""
    places = {
        place
        for place, (heading, column) in enumerate(zip(headings, columns, strict=True))
        if place not in used and not heading.group and not heading.unit and _goes_with(stamps, column)
    }
    if len(places) + len(used) == len(columns):  # nothing would be left
        return set()
    if places:
        names = ", ".join(headings[place].name or str(place + 1) for place in sorted(places))
        guesses.append(f"left out: {names} (the same time again)")
    return places


def _goes_with(stamps: Stamps, column: Column) -> bool:
    """The column goes up with the stamps at one of the units of time, and is nowhere off by half an interval."""
    for theirs, mine in zip(look(stamps), look(column), strict=True):
        both = np.isfinite(theirs) & np.isfinite(mine)
        t, c = theirs[both] - theirs[both][:1], mine[both] - mine[both][:1]
        if len(t) < _LEAST or t[-1] <= 0 or c[-1] <= 0:
            return False
        factor = t[-1] / c[-1]
        unit = min(FACTORS.values(), key=lambda size: abs(math.log(size / factor)))
        if abs(factor / unit - 1.0) > _SAME_RATE or np.abs(c * unit - t).max() > 0.5 * float(
            np.median(np.diff(t))
        ):
            return False
    return True


def unseen_by_stamps(numberings: Sequence[RowNumbering], missing: int) -> list[str]:
    """In words, samples that are missing by their numbers where the time stamps show no gap."""
    return [
        f"by its numbers, column {n.name}, {n.missing} samples are missing, by the time stamps {missing}: "
        "time stamps added on receipt hide lost samples"
        for n in numberings
        if n.missing > missing
    ]


def _numbering(place: int, name: str, column: Column) -> RowNumbering | None:
    if is_counter(column) and all((np.diff(part) > 0).all() for part in _parts(column)):
        return RowNumbering(place=place, name=name, numbers=column)
    steps = np.concatenate([np.diff(part) for part in _parts(column)] or [np.empty(0)])
    if len(steps) == 0 or not np.array_equal(steps, np.round(steps)):
        return None
    sizes, counts = np.unique(steps, return_counts=True)
    stride = float(sizes[counts.argmax()])
    top = max(float(part.max()) for part in _parts(column)) + column.origin
    turn = next((t for t in _TURNS if t > top), None)
    if stride <= 0 or counts.max() < len(steps) / 2 or (turn is None and steps.min() < 0):
        return None
    remarks, going = [], steps
    if steps.min() < 0 and turn is not None:
        going = np.where(steps < 0, steps + turn, steps)
        if turn - top > max(0.01 * turn, 2 * stride) or going[steps < 0].max() > turn / 2:
            return None  # begun anew by itself, or out of order
        remarks.append(
            f"the number in column {name} wraps at {turn}, {plural(int((steps < 0).sum()), 'time')}: unwrapped"
        )
    if (going % stride != 0).any() or (going == 0).mean() > 0.1:
        return None
    if stride != 1:
        remarks.append(
            f"the number in column {name} goes on by {stride:g} from row to row: one of {stride:g} is in the file"
        )
    numbers = np.concatenate(([0], np.cumsum(going / stride))).astype(np.int64)
    return RowNumbering(place=place, name=name, numbers=ArrayColumn(numbers), remarks=tuple(remarks))


def _parts(column: Column) -> Iterator[NDArray[np.float64]]:
    """The whole column, each part with the last value of the one before."""
    for start in range(0, len(column), _ROWS):
        yield column.read(max(start - 1, 0), min(start + _ROWS, len(column)))
