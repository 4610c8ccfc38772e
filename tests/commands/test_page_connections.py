# SPDX-License-Identifier: BSD-3-Clause
"""Connections that say nothing, half of something, or too much: they give way, and the page answers on."""

from __future__ import annotations

import asyncio
import http.client
import re
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest
import uvicorn
from starlette.requests import Request
from uvicorn.server import ServerState

from allanite.commands.page import connections
from allanite.commands.page.application import Application
from allanite.commands.page.connections import PageConnection, connections_within
from allanite.commands.page.events import Streams
from allanite.commands.page.replies import Refused, body_of
from allanite.commands.page.settings import Limits
from page_client import application, served

PATIENCE = 60.0  # [s] nobody is measured here
HALVES = (
    b"",
    b"GET /api/jobs HTTP/1.1\r\nHost: 127.0.0.1\r\n",
    b"POST /api/jobs HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1000\r\n\r\n{",
)


@pytest.fixture
def app(tmp_path: Path) -> Iterator[Application]:
    (tmp_path / "data").mkdir()
    # A head may take as long as this test does: nothing but the number of connections makes room.
    with served(tmp_path / "data", tmp_path / "cache", head=10 * PATIENCE) as app:
        yield app


def opened(app: Application, said: bytes) -> socket.socket:
    found = socket.create_connection(("127.0.0.1", app.settings.port), PATIENCE)
    found.sendall(said)
    return found


def cookie(app: Application) -> str:
    return f"{app.settings.cookie}={app.settings.session}"


def asked(app: Application, path: str = "/api/jobs") -> int:
    """Status of a request with the cookie, over a connection of its own."""
    talk = http.client.HTTPConnection("127.0.0.1", app.settings.port, timeout=PATIENCE)
    try:
        talk.request("GET", path, headers={"Cookie": cookie(app)})
        answer = talk.getresponse()
        answer.read()
        return answer.status
    finally:
        talk.close()


def test_300_half_open_connections_leave_room_for_the_page(app: Application) -> None:
    with ExitStack() as held:
        for number in range(300):
            held.enter_context(opened(app, HALVES[number % len(HALVES)]))
        for _ in range(5):
            assert asked(app) == 200
        again = held.enter_context(opened(app, b""))  # who connects before it speaks is heard, too
        for number in range(60):
            held.enter_context(opened(app, HALVES[number % len(HALVES)]))
        again.sendall(f"GET /api/jobs HTTP/1.1\r\nHost: 127.0.0.1:{app.settings.port}\r\n".encode())
        again.sendall(f"Cookie: {cookie(app)}\r\nConnection: close\r\n\r\n".encode())
        assert again.makefile("rb").readline() == b"HTTP/1.1 200 OK\r\n"


def test_event_streams_of_one_session_leave_room_for_the_page(app: Application) -> None:
    head = f"GET /api/jobs/events HTTP/1.1\r\nHost: 127.0.0.1:{app.settings.port}\r\nCookie: {cookie(app)}\r\n\r\n"
    with ExitStack() as held:
        streams = [held.enter_context(opened(app, head.encode())) for _ in range(255)]
        files = [s.makefile("rb") for s in streams]
        for file in files:
            assert file.readline() == b"HTTP/1.1 200 OK\r\n"
        assert asked(app) == 200
        made_room = len(streams) - app.settings.limits.streams
        for file in files[:made_room]:  # told to come back later, and ended
            retries = re.findall(rb"retry: (\d+)", file.read())
            assert int(retries[-1]) >= 10_000
        for file in files[made_room:]:  # still open
            while not file.readline().startswith(b"event: jobs"):
                pass


def test_answers_that_are_waited_for_leave_threads_to_others(app: Application) -> None:
    """A figure may take half a minute, and somebody may ask for many."""
    (app.settings.folder / "calibration.json").write_text('{"format": "allanite-calibration"}')
    (document,) = app.catalogue.scan()["documents"]
    waiting, go = threading.Semaphore(0), threading.Event()

    def slow(task: Any) -> dict[str, Any]:
        waiting.release()
        go.wait(PATIENCE)
        return {"exit": 0, "result": {}}

    app.quick.ask = slow  # type: ignore[method-assign]
    head = (
        f"GET /api/documents/{document['id']}/parameters HTTP/1.1\r\nHost: 127.0.0.1:{app.settings.port}\r\n"
    )
    with ExitStack() as held:
        asking = [
            held.enter_context(opened(app, f"{head}Cookie: {cookie(app)}\r\n\r\n".encode()))
            for _ in range(60)
        ]
        assert waiting.acquire(timeout=PATIENCE)
        assert asked(app, "/api/catalogue") == 200 and not go.is_set()
        go.set()
        for one in asking:
            assert one.makefile("rb").readline() == b"HTTP/1.1 200 OK\r\n"


