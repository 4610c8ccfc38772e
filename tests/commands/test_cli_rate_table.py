# SPDX-License-Identifier: BSD-3-Clause
"""The command rate-table from end to end on twins whose truth is known: files, report, picture, refusals."""

from __future__ import annotations

import csv
import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.experiments.rate_table import RateTableEstimate, Sinusoids, read_rate_table, simulate_on_table
from allanite.files.recording_file import write_recording
from allanite.noise import Flicker, NoiseModel, White
from allanite.study.model_file import model_of, save_models
from allanite.views.blocks import TableBlock
from allanite.views.figures import sheet_of
from allanite.views.registry import document_of
from allanite.views.report import html_of, page_of
from allanite.views.wording.rate_table import scale_unit
from shell import Run

MODEL = "N=0.3 deg/√h, B=5 deg/h"
RATES = (0, 20, -20, 100, -100, 0, 100, -100, 20, -20, 0)
DEG = math.pi / 180


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in steps, one that clips, one in volts, and the table of all."""
    place = tmp_path_factory.mktemp("table")
    rows = "".join(f"{20 * i},{20 * i + 20},{r}\n" for i, r in enumerate(RATES))
    (place / "table.csv").write_text(f"start,stop,rate_deg_s\n{rows}", encoding="utf-8")
    table, noise = read_rate_table(place / "table.csv"), model_of(MODEL)
    facts: dict[str, Any] = {"rate": 20.0, "duration": 226.0, "seed": 1, "offset": 1.5, "settling": 0.1}
    run = simulate_on_table(noise, table, unit="deg/s", scale=1.002, bias=0.05 * DEG, **facts)
    write_recording(run, place / "run.parquet")
    write_recording(
        simulate_on_table(noise, table, unit="deg/s", limit=90 * DEG, **facts), place / "clipped.parquet"
    )
    volts = NoiseModel.of(White(N=1e-4), Flicker(B=1e-5), kind="voltage")
    save_models({"gyro": volts.to_json()}, place / "volts.json")
    made = simulate_on_table(volts, table, unit="V", name="gyro", scale=0.024 / DEG, bias=2.5, **facts)
    write_recording(made, place / "volts.parquet")
    return place


def options(bench: Path, log: str = "run.parquet", model: str = MODEL) -> list[Any]:
    return ["rate-table", bench / log, "--table", bench / "table.csv", "--model", model]


def test_the_command_prints_numbers_and_leaves_files(run: Run, bench: Path, tmp_path: Path) -> None:
    done = run(*options(bench), "--out", tmp_path / "out", "--plot", tmp_path / "fig.svg")
    assert done.code == 0, done.err
    assert done.out.startswith("Resolved. The scale factor is known to")
    for words in (
        "Scale factor",
        "deg/h",
        "ppm of full scale",
        "not resolved: below",
        "Clock offset",
        "11 steps",
    ):
        assert words in done.out
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert names == {"report.html", "rate-table.json", "steps.csv"} and (tmp_path / "fig.svg").stat().st_size
    with (tmp_path / "out" / "steps.csv").open(encoding="utf-8") as file:
        steps = list(csv.DictReader(file))
    assert [float(s["rate_deg_s"]) for s in steps] == list(RATES)
    assert all(abs(float(s["residual_ppm"])) < 100 and s["used"] == "yes" for s in steps)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Where the band includes zero" in page and "Reference-aided" in page
    again = run("report", tmp_path / "out" / "rate-table.json", "--output", tmp_path / "again.html")
    assert again.code == 0, again.err


def test_json_holds_the_truth(run: Run, bench: Path) -> None:
    done = run(*options(bench), "--json", "--nonlinearity", "1", "--table-uncertainty", "10ppm")
    document = json.loads(done.out)
    found = {p["name"]: p for p in document["parameters"]}
    scale = found["scale factor"]
    assert scale["lower"] < 1.002 < scale["upper"] and "quadratic" not in found
    assert document["budget"]["table rate"] == pytest.approx(1e-5)
    assert found["clock offset"]["value"] == pytest.approx(1.6, abs=0.01)  # the sensor's delay in it
    assert document["provenance"]["source"] == "run.parquet" and document["model_name"] == "given in words"


def test_volts_give_a_scale_factor_in_millivolts(run: Run, bench: Path) -> None:
    done = run(*options(bench, "volts.parquet", str(bench / "volts.json")))
    assert done.code == 0 and "mV/(deg/s)" in done.out and "Scale-factor error" not in done.out
    sheet = run(*options(bench, "volts.parquet"), "--scale-factor", "24 mV/(deg/s)", "--json")
    found = {p["name"]: p for p in json.loads(sheet.out)["parameters"]}
    assert found["scale-factor error"]["value"] == pytest.approx(0.0, abs=1e-3)
    wrong = run(*options(bench, "volts.parquet"))
    assert wrong.code == 1 and "--scale-factor" in wrong.err


def test_what_the_table_does_is_no_fault_of_the_sensor(run: Run, bench: Path) -> None:
    done = run(*options(bench), "--json")
    document = json.loads(done.out)
    assert done.code == 0 and all(f["severity"] == "info" for f in document["findings"]), document["findings"]


def test_steps_that_clip_are_named(run: Run, bench: Path) -> None:
    done = run(*options(bench, "clipped.parquet"))
    assert done.code == 0, done.err
    assert "4 steps at -100, 100 deg/s clip and are left out" in " ".join(done.out.split())
    assert "7 of 11 steps used" in done.out


def test_sign_and_own_noise_and_the_part_of_a_log(run: Run, bench: Path) -> None:
    done = run("rate-table", bench / "run.parquet", "--table", bench / "table.csv", "--nonlinearity", "sign")
    assert done.code == 0 and "Asymmetry" in done.out and "fitted to this record" in done.out
    part = run(*options(bench), "--from", "1.5", "--offset", "0", "--axis", "up", "--latitude", "48.1")
    assert part.code == 0 and "Bias without the Earth" in part.out and "Delay" in part.out


@pytest.mark.parametrize(
    ("more", "code", "said"),
    [
        (["--nonlinearity", "cubic"], 2, "cubic"),
        (["--axis", "sideways"], 2, "sideways"),
        (["--table", "nowhere.csv"], 2, "nowhere.csv"),
        (["--dead-time", "30"], 1, "shorter than"),
        (["--channel", "x"], 1, "no channel"),
        (["--temperature", "T"], 1, "no channel"),
    ],
)
def test_wrong_use_is_told(run: Run, bench: Path, more: list[str], code: int, said: str) -> None:
    done = run(*options(bench), *more)
    assert done.code == code and said in done.err and done.out == ""


def test_a_table_with_a_wrong_cell_names_line_and_column(run: Run, bench: Path, tmp_path: Path) -> None:
    place = tmp_path / "bad.csv"
    place.write_text("start,stop,rate_deg_s\n0,20,0\n20,40,fast\n", encoding="utf-8")
    done = run("rate-table", bench / "run.parquet", "--table", place)
    assert done.code == 1 and "bad.csv, line 3, column 'rate': 'fast' is no number" in done.err


def test_files_are_not_replaced_unasked(run: Run, bench: Path, tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text("mine", encoding="utf-8")
    done = run(*options(bench), "--out", tmp_path)
    assert done.code == 1 and (tmp_path / "report.html").read_text(encoding="utf-8") == "mine"


# -- pictures and pages -------------------------------------------------------------------------------------


def swings() -> al.Recording:
    table = Sinusoids(start=[0, 50], stop=[50, 80], amplitude=[DEG, DEG], frequency=[0.2, 2.0], phase=[0, 0])
    return simulate_on_table(model_of(MODEL), table, rate=50.0, duration=85.0, seed=2), table  # type: ignore[return-value]


@pytest.fixture(scope="module")
def documents(bench: Path) -> dict[str, Any]:
    """Of a run in steps, of sinusoids, and of one that tells nothing."""
    table, noise = read_rate_table(bench / "table.csv"), model_of(MODEL)
    record, swing = swings()
    still = simulate_on_table(noise, table, rate=20.0, duration=226.0, seed=3, scale=0.0)
    return {
        "steps": al.measure_rate_table(al.read(bench / "run.parquet"), table=table, model=noise).to_json(),
        "swings": al.measure_rate_table(record, table=swing, model=noise, offset=0.0).to_json(),
        "still": al.measure_rate_table(still, table=table, model=noise).to_json(),
    }


@pytest.mark.parametrize("which", ["steps", "swings", "still"])
def test_every_result_has_a_page_and_a_picture(documents: dict[str, Any], which: str) -> None:
    document = json.loads(json.dumps(documents[which], allow_nan=False))
    page = html_of(document)
    assert not re.search(r">\s*[-−]?(nan|None|inf)\b", page)
    assert sheet_of(document).rows


def test_views_of_the_picture(documents: dict[str, Any]) -> None:
    steps = documents["steps"]
    titles = [row[0].title for row in sheet_of(steps).rows]
    assert len(titles) == 4 and titles[1] == "Residual of each step"
    assert [row[0].title for row in sheet_of(documents["swings"], view="frequency").rows] == ["Gain", "Phase"]
    panel = sheet_of(steps, view="response").rows[0][0]
    drawn = next(c for c in panel.curves if c.marker == "circle")
    assert sorted(drawn.x.tolist()) == pytest.approx(sorted(RATES))
    for view in ("frequency", "sideways"):
        with pytest.raises(InputError, match=view):
            sheet_of(steps, view=view)


def test_words_of_the_numbers(documents: dict[str, Any]) -> None:
    document = documents["steps"]
    result = document_of(document).result
    assert isinstance(result, RateTableEstimate)
    section = next(s for s in page_of(document).sections if s.id == "verdict")
    numbers = next(b for b in section.blocks if isinstance(b, TableBlock))
    lines = {cells[0].text: [cell.text for cell in cells] for cells, _ in numbers.rows}
    assert lines["Scale factor"][1].startswith("1.00") and lines["Scale factor"][4] == "resolved"
    assert lines["Scale-factor error"][3] == "ppm"
    assert lines["Quadratic term"][4].startswith("not resolved: below")
    ppm = result["scale-factor error"].value * 1e6
    assert float(lines["Scale-factor error"][1]) == pytest.approx(ppm, abs=1.0)
    counts = replace(result, unit="LSB", kind="counts", channel_scale=1.0)
    assert scale_unit(counts)[0] == "LSB/(deg/s)"


def test_a_gap_in_the_log_is_a_loss(run: Run, bench: Path, tmp_path: Path) -> None:
    record = al.read(bench / "run.parquet")
    samples = np.array(record.values("gyro"))
    samples[1000:1200] = np.nan
    write_recording(
        al.Recording.from_rate(samples, rate=20.0, unit="deg/s", names=["gyro"]), tmp_path / "gap.parquet"
    )
    done = run(
        "rate-table", tmp_path / "gap.parquet", "--table", bench / "table.csv", "--model", MODEL, "--json"
    )
    assert done.code == 3
    found = {p["name"]: p for p in json.loads(done.out)["parameters"]}
    assert found["scale factor"]["value"] == pytest.approx(1.002, abs=5 * found["scale factor"]["total_sd"])
