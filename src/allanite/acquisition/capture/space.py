# SPDX-License-Identifier: BSD-3-Clause
"""How much room a run needs on the disk, and how much there is."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from allanite.lazy_dataclasses import dataclass

__all__ = ["Space", "batch_seconds", "bytes_per_second", "space_of"]

#: What a batch costs besides its samples [bytes]: measured, one to twenty channels.
_OVERHEAD = 450
#: Bytes of a sample besides its values: counter, clock, flags.
_BESIDE = 17
#: A run is warned of when less than so many times its need is free.
_SAFE = 2.0
#: A run without a planned end is warned of when the disk lasts for less [s].
_LASTS = 86_400.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Space:
    """Room on the disk of a run.

    Attributes
    ----------
    needed : float or None [bytes]
        None: the run has no planned end.
    free : int [bytes]
    seconds : float [s]
        For how long the free room lasts.
    """

    needed: float | None
    free: int
    seconds: float

    @property
    def enough(self) -> bool:
        """Twice the need is free; without a planned end, room for a day."""
        return self.seconds >= _LASTS if self.needed is None else self.free >= _SAFE * self.needed

    @property
    def warning(self) -> str:
        """What is to be said of too little room; "" where there is enough."""
        if self.enough:
            return ""
        free, advice = _size(self.free), "make room, or record to another disk"
        if self.needed is None:
            return f"no end is planned, and {free} are free, enough for {self.seconds / 3600:.3g} h: {advice}"
        if self.free < self.needed:
            return f"the run needs {_size(self.needed)}, and {free} are free: it will end early; {advice}"
        return f"the run needs {_size(self.needed)}, and only {free} are free: {advice}"


def _size(count: float) -> str:
    return f"{count / 1e9:.3g} GB" if count >= 1e9 else f"{count / 1e6:.3g} MB"


def batch_seconds(rate: float) -> float:
    """Length of a batch [s]: all that a kill can lose. A second at low rates, where batches cost the more."""
    return 1.0 if rate <= 100 else 0.5


def bytes_per_second(rate: float, channels: int) -> float:
    """What a run writes."""
    return rate * (_BESIDE + 8 * channels) + _OVERHEAD / batch_seconds(rate)


def space_of(folder: str | os.PathLike[str], rate: float, channels: int, seconds: float | None) -> Space:
    """Room on the disk that holds a folder, which need not be there yet."""
    place = Path(folder).absolute()
    while not place.exists():
        place = place.parent
    free, each = shutil.disk_usage(place).free, bytes_per_second(rate, channels)
    return Space(needed=None if seconds is None else each * seconds, free=free, seconds=free / each)