@pytest.mark.parametrize(("comes", "status"), [(False, 408), (True, 400)])
def test_the_body_of_a_request_must_come_in_time(comes: bool, status: int) -> None:
    async def receive() -> Any:
        if comes:
            return {"type": "http.disconnect"}
        return await asyncio.get_running_loop().create_future()

    with pytest.raises(Refused) as refused:
        asyncio.run(body_of(Request({"type": "http", "headers": []}, receive), most=100, seconds=0.01))
    assert refused.value.status == status


def test_the_oldest_stream_ends_when_there_is_one_too_many() -> None:
    streams, left = Streams(2), []

    async def look() -> list[bytes]:
        opened = [
            streams.stream(list, over=lambda: False, leave=lambda i=i: left.append(i)).body_iterator
            for i in range(3)
        ]
        for one in opened:
            assert b"retry: 1000" in await anext(one)  # type: ignore[arg-type]
        rest = [part async for part in opened[0]]
        for one in opened[1:]:
            await one.aclose()  # type: ignore[union-attr]
        return rest  # type: ignore[return-value]

    assert asyncio.run(look()) == [b"retry: 15000\n\n"]
    assert left == [0, 1, 2] and not streams._open


# -- by a clock of their own ---------------------------------------------------------------------------------------


class Clock:
    """Of a loop that only has timers, which go off when the test says so."""

    def __init__(self) -> None:
        self.now = 0.0
        self.timers: list[Any] = []

    def time(self) -> float:
        return self.now

    def call_later(self, seconds: float, what: Any, *given: Any) -> Any:
        timer = SimpleNamespace(at=self.now + seconds, what=lambda: what(*given), on=True)
        timer.cancel = lambda: setattr(timer, "on", False)
        self.timers.append(timer)
        return timer

    def create_task(self, work: Any, **_: Any) -> Any:
        work.close()
        return Mock()

    def go(self, seconds: float) -> None:
        """Let time pass."""
        end = self.now + seconds
        while due := sorted((t for t in self.timers if t.on and t.at <= end), key=lambda t: t.at):
            self.now, due[0].on = due[0].at, False
            due[0].what()
        self.now = end


class Wire:
    """A transport."""

    def __init__(self, host: str) -> None:
        self.host, self.open, self.owner = host, True, None

    def get_extra_info(self, name: str) -> Any:
        return {"peername": (self.host, 40_000), "sockname": ("127.0.0.1", 1)}.get(name)

    def is_closing(self) -> bool:
        return not self.open

    def close(self) -> None:
        self.open = False

    abort = close

    def write(self, data: bytes) -> None: ...
    def pause_reading(self) -> None: ...
    def resume_reading(self) -> None: ...


