# SPDX-License-Identifier: BSD-3-Clause
"""Columns: the samples of one channel, read by position, as they were written.

A column may be an array, a memory map, a part of another column, one with samples masked, or runs of samples placed
on a longer grid. Only the block that is read is turned into float64.
"""

from __future__ import annotations

import mmap
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass

__all__ = [
    "ArrayColumn",
    "Bound",
    "Calculated",
    "Column",
    "Compared",
    "Detached",
    "Masked",
    "Slice",
    "Spliced",
    "View",
    "less_base",
    "let_go",
    "merge_spans",
    "middle",
    "torn",
]

_COMPARED = 1 << 20  # samples compared at once
_PROBED = 1 << 16  # samples that tell where most of a column lies
_NEAR = 0.25  # of them that must lie within 2**53 of the base
_FITS_64_BITS = float(1 << 62)

Spans = NDArray[np.int64]
Samples = NDArray[np.float64]


class Column(Protocol):
    """Samples of one channel, read by position. Implementations may map or decode a file lazily."""

    @property
    def origin(self) -> float:
        """Value that `read` has subtracted (64-bit integers far from zero); 0.0 otherwise."""
        ...

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type in which the samples were written."""
        ...

    def __len__(self) -> int: ...

    def read(self, start: int, stop: int) -> Samples:
        """Samples [start, stop) as float64, as written (overload words included)."""
        ...


class Compared:
    """What columns have that are equal where their samples are, however these are stored."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Compared):
            return NotImplemented
        one, two = cast(Column, self), cast(Column, other)
        return (
            len(one) == len(two)
            and one.origin == two.origin
            and all(
                np.array_equal(one.read(at, at + _COMPARED), two.read(at, at + _COMPARED), equal_nan=True)
                for at in range(0, len(one), _COMPARED)
            )
        )

    def __hash__(self) -> int:
        column = cast(Column, self)
        return hash((len(column), column.origin))


class Calculated(Compared):
    """What every column has whose samples are made as they are read: they are float64, and nothing is removed."""

    __slots__ = ()

    @property
    def origin(self) -> float:
        return 0.0

    @property
    def dtype(self) -> np.dtype[Any]:
        return np.dtype(np.float64)


class Bound(Compared):
    """What columns have that are bound to an open file or another library: another process gets their samples."""

    __slots__ = ()

    def __reduce__(self) -> tuple[type[Detached], tuple[Samples, np.dtype[Any], float]]:
        column = cast(Column, self)
        return Detached, (column.read(0, len(column)), column.dtype, column.origin)


class ArrayColumn(Compared):
    """A column over a NumPy array or memory map of any real type; nothing is copied but the block read."""

    __slots__ = ("_array", "_base", "origin")

    def __init__(self, array: NDArray[Any]) -> None:
        self._array = array
        self._base = _integer_base(array)
        self.origin = float(self._base)

    @property
    def dtype(self) -> np.dtype[Any]:
        return self._array.dtype

    def __len__(self) -> int:
        return len(self._array)

    def read(self, start: int, stop: int) -> Samples:
        part = self._array[start:stop]
        let_go(self._array, start)
        return np.asarray(part, dtype=np.float64) if self._base == 0 else less_base(part, self._base)


@dataclass(frozen=True, slots=True, eq=False)
class Detached(Compared):
    """The samples of a `Bound` column in another process."""

    samples: Samples
    dtype: np.dtype[Any]
    origin: float

    def __len__(self) -> int:
        return len(self.samples)

    def read(self, start: int, stop: int) -> Samples:
        return self.samples[start:stop]


def let_go(array: NDArray[Any], before: int) -> None:
    """Give the pages of a memory map that lie before a position back: they are read again if they are asked for.

    A log larger than memory would otherwise fill it while it is read once from end to end.
    """
    mapped = getattr(array, "_mmap", None)
    if mapped is None or before == 0 or array.strides[0] <= 0 or not hasattr(mapped, "madvise"):
        return
    first = array.__array_interface__["data"][0] - np.frombuffer(mapped, dtype=np.uint8).ctypes.data
    length = (first + before * array.strides[0]) // mmap.PAGESIZE * mmap.PAGESIZE
    if length > 0:
        mapped.madvise(mmap.MADV_DONTNEED, 0, length)


def _integer_base(array: NDArray[Any]) -> int:
    if array.dtype.kind not in "iu" or array.dtype.itemsize < 8 or array.size == 0:
        return 0
    low, high = int(array.min()), int(array.max())
    if max(abs(low), abs(high)) < 1 << 53:
        return 0
    if high - low >= (1 << 53) - (1 << 11):  # less what the base lies below `low`
        return _base_of_most(array, low, high)
    base = int(float(low))  # a number that float64 holds: `origin` tells it to others
    return base if base <= low else int(np.nextafter(float(low), -np.inf))


