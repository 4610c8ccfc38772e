# SPDX-License-Identifier: BSD-3-Clause
"""Which channel of a log in motion is which of the log at rest."""

from __future__ import annotations

import re
from collections.abc import Sequence

from allanite.errors import InputError
from allanite.recording.records import Channel, Recording

__all__ = ["matched_channels"]

_AXIS = re.compile(r"(?:^|[^a-z])([xyz])(?![a-z])|(?<=[a-z])([xyz])$|([012])\W*$", re.IGNORECASE)


def matched_channels(rest: Recording, motion: Recording, match: Sequence[str] = ()) -> list[tuple[str, str]]:
    """Names at rest and in motion of the channels that belong together.

    Of one name; else of one quantity and axis (x, y, z, or 0, 1, 2 at the end of the name); else alone of their
    quantity in both.

    Parameters
    ----------
    match : sequence of str, optional
        Channels by one name, or by one for each of the two logs with a comma between.

    Raises
    ------
    InputError
        None belong together, a channel that is not there, or channels of different quantities.
    """
    if match:
        pairs = [_given(pair) for pair in match]
    else:
        moving = [c for c in motion.channels if c.kind.noise_bearing]
        pairs = [
            (c.name, other.name)
            for c in rest.channels
            if c.kind.noise_bearing and (other := _partner(c, rest, moving)) is not None
        ]
    if not pairs:
        raise InputError(
            f"no channel of {rest.source or 'the log at rest'} ({', '.join(rest.names)}) belongs to one of "
            f"{motion.source or 'the log in motion'} ({', '.join(motion.names)}): state pairs, --match gx,gyro_x"
        )
    for quiet, moved in pairs:
        _refuse_other_quantity(rest[quiet], motion[moved])
    return pairs


def _given(pair: str) -> tuple[str, str]:
    names = [name.strip() for name in pair.split(",")]
    if len(names) > 2 or not all(names):
        raise InputError(
            f"{pair!r}: state a channel by one name, or by two, at rest and in motion: gx,gyro_x"
        )
    return names[0], names[-1]


def _partner(channel: Channel, rest: Recording, moving: Sequence[Channel]) -> Channel | None:
    same = [c for c in moving if _quantity(c) == _quantity(channel)]
    if named := [c for c in same if c.name == channel.name]:
        return named[0]
    axis = _axis(channel.name)
    along = [c for c in same if axis and _axis(c.name) == axis]
    if len(along) == 1:
        return along[0]
    alone = [c for c in rest.channels if _quantity(c) == _quantity(channel)]
    return same[0] if len(same) == len(alone) == 1 else None


def _axis(name: str) -> str:
    """x, y or z; "" where the name does not tell."""
    match = _AXIS.search(name)
    axis = next((g for g in match.groups() if g), "").lower() if match else ""
    return {"0": "x", "1": "y", "2": "z"}.get(axis, axis)


def _quantity(channel: Channel) -> tuple[str, str]:
    return channel.kind.rate.value, "" if channel.kind.has_si else channel.unit


def _refuse_other_quantity(one: Channel, other: Channel) -> None:
    if _quantity(one) != _quantity(other):
        raise InputError(
            f"{one.name} measures {one.kind.rate.value} in {one.unit or 'unknown units'} at rest, {other.name} "
            f"{other.kind.rate.value} in {other.unit or 'unknown units'} in motion: state the units of both (--unit)"
        )
