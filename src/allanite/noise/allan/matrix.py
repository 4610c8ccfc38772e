# SPDX-License-Identifier: BSD-3-Clause
"""Allan covariance of several channels, overlapping, from the kernel of the variance by polarisation.

With D_i the difference of adjacent means over tau in channel i, at positions where every channel is complete,

    C_ij(tau) = <D_i D_j>/2 = (AVAR_i + AVAR_j - AVAR_{i-j})/2,                                                     (1)

exactly, also in a record with gaps, because all three are sums over the same positions. The variances of differences
are computed themselves: what two channels do not share is there without cancellation, however much they do share.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan.covariance import complete_starts
from allanite.noise.allan.statistics import block_sums, total_length
from allanite.recording.block_series import made_by_blocks

__all__ = ["AllanMatrix", "allan_matrix", "allan_products"]

Array = NDArray[np.float64]
Spans = NDArray[np.int64]

#: Starts whose differences are multiplied at once.
_PIECE = 2048


@dataclass(frozen=True, slots=True, kw_only=True)
class AllanMatrix:
    """Allan covariance of n channels at several lags.

    Attributes
    ----------
    lags : ndarray of int64, shape (n_lags,)
    covariance : ndarray, shape (n_lags, n, n)
        Square of the channels' unit; the diagonal holds the Allan variances.
    difference : ndarray, shape (n_lags, n, n)
        Allan variances of the differences of channels; zero on the diagonal.
    count : ndarray of int64, shape (n_lags,)
        Terms in the sums.
    """

    lags: NDArray[np.int64]
    covariance: Array
    difference: Array
    count: NDArray[np.int64]


def allan_matrix(phases: Sequence[Array] | Array, missing: Spans, lags: NDArray[np.int64]) -> AllanMatrix:
    """Allan covariance matrix of channels that were recorded together.

    Parameters
    ----------
    phases : n ndarrays, shape (n_samples + 1,)
        Running sums of the samples of each channel, in one unit, less a constant rate; finite everywhere.
    missing : ndarray of int64, shape (n_runs, 2) [samples]
        Where any of the channels is missing.
    lags : ndarray of int64, shape (n_lags,)
        NaN where no position is complete.
    """
    n, points = len(phases), len(phases[0])
    runs = [complete_starts(missing, points - 1, 2 * int(m)) for m in lags]
    count = np.array([total_length(r) for r in runs], dtype=np.int64)
    with np.errstate(divide="ignore", invalid="ignore"):
        norm = 2.0 * lags.astype(np.float64) ** 2 * np.where(count > 0, count, np.nan)

    def variance(x: Array) -> Array:
        return np.asarray(block_sums(np.asanyarray(x, order="C"), 2, lags, runs, 1) / norm)

    variances = np.stack([variance(x) for x in phases], axis=1)
    difference = np.zeros((len(lags), n, n))
    for i in range(n):
        for j in range(i):
            apart = made_by_blocks(np.subtract, phases[i], phases[j])
            difference[:, i, j] = difference[:, j, i] = variance(apart)
    covariance = 0.5 * (variances[:, :, None] + variances[:, None, :] - difference)
    return AllanMatrix(lags=lags, covariance=covariance, difference=difference, count=count)


def allan_products(phases: Array, missing: Spans, lags: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Allan covariance alone, of many channels: a matrix product in place of a pass for each pair.

    Parameters are those of `allan_matrix`, the phases as rows of one array.

    Returns
    -------
    covariance : ndarray, shape (n_lags, n, n)
        NaN where no position is complete.
    count : ndarray of int64, shape (n_lags,)
    """
    n, points = phases.shape
    runs = [complete_starts(missing, points - 1, 2 * int(m)) for m in lags]
    count = np.array([total_length(r) for r in runs], dtype=np.int64)
    covariance = np.full((len(lags), n, n), np.nan)
    for k, m in enumerate(lags.tolist()):
        total = np.zeros((n, n))
        for start, stop in _pieces(runs[k]):
            d = (
                phases[:, start + 2 * m : stop + 2 * m]
                - 2 * phases[:, start + m : stop + m]
                + phases[:, start:stop]
            )
            total += d @ d.T
        if count[k]:
            covariance[k] = total / (2.0 * float(m) ** 2 * count[k])
    return covariance, count


def _pieces(runs: Spans) -> Iterator[tuple[int, int]]:
    """The runs, cut into pieces whose differences stay in cache."""
    for start, stop in runs.tolist():
        for begin in range(start, stop, _PIECE):
            yield begin, min(begin + _PIECE, stop)
