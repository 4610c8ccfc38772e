# SPDX-License-Identifier: BSD-3-Clause
"""The overlapping Allan variance window by window of a record, and the exact covariance of all windows and lags.

A term d_m(i) of the sum belongs to the window of time in which its centre i + m lies, so that every term belongs to
one window, and the mean over windows, weighed by their terms, is the variance of the whole record. Windows are not
independent: a term reaches m samples to both sides of its centre. As in `covariance`,

    Cov(v_w(m1), v_v(m2)) = 2/(M_w M_v) sum_{i in w} sum_{j in v} r12(j - i)^2,                                     (1)

and a sum over a rectangle of positions is four values of the second sum of r12^2,

    H(x) = sum_k r12(k)^2 max(0, x - k),
    sum_{i in [a, b)} sum_{j in [c, d)} = H(d - a) - H(d - b) - H(c - a) + H(c - b),                                (2)

so that all pairs of windows of two lags cost a table of some hundred nodes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, Ramp, TermType
from allanite.noise.allan.covariance import cross_covariance, distance_nodes, in_samples
from allanite.noise.allan.statistics import STATISTICS, Phase
from allanite.recording.sample_columns import let_go

__all__ = ["AllanCells", "cell_covariance", "cells_of"]

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
Spans = NDArray[np.int64]

#: Starts that are summed before the pages of a phase in a file are given back.
_AT_ONCE = 1 << 20


@dataclass(frozen=True, slots=True, kw_only=True)
class AllanCells:
    """Allan variances of windows of time at several lags: one cell for each, lag after lag.

    Attributes
    ----------
    lags : ndarray of int64, shape (n_lags,)
    row : ndarray of int64, shape (n_cells,)
        Position of the cell's lag in `lags`.
    start, stop : ndarray of int64, shape (n_cells,) [samples]
        The window of time, half-open.
    first, last : ndarray of int64, shape (n_cells,)
        Its starts of terms lie in [first, last).
    count : ndarray of int64, shape (n_cells,)
        Terms in the sum; fewer than last - first where samples are missing.
    variance : ndarray, shape (n_cells,)
        In the square of the channel's own unit.
    """

    lags: Whole
    row: Whole
    start: Whole
    stop: Whole
    first: Whole
    last: Whole
    count: Whole
    variance: Array

    def __post_init__(self) -> None:
        for name in self.__slots__:
            getattr(self, name).flags.writeable = False

    def __len__(self) -> int:
        return len(self.row)

    @property
    def lag(self) -> Whole:
        """Lag of each cell, shape (n_cells,)."""
        return self.lags[self.row]

    @property
    def whole(self) -> Array:
        """Variance of the whole record at each lag, shape (n_lags,)."""
        terms = np.bincount(self.row, self.count, len(self.lags))
        return np.asarray(np.bincount(self.row, self.count * self.variance, len(self.lags)) / terms)

    def where(self, keep: NDArray[np.bool_]) -> AllanCells:
        """The cells that are kept, shape (n_cells,), and their lags."""
        rows, row = np.unique(self.row[keep], return_inverse=True)
        parts = {name: getattr(self, name)[keep] for name in self.__slots__ if name not in ("lags", "row")}
        return AllanCells(lags=self.lags[rows], row=row.astype(np.int64), **parts)


def cells_of(phase: Phase, lags: Sequence[int], windows: Sequence[int]) -> AllanCells:
    """Allan variance of every window of time at every lag; windows without a term are left out.

    Parameters
    ----------
    phase : Phase
    lags : sequence of int [samples]
    windows : sequence of int [samples]
        Length of the windows at each lag, not below it.
    """
    parts = [_cells_of_lag(phase, int(m), int(size)) for m, size in zip(lags, windows, strict=True)]
    names = ("start", "stop", "first", "last", "count", "variance")
    joined = {name: np.concatenate([part[name] for part in parts]) for name in names}
    row = np.repeat(np.arange(len(parts)), [len(part["start"]) for part in parts])
    return AllanCells(lags=np.array(lags, dtype=np.int64), row=row, **joined)


def _cells_of_lag(phase: Phase, m: int, length: int) -> dict[str, NDArray[np.generic]]:
    n = phase.n_samples
    runs = phase.starts(STATISTICS["oadev"], m)
    edges = np.arange(0, n + length, length, dtype=np.int64)
    edges[-1] = n
    borders = np.clip(edges - m, 0, None)  # of the starts whose centres lie in the windows
    below = _below(runs, borders)
    count = np.diff(below)
    sums = _sums(phase.x, m, runs, length, len(count))
    there = count > 0
    first, last = _extents(runs, borders)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = sums / (2.0 * m * m * count)
    return {
        "start": edges[:-1][there],
        "stop": edges[1:][there],
        "first": first[there],
        "last": last[there],
        "count": count[there],
        "variance": variance[there],
    }


def _sums(x: Array, m: int, runs: Spans, length: int, windows: int) -> Array:
    """Sum of squares of each window: the kernel's blocks, shifted by the lag so that they follow the centres."""
    offset = length - m
    head, tail = _within(runs, 0, offset), _within(runs, offset, len(x)) - offset
    sums = np.zeros(windows)
    lags = np.array([m], dtype=np.int64)
    for part, shift, block, into in ((head, 0, max(offset, 1), 0), (tail, offset, length, 1)):
        if len(part):
            blocks = min(int(part[-1, 1] - 1) // block + 1, windows - into)
            ends = np.array([0, len(part)], dtype=np.int64)
            several = max(_AT_ONCE // block, 1)
            for k in range(0, blocks, several):
                stop = min(k + several, blocks)
                squares = _kernels.difference_squares(x[shift:], 2, lags, part, ends, k, stop, block)
                sums[into + k : into + stop] = squares[:, 0]
                let_go(x, len(x))
    return sums


def _within(runs: Spans, start: int, stop: int) -> Spans:
    cut = np.clip(runs, start, stop)
    return np.ascontiguousarray(cut[cut[:, 1] > cut[:, 0]])


def _below(runs: Spans, at: Whole) -> Whole:
    """Positions of `runs` below each of `at`."""
    if len(runs) == 0:
        return np.zeros(len(at), dtype=np.int64)
    before = np.concatenate(([0], np.cumsum(runs[:, 1] - runs[:, 0])))
    k = np.searchsorted(runs[:, 0], at, side="right")
    inside = np.where(k > 0, np.minimum(at, runs[np.maximum(k - 1, 0), 1]) - runs[np.maximum(k - 1, 0), 0], 0)
    return np.asarray(np.where(k > 0, before[np.maximum(k - 1, 0)] + inside, 0), dtype=np.int64)


def _extents(runs: Spans, borders: Whole) -> tuple[Whole, Whole]:
    """First and one beyond the last position of `runs` between each pair of borders."""
    if len(runs) == 0:
        return borders[:-1], borders[:-1]
    next_ = np.minimum(np.searchsorted(runs[:, 1], borders[:-1], side="right"), len(runs) - 1)
    last = np.maximum(np.searchsorted(runs[:, 0], borders[1:], side="left") - 1, 0)
    return np.maximum(runs[next_, 0], borders[:-1]), np.minimum(runs[last, 1], borders[1:])


# -- covariance ----------------------------------------------------------------------------------------------


def cell_covariance(cells: AllanCells, model: NoiseModel, n_samples: int, dt: float, sampling: str) -> Array:
    """Covariance of all cells under a model, equations (1) and (2), shape (n_cells, n_cells) [SI^4].

    Where samples are missing within a window, its terms are taken as spread evenly from its first to its last, and
    as close to one another as without the gaps: the variance comes out too large rather than too small (by a few
    per cent with a tenth of the samples missing at random).
    """
    terms = [in_samples(term, dt) for term in model.terms]
    out = np.empty((len(cells), len(cells)))
    members = [np.flatnonzero(cells.row == row) for row in range(len(cells.lags))]
    for a, first in enumerate(members):
        for b in range(a, len(members)):
            second = members[b]
            block = _block(cells, first, second, terms, n_samples, sampling)
            out[np.ix_(first, second)] = block
            out[np.ix_(second, first)] = block.T
    return out


def _block(
    cells: AllanCells, first: Whole, second: Whole, terms: Sequence[TermType], n_samples: int, sampling: str
) -> Array:
    m1, m2 = int(cells.lag[first[0]]), int(cells.lag[second[0]])
    k, weight = distance_nodes(m1, m2, n_samples)
    lengths, offsets = np.array([[m1, m2]], dtype=np.float64), np.array([0, len(k)])
    r = sum((cross_covariance(t, lengths, offsets, k, sampling) for t in terms), 0 * k)
    slope = sum(t.R**2 for t in terms if isinstance(t, Ramp))
    order = np.argsort(k, kind="stable")
    k, f = k[order], (weight * (2 * r * r + 2 * slope * m1 * m2 * r))[order]
    total, moment = np.concatenate(([0.0], np.cumsum(f))), np.concatenate(([0.0], np.cumsum(f * k)))

    def second_sum(x: Whole) -> Array:
        below = np.searchsorted(k, x)
        return np.asarray(x * total[below] - moment[below])

    a, b = cells.first[first][:, None], cells.last[first][:, None]
    c, d = cells.first[second], cells.last[second]
    whole = second_sum(d - a) - second_sum(d - b) - second_sum(c - a) + second_sum(c - b)
    one, two = (cells.count[part].astype(np.float64) for part in (first, second))
    share = np.sqrt(np.outer(one / (b - a)[:, 0], two / (d - c)))
    return np.asarray(whole * share / np.outer(one, two))
