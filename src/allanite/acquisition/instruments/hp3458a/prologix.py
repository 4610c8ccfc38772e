# SPDX-License-Identifier: BSD-3-Clause
"""Prologix GPIB controllers (user manual 2009 and later) and the AR488, over TCP or a serial port, safe for binary.

To the instrument, CR, LF, ESC and `+` are escaped with ESC; from it, bytes come as they are. The adapter reads only
when told to: each `++read eoi` fetches one message of the instrument, and ends by itself after `++read_tmo_ms`. It does
not say that it ended, so a read is over when its bytes are there, or when nothing came for that time and a little more.
"""

from __future__ import annotations

import re
import select
import socket
import time
from typing import Any, Protocol

from allanite.acquisition.instruments.hp3458a.resources import DEFAULT_PORT
from allanite.acquisition.instruments.port_names import refusal_of_path
from allanite.errors import InstrumentError
from allanite.plain_files.extras import require

__all__ = ["Link", "PrologixTransport", "SerialLink", "TcpLink", "escaped"]

#: Time after which the adapter ends a read by itself [ms]; it takes 3000 at most.
READ_TIMEOUT_MS = 300
#: Time for its answer to come through the network or the serial port [s].
MARGIN = 0.25
#: An AR488 on an Arduino starts anew when its port is opened.
BOOT_TRIES, BOOT_WAIT = 6, 0.6
_SPECIAL = re.compile(rb"([\r\n\x1b+])")


class Link(Protocol):
    """A byte stream to the adapter."""

    def send(self, data: bytes) -> None:
        """Send all of it."""
        ...

    def receive(self, limit: int, timeout: float) -> bytes:
        """What is there, waiting at most `timeout` seconds for the first byte."""
        ...

    def close(self) -> None:
        """Give it back."""
        ...


def escaped(message: bytes) -> bytes:
    """A message as the adapter passes it on unchanged."""
    return _SPECIAL.sub(b"\x1b\\1", message)


class TcpLink:
    """An adapter in the network, ``host`` or ``host:port``."""

    def __init__(self, where: str, timeout: float = 5.0) -> None:
        host, _, port = where.partition(":")
        self._name = where
        try:
            self._socket = socket.create_connection((host, int(port or DEFAULT_PORT)), timeout)
        except (OSError, ValueError) as error:
            raise InstrumentError(
                f"prologix://{where}: no connection ({error}); is the adapter switched on and the address right?"
            ) from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data: bytes) -> None:
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise self._gone(error) from error

    def receive(self, limit: int, timeout: float) -> bytes:
        try:
            ready, _, _ = select.select([self._socket], [], [], max(timeout, 0))
            if not ready:
                return b""
            data = self._socket.recv(limit)
        except OSError as error:
            raise self._gone(error) from error
        if not data:
            raise self._gone(ConnectionResetError("closed by the other side"))
        return data

    def close(self) -> None:
        self._socket.close()

    def _gone(self, error: BaseException) -> InstrumentError:
        return InstrumentError(f"prologix://{self._name}: the link is gone ({error}); connect again")


class SerialLink:
    """An adapter at a serial port, through pyserial."""

    def __init__(self, port: str, baudrate: int = 115200) -> None:
        if refusal := refusal_of_path(port):
            raise InstrumentError(refusal)
        require("serial", "instruments", f"an adapter at {port}", error=InstrumentError)
        import serial

        self._name = port
        self._broken: tuple[type[BaseException], ...] = (OSError, serial.SerialException)
        try:
            # Exclusive: two programs at one port take each other's bytes.
            self._port: Any = serial.Serial(port, baudrate, timeout=0, write_timeout=5, exclusive=True)
        except self._broken as error:
            raise InstrumentError(
                f"{port}: cannot be opened ({error}); is the adapter plugged in, is the port free, and may this "
                "user open it?"
            ) from error

    def send(self, data: bytes) -> None:
        try:
            self._port.write(data)
            self._port.flush()
        except self._broken as error:
            raise self._gone(error) from error

    def receive(self, limit: int, timeout: float) -> bytes:
        try:
            self._port.timeout = max(timeout, 0)
            first = bytes(self._port.read(1))
            return first + bytes(self._port.read(min(self._port.in_waiting, limit - 1))) if first else b""
        except self._broken as error:
            raise self._gone(error) from error

    def close(self) -> None:
        self._port.close()

    def _gone(self, error: BaseException) -> InstrumentError:
        return InstrumentError(f"{self._name}: the port is gone ({error}); connect again")


