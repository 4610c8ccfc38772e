# SPDX-License-Identifier: BSD-3-Clause
"""Records one behind another in a stream of bytes that may be torn: which marks are records?

A mark is a place that looks like the beginning of a record, and its record tells where the next one must begin. Marks
also occur inside of records. A record counts only if another one begins where it ends, or the stream does; what lies
between records is passed over and counted.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = ["RecordChain", "follow_chain"]

_Ints = NDArray[np.int64]
_Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordChain:
    """What a window of the stream holds.

    Attributes
    ----------
    keep : ndarray of bool, one per mark
        True for the marks that are records.
    end : int [bytes]
        Where the record behind the last one begins.
    skipped : int [bytes]
        What belongs to no record.
    breaks : int
        In how many places.
    """

    keep: _Bools
    end: int
    skipped: int
    breaks: int


def follow_chain(marks: _Ints, follows: _Ints, *, reach: int, size: int, last: bool) -> RecordChain:
    """The records among the marks of a window, whose first byte begins a record or is to be passed over.

    Parameters
    ----------
    marks : ndarray of int64, shape (n,), rising [bytes]
    follows : ndarray of int64, shape (n,) [bytes]
        Where the record of each mark ends.
    reach : int [bytes]
        Records that begin here or later are left to the next window.
    size : int [bytes]
        Of the window; marks beyond `reach` must be known up to here.
    last : bool
        The stream ends with the window.
    """
    # The mark at which the record behind each one begins; nearly always it is the next mark.
    link = np.arange(1, len(marks) + 1)
    good = np.zeros(len(marks), dtype=bool)
    good[:-1] = follows[:-1] == marks[1:]
    rare = np.flatnonzero(~good)
    link[rare] = np.searchsorted(marks, follows[rare])
    inside = rare[link[rare] < len(marks)]
    good[inside] = marks[link[inside]] == follows[inside]
    if last:
        good[follows == size] = True
    keep, end, skipped, breaks = _walk(marks, follows, good, link, rare, min(reach, size))
    return RecordChain(keep=keep, end=end, skipped=skipped, breaks=breaks)


def _walk(
    marks: _Ints, follows: _Ints, good: _Bools, link: _Ints, rare: _Ints, reach: int
) -> tuple[_Bools, int, int, int]:
    """Along neighbours at once; what is no record is passed over to the next sound one."""
    keep = np.zeros(len(marks), dtype=bool)
    sound = np.flatnonzero(good)
    stop = int(np.searchsorted(marks, reach))
    i, at, skipped, breaks = 0, 0, 0, 0
    while at < reach:
        if i >= stop or marks[i] != at or not good[i]:
            k = int(np.searchsorted(sound, np.searchsorted(marks, at)))
            i = int(sound[k]) if k < len(sound) else stop
            new = int(marks[i]) if i < stop else reach
            skipped, breaks, at = skipped + new - at, breaks + 1, new
            continue
        turn = min(int(rare[np.searchsorted(rare, i)]), stop - 1)
        if good[turn]:
            keep[i : turn + 1] = True
            at, i = int(follows[turn]), int(link[turn])
        else:
            keep[i:turn] = True
            at, i = int(marks[turn]), turn
    return keep, at, skipped, breaks
