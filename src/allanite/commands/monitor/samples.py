# SPDX-License-Identifier: BSD-3-Clause
"""What is summed up of the samples of a run, or of one part of it, as they come: in bounded memory."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from allanite.commands.monitor.stamps import StampIndex
from allanite.errors import DataQualityError, InputError

if TYPE_CHECKING:
    from allanite.files.store import Batch, Header
    from allanite.noise.allan import AllanCurve
    from allanite.noise.allan.live import LiveCurve

__all__ = ["PartSamples"]


class PartSamples:
    """The samples of one part.

    Parameters
    ----------
    number : int
        Of the part, from 1.
    header : Header
    before : int
        The last number of the part before; -1 for the first part.

    Attributes
    ----------
    samples, missing, gaps : int
        That came; that are missing before or between them, and in how many gaps.
    no_value, doubtful, resyncs : int
        Of those that came: without a value (overload or missing in one channel at least), marked as doubtful, and
        the first after an interruption.
    last : int
        Number of the last sample of the run.
    last_ns : int [ns]
        Its clock; before all clocks where none has come.
    values : tuple of float
        Of the last sample, in the channels' own units.
    """

    def __init__(self, number: int, header: Header, before: int = -1) -> None:
        self.number, self.header, self.last = number, header, before
        self.samples = self.missing = self.gaps = 0
        self.no_value = self.doubtful = self.resyncs = 0
        self.last_ns = -1
        self.values: tuple[float, ...] = ()
        self.stamps = StampIndex(header.rate)
        self._utc_ns: int | None = None
        self._live = _live(header)

    def take(self, batches: list[Batch]) -> None:
        """Sum up what has come."""
        import numpy as np

        from allanite.files.store import Flag

        counter = np.concatenate([b.counter for b in batches])
        values = np.concatenate([b.values for b in batches])
        first = self.number > 1 and not self.samples  # what is missing between two parts belongs to neither
        jumps = np.diff(counter, prepend=int(counter[0]) - 1 if first else self.last) - 1
        self.gaps += int(np.count_nonzero(jumps))
        self.missing += int(jumps.sum())
        if self._live is not None:
            for start, stop in _stretches(jumps):
                self._live.skip(int(jumps[start]))
                self._live.feed(values[start:stop])
        for batch in batches:
            self.stamps.take(batch)
            self.no_value += batch.count(Flag.NO_VALUE)
            self.doubtful += batch.count(Flag.DOUBTFUL)
            self.resyncs += batch.count(Flag.RESYNC)
        self.last, self.last_ns = int(counter[-1]), int(batches[-1].monotonic_ns[-1])
        self._utc_ns = batches[-1].utc_ns
        self.values = tuple(values[-1].tolist())
        self.samples += len(counter)

    def curve(self) -> AllanCurve | None:
        """The Allan curve so far; None where there is none yet."""
        try:
            return None if self._live is None else self._live.curve()
        except DataQualityError:
            return None

    def age(self) -> float | None:
        """Seconds of the wall clock since the last sample that is on the disk."""
        return None if self._utc_ns is None else max((time.time_ns() - self._utc_ns) / 1e9, 0.0)


def _live(header: Header) -> LiveCurve | None:
    from allanite.noise.allan.live import LiveCurve

    try:
        return LiveCurve(header.channels, header.rate)
    except InputError:  # only temperatures, or angles
        return None


def _stretches(jumps: Any) -> list[tuple[int, int]]:
    """From each jump to the next."""
    import numpy as np

    starts = np.flatnonzero(jumps)
    starts = starts if len(starts) and starts[0] == 0 else np.concatenate([[0], starts])
    return list(zip(starts.tolist(), [*starts[1:].tolist(), len(jumps)], strict=True))
