# SPDX-License-Identifier: BSD-3-Clause
"""The clocks of the host: intervals from one that goes on while the host sleeps, labels from the wall clock.

The wall clock is set, steps and slews; nothing but labels is taken from it, and what it does is written down.
"""

from __future__ import annotations

import time
from dataclasses import field

from allanite.acquisition.instruments import host_ns
from allanite.lazy_dataclasses import dataclass

__all__ = ["ClockEvent", "ClockWatch", "HostClock"]

#: A wall clock that moved more than this against the other since the last look was set [ns].
_STEP = 100_000_000
#: The host slept when this much more time has passed than its processor saw [ns].
_SLEPT = 500_000_000


class HostClock:
    """The clocks of this machine, in ns."""

    def now(self) -> int:
        """Time that passes evenly, also while the host sleeps: that of the blocks of an instrument."""
        return host_ns()

    def awake(self) -> int:
        """Time that passes while the host is awake."""
        return time.monotonic_ns()

    def utc(self) -> int:
        """Wall clock since 1970, UTC."""
        return time.time_ns()


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockEvent:
    """A wall clock that was set, or a host that slept.

    Attributes
    ----------
    what : "step" or "sleep"
    seconds : float [s]
        How far the wall clock was moved, forward positive; how long the host slept.
    """

    what: str
    seconds: float


@dataclass(slots=True)
class ClockWatch:
    """Looks at the clocks from time to time."""

    clock: HostClock
    _wall: int = field(init=False)
    _asleep: int = field(init=False)

    def __post_init__(self) -> None:
        self._wall, self._asleep = self._offsets()

    def look(self) -> list[ClockEvent]:
        """What happened since the last look."""
        wall, asleep = self._offsets()
        events = []
        if asleep - self._asleep > _SLEPT:
            events.append(ClockEvent(what="sleep", seconds=(asleep - self._asleep) / 1e9))
        if abs(wall - self._wall) > _STEP:
            events.append(ClockEvent(what="step", seconds=(wall - self._wall) / 1e9))
        self._wall, self._asleep = wall, asleep
        return events

    def _offsets(self) -> tuple[int, int]:
        now = self.clock.now()
        return self.clock.utc() - now, now - self.clock.awake()
