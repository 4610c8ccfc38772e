# SPDX-License-Identifier: BSD-3-Clause
"""The page while others hold its connections: how long somebody with a session waits for an answer.

The server is `allanite serve` in a process of its own. Sockets that it closes are opened again every second, so that it
is held all the time.
"""

from __future__ import annotations

import http.client
import os
import re
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

__all__ = ["run_held", "run_streams"]

Json = dict[str, Any]
#: The longest that an answer may take [s].
_BAR = 1.0
_EVERY = 0.25  # [s] between two requests
_AGAIN = 1.0  # [s] between two looks at which sockets were closed
_UPLOAD = 8000  # [bytes/s] of an upload that goes on all the time
_HALVES = {
    "silent": b"",
    "half a head": b"GET /api/jobs HTTP/1.1\r\nHost: 127.0.0.1\r\n",
    "half a body": b"POST /api/jobs HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1000\r\n\r\n{",
}


class _Page:
    """A page that is served, and a session of it."""

    def __init__(self, address: str) -> None:
        base, _, path = address.removeprefix("http://").partition("/")
        self.host, _, port = base.partition(":")
        self.port = int(port)
        talk = http.client.HTTPConnection(self.host, self.port, timeout=60)
        talk.request("GET", f"/{path}")
        answer = talk.getresponse()
        found = re.search(r'name="csrf-token" content="([^"]+)"', answer.read().decode())
        assert found is not None
        self.cookie = answer.headers["Set-Cookie"].partition(";")[0]
        self.proof = {
            "Cookie": self.cookie,
            "X-CSRF-Token": found[1],
            "Origin": f"http://{base}",
            "Content-Type": "application/octet-stream",
        }
        talk.close()

    def open(self, said: bytes) -> socket.socket:
        made = socket.create_connection((self.host, self.port), 60)
        made.sendall(said)
        made.setblocking(False)
        return made

    def asked(self) -> tuple[float, int]:
        """Time until the answer over a connection of its own is there [s], and its status; 0 for none."""
        began = time.perf_counter()
        talk = http.client.HTTPConnection(self.host, self.port, timeout=60)
        try:
            talk.request("GET", "/api/jobs", headers={"Cookie": self.cookie})
            answer = talk.getresponse()
            answer.read()
            return time.perf_counter() - began, answer.status
        except OSError:
            return time.perf_counter() - began, 0
        finally:
            talk.close()


@contextmanager
def _served() -> Iterator[_Page]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "recordings"
        folder.mkdir()
        server = subprocess.Popen(
            [sys.executable, "-m", "allanite", "serve", str(folder), "--no-browser"],
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "XDG_CACHE_HOME": name, "PYTHONUNBUFFERED": "1"},
        )
        try:
            assert server.stdout is not None
            yield _Page(server.stdout.readline().strip())
        finally:
            server.terminate()
            server.wait(60)


def run_held(seconds: float, say: Callable[[str], None], *, sockets: int = 300) -> list[Json]:
    """Idle sockets of all kinds, a slow upload, and a session that asks four times a second."""
    with _served() as page:
        uploaded: list[int] = []
        upload = threading.Thread(target=lambda: uploaded.append(_slowly(page, seconds)))
        upload.start()
        kinds = [list(_HALVES.values())[i % len(_HALVES)] for i in range(sockets)]
        held = [page.open(said) for said in kinds]
        spent, failed, again = [], 0, 0
        end = time.monotonic() + seconds
        due = time.monotonic() + _AGAIN
        while time.monotonic() < end:
            if time.monotonic() > due:
                due += _AGAIN
                for i in (i for i, one in enumerate(held) if _is_closed(one)):
                    held[i].close()
                    held[i] = page.open(kinds[i])
                    again += 1
            took, status = page.asked()
            spent.append(took)
            failed += status != 200
            if len(spent) % 200 == 0:
                say(f"page held: {len(spent)} answers, the slowest after {1e3 * max(spent):.0f} ms")
            time.sleep(_EVERY)
        upload.join()
        for one in held:
            one.close()
    row = {"sockets": sockets, "kinds": ", ".join(_HALVES), "seconds": round(seconds), "opened_again": again}
    return [
        row | _times(spent, failed) | {"upload_at_8_kB_per_s": "kept" if uploaded == [201] else "broken off"}
    ]


def run_streams(say: Callable[[str], None], *, streams: int = 255, requests: int = 40) -> list[Json]:
    """Event streams of one session, and the same session that asks."""
    with _served() as page:
        head = (
            f"GET /api/jobs/events HTTP/1.1\r\nHost: {page.host}:{page.port}\r\nCookie: {page.cookie}\r\n\r\n"
        )
        held = [page.open(head.encode()) for _ in range(streams)]
        found = [page.asked() for _ in range(requests)]
        for one in held:
            one.close()
    say(f"page with {streams} streams: {requests} answers")
    failed = sum(status != 200 for _, status in found)
    return [{"streams": streams} | _times([took for took, _ in found], failed)]


def _times(spent: list[float], failed: int) -> Json:
    return {
        "requests": len(spent),
        "failed": failed,
        "shortest_ms": round(1e3 * min(spent), 1),
        "median_ms": round(1e3 * statistics.median(spent), 1),
        "longest_ms": round(1e3 * max(spent), 1),
        "passes": not failed and max(spent) < _BAR,
    }


def _slowly(page: _Page, seconds: float) -> int:
    """Status of an upload that takes so long."""
    line = b"1.0,2.0\n" * (_UPLOAD // 8)
    pieces = max(round(seconds), 1)
    talk = http.client.HTTPConnection(page.host, page.port, timeout=60)
    talk.putrequest("POST", "/api/upload")
    for name, value in {
        **page.proof,
        "X-File-Name": "slow.csv",
        "Content-Length": str(pieces * len(line)),
    }.items():
        talk.putheader(name, value)
    try:
        talk.endheaders()
        for _ in range(pieces):
            talk.send(line)
            time.sleep(1.0)
        return talk.getresponse().status
    except OSError:
        return 0
    finally:
        talk.close()


def _is_closed(one: socket.socket) -> bool:
    """Whether the server has closed a connection; what it says is thrown away."""
    try:
        while said := one.recv(4096):
            del said
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True
