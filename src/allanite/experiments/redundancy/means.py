# SPDX-License-Identifier: BSD-3-Clause
"""A record of several sensors as means over windows of equal length."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import BLOCK, Recording

__all__ = ["WindowMeans", "window_means"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowMeans:
    """Means of n sensors over windows.

    Attributes
    ----------
    size : int [samples]
    dt : float [s]
        Length of a window.
    mean : ndarray, shape (windows, n) [SI]
        NaN where a sensor has no sample.
    part : ndarray, shape (windows, n)
        Usable samples over all, 0 to 1.
    frozen : ndarray of bool, shape (windows, n)
        All samples of the window are the same number.
    """

    size: int
    dt: float
    mean: Array
    part: Array
    frozen: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.mean)

    def merged(self, count: int) -> WindowMeans:
        """Windows `count` times as long; what is left over at the end is dropped."""
        rows = len(self) // count
        shape = (rows, count, self.mean.shape[1])
        part = self.part[: rows * count].reshape(shape)
        total = (np.nan_to_num(self.mean[: rows * count]).reshape(shape) * part).sum(axis=1)
        whole = part.sum(axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = total / whole
        return WindowMeans(
            size=self.size * count,
            dt=self.dt * count,
            mean=mean,
            part=whole / count,
            frozen=np.asarray(self.frozen[: rows * count].reshape(shape).all(axis=1)),
        )


def window_means(recording: Recording, channels: tuple[str, ...], size: int) -> WindowMeans:
    """Means over windows of `size` samples; an incomplete window at the end is dropped."""
    columns = [_of_channel(recording, name, size) for name in channels]
    mean, part, frozen = (np.stack(parts, axis=1) for parts in zip(*columns, strict=True))
    return WindowMeans(size=size, dt=size / recording.rate, mean=mean, part=part, frozen=frozen)


def _of_channel(recording: Recording, name: str, size: int) -> tuple[Array, Array, NDArray[np.bool_]]:
    windows = recording.n_samples // size
    mean, part, frozen = np.full(windows, np.nan), np.zeros(windows), np.zeros(windows, dtype=np.bool_)
    for start, samples in recording.blocks(name, size * max(BLOCK // size, 1)):
        rows = len(samples) // size
        if rows:
            y = samples[: rows * size].reshape(rows, size)
            there = ~np.isnan(y)
            count = there.sum(axis=1)
            total = np.where(there, y, 0.0).sum(axis=1)
            at = slice(start // size, start // size + rows)
            mean[at] = np.where(count > 0, total / np.maximum(count, 1), np.nan)
            part[at] = count / size
            frozen[at] = (y == y[:, :1]).all(axis=1) & (size > 1)
    channel = recording[name]
    return (mean + recording.origin(name)) * channel.scale, part, frozen
