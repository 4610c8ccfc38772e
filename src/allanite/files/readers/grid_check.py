# SPDX-License-Identifier: BSD-3-Clause
"""A grid against the stamps that it was made of: does each sample lie where its stamp says?

The rate, the gaps and the missing samples of each are found one by one, and each may be well fitted while the whole
contradicts the stamps: a rate that is 0.4 % off takes the place of a few lost samples. Only the sum of all shows it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.clock_line import Marks
from allanite.files.readers.filled_stamps import Filled

__all__ = ["in_stalls", "off_grid_share"]

_Floats = NDArray[np.float64]

#: Intervals from its place beyond which a sample is off the grid: half of one, and the error of the phase.
_FAR = 0.75
#: Rms scatters of a stamp that are added to half an interval, where that is more.
_SCATTERS = 2.0
#: Samples over which a clock is even, but for a change of its rate by so much.
_WINDOW, _DRIFT = 4096, 5e-4
#: Share of an interval below which stamps were written in one go.
_PILED = 0.5


def off_grid_share(stamps: Filled, marks: Marks, interval: float, jitter: float = 0.0) -> float:
    """Share of stamps that lie farther from their places than half an interval and the error of the phase.

    Stamps that scatter by `jitter` [s] rms lie twice that farther, in one case of twenty.

    Those that were written in one go count for nothing.

    Notes
    -----
    Within 4096 samples a clock may drift by 500 ppm; over more it may do as it likes, which is another finding.
    """
    limit = interval * max(_FAR, 0.5 + _SCATTERS * jitter / interval)
    gained, fallen = np.cumsum(marks.missing), np.cumsum(_falls(stamps, marks))
    far = size = 0
    for first, count, block in stamps.blocks(0, 0):
        k = np.arange(first, first + count + 1)
        residual = block - interval * k
        if len(gained):
            at = np.searchsorted(marks.gaps, k)
            residual -= interval * np.where(at > 0, gained[at - 1], 0)
        if len(fallen):
            at = np.searchsorted(marks.shifts, k)
            residual -= np.where(at > 0, fallen[at - 1], 0.0)
        residual = residual[~_piled(block, interval)]
        for part in np.array_split(residual, max(round(len(residual) / _WINDOW), 1)):
            far += int(np.count_nonzero(np.abs(_without_drift(part, interval)) > limit))
            size += len(part)
    return far / max(size, 1)


def _falls(stamps: Filled, marks: Marks) -> _Floats:
    """By how much the clock fell back, where a stamp does [s]: a host stamps nothing early."""
    back = [bool(np.diff(stamps.read(int(k), int(k) + 2))[0] <= 0.0) for k in marks.shifts]
    return np.where(back, marks.offsets, 0.0)


def _piled(stamps: _Floats, interval: float) -> NDArray[np.bool_]:
    """Stamps that were written in one go with the one before or behind."""
    close = np.diff(stamps) < _PILED * interval
    return np.asarray(np.append(close, False) | np.append(False, close))


def _without_drift(residual: _Floats, interval: float) -> _Floats:
    """Distances from a line that is as steep as a clock may drift: through the medians of both halves."""
    half = len(residual) // 2
    if half < 2:
        return np.zeros(len(residual))
    rest = residual - np.median(residual)
    slope = float(np.median(rest[-half:]) - np.median(rest[:half])) / (len(residual) - half)
    slope = float(np.clip(slope, -_DRIFT * interval, _DRIFT * interval))
    rest = rest - slope * np.arange(len(rest))
    return np.asarray(rest - np.median(rest))


def in_stalls(stamps: Filled, marks: Marks, interval: float) -> int:
    """Samples stamped in one go of which some are missing, nobody knows which: their places are open by as many."""
    count = 0
    for first, _, block in stamps.blocks(0, 0):
        piled = np.diff(block) < _PILED * interval
        edges = np.flatnonzero(np.diff(piled.astype(np.int8), prepend=0, append=0))
        begins, ends = first + edges[::2], first + edges[1::2]  # samples, the last one included
        after = np.searchsorted(marks.gaps, begins - 1)
        inside = (after < len(marks.gaps)) & (np.append(marks.gaps, np.iinfo(np.int64).max)[after] <= ends)
        count += int((ends - begins + 1)[inside].sum())
    return count
