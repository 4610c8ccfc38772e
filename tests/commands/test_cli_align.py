# SPDX-License-Identifier: BSD-3-Clause
"""`allanite align`: what it prints, what it leaves, and what it refuses; figures and page of an alignment."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import pytest

import allanite as al
from allanite.errors import InputError
from allanite.experiments.alignment import align
from allanite.files.recording_file import write_recording
from allanite.filtering.simulation import UnitMotion, simulate_unit
from allanite.quantities.earth import DEG_H
from allanite.recording.calibration import Calibration
from allanite.study.model_file import model_of
from allanite.views.figures import sheet_of
from allanite.views.report import html_of
from pages import Balance, document_of, text_of
from shell import Run

DEG = math.pi / 180
NOISE = {"gyro": model_of("N=0.02 deg/√h"), "accelerometer": model_of("N=0.02 m/s/√h")}
WORDS = "N=0.02 deg/√h"
PLACE = ("--latitude", "48.1")


def biased(**biases: float) -> Calibration:
    """Nominal but for some biases of the gyros [deg/h]."""
    nominal = Calibration.nominal("accelerometer", "gyro")
    drawn = {f"gyro.bias_{axis}": value * DEG_H for axis, value in biases.items()}
    return nominal.with_values(
        [v + drawn.get(n, 0.0) for n, v in zip(nominal.names, nominal.values, strict=True)]
    )


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Logs of a unit: still, turned by half a turn, turning."""
    folder = tmp_path_factory.mktemp("align")
    two = [(0, 0, 30 * DEG), (0.02, 0, 210 * DEG)]
    for name, motion in (
        ("still", UnitMotion.still((0, 0, 30 * DEG), duration=100.0)),
        ("two", UnitMotion.positions(two, dwell=80.0, turn=4.0)),
        ("spin", UnitMotion.rotation(8 * DEG, 120.0, heading=30 * DEG)),
    ):
        made = simulate_unit(
            NOISE,
            rate=20.0,
            motion=motion,
            latitude=48.1 * DEG,
            seed=1,
            axes="FLU",
            calibration=biased(x=3, y=-2),
        )
        write_recording(made, folder / f"{name}.parquet")
    known = biased(x=3, y=-2).with_repeatability({"gyro.bias": 0.05 * DEG_H})
    channels = {s: tuple(f"{p}_{a}" for a in "xyz") for s, p in (("gyro", "gyro"), ("accelerometer", "acc"))}
    document = {**known.to_json(), "channels": channels, "source": "table.parquet"}
    (folder / "calibration.json").write_text(json.dumps(document), encoding="utf-8")
    return folder


def test_two_positions_leave_a_report(run: Run, logs: Path, tmp_path: Path) -> None:
    out, figure = tmp_path / "out", tmp_path / "heading.pdf"
    done = run("align", logs / "two.parquet", "--model", WORDS, *PLACE, "--out", out, "--plot", figure)
    assert done.code == 0, done.err
    assert done.out.startswith("Resolved. ")
    for words in (
        "Heading at the end",
        "Heading at the beginning",
        "by the record",
        "10.04 deg/h",
        "nominal",
        "x forward, y left, z up (FLU)",
    ):
        assert words in done.out
    document = json.loads((out / "alignment.json").read_text(encoding="utf-8"))
    assert document["format"] == "allanite-alignment"
    interval = document["last"]["interval"]
    assert (210 * DEG - interval["start"]) % (2 * math.pi) < interval["width"]
    assert document["last"]["roll"] == pytest.approx(0.02, abs=1e-3)
    rows = list(csv.DictReader((out / "stands.csv").open(encoding="utf-8")))
    assert len(rows) == 2
    assert float(rows[1]["turned_deg"]) == pytest.approx(180.0, abs=0.1) or float(
        rows[1]["turned_deg"]
    ) == pytest.approx(-180.0, abs=0.1)
    assert figure.stat().st_size > 1000
    page = (out / "report.html").read_text(encoding="utf-8")
    balance = Balance()
    balance.feed(document_of(page))
    assert not balance.wrong
    words = text_of(page)
    for said in (
        "Resolved.",
        "heading of the forward axis",
        "Attitudes in chronological order",
        "TRIAD",
        "Shuster",
    ):
        assert said in words
    assert run("align", logs / "two.parquet", *PLACE, "--out", out).code == 1  # it is there


@pytest.mark.long
def test_one_position_says_what_is_missing(run: Run, logs: Path) -> None:
    none = run("align", logs / "still.parquet", "--model", WORDS, *PLACE)
    assert none.code == 0
    assert none.out.startswith("No north. One attitude")
    assert "Turn the unit by 180 deg" in none.out
    assert "TRIAD" not in none.out  # a heading nobody may take
    document = json.loads(run("align", logs / "still.parquet", "--model", WORDS, *PLACE, "--json").out)
    assert document["last"]["heading"] is None
    assert document["last"]["interval"]["width"] == pytest.approx(2 * math.pi)
    known = run(
        "align", logs / "still.parquet", "--model", WORDS, *PLACE, "--gyro-bias", "2.5deg/h", "--json"
    )
    told = json.loads(known.out)
    assert told["verdict"] == "resolved"
    assert told["budget"]["gyro bias"] == pytest.approx(
        2.5 * DEG_H / told["horizontal_length"]["value"], rel=1e-3
    )


