# SPDX-License-Identifier: BSD-3-Clause
"""How long one waits for the page: a series of 20 million samples prepared, opened and zoomed, over HTTP.

    python -m benchmarks.page_speed

A real server in a process of its own, asked over HTTP; then a real browser without a screen, from the click on the
recording, or the end of a stroke over the series, until the picture is painted. The latter is left out where
playwright or chromium is not installed.
"""

from __future__ import annotations

import json
import os
import re
import shutil
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
OPENED = 7  # times, in the browser
STROKES = 25

#: Milliseconds from an event to the paint after the next drawing of the series.
_WATCH = """
() => {
  const plot = () => document.querySelector(".series .plot");
  const painted = (then) => requestAnimationFrame(() => setTimeout(() => then(performance.now())));
  window.spent = (event) => new Promise((resolve) => {
    let begin = null;
    window.addEventListener(event, (e) => {
      begin = e.timeStamp;
      new MutationObserver((news, watcher) => {
        if (!news.some((one) => one.target === plot())) return;
        watcher.disconnect();
        painted((end) => resolve(end - begin));
      }).observe(document.body, { subtree: true, attributeFilter: ["data-drawn"] });
    }, { capture: true, once: true });
  });
}
"""


class _Page:
    """A browser without a screen."""

    def __init__(self, address: str) -> None:
        self.base = address.split("/?")[0]
        with urllib.request.urlopen(address) as answer:
            self._cookie = answer.headers["Set-Cookie"].split(";")[0]
            token = re.search(r'name="csrf-token" content="([^"]+)"', answer.read().decode())
        assert token is not None
        self._proof = {"X-CSRF-Token": token[1], "Origin": self.base, "Content-Type": "application/json"}

    def ask(self, path: str, data: Any = None) -> bytes:
        body = None if data is None else json.dumps(data).encode()
        headers = {"Cookie": self._cookie, **({} if data is None else self._proof)}
        with urllib.request.urlopen(urllib.request.Request(self.base + path, body, headers)) as answer:
            return bytes(answer.read())


def _timed(page: _Page, path: str, data: Any = None) -> tuple[float, bytes]:
    begin = time.perf_counter()
    answer = page.ask(path, data)
    return time.perf_counter() - begin, answer


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


def measure_browser(address: str) -> dict[str, Any]:
    """Milliseconds until something is painted; empty without a browser."""
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        program = None
    if program is None:
        return {}
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=program, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.goto(address)
        opened = [_opened(page) for _ in range(OPENED)]
        strokes = [_stroke(page, n) for n in range(STROKES)]
        reloaded = _reloaded(page)
        version = browser.version
        browser.close()
    return {
        "browser": f"Chromium {version}",
        "screen_median_ms": statistics.median(opened),
        "screen_worst_ms": max(opened),
        "screen_reload_ms": reloaded,
        "drawn_median_ms": statistics.median(strokes),
        "drawn_p90_ms": sorted(strokes)[int(0.9 * STROKES)],
        "drawn_worst_ms": max(strokes),
    }


def _opened(page: Any) -> float:
    """Click on the recording; the pyramid is there already, the view is not."""
    page.evaluate("location.hash = '#/'")
    page.locator("main h1", has_text="Recordings of").wait_for()
    page.evaluate(_WATCH)
    waiting = page.evaluate_handle("({ end: spent('click') })")
    page.get_by_role("link", name="log.npy").click()
    return float(waiting.evaluate("w => w.end"))


def _stroke(page: Any, number: int) -> float:
    """A stroke of the pointer over a third of what is on screen; each fourth time over the whole record again."""
    plot = page.locator(".series .plot")
    if number % 4 == 0:
        plot.press("Home")
        page.wait_for_timeout(500)
    box = plot.bounding_box()
    x, y = box["x"] + 120 + 37 * (number % 9), box["y"] + box["height"] / 2
    waiting = page.evaluate_handle("({ end: spent('mouseup') })")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + box["width"] / 3, y + 2, steps=4)
    page.mouse.up()
    spent = float(waiting.evaluate("w => w.end"))
    page.wait_for_timeout(400)  # two strokes in a row would be a double click
    return spent


def _reloaded(page: Any) -> float:
    """From nothing: the page itself, its scripts out of the cache of the browser, and the series."""
    page.reload(wait_until="commit")
    page.locator(".series .plot[data-drawn]").wait_for()
    return float(page.evaluate("() => performance.now()"))


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
            address = server.stdout.readline().strip()
            seconds = measure(_Page(address))
            drawn = measure_browser(address)
        finally:
            server.send_signal(signal.SIGINT)
            server.wait()
    result = {
        "machine": describe("starlette", "uvicorn"),
        "samples": SAMPLES,
        **seconds,
        **drawn,
        "notes": [
            f"{SAMPLES} samples of one channel out of a .npy; a new connection for each request",
            f"zoom: {ZOOMS} windows of all lengths, at most 1500 blocks each",
            *_notes(drawn),
        ],
    }
    rows = [
        ["first time: read, pyramid, written", f"{1e3 * seconds['prepared_s']:.0f}"],
        ["opened again", f"{1e3 * seconds['opened_s']:.1f}"],
        ["whole record, as blocks", f"{1e3 * seconds['first_s']:.1f}"],
        ["zoom, median", f"{seconds['zoom_median_ms']:.1f}"],
        ["zoom, 99 %", f"{seconds['zoom_p99_ms']:.1f}"],
    ]
    if drawn:
        rows += [
            ["on screen after the click, median", f"{drawn['screen_median_ms']:.0f}"],
            ["on screen after the click, worst", f"{drawn['screen_worst_ms']:.0f}"],
            ["on screen after a reload of the page", f"{drawn['screen_reload_ms']:.0f}"],
            ["zoom drawn, median", f"{drawn['drawn_median_ms']:.0f}"],
            ["zoom drawn, 90 %", f"{drawn['drawn_p90_ms']:.0f}"],
            ["zoom drawn, worst", f"{drawn['drawn_worst_ms']:.0f}"],
        ]
    print(save("page_speed", "A long series on the page", result, ["step", "ms"], rows))


def _notes(drawn: dict[str, Any]) -> list[str]:
    if not drawn:
        return ["playwright or chromium is not installed: nothing was drawn"]
    return [
        f"{drawn['browser']} without a screen and without a graphics processor, 1280 x 900 pixels",
        f"on screen: {OPENED} clicks on the recording, until the paint",
        f"drawn: {STROKES} strokes with the pointer, from its release until the paint",
    ]


if __name__ == "__main__":
    main()
