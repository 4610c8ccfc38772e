# SPDX-License-Identifier: BSD-3-Clause
"""Stamps of the host, evenly over a run however long it is: they measure the rate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from allanite.files.store import Batch

__all__ = ["MOST", "StampIndex"]

#: Stamps that are kept: every second one goes when there are so many.
MOST = 2048


class StampIndex:
    """Number and clock at the beginning of every so many seconds.

    Parameters
    ----------
    rate : float [Hz]
        Nominal.
    """

    def __init__(self, rate: float) -> None:
        self._samples = max(round(rate), 1)  # of a second
        self._kept: list[tuple[int, int]] = []
        self._every = self._seconds = 0
        self._second = -1

    def __len__(self) -> int:
        return len(self._kept)

    def take(self, batch: Batch) -> None:
        """Keep what is needed of the stamps of a batch."""
        import numpy as np

        second = batch.counter // self._samples
        for i in np.flatnonzero(np.diff(second, prepend=self._second)).tolist():
            self._seconds += 1
            if self._seconds % (1 << self._every):
                continue
            self._kept.append((int(batch.counter[i]), int(batch.monotonic_ns[i])))
            if len(self._kept) >= MOST:
                self._kept = self._kept[1::2]
                self._every += 1
        self._second = int(second[-1])

    def rate(self) -> Mapping[str, float] | None:
        """By the clock of the host, with its standard uncertainty; that clock's own error is not in it.

        None from too few stamps, and from stamps that were computed; see `allanite.files.store.survey.clock_rate`.
        """
        import numpy as np

        from allanite.files.store.survey import clock_rate

        fitted = clock_rate(np.array(self._kept, dtype=np.int64).reshape(-1, 2)) if self._kept else None
        return None if fitted is None else {"value": fitted[0], "standard_uncertainty": fitted[1]}
