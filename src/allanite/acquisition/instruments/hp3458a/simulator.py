# SPDX-License-Identifier: BSD-3-Clause
"""Doors to the simulated 3458A: a bare TCP socket, and a Prologix adapter over TCP or at a pseudo terminal.

Every byte that passes is kept (the first mebibyte of each direction), so that a conversation can be tested as it was
on the wire. A door serves one host at a time, as the instrument does.
"""

from __future__ import annotations

import os
import select
import socket
import threading
import time
from collections import deque
from typing import Literal, Protocol

from allanite.acquisition.instruments.hp3458a.simulated_meter import SimulatedMeter

__all__ = ["MeterSimulator", "SimulatedPrologix"]

KEPT = 1 << 20
CHUNK = 1 << 16
#: Longest sleep of a door that waits [s].
NAP = 0.002
CTRL_C = b"\x03"


class Door(Protocol):
    """Between the byte stream of the host and the messages of the meter."""

    def hear(self, data: bytes) -> None:
        """Bytes from the host."""
        ...

    def speak(self) -> bytes:
        """Bytes for the host."""
        ...

    def stalled(self) -> None:
        """The host does not take what it was sent."""
        ...


class _Socket:
    """A gateway that passes everything on; Ctrl-C is device clear."""

    def __init__(self, meter: SimulatedMeter) -> None:
        self._meter = meter

    def hear(self, data: bytes) -> None:
        before, cleared, after = data.rpartition(CTRL_C)
        if cleared:
            del before
            self._meter.clear()
        self._meter.receive(after)

    def speak(self) -> bytes:
        return self._meter.take(CHUNK)

    def stalled(self) -> None:
        self._meter.lose_due(keep=1)


class SimulatedPrologix:
    """The adapter: orders that begin with ++, escapes undone, one message of the meter for each read."""

    VERSION = b"Prologix GPIB-ETHERNET Controller version 01.06.06.00 (simulated)"

    def __init__(self, meter: SimulatedMeter, version: bytes = VERSION) -> None:
        self._meter = meter
        self._version = version
        self.orders: list[bytes] = []
        self._line = bytearray()
        self._escaped = self._plain = False
        self._waiting: deque[tuple[bytes, bool]] = deque()
        self._read_until: float | None = None
        self._timeout = 0.5

    def hear(self, data: bytes) -> None:
        for byte in data:
            if self._escaped:
                # An escaped sign at the start makes the line a message, not an order.
                self._plain |= not self._line
                self._line.append(byte)
                self._escaped = False
            elif byte == 0x1B:
                self._escaped = True
            elif byte in b"\r\n":
                if self._line:
                    order = self._line.startswith(b"++") and not self._plain
                    self._waiting.append((bytes(self._line), order))
                self._line, self._plain = bytearray(), False
            else:
                self._line.append(byte)

    def speak(self) -> bytes:
        if self._read_until is not None:
            # A slow host leaves the meter with the newest reading only.
            self._meter.lose_due(keep=1)
            message = self._meter.message()
            if message or time.monotonic() >= self._read_until:
                self._read_until = None
            return message
        spoken = b""
        while self._waiting and not spoken and self._read_until is None:
            line, order = self._waiting.popleft()
            if order:
                spoken = self._obey(line)
            else:
                self._meter.receive(line + b"\n")
        return spoken

    def stalled(self) -> None:
        """The adapter reads nothing by itself."""

    def _obey(self, line: bytes) -> bytes:
        self.orders.append(line)
        name, _, rest = line.partition(b" ")
        if name == b"++ver":
            return self._version + b"\r\n"
        if name == b"++clr":
            self._meter.clear()
        elif name == b"++read":
            self._read_until = time.monotonic() + self._timeout
        elif name == b"++read_tmo_ms":
            self._timeout = int(rest) / 1000
        return b""


