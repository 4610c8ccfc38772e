# SPDX-License-Identifier: BSD-3-Clause
"""Stamps that scatter about an even grid by less than half an interval, with pauses of any length between them.

Each stamp then lies nearest to its own place, once the phase of the grid is known: the phase is a mean over the
neighbors, never across a pause, which begins a phase of its own. Every step is vectorized over a block.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.quantities.sums import sum_of_products

__all__ = ["MARGIN", "between", "common_slope", "holds", "interval_between_pauses", "steps_of"]

_Floats = NDArray[np.float64]
_Ints = NDArray[np.int64]

#: A difference of more intervals begins a new phase; so does a fall by as many. (Two stamps that were swapped do not.)
_PAUSE = 2.5
#: Stamps on either side that tell the phase.
_WINDOW = 48
#: Rounds in which the phase is told from the places found, after the first, which is told from the stamps alone.
_ROUNDS = 2
#: A stamp out of place is forgiven if one of the next so many is back.
_MAKE_UP = 4
#: Next to a pause a stamp may lie so many intervals from its place: half of one, and the error of the phase.
_ASTRAY = 0.7
#: Shares of the stamps that may fall back, for a moment (4.6 % of those that scatter by a quarter of an interval), and
#: for good (near pauses the phase is less well known).
_FALLS, _LASTING = 0.06, 0.0003
#: Stamps before and behind a block on which its places depend.
MARGIN = (_ROUNDS + 2) * (_WINDOW + _MAKE_UP)

#: Rms distance from a line, in intervals, beyond which stretches between pauses have lost samples of their own.
_STRAIGHT = 0.4
#: First reach of the search for an interval, relative; sizes of the pieces by which it is narrowed.
_REACH, _PIECES, _CANDIDATES = 0.08, (32, 256, 2048), 41
_MOST = 1 << 15  # stamps that are looked at
#: Rounds of least squares about places that are known, and how far the interval may still move.
_SETTLING, _NEARBY = 3, 0.05
#: Mean square distance from their places, in intervals, beyond which lost samples were not counted.
_REST = 0.08


def steps_of(stamps: _Floats, interval: float) -> _Floats:
    """By how many intervals each difference is longer than one: whole numbers, but for pauses.

    Parameters
    ----------
    stamps : ndarray, shape (n,) [s]
    interval : float [s]

    Returns
    -------
    ndarray, shape (n - 1,)
        0 where the next sample follows, also where only its stamp is out of place.
    """
    return _made_up(_level(stamps, interval))


def holds(stretches: list[_Floats], interval: float) -> bool:
    """True if the stamps scatter by less than half an interval, but for a few: they lie on a grid.

    Else they fall back: each that lies nearest to a place that an earlier one has is a fall of their level, for a
    moment if its stamp is out of place, for good if no grid of this interval holds.
    """
    levels = [_level(stretch, interval) for stretch in stretches]
    size = sum(map(len, levels))
    falls = sum(np.count_nonzero(np.diff(level) < -0.5) for level in levels)
    lasting = sum(np.count_nonzero(_made_up(level) < 0.0) for level in levels)
    return bool(falls <= 2 + _FALLS * size and lasting <= 2 + _LASTING * size)


def _level(stamps: _Floats, interval: float) -> _Floats:
    """Place of each stamp less its number: what stamps freed of their scatter would show."""
    at = stamps / interval
    count = np.arange(len(at), dtype=np.float64)
    segment, low, high = _windows(at)
    turning = np.exp(2j * np.pi * (at % 1.0))
    phase = _unwrapped(np.angle(_mean(turning, low, high)) / (2 * np.pi), segment)
    for _ in range(_ROUNDS):
        step = _made_up(np.round(at - phase) - count)
        level = np.concatenate(([0.0], np.cumsum(step)))
        phase = _mean(at - count - level, low, high)
    place = _with_neighbors(np.round(at - phase), at - phase, segment)
    return np.asarray(place + phase - count)


def _windows(at: _Floats) -> tuple[_Ints, _Ints, _Ints]:
    """Of each stamp: the number of its stretch between pauses, and the window in it."""
    pauses = np.flatnonzero(np.abs(np.diff(at)) > _PAUSE) + 1
    ends = np.concatenate(([0], pauses, [len(at)]))
    segment = np.repeat(np.arange(len(ends) - 1), np.diff(ends))
    k = np.arange(len(at))
    low = np.maximum(k - _WINDOW, ends[segment])
    high = np.minimum(k + _WINDOW + 1, ends[segment + 1])
    return segment, low, high


def _mean(values: NDArray[Any], low: _Ints, high: _Ints) -> NDArray[Any]:
    total = np.concatenate(([0], np.cumsum(values)))
    return np.asarray((total[high] - total[low]) / (high - low))


def _unwrapped(phase: _Floats, segment: _Ints) -> _Floats:
    """Phases that go on past half an interval, within each stretch."""
    turn = -np.round(np.diff(phase))
    turn[np.flatnonzero(np.diff(segment))] = 0.0
    turns = np.concatenate(([0.0], np.cumsum(turn)))
    first = np.searchsorted(segment, np.arange(segment[-1] + 1))
    return phase + turns - turns[first][segment]


def _made_up(level: _Floats) -> _Floats:
    """Steps of a level, those left out that one of the next few stamps takes back."""
    step = np.diff(level)
    step[np.abs(step) <= 0.5] = 0.0
    odd = np.flatnonzero(step)
    for j in range(1, _MAKE_UP + 1):
        k = odd[odd + 1 + j < len(level)]
        k = k[np.abs(level[k + 1 + j] - level[k]) <= 0.5]
        for i in range(j + 1):
            step[k + i] = 0.0
    return step


def _with_neighbors(place: _Floats, at: _Floats, segment: _Ints) -> _Floats:
    """Places of the stamps next to a pause, where the phase is told from one side and no step is taken back.

    A step among them counts only if some stamp is else far from its place.
    """
    place = place.copy()
    ends = np.flatnonzero(np.diff(segment, prepend=-1, append=segment[-1] + 1))
    for first, last, way in ((ends[:-1], ends[1:] - 1, 1), (ends[1:] - 1, ends[:-1], -1)):
        for j in range(_MAKE_UP, 0, -1):  # from the inside to the end
            k = first + way * (j - 1)
            inner = k + way
            k = k[(last - inner) * way >= 0]
            wanted = place[k + way] - way
            near = np.abs(at[k] - wanted) <= _ASTRAY
            place[k[near]] = wanted[near]
    return place


# -- the interval -------------------------------------------------------------------------------------------


def interval_between_pauses(stretches: list[_Floats], guess: float, *, lossy: bool = False) -> float:
    """The sample interval, told from what lies between pauses alone.

    Parameters
    ----------
    stretches : list of ndarray [s]
        Stamps that follow each other.
    guess : float [s]
        The median of the differences.
    lossy : bool
        No stretch is free of lost samples, for certain.

    Returns
    -------
    float [s]
        Least squares over stretches without lost samples; where these are few, the interval at which all stamps
        turn together (a periodogram, summed over pieces without regard to their phases).
    """
    differences = np.concatenate([np.diff(stretch) for stretch in stretches])
    for _ in range(3):  # lost samples draw a median up
        ordinary = differences[(differences > 0) & (differences < 1.5 * guess)]
        guess = float(np.median(ordinary)) if len(ordinary) else guess
    parts = between(stretches, -_PAUSE * guess, _PAUSE * guess)
    straight = [part for part in parts if len(part) > 3 and _distance(part) < _STRAIGHT * guess]
    interval, rest = guess, np.inf
    if not lossy and sum(map(len, straight)) > 0.5 * sum(map(len, parts)):
        interval, rest = _settled(stretches, common_slope(straight))
    if rest > _REST * sum(map(len, stretches)):
        interval = min(
            (interval, rest), _settled(stretches, _coherent(parts, guess)), key=lambda each: each[1]
        )[0]
    return interval


def _settled(stretches: list[_Floats], guess: float) -> tuple[float, float]:
    """The interval by least squares, the samples that are missing between two pauses counted, and what rests, squared.

    Each missing sample bends a slope that does not count it; what is left shows that it was not counted.
    """
    first, rest = guess, np.inf
    for _ in range(_SETTLING):
        rise = square = total = 0.0
        for stretch in stretches:
            step = steps_of(stretch, guess)
            place = np.arange(len(stretch)) + np.concatenate(([0.0], np.cumsum(np.round(step))))
            ends = np.concatenate(([0], np.flatnonzero(np.abs(step) > _PAUSE - 1.0) + 1, [len(stretch)]))
            for a, b in zip(ends[:-1], ends[1:], strict=True):
                x = place[a:b] - place[a:b].mean()
                y = stretch[a:b] - stretch[a:b].mean() - guess * x
                rise += sum_of_products(x, y)
                square += sum_of_products(x, x)
                total += sum_of_products(y, y)
        if not square > 0:
            break
        change = rise / square
        if not abs((guess + change) / first - 1.0) < _NEARBY:  # places that the stamps do not tell
            return first, np.inf
        rest = max(total - rise * change, 0.0) / guess / guess
        guess += change
    return guess, float(rest)


def between(stretches: list[_Floats], shortest: float, longest: float) -> list[_Floats]:
    """Parts of stretches in which every difference lies between two bounds [s]."""
    parts = []
    for stretch in stretches:
        differences = np.diff(stretch)
        parts += np.split(stretch, np.flatnonzero((differences < shortest) | (differences > longest)) + 1)
    return parts


def common_slope(parts: list[_Floats]) -> float:
    """Least-squares slope of stamps against their numbers, each part with an intercept of its own."""
    lines = [_line(part) for part in parts]
    return sum(rise for rise, _ in lines) / sum(square for _, square in lines)


def _line(stamps: _Floats) -> tuple[float, float]:
    """Sums whose ratio is the least-squares slope."""
    k: _Floats = np.arange(len(stamps), dtype=np.float64) - (len(stamps) - 1) / 2
    return sum_of_products(k, stamps), sum_of_products(k, k)


def _distance(stamps: _Floats) -> float:
    """Rms distance from a line."""
    rise, square = _line(stamps)
    k = np.arange(len(stamps)) - (len(stamps) - 1) / 2
    return float((stamps - stamps.mean() - rise / square * k).std())


def _coherent(parts: list[_Floats], guess: float) -> float:
    best, reach = guess, _REACH
    for size in _PIECES:
        pieces = [part[a : a + size] for part in parts for a in range(0, len(part), size)]
        starts = np.cumsum([0, *map(len, pieces)])[:-1]
        starts = starts[: max(int(np.searchsorted(starts, _MOST)), 1)]
        stamps = np.concatenate([piece - piece[0] for piece in pieces[: len(starts)]])
        frequencies = np.linspace(1 / (1 + reach), 1 / (1 - reach), _CANDIDATES) / best
        best = float(1 / frequencies[int(np.argmax(_power(stamps, starts, frequencies)))])
        reach /= 8.0
    return best


def _power(stamps: _Floats, starts: _Ints, frequencies: _Floats) -> list[float]:
    """Of the pieces together at each of some frequencies with even steps [1/s].

    From one to the next each stamp turns by the same angle: a product, where an exponential takes ten times as long.
    """
    turning, turn = (_phasors(stamps * f) for f in (frequencies[0], frequencies[1] - frequencies[0]))
    power = []
    for _ in frequencies:
        power.append(float((np.abs(np.add.reduceat(turning, starts)) ** 2).sum()))
        turning *= turn
    return power


def _phasors(turns: _Floats) -> NDArray[np.complex128]:
    return np.asarray(
        np.exp(2j * np.pi * (turns - np.floor(turns)))
    )  # as turns % 1, in a quarter of its time
