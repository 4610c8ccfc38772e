# SPDX-License-Identifier: BSD-3-Clause
"""A column that numbers the samples: jumps of the number are samples that are missing.

A number of a few bits begins anew (0 ... 255, 0 ...), and a logger that keeps every k-th sample goes on by k. Both are
recognised by the whole column, never by its beginning, and said in words. A column of that name that does neither
numbers nothing here, and that is said too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from allanite.counted import plural
from allanite.readers.column_look import is_counter
from allanite.readers.headings import Heading
from allanite.recording import ArrayColumn, Column

__all__ = ["Numbering", "numbering_of", "unseen_by_stamps"]

#: Where numbers begin anew: after 8, 16, 24, 32 bits, or after some decimal digits.
_TURNS = tuple(sorted([256, 65_536, 1 << 24, 1 << 32, *(10**k for k in range(2, 10))]))
_ROWS = 1 << 18


@dataclass(frozen=True, slots=True, kw_only=True)
class Numbering:
    """The sample numbers of a table.

    Attributes
    ----------
    place : int
        Of the column.
    name : str
    numbers : Column
        One more from row to row where no sample is missing.
    said : tuple of str
        What was understood, in words.
    """

    place: int
    name: str
    numbers: Column
    said: tuple[str, ...] = ()

    @property
    def missing(self) -> int:
        """Samples between the first and the last number that have no row."""
        n = len(self.numbers)
        span = float(self.numbers.read(n - 1, n)[0]) - float(self.numbers.read(0, 1)[0])
        return round(span) + 1 - n if np.isfinite(span) else 0


def numbering_of(headings: Sequence[Heading], columns: Sequence[Column]) -> tuple[list[Numbering], list[str]]:
    """All columns that number the samples, and what is to be said of those that only have such a name."""
    found, said = [], []
    for place, (heading, column) in enumerate(zip(headings, columns, strict=True)):
        if heading.group != "counter":
            continue
        numbering = _numbering(place, heading.name, column)
        if numbering is None:
            said.append(
                f"column {heading.name} is named like a sample number and does not number the rows: it is a channel, "
                "and gaps cannot be told from it"
            )
        else:
            found.append(numbering)
    return found, said


def unseen_by_stamps(numberings: Sequence[Numbering], missing: int) -> list[str]:
    """In words, samples that are missing by their numbers where the time stamps show no gap."""
    return [
        f"by its numbers, column {n.name}, {n.missing} samples are missing, by the time stamps {missing}: stamps "
        "that a computer gives on receipt hide what was lost"
        for n in numberings
        if n.missing > missing
    ]


def _numbering(place: int, name: str, column: Column) -> Numbering | None:
    if is_counter(column) and all((np.diff(part) > 0).all() for part in _parts(column)):
        return Numbering(place=place, name=name, numbers=column)
    steps = np.concatenate([np.diff(part) for part in _parts(column)] or [np.empty(0)])
    if len(steps) == 0 or not np.array_equal(steps, np.round(steps)):
        return None
    sizes, counts = np.unique(steps, return_counts=True)
    stride = float(sizes[counts.argmax()])
    top = max(float(part.max()) for part in _parts(column)) + column.origin
    turn = next((t for t in _TURNS if t > top), None)
    if stride <= 0 or counts.max() < len(steps) / 2 or (turn is None and steps.min() < 0):
        return None
    said, going = [], steps
    if steps.min() < 0 and turn is not None:
        going = np.where(steps < 0, steps + turn, steps)
        if turn - top > max(0.01 * turn, 2 * stride) or going[steps < 0].max() > turn / 2:
            return None  # begun anew by itself, or out of order
        said.append(
            f"the number in column {name} wraps at {turn}, {plural(int((steps < 0).sum()), 'time')}: unwrapped"
        )
    if (going % stride != 0).any() or (going == 0).mean() > 0.1:
        return None
    if stride != 1:
        said.append(
            f"the number in column {name} goes on by {stride:g} from row to row: one of {stride:g} is in the file"
        )
    numbers = np.concatenate(([0], np.cumsum(going / stride))).astype(np.int64)
    return Numbering(place=place, name=name, numbers=ArrayColumn(numbers), said=tuple(said))


def _parts(column: Column) -> Iterator[NDArray[np.float64]]:
    """The whole column, each part with the last value of the one before."""
    for start in range(0, len(column), _ROWS):
        yield column.read(max(start - 1, 0), min(start + _ROWS, len(column)))
