# SPDX-License-Identifier: BSD-3-Clause
"""The whole of a record in some thousand points: mean, standard deviation and envelope."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.recording.records import Channel, Recording
from allanite.study.results import BlockExtremes

__all__ = ["OverviewTally"]

Array = NDArray[np.float64]

#: Points of the envelope.
_POINTS = 1500


class OverviewTally:
    """Mean, standard deviation and the envelope that a picture of a whole channel needs, from its blocks in turn."""

    __slots__ = (
        "_channel",
        "_count",
        "_dt",
        "_ends",
        "_filled",
        "_origin",
        "_reference",
        "_size",
        "_square",
        "_total",
    )

    def __init__(self, recording: Recording, channel: Channel) -> None:
        self._channel, self._dt, self._origin = channel, recording.dt, recording.origin(channel.name)
        self._size = max(1, -(-recording.n_samples // _POINTS))
        self._ends, self._filled = list[Array](), 0  # samples in a part that is not full yet
        self._reference: float | None = None
        self._total = self._square = 0.0
        self._count = 0

    def add(self, values: Array) -> None:
        """Take the next block: its own unit, NaN where missing."""
        complete = not math.isnan(float(values.sum()))
        present = values if complete else values[~np.isnan(values)]
        if self._reference is None and len(present):
            self._reference = float(present[0])
        centred = present - (self._reference or 0.0)
        self._total += float(centred.sum())
        self._square += float(np.dot(centred, centred))
        self._count += len(present)
        starts = np.maximum(np.arange(-self._filled, len(values), self._size), 0)
        ends = _ends(values, starts)
        if self._filled:
            last = self._ends[-1]
            last[0, -1], last[1, -1] = np.fmin(last[0, -1], ends[0, 0]), np.fmax(last[1, -1], ends[1, 0])
            ends = ends[:, 1:]
        if ends.size:
            self._ends.append(ends)
        self._filled = (self._filled + len(values)) % self._size

    def result(self) -> tuple[float, float, BlockExtremes]:
        """Mean, standard deviation and envelope, SI."""
        count, scale = self._count, self._channel.scale
        ends = np.sort((np.concatenate(self._ends, axis=1) + self._origin) * scale, axis=0)
        t = (np.arange(ends.shape[1]) + 0.5) * self._size * self._dt
        envelope = BlockExtremes(t=np.asarray(t, dtype=np.float64), low=ends[0], high=ends[1])
        if not count:
            return math.nan, math.nan, envelope
        middle = self._total / count
        sd = math.sqrt(max(self._square - self._total * middle, 0.0) / max(count - 1, 1)) * abs(scale)
        return ((self._reference or 0.0) + middle + self._origin) * scale, sd, envelope


def _ends(values: Array, starts: NDArray[np.int64]) -> Array:
    """Least and largest of the values from each start on to the next; NaN where all are missing."""
    ends = np.stack([np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)])
    if not np.isnan(ends).any():
        return ends
    missing = np.isnan(values)
    low = np.minimum.reduceat(np.where(missing, np.inf, values), starts)
    high = np.maximum.reduceat(np.where(missing, -np.inf, values), starts)
    return np.where(np.isinf(low), np.nan, np.stack([low, high]))
