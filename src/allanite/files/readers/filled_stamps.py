# SPDX-License-Identifier: BSD-3-Clause
"""Time stamps as they are looked through: in blocks, again and again, the missing ones interpolated."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.lazy_dataclasses import dataclass

__all__ = ["BLOCK", "CACHED", "ArrayStamps", "Filled", "KeptStamps", "Stamps"]

_Floats = NDArray[np.float64]

BLOCK: Final = 1 << 20
#: Stamps of a pass that computes much of each: its intermediate results stay in the cache of a processor.
CACHED: Final = 1 << 17
_IN_MEMORY = 32 << 20  # stamps that are kept; more are read again in every pass


class Stamps(Protocol):
    """Time stamps read by position: seconds since the first one, NaN where a stamp is missing."""

    def __len__(self) -> int: ...

    def read(self, start: int, stop: int) -> _Floats:
        """Stamps [start, stop) in seconds since the first stamp."""
        ...


@dataclass(frozen=True, slots=True)
class ArrayStamps:
    """Stamps over an array of seconds."""

    seconds: _Floats

    def __len__(self) -> int:
        return len(self.seconds)

    def read(self, start: int, stop: int) -> _Floats:
        with np.errstate(invalid="ignore"):  # an infinite stamp is a missing one
            return np.asarray(self.seconds[start:stop] - self.seconds[0])


@dataclass(frozen=True, slots=True)
class KeptStamps:
    """Stamps that were read into memory, because they are looked through several times.

    Attributes
    ----------
    seconds : ndarray, shape (n,)
        Since the first one; NaN where missing. Not to be written into.
    """

    seconds: _Floats

    @classmethod
    def of(cls, stamps: Stamps) -> KeptStamps | None:
        """The stamps, or None if they are too many."""
        if isinstance(stamps, cls):
            return stamps
        if len(stamps) > _IN_MEMORY:
            return None
        seconds = np.empty(len(stamps))
        for start in range(0, len(stamps), BLOCK):
            seconds[start : start + BLOCK] = stamps.read(start, start + BLOCK)
        return cls(seconds)

    def __len__(self) -> int:
        return len(self.seconds)

    def read(self, start: int, stop: int) -> _Floats:
        return self.seconds[start:stop]

    def fall(self) -> bool:
        """True if a stamp is earlier than the one before."""
        parts = (self.seconds[max(a - 1, 0) : a + BLOCK] for a in range(0, len(self), BLOCK))
        return any(bool((part[1:] < part[:-1]).any()) for part in parts)


class Filled:
    """Stamps whose missing ones are interpolated, so that one empty cell does not end the analysis.

    They are looked through several times: what fits into memory is decoded once.
    """

    def __init__(self, stamps: Stamps) -> None:
        self._stamps = stamps
        self.block = BLOCK
        kept = KeptStamps.of(stamps)
        self._kept = None if kept is None else kept.seconds
        self._whole = self._kept is not None and bool(np.isfinite(self._kept).all())  # no stamp is missing

    def __len__(self) -> int:
        return len(self._stamps)

    def read(self, start: int, stop: int) -> _Floats:
        """Stamps [start, stop), as far as there are any; not to be written into.

        Raises
        ------
        DataQualityError
            Fewer than two stamps are there to interpolate between.
        """
        start, stop = max(start, 0), min(stop, len(self))
        if self._kept is not None:
            block = self._kept[start:stop]
        else:
            block = np.asarray(self._stamps.read(start, stop), dtype=np.float64)
        bad = None if self._whole else ~np.isfinite(block)
        if bad is None or not bad.any():
            return block
        good = np.flatnonzero(~bad)
        if len(good) < 2:
            raise DataQualityError(
                f"rows {start} to {stop}: the time column is empty; pass the rate instead (--rate)"
            )
        block = block.copy()
        at = np.flatnonzero(bad)
        block[at] = np.interp(at, good, block[good])
        # Ends: extrapolate with the mean interval of the block.
        with np.errstate(over="ignore", invalid="ignore"):  # stamps near the end of float64 are refused later
            mean = (block[good[-1]] - block[good[0]]) / (good[-1] - good[0])
            block[: good[0]] = block[good[0]] - mean * np.arange(good[0], 0, -1)
            block[good[-1] + 1 :] = block[good[-1]] + mean * np.arange(1, len(block) - good[-1])
        return block

    def blocks(self, before: int, after: int, most: int = BLOCK) -> Iterator[tuple[int, int, _Floats]]:
        """Pieces of the stamps: (first interval, number of intervals, stamps from first - before on)."""
        size = min(most, self.block)
        for start in range(0, len(self) - 1, size):
            count = min(size, len(self) - 1 - start)
            yield start, count, self.read(start - before, start + count + 1 + after)
