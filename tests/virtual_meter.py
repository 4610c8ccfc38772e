# SPDX-License-Identifier: BSD-3-Clause
"""A simulated 3458A and its driver in a time that is only counted: six days of readings in seconds.

The driver, its streams and the meter are the real ones; the wire between them is a call, and who waits moves the clock.
The clock of the meter may be off that of the host, and the host is late by a random time at each read.
"""

from __future__ import annotations

import itertools
import math
import time
import types
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from allanite.acquisition.instruments.hp3458a import (
    conversation,
    driver,
    prologix,
    simulated_meter,
    simulator,
)
from allanite.acquisition.instruments.hp3458a.prologix import PrologixTransport
from allanite.acquisition.instruments.hp3458a.simulated_meter import SimulatedMeter
from allanite.acquisition.instruments.hp3458a.simulator import SimulatedPrologix
from allanite.acquisition.instruments.hp3458a.transports import Transport
from allanite.errors import InstrumentError

SECOND = 10**9
#: Mean lateness of the host at a read [s].
LATE = 0.3e-3
READING = 17  # bytes of a line
#: Step in which a virtual adapter waits [s].
NAP = 0.5e-3
#: What an attempt to connect takes that is refused [s].
REFUSED = 0.1


@dataclass(slots=True)
class VirtualClock:
    """Nanoseconds of the host."""

    ns: int = 1_000 * SECOND

    def now(self) -> int:
        return self.ns

    def seconds(self) -> float:
        return self.ns / SECOND

    def pass_by(self, seconds: float) -> None:
        self.ns += round(seconds * SECOND)


