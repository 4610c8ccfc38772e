# SPDX-License-Identifier: BSD-3-Clause
"""Bytes to and from the meter through PyVISA, or through a Prologix-style adapter of our own.

A read returns exactly the bytes that came, never more than asked for; running out of time is an empty or a shorter
answer, a lost link an `InstrumentError`. No termination character is set while readings stream: in binary, 0x0A is a
value like any other.
"""

from __future__ import annotations

import time
from typing import Any, Protocol

from allanite.acquisition.instruments.hp3458a.resources import PROLOGIX, SOCKET, refuse_unfit
from allanite.errors import InstrumentError
from allanite.plain_files.extras import require

__all__ = ["Transport", "VisaTransport", "open_transport"]

#: Device clear where there is no bus: meters with a serial port take Ctrl-C for it, and so do gateways to a socket.
CTRL_C = b"\x03"
#: A cleared socket is empty when nothing came for so long [s]; emptying it ends after this time in any case.
QUIET, LONGEST_CLEAR = 0.05, 3.0


class Transport(Protocol):
    """One instrument at the other end."""

    def write(self, message: bytes) -> None:
        """Send one message; the end of message is added here."""
        ...

    def read_line(self, timeout: float) -> bytes:
        """An answer up to and with its line feed, or what came of it in `timeout` seconds."""
        ...

    def read_bytes(self, count: int, timeout: float, *, message: int | None) -> bytes:
        """At most `count` bytes, fewer where no more came; a lost link is said when nothing is left to give.

        `message`: bytes of each message of the meter; None where each ends with a line feed.
        """
        ...

    def clear(self) -> None:
        """Device clear, and everything on its way to us dropped."""
        ...

    def close(self) -> None:
        """Give the link back."""
        ...


def open_transport(resource: str, *, connect_timeout: float = 5.0) -> Transport:
    """The transport of a resource.

    Parameters
    ----------
    resource : str
        ``GPIB0::22::INSTR``, ``TCPIP::host::port::SOCKET`` or another VISA resource;
        ``prologix://host:port/22`` (port 1234 when left out) or ``prologix:///dev/ttyUSB0/22``.

    Raises
    ------
    InputError
        The text is no resource.
    InstrumentError
        Nothing answers there, or the extra `instruments` is not installed.
    """
    refuse_unfit(resource)
    if match := PROLOGIX.fullmatch(resource):
        from allanite.acquisition.instruments.hp3458a.prologix import PrologixTransport, SerialLink, TcpLink

        where = match["where"]
        link = SerialLink(where) if where.startswith("/") else TcpLink(where, connect_timeout)
        return PrologixTransport(link, int(match["address"]))
    return VisaTransport(resource, connect_timeout=connect_timeout)


class VisaTransport:
    """A PyVISA resource, read by exact counts.

    Parameters
    ----------
    resource : str
    backend : str
        "" takes the maker's VISA library where there is one, else pyvisa-py ("@py").
    """

    def __init__(self, resource: str, *, connect_timeout: float = 5.0, backend: str = "") -> None:
        require("pyvisa", "instruments", f"the connection {resource}", error=InstrumentError)
        import pyvisa

        self._visa: Any = pyvisa
        self._name = resource
        self._socket = bool(SOCKET.fullmatch(resource))
        self._manager, self._resource = self._connect(backend, connect_timeout)
        self._session: int = self._resource.session
        self._resource.read_termination = None
        self._resource.write_termination = ""
        if self._socket:
            # Else a read that runs out of time throws away what had come of it.
            self._set("VI_ATTR_SUPPRESS_END_EN", False)

    def _connect(self, backend: str, timeout: float) -> tuple[Any, Any]:
        try:
            try:
                manager = self._visa.ResourceManager(backend)
            except (OSError, ValueError):
                if backend:
                    raise
                manager = self._visa.ResourceManager("@py")
            return manager, manager.open_resource(self._name, open_timeout=round(timeout * 1000))
        except Exception as error:
            # pyvisa-py raises bare Exception, ValueError, OSError and VisaIOError for the same thing.
            raise InstrumentError(
                f"{self._name}: cannot be opened ({error}); is it switched on, is the address right, and is a VISA "
                'library (or pyvisa-py: pip install "allanite[instruments]") installed?'
            ) from error

    def write(self, message: bytes) -> None:
        self._guarded(self._resource.write_raw, message + b"\n")

    def read_line(self, timeout: float) -> bytes:
        self._set("VI_ATTR_TERMCHAR_EN", True)
        try:
            return self._read(256, timeout)
        finally:
            self._set("VI_ATTR_TERMCHAR_EN", False)

    def read_bytes(self, count: int, timeout: float, *, message: int | None) -> bytes:
        del message  # the end of a message is a line of the bus here
        out = bytearray()
        deadline = time.monotonic() + timeout
        while len(out) < count:
            left = deadline - time.monotonic()
            if left <= 0 and out:
                break
            try:
                part = self._read(count - len(out), max(left, 0.001))
            except InstrumentError:
                if not out:
                    raise
                break  # what has come is given; the next read says that the link is gone
            if not part:
                break
            out += part
        return bytes(out)

    def clear(self) -> None:
        if not self._socket:
            self._guarded(self._resource.clear)
            return
        # pyvisa-py empties a socket that was closed by the other side for ever; so we do it, for a bounded time.
        self._guarded(self._resource.write_raw, CTRL_C)
        deadline = time.monotonic() + LONGEST_CLEAR
        while time.monotonic() < deadline and self._read(4096, QUIET):
            pass

    def close(self) -> None:
        for thing in (self._resource, self._manager):
            try:
                thing.close()
            except (OSError, self._visa.Error, AttributeError):
                # A link that is gone cannot be closed in order; there is nothing left to give back.
                continue

    def _read(self, count: int, timeout: float) -> bytes:
        self._resource.timeout = max(timeout * 1000, 1)
        codes = self._visa.constants.StatusCode
        try:
            with self._resource.ignore_warning(
                codes.success_max_count_read, codes.success_device_not_present
            ):
                data, _ = self._resource.visalib.read(self._session, count)
        except self._visa.errors.VisaIOError as error:
            if error.error_code == codes.error_timeout:
                self._check_alive()
                return b""
            raise self._gone(error) from error
        except (OSError, self._visa.Error) as error:
            raise self._gone(error) from error
        return bytes(data)

    def _check_alive(self) -> None:
        """pyvisa-py takes the end of a socket for silence; ask the socket itself."""
        session = getattr(self._resource.visalib, "sessions", {}).get(self._session)
        link = getattr(session, "interface", None)
        if not self._socket or link is None:
            return
        import select
        import socket

        readable, _, _ = select.select([link], [], [], 0)
        if readable and not link.recv(1, socket.MSG_PEEK):
            raise self._gone(ConnectionResetError("closed by the other side"))

    def _guarded(self, call: Any, *arguments: Any) -> None:
        try:
            call(*arguments)
        except (OSError, self._visa.Error) as error:
            raise self._gone(error) from error

    def _set(self, name: str, value: bool) -> None:
        self._guarded(
            self._resource.set_visa_attribute,
            getattr(self._visa.constants.ResourceAttribute, _ATTR[name]),
            value,
        )

    def _gone(self, error: BaseException) -> InstrumentError:
        return InstrumentError(f"{self._name}: the link is gone ({error}); connect again")


_ATTR = {"VI_ATTR_TERMCHAR_EN": "termchar_enabled", "VI_ATTR_SUPPRESS_END_EN": "suppress_end_enabled"}
