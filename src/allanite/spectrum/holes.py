# SPDX-License-Identifier: BSD-3-Clause
"""Isolated missing samples in a periodogram.

Left out at weight zero, a missing sample of red noise is a step down to the mean and back: it leaks the power of the
lowest frequencies over all others. Here its expected value given its neighbours stands in for it, and what that value
lacks in variance is added to the density: for error e_i of the best estimate, which no neighbour tells,

    E|F(f)|^2 = E|F'(f)|^2 + sum over missing i of w_i^2 var(e_i)                                          (1)

at every frequency, whatever the spectrum. White noise is so put back to what it was (the estimate is then the mean); a
random walk needs nothing put back. Runs of more than a few samples stay missing: segments that hold them are left out.
The recording itself keeps its gaps.

References
----------
.. [1] N. Wiener, "Extrapolation, interpolation and smoothing of stationary time series", 1949: the estimate from both
   sides; here from the autocovariance of the block itself, over `_REACH` samples on each side.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

__all__ = ["Bridge"]

Array = NDArray[np.float64]

#: Longest run of missing samples that is bridged.
LONGEST_RUN = 4
_REACH = 8
_ENOUGH = 64  # samples of a block that its autocovariance is taken from
_RIDGE = 1e-9
_BATCH = 4096


class Bridge:
    """Bridges short runs of missing samples in a stream of blocks, and counts what that takes off the variance."""

    def __init__(self) -> None:
        self._lacking = 0.0
        self._samples = 0

    @property
    def lacking(self) -> float:
        """Variance that bridged samples lack, averaged over all samples: a white density of this times dt."""
        return self._lacking / max(self._samples, 1)

    def __call__(self, block: Array) -> Array:
        """The block with its short runs bridged."""
        missing = np.isnan(block)
        self._samples += int(len(block) - missing.sum())
        if not missing.any() or len(block) - missing.sum() < _ENOUGH:
            return block
        short = _short(missing)
        if not len(short):
            return block
        self._samples += len(short)
        level = float(np.nanmean(block))
        covariance = _autocovariance(np.where(missing, 0.0, block - level), ~missing)
        out = block.copy()
        for places in _batches(short):
            value, error = _expected(block - level, ~missing, places, covariance)
            out[places] = value + level
            self._lacking += float(error.sum())
        return out


def _batches(places: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    for first in range(0, len(places), _BATCH):
        yield places[first : first + _BATCH]


def _short(missing: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Missing samples in runs that are short enough, and not at the ends of the block."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], missing, [False]]).astype(np.int8)))
    runs = edges.reshape(-1, 2)
    runs = runs[(np.diff(runs, axis=1)[:, 0] <= LONGEST_RUN) & (runs[:, 0] > 0) & (runs[:, 1] < len(missing))]
    found = [np.arange(a, b) for a, b in runs]
    return np.concatenate(found) if found else np.zeros(0, dtype=np.int64)


def _autocovariance(values: Array, present: NDArray[np.bool_]) -> Array:
    """R(0) about the mean of the block, and R(h) = R(0) - D(h)/2 by mean squared differences D: no cancellation."""
    whole = float(values @ values) / max(int(present.sum()), 1)
    found = [whole]
    for h in range(1, 2 * _REACH + 1):
        both = present[h:] & present[:-h]
        apart = float(np.sum(np.where(both, values[h:] - values[:-h], 0.0) ** 2)) / max(int(both.sum()), 1)
        found.append(whole - apart / 2)
    return np.array(found)


def _expected(
    values: Array, present: NDArray[np.bool_], places: NDArray[np.int64], covariance: Array
) -> tuple[Array, Array]:
    """Best linear estimate of the samples at `places` from those around, and the variance of its error."""
    offsets = np.concatenate([np.arange(-_REACH, 0), np.arange(1, _REACH + 1)])
    near = places[:, None] + offsets
    inside = (near >= 0) & (near < len(values))
    near = np.clip(near, 0, len(values) - 1)
    there = inside & present[near]
    between = covariance[np.minimum(np.abs(np.subtract.outer(offsets, offsets)), 2 * _REACH)]
    matrix = np.where(there[:, :, None] & there[:, None, :], between, 0.0)
    diagonal = np.arange(len(offsets))
    matrix[:, diagonal, diagonal] = covariance[0] * (1 + _RIDGE) or 1.0
    target = np.where(there, covariance[np.abs(offsets)], 0.0)
    share = np.linalg.solve(matrix, target[:, :, None])[:, :, 0]
    value = np.sum(share * np.where(there, values[near], 0.0), axis=1)
    error = covariance[0] - np.sum(share * target, axis=1)
    return value, np.clip(error, 0.0, covariance[0])
