# SPDX-License-Identifier: BSD-3-Clause
"""Open connections: how long each may take, how many there may be, and which of them give way.

Whoever can reach the port can open connections, and each holds a file of this process. So a request has to arrive in
time, and connections without a session give way, the one that has waited longest first, when there are too many. They
never take all places: those of a session, and the newest connection of all, always find one.

=================================== ===============================================================================
a request head                      complete within `Limits.head` of its first moment; an idle connection is closed
                                    by uvicorn after 5 s
a request body                      half of `Limits.slowest` at least, from one look to the next, as long as the
                                    server reads: whoever reads it refuses it earlier, and says why
the body of a request that is       thrown away for `Limits.head` seconds, so that the answer is seen; then closed
answered already
an answer that nobody takes         closed when nothing was taken for `Limits.silence` seconds
connections                         `Limits.sockets`, and at most half of the files that the system lets open
of these without a session          `Limits.strangers`, and from one other machine `Limits.share`
=================================== ===============================================================================
"""

from __future__ import annotations

import asyncio
import ipaddress
from heapq import nsmallest
from typing import Any, Literal

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from allanite.commands.page.settings import Limits

__all__ = ["BACKLOG", "PageConnection", "connections_within"]

BACKLOG = 16
"""Connections accepted in one pass of the event loop. It takes five passes until the guard has looked at what one of
them sent: an eighth of `Limits.strangers`, so that nobody gives way before that."""

Phase = Literal["head", "body", "answer", "idle", "discarded", "stuck"]


def connections_within(limits: Limits) -> type[PageConnection]:
    """The class of connections of one server."""

    class Limited(PageConnection):
        pass

    Limited.limits = limits
    Limited.most = min(limits.sockets, _files() // 2)
    return Limited


class PageConnection(H11Protocol):
    """One connection.

    Attributes
    ----------
    phase : str
        What it waits for, looked at `Limits.head` / 10 seconds apart or more often.
    since : float [s]
        When that began; of a body, when it was last found fast enough.
    """

    limits: Limits
    most: int

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self.phase: Phase = "head"
        self.since = self.loop.time()
        self._bytes = self._bytes_then = 0
        self._timer: asyncio.TimerHandle | None = None

    @property
    def known(self) -> bool:
        """Whether its last request had the token or the cookie."""
        return self.scope is not None and bool(self.scope["state"].get("known"))

    # -- what happens -----------------------------------------------------------------------------------------

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._make_room()
        self._look()

    def data_received(self, data: bytes) -> None:
        self._bytes += len(data)
        super().data_received(data)
        self._note()

    def on_response_complete(self) -> None:
        super().on_response_complete()
        self._note()

    def pause_writing(self) -> None:
        super().pause_writing()
        self._note()

    def resume_writing(self) -> None:
        super().resume_writing()
        self._note()

    def connection_lost(self, exc: Exception | None) -> None:
        if self._timer is not None:
            self._timer.cancel()
        super().connection_lost(exc)

    # -- how long it may take ---------------------------------------------------------------------------------

    def _note(self) -> None:
        """Note the phase; its clock starts anew where it is another one."""
        phase = self._phase()
        if phase != self.phase:
            self.phase, self.since, self._bytes_then = phase, self.loop.time(), self._bytes

    def _phase(self) -> Phase:
        if self.flow.write_paused:
            return "stuck"
        pending = self.cycle is not None and not self.cycle.response_complete
        if self.conn.their_state is h11.SEND_BODY:
            return "body" if pending else "discarded"
        if pending:
            return "answer"
        return "head" if self.cycle is None or self.conn.trailing_data[0] else "idle"

    def _look(self) -> None:
        """Close the connection if its time is up; look again."""
        self._note()
        now = self.loop.time()
        if self._is_late(now):
            self.transport.abort()
            return
        self._timer = self.loop.call_later(
            min(1.0, self.limits.head / 10, self.limits.grace / 10), self._look
        )

    def _is_late(self, now: float) -> bool:
        spent = now - self.since
        if self.phase in ("head", "discarded"):
            return spent > self.limits.head
        if self.phase == "stuck":
            return spent > self.limits.silence
        if self.phase != "body" or spent < self.limits.grace + self.limits.head:
            return False
        if not self.flow.read_paused and self._bytes - self._bytes_then < self.limits.slowest / 2 * spent:
            return True
        self.since, self._bytes_then = now, self._bytes
        return False

    # -- how many there may be --------------------------------------------------------------------------------

    def _make_room(self) -> None:
        """End the connections that stand in the way of this one, or this one where all others are at work."""
        others = self._others()
        strangers = [c for c in others if not c.known]
        if not _is_here(self.client):
            of_same_host = [c for c in strangers if _host(c) == _host(self)]
            _end(of_same_host, len(of_same_host) + 1 - self.limits.share)
        _end(strangers, len(strangers) + 1 - self.limits.strangers)
        if len(others) < self.most:
            return
        others = self._others()
        waiting = [c for c in others if c.phase != "answer"]
        _end([c for c in waiting if not c.known] or waiting or [self], len(others) + 1 - self.most)

    def _others(self) -> list[PageConnection]:
        others = (c for c in self.connections if isinstance(c, PageConnection) and c is not self)
        return [c for c in others if not c.transport.is_closing()]


def _end(connections: list[PageConnection], number: int) -> None:
    """End those that have waited longest."""
    for one in nsmallest(number, connections, key=lambda c: c.since):
        one.transport.abort()


def _host(connection: PageConnection) -> str:
    return connection.client[0] if connection.client else ""


def _is_here(client: tuple[str, int] | None) -> bool:
    """Whether it comes from this machine: all of its programs have one address."""
    try:
        return client is not None and ipaddress.ip_address(client[0]).is_loopback
    except ValueError:
        return False


def _files() -> int:
    """Files that this process may have open."""
    try:
        import resource
    except ImportError:  # on Windows the limit is far away
        return 1 << 20
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return 1 << 20 if soft == resource.RLIM_INFINITY else soft
