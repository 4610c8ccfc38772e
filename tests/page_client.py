# SPDX-License-Identifier: BSD-3-Clause
"""A page as a browser asks it: with its address, its cookie and the secret of its requests; and a server of its own."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx2 as httpx
import numpy as np
from starlette.testclient import TestClient

from allanite.commands.page.application import Application
from allanite.commands.page.attached import Named
from allanite.commands.page.server import listening, server_of
from allanite.commands.page.settings import Limits, Settings
from allanite.files.recording_file import write_recording
from allanite.recording.records import Recording

__all__ = ["PORT", "Browser", "application", "noise", "served", "small_log"]

PORT = 8123
BASE = f"http://127.0.0.1:{PORT}"


def application(
    folder: Path, cache: Path, *, port: int = PORT, instruments: tuple[Named, ...] = (), **limits: Any
) -> Application:
    """The application over a folder."""
    return Application(
        Settings(
            folder=folder.resolve(),
            port=port,
            cache=cache,
            instruments=instruments,
            limits=replace(Limits(), **{"ahead": False, "look": 0.05, **limits}),
        )
    )


@contextmanager
def served(folder: Path, cache: Path, **limits: Any) -> Iterator[Application]:
    """The application behind a socket, as `allanite serve` has it, in a thread of this process."""
    with listening("127.0.0.1", 0) as bound:
        app = application(folder, cache, port=bound.getsockname()[1], **limits)
        server = server_of(app)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [bound]}, daemon=True)
        thread.start()
        try:
            while not server.started and thread.is_alive():
                time.sleep(0.01)
            yield app
        finally:
            server.should_exit = True
            thread.join(60)
    assert not thread.is_alive()


class Browser:
    """What a browser keeps between requests; use it as a context to have workers as well."""

    def __init__(self, app: Application, *, enter: bool = True) -> None:
        self.app = app
        self.client = TestClient(app.app, base_url=BASE, raise_server_exceptions=False)
        self.csrf = ""
        if enter:
            page = self.client.get(f"/?token={app.settings.token}")
            assert page.status_code == 200
            found = re.search(r'name="csrf-token" content="([^"]+)"', page.text)
            assert found is not None
            self.csrf = found.group(1)

    def __enter__(self) -> Browser:
        self.client.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self.client.__exit__(None, None, None)

    @property
    def proof(self) -> dict[str, str]:
        """Headers of a request that changes something."""
        return {"X-CSRF-Token": self.csrf, "Origin": BASE}

    def get(self, path: str, **options: Any) -> httpx.Response:
        return self.client.get(path, **options)

    def post(self, path: str, data: Mapping[str, Any] | None = None) -> httpx.Response:
        return self.client.post(path, json=data or {}, headers=self.proof)

    def names(self) -> dict[str, str]:
        """Ids of the recordings by their names."""
        return {r["name"]: r["id"] for r in self.get("/api/catalogue").json()["recordings"]}

    def start(self, **request: Any) -> dict[str, Any]:
        """Start a job."""
        answer = self.post("/api/jobs", request)
        assert answer.status_code == 202, answer.text
        return dict(answer.json()["job"])

    def wait(self, job: Mapping[str, Any], seconds: float = 60.0) -> dict[str, Any]:
        """A job once it is over."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            found = self.get(f"/api/jobs/{job['id']}").json()["job"]
            if found["state"] not in ("queued", "running"):
                return dict(found)
            time.sleep(0.02)
        raise AssertionError(f"still {found['state']} after {seconds} s: {found}")

    def recording(self, name: str) -> str:
        return self.names()[name]


def noise(n: int = 1200, seed: int = 1) -> np.ndarray:
    """Rates of a sensor at rest [rad/s]."""
    rng = np.random.default_rng(seed)
    return 1e-4 * rng.standard_normal(n) + 1e-6 * np.cumsum(rng.standard_normal(n)) + 1e-3


def small_log(folder: Path, name: str = "gyro.csv", seed: int = 1) -> Path:
    """A short log of one axis."""
    recording = Recording.from_rate(noise(seed=seed), rate=10.0, unit="rad/s", names=["gyro"])
    return write_recording(recording, folder / name)