class Port:
    """Where connections come in."""

    def __init__(self, tmp_path: Path, **limits: Any) -> None:
        limits_ = replace(Limits(), **limits)
        self.kind = connections_within(limits_)
        self.state, self.clock = ServerState(), Clock()
        self.config = uvicorn.Config(application(tmp_path, tmp_path).app, log_level="critical")

    def connect(self, *, known: bool = False, host: str = "127.0.0.1") -> PageConnection:
        self.clock.go(0.001)
        made = self.kind(self.config, self.state, {}, self.clock)
        made.connection_made(Wire(host))  # type: ignore[arg-type]
        if known:
            made.data_received(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n")
            made.scope["state"]["known"] = True  # type: ignore[typeddict-unknown-key]
            answered(made)
            made._unset_keepalive_if_required()  # uvicorn's clock is not the one that is looked at here
        return made


def is_open(one: PageConnection) -> bool:
    return not one.transport.is_closing()


def answered(one: PageConnection) -> None:
    """Send a whole answer."""
    for message in (
        {"type": "http.response.start", "status": 401, "headers": []},
        {"type": "http.response.body", "body": b"no"},
    ):
        with suppress(StopIteration):
            one.cycle.send(message).send(None)  # type: ignore[arg-type]


def test_a_head_must_be_complete_in_time(tmp_path: Path) -> None:
    port = Port(tmp_path)
    silent, dripping, timely = (port.connect() for _ in range(3))
    for second in range(9):
        dripping.data_received(b"GET /aaaaaaa"[second : second + 1])
        port.clock.go(1.0)
    timely.data_received(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n")
    assert is_open(silent) and is_open(dripping)
    port.clock.go(3.0)
    assert [is_open(c) for c in (silent, dripping, timely)] == [False, False, True]
    port.clock.go(3600.0)
    assert is_open(timely)  # the answer takes its time


def test_a_second_head_must_be_complete_in_time_too(tmp_path: Path) -> None:
    port = Port(tmp_path)
    one = port.connect(known=True)
    port.clock.go(4.0)
    for _ in range(9):
        one.data_received(b"G")
        port.clock.go(1.0)
    assert is_open(one)
    port.clock.go(3.0)
    assert not is_open(one)


def test_the_body_of_a_refused_request_is_thrown_away_for_a_while_only(tmp_path: Path) -> None:
    port = Port(tmp_path)
    one = port.connect()
    one.data_received(b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 1000000\r\n\r\n")
    answered(one)
    for _ in range(9):
        one.data_received(b"x")
        port.clock.go(1.0)
    assert is_open(one)
    one.data_received(b"x" * 1000)
    port.clock.go(3.0)
    assert not is_open(one)


@pytest.mark.parametrize(("rate", "held"), [(5000, True), (100, False), (0, False)])
def test_a_body_may_take_long_and_must_get_on(tmp_path: Path, rate: int, held: bool) -> None:
    port = Port(tmp_path)
    one = port.connect()
    one.data_received(b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 99999999\r\n\r\n")
    for _ in range(1800):
        if is_open(one) and rate:
            one.data_received(b"x" * rate)
            one.cycle.body.clear()  # as somebody who reads does
            one.flow.resume_reading()
        port.clock.go(1.0)
    assert is_open(one) is held


def test_a_body_that_the_server_does_not_read_is_not_late(tmp_path: Path) -> None:
    port = Port(tmp_path)
    one = port.connect()
    one.data_received(b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 99999999\r\n\r\n" + b"x" * 70_000)
    assert one.flow.read_paused
    port.clock.go(600.0)
    assert is_open(one)


def test_an_answer_must_be_taken(tmp_path: Path) -> None:
    port = Port(tmp_path)
    slow, stuck = (port.connect() for _ in range(2))
    for one in (slow, stuck):
        one.data_received(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n")
    for _ in range(10):
        for one in (slow, stuck):
            if not one.flow.write_paused:
                one.pause_writing()
        port.clock.go(10.0)
        slow.resume_writing()
    assert is_open(slow) and not is_open(stuck)


def test_strangers_give_way_the_oldest_first(tmp_path: Path) -> None:
    port = Port(tmp_path, sockets=8, strangers=3)
    known = [port.connect(known=True) for _ in range(4)]
    strangers = []
    for _ in range(6):
        strangers.append(port.connect())
        port.clock.go(0.1)
    assert all(map(is_open, known)) and [is_open(s) for s in strangers] == [False] * 3 + [True] * 3
    known += [
        port.connect(known=True) for _ in range(4)
    ]  # each comes as a stranger, and takes the place of one
    assert all(map(is_open, known[1:])) and sum(map(is_open, (*known, *strangers))) == 8
    working = [port.connect(known=True) for _ in range(8)]
    for one in working:
        one.data_received(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n")
        one.scope["state"]["known"] = True  # type: ignore[typeddict-unknown-key]
    late = port.connect()
    assert all(map(is_open, working)) and not is_open(late)  # all others are at work


def test_other_machines_have_a_share_each(tmp_path: Path) -> None:
    port = Port(tmp_path, share=2)
    here = [port.connect() for _ in range(9)]
    one = [port.connect(host="one") for _ in range(5)]
    two = port.connect(host="two")
    assert all(map(is_open, here)) and [is_open(c) for c in one] == [False] * 3 + [True] * 2 and is_open(two)


def test_half_of_the_files_that_may_be_open_are_left(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "_files", lambda: 100)
    assert connections_within(Limits()).most == 50
    monkeypatch.setattr(connections, "_files", lambda: 1024)
    assert connections_within(Limits()).most == Limits().sockets
    assert Limits().strangers >= 8 * connections.BACKLOG  # nobody is the oldest before he was heard
