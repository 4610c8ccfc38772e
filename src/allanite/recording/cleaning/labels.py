# SPDX-License-Identifier: BSD-3-Clause
"""Repairs of names: a file whose headings stand over the wrong columns."""

from __future__ import annotations

from dataclasses import replace

from allanite.errors import InputError
from allanite.recording.cleaning.step import noted
from allanite.recording.records import Recording

__all__ = ["swap"]


def swap(recording: Recording, names: str) -> Recording:
    """Two channels exchange their names; samples, units and scales stay where they are.

    Raises
    ------
    InputError
        Not two names, or a channel that is not there.
    """
    wanted = [name.strip() for name in names.split(",") if name.strip()]
    if len(wanted) != 2 or wanted[0] == wanted[1]:
        raise InputError(f"swap takes two names of channels, as in swap=gyro_x,gyro_z, not {names!r}")
    one, other = (recording.index(name) for name in wanted)
    channels = list(recording.channels)
    channels[one] = replace(channels[one], name=wanted[1])
    channels[other] = replace(channels[other], name=wanted[0])
    why = f"{wanted[0]} and {wanted[1]} exchange their names"
    return noted(replace(recording, channels=tuple(channels)), "swap", why, {})
