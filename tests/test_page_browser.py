# SPDX-License-Identifier: BSD-3-Clause
"""The page in a real browser: from a dropped log to imu.yaml, zoom, marks, plans, captures, cancelled work."""

from __future__ import annotations

import re
import shutil
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.page.application import Application
from allanite.page.settings import Limits, Settings

SERIES = ".series .plot[data-drawn]"
STUDY = ".study .plot[data-drawn]"


def imu_log(path: Path, *, units: bool = True, n: int = 1500) -> Path:
    """A log of six axes at 50 Hz; without units and time where that is asked for."""
    rng = np.random.default_rng(4)
    table = np.column_stack([rng.standard_normal((n, 3)) * 0.04, rng.standard_normal((n, 3)) * 0.01])
    table[:, 5] += 9.81
    if units:
        table = np.column_stack([np.arange(n) / 50.0, table])
    axes = [f"{kind}_{axis}" for kind in ("gyro", "acc") for axis in "xyz"]
    suffix = {"gyro": "_deg_s", "acc": "_m_s2"} if units else {"gyro": "", "acc": ""}
    names = ["time_s"] * units + [f"{a}{suffix[a[:-2]]}" for a in axes]
    np.savetxt(path, table, delimiter=",", header=",".join(names), comments="", fmt="%.6f")
    return path


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """Address of a page, with its token, and its folder."""
    import uvicorn

    folder, cache = tmp_path_factory.mktemp("recordings"), tmp_path_factory.mktemp("cache")
    imu_log(folder / "bench.csv")
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))
        bound.listen(64)
        settings = Settings(
            folder=folder.resolve(), port=bound.getsockname()[1], cache=cache, limits=Limits(ahead=False)
        )
        application = Application(settings)
        server = uvicorn.Server(uvicorn.Config(application.app, log_level="warning", access_log=False))
        application.ending = lambda: server.should_exit
        thread = threading.Thread(target=server.run, kwargs={"sockets": [bound]}, daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{settings.port}/?token={settings.token}", folder
        server.should_exit = True
        thread.join(20)
    assert not thread.is_alive()


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    api = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed: pip install playwright"
    )
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("no chromium: sudo apt-get install chromium")
    quiet = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]
    with api.sync_playwright() as play:
        opened = play.chromium.launch(executable_path=program, args=quiet)
        yield opened.new_context(
            viewport={"width": 1280, "height": 900}
        )  # one, so that scripts are fetched once
        opened.close()


@pytest.fixture
def page(chromium: Any, served: tuple[str, Path]) -> Iterator[Any]:
    """A fresh window of the page; it must neither complain nor ask anybody else."""
    address, _ = served
    opened = chromium.new_page()
    complaints: list[str] = []
    opened.on("console", lambda m: complaints.append(m.text) if m.type in ("error", "warning") else None)
    opened.on("pageerror", lambda error: complaints.append(str(error)))
    own = address.split("?")[0]
    opened.on(
        "request",
        lambda r: None if r.url.startswith((own, "data:", "blob:")) else complaints.append(f"asks {r.url}"),
    )
    opened.goto(address)
    yield opened
    opened.close()
    assert not complaints


def test_from_a_dropped_log_to_imu_yaml_in_two_clicks(
    page: Any, served: tuple[str, Path], tmp_path: Path
) -> None:
    page.locator("#drop-input").set_input_files(imu_log(tmp_path / "dropped.csv"))
    page.locator(SERIES).wait_for(timeout=30_000)
    assert "token" not in page.url
    page.get_by_role("button", name="Characterize").click()
    page.locator(STUDY).wait_for(timeout=60_000)
    with page.expect_download() as caught:
        page.get_by_role("button", name="imu.yaml").click()
    written = Path(caught.value.path()).read_text()
    (own,) = served[1].glob("allanite-results/*/imu.yaml")
    assert written == own.read_text()
    assert re.search(r"gyroscope_noise_density: \d", written)
    assert re.search(
        r"allanite characterize allanite-dropped/\S+ --out", page.locator(".study .same").text_content()
    )
    # The table says what the study says, in the unit that is chosen.
    row = page.locator(".parameters tbody tr", has_text="random walk").first
    in_people = float(row.locator(".value").text_content())
    row.get_by_role("combobox").select_option("rad/s/√Hz")
    assert float(row.locator(".value").text_content().replace("−", "-")) == pytest.approx(
        in_people / 3437.7467707849396, rel=1e-3
    )
    # Terms off, and an averaging time left out by the list beside the curve.
    page.get_by_label(re.compile("^N white")).uncheck()
    page.get_by_text("Leave averaging times out").click()
    page.get_by_label("0.02 s", exact=True).check()
    assert page.get_by_role("button", name="Fit again").is_visible()


