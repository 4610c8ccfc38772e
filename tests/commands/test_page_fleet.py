# SPDX-License-Identifier: BSD-3-Clause
"""The table of a fleet on the page: its stream, and 100 000 rows sorted, filtered and brushed in a real browser."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from allanite.commands.page.fleet_table import fleet_stream
from allanite.commands.page.server import address_of
from axe import axe_script, violations
from fleet_tables import MIDDLE, fleet_table
from page_client import Browser, application, served, small_log
from real_browser import opened_browser

ROWS = 100_000
DEG_ROOT_H = 60 * 180 / np.pi


def large_table(rows: int) -> pa.Table:
    """N of gyro_x of so many logs; the first log is in the folder, every tenth gives an upper limit only."""
    number = np.arange(rows)
    estimate = np.where(number % 10 == 9, np.nan, MIDDLE * np.exp(0.2 * np.sin(number * 0.7)))
    texts = {
        "log": np.char.add(np.char.add("logs/u", np.char.zfill(number.astype(str), 6)), ".csv"),
        "unit": np.char.add("u", np.char.zfill(number.astype(str), 6)),
        "lot": np.char.add("lot", (number % 7).astype(str)),
        "status": np.where(number % 10 == 9, "upper_limit", "resolved"),
    }
    same = {"channel": "gyro_x", "kind": "rate", "term": "N", "unit_of_measure": "rad/s/√Hz"}
    return pa.table(
        {
            **{name: pa.array(values.tolist()) for name, values in texts.items()},
            **{name: pa.array([value] * rows) for name, value in same.items()},
            "estimate": pa.array(estimate, from_pandas=True),
            "lower": pa.array(0.98 * estimate, from_pandas=True),
            "upper": pa.array(1.02 * estimate, from_pandas=True),
            "temperature": pa.array(20.0 + number % 5),
        }
    )


def write_table(table: pa.Table, place: Path, files: int) -> None:
    """As a folder of so many files, or as one file."""
    if not files:
        pq.write_table(table, place)
        return
    place.mkdir()
    for i in range(files):
        rows = table.slice(i * len(table) // files, (i + 1) * len(table) // files - i * len(table) // files)
        pq.write_table(rows, place / f"{i:03d}-of-{files:03d}.parquet")


def test_the_coefficient_shown_first_is_the_white_noise_of_most_logs(tmp_path: Path) -> None:
    """Not that of a log without a header, whose channels sort first."""
    many, few = fleet_table(units=5, symbols=("B", "N")), fleet_table(units=1, symbols=("N", "B"))
    few = few.set_column(few.column_names.index("channel"), "channel", pa.array(["ch0"] * len(few)))
    write_table(pa.concat_tables([few, many]), tmp_path / "fleet.parquet", 1)
    facts = fleet_stream({"table": str(tmp_path / "fleet.parquet"), "file": str(tmp_path / "stream")})
    assert facts["chosen"] == ("gyro_x", "N") and facts["rows"] == 5
    assert facts["coefficients"] == [("gyro_x", "N"), ("ch0", "N"), ("ch0", "B"), ("gyro_x", "B")]


@pytest.mark.parametrize("files", [0, 1, 2])
def test_the_stream_is_arrow_in_the_units_of_people(tmp_path: Path, files: int) -> None:
    folder = tmp_path / "fleets"
    folder.mkdir()
    write_table(fleet_table(units=5, symbols=("N", "B")), folder / "fleet.parquet", files)
    small_log(folder, "log.csv")
    with Browser(application(folder, tmp_path / "cache")) as browser:
        listed = {r["name"]: r for r in browser.get("/api/catalogue").json()["recordings"]}
        assert listed["fleet.parquet"]["is_fleet"] and not listed["log.csv"]["is_fleet"]
        address = f"/api/recordings/{listed['fleet.parquet']['id']}/fleet"
        reply = browser.get(f"{address}?channel=gyro_x&term=B")
        facts = json.loads(unquote(reply.headers["X-Fleet"]))
        assert facts["coefficients"] == [["gyro_x", "N"], ["gyro_x", "B"]]
        assert facts["chosen"] == ["gyro_x", "B"] and facts["unit"] == "deg/h"
        table = pa.ipc.open_stream(reply.content).read_all()
        assert table["unit"].to_pylist() == [f"u0{i}" for i in range(5)]
        stored = pq.read_table(folder / "fleet.parquet", filters=[("term", "=", "B")])["estimate"].to_numpy()
        assert table["estimate"].to_numpy() == pytest.approx(stored * np.degrees(3600))
        wrong = browser.get(f"{address}?channel=gyro_x&term=K")
        assert wrong.status_code == 400 and "the fleet has no K of gyro_x" in wrong.json()["error"]["message"]
        other = browser.get(f"/api/recordings/{listed['log.csv']['id']}/fleet")
        assert other.status_code == 404
    assert not [*(tmp_path / "cache").glob("*.arrow")]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A window on a folder with a large fleet, and one of its logs."""
    tmp_path = tmp_path_factory.mktemp("page")
    folder = tmp_path / "fleets"
    (folder / "logs").mkdir(parents=True)
    pq.write_table(large_table(ROWS), folder / "fleet.parquet")
    small_log(folder / "logs", "u000000.csv")
    with served(folder, tmp_path / "cache") as app, opened_browser() as chromium:
        window = chromium.new_context(viewport={"width": 1280, "height": 800}).new_page()
        complaints: list[str] = []
        window.on("console", lambda m: complaints.append(m.text) if m.type in ("error", "warning") else None)
        window.on("pageerror", lambda error: complaints.append(str(error)))
        window.set_default_timeout(60_000)
        window.goto(address_of(app.settings))
        yield window
        assert not complaints