class PrologixTransport:
    """One instrument behind an adapter.

    Parameters
    ----------
    link : Link
    address : int
        GPIB address of the instrument.

    Raises
    ------
    InstrumentError
        No adapter answers.
    """

    def __init__(self, link: Link, address: int) -> None:
        self._link = link
        self._pending = bytearray()
        self._asked: float | None = None  # when the read that is still open was sent
        self._since = 0  # bytes that came for it
        try:
            self.version = self._greet()
            if b"AR488" not in self.version:
                # Else the adapter writes each setting into its memory, which wears out. AR488 saves only when told.
                self._order(b"++savecfg 0")
            for order in (
                b"++mode 1",
                b"++auto 0",
                b"++addr %d" % address,
                b"++eos 2",
                b"++eoi 1",
                b"++eot_enable 0",
                b"++read_tmo_ms %d" % READ_TIMEOUT_MS,
            ):
                self._order(order)
        except BaseException:
            link.close()
            raise

    def _greet(self) -> bytes:
        """What the adapter says of itself, twice: once may be what was left over from another program."""
        self._link.send(b"\n")  # ends whatever half a line another program has left
        before = b""
        for _ in range(BOOT_TRIES):
            self._order(b"++ver")
            greeting = b""
            deadline = time.monotonic() + BOOT_WAIT
            while not greeting.endswith(b"\n") and (left := deadline - time.monotonic()) > 0:
                greeting += self._link.receive(256, left)
            greeting = greeting.strip()
            if greeting and greeting == before:
                self._drop(0.05)
                return greeting
            before = greeting or before
        raise InstrumentError(
            "no answer to ++ver, or never the same one: no Prologix or AR488 adapter at this address; check the port, "
            "and the baud rate (115200) of a serial one"
        )

    def write(self, message: bytes) -> None:
        self._link.send(escaped(message) + b"\n")

    def read_line(self, timeout: float) -> bytes:
        deadline = time.monotonic() + timeout
        while b"\n" not in self._pending:
            if not self._fetch(deadline, None):
                break
        end = self._pending.find(b"\n") + 1 or len(self._pending)
        return self._take(end)

    def read_bytes(self, count: int, timeout: float, *, message: int | None) -> bytes:
        deadline = time.monotonic() + timeout
        while len(self._pending) < count:
            try:
                if not self._fetch(deadline, message):
                    break
            except InstrumentError:
                if not self._pending:
                    raise
                break  # what has come is given; the next read says that the link is gone
        return self._take(min(count, len(self._pending)))

    def clear(self) -> None:
        self._order(b"++clr")
        self._pending.clear()
        # A read that was open ends at the latest after its own time; what it brings is not wanted.
        self._drop(READ_TIMEOUT_MS / 1000 + MARGIN if self._asked is not None else MARGIN / 5)
        self._asked = None

    def close(self) -> None:
        self._link.close()

    def _fetch(self, deadline: float, message: int | None) -> bool:
        """Wait for bytes of the open read, asking for one first where none is open; False when time is up."""
        now = time.monotonic()
        if now >= deadline:
            return False
        if self._asked is None:
            self._order(b"++read eoi")
            self._asked, self._since = now, 0
        over = self._asked + READ_TIMEOUT_MS / 1000 + MARGIN
        data = self._link.receive(65536, min(deadline, over) - now)
        if data:
            self._pending += data
            self._since += len(data)
            self._asked = now
            whole = data.endswith(b"\n") if message is None else self._since >= message
            if whole:
                self._asked = None
        elif time.monotonic() >= over:
            self._asked = None
        return True

    def _take(self, count: int) -> bytes:
        out = bytes(self._pending[:count])
        del self._pending[:count]
        return out

    def _drop(self, quiet: float) -> None:
        """Throw away what comes until nothing does for `quiet` seconds; bounded."""
        deadline = time.monotonic() + 4 * quiet + 1
        while time.monotonic() < deadline and self._link.receive(65536, quiet):
            pass

    def _order(self, order: bytes) -> None:
        self._link.send(order + b"\n")
