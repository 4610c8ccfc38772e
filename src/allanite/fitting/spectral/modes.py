# SPDX-License-Identifier: BSD-3-Clause
"""The slowest movements of a record, as far as the samples that are there tell them.

A periodogram loses the lowest frequencies to its window. Here they are seen by contrasts of means over blocks, which
are nearly uncorrelated whatever the noise and cross gaps without closing or filling them: see `fitting.slow_contrasts`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.slow_contrasts import autocorrelations, slow_contrasts
from allanite.noise import TermType, White
from allanite.noise.spectrum.periodogram import rate_blocks
from allanite.recording.records import Recording

__all__ = ["SlowModes", "slow_modes"]

Array = NDArray[np.float64]

#: Blocks of a record at most, and the part of the contrasts that is used: faster ones see the folding of the blocks.
BLOCKS, PART = 1024, 4
#: A block needs this part of its samples.
_PRESENT = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class SlowModes:
    """Contrasts of block means.

    Attributes
    ----------
    value : ndarray, shape (n,) [SI]
        c_k.
    frequency : ndarray, shape (n,) [Hz]
        Where a contrast listens; ascending.
    slope : ndarray, shape (n,) [s]
        c_k of a ramp of slope 1/s.
    whole : bool
        The contrasts hold all that the record tells (no block is longer than a sample).
    """

    value: Array
    frequency: Array
    slope: Array
    whole: bool
    _autocorrelation: Array
    _size: int
    _dt: float
    _sampling: str

    def variance(self, term: TermType) -> Array:
        """E[c_k^2] of a term, shape (n,): eq. (2)."""
        if isinstance(term, White):  # exact even where blocks miss samples
            return np.full(len(self.value), term.N**2 / (self._size * self._dt))
        return np.asarray(self._autocorrelation @ self._autocovariance(term))

    def _autocovariance(self, term: TermType) -> Array:
        """R(h) of the block means up to a constant: the second difference of the phase covariance."""
        h = np.arange(-1, self._autocorrelation.shape[1] + 1, dtype=np.float64)
        if self._sampling == "mean":  # means of means are means
            phase = term.phase_covariance(np.abs(h), self._dt * self._size, "mean")
        else:
            phase = term.phase_covariance(np.abs(h) * self._size, self._dt, "point") / self._size**2
        return np.asarray(2 * phase[1:-1] - phase[2:] - phase[:-2])


def slow_modes(recording: Recording, name: str, *, blocks: int = BLOCKS) -> SlowModes:
    """The slowest contrasts of a channel, a quarter of the blocks that are there; at most so many `blocks`."""
    size = max(-(-recording.n_samples // blocks), 1)
    mean, part = _block_means(recording, name, size)
    there = np.flatnonzero(part >= _PRESENT)
    dt, scale = 1 / recording.rate, abs(recording[name].scale)
    count = len(there) - 1 if size == 1 else len(there) // PART
    if count < 1:
        none = np.zeros(0)
        return SlowModes(
            value=none, frequency=none, slope=none, whole=size == 1, _autocorrelation=np.zeros((0, 1)),
            _size=size, _dt=dt, _sampling=recording[name].sampling,
        )  # fmt: skip
    rate, contrasts = slow_contrasts(there, 1 / part[there], count)
    placed = np.zeros((count, len(part)))
    placed[:, there] = contrasts
    centre = (there + 0.5) * size * dt
    return SlowModes(
        value=contrasts @ (mean[there] * scale),
        frequency=np.arcsin(np.minimum(np.sqrt(rate) / 2, 1.0)) / (math.pi * size * dt),
        slope=contrasts @ (centre - centre.mean()),
        whole=size == 1,
        _autocorrelation=autocorrelations(placed),
        _size=size,
        _dt=dt,
        _sampling=recording[name].sampling,
    )


def _block_means(recording: Recording, name: str, size: int) -> tuple[Array, Array]:
    """Means over blocks of the rate less a constant, in the channel's own unit, and the part of each that is there."""
    rest, means, parts = np.zeros(0), [], []
    for _, block in rate_blocks(recording, name):
        stream = np.concatenate([rest, block])
        rows = len(stream) // size
        table, rest = stream[: rows * size].reshape(rows, size), stream[rows * size :]
        present = ~np.isnan(table)
        count = present.sum(axis=1)
        means.append(np.where(present, table, 0.0).sum(axis=1) / np.maximum(count, 1))
        parts.append(count / size)
    if not means:  # a record without samples
        return np.zeros(0), np.zeros(0)
    return np.concatenate(means), np.concatenate(parts)