def test_zoom_shows_every_sample_turns_are_marked_and_work_is_cancelled(page: Any) -> None:
    page.get_by_role("link", name="bench.csv").click()
    plot = page.locator(SERIES)
    plot.wait_for(timeout=30_000)
    before = plot.get_attribute("data-drawn")
    box = plot.bounding_box()
    page.mouse.move(box["x"] + 300, box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 360, box["y"] + 62, steps=3)
    page.mouse.up()
    page.locator(".series .plot[data-drawn='samples 1']").wait_for(timeout=5000)
    assert before != "samples 1" or "s on screen" in page.locator(".series [role=status]").text_content()
    plot.press("Home")
    page.locator(".series [role=status]", has_text="30 s on screen").wait_for(timeout=5000)
    # What is marked becomes a row that can be corrected by hand.
    page.get_by_role("radio", name="Earth rate and north").check()
    page.get_by_role("button", name="Mark turns").click()
    page.locator(".series .drag[data-subplot='xy'].nsewdrag").wait_for()
    page.wait_for_timeout(300)
    box = plot.bounding_box()
    page.mouse.move(box["x"] + 400, box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 460, box["y"] + 62, steps=3)
    page.mouse.up()
    page.locator(".marks input").first.wait_for(timeout=5000)
    start, stop = (float(i.input_value()) for i in page.locator(".marks input").all())
    assert 0 < start < stop < 30
    # Work can be cancelled, and begun again.
    page.get_by_role("radio", name="Noise").check()
    page.get_by_role("button", name="Characterize").click()
    page.get_by_role("main").get_by_role("button", name=re.compile("^Cancel")).click()
    page.get_by_role("main").locator(".job.cancelled").wait_for(timeout=5000)
    assert page.get_by_role("button", name="Characterize").is_enabled()


def test_what_a_file_does_not_say_is_asked_in_the_same_place(page: Any, tmp_path: Path) -> None:
    page.locator("#drop-input").set_input_files(imu_log(tmp_path / "bare.csv", units=False, n=400))
    page.get_by_role("alert").wait_for(timeout=30_000)
    assert "rate" in page.get_by_role("alert").text_content()
    page.get_by_label("Samples per second").fill("50")
    page.get_by_label("Unit of the samples").fill("gyro=deg/s, acc=m/s^2")
    page.get_by_role("button", name="Open with this").click()
    page.locator(SERIES).wait_for(timeout=30_000)
    assert "8 s" in page.locator("#series-title").text_content()


def test_a_capture_is_started_watched_and_stopped(page: Any) -> None:
    page.get_by_role("link", name="Capture").click()
    page.get_by_role("button", name="Start").click()
    page.get_by_role("img", name="Series so far").and_(page.locator("[data-drawn]")).wait_for(timeout=30_000)
    page.get_by_role("button", name="Stop").click()
    page.get_by_text("The run is over and closed.").wait_for(timeout=15_000)
    assert page.get_by_role("button", name="Stop").count() == 0


def test_sliders_plan_and_everything_that_can_be_operated_has_a_name(page: Any) -> None:
    """Also without a mouse: every control is reached by the keyboard and says what it is."""
    page.get_by_role("link", name="Plan").click()
    amount = page.locator(".amount")
    amount.wait_for(timeout=30_000)
    before = float(amount.text_content().split()[0])
    page.get_by_role("slider", name="Length of the record").press("End")
    until = time.monotonic() + 10
    while float(amount.text_content().split()[0]) >= before / 3 and time.monotonic() < until:
        page.wait_for_timeout(50)
    assert float(amount.text_content().split()[0]) < before / 3
    for address in ("", "#/compare", "#/plan", "#/capture"):
        page.goto(page.url.split("#")[0] + address)
        page.locator("main h1").wait_for()
        nameless = page.locator("button, select, input, a[href]").evaluate_all(
            """all => all.filter(e => e.offsetParent !== null && !(e.textContent.trim()
               || e.getAttribute("aria-label") || [...(e.labels || [])].some(l => l.textContent.trim())))
               .map(e => e.outerHTML)"""
        )
        assert not nameless
        ids = page.locator("[id]").evaluate_all("all => all.map(e => e.id)")
        assert len(set(ids)) == len(ids)
