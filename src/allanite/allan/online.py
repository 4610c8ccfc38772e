# SPDX-License-Identifier: BSD-3-Clause
"""The decimated engine: OADEV in one pass and fixed memory, for records larger than memory.

The phase is decimated by two per octave, so that every lag keeps at least 64 positions per window: every 2^k-th
window is taken at a lag of 64 * 2^k samples and more. The estimate has the same mean; its degrees of freedom fall by
less than 0.1 %.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.allan.statistics import first_level, merge_touching
from allanite.errors import DataQualityError
from allanite.recording import Recording

__all__ = ["decimable", "decimated_sums"]

Array = NDArray[np.float64]
Lags = NDArray[np.int64]

_ORDER = 2
_POSITIONS = 64
_BLOCK = 1024


def decimable(lags: Lags) -> Lags:
    """The nearest lags that are whole numbers of decimated samples: q 2^k with q in [64, 128)."""
    level = np.maximum(np.floor(np.log2(lags / _POSITIONS)), 0).astype(np.int64)
    step = np.int64(1) << level
    return np.unique((lags + step // 2) // step * step)


def decimated_sums(
    recording: Recording,
    name: str,
    lags: Lags,
    progress: Callable[[float], None] | None = None,
) -> tuple[Array, Lags, Lags]:
    """OAVAR of one channel at decimable lags, in the channel's own unit squared.

    Returns
    -------
    variance : ndarray, shape (n_lags,)
        NaN where no window is complete.
    count : ndarray of int64, shape (n_lags,)
        Complete windows that the estimate stands for (those summed times their stride).
    missing : ndarray of int64, shape (n_runs, 2)

    Raises
    ------
    DataQualityError
        Every sample is missing.
    """
    numbers, counters = (
        np.zeros(size, dtype)
        for size, dtype in zip(
            _kernels.online_allan_size(lags, _ORDER, _POSITIONS, _BLOCK), (np.float64, np.int64), strict=True
        )
    )
    offset = first_level(recording, name)
    runs = []
    for start, block in recording.blocks(name):
        block = np.ascontiguousarray(block)
        runs.append(_kernels.missing_runs(block, start))
        _kernels.online_allan_feed(numbers, counters, lags, _ORDER, _POSITIONS, _BLOCK, block, offset)
        if progress is not None:
            progress((start + len(block)) / recording.n_samples)
    sums, terms = _kernels.online_allan_read(numbers, counters, lags, _ORDER, _POSITIONS, _BLOCK)
    missing = merge_touching(np.concatenate(runs))
    if len(missing) and int((missing[:, 1] - missing[:, 0]).sum()) == recording.n_samples:
        raise DataQualityError(f"channel {name!r}: all {recording.n_samples} samples are missing")
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.where(terms > 0, sums / (2 * lags.astype(np.float64) ** 2 * terms), np.nan)
    stride = np.int64(1) << np.maximum(np.floor(np.log2(lags / _POSITIONS)), 0).astype(np.int64)
    return variance, np.minimum(terms * stride, recording.n_samples - 2 * lags + 1), missing
