# SPDX-License-Identifier: BSD-3-Clause
"""The lowest and highest values of a run while it grows, in as many blocks as a screen shows, however long it is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from allanite.files.store import Batch

__all__ = ["GrowingEnvelope"]

Array = NDArray[np.float64]


class GrowingEnvelope:
    """Blocks of equal length; when there are too many, two become one.

    Parameters
    ----------
    channels : int
    rate : float [Hz]
    most : int
        Blocks, even.
    """

    def __init__(self, channels: int, rate: float, *, most: int = 1024) -> None:
        self.rate, self.size, self._most = rate, 1, most
        self._first: int | None = None  # number of the first sample of all
        self.count = 0  # blocks that were reached
        self._low = np.full((channels, most), np.nan)
        self._high = np.full((channels, most), np.nan)

    @property
    def low(self) -> Array:
        """Shape (channels, count): NaN where nothing is in a block."""
        return self._low[:, : self.count]

    @property
    def high(self) -> Array:
        """Shape (channels, count)."""
        return self._high[:, : self.count]

    def take(self, batches: Sequence[Batch]) -> None:
        """The next batches of the run."""
        for batch in batches:
            self.add(batch.counter, batch.values)

    def add(self, counter: NDArray[np.int64], values: Array) -> None:
        """Samples, shape (n, channels), and their numbers, which rise."""
        if not len(counter):
            return
        if self._first is None:
            self._first = int(counter[0])
        places = counter - self._first
        while int(places[-1]) // self.size >= self._most:
            self._halve()
        blocks = places // self.size
        starts = np.flatnonzero(np.diff(blocks, prepend=-1))
        at = blocks[starts]
        low, high = (least.reduceat(values, starts, axis=0).T for least in (np.fmin, np.fmax))
        self._low[:, at] = np.fmin(self._low[:, at], low)
        self._high[:, at] = np.fmax(self._high[:, at], high)
        self.count = int(at[-1]) + 1

    def _halve(self) -> None:
        self.size *= 2
        half = self._most // 2
        for ends, least in ((self._low, np.fmin), (self._high, np.fmax)):
            ends[:, :half] = least(ends[:, 0::2], ends[:, 1::2])
            ends[:, half:] = np.nan
        self.count = -(-self.count // 2)

    def to_json(self) -> dict[str, Any]:
        """Plain data; null where nothing is in a block."""
        return {
            "rate": self.rate, "first": self._first or 0, "size": self.size, "count": self.count,
            "low": _plain(self.low), "high": _plain(self.high),
        }  # fmt: skip


def _plain(rows: Array) -> list[list[float | None]]:
    return [[None if v != v else v for v in row] for row in rows.tolist()]
