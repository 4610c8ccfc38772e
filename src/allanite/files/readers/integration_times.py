# Specification: PX4, msg/SensorCombined.msg (gyro_integral_dt) and msg/VehicleImu.msg (delta_angle_dt).
# SPDX-License-Identifier: BSD-3-Clause
"""Integration times: over how long each sample gathered, as a log states beside its samples.

A log that keeps every k-th message holds samples that average a part of their interval only. That part is the aperture
of the channel, from which the excess of its white noise follows.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from allanite.files.readers.column_look import look
from allanite.files.readers.headings import measures, read_heading
from allanite.files.readers.table import Table
from allanite.quantities.units import QuantityKind, parse_unit
from allanite.recording.records import Channel, Column

__all__ = ["covered_seconds", "namesake", "with_apertures"]

#: Share of the interval from which on a sample is the mean of all of it: clocks and roundings differ by that much.
_WHOLE: Final = 0.95
#: Intervals that an integration time in a column without a unit may last.
_LONGEST: Final = 1.2
_INTEGRAL: Final = re.compile(
    r"(?:(?P<of>.+)_)?integra(?:l|tion)_?(?:d_?t|time|interval|period)(?:_[mun]?s(?:ec)?)?"
)
_DT: Final = re.compile(r"(?P<of>.+)_d_?t(?:_[mun]?s(?:ec)?)?")


def with_apertures(
    channels: Mapping[int, Channel], table: Table, rate: float, increments: Collection[int]
) -> dict[int, Channel]:
    """The channels, each with the aperture that its file states where that is a part of the sample interval.

    Increments are left as they are: their own intervals give their aperture.
    """
    result = dict(channels)
    columns = {
        match["of"] or "": i
        for i, h in enumerate(table.headings)
        if (match := _INTEGRAL.fullmatch(_plain(h)))
    }
    for i, channel in channels.items():
        if i in increments or channel.kind.value not in ("rate", "acceleration"):
            continue
        heading = _plain(table.headings[i])
        of = max((of for of in columns if heading.startswith(of)), key=len, default=None)
        seconds = table.apertures.get(table.headings[i])
        if seconds is None and of is not None:
            place = columns[of]
            unit = (table.units[place] if table.units else "") or read_heading(table.headings[place]).unit
            scale = covered_seconds(table.columns[place], unit, rate)
            seconds = None if scale is None else scale[0]
        result[i] = with_aperture(channel, seconds, rate)
    return result


def with_aperture(channel: Channel, seconds: float | None, rate: float) -> Channel:
    """The channel with this integration time as its aperture, where it is shorter than the interval."""
    if seconds is None or not 0.0 < seconds < _WHOLE / rate or channel.sampling != "mean":
        return channel
    return replace(channel, aperture=seconds)


def namesake(place: int, table: Table) -> int | None:
    """The column with the intervals of an increment by its name: delta_angle_dt of delta_angle[0]."""
    name = _plain(table.headings[place])
    for i, heading in enumerate(table.headings):
        match = _DT.fullmatch(_plain(heading))
        if match and i != place and name.startswith(match["of"]):
            return i
    return None


def covered_seconds(column: Column, unit: str, rate: float) -> tuple[float, float] | None:
    """The typical integration time in a column, and seconds per unit of the column.

    Without a unit it is the largest of s, ms, us and ns in which it lasts no longer than the sample interval.
    """
    values = np.concatenate(look(column)) + column.origin
    values = values[np.isfinite(values) & (values > 0)]
    if not len(values):
        return None
    typical = float(np.median(values))
    if unit:
        factors: tuple[float, ...] = (parse_unit(unit).factor,) if measures(unit) is QuantityKind.TIME else ()
    else:
        factors = (1.0, 1e-3, 1e-6, 1e-9)
    return next(((typical * f, f) for f in factors if typical * f * rate <= _LONGEST), None)


def _plain(heading: str) -> str:
    return re.sub(r"[^0-9a-z]+", "_", heading.lower()).strip("_")
