# SPDX-License-Identifier: BSD-3-Clause
"""The pictures of docs/howto/page.md, taken anew: `python tests/page_pictures.py [NAME...]`.

Logs are simulated with fixed seeds, results made by the commands, and the page shown by Chromium, as its user sees it.
"""

from __future__ import annotations

import io
import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Callable
from math import radians
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import allanite as al
from allanite.commands.page.server import address_of
from allanite.commands.page.settings import RESULTS
from page_client import served
from real_browser import opened_browser

IMAGES = Path(__file__).resolve().parents[1] / "docs" / "images"
WIDTH, LOW, HIGH = 1280, 800, 1100  # [pixels]
DRAWN = ".plot[data-drawn]"

Scene = Callable[[Any, str], int]


# -- what lies in the folder ----------------------------------------------------------------------------------------


def unit(path: Path, *, seed: int, white: float) -> None:
    """Ten minutes of six axes at 100 Hz, with the biases of such sensors."""
    gyro = al.model_of(f"N={white} deg/√h, B=12 deg/h")
    model = {"x": gyro, "y": gyro, "z": gyro}
    simulated = al.simulate(model, rate=100.0, duration=600.0, seed=seed, unit="deg/s")
    rates = np.column_stack([simulated.values(axis) for axis in model])
    rng = np.random.default_rng(seed)
    specific_force = rng.normal(scale=0.04, size=rates.shape) + [0.03, -0.05, 9.80665]
    table = np.column_stack([np.arange(len(rates)) / 100, rates + [0.2, -0.1, 0.3], specific_force])
    names = "time_s,gyro_x_deg_s,gyro_y_deg_s,gyro_z_deg_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2"
    np.savetxt(path, table, delimiter=",", header=names, comments="", fmt="%.5f")


def counts(path: Path) -> None:
    """Half an hour of whole numbers, as a register gives them."""
    rng = np.random.default_rng(3)
    table = rng.normal(scale=[40] * 3 + [60] * 3, size=(180_000, 6)) + [0, 0, 0, 0, 0, 16384]
    table = np.column_stack([np.arange(180_000) * 10_000, np.round(table)])
    np.savetxt(path, table, delimiter=",", header="timestamp_us,gx,gy,gz,ax,ay,az", comments="", fmt="%d")


def takes(folder: Path) -> None:
    """A gyro turned between north and south every minute, and one on a table with eight positions."""
    bench: dict[str, Any] = {"rate": 10.0, "unit": "deg/h"}
    level = al.model_of("N=0.02 deg/√h")
    motion = al.Motion.reversals(60.0)
    simulated = al.simulate(level, duration=1200.0, seed=4, motion=motion, latitude=radians(23.3), **bench)
    al.write_recording(simulated, folder / "earth-take.parquet")
    headings = [45.0 * k for k in range(8)]
    around = al.Motion.positions([radians(29 + heading) for heading in headings], dwell=300.0)
    simulated = al.simulate(level, duration=2400.0, seed=2, motion=around, latitude=radians(48.1), **bench)
    al.write_recording(simulated, folder / "table.parquet")
    rows = [f"{300 * k + (3 if k else 0)},{300 * (k + 1)},{heading}\n" for k, heading in enumerate(headings)]
    (folder.parent / "headings.csv").write_text("start,stop,heading\n" + "".join(rows))


def filled(folder: Path) -> None:
    """Logs of two units, takes, and results of commands."""
    unit(folder / "bench-unit-07.csv", seed=7, white=0.3)
    unit(folder / "bench-unit-08.csv", seed=8, white=0.36)
    takes(folder)
    noise = '--model "N=0.02 deg/√h"'
    results = {
        "bench-unit-07-characterize": "characterize bench-unit-07.csv",
        "bench-unit-07-variation": "variation bench-unit-07.csv",
        "bench-unit-07-compare": "compare bench-unit-07.csv bench-unit-08.csv",
        "table-north": f"north table.parquet --latitude 48.1 --headings ../headings.csv {noise}",
        "earth-take-earth-rate": f"earth-rate earth-take.parquet --latitude 23.3 --first north {noise}",
    }
    for name, command in results.items():
        words = [sys.executable, "-m", "allanite", *shlex.split(command), "--out", f"{RESULTS}/{name}"]
        subprocess.run(words, cwd=folder, stdout=subprocess.DEVNULL, check=False)  # a finding is no failure


