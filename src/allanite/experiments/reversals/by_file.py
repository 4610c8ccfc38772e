# SPDX-License-Identifier: BSD-3-Clause
"""Positions that were recorded one by one, each in a file of its own: one record with the time between them missing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError, LimitError
from allanite.experiments.reversals.apart import PositionsApart
from allanite.experiments.reversals.schedule import placed
from allanite.experiments.reversals.turns import DEAD_TIME, Reversals
from allanite.recording.records import ArrayColumn, Channel, Kind, Recording

__all__ = ["BETWEEN", "joined_files", "joined_positions"]

#: Time from one file to the next where neither the files nor the caller tell it [s].
BETWEEN = 60.0
#: Relative difference of the rates of two files that are of one sensor.
_SAME_RATE = 0.01
#: Time from one file to the next beyond which it is another day's measurement [s].
_LONGEST = 86400.0
#: Values that one record may hold, the missing ones included: 1.6 GB.
_MOST = 200_000_000

Spans = list[tuple[int, int]]


def joined_files(
    recordings: Sequence[Recording],
    names: Sequence[str] | None = None,
    *,
    between: float = BETWEEN,
) -> tuple[Recording, Spans, PositionsApart]:
    """One record of all files, missing between them.

    Parameters
    ----------
    recordings : sequence of Recording
        In the order in which they were made.
    names : sequence of str, optional
        Channels to keep; by default those of the first file. Units may differ from file to file.
    between : float [s]
        Time from the end of a file to the beginning of the next where the files do not tell it: the sensor's slow
        noise goes on in it.

    Returns
    -------
    recording : Recording
        In the units of the first file.
    spans : list of (int, int) [samples]
        Where each file is in it.
    apart : PositionsApart
        Where the time between the files comes from.

    Raises
    ------
    InputError
        Fewer than two files, other channels or another rate in one of them, files that overlap in time.
    LimitError
        Too much time between the files at their rate.
    """
    if len(recordings) < 2:
        raise InputError("positions in files of their own need at least two files")
    if not (math.isfinite(between) and between > 0):
        raise InputError(f"the time between the files must be positive seconds, not {between!r}")
    first = recordings[0]
    kept = [first[name] for name in (first.names if names is None else names)]
    for other in recordings[1:]:
        _refuse_another(first, other, kept)
    pauses, apart = _pauses(recordings, between)
    missing = [max(round(pause * first.rate), 1) for pause in pauses]
    _refuse_too_many(recordings, missing, len(kept))
    starts = np.cumsum([0, *(r.n_samples + gap for r, gap in zip(recordings, missing, strict=False))])
    spans = [(a, a + r.n_samples) for a, r in zip(starts.tolist(), recordings, strict=True)]
    columns = []
    for channel in kept:
        column = np.full(spans[-1][1], np.nan)
        for (a, b), recording in zip(spans, recordings, strict=True):
            column[a:b] = _in_unit_of(channel, recording)
        columns.append(ArrayColumn(column))
    files = [recording.source for recording in recordings]
    whole = Recording(
        channels=tuple(kept),
        columns=tuple(columns),
        rate=first.rate,
        start=first.start,
        source=f"{files[0]} and {len(files) - 1} more",
        history=({"step": "join", "files": files, "between_s": pauses},),
    )
    return whole, spans, apart


def joined_positions(
    recordings: Sequence[Recording],
    headings: Sequence[float],
    *,
    between: float = BETWEEN,
    dead_time: float = DEAD_TIME,
) -> tuple[Recording, Reversals, PositionsApart]:
    """One record of the rates of all files, and where the sensor stood in each.

    Parameters
    ----------
    recordings, between
        See `joined_files`.
    headings : sequence of float [rad]
        Of the sensitive axis, from north over east.
    dead_time : float [s]
        Left out at the beginning of every file but the first.

    Returns
    -------
    recording : Recording
    positions : Reversals
    apart : PositionsApart
        Where the time between the files comes from.

    Raises
    ------
    InputError
        As `joined_files`; or not one heading for each file.
    """
    if len(recordings) != len(headings):
        raise InputError("positions in files of their own need at least two files, each with its heading")
    rates = [c.name for c in recordings[0].channels if c.kind is Kind.RATE] if recordings else []
    whole, spans, apart = joined_files(recordings, rates, between=between)
    labels = [recording.source for recording in recordings]
    return whole, placed(whole, spans, headings, labels, dead_time=dead_time), apart


def _in_unit_of(channel: Channel, recording: Recording) -> NDArray[np.float64]:
    """The same channel of another file, in the unit of the first."""
    counterpart = recording[channel.name]
    if counterpart.scale == channel.scale:
        return recording.values(channel.name)
    return recording.scaled(channel.name) / channel.scale


def _refuse_another(first: Recording, other: Recording, kept: Sequence[Channel]) -> None:
    kinds = {c.name: c.kind for c in other.channels}
    if not kept or any(kinds.get(c.name) is not c.kind for c in kept):
        there, here = (
            ", ".join(f"{c.name} ({c.kind.value})" for c in channels) or "none"
            for channels in (other.channels, kept or first.channels)
        )
        raise InputError(
            f"{other.source} has the channels {there}, {first.source} has {here}: files of one sensor have the "
            "same; choose with --channels, name units with --unit"
        )
    if abs(other.rate / first.rate - 1) > _SAME_RATE:
        raise InputError(
            f"{other.source} has {other.rate:g} samples per second, {first.source} has {first.rate:g}: all positions "
            "are recorded at one rate"
        )


def _refuse_too_many(recordings: Sequence[Recording], missing: Sequence[int], channels: int) -> None:
    count = channels * (sum(r.n_samples for r in recordings) + sum(missing))
    if count > _MOST:
        raise LimitError(
            f"{len(recordings)} files with the time between them are {count:.2g} samples, more than {_MOST:.2g}: take "
            "a part of each (--from, --to), or lower their rate"
        )


def _pauses(recordings: Sequence[Recording], between: float) -> tuple[list[float], PositionsApart]:
    """Time from each file to the next [s], by their stamps where all have them."""
    starts = [r.start for r in recordings]
    if any(start is None for start in starts):
        return [between] * (len(recordings) - 1), PositionsApart(count=len(recordings), assumed=between)
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
    return [max(p, recordings[0].dt) for p in pauses], PositionsApart(count=len(recordings))
