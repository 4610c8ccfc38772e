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
from allanite.errors import DataQualityError
from allanite.noise.allan.statistics import first_level, merge_touching
from allanite.recording.records import Recording

__all__ = ["OnlineSums", "decimable", "decimated_sums"]

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


class OnlineSums:
    """Sums of squares of one channel at decimable lags, block by block, in fixed memory.

    Parameters
    ----------
    lags : ndarray of int64, shape (n_lags,)
    offset : float
        Near the level of the samples, [own unit]: keeps digits.
    """

    def __init__(self, lags: Lags, offset: float) -> None:
        self.lags, self.offset = lags, offset
        sizes = _kernels.online_allan_size(lags, _ORDER, _POSITIONS, _BLOCK)
        self._numbers, self._counters = np.zeros(sizes[0]), np.zeros(sizes[1], np.int64)
        self._missing: list[Lags] = []
        self.n_samples = 0

    def feed(self, block: Array) -> None:
        """The next samples, NaN where missing."""
        block = np.ascontiguousarray(block)
        self._missing.append(_kernels.missing_runs(block, self.n_samples))
        _kernels.online_allan_feed(
            self._numbers, self._counters, self.lags, _ORDER, _POSITIONS, _BLOCK, block, self.offset
        )
        self.n_samples += len(block)

    def read(self) -> tuple[Array, Lags, Lags]:
        """Variance [own unit^2], windows that it stands for, runs of missing samples: see `decimated_sums`."""
        lags = self.lags
        sums, terms = _kernels.online_allan_read(
            self._numbers, self._counters, lags, _ORDER, _POSITIONS, _BLOCK
        )
        self._missing = [merge_touching(np.concatenate(self._missing))] if self._missing else []
        missing = self._missing[0] if self._missing else np.zeros((0, 2), np.int64)
        with np.errstate(divide="ignore", invalid="ignore"):
            variance = np.where(terms > 0, sums / (2 * lags.astype(np.float64) ** 2 * terms), np.nan)
        stride = np.int64(1) << np.maximum(np.floor(np.log2(lags / _POSITIONS)), 0).astype(np.int64)
        return variance, np.minimum(terms * stride, self.n_samples - 2 * lags + 1), missing


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
    sums = OnlineSums(lags, first_level(recording, name))
    for start, block in recording.blocks(name):
        sums.feed(block)
        if progress is not None:
            progress((start + len(block)) / recording.n_samples)
    variance, count, missing = sums.read()
    if len(missing) and int((missing[:, 1] - missing[:, 0]).sum()) == recording.n_samples:
        raise DataQualityError(f"channel {name!r}: all {recording.n_samples} samples are missing")
    return variance, count, missing
