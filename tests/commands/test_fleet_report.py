# SPDX-License-Identifier: BSD-3-Clause
"""`allanite fleet report`: a population with known units that stand out, at every door."""

from __future__ import annotations

import csv
import json
import math
from datetime import datetime, timedelta
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from allanite.commands import measure
from allanite.errors import InputError
from allanite.stability.fleet.results import FleetPopulation
from allanite.study.result_document import Reportable
from allanite.views.figures import sheet_of
from allanite.views.registry import document_of
from allanite.views.report import render_file
from allanite.views.result_page import view_of
from fleet_tables import MIDDLE, fleet_table
from shell import Run


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fleet")
    pq.write_table(fleet_table(factors={"u03": 2.5}), folder / "fleet.parquet")
    return folder


@pytest.fixture(scope="module")
def document(fleet: Path) -> Reportable:
    return measure("fleet report", fleet).document


@pytest.fixture(scope="module")
def population(document: Reportable) -> FleetPopulation:
    result: FleetPopulation = document.result
    return result


def left_in(folder: Path) -> Reportable:
    """What `fleet report --out` leaves."""
    return document_of(json.loads((folder / "population.json").read_text(encoding="utf-8")))


def test_the_terminal_answers_first_in_units_that_people_use(
    fleet: Path, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    out = tmp_path / "out"
    done = run("fleet", "report", fleet, "--out", out)
    assert done.code == 0, done.err
    assert done.out.startswith("Units stand out. u03: 1 of 40 units;")
    words = " ".join(done.out.split())
    assert "gyro_x N [deg/√h]" in words and "gyro_x B [deg/h]" in words and "40 of 40" in words
    assert "99 % of units" in words and "temperature 22.0 °C" in words
    assert max(map(len, done.out.split("\nwrote")[0].splitlines())) <= 80
    rows = {
        name: [*csv.DictReader((out / name).open())]
        for name in ("coefficients.csv", "standing_out.csv", "lots.csv")
    }
    assert [r["symbol"] for r in rows["coefficients.csv"]] == ["N", "B"]
    assert float(rows["coefficients.csv"][0]["middle"]) == pytest.approx(MIDDLE, rel=0.15)
    assert {r["unit"] for r in rows["standing_out.csv"]} == {"u03"}
    assert all(float(r["ratio"]) == pytest.approx(2.5, rel=0.4) for r in rows["standing_out.csv"])
    assert {(r["symbol"], r["lot"]) for r in rows["lots.csv"]} == {
        (s, f"lot{i}") for s in "NB" for i in range(4)
    }


@pytest.mark.long
def test_the_document_is_read_again_and_makes_its_report(fleet: Path, run: Run, tmp_path: Path) -> None:
    done = run("fleet", "report", fleet / "fleet.parquet", "--json")
    data = json.loads(done.out)
    assert data["format"] == "allanite-fleet" and data["verdict"] == "stand out"
    document = document_of(data)
    assert document.to_json() == data
    (tmp_path / "population.json").write_text(done.out, encoding="utf-8")
    page = render_file(tmp_path / "population.json", tmp_path / "again.html").read_text(encoding="utf-8")
    assert "u03" in page


@pytest.mark.long
def test_options_reach_the_statistics(fleet: Path) -> None:
    result: FleetPopulation = measure(
        "fleet report",
        fleet,
        no_lots=True,
        content=0.9,
        confidence=0.9,
        conditions=[],
        false_discovery_rate=0.01,
    ).result
    first = result.coefficients[0]
    assert first.lots == 1 and first.content == 0.9 and not first.effects and not first.of_lots
    assert (result.confidence, result.false_discovery_rate) == (0.9, 0.01)
    with pytest.raises(InputError, match="no numeric column 'humidity'"):
        measure("fleet report", fleet, conditions=["humidity"])


@pytest.mark.long
def test_a_failed_log_is_a_loss(tmp_path: Path, run: Run) -> None:
    table = fleet_table().to_pylist()
    table.append({**dict.fromkeys(table[0]), "log": "broken.csv", "unit": "u99", "kind": None})
    pq.write_table(pa.Table.from_pylist(table, schema=fleet_table().schema), tmp_path / "fleet.parquet")
    done = run("fleet", "report", tmp_path)
    assert done.code == 3 and "No unit stands out." in done.out


@pytest.mark.long
def test_the_page_has_every_part_and_figures(population: FleetPopulation, document: Reportable) -> None:
    page = view_of(document)
    assert [s.id for s in page.sections] == ["verdict", "effects", "lots", "pictures", "method", "provenance"]
    panels = sheet_of(population).panels
    assert [p.title for p in panels] == [
        "gyro_x: relative to the middle",
        "N of gyro_x: 40 units",
        "B of gyro_x: 40 units",
        "gyro_x, lot by lot",
    ]
    marked = next(c for c in panels[1].curves if c.label == "unit that stands out")
    assert marked.x == pytest.approx([2.5 * math.degrees(MIDDLE) * 60], rel=0.15)
    with pytest.raises(InputError, match="no figure 'correlations': no two coefficients correlate"):
        sheet_of(population, view="correlations")
    crosses = next(c for c in panels[0].curves if c.label == "stands out")
    assert len(crosses.x) == len(population.standing_out)
    for panel in panels:
        for curve in panel.curves:
            assert math.isfinite(float(curve.y.max()))
    with pytest.raises(InputError, match="no view 'none' of a fleet"):
        sheet_of(population, view="none")


@pytest.mark.long
def test_a_data_sheet_is_a_limit_of_the_units(
    fleet: Path, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    sheet, out = tmp_path / "sheet.yaml", tmp_path / "out"
    sheet.write_text("gyro: {angle_random_walk: 2 deg/√h}", encoding="utf-8")
    done = run("fleet", "report", fleet, "--sheet", sheet, "--out", out)
    assert done.code == 0, done.err
    words = " ".join(done.out.split())
    assert "The fleet meets its limits." in words and "at most 1 % of units lie above the limit" in words
    assert max(map(len, done.out.split("\nwrote")[0].splitlines())) <= 80
    rows = [*csv.DictReader((out / "coefficients.csv").open(encoding="utf-8"))]
    assert [r["capability"] for r in rows] == ["meets", ""]
    assert float(rows[0]["limit"]) == pytest.approx(math.radians(2) / 60, rel=1e-9)
    assert "Units above it" in (out / "report.html").read_text(encoding="utf-8")
    sheet.write_text("accelerometer: {velocity_random_walk: 0.02 m/s/√h}", encoding="utf-8")
    with pytest.raises(
        InputError, match="no value for a coefficient of the fleet; those are B of gyro_x, N of"
    ):
        measure("fleet report", fleet, sheet=sheet)


@pytest.mark.long
def test_coefficients_that_vary_together_are_a_table_and_a_figure(tmp_path: Path, run: Run) -> None:
    first = fleet_table(symbols=("N",), lots=1)
    second = first.set_column(
        first.column_names.index("channel"), "channel", pa.array(["gyro_y"] * len(first))
    )
    other = fleet_table(symbols=("B",), lots=1, seed=8)
    pq.write_table(pa.concat_tables([first, second, other]), tmp_path / "fleet.parquet")
    assert run("fleet", "report", tmp_path, "--out", tmp_path / "out").code == 0
    document = left_in(tmp_path / "out")
    (pair,) = document.result.correlations
    assert (pair.first, pair.second, pair.units) == ("N of gyro_x", "N of gyro_y", 40)
    assert document.result.pairs == 3 and pair.correlation.lower > 0.99
    assert document_of(document.to_json()).to_json() == document.to_json()
    (panel,) = sheet_of(document.result, view="correlations").panels
    assert panel.curves[0].y == pytest.approx([pair.correlation.value])
    (row,) = csv.DictReader((tmp_path / "out" / "correlations.csv").open(encoding="utf-8"))
    assert row["second"] == "N of gyro_y" and row["left_out"] == "0"


@pytest.mark.long
def test_a_unit_that_changes_over_its_repeats_is_named(tmp_path: Path, run: Run) -> None:
    rows = fleet_table(symbols=("N",), lots=1, repeats=4).to_pylist()
    for row in rows:
        quarters = int(row["log"].split("_")[1].removesuffix(".csv"))
        row["date"] = datetime(2026, 1, 1) + timedelta(days=91.3125 * quarters)
        if row["unit"] == "u07":
            row["profile"] = [knot + 0.1 * quarters for knot in row["profile"]]
    schema = fleet_table().schema.append(pa.field("date", pa.timestamp("us")))
    pq.write_table(pa.Table.from_pylist(rows, schema=schema), tmp_path / "fleet.parquet")
    done = run("fleet", "report", tmp_path, "--out", tmp_path / "out")
    document = left_in(tmp_path / "out")
    (drift,) = document.result.drifts
    assert document.result.repeated == 40
    assert (drift.unit, drift.symbol, drift.logs) == ("u07", "N", 4)
    assert drift.slope.lower < 0.4 < drift.slope.upper and 0 < drift.slope.lower
    assert document_of(document.to_json()).to_json() == document.to_json()
    assert "%/year" in done.out and "1 of 40 coefficients" in (tmp_path / "out" / "report.html").read_text(
        "utf-8"
    )
    (row,) = csv.DictReader((tmp_path / "out" / "drifts.csv").open(encoding="utf-8"))
    assert row["unit"] == "u07" and float(row["slope"]) == drift.slope.value
