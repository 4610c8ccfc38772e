# SPDX-License-Identifier: BSD-3-Clause
"""Turns read off the signal alone."""

from __future__ import annotations

import math

from allanite.errors import InputError
from allanite.experiments.reversals.excursions import survey
from allanite.experiments.reversals.judgement import judge, positions_of
from allanite.experiments.reversals.remarks import remarks
from allanite.experiments.reversals.sides import checked_first, sign_at_first
from allanite.experiments.reversals.turned_over import turned_over
from allanite.experiments.reversals.turns import DEAD_TIME, Reversals, checked_dead_time
from allanite.recording.records import Kind, Recording

__all__ = ["channel_of", "find_reversals", "heading_of"]

_TURNED = (Kind.RATE, Kind.ANGLE)
_RAW = (Kind.VOLTAGE, Kind.COUNTS, Kind.UNKNOWN)


def find_reversals(
    recording: Recording,
    *,
    channel: str | None = None,
    first: str | None = "north",
    dead_time: float = DEAD_TIME,
) -> Reversals:
    """Find when the sensor was turned between north and south, or between up and down.

    Parameters
    ----------
    recording : Recording
        A gyro whose sensitive axis is horizontal, or vertical, turned by about 180 deg every 10 to 600 s, each turn
        within 10 s. Volts, counts and unknown units will do.
    channel : str, optional
        Name of the gyro channel, if the recording has several.
    first : "north", "south", "up", "down" or None
        First direction of the axis. One axis cannot show it: with None the signs assume north, and `Reversals.first`
        says so.
    dead_time : float [s]
        Time left out after each turn.

    Returns
    -------
    Reversals
        `static` where there is no turn: then one position fills the record.

    Raises
    ------
    InputError
        No such channel, several to choose from, or one that is no gyro; a wrong `first` or `dead_time`.
    DataQualityError
        The channel holds no samples.

    Notes
    -----
    1. Turns stand hundreds of noise deviations above the level; the level is a running median, which a warm-up of
       1 deg/s does not disturb (`allanite.experiments.reversals.excursions`).
    2. What is a turn is decided by the angle, else by size, else by rhythm; stretches without readings are settled by
       the turns around them, or leave the direction unknown (`allanite.experiments.reversals.judgement`).
    3. The record is streamed; memory grows by a few bytes for each 8 s of it, and by the turns.
    4. The direction is counted from the beginning. A half turn that leaves no trace at all reverses all that follows:
       compare `Reversals.table` with the notes taken.

    Examples
    --------
    >>> find_reversals(recording, first="north").with_dead_time(3.0).table()  # doctest: +SKIP
    """
    name = channel_of(recording, channel)
    start = checked_first(first)
    dead_time = checked_dead_time(dead_time)
    surveyed = survey(recording, name)
    judgement = judge(surveyed)
    positions = positions_of(
        judgement.turns,
        judgement.disturbed,
        surveyed.n_samples,
        first=heading_of(start),
        returning=judgement.returning,
    )
    return Reversals.cut(
        rate=recording.rate,
        n_samples=recording.n_samples,
        turns=judgement.turns,
        positions=positions,
        disturbed=judgement.disturbed,
        source="detected" if judgement.turns else "none",
        first=start,
        dead_time=dead_time,
        findings=remarks(surveyed, judgement, positions, turned_over(recording, name, positions)),
    ).beginning(first)


def channel_of(recording: Recording, channel: str | None) -> str:
    """The channel to look at.

    Raises
    ------
    InputError
        No such channel, several to choose from, or none that is a gyro's.
    """
    if channel is not None:
        kind = recording[channel].kind
        if kind not in (*_TURNED, *_RAW):
            raise InputError(f"turns are read off a gyro; channel {channel!r} is one of {kind.value}")
        return channel
    for kinds in (_TURNED, _RAW):
        names = [c.name for c in recording.channels if c.kind in kinds]
        if len(names) == 1:
            return names[0]
        if names:
            raise InputError(f"which channel shows the turns? Choose one: {', '.join(names)}")
    raise InputError(
        f"turns are read off a gyro, and no channel is one of a gyro: {', '.join(recording.names)}"
    )


def heading_of(first: str) -> float:
    """Heading of the first position [rad], from north or from up; unknown counts as north."""
    return 0.0 if sign_at_first(first) > 0 else math.pi