@pytest.mark.long
def test_a_calibration_is_taken_with_its_covariance(run: Run, logs: Path) -> None:
    options = ("--model", WORDS, *PLACE, "--calibration", logs / "calibration.json")
    done = run("align", logs / "still.parquet", *options, "--json")
    document = json.loads(done.out)
    assert document["verdict"] == "resolved"
    assert document["calibrated"]
    assert document["calibration_source"] == "table.parquet"
    interval = document["last"]["interval"]
    assert (30 * DEG - interval["start"]) % (2 * math.pi) < interval["width"] < 6 * DEG
    assert document["budget"]["gyro bias"] > 0
    more = json.loads(
        run("align", logs / "still.parquet", *options, "--accelerometer-bias", "10mg", "--json").out
    )
    assert more["budget"]["accelerometer calibration"] == pytest.approx(0.01 * math.tan(48.1 * DEG), rel=0.05)


@pytest.mark.long
@pytest.mark.parametrize("words", [(), ("--rotating",)])
def test_a_rotation_is_found_or_said(run: Run, logs: Path, words: tuple[str, ...]) -> None:
    done = run("align", logs / "spin.parquet", "--model", WORDS, *PLACE, *words)
    assert done.code == 0, done.err
    assert done.out.startswith("Resolved. ")
    assert "turning all the time: 2.7 revolutions" in done.out


@pytest.mark.long
def test_spans_out_of_a_file(run: Run, logs: Path, tmp_path: Path) -> None:
    (tmp_path / "rests.csv").write_text("start,stop\n5,75\n90,160\n", encoding="utf-8")
    done = run(
        "align", logs / "two.parquet", "--model", WORDS, *PLACE, "--spans", tmp_path / "rests.csv", "--json"
    )
    assert json.loads(done.out)["spans"] == [[5.0, 75.0], [90.0, 160.0]]
    later = run("align", logs / "two.parquet", "--model", WORDS, *PLACE, "--from", "10", "--json")
    assert json.loads(later.out)["duration"] == pytest.approx(154.0)


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (("--latitude", "90"), 1, "undefined"),
        ((*PLACE, "--axes", "FFU"), 1, "right-handed"),
        ((*PLACE, "--gyro-bias", "3"), 2, "no rate of rotation"),
        ((*PLACE, "--accelerometer-bias", "3deg"), 2, "no acceleration"),
        ((*PLACE, "--channels", "gyro"), 1, "three gyros and three accelerometers"),
        ((*PLACE, "--unit", "gyro=LSB", "--gyro", "gyro_x,gyro_y,gyro_z"), 1, "a scale is needed"),
        ((*PLACE, "--model", "N=1 m/s/√h, B=1 mg", "--resting", "--confidence", "2"), 1, "confidence"),
    ],
)
def test_what_makes_no_sense_is_refused(
    run: Run, logs: Path, options: tuple[str, ...], code: int, words: str
) -> None:
    done = run("align", logs / "still.parquet", *options)
    assert done.code == code
    assert words in done.err


# -- figures and page ---------------------------------------------------------------------------------------


def test_figures_show_the_compass_the_convergence_and_the_stands(logs: Path) -> None:
    found = align(al.read(logs / "two.parquet"), model=NOISE, latitude=48.1 * DEG, checkpoints=30)
    document = found.to_json()
    assert len(sheet_of(found).rows) == 3
    assert [len(sheet_of(document, view=v).rows) for v in ("compass", "convergence", "residuals")] == [
        1,
        1,
        1,
    ]
    curve = sheet_of(document, view="convergence").panels[0].curves[0]
    assert curve.lower is not None
    assert curve.upper is not None
    assert (curve.lower <= curve.y).all()
    assert (curve.y <= curve.upper).all()
    assert curve.y[-1] == pytest.approx(0.0, abs=0.05)
    with pytest.raises(InputError, match="view"):
        sheet_of(document, view="sphere")


def test_no_north_has_a_page_and_a_full_circle(logs: Path) -> None:
    found = align(al.read(logs / "still.parquet"), model=NOISE, latitude=48.1 * DEG, checkpoints=3)
    assert found.verdict == "no north"
    assert len(sheet_of(found).rows) == 1
    with pytest.raises(InputError, match="no figure"):
        sheet_of(found, view="convergence")
    drawing = sheet_of(found).panels[0].drawing
    assert drawing is not None
    assert any("every direction" in getattr(part, "text", "") for part in drawing.parts)
    words = text_of(html_of(found))
    assert "No north." in words
    assert "every direction is possible" not in words or "whole circle" in words
