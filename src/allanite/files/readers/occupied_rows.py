# SPDX-License-Identifier: BSD-3-Clause
"""Rows without a sample of the chosen channels: lost samples, or rows of something else.

A logger that loses a sample writes an empty row in its place: the stamps beside it leave room for it, and it stays.
A line of a GPS receiver among the samples, or a row of another sensor in a table that was merged by time, takes no
place of the sensor's own: counted as a sample, it would raise the rate. Such rows are left out of the time grid.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.files.readers.column_look import look
from allanite.files.readers.filled_stamps import BLOCK, CACHED, KeptStamps
from allanite.files.readers.headings import FITTING, Heading
from allanite.files.readers.kept_rows import KeptRows
from allanite.files.readers.stamp_table import TimeChoice
from allanite.files.readers.timebase import Stamps
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural
from allanite.recording.channel_names import for_shell
from allanite.recording.records import Column

__all__ = ["left_out_remark", "occupied_rows", "refuse_several_clocks", "with_kept_stamps"]

_Floats = NDArray[np.float64]
_Mask = NDArray[np.bool_]

_EVEN: Final = 0.25  # of the interval: stamps that are off by less tell the place of every row
_ODD: Final = 0.1  # share of the intervals that may be odd among even stamps
_NEIGHBORS: Final = 0.05  # share of the samples that follow one another without a row between
_ROOM: Final = 0.5  # intervals by which the room between two samples may differ from the rows in it
_DRIFT: Final = 0.01  # and the share of it
_STRETCHES: Final = 64
_SAME_ROWS: Final = 0.75  # share of the rows of a channel that make it one of another's sensor


def with_kept_stamps(time: TimeChoice) -> TimeChoice:
    """The time with its stamps in memory, if they fit: they are looked through several times."""
    kept = KeptStamps.of(time.stamps)
    return time if kept is None else replace(time, stamps=kept)


def occupied_rows(time: TimeChoice, columns: Sequence[Column]) -> KeptRows | None:
    """The rows that define the time grid; None where all do.

    Parameters
    ----------
    time : TimeChoice
    columns : sequence of Column
        Samples of the chosen channels.
    """
    if _every_row_counts(time.stamps, columns):
        return None
    occupied = KeptRows.of(_occupied(columns))
    if len(occupied) in (0, occupied.total):
        return None
    pace = _pace(time.stamps, occupied)
    if pace is None or not _has_room(time.stamps, occupied, pace):
        return occupied
    stamped = KeptRows.of(_stamped(time.stamps, occupied, ends_only=pace.even))
    return None if len(stamped) == stamped.total else stamped


def _every_row_counts(stamps: Stamps, columns: Sequence[Column]) -> bool:
    """True where no stamp is missing or odd, and a channel has a value wherever it is looked at."""
    parts = [look(column) for column in columns]
    if not any(all(np.isfinite(block).all() for block in blocks) for blocks in parts):
        return False
    return isinstance(stamps, KeptStamps) and _is_even(stamps.seconds)


def _is_even(seconds: _Floats) -> bool:
    median = float(np.median(np.diff(seconds[:4096]))) if len(seconds) > 1 else math.nan
    for start in range(0, len(seconds) - 1, CACHED):
        steps = np.diff(seconds[start : start + CACHED + 1])
        if not (steps.min() > (1 - _EVEN) * median and steps.max() < (1 + _EVEN) * median):
            return False  # as well where a stamp is missing: NaN is not less
    return True


def _occupied(columns: Sequence[Column]) -> Iterator[_Mask]:
    n = len(columns[0])
    for start in range(0, n, BLOCK):
        stop = min(start + BLOCK, n)
        mask = ~np.isnan(columns[0].read(start, stop))
        for column in columns[1:]:
            if mask.all():
                break
            mask |= ~np.isnan(column.read(start, stop))
        yield mask


def _stamped(stamps: Stamps, occupied: KeptRows, *, ends_only: bool) -> Iterator[_Mask]:
    """Rows with a sample or a stamp; of even stamps, those between two samples have a place without one."""
    n = occupied.total
    first, last = _ends(occupied) if ends_only else (n, n)
    for start in range(0, n, BLOCK):
        stop = min(start + BLOCK, n)
        mask = occupied.mask(start, stop) | np.isfinite(stamps.read(start, stop))
        mask[max(first - start, 0) : max(last - start, 0)] = True
        yield mask


def _ends(occupied: KeptRows) -> tuple[int, int]:
    """The first row with a sample, and the one behind the last."""
    places = [np.flatnonzero(occupied.mask(a, min(a + BLOCK, occupied.total))) + a for a in _starts(occupied)]
    held = [part for part in places if len(part)]
    return int(held[0][0]), int(held[-1][-1]) + 1


def _starts(occupied: KeptRows) -> range:
    return range(0, occupied.total, BLOCK)


# -- room for the rows -------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pace:
    """How samples that follow one another row by row are apart: interval [s], its scatter in intervals."""

    interval: float
    scatter: float
    even: bool


@dataclass(frozen=True, slots=True)
class _Steps:
    """From one sample to the next: how far apart their stamps are [s], and how many empty rows are between."""

    apart: _Floats
    between: NDArray[np.int64]

    @classmethod
    def of(cls, stamps: _Floats, mask: _Mask) -> _Steps:
        rows = np.flatnonzero(mask & np.isfinite(stamps))
        return cls(np.diff(stamps[rows]), np.diff(rows) - 1)


def _pace_of(steps: Sequence[_Steps]) -> _Pace | None:
    """None where no two samples follow one another, so that every one of them is alone among other rows."""
    apart = np.concatenate([one.apart for one in steps])
    neighbors = apart[np.concatenate([one.between for one in steps]) == 0]
    if len(neighbors) <= _NEIGHBORS * len(apart):
        return None
    median = float(np.median(neighbors))
    good = np.abs(neighbors - median) <= _EVEN * median
    if median > 0 and good.mean() >= 1 - _ODD:
        return _Pace(interval=float(neighbors[good].mean()), scatter=0.0, even=True)
    mean = float(neighbors.mean())
    return _Pace(interval=mean, scatter=float(neighbors.std()) / mean, even=False) if mean > 0 else None


def _pace(stamps: Stamps, occupied: KeptRows) -> _Pace | None:
    n = occupied.total
    length = min(n, 4096)
    places = np.linspace(0, n - length, min(_STRETCHES, max(1, n // length))).astype(np.int64)
    starts = [int(a) for a in np.unique(places // 8 * 8)]
    return _pace_of([_Steps.of(stamps.read(a, a + length), occupied.mask(a, a + length)) for a in starts])


def _has_room(stamps: Stamps, occupied: KeptRows, pace: _Pace) -> bool:
    """True if the samples are as far apart as the empty rows between them call for."""
    room, n = _Room(pace), occupied.total
    rows, seconds = np.zeros(0, dtype=np.int64), np.zeros(0)  # of the last sample
    for start in _starts(occupied):
        block = stamps.read(start, min(start + BLOCK, n))
        mask = occupied.mask(start, start + len(block))
        mask[[0, -1]] |= [
            start == 0,
            start + len(block) == n,
        ]  # empty rows at the ends have their place as well
        places = np.flatnonzero(mask & np.isfinite(block))
        rows, seconds = np.append(rows[-1:], places + start), np.append(seconds[-1:], block[places])
        room.add(_Steps(np.diff(seconds), np.diff(rows) - 1))
        if pace.even and room.odd:
            return False
    return room.fits()


class _Room:
    """Room between samples for the empty rows between them, tallied block by block."""

    def __init__(self, pace: _Pace) -> None:
        self._pace = pace
        self.odd = False
        self._runs = self._rows = 0
        self._room = 0.0

    def add(self, steps: _Steps) -> None:
        at = steps.between > 0
        rows, room = steps.between[at], steps.apart[at] / self._pace.interval - 1.0
        self.odd = self.odd or bool((np.abs(room - rows) > _ROOM + _DRIFT * rows).any())
        self._runs += len(rows)
        self._rows += int(rows.sum())
        self._room += float(room.sum())

    def fits(self) -> bool:
        """Of even stamps each row tells; of others all together, as far as their scatter lets them."""
        if self._pace.even:
            return not self.odd
        return self._room >= 0.5 * self._rows - 3.0 * self._pace.scatter * math.sqrt(self._runs)


# -- sensors of several rates ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Sensor:
    """Channels that have their values in the same rows, by the places of their columns."""

    places: list[int]
    rows: list[_Mask]

    @property
    def count(self) -> int:
        return sum(int(part.sum()) for part in self.rows)

    def shares_rows(self, other: Sequence[_Mask]) -> bool:
        both = sum(int((a & b).sum()) for a, b in zip(self.rows, other, strict=True))
        return both >= _SAME_ROWS * min(self.count, sum(int(part.sum()) for part in other))

    def rate(self, stamps: Sequence[_Floats]) -> float:
        steps = [np.diff(t[m & np.isfinite(t)]) for t, m in zip(stamps, self.rows, strict=True)]
        span = sum(float(part.sum()) for part in steps)
        return sum(map(len, steps)) / span if span > 0 else math.nan


def refuse_several_clocks(
    time: TimeChoice,
    columns: Sequence[Column],
    named: Mapping[int, Heading],
    chosen: Sequence[int],
    name: str,
) -> None:
    """Ask which sensor is meant where a table merges sensors whose samples are taken at times of their own.

    Raises
    ------
    InputError
        No time grid holds the rows of all chosen channels.
    """
    if len(chosen) < 2:
        return
    stamps = look(time.stamps)
    if all(_is_even(part) for part in stamps):
        return
    sensors = _sensors(columns, chosen)
    if len(sensors) < 2:
        return
    main = max(sensors, key=lambda one: one.count)
    pace = _pace_of([_Steps.of(t, m) for t, m in zip(stamps, main.rows, strict=True)])
    if pace is not None:
        room = _Room(pace)
        for t, m in zip(stamps, main.rows, strict=True):
            room.add(_Steps.of(t, m))
        if room.fits():
            return
    elif all(bool(m.all()) for m in main.rows):
        return
    rates = "; ".join(
        f"{', '.join(named[i].name for i in one.places)} at {one.rate(stamps):.4g} Hz" for one in sensors
    )
    ways = " or ".join(f"--channels {for_shell(_word(one, named))}" for one in sensors)
    words = _word(main, named).split(",")
    raise InputError(
        f"{name}: the table merges sensors with time stamps of their own: {rates}. No even time grid holds them all; "
        f"choose the channels of one: {ways}; in Python channels={words!r}"
    )


def _sensors(columns: Sequence[Column], chosen: Sequence[int]) -> list[_Sensor]:
    sensors: list[_Sensor] = []
    for place in chosen:
        rows = [~np.isnan(part) for part in look(columns[place])]
        if not any(part.any() for part in rows):
            continue
        theirs = next((one for one in sensors if one.shares_rows(rows)), None)
        if theirs is None:
            sensors.append(_Sensor([place], rows))
        else:
            theirs.places.append(place)
            for mine, more in zip(theirs.rows, rows, strict=True):
                mine |= more
    return sensors


def _word(sensor: _Sensor, named: Mapping[int, Heading]) -> str:
    """The group of a sensor where it is all of the group, else its channels."""
    group = named[sensor.places[0]].group
    whole = [i for i, heading in named.items() if heading.group == group]
    if group in FITTING and whole == sorted(sensor.places):
        return group
    return ",".join(named[i].name for i in sensor.places)


def left_out_remark(rows: KeptRows) -> str:
    """What is left out, in words."""
    out = rows.total - len(rows)
    return (
        f"{plural(out, 'row', 'have')} no sample of these channels and no place on their time grid: left out"
    )
