# SPDX-License-Identifier: BSD-3-Clause
"""The slowest movements of a record, as far as the samples that are there tell them.

A periodogram loses the lowest frequencies to its window. Here they are seen by contrasts of means over blocks, which
are nearly uncorrelated whatever the noise and cross gaps without closing or filling them: see `fitting.slow_contrasts`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.slow_contrasts import autocorrelations, slow_contrasts
from allanite.lazy_dataclasses import dataclass
from allanite.noise import TermType, White
from allanite.noise.spectrum.periodogram import rate_blocks
from allanite.recording.records import Recording

__all__ = ["PartMeans", "SlowModes", "slow_modes"]

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


def slow_modes(
    recording: Recording, name: str, *, blocks: int = BLOCKS, means: PartMeans | None = None
) -> SlowModes:
    """The slowest contrasts of a channel, a quarter of the blocks that are there; at most so many `blocks`.

    `means` are those of the channel, where another pass has made them.
    """
    if means is None:
        means = PartMeans(recording.n_samples, blocks)
        for _, block in rate_blocks(recording, name):
            means.feed(block)
    size, (mean, part) = means.size, means.result()
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


class PartMeans:
    """Means of a record that comes in blocks, over at most so many equal parts of it.

    Attributes
    ----------
    size : int
        Samples of a part.
    """

    __slots__ = ("_means", "_parts", "_rest", "size")

    def __init__(self, n_samples: int, blocks: int = BLOCKS) -> None:
        self.size = max(-(-n_samples // blocks), 1)
        self._rest = np.zeros(0)
        self._means, self._parts = [np.zeros(0)], [np.zeros(0)]

    def feed(self, rates: Array) -> None:
        """Take the next block, as `rate_blocks` gives it."""
        stream = np.concatenate([self._rest, rates])
        rows = len(stream) // self.size
        table = stream[: rows * self.size].reshape(rows, self.size)
        self._rest = stream[rows * self.size :]
        total, part = table.sum(axis=1), np.ones(rows)
        missing = np.isnan(total)
        if missing.any():
            present = ~np.isnan(table[missing])
            total[missing] = np.where(present, table[missing], 0.0).sum(axis=1)
            part[missing] = present.sum(axis=1) / self.size
        self._means.append(total / np.maximum(part * self.size, 1))
        self._parts.append(part)

    def result(self) -> tuple[Array, Array]:
        """Means of the rates less a constant, in the channel's own unit, and the share of each part that is there."""
        return np.concatenate(self._means), np.concatenate(self._parts)
