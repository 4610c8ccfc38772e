# SPDX-License-Identifier: BSD-3-Clause
"""Does the rate of a record change once? Its mean rate would then make the time axis wrong."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.filled_stamps import Filled
from allanite.lazy_dataclasses import dataclass

__all__ = ["RateChange", "kink", "two_rates"]

Array = NDArray[np.float64]

#: Stamps looked at, and stretches between them that are needed.
_LOOKED_AT, _FEWEST = 257, 15
#: Least relative difference of two rates; of the stretches so many are nearer to their own than a part of it.
_DIFFERENT, _MOST, _NEAR = 0.01, 0.9, 0.25
_END = 32  # of the stretches, one part so small tells the rate at an end, but 3 of them at least


@dataclass(frozen=True, slots=True)
class RateChange:
    """Rates before and after a change [Hz], and when it was [s since the first stamp]."""

    before: float
    after: float
    at: float


def two_rates(stamps: Filled) -> RateChange | None:
    """Of stamps, as if no sample were missing; None where the rate does not change, or more than once."""
    rows = np.unique(np.linspace(0, max(len(stamps) - 1, 0), _LOOKED_AT).astype(np.int64))
    return kink(rows.astype(np.float64), np.array([stamps.read(row, row + 1)[0] for row in rows.tolist()]))


def kink(places: Array, times: Array) -> RateChange | None:
    """Of samples by their places in the record and their times [s].

    Each stretch between two of them has one of two intervals, all of the first before all of the second. Pauses
    lengthen a few stretches; a clock that drifts has all intervals in between.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        pace = np.log(np.diff(times) / np.diff(places))
    known = np.flatnonzero(np.isfinite(pace))
    pace = pace[known]
    if len(pace) < _FEWEST:
        return None
    end = max(len(pace) // _END, 3)
    first, last = (float(np.median(part)) for part in (pace[:end], pace[-end:]))
    if abs(last - first) < _DIFFERENT:
        return None
    is_first = np.abs(pace - first) < np.abs(pace - last)
    k = int(np.cumsum(np.where(is_first, 1, -1))[:-1].argmax()) + 1
    parts = pace[:k], pace[k:]
    before, after = (float(np.median(part)) for part in parts)
    near = _NEAR * abs(after - before)
    steady = all(np.mean(np.abs(p - np.median(p)) < near) >= _MOST for p in parts)
    if not steady or abs(after - before) < _DIFFERENT:
        return None
    return RateChange(before=math.exp(-before), after=math.exp(-after), at=float(times[known[k]]))
