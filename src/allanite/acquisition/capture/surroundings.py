# SPDX-License-Identifier: BSD-3-Clause
"""What happens around a run: the clocks of the host and the room on its disk, looked at from time to time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import Any

from allanite.acquisition.capture.clock import ClockEvent, ClockWatch, HostClock
from allanite.acquisition.capture.numbering import Gap
from allanite.acquisition.capture.space import Space, space_of
from allanite.files.store import LogStore
from allanite.lazy_dataclasses import dataclass

__all__ = ["Surroundings"]

#: Sleeps that are kept until a gap tells of them.
_SLEEPS = 10


@dataclass(slots=True)
class Surroundings:
    """Looks at clocks and disk, writes down what it sees, and tells what the clocks did."""

    store: LogStore
    clock: HostClock
    on_event: Callable[[str, Mapping[str, Any]], None]
    _watch: ClockWatch = field(init=False)
    _slept: list[float] = field(default_factory=list)  # [s], of which no gap has told yet

    def __post_init__(self) -> None:
        self._watch = ClockWatch(self.clock)

    def look(self, left: float | None) -> Space:
        """At both; the room that is needed for the `left` seconds of the run."""
        self.look_at_clocks()
        header = self.store.header
        space = space_of(self.store.folder, header.rate, len(header.channels), left)
        self.store.note(
            "pair",
            now_ns=self.clock.now(),
            utc_ns=self.clock.utc(),
            free=space.free,
            seconds=round(space.seconds),
        )
        return space

    def look_at_clocks(self) -> None:
        """What the wall clock did, and whether the host slept."""
        for event in self._watch.look():
            facts = {"what": event.what, "seconds": event.seconds}
            self.store.note("clock", **facts)
            self.on_event("clock", {**facts, "text": _words(event)})
            if event.what == "sleep":
                self._slept = [*self._slept[1 - _SLEEPS :], event.seconds]

    def explained(self, gap: Gap) -> Gap:
        """A gap about as long as the host slept came of that."""
        lasted = gap.samples / self.store.header.rate
        for seconds in self._slept:
            if lasted >= seconds / 2:
                self._slept.remove(seconds)
                return replace(gap, reason=f"the host slept for {seconds:.0f} s; {gap.reason}")
        return gap


def _words(event: ClockEvent) -> str:
    if event.what == "sleep":
        return f"the host slept for {event.seconds:.0f} s"
    return f"the wall clock was set by {event.seconds:+.3g} s"