class MeterSimulator:
    """A simulated meter behind a door, in a thread of its own.

    Parameters
    ----------
    meter : SimulatedMeter
        Simulated meter.
    door : "socket", "prologix" or "prologix-serial"
        Connection of the simulated meter.
    version : bytes, optional
        Answer of the adapter to ++ver.

    Attributes
    ----------
    resource : str
        Resource that the driver opens.
    heard, said : bytearray
        Bytes from and to the host.

    Examples
    --------
    >>> from allanite.acquisition.instruments.hp3458a.simulated_meter import SimulatedMeter
    >>> with MeterSimulator(SimulatedMeter()) as simulator:
    ...     simulator.resource.startswith("TCPIP::127.0.0.1::")
    True
    """

    def __init__(
        self,
        meter: SimulatedMeter,
        door: Literal["socket", "prologix", "prologix-serial"] = "socket",
        *,
        version: bytes = SimulatedPrologix.VERSION,
    ) -> None:
        self.meter = meter
        self.heard, self.said = bytearray(), bytearray()
        self._kind, self._version = door, version
        self._ends = threading.Event()
        self._listener: socket.socket | None = None
        self._slave: int | None = None
        self._port = 0
        self._thread = threading.Thread(target=self._run, name="simulated 3458A", daemon=True)

    def __enter__(self) -> MeterSimulator:
        if self._kind == "prologix-serial":
            self._master, self._slave = _raw_terminal()
            self.resource = f"prologix://{os.ttyname(self._slave)}/22"
        else:
            self._listen()
            shape = "TCPIP::{}::{}::SOCKET" if self._kind == "socket" else "prologix://{}:{}/22"
            self.resource = shape.format("127.0.0.1", self._port)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.set()
        self._thread.join(5)
        if self._listener is not None:
            self._listener.close()
        if self._slave is not None:
            os.close(self._slave)

    def _listen(self) -> None:
        self._listener = socket.socket()
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._listener.bind(("127.0.0.1", self._port))
        self._listener.listen(1)
        self._port = self._listener.getsockname()[1]

    def _run(self) -> None:
        if self._kind == "prologix-serial":
            self._serve(self._master)
            os.close(self._master)
            return
        while not self._ends.is_set():
            assert self._listener is not None  # noqa: S101
            ready, _, _ = select.select([self._listener], [], [], 0.05)
            if not ready:
                continue
            link, _ = self._listener.accept()
            with link:
                link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                link.setblocking(False)
                self._serve(link.fileno())
            self._after_drop()

    def _after_drop(self) -> None:
        """Away for a while, then back at power-on, perhaps as another meter."""
        fault = self.meter.dropped
        if fault is None:
            return
        if self._listener is not None:
            self._listener.close()
        self._ends.wait(fault.seconds)
        self.meter.come_back(fault)
        self._listen()

    def _serve(self, link: int) -> None:
        door: Door = (
            _Socket(self.meter) if self._kind == "socket" else SimulatedPrologix(self.meter, self._version)
        )
        out = b""
        while not self._ends.is_set():
            out = out or door.speak()
            if not out and self.meter.dropped is not None:
                return
            readable, writable, _ = select.select([link], [link] if out else [], [], NAP)
            try:
                if readable:
                    data = os.read(link, CHUNK)
                    if not data:
                        return
                    _keep(self.heard, data)
                    door.hear(data)
                    if CTRL_C in data and self._kind == "socket":
                        out = b""
                if writable and out:
                    sent = os.write(link, out)
                    _keep(self.said, out[:sent])
                    out = out[sent:]
                elif out:
                    door.stalled()
            except OSError:
                return


def _keep(log: bytearray, data: bytes) -> None:
    log += data[: max(KEPT - len(log), 0)]


def _raw_terminal() -> tuple[int, int]:
    """A pseudo terminal that changes no byte."""
    import pty
    import tty

    master, slave = pty.openpty()
    tty.setraw(slave)
    return master, slave
