# SPDX-License-Identifier: BSD-3-Clause
"""Stamps that a host wrote late: no sample was taken later than the ones after it tell.

A host that stalls stamps what has piled up in one go; each of those stamps is late by an interval less than the one
before. A stamp less the interval times its number is nowhere above what comes behind it by more than the scatter, but
for those: they are brought down to it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.filled_stamps import BLOCK, Filled
from allanite.lazy_dataclasses import dataclass

__all__ = ["REACH", "InTime", "brought_forward", "earliest", "off_grid", "usual_lateness"]

_Floats = NDArray[np.float64]

#: Samples among which one is in time.
REACH = 256
#: Intervals, beside the usual ones, by which a stamp is late.
_LATE = 0.5
#: Intervals by which the first of them is later than the one before.
_SUDDEN = 0.25
#: Share of the differences near one interval without which stamps come in bursts, and are in time at their end alone.
_ORDINARY = 0.2
#: Intervals between stamps in time over which their error does not count.
_NEAR = 64.0


def brought_forward(stamps: _Floats, interval: float, usual: float) -> tuple[_Floats, NDArray[np.bool_]]:
    """The stamps, late ones brought forward to what the ones after them tell, and which were late.

    Parameters
    ----------
    stamps : ndarray, shape (n,) [s]
    interval, usual : float [s]
        From sample to sample; `usual_lateness` of the record.
    """
    lateness = _lateness(stamps, interval)
    late, made_up = _late(lateness, interval, usual)
    late &= made_up
    return (np.where(late, stamps - lateness + usual, stamps), late) if late.any() else (stamps, late)


def earliest(stamps: _Floats, interval: float, usual: float) -> _Floats:
    """The time at which the stamps after a sample say that it was taken [s]: it steps up where samples are lost."""
    lateness = _lateness(stamps, interval)
    late, made_up = _late(lateness, interval, usual)
    return np.where(late & ~made_up, stamps, stamps - lateness)


def _late(lateness: _Floats, interval: float, usual: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    late = lateness > usual + _LATE * interval
    return late, _made_up(late, lateness / interval) if late.any() else late


@dataclass(frozen=True, slots=True)
class InTime:
    """Stamps as they are looked through, late ones brought forward."""

    stamps: Filled
    interval: float
    usual: float

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def block(self) -> int:
        """Intervals in a piece."""
        return self.stamps.block

    def blocks(self, before: int, after: int, most: int = BLOCK) -> Iterator[tuple[int, int, _Floats]]:
        """As `Filled.blocks`."""
        for first, count, block in self.stamps.blocks(before + REACH, after + REACH, most):
            brought, _ = brought_forward(block, self.interval, self.usual)
            lead = min(first, before + REACH) - min(first, before)
            yield first, count, brought[lead : lead + min(first, before) + count + 1 + after]


def _made_up(late: NDArray[np.bool_], lateness: _Floats) -> NDArray[np.bool_]:
    """Where stamps are late from one to the next, and in time again after about as many samples as they are late by.

    Else rows came twice, or the rate is another.
    """
    edges = np.flatnonzero(np.diff(late.astype(np.int8), prepend=0, append=0))
    starts, lengths = edges[::2], np.diff(edges)[::2]
    sudden = (starts == 0) | (lateness[starts] - lateness[starts - 1] > _SUDDEN)
    kept = sudden & (lengths <= 8.0 * np.maximum.reduceat(lateness, starts) + 8.0)
    result = np.zeros(len(late), dtype=bool)
    result[late] = np.repeat(kept, lengths)
    return result


def usual_lateness(stretches: list[_Floats], interval: float) -> float:
    """Median distance of stamps that follow each other evenly from the earliest behind them [s]."""
    lateness = [
        _lateness(s, interval)[:-1][np.abs(np.diff(s) - interval) < 0.5 * interval] for s in stretches
    ]
    ordinary = np.concatenate(lateness)
    few = len(ordinary) < _ORDINARY * sum(map(len, stretches))
    return 0.0 if few else float(np.median(ordinary))


def off_grid(stretches: list[_Floats], interval: float) -> float:
    """Rms distance of the differences from whole intervals, in intervals: 0.29 where there is no grid."""
    apart = np.concatenate([np.diff(stretch) for stretch in stretches]) / interval
    apart = apart[apart < _NEAR]
    return float(np.sqrt(np.mean((apart - np.round(apart)) ** 2))) if len(apart) else 1.0


def _lateness(stamps: _Floats, interval: float) -> _Floats:
    """How far above the lowest of the next ones each stamp is, less interval times number; never across a fall [s]."""
    fall = np.minimum(np.diff(stamps, prepend=stamps[0]), 0.0)
    level = stamps - interval * np.arange(len(stamps)) - np.cumsum(fall)
    lowest, reach = _without_early(level, 0.5 * interval), 1
    while reach < min(REACH, len(level)):
        lowest[:-reach] = np.minimum(lowest[:-reach], lowest[reach:])
        reach *= 2
    return np.asarray(level - lowest)


def _without_early(level: _Floats, bound: float) -> _Floats:
    """The level, each stamp raised that alone is below those around it: a row that was written twice, say."""
    before, middle, behind = level[1:-2], level[2:-1], level[3:]
    even = (np.abs(before - behind) < bound) & (np.abs(before - level[:-3]) < bound)
    early = even & (middle < np.minimum(before, behind) - bound)
    raised = level.copy()
    raised[2:-1][early] = before[early]
    return raised
