# SPDX-License-Identifier: BSD-3-Clause
"""Increments: the angle or velocity gained in each sample interval. Over that interval they are a mean rate.

Names state them (``delta_theta_x``, ``dvx``, ``X_DELTANG``), and so does a unit, ``deg/sample``. They are divided by
the column of intervals in the file where it bears their name or agrees with the time stamps, and by the sample interval
otherwise. Intervals shorter than the spacing of the rows are the aperture of the rates.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from itertools import takewhile
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.column_look import look
from allanite.files.readers.integration_times import covered_seconds, namesake, with_aperture
from allanite.files.readers.row_intervals import interval_unit
from allanite.files.readers.table import Table
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.units import parse_unit
from allanite.recording.records import Channel, Column
from allanite.recording.sample_columns import Calculated

__all__ = ["Divided", "divided"]

#: Share of the sample interval by which a typical interval in a column may differ from it.
_AGREES: Final = 0.2


@dataclass(frozen=True, slots=True)
class Divided:
    """Channels whose increments became rates.

    Attributes
    ----------
    channels : dict of column number to Channel
    columns : dict of column number to Column
    used : frozenset of int
        Columns of intervals that they were divided by.
    steps : tuple of dict
        For the history.
    guesses : tuple of str
    """

    channels: Mapping[int, Channel]
    columns: Mapping[int, Column]
    used: frozenset[int]
    steps: tuple[Mapping[str, Any], ...]
    guesses: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Rates(Calculated):
    """Increments over their intervals; missing where the interval is not positive."""

    of: Column
    intervals: Column | None
    scale: float  # seconds per unit of the intervals, or the interval itself

    def __len__(self) -> int:
        return len(self.of)

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        steps = self.of.read(start, stop) + self.of.origin
        if self.intervals is None:
            return steps / self.scale
        spans = (self.intervals.read(start, stop) + self.intervals.origin) * self.scale
        rates: NDArray[np.float64] = np.full(len(steps), np.nan)
        return np.divide(steps, spans, out=rates, where=spans > 0)


def divided(
    channels: Mapping[int, Channel], increments: Collection[int], table: Table, rate: float
) -> Divided:
    """The channels and columns of a table, increments divided by their interval."""
    new, columns = dict(channels), {i: table.columns[i] for i in channels}
    used, names_by_divisor = set[int](), dict[str, list[str]]()
    for i in (i for i in channels if i in increments):
        channel = channels[i]
        place, scale, seconds = _intervals_of(i, table, rate) or (None, 1.0 / rate, None)
        columns[i] = _Rates(table.columns[i], None if place is None else table.columns[place], scale)
        unit = "m/s²" if channel.unit == "m/s" else f"{channel.unit}/s"
        new[i] = with_aperture(replace(channel, kind=channel.kind.rate, unit=unit), seconds, rate)
        divisor = (
            f"the sample interval, {scale:.6g} s" if place is None else f"column {table.headings[place]}"
        )
        names_by_divisor.setdefault(divisor, []).append(channel.name)
        used |= set() if place is None else {place}
    return Divided(
        channels=new,
        columns=columns,
        used=frozenset(used),
        steps=tuple(
            {"step": "increments", "channels": names, "divided_by": divisor}
            for divisor, names in names_by_divisor.items()
        ),
        guesses=tuple(
            f"{', '.join(names)}: increments by the name or the unit, divided by {divisor}, to get rates; rename the "
            "column if it is a running sum"
            for divisor, names in names_by_divisor.items()
        ),
    )


def _intervals_of(place: int, table: Table, rate: float) -> tuple[int, float, float | None] | None:
    """The column of the intervals of an increment, its unit in seconds, and their length where they bear its name.

    None where no column has that name or agrees with the rate.
    """
    named = namesake(place, table)
    if named is not None:
        stated = (table.units[named] if table.units else "") or interval_unit(table.headings[named]) or ""
        covered = covered_seconds(table.columns[named], stated, rate)
        if covered is not None:
            return named, covered[1], covered[0]
    fitting = []
    for i, heading in enumerate(table.headings):
        unit = interval_unit(heading)
        if unit is None or i == place:
            continue
        unit = (table.units[i] if table.units else "") or unit
        scale = _agreeing(table.columns[i], unit, rate)
        if scale is not None:
            pairs = zip(heading.lower(), table.headings[place].lower(), strict=False)
            alike = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))
            fitting.append((-alike, i, scale))
    return (*min(fitting)[1:], None) if fitting else None


def _agreeing(column: Column, unit: str, rate: float) -> float | None:
    """Seconds per unit of a column of intervals; None where they are not those of the samples."""
    values = np.concatenate(look(column)) + column.origin
    values = values[np.isfinite(values) & (values > 0)]
    if not len(values):
        return None
    typical = float(np.median(values))
    factors = (parse_unit(unit).factor,) if unit else (1.0, 1e-3, 1e-6, 1e-9)
    return next((f for f in factors if abs(typical * f * rate - 1.0) <= _AGREES), None)
