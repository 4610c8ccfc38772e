# SPDX-License-Identifier: BSD-3-Clause
"""The whole of a record in some thousand points: mean, standard deviation and envelope."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.recording.records import Channel, Recording
from allanite.study.results import BlockExtremes

__all__ = ["overview_of"]

Array = NDArray[np.float64]

#: Points of the envelope.
_POINTS = 1500


def overview_of(recording: Recording, channel: Channel) -> tuple[float, float, BlockExtremes]:
    """Mean, standard deviation and the envelope that a picture of the whole record needs, in one pass, SI."""
    n = recording.n_samples
    size = max(1, -(-n // _POINTS))
    block = size * max(1, (1 << 18) // size)
    origin, low, high, total, square, count = recording.origin(channel.name), [], [], 0.0, 0.0, 0
    reference: float | None = None
    for _, values in recording.blocks(channel.name, block):
        complete = not math.isnan(float(values.sum()))
        present = values if complete else values[~np.isnan(values)]
        if reference is None and len(present):
            reference = float(present[0])
        centred = present - (reference or 0.0)
        total += float(centred.sum())
        square += float(np.dot(centred, centred))
        count += len(present)
        ends = _ends(values, size) if complete else _ends_of_present(values, size)
        low.append(ends[0])
        high.append(ends[1])
    scale = channel.scale
    ends = np.sort((np.stack([np.concatenate(low), np.concatenate(high)]) + origin) * scale, axis=0)
    middle = total / count if count else math.nan
    sd = math.sqrt(max(square - total * middle, 0.0) / max(count - 1, 1)) * abs(scale) if count else math.nan
    mean = ((reference or 0.0) + middle + origin) * scale
    t = (np.arange(ends.shape[1]) + 0.5) * size * recording.dt
    return mean, sd, BlockExtremes(t=np.asarray(t, dtype=np.float64), low=ends[0], high=ends[1])


def _ends(values: Array, size: int) -> Array:
    """Least and largest of each `size` values, and of what is left; none is missing."""
    starts = np.arange(0, len(values), size)
    return np.stack([np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)])


def _ends_of_present(values: Array, size: int) -> Array:
    """The same where some are missing: NaN where all are."""
    missing = np.isnan(values)
    low, _ = _ends(np.where(missing, np.inf, values), size)
    _, high = _ends(np.where(missing, -np.inf, values), size)
    return np.where(np.isinf(low), np.nan, np.stack([low, high]))
