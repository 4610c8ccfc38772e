# SPDX-License-Identifier: BSD-3-Clause
"""Which channel is on the table's axis, and which are across it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from allanite.errors import InputError
from allanite.experiments.rate_table.motion import RateTable, TableClock
from allanite.experiments.rate_table.record.rows import RATE, RegressionRows, SampleSelection
from allanite.experiments.rate_table.record.timing import coarse_offset
from allanite.recording.records import Channel, Kind, Recording

__all__ = ["channels_of", "refuse_still", "unit_of"]

_UNITS = {Kind.RATE: "rad/s", Kind.VOLTAGE: "V"}


def channels_of(
    recording: Recording, table: RateTable, channel: str | None, cross: Sequence[str] | None
) -> tuple[str, tuple[str, ...]]:
    """The channel that is measured, and those across it.

    Raises
    ------
    InputError
        No channel that could follow a rate, or one that is none.
    """
    offered = _offered(recording)
    if channel is None:
        if not offered:
            has = ", ".join(f"{c.name} ({c.kind.value})" for c in recording.channels)
            raise InputError(
                f"no channel of rates, volts or counts: {has}; give the unit of the samples, e.g. deg/s"
            )
        channel = offered[0] if len(offered) == 1 else _most(recording, table, offered)
    else:
        _refuse(recording[channel])
    if cross is None:
        cross = [n for n in offered if n != channel and recording[n].kind is recording[channel].kind]
    for name in cross:
        _refuse(recording[name])
        if name == channel:
            raise InputError(f"channel {name!r} is the one on the table's axis, and cannot be across it")
    return channel, tuple(cross)


def refuse_still(recording: Recording, channel: str) -> None:
    """A channel that holds one value throughout responds to nothing.

    Raises
    ------
    InputError
        It does.
    """
    low, high = math.inf, -math.inf
    for _, samples in recording.blocks(channel):
        values = samples[np.isfinite(samples)]
        low, high = (
            min(low, float(values.min(initial=math.inf))),
            max(high, float(values.max(initial=-math.inf))),
        )
    if low == high:
        raise InputError(
            f"channel {channel!r} repeats one value throughout: is the sensor connected, and is this its channel?"
        )


def _offered(recording: Recording) -> list[str]:
    for kinds in ((Kind.RATE,), (Kind.VOLTAGE, Kind.COUNTS), (Kind.UNKNOWN,)):
        names = [c.name for c in recording.channels if c.kind in kinds]
        if names:
            return names
    return []


def _refuse(facts: Channel) -> None:
    if facts.kind not in (Kind.RATE, Kind.VOLTAGE, Kind.COUNTS, Kind.UNKNOWN):
        raise InputError(
            f"channel {facts.name!r} is one of {facts.kind.value}: a rate table measures rates, volts or counts"
        )


def _most(recording: Recording, table: RateTable, offered: Sequence[str]) -> str:
    """The channel with the largest response, by plain least squares."""

    def response(name: str) -> float:
        window = SampleSelection(clock=TableClock(offset=coarse_offset(recording, name, table).offset))
        rows = RegressionRows.of(recording, name, table, window)
        u, y = rows.column(RATE)[rows.used], rows.mean[rows.used]
        u = u - u.mean()
        return abs(float(u @ y) / max(float(u @ u), 1e-300)) if np.isfinite(y).all() else 0.0

    return max(offered, key=response)


def unit_of(facts: Channel) -> str:
    """SI unit of a channel, its own where there is none."""
    return _UNITS.get(facts.kind, facts.unit or "1")
