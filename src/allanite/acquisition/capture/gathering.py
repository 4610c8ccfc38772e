# SPDX-License-Identifier: BSD-3-Clause
"""Samples gathered into batches: a second of them at low rates, half a second at high ones; a kill can lose no more."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from allanite.acquisition.capture.numbering import Gap, Numbered
from allanite.acquisition.capture.space import batch_seconds
from allanite.files.store import Batch
from allanite.lazy_dataclasses import dataclass

__all__ = ["Gathering"]


@dataclass(slots=True)
class Gathering:
    """What waits to be written."""

    _items: list[Numbered] = field(default_factory=list)
    _since: int = 0  # [ns]

    def __bool__(self) -> bool:
        return bool(self._items)

    def add(self, item: Numbered, now: int) -> None:
        """Keep samples, and what is missing before and between them, from `now` [ns] on."""
        if len(item) or item.gaps:
            self._since = self._since if self._items else now
            self._items.append(item)

    def is_due(self, rate: float, now: int) -> bool:
        """Whether there are enough for a batch, or the first of them has waited for as long as one lasts."""
        if not self._items:
            return False
        seconds = batch_seconds(rate)
        return sum(map(len, self._items)) >= seconds * rate or now - self._since >= seconds * 1e9

    def take(self, utc_ns: int) -> tuple[list[Gap], Batch | None]:
        """All of it: gaps, and samples as a batch that is written at `utc_ns`; None where there are none."""
        items, self._items = self._items, []
        gaps = [gap for item in items for gap in item.gaps]
        counter = np.concatenate([item.counter for item in items]) if items else np.zeros(0, dtype=np.int64)
        if not len(counter):
            return gaps, None
        return gaps, Batch(
            counter=counter,
            monotonic_ns=np.concatenate([item.monotonic_ns for item in items]),
            values=np.concatenate([item.values for item in items]),
            flags=np.concatenate([item.flags for item in items]),
            utc_ns=utc_ns,
        )
