# SPDX-License-Identifier: BSD-3-Clause
"""Does the rate of a record change once? Its mean rate would then make the time axis wrong."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.filled_stamps import Filled

__all__ = ["kink", "two_rates"]

Array = NDArray[np.float64]

#: Stamps looked at, a least number of rows, and a difference of the rates that is one.
_LOOKED_AT, _FEWEST, _DIFFERENT = 512, 16, 0.01
#: So much of the bend may be left between the stamps and two straight lines.
_LEFT = 0.05


def two_rates(stamps: Filled) -> tuple[float, float, int] | None:
    """Rates [Hz] before and after the row at which the rate changes; None where it does not, or more than once."""
    n = len(stamps)
    rows = np.unique(np.linspace(0, max(n - 1, 0), _LOOKED_AT).astype(np.int64))
    change = kink(rows.astype(np.float64), np.array([stamps.read(row, row + 1)[0] for row in rows.tolist()]))
    return None if change is None else (1 / change[0], 1 / change[1], int(rows[change[2]]))


def kink(places: Array, times: Array) -> tuple[float, float, int] | None:
    """Intervals [s] before and after the place, by its index, at which the interval changes; None where it does not.

    The times are then two straight lines over the places, and are farthest from their chord where these meet.
    """
    if len(places) < _FEWEST:
        return None
    bend = np.abs(times - np.interp(places, places[[0, -1]], times[[0, -1]]))
    k = int(bend.argmax())
    if not 2 <= k < len(places) - 2:
        return None
    lines = [np.polyfit(places[part], times[part], 1) for part in (slice(k), slice(k + 1, None))]
    intervals = [float(line[0]) for line in lines]
    if not min(intervals) > 0 or abs(intervals[0] / intervals[1] - 1) < _DIFFERENT:
        return None
    left = np.minimum(*(np.abs(np.polyval(line, places) - times) for line in lines))
    return (intervals[0], intervals[1], k) if left.max() <= _LEFT * bend[k] else None