@dataclass(slots=True)
class VirtualWire:
    """A `Transport` to a meter whose clock runs `1 + error` times as fast as that of the host."""

    meter: SimulatedMeter
    clock: VirtualClock
    error: float
    answer_seconds: float = 0.02  # from a query to its answer
    late: float = LATE  # of the host at a read, on average [s]
    gone: bool = False
    said: bytearray = field(default_factory=bytearray)  # readings as the host got them
    _jitter: np.random.Generator = field(default_factory=lambda: np.random.default_rng(5))
    _held: bytearray = field(default_factory=bytearray)

    def write(self, message: bytes) -> None:
        self._refuse_gone()
        self.meter.receive(message + b"\n")

    def read_line(self, timeout: float) -> bytes:
        self._refuse_gone()
        self.clock.pass_by(self.answer_seconds)
        return self.meter.message()

    def read_bytes(self, count: int, timeout: float, *, message: int | None) -> bytes:
        if not self._held:
            self._refuse_gone()
        deadline = self.clock.ns + round(timeout * SECOND)
        while len(self._held) < count:
            part = self.meter.take(count)
            self._held += part
            if part:
                continue
            if self.meter.dropped is not None:
                break  # what has come is given; the next read says that the link is gone
            # A fault changes how many bytes a reading has: then from reading to reading.
            due = self._due(1 if self.meter._faults else -(-(count - len(self._held)) // READING))
            self.clock.ns = max(self.clock.ns, min(deadline, due))
            if due > deadline:
                self._held += self.meter.take(count)
                break
        else:
            self.clock.pass_by(self._jitter.exponential(self.late))
        if not self._held:
            self._refuse_gone()
        out = bytes(self._held[:count])
        del self._held[:count]
        self.said += out
        return out

    def clear(self) -> None:
        self._refuse_gone()
        self._held.clear()
        self.meter.clear()

    def close(self) -> None:
        self._held.clear()

    def _due(self, readings: int) -> int:
        """When so many more readings are there, or the last ones of an arming."""
        meter = self.meter
        if not meter.measuring:
            return 1 << 62
        in_meter = (
            meter._origin + round((meter._done + min(readings, meter._left)) * self._period * SECOND) + 2
        )
        return round(max(in_meter, meter._silent_until) / (1 + self.error)) + 2

    @property
    def _period(self) -> float:
        return self.meter._state["TIMER"][0]

    def _refuse_gone(self) -> None:
        if self.gone or self.meter.dropped is not None:
            raise InstrumentError("the link is gone")


@dataclass(slots=True)
class DelayingWire(VirtualWire):
    """A gateway that passes answers on as late as it likes, in their order, whatever was cleared meanwhile."""

    delays: Iterator[float] = field(default_factory=lambda: itertools.repeat(0.0))  # [s]
    _on_way: deque[tuple[int, bytes]] = field(default_factory=deque)

    def write(self, message: bytes) -> None:
        self.meter.receive(message + b"\n")
        while self.meter._output:
            came = self.clock.ns + round(next(self.delays) * SECOND)
            before = self._on_way[-1][0] if self._on_way else 0
            self._on_way.append((max(came, before), self.meter._output.popleft()))

    def read_line(self, timeout: float) -> bytes:
        deadline = self.clock.ns + round(timeout * SECOND)
        if self._on_way and self._on_way[0][0] <= deadline:
            came, answer = self._on_way.popleft()
            self.clock.ns = max(self.clock.ns, came)
            return answer
        self.clock.ns = deadline
        return b""

    def read_bytes(self, count: int, timeout: float, *, message: int | None) -> bytes:
        if self._on_way and self._on_way[0][0] <= self.clock.ns + round(timeout * SECOND):
            return self.read_line(timeout)
        return super(DelayingWire, self).read_bytes(count, timeout, message=message)


@dataclass(slots=True)
class VirtualAdapter:
    """A link of `PrologixTransport` to the simulated adapter in front of a meter."""

    door: SimulatedPrologix
    clock: VirtualClock
    delays: Iterator[float] = field(default_factory=lambda: itertools.repeat(0.0))  # of what it says [s]
    _on_way: deque[tuple[int, bytes]] = field(default_factory=deque)

    def send(self, data: bytes) -> None:
        self._refuse_gone()
        self.door.hear(data)

    def receive(self, limit: int, timeout: float) -> bytes:
        deadline = self.clock.ns + math.ceil(timeout * SECOND)  # a wait moves the clock
        while not (said := self._spoken()) and self.clock.ns < deadline:
            self._refuse_gone()
            self.clock.pass_by(NAP)
        assert len(said) <= limit
        return said

    def _spoken(self) -> bytes:
        if said := self.door.speak():
            came = self.clock.ns + round(next(self.delays) * SECOND)
            before = self._on_way[-1][0] if self._on_way else 0
            self._on_way.append((max(came, before), said))
        return self._on_way.popleft()[1] if self._on_way and self._on_way[0][0] <= self.clock.ns else b""

    def close(self) -> None:
        """Nothing is held."""

    def _refuse_gone(self) -> None:
        if self.door._meter.dropped is not None:
            raise InstrumentError("the link is gone")


@dataclass(slots=True)
class VirtualLink:
    """What connects to a meter that breaks the link ("drop") and is back at power-on after its time.

    `before_drop`: when the meter was armed for the last time before it broke the link [ns].
    """

    meter: SimulatedMeter
    clock: VirtualClock
    opened: Callable[[], Transport]
    before_drop: int = 0
    _back_ns: int | None = None

    def connect(self) -> Transport:
        fault = self.meter.dropped
        if fault is None:
            return self.opened()
        if self._back_ns is None:
            self.before_drop = self.meter._origin
            self._back_ns = self.clock.ns + round(fault.seconds * SECOND)
        if self.clock.ns < self._back_ns:
            self.clock.pass_by(REFUSED)
            raise InstrumentError("no connection")
        self.meter.come_back(fault)
        self._back_ns = None
        return self.opened()


@contextmanager
def virtual_time(error: float = 0.0) -> Iterator[VirtualClock]:
    """The clocks of driver and meter are replaced meanwhile."""
    clock = VirtualClock()
    before = driver.host_ns, simulated_meter.host_ns
    driver.host_ns = clock.now
    simulated_meter.host_ns = lambda: round(clock.now() * (1 + error))
    for module in (conversation, driver, prologix, simulator):
        module.time = types.SimpleNamespace(monotonic=clock.seconds)
    try:
        yield clock
    finally:
        driver.host_ns, simulated_meter.host_ns = before
        for module in (conversation, driver, prologix, simulator):
            module.time = time


@contextmanager
def virtual_wire(error: float = 0.0, **simulated: object) -> Iterator[VirtualWire]:
    """A meter at the other end, which sends zeros unless told."""
    with virtual_time(error) as clock:
        meter = SimulatedMeter(**{"signal": lambda index: np.zeros(len(index)), **simulated})
        yield VirtualWire(meter, clock, error)


@contextmanager
def virtual_adapter(**simulated: object) -> Iterator[tuple[PrologixTransport, VirtualClock]]:
    """A meter behind an adapter."""
    with virtual_time() as clock:
        door = SimulatedPrologix(SimulatedMeter(**simulated))
        yield PrologixTransport(VirtualAdapter(door, clock), 22), clock


@contextmanager
def virtual_link(door: str, **simulated: object) -> Iterator[VirtualLink]:
    """A meter at a bare wire ("socket") or behind an adapter ("prologix"), to be connected to again and again."""
    with virtual_time() as clock:
        meter = SimulatedMeter(**simulated)
        opened: dict[str, Callable[[], Transport]] = {
            "socket": lambda: VirtualWire(meter, clock, 0.0, answer_seconds=2e-3),
            "prologix": lambda: PrologixTransport(VirtualAdapter(SimulatedPrologix(meter), clock), 22),
        }
        yield VirtualLink(meter, clock, opened[door])
