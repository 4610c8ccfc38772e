# SPDX-License-Identifier: BSD-3-Clause
"""Positions that were recorded one by one, each in a file of its own: one record with the time between them missing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.recording import Kind, Recording
from allanite.reversals.schedule import placed
from allanite.reversals.turns import DEAD_TIME, Reversals

__all__ = ["joined_positions"]

#: Relative difference of the rates of two files that are of one sensor.
_SAME_RATE = 0.01
#: Time from one file to the next beyond which it is another day's measurement [s].
_LONGEST = 86400.0


def joined_positions(
    recordings: Sequence[Recording],
    headings: Sequence[float],
    *,
    between: float = 60.0,
    dead_time: float = DEAD_TIME,
) -> tuple[Recording, Reversals, str]:
    """One record of the rates of all files, and where the sensor stood in each.

    Parameters
    ----------
    recordings : sequence of Recording
        In the order in which they were made.
    headings : sequence of float [rad]
        Of the sensitive axis, from north over east.
    between : float [s]
        Time from the end of a file to the beginning of the next where the files do not tell it: the sensor's slow
        noise goes on in it.
    dead_time : float [s]
        Left out at the beginning of every file but the first.

    Returns
    -------
    recording : Recording
        Rates in rad/s; missing between the files.
    positions : Reversals
    remark : str
        Where the time between the files comes from.

    Raises
    ------
    InputError
        Fewer than two files, other channels or another rate in one of them, files that overlap in time.
    """
    if len(recordings) < 2 or len(recordings) != len(headings):
        raise InputError("positions in files of their own need at least two files, each with its heading")
    if not (math.isfinite(between) and between > 0):
        raise InputError(f"the time between the files must be positive seconds, not {between!r}")
    first = recordings[0]
    names = [c.name for c in first.channels if c.kind is Kind.RATE]
    for other in recordings[1:]:
        _refuse_another(first, other, names)
    pauses, remark = _pauses(recordings, between)
    parts: list[NDArray[np.float64]] = []
    spans, at = [], 0
    for recording, pause in zip(recordings, (*pauses, 0.0), strict=True):
        spans.append((at, at + recording.n_samples))
        parts.append(np.column_stack([recording.scaled(name) for name in names]))
        missing = max(round(pause * first.rate), 1) if pause else 0
        parts.append(np.full((missing, len(names)), np.nan))
        at += recording.n_samples + missing
    whole = Recording.from_rate(
        np.concatenate(parts),
        rate=first.rate,
        unit="rad/s",
        names=names,
        sampling=first[names[0]].sampling,
        start=first.start,
    )
    labels = [recording.source for recording in recordings]
    return whole, placed(whole, spans, headings, labels, dead_time=dead_time), remark


def _refuse_another(first: Recording, other: Recording, names: Sequence[str]) -> None:
    own = [c.name for c in other.channels if c.kind is Kind.RATE]
    if not names or own != list(names):
        there, here = ", ".join(own) or "none", ", ".join(names) or "none"
        raise InputError(
            f"{other.source} has the rates {there}, {first.source} has {here}: files of one sensor have the "
            "same; choose with --channels, name units with --unit"
        )
    if abs(other.rate / first.rate - 1) > _SAME_RATE:
        raise InputError(
            f"{other.source} has {other.rate:g} samples per second, {first.source} has {first.rate:g}: all positions "
            "are recorded at one rate"
        )


def _pauses(recordings: Sequence[Recording], between: float) -> tuple[list[float], str]:
    """Time from each file to the next [s], by their stamps where all have them."""
    starts = [r.start for r in recordings]
    told = f"the files do not say when they were recorded: {between:g} s are assumed between them (--between)"
    if any(start is None for start in starts):
        return [between] * (len(recordings) - 1), told
    pauses = [
        ((later.start or 0) - (early.start or 0)) * 1e-9 - early.duration
        for early, later in zip(recordings, recordings[1:], strict=False)
    ]
    for early, later, pause in zip(recordings, recordings[1:], pauses, strict=False):
        if not -early.dt < pause <= _LONGEST:
            raise InputError(
                f"{later.source} begins {pause:.6g} s after the end of {early.source}: give the files in the order in "
                "which they were recorded, within a day"
            )
    return [max(p, recordings[0].dt) for p in pauses], "the time between the files is that of their stamps"
