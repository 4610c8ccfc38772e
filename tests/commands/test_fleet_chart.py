# SPDX-License-Identifier: BSD-3-Clause
"""`allanite fleet chart`: a shift at a known date, in the terminal, the document, the table and the figure."""

from __future__ import annotations

import csv
import json
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from allanite.commands import measure
from allanite.errors import InputError
from allanite.stability.fleet.charts import ControlChart, control_chart
from allanite.stability.fleet.control_rules import ControlRule
from allanite.views.figures import sheet_of
from allanite.views.registry import document_of
from fleet_tables import MIDDLE, fleet_table
from shell import Run

FIRST = 32


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Forty units three days apart; the last eight are noisier by a half."""
    folder = tmp_path_factory.mktemp("fleet")
    table = fleet_table(symbols=("N",), factors={f"u{i}": 1.5 for i in range(FIRST, 40)}, lots=1)
    days = [datetime(2026, 1, 1) + timedelta(days=3 * int(u[1:])) for u in table["unit"].to_pylist()]
    dated = table.append_column("date", pa.array(days, pa.timestamp("us")))
    pq.write_table(dated.take(np.random.default_rng(2).permutation(len(dated))), folder / "fleet.parquet")
    return folder


@pytest.fixture(scope="module")
def chart(fleet: Path) -> ControlChart:
    result: ControlChart = measure(
        "fleet chart", fleet, channel="gyro_x", term="N", phase_two="2026-04-05"
    ).result
    return result


def test_a_shift_signals_after_it_and_not_before(chart: ControlChart) -> None:
    assert chart.first == FIRST and chart.by_date and chart.limits_only == 0
    assert chart.units == tuple(f"u{i:02}" for i in range(40))
    assert chart.center.value == pytest.approx(MIDDLE, rel=0.08)
    beyond = [s.number for s in chart.signals if s.rule is ControlRule.BEYOND_3]
    assert beyond and min(beyond) > FIRST
    weighted = [s.number for s in chart.signals if s.rule is ControlRule.EWMA]
    assert set(range(FIRST + 3, 41)) <= set(weighted) and min(weighted) > FIRST
    assert np.all(np.abs(chart.z[:FIRST]) < 3)
    assert np.std(chart.z[:FIRST]) == pytest.approx(1.0, abs=0.3)


@pytest.mark.long
def test_a_point_has_limits_of_its_own_uncertainty(fleet: Path) -> None:
    table = pq.read_table(fleet / "fleet.parquet").to_pylist()
    for row in table[:10]:  # four times as uncertain
        best = row["profile"][4]
        row["profile"] = [best + 4 * (knot - best) for knot in row["profile"]]
    schema = pq.read_schema(fleet / "fleet.parquet")
    made = control_chart(pa.Table.from_pylist(table, schema=schema), channel="gyro_x", term="N")
    width, own = np.log(made.high / made.low), np.log(made.upper / made.lower)
    assert (own > 2 * np.median(own)).sum() == 10
    of_fleet = (width / 6) ** 2 - (own / (2 * 1.96)) ** 2  # variances: limits, less the point
    assert of_fleet == pytest.approx(np.full(40, of_fleet[0]), rel=1e-4)
    assert made.first == 40


def test_every_door(fleet: Path, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    out = tmp_path / "out"
    words = ("--channel", "gyro_x", "--term", "N", "--phase-two", "33", "--rules", "nelson", "--no-ewma")
    done = run("fleet", "chart", fleet, *words, "--out", out, "--plot", tmp_path / "chart.svg")
    assert done.code == 0, done.err
    assert done.out.startswith("Out of control. N of gyro_x: ") and "deg/√h" in done.out
    assert max(map(len, done.out.split("\nwrote")[0].splitlines())) <= 80
    data = json.loads((out / "chart.json").read_text(encoding="utf-8"))
    document = document_of(data)
    assert document.to_json() == data and data["verdict"] == "signals"
    rows = [*csv.DictReader((out / "points.csv").read_text(encoding="utf-8").splitlines())]
    assert len(rows) == 40 and {r["phase"] for r in rows[FIRST:]} == {"2"}
    assert any("beyond 3 sd" in r["signals"] for r in rows[FIRST:])
    panels = sheet_of(document.result).panels
    assert [p.title for p in panels] == ["N of gyro_x: individuals"]
    with pytest.raises(InputError, match="no weighted mean"):
        sheet_of(document.result, view="ewma")
    assert (tmp_path / "chart.svg").stat().st_size > 1000


def test_the_figure_draws_every_point_once(chart: ControlChart) -> None:
    individuals, weighted = sheet_of(chart).panels
    drawn = [c for c in individuals.curves if c.marker == "circle"]
    assert sum(len(c.x) for c in drawn) == 40
    assert {c.label for c in weighted.curves} >= {"weighted mean", "beyond the limits"}
    assert individuals.labels[0].text == "phase II"


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"channel": "gyro_z"}, "the fleet has no N of gyro_z; there are: N of gyro_x"),
        ({"phase_two": "soon"}, "write a date as 2026-03-01, or a number"),
        ({"phase_two": "2"}, "phase II begins at log 2 of 40"),
        ({"phase_two": "2030-01-01"}, "phase II begins at log 41 of 40"),
        ({"rules": "all"}, "no rules 'all'"),
    ],
)
def test_a_chart_that_cannot_be_drawn_is_refused(fleet: Path, options: dict[str, str], says: str) -> None:
    with pytest.raises(InputError, match=says):
        measure("fleet chart", fleet, **{"channel": "gyro_x", "term": "N", **options})
