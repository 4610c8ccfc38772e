# SPDX-License-Identifier: BSD-3-Clause
"""How long a run is to be: its duration in samples, also where the rate changes in mid-run."""

from __future__ import annotations

from dataclasses import field, replace

import numpy as np

from allanite.acquisition.capture.numbering import Gap, Numbered
from allanite.lazy_dataclasses import dataclass

__all__ = ["CapturePlan"]


@dataclass(slots=True)
class CapturePlan:
    """The planned duration.

    Parameters
    ----------
    seconds : float or None [s]
        None: no end is planned.
    rate : float [Hz]
        Nominal, of the samples to come.

    Attributes
    ----------
    limit : int or None
        Number behind the last sample.
    """

    seconds: float | None
    rate: float
    limit: int | None = field(init=False)

    def __post_init__(self) -> None:
        self.limit = None if self.seconds is None else max(round(self.seconds * self.rate), 1)

    def change(self, rate: float, number: int) -> None:
        """Samples from this number on come at another rate: the time that is left stays what it is."""
        if self.limit is not None:
            self.limit = number + max(round((self.limit - number) * rate / self.rate), 0)
        self.rate = rate

    def left(self, number: int) -> float | None:
        """Time from this number to the end [s]."""
        return None if self.limit is None else max(self.limit - number, 0) / self.rate

    def share(self, number: int) -> float | None:
        """Of the duration, what is over before this number."""
        left = self.left(number)
        return None if left is None or self.seconds is None else 1.0 - min(left / self.seconds, 1.0)

    def is_over(self, item: Numbered) -> bool:
        """Whether nothing that comes after these samples belongs to the run."""
        return self.limit is not None and int(item.counter[-1]) + 1 >= self.limit

    def cut(self, item: Numbered) -> Numbered:
        """The samples whose number lies below the limit, and what is missing up to there."""
        n = len(item) if self.limit is None else int(np.searchsorted(item.counter, self.limit))
        if n == len(item):
            return item
        return Numbered(
            counter=item.counter[:n],
            monotonic_ns=item.monotonic_ns[:n],
            values=item.values[:n],
            flags=item.flags[:n],
            gaps=tuple(cut for gap in item.gaps if (cut := self.cut_gap(gap)) is not None),
        )

    def cut_gap(self, gap: Gap) -> Gap | None:
        """What of a gap lies below the limit."""
        if self.limit is None:
            return gap
        samples = min(gap.samples, self.limit - gap.counter)
        return replace(gap, samples=samples, dropped=min(gap.dropped, samples)) if samples > 0 else None
