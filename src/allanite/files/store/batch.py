# SPDX-License-Identifier: BSD-3-Clause
"""A batch: some samples of all channels, as they came, with the counter and the clocks of the moment."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass

__all__ = ["Batch", "Flag", "count_flags"]


class Flag:
    """What is odd about a sample; the value of a sample with `OVERLOAD` or `MISSING` is NaN: `NO_VALUE`, both bits.

    Plain integers: a member of an enumeration would turn an array of uint8 into one of int64.
    """

    OVERLOAD: Final = 1
    MISSING: Final = 2
    RESYNC: Final = 4
    DOUBTFUL: Final = 8
    NO_VALUE: Final = OVERLOAD | MISSING


def count_flags(flags: NDArray[np.uint8]) -> dict[str, int]:
    """How many samples have each of `Flag`, and how many any of `NO_VALUE`, by its name in small letters."""
    names = (name for name in vars(Flag) if name.isupper())
    return {name.lower(): int(np.count_nonzero(flags & np.uint8(getattr(Flag, name)))) for name in names}


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Consecutive samples.

    Attributes
    ----------
    counter : ndarray of int64, shape (n,)
        Number of each sample; it rises, and a jump says how many are missing.
    monotonic_ns : ndarray of int64, shape (n,) [ns]
        Monotonic clock of the host at each sample.
    values : ndarray of float64, shape (n, n_channels)
        In the channels' own units, NaN where missing.
    flags : ndarray of uint8, shape (n,)
        Sums of `Flag`.
    utc_ns : int [ns]
        Wall clock when the batch was made, just after its last sample came; since 1970.

    Raises
    ------
    InputError
        Arrays that are not equally long, no sample at all, or a counter that does not rise.
    """

    counter: NDArray[np.int64]
    monotonic_ns: NDArray[np.int64]
    values: NDArray[np.float64]
    flags: NDArray[np.uint8]
    utc_ns: int

    def __post_init__(self) -> None:
        kinds = (
            ("counter", np.int64),
            ("monotonic_ns", np.int64),
            ("values", np.float64),
            ("flags", np.uint8),
        )
        for name, kind in kinds:
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=kind))
        shapes = [getattr(self, name).shape for name, _ in kinds]
        n = shapes[0][:1]
        if self.values.ndim != 2 or not n or not all(s == n for s in (*shapes[:2], shapes[3], shapes[2][:1])):
            raise InputError(
                "a batch needs counter, monotonic_ns and flags of shape (n,) and values of shape (n, n_channels); "
                f"got {shapes[0]}, {shapes[1]}, {shapes[3]} and {shapes[2]}"
            )
        if not len(self) or not bool(np.all(self.counter[1:] > self.counter[:-1])):
            raise InputError(
                "the counter of a batch must increase from sample to sample, and a batch must not be empty"
            )

    def __len__(self) -> int:
        return len(self.counter)

    @property
    def first(self) -> int:
        """Number of the first sample."""
        return int(self.counter[0])

    @property
    def last(self) -> int:
        """Number of the last sample."""
        return int(self.counter[-1])

    def count(self, flags: int) -> int:
        """Samples with any of these; `Flag.NO_VALUE` counts those without a value in one channel at least."""
        return int(np.count_nonzero(self.flags & np.uint8(flags)))

    def after(self, counter: int | None) -> Batch | None:
        """The samples behind a number; None if there are none."""
        if counter is None or self.first > counter:
            return self
        if self.last <= counter:
            return None
        keep = slice(int(np.searchsorted(self.counter, counter, side="right")), None)
        return replace(
            self,
            counter=self.counter[keep],
            monotonic_ns=self.monotonic_ns[keep],
            values=self.values[keep],
            flags=self.flags[keep],
        )
