# SPDX-License-Identifier: BSD-3-Clause
"""What the search for time looks at, the columns of a file, and what it finds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.headings import Heading
from allanite.files.readers.stated_time import option_text
from allanite.files.readers.timebase import Stamps
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import Column

__all__ = ["Scaled", "StampTable", "Summed", "TimeChoice"]


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
class Scaled:
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
class Summed:
    """Stamps in two columns: seconds and nanoseconds, or weeks and seconds."""

    coarse: Scaled
    fine: Scaled

    def __len__(self) -> int:
        return len(self.coarse)

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        return self.coarse.read(start, stop) + self.fine.read(start, stop)


@dataclass(frozen=True, slots=True, kw_only=True)
class StampTable:
    """The columns of a file, as far as they may be time.

    Attributes
    ----------
    headings : sequence of Heading
    raw : sequence of str
        As they stand in the file.
    columns : sequence of Column
    numbers : sequence of int
        Of the columns in the file, from 1.
    known_units : dict of column number to unit
        Columns that are time beyond doubt (parsed dates, in ns since 1970).
    questions : dict of column number to str
        What is asked where one of these is time.
    nominal : float or None [Hz]
        Rate that the file states elsewhere; settles the unit of stamps that could be in several.
    inertial : bool
        The log is one of gyros or accelerometers.
    rate_said : bool
        The caller gives the rate, so that the stamps are set aside: nothing is asked about them.
    file : str
        For messages.
    """

    headings: Sequence[Heading]
    raw: Sequence[str]
    columns: Sequence[Column]
    numbers: Sequence[int]
    known_units: Mapping[int, str]
    questions: Mapping[int, str]
    nominal: float | None
    inertial: bool
    rate_said: bool
    file: str

    def label(self, place: int) -> str:
        """A column in a message."""
        return repr(self.headings[place].name) if self.headings[place].name else str(self.numbers[place])

    def option(self, place: int) -> str:
        """A column as the option names it."""
        return option_text(self.raw[place], self.numbers[place])
