# SPDX-License-Identifier: BSD-3-Clause
"""A run while it is recorded: what has come, what is missing, the Allan curve so far."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from allanite.errors import DataQualityError

if TYPE_CHECKING:
    from allanite.allan import AllanCurve
    from allanite.allan.live import LiveCurve
    from allanite.log_store import Batch, Position, Run

__all__ = ["RunWatch"]

#: Rows of samples for which the rate is measured, at least.
_FEWEST = 10


@dataclass(slots=True)
class RunWatch:
    """Follows a run; each `look` reads only what has come since the last one.

    Parameters
    ----------
    folder : path

    Raises
    ------
    FormatError
        There is no run.
    """

    folder: str | os.PathLike[str]
    run: Run = field(init=False)
    _live: LiveCurve | None = field(init=False, default=None)
    _position: Position | None = None
    _first: tuple[int, int] | None = None  # number and clock
    _last: tuple[int, int] | None = None
    _values: tuple[float, ...] = ()
    _samples: int = 0
    _gaps: int = 0
    _overloads: int = 0

    def __post_init__(self) -> None:
        from allanite.allan.live import LiveCurve
        from allanite.errors import InputError
        from allanite.log_store import open_run

        self.run = open_run(self.folder)
        try:
            self._live = LiveCurve(self.run.header.channels, self.run.header.rate)
        except InputError:  # only temperatures, or angles
            self._live = None

    def look(self) -> Mapping[str, Any]:
        """Plain data of the moment."""
        from allanite.log_store import open_run

        while True:
            batches, self._position = self.run.tail(self._position)
            for batch in batches:
                self._take(batch)
            if not batches:
                break
        self.run = open_run(self.folder)
        return {
            "format": "allanite-monitor",
            "version": 1,
            "folder": str(self.folder),
            "status": self.run.status,
            "reason": self.run.reason,
            "instrument": dict(self.run.header.instrument),
            "channels": [c.to_json() for c in self.run.header.channels],
            "rate": self.run.header.rate,
            "measured_rate": self._measured_rate(),
            "samples": self._samples,
            "missing": 0 if self._last is None else self._last[0] + 1 - self._samples,
            "gaps": self._gaps,
            "overloads": self._overloads,
            "values": list(self._values),
            "disk": self._disk(),
        }

    def curve(self) -> AllanCurve | None:
        """The Allan curve so far; None where there is none yet."""
        try:
            return None if self._live is None else self._live.curve()
        except DataQualityError:
            return None

    def _take(self, batch: Batch) -> None:
        import numpy as np

        from allanite.log_store import Flag

        counter = batch.counter
        expected = 0 if self._last is None else self._last[0] + 1
        jumps = np.diff(counter, prepend=expected - 1) - 1
        self._gaps += int(np.count_nonzero(jumps))
        if self._live is not None:
            for start, stop in _stretches(jumps):
                self._live.skip(int(jumps[start]))
                self._live.feed(batch.values[start:stop])
        self._first = self._first or (int(counter[0]), int(batch.monotonic_ns[0]))
        self._last = int(counter[-1]), int(batch.monotonic_ns[-1])
        self._values = tuple(batch.values[-1].tolist())
        self._samples += len(counter)
        self._overloads += int(np.count_nonzero(batch.flags & Flag.OVERLOAD))

    def _measured_rate(self) -> float | None:
        """Samples per second of the host's clock, from the first to the last."""
        if self._first is None or self._last is None or self._last[0] - self._first[0] < _FEWEST:
            return None
        seconds = (self._last[1] - self._first[1]) / 1e9
        return (self._last[0] - self._first[0]) / seconds if seconds > 0 else None

    def _disk(self) -> Mapping[str, float]:
        from allanite.capture import space_of

        header = self.run.header
        space = space_of(self.folder, header.rate, len(header.channels), None)
        return {"free": space.free, "seconds": space.seconds}


def _stretches(jumps: Any) -> list[tuple[int, int]]:
    """From each jump to the next."""
    import numpy as np

    starts = np.flatnonzero(jumps)
    starts = starts if len(starts) and starts[0] == 0 else np.concatenate([[0], starts])
    return list(zip(starts.tolist(), [*starts[1:].tolist(), len(jumps)], strict=True))
