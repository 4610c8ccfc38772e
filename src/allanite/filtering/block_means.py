# SPDX-License-Identifier: BSD-3-Clause
"""A record as means over equal blocks, from its usable spans only: what a regression works on.

Means over blocks keep the information as long as the blocks are short against the dwells (the standard deviation of
an Earth rate from dwells of 30 s rises by 0.014 % with blocks of 1 s, by the square of the block) and against the
time after which slow noise rules. Where the dwells are long, a change of direction shows within the time that white
noise needs to fall to the slow noise: longer blocks would lose it, however short they are against the dwell.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import DataQualityError, InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, Quantisation, White
from allanite.recording.records import BLOCK, Recording

__all__ = ["BlockMeans", "block_means", "longest_block"]

Array = NDArray[np.float64]

#: Blocks in a dwell, and in the time that white noise rules. Each costs less than 0.1 % of the standard deviation:
#: 0.02 % for the first; 0.07 % for the second (noise with a corner of 10 s, dwells of 1800 s).
PER_DWELL, PER_REACH = 24, 10
#: Most blocks in a dwell, for noise without a white part.
MOST = 2400


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockMeans:
    """Means over the blocks of a record.

    Attributes
    ----------
    dt : float [s]
        Length of a block.
    mean : ndarray, shape (n,) [SI]
        Mean of the usable samples of a block; NaN where there are none.
    part : ndarray, shape (n,)
        Usable samples over all samples of a block, 0 to 1.
    time : ndarray, shape (n,) [s]
        Mean time of the usable samples since the beginning of the record; the middle of a block without any.
    span : ndarray of int64, shape (n,)
        Which span the samples come from; -1 where there are none.
    """

    dt: float
    mean: Array
    part: Array
    time: Array
    span: NDArray[np.int64]

    @property
    def size(self) -> int:
        """Number of blocks."""
        return len(self.mean)

    def of_spans(self, n_spans: int) -> tuple[Array, Array]:
        """Mean of each span (NaN without samples), and how many whole blocks its samples would fill."""
        used = self.span >= 0
        weight = np.asarray(np.bincount(self.span[used], self.part[used], n_spans), dtype=np.float64)
        total = np.bincount(self.span[used], (self.part * self.mean)[used], n_spans)
        with np.errstate(invalid="ignore"):
            return total / weight, weight


def block_means(recording: Recording, channel: str, size: int, spans: ArrayLike) -> BlockMeans:
    """Means over blocks of `size` samples.

    A block that touches two spans keeps the samples of the one with more of them, so that no block mixes two
    directions.

    Parameters
    ----------
    recording : Recording
    channel : str
    size : int
    spans : array_like, shape (n_spans, 2) [samples]
        Half-open, sorted, disjoint.

    Raises
    ------
    InputError
        A size below one, spans that overlap or are not sorted, a channel of angles.
    DataQualityError
        A record without samples.
    """
    facts = recording[channel]
    if facts.kind.integrated:
        raise InputError(
            f"channel {channel!r} holds {facts.kind.value}s, the running sum; give the rates instead"
        )
    edges = np.asarray(spans, dtype=np.int64).reshape(-1, 2)
    if size < 1 or (np.diff(edges.ravel()) < 0).any():
        raise InputError("blocks need at least one sample, and spans must be sorted and disjoint")
    if not recording.n_samples:
        raise DataQualityError(f"channel {channel!r} has no samples: there is nothing to take means of")
    parts = [
        _chunk(samples, start, size, edges)
        for start, samples in recording.blocks(channel, size * max(BLOCK // size, 1))
    ]
    mean, part, time, span = (np.concatenate(column) for column in zip(*parts, strict=True))
    origin = recording.origin(channel)
    return BlockMeans(
        dt=size / recording.rate,
        mean=(mean + origin) * facts.scale,
        part=part,
        time=time / recording.rate,
        span=span,
    )


def _chunk(
    samples: Array, start: int, size: int, edges: NDArray[np.int64]
) -> tuple[Array, Array, Array, NDArray[np.int64]]:
    """Means, usable parts, times [samples] and spans of the blocks that begin at sample `start`."""
    n_blocks = -(-len(samples) // size)
    position: NDArray[np.int64] = np.arange(start, start + n_blocks * size)
    values: Array = np.full(n_blocks * size, np.nan)
    values[: len(samples)] = samples
    after = np.searchsorted(edges.ravel(), position, side="right")
    span: NDArray[np.int64] = np.where(after % 2 == 1, after // 2, -1)
    span[np.isnan(values)] = -1
    shape = (n_blocks, size)
    span, values, position = span.reshape(shape), values.reshape(shape), position.reshape(shape)
    last = span.max(axis=1)
    first = np.where(span >= 0, span, np.iinfo(np.int64).max).min(axis=1)
    more = (span == first[:, None]).sum(axis=1) > (span == last[:, None]).sum(axis=1)
    chosen = np.where(more, first, last)
    use = (span == chosen[:, None]) & (chosen[:, None] >= 0)
    count = use.sum(axis=1)
    none = count == 0
    divisor = np.where(none, 1, count)
    mean = np.where(none, np.nan, np.where(use, values, 0.0).sum(axis=1) / divisor)
    middle = np.where(none, position.mean(axis=1), np.where(use, position, 0).sum(axis=1) / divisor) + 0.5
    return mean, count / size, middle, np.where(none, -1, chosen)


def longest_block(model: NoiseModel, dwell: float) -> float:
    """Length of the blocks [s] that keep the information of dwells of this length [s]."""
    return max(min(dwell / PER_DWELL, _white_reach(model) / PER_REACH), dwell / MOST)


def _white_reach(model: NoiseModel) -> float:
    """Averaging time from which the slow noise is as large as the white [s]: 0 without white noise, or infinite."""
    white = sum(t.N**2 for t in model.terms if isinstance(t, White))
    slow = NoiseModel(terms=tuple(t for t in model.terms if not isinstance(t, (White, Quantisation))))
    tau = np.geomspace(1e-4, 1e8, 1201)
    ruled = slow.avar(tau) >= white / tau
    if not slow.terms or not ruled.any():
        return math.inf
    return float(tau[int(np.argmax(ruled))]) if white else 0.0