def opened(page: Any) -> None:
    """The table of the fleet, as it is first."""
    page.evaluate("location.hash = '#/'")
    page.get_by_role("heading", name="Recordings of inertial sensors").wait_for()
    page.locator("#side-files a", has_text="fleet.parquet").click()
    page.locator("main [data-drawn]").wait_for()


#: How long the page takes for a press, and for another content of a field [ms].
PRESS = "b => { const t = performance.now(); b.click(); return performance.now() - t; }"
FILL = """(i, value) => {
  const t = performance.now();
  i.value = value;
  i.dispatchEvent(new Event("input"));
  return performance.now() - t;
}"""


def test_100_000_rows_are_sorted_filtered_and_brushed_without_waiting(page: Any) -> None:
    opened(page)
    count = page.locator("main [role=status]").last
    assert count.text_content() == f"{ROWS} of {ROWS} logs"
    lines = page.locator(".virtual tbody tr:not(.space)")
    assert lines.count() < 60
    assert lines.first.locator("a").text_content() == "u000000"
    # The end is reached by scrolling.
    page.locator(".virtual").evaluate("place => { place.scrollTop = place.scrollHeight; }")
    page.locator(".virtual a", has_text=f"u{ROWS - 1:06}").wait_for()
    # Sorted by the estimate: the smallest first.
    head = page.get_by_role("button", name="Estimate [deg/√h]")
    took = [head.evaluate(PRESS)]
    cell = lines.first.locator("td").nth(2)
    assert float(cell.text_content()) == pytest.approx(MIDDLE * np.exp(-0.2) * DEG_ROOT_H, rel=1e-3)
    assert page.locator("th[aria-sort=ascending]").text_content() == "Estimate [deg/√h]"
    # Filtered by text, then by a range.
    search = page.get_by_label("Unit, lot or log")
    took.append(search.evaluate(FILL, "u00012"))
    assert count.text_content() == f"10 of {ROWS} logs"
    search.evaluate(FILL, "")
    least = page.get_by_label("From", exact=True)
    took.append(least.evaluate(FILL, f"{MIDDLE * DEG_ROOT_H}"))
    number = np.arange(ROWS)
    above = int(((np.sin(number * 0.7) >= 0) & (number % 10 != 9)).sum())
    assert abs(int(count.text_content().split()[0]) - above) <= 1
    least.evaluate(FILL, "")
    # Brushed: the lower half of the logarithms.
    box = page.locator(".brush").bounding_box()
    page.mouse.move(box["x"], box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 20, steps=3)
    page.mouse.up()
    below = int(((np.sin(number * 0.7) <= 0) & (number % 10 != 9)).sum())
    shown = int(count.text_content().split()[0])
    assert abs(shown - below) < 0.02 * ROWS
    assert max(took) < 1000, took  # ms; a person waits for none of them
    if axe := axe_script():
        page.evaluate(axe)
        assert violations(page) == []


@pytest.mark.long
def test_a_click_opens_the_study_of_a_log_and_makes_it_where_there_is_none(page: Any) -> None:
    opened(page)
    page.get_by_role("link", name="u000001", exact=True).click()
    page.get_by_text("logs/u000001.csv is not in the folder of this page").wait_for()
    page.get_by_role("link", name="u000000", exact=True).click()
    page.locator(".study table").first.wait_for()
    assert "#/recording/" in page.url