def _base_of_most(array: NDArray[Any], low: int, high: int) -> int:
    """The base of a column that a clock step, or a stamp that was never set, tears apart.

    The samples near the base stay exact; those beyond 2**53 of it keep 53 bits, an error that their distance dwarfs.
    """
    base = int(middle(array))
    if torn(less_base(array[:: max(array.size // _PROBED, 1)], base)):
        raise InputError(
            f"64-bit integers from {low} to {high} span more than 2**53: float64 cannot hold them; "
            "subtract an offset or scale them first"
        )
    return base


def middle(values: NDArray[Any]) -> float:
    """A number that half of the values are not above, of a part of them where there are many; 0 of none."""
    some = values[:: max(len(values) // _PROBED, 1)]
    return float(np.partition(some, len(some) // 2)[len(some) // 2]) if len(some) else 0.0


def torn(away: Samples) -> bool:
    """True for integers of 64 bits, less their base, that float64 does not hold: few are within 2**53 of the base."""
    return bool(np.count_nonzero(np.abs(away) < 1 << 53) < _NEAR * np.count_nonzero(np.isfinite(away)))


def less_base(part: NDArray[Any], base: int) -> Samples:
    """Integers of 64 bits less a base: exact within 2**53 of it, which float64 holds, and to 53 bits beyond."""
    distance = np.asarray(part, dtype=np.float64) - float(base)
    with np.errstate(over="ignore"):  # a difference beyond 64 bits is far from the base: not taken
        exact = (part - part.dtype.type(base)).view(np.int64)
    return np.where(np.abs(distance) < _FITS_64_BITS, exact, distance)


@dataclass(frozen=True, slots=True)
class View:
    """What every view of another column has of it."""

    of: Column

    @property
    def origin(self) -> float:
        return self.of.origin

    @property
    def dtype(self) -> np.dtype[Any]:
        return self.of.dtype


@dataclass(frozen=True, slots=True)
class Slice(View):
    """Samples [start, stop) of another column."""

    start: int
    stop: int

    def __len__(self) -> int:
        return self.stop - self.start

    def read(self, start: int, stop: int) -> Samples:
        stop = min(stop, len(self))
        return self.of.read(self.start + start, self.start + stop)


@dataclass(frozen=True, slots=True)
class Masked(View):
    """A column some of whose samples are excluded, for a stated reason: they read as NaN."""

    spans: Spans

    def __len__(self) -> int:
        return len(self.of)

    def read(self, start: int, stop: int) -> Samples:
        block = self.of.read(start, stop)
        first = np.searchsorted(self.spans[:, 1], start, side="right")
        last = np.searchsorted(self.spans[:, 0], start + len(block), side="left")
        if last > first:
            block = np.array(block)
            for a, b in self.spans[first:last]:
                block[max(a - start, 0) : b - start] = np.nan
        return block


@dataclass(frozen=True, slots=True)
class Spliced(View):
    """A column whose samples lie in runs on a longer grid; between the runs nothing was recorded.

    Attributes
    ----------
    of : Column
        The samples, one after another.
    source, grid : ndarray of int64, shape (n_runs + 1,), (n_runs,)
        Run r holds samples source[r]..source[r+1] and begins at position grid[r].
    length : int
        Length of the grid.
    """

    source: NDArray[np.int64]
    grid: NDArray[np.int64]
    length: int

    def __len__(self) -> int:
        return self.length

    def read(self, start: int, stop: int) -> Samples:
        stop = min(stop, self.length)
        block = np.full(max(stop - start, 0), np.nan)
        first = max(int(np.searchsorted(self.grid, start, side="right")) - 1, 0)
        last = int(np.searchsorted(self.grid, stop, side="left"))
        if last <= first or stop <= start:
            return block
        # One read of all samples between, whatever the number of runs: a read for each run would cost its length again.
        begin, end = self.grid[first:last], self.grid[first:last] + np.diff(self.source[first : last + 1])
        low, high = np.maximum(begin, start), np.minimum(end, stop)
        count = np.maximum(high - low, 0)
        total = int(count.sum())
        if total:
            before = np.cumsum(count) - count
            places = np.repeat(low - start - before, count) + np.arange(total)
            samples = int(self.source[first] + low[0] - begin[0]) if count[0] else int(self.source[first + 1])
            block[places] = self.of.read(samples, samples + total)
        return block


def merge_spans(spans: Spans) -> Spans:
    """Sorted, disjoint, non-empty spans [start, stop) covering the same positions."""
    spans = spans[spans[:, 1] > spans[:, 0]]
    if len(spans) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    spans = spans[np.argsort(spans[:, 0], kind="stable")]
    reach = np.maximum.accumulate(spans[:, 1])
    new = np.concatenate(([True], spans[1:, 0] > reach[:-1]))
    return np.stack(
        [spans[new, 0], reach[np.concatenate((np.flatnonzero(new)[1:] - 1, [len(spans) - 1]))]], axis=1
    )
