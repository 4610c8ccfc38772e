# SPDX-License-Identifier: BSD-3-Clause
"""Columns that tell the rows of several sensors, or of several axes, apart.

They are told by what they do, whatever they are called and wherever they are: several rows share each time stamp, and
the same few values come up once among the rows of every stamp. A counter, a status and a coarse clock do not do that.
A column that is called after an identity is one as soon as its values take turns from row to row.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.headings import Heading
from allanite.lazy_dataclasses import dataclass

__all__ = ["MOST_SENSORS", "RowLabels", "find_identity", "is_called_identity"]

_Codes = NDArray[np.int64]

#: Sensors in one table.
MOST_SENSORS: Final = 16
_LEAST_STAMPS: Final = 8
_SHARED: Final = 0.75  # stamps per row: fewer, where rows share them
_WHOLE: Final = 0.8  # share of the stamps that have all sensors
_APART: Final = 0.98  # share of the rows that no other one of their stamp is like
_CYCLE: Final = 0.95  # share of the rows that follow one another in turn
_NAMED: Final = re.compile(
    r"(?:dev(?:ice)?|ch(?:an(?:nel)?)?|port|addr(?:ess)?|bus|slot|src|source|unit|host|axis|sensor|imu|node|mac|id|"
    r"instance|i|sn|serial)(?:_?(?:id|no|nr|number|name|index|addr(?:ess)?))?",
    re.IGNORECASE,
)
_WHOLE_UNITS: Final = (1.0, 60.0, 1e3, 1e6, 1e9)  # a second in s, ms, us and ns; a minute in s
_EVENLY: Final = 0.05  # of their distance
_NO_IDENTITY: Final = ("counter", "gyro", "acc", "temperature", "time")


@dataclass(frozen=True, slots=True, kw_only=True)
class RowLabels:
    """A column of a table, its values numbered.

    Attributes
    ----------
    heading : Heading
    clock : bool
        It is time by its name or by its dates.
    codes : ndarray of int64, shape (n,)
        The number of the value in each row, from 0.
    count : int
        Different values.
    divides_time : bool
        They part a second, or a minute, evenly: what is finer than the whole seconds in another column.
    """

    heading: Heading
    clock: bool
    codes: _Codes
    count: int
    divides_time: bool

    @classmethod
    def of(cls, heading: Heading, values: NDArray[np.generic], *, clock: bool = False) -> RowLabels:
        """The labels of words or numbers."""
        different, codes = np.unique(values, return_inverse=True)
        return cls(
            heading=heading,
            clock=clock or heading.group == "time",
            codes=codes.astype(np.int64),
            count=len(different),
            divides_time=len(different) <= MOST_SENSORS and _divides_time(different),
        )

    @property
    def may_identify(self) -> bool:
        """A few values, of nothing that is measured or counted."""
        few = 2 <= self.count <= MOST_SENSORS and len(self.codes) >= 3 * self.count
        return (
            few
            and not (self.clock or self.divides_time)
            and not self.heading.unit
            and self.heading.group not in _NO_IDENTITY
        )

    @property
    def takes_turns(self) -> bool:
        """True if all values come up one after another, again and again."""
        k = self.count
        in_turn = self.codes[k:] == self.codes[:-k]
        return len(set(self.codes[:k].tolist())) == k and bool(in_turn.mean() >= _CYCLE)

    @property
    def runs(self) -> _Codes:
        """The number of the run of equal values in which each row is, from 0."""
        return np.concatenate(([0], np.cumsum(np.diff(self.codes) != 0))).astype(np.int64)


def _divides_time(values: NDArray[np.generic]) -> bool:
    """True for values that are evenly apart and fill one of the units that a clock counts in."""
    try:
        numbers = np.sort(values.astype(np.float64))
    except ValueError:
        return False
    for whole in _WHOLE_UNITS:
        apart = np.diff(numbers, append=numbers[0] + whole) * len(numbers) / whole
        if 0 <= numbers[0] and numbers[-1] < whole and np.abs(apart - 1.0).max() < _EVENLY:
            return True
    return False


def find_identity(columns: Mapping[int, RowLabels]) -> tuple[int, ...]:
    """The place of the column that tells the sensors apart, two places where it takes both; none if it is one sensor.

    Parameters
    ----------
    columns : mapping of int to RowLabels
        Rows as they follow one another in the file, by place.
    """
    maybe = [place for place, labels in columns.items() if labels.may_identify]
    for place in maybe:
        if is_called_identity(columns[place].heading) and columns[place].takes_turns:
            return (place,)
    stamps = _shared_stamps(list(columns.values()))
    for places in (*combinations(maybe, 1), *combinations(maybe, 2)):
        if any(_once_a_stamp(runs, _together([columns[place] for place in places])) for runs in stamps):
            return places
    return ()


def is_called_identity(heading: Heading) -> bool:
    """True for the name of a sensor, a channel, an axis, an address."""
    return _NAMED.fullmatch(heading.name) is not None


def _shared_stamps(columns: Sequence[RowLabels]) -> list[_Codes]:
    """Runs of equal stamps, of the columns that never return to a value; none where a clock tells every row."""
    runs_of = {i: labels.runs for i, labels in enumerate(columns) if labels.count >= _LEAST_STAMPS}
    stamps = [i for i, runs in runs_of.items() if runs[-1] + 1 == columns[i].count]
    if any(columns[i].clock and columns[i].count == len(columns[i].codes) for i in stamps):
        return []
    return [runs_of[i] for i in stamps if columns[i].count < _SHARED * len(columns[i].codes)]


def _together(columns: Sequence[RowLabels]) -> _Codes:
    codes = columns[0].codes
    for labels in columns[1:]:
        codes = codes * labels.count + labels.codes
    return np.unique(codes, return_inverse=True)[1].astype(np.int64)


def _once_a_stamp(runs: _Codes, codes: _Codes) -> bool:
    """True if the rows of a stamp differ, and nearly every stamp has all values."""
    count = int(codes.max()) + 1
    if count < 2 or count > MOST_SENSORS:
        return False
    whole = np.bincount(runs) == count
    apart = len(np.unique(runs * count + codes))
    return bool(whole.mean() >= _WHOLE and apart >= _APART * len(codes))
