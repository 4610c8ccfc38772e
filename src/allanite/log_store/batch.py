# SPDX-License-Identifier: BSD-3-Clause
"""A batch: some samples of all channels, as they came, with the counter and the clocks of the moment."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntFlag

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError

__all__ = ["Batch", "Flag"]


class Flag(IntFlag):
    """What is odd about a sample; the value of a sample with `OVERLOAD` or `MISSING` is NaN."""

    OVERLOAD = 1
    MISSING = 2
    RESYNC = 4
    DOUBTFUL = 8


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
        Wall clock at the last sample, since 1970.

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
                "the counter of a batch must rise from sample to sample, and a batch is never empty"
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
