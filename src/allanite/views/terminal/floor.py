# SPDX-License-Identifier: BSD-3-Clause
"""Curves over the floor of their instrument as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.noise.allan.channel_curve import ChannelCurve
from allanite.study.results import ChannelFloor
from allanite.views.terminal.console import console, table_of
from allanite.views.wording.floor import floor_lines

if TYPE_CHECKING:
    from allanite.fitting.sensor_curves import OverFloor

__all__ = ["show_over_floor"]


def show_over_floor(curve: OverFloor) -> None:
    """Measured, instrument and sensor at every lag, one table for each channel."""
    out = console()
    for channel in curve.measured.channels:
        measured, floor = ChannelCurve.of(curve.measured[channel.name]), ChannelFloor.of(curve, channel.name)
        heads, rows = floor_lines(channel.kind.value, channel.unit, measured, floor.curve, floor.sensor)
        out.print(channel.name)
        table = table_of(heads)
        for row in rows:
            table.add_row(*row)
        out.print(table)
    out.print(
        f"oadev, {100 * curve.measured.confidence:g} % intervals; "
        "'<' is an upper limit: the instrument hides the sensor"
    )