# -- what is shown --------------------------------------------------------------------------------------------------


def at(page: Any, base: str, address: str) -> None:
    page.goto(f"{base}{address}")
    page.locator(f"html:has(#main-nav a[href='{address}'][aria-current]) main h1").wait_for()


def recording(page: Any, base: str, name: str) -> None:
    at(page, base, "#/")
    page.locator("#side-files a", has_text=name).click()
    page.locator(f".series {DRAWN}").wait_for()


def result(page: Any, base: str, kind: str) -> int:
    at(page, base, "#/results")
    page.locator("main").get_by_role("link", name=kind, exact=True).click()
    page.locator(f"main {DRAWN}").first.wait_for()
    return HIGH


def series(page: Any, base: str) -> int:
    recording(page, base, "bench-unit-08.csv")
    return LOW


def noise(page: Any, base: str) -> int:
    recording(page, base, "bench-unit-07.csv")
    page.locator(f".study .noise {DRAWN}").wait_for()
    return LOW


def not_said(page: Any, base: str) -> int:
    recording(page, base, "mpu6050.csv")
    page.get_by_label(re.compile("^Gyroscope")).select_option(label="131 LSB/(deg/s) (±250 deg/s)")
    return LOW


def earth_rate(page: Any, base: str) -> int:
    recording(page, base, "earth-take.parquet")
    page.get_by_role("radio", name="Earth rate and north").check()
    form = page.get_by_role("region", name="Measurement")
    form.get_by_label("Latitude [deg]").fill("23.3")
    form.get_by_label("Model", exact=True).select_option("in words")
    form.get_by_label("Model in words").fill("N=0.02 deg/√h")
    form.get_by_label("First", exact=True).select_option("north")
    page.get_by_role("button", name="Measure").click()
    page.locator("main .banner").first.wait_for()
    page.get_by_role("button", name="detected turns").click()
    page.locator(".marks input").first.wait_for()
    return HIGH


def plan(page: Any, base: str) -> int:
    at(page, base, "#/plan")
    page.locator(f"main {DRAWN}").first.wait_for()
    return HIGH


def results(page: Any, base: str) -> int:
    at(page, base, "#/results")
    page.get_by_role("link", name="North", exact=True).wait_for()
    return LOW


def live(page: Any, base: str) -> int:
    page.get_by_role("button", name="Dark").click()
    at(page, base, "#/capture")
    page.get_by_role("button", name="Start").click()
    page.get_by_role("group", name="Series so far").and_(page.locator("[data-drawn]")).wait_for()
    page.wait_for_timeout(20_000)  # what a picture of a capture needs
    return HIGH


SCENES: dict[str, Scene] = {
    "results": results,
    "series": series,
    "noise": noise,
    "counts": not_said,
    "closer": lambda page, base: result(page, base, "Variation"),
    "earth-rate": earth_rate,
    "north": lambda page, base: result(page, base, "North"),
    "plan": plan,
    "compare": lambda page, base: result(page, base, "Comparison"),
    "live": live,
}


def taken(page: Any, height: int) -> Image.Image:
    """The window from its upper end, in few colors: a quarter of the size."""
    page.set_viewport_size({"width": WIDTH, "height": height})
    page.evaluate("() => document.activeElement?.blur()")
    page.wait_for_timeout(500)  # drawings follow the size of the window
    page.evaluate("() => scrollTo(0, 0)")
    return Image.open(io.BytesIO(page.screenshot())).convert("P", palette=Image.Palette.ADAPTIVE, colors=64)


def main(names: list[str]) -> None:
    """Take the pictures of these scenes, or of all."""
    chosen = names or list(SCENES)
    with tempfile.TemporaryDirectory() as scratch, opened_browser() as browser:
        folder = Path(scratch) / "recordings"
        folder.mkdir()
        filled(folder)
        counts(folder / "mpu6050.csv")
        os.environ["XDG_CACHE_HOME"] = scratch
        with served(folder, Path(scratch) / "cache", look=0.5) as app:
            address = address_of(app.settings)
            for name in chosen:
                page = browser.new_page(viewport={"width": WIDTH, "height": LOW})
                page.goto(address)
                height = SCENES[name](page, address.split("?")[0])
                taken(page, height).save(IMAGES / f"page-{name}.png", optimize=True)
                page.close()
                print(f"page-{name}.png", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
