# SPDX-License-Identifier: BSD-3-Clause
"""How long one waits for the page: a series of 20 million samples prepared, opened and zoomed, over HTTP.

    python -m benchmarks.page_speed

A real server in a process of its own. What a browser needs to draw is not in it.
"""

from __future__ import annotations

import json
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np

from .machine import describe, save

SAMPLES = 20_000_000
RATE = 200.0
ZOOMS = 300


class _Page:
    """A browser without a screen."""

    def __init__(self, address: str) -> None:
        self.base = address.split("/?")[0]
        with urllib.request.urlopen(address) as answer:
            self._cookie = answer.headers["Set-Cookie"].split(";")[0]
            found = re.search(r'name="csrf-token" content="([^"]+)"', answer.read().decode())
        assert found is not None
        self._proof = {"X-CSRF-Token": found[1], "Origin": self.base, "Content-Type": "application/json"}

    def ask(self, path: str, data: Any = None) -> bytes:
        body = None if data is None else json.dumps(data).encode()
        headers = {"Cookie": self._cookie, **({} if data is None else self._proof)}
        with urllib.request.urlopen(urllib.request.Request(self.base + path, body, headers)) as answer:
            return bytes(answer.read())


def _timed(page: _Page, path: str, data: Any = None) -> tuple[float, bytes]:
    begin = time.perf_counter()
    found = page.ask(path, data)
    return time.perf_counter() - begin, found


def measure(page: _Page) -> dict[str, Any]:
    """Seconds of each step."""
    (recording,) = json.loads(page.ask("/api/catalogue"))["recordings"]
    way, how = f"/api/recordings/{recording['id']}/open", {"read": {"unit": "deg/s", "rate": RATE}}
    begin = time.perf_counter()
    job = json.loads(page.ask(way, how))["job"]
    while job["state"] in ("queued", "running"):
        time.sleep(0.01)
        job = json.loads(page.ask(f"/api/jobs/{job['id']}"))["job"]
    assert job["state"] == "done", job["message"]
    prepared = time.perf_counter() - begin
    opened, answer = _timed(page, way, how)
    series = json.loads(answer)["series"]["id"]
    first, whole = _timed(page, f"/api/series/{series}/window")
    rng, spent = np.random.default_rng(1), []
    for _ in range(ZOOMS):
        length = SAMPLES / RATE * 10 ** -rng.uniform(0, 5)
        start = rng.uniform(0, SAMPLES / RATE - length)
        spent.append(_timed(page, f"/api/series/{series}/window?from={start}&to={start + length}")[0])
    return {
        "prepared_s": prepared,
        "opened_s": opened,
        "first_s": first,
        "first_bytes": len(whole),
        "zoom_median_ms": 1e3 * statistics.median(spent),
        "zoom_p99_ms": 1e3 * sorted(spent)[int(0.99 * ZOOMS)],
    }


def main() -> None:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "data"
        folder.mkdir()
        samples = np.random.default_rng(1).standard_normal(SAMPLES)
        samples[SAMPLES // 3 : SAMPLES // 3 + 1000] = np.nan
        np.save(folder / "log.npy", samples)
        server = subprocess.Popen(
            [sys.executable, "-m", "allanite", "serve", str(folder), "--no-browser"],
            stdout=subprocess.PIPE, text=True, env={**os.environ, "XDG_CACHE_HOME": str(Path(place) / "cache")},
        )  # fmt: skip
        try:
            assert server.stdout is not None
            found = measure(_Page(server.stdout.readline().strip()))
        finally:
            server.send_signal(signal.SIGINT)
            server.wait()
    result = {
        "machine": describe("starlette", "uvicorn"),
        "samples": SAMPLES,
        **found,
        "notes": [
            f"{SAMPLES} samples of one channel out of a .npy; a new connection for each request",
            f"zoom: {ZOOMS} windows of all lengths, at most 1500 blocks each",
        ],
    }
    rows = [
        ["first time: read, pyramid, written", f"{1e3 * found['prepared_s']:.0f}"],
        ["opened again", f"{1e3 * found['opened_s']:.1f}"],
        ["whole record, as blocks", f"{1e3 * found['first_s']:.1f}"],
        ["zoom, median", f"{found['zoom_median_ms']:.1f}"],
        ["zoom, 99 %", f"{found['zoom_p99_ms']:.1f}"],
    ]
    print(save("page_speed", "A long series on the page", result, ["step", "ms"], rows))


if __name__ == "__main__":
    main()
