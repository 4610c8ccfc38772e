# SPDX-License-Identifier: BSD-3-Clause
"""A record of several axes as cells of a twentieth of a second: what rest is judged by, read block by block."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import BLOCK, Recording

__all__ = ["ChannelCells", "cut", "runs"]

Array = NDArray[np.float64]
Counts = NDArray[np.integer[Any]]
Mask = NDArray[np.bool_]

#: A cell lasts so long [s], but no less than one sample; a record has no more cells than this.
CELL, MOST = 0.05, 2_000_000
#: Differences between samples below this share of their size are rounding.
ROUNDING = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelCells:
    """Cells of some channels, in SI (counts where a channel has none), less the level of each channel.

    Attributes
    ----------
    size : int
        Samples in a cell.
    dt : float [s]
        Sample interval.
    total : ndarray, shape (n, axes)
        Sum of the samples that are there.
    count : ndarray of int, shape (n, axes)
        Their number.
    square : ndarray, shape (n, axes)
        Sum of the squared differences of neighbouring samples, that from the cell before included.
    steps, equal : ndarray of int, shape (n, axes)
        Differences of neighbouring samples, and those that are zero.
    step : ndarray, shape (axes,)
        Smallest difference that is not rounding: of counted samples, one count.
    largest : ndarray, shape (axes,)
        Largest absolute sample, the level included.
    """

    size: int
    dt: float
    total: Array
    count: Counts
    square: Array
    steps: Counts
    equal: Counts
    step: Array
    largest: Array

    @property
    def n(self) -> int:
        """Number of cells."""
        return len(self.total)

    @property
    def length(self) -> float:
        """Length of a cell [s]."""
        return self.size * self.dt

    @property
    def whole(self) -> Mask:
        """Cells with a sample in every axis, shape (n,): nothing turns in the time of a cell."""
        return np.asarray((self.count > 0).all(axis=1))

    def mean(self, start: int = 0, stop: int | None = None) -> Array:
        """Mean of each of the cells [start, stop), shape (stop - start, axes); NaN without samples."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.total[start:stop] / self.count[start:stop])


def cut(recording: Recording, channels: Sequence[str], advance: Callable[[float], None]) -> ChannelCells:
    """The cells of some channels; samples that do not fill a cell at the end are left out."""
    size = max(round(CELL * recording.rate), -(-recording.n_samples // MOST), 1)
    shape, small = (recording.n_samples // size, len(channels)), np.min_scalar_type(size)
    total, square = np.empty(shape), np.empty(shape)
    count, steps, equal = (np.empty(shape, dtype=small) for _ in range(3))
    step, largest = np.empty(len(channels)), np.empty(len(channels))
    for i, name in enumerate(channels):
        columns = tuple(table[:, i] for table in (total, count, square, steps, equal))
        step[i], largest[i] = _fill(recording, name, size, columns)
        advance((i + 1) / len(channels))
    return ChannelCells(
        size=size,
        dt=recording.dt,
        total=total,
        count=count,
        square=square,
        steps=steps,
        equal=equal,
        step=step,
        largest=largest,
    )


def _fill(recording: Recording, name: str, size: int, columns: Sequence[NDArray[Any]]) -> tuple[float, float]:
    """Write sums, counts, squared differences, differences, zero ones of them; smallest difference, largest sample."""
    channel, origin = recording[name], recording.origin(name)
    scale = abs(channel.scale)
    factors = (np.sign(channel.scale) * scale, 1, scale**2, 1, 1)
    level = last = np.nan
    smallest, largest = np.inf, 0.0
    for start, block in recording.blocks(name, size * max(BLOCK // size, 1)):
        there = ~np.isnan(block)
        if np.isnan(level) and there.any():
            level = float(block[there][0])
        largest = max(largest, float(np.abs(block[there] + origin).max(initial=0.0)))
        difference = np.diff(block, prepend=last)
        last = float(block[-1])
        apart = np.abs(difference[np.abs(difference) > ROUNDING * largest])
        smallest = min(smallest, float(apart.min(initial=np.inf)))
        first, rows = start // size, len(block) // size
        made = _chunk(block[: rows * size], difference[: rows * size], level, rows)
        for column, values, factor in zip(columns, made, factors, strict=True):
            column[first : first + rows] = values * factor
    return smallest * scale, largest * scale


def _chunk(block: Array, difference: Array, level: float, rows: int) -> tuple[Array, ...]:
    def summed(values: Array | Mask) -> Array:
        return np.asarray(values.reshape(rows, -1).sum(axis=1), dtype=np.float64)

    there, known = ~np.isnan(block), ~np.isnan(difference)
    total = np.where(there, block - level, 0.0)
    return (
        summed(total),
        summed(there),
        summed(np.where(known, difference, 0.0) ** 2),
        summed(known),
        summed(difference == 0.0),
    )


def runs(mask: Mask) -> list[tuple[int, int]]:
    """Runs [start, stop) of true cells."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8))).reshape(-1, 2)
    return [(int(a), int(b)) for a, b in edges]
