# SPDX-License-Identifier: BSD-3-Clause
"""Where stamps that a stated rate sets aside restart or jump: the rows on both sides are no neighbors in time."""

from __future__ import annotations

from typing import Final

import numpy as np

from allanite.files.readers.filled_stamps import BLOCK, Stamps

__all__ = ["seams_of"]

#: Intervals that neighbors may lie from their place: further is neither jitter nor swapped rows.
_FAR: Final = 20.0
#: Seams; more are rows out of order, which is why the stamps were set aside.
_MOST: Final = 50


def seams_of(stamps: Stamps, rate: float) -> list[int]:
    """Rows whose stamp is earlier than the one before, or later by more than all the rows take, by many intervals.

    Empty where there are so many that the stamps tell nothing.
    """
    seams: list[int] = []
    longest = max(len(stamps), _FAR) / rate
    for start in range(0, len(stamps) - 1, BLOCK):
        step = np.diff(stamps.read(start, start + BLOCK + 1))
        with np.errstate(invalid="ignore"):
            seams += (np.flatnonzero((step < -_FAR / rate) | (step > longest)) + start + 1).tolist()
        if len(seams) > _MOST:
            return []
    return seams
