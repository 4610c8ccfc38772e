# SPDX-License-Identifier: BSD-3-Clause
"""Three axes at rest, the null test, and reports of any document: the doors, from end to end."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import allanite as al
from allanite.errors import FormatError, InputError
from allanite.experiments.rate_vector import measure_rate_vector
from allanite.files.recording_file import write_recording
from allanite.filtering.simulation import Motion, simulate
from allanite.quantities.earth import EARTH_RATE
from allanite.study.model_file import model_of
from allanite.views.figures import sheet_of
from allanite.views.report import html_of, render_file
from remade import without_links
from shell import Run

Array = NDArray[np.float64]

DEG_H = math.pi / 180 / 3600
RATE, LENGTH = 20.0, 600.0
LATITUDE = math.radians(48.1)
WHITE = 0.005 * math.pi / 180 / 60  # deg/rt-h
KNOCK = (240.0, 270.0)
BASE = EARTH_RATE * np.array([math.cos(LATITUDE) * 0.8, -math.cos(LATITUDE) * 0.6, math.sin(LATITUDE)])
PLACE = ["--latitude", "48.1"]
GOOD = "N=0.1 deg/√h, B=1 deg/h"


def rates(bias: float = 0.0) -> Array:
    """Three gyros at rest [rad/s], shaken for half a minute."""
    rng = np.random.default_rng(11)
    n = round(LENGTH * RATE)
    found = BASE + bias + WHITE * math.sqrt(RATE) * rng.standard_normal((n, 3))
    t = np.arange(n) / RATE
    shaken = (t >= KNOCK[0]) & (t < KNOCK[1])
    found[shaken] += 300 * DEG_H * np.sin(2 * t[shaken, None] + np.arange(3))
    return found


def of_axes(samples: Array, *, rate: float = RATE, force: bool = True) -> al.Recording:
    """Gyros, and accelerometers that see gravity upwards."""
    gyros = al.Recording.from_rate(samples, rate=rate, unit="rad/s", names=["gx", "gy", "gz"])
    if not force:
        return gyros
    rng = np.random.default_rng(12)
    up = np.array([0.0, 0.0, 9.81]) + 1e-3 * rng.standard_normal(samples.shape)
    acc = al.Recording.from_rate(up, rate=rate, unit="m/s²", names=["ax", "ay", "az"])
    return replace(gyros, channels=gyros.channels + acc.channels, columns=gyros.columns + acc.columns)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clean log of three axes, one with biases, and one with a hole while at rest."""
    place = tmp_path_factory.mktemp("axes")
    write_recording(of_axes(rates()), place / "rest.parquet")
    write_recording(of_axes(rates(100 * DEG_H)), place / "biased.parquet")
    holed = rates()
    holed[2000:2300] = np.nan
    write_recording(of_axes(holed), place / "hole.parquet")
    return place


# -- the rate vector ----------------------------------------------------------------------------------------


def test_three_axes_at_rest_give_the_rate_vector(run: Run, logs: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = run("earth-rate", logs / "rest.parquet", *PLACE, "--out", out, "--plot", tmp_path / "vector.pdf")
    assert done.code == 0, done.err
    assert done.out.startswith("Resolved. ")
    document = json.loads((out / "rate-vector.json").read_text(encoding="utf-8"))
    assert document["format"] == "allanite-rate-vector"
    length = document["magnitude"]
    assert length["lower"] < EARTH_RATE < length["upper"]
    # white noise alone: three axes, each known to WHITE over the root of the time at rest
    assert abs(length["value"] - EARTH_RATE) < 5 * WHITE / math.sqrt(LENGTH - 60)
    for words in (
        "Magnitude",
        "15.041",
        "gz",
        "moves more than the quiet parts",
        "0:04:3",  # the end of the longest stretch that was left out
        "from the angle between gravity and the vector; given 48.1°",
        "|bias + Earth|",
        "The interval includes only the noise",
    ):
        assert words in done.out
    with (out / "stretches.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    covered = sum(float(r["stop_s"]) - float(r["start_s"]) for r in rows)
    assert covered == pytest.approx(LENGTH)
    assert {r["used"] for r in rows} == {"yes", "no"}
    assert (tmp_path / "vector.pdf").read_bytes().startswith(b"%PDF")
    page = (out / "report.html").read_text(encoding="utf-8")
    assert {page.split('class="live" id="')[i].split('"')[0] for i in (1, 2, 3)} == {
        "length",
        "means",
        "record-figure",
    }
    assert run("earth-rate", logs / "rest.parquet", *PLACE, "--out", out).code == 1  # it is there


@pytest.mark.long
def test_biases_make_it_no_measurement_of_the_earth(run: Run, logs: Path) -> None:
    done = run("earth-rate", logs / "biased.parquet", *PLACE)
    assert done.code == 0
    assert done.out.startswith("Inconsistent with Earth. ")
    assert "not passed" in done.out
    assert "urn the sensor" in done.out


@pytest.mark.long
def test_channels_name_the_axes_and_a_model_makes_the_interval(run: Run, logs: Path) -> None:
    alone = run("earth-rate", logs / "rest.parquet", *PLACE, "--channels", "gx,gy,gz")
    assert alone.code == 0
    assert "takes three accelerometers" in alone.out
    words = [*PLACE, "--model", "N=0.005 deg/√h", "--bias-uncertainty", "0.2deg/h", "--json"]
    found = json.loads(run("earth-rate", logs / "rest.parquet", *words).out)
    assert found["budget"]["bias"] == pytest.approx(0.2 * DEG_H)
    assert found["total_sd"] > 0.2 * DEG_H > found["sd"]
    assert found["model_name"] == "given in words"
    one = run("earth-rate", logs / "rest.parquet", *PLACE, "--channels", "gx")
    assert one.code == 0
    assert one.out.startswith("Inconsistent with Earth")
    assert "an axis that was not turned" in " ".join(one.out.split())


def test_samples_missing_at_rest_are_a_loss_and_shaking_is_none(run: Run, logs: Path) -> None:
    done = run("earth-rate", logs / "hole.parquet", *PLACE)
    assert done.code == 3, done.err
    assert "samples missing" in done.out


@pytest.mark.long
def test_a_frozen_axis_is_left_out_of_the_vector_too(run: Run, tmp_path: Path) -> None:
    samples = rates()
    samples[6000:7000, 0] = samples[6000, 0]
    write_recording(of_axes(samples), tmp_path / "stuck.parquet")
    done = run("earth-rate", tmp_path / "stuck.parquet", *PLACE, "--json")
    assert done.code == 3, done.err
    found = json.loads(done.out)
    assert "stuck" in {f["code"] for f in found["findings"]}
    assert not any(s["start"] < 340 and s["stop"] > 310 for s in found["used"])


@pytest.mark.long
def test_three_axes_that_were_turned_are_asked_which(run: Run, tmp_path: Path) -> None:
    samples = rates()
    turns = np.arange(100.0, LENGTH, 100.0)
    sign = 1.0
    for turn in turns:  # half a turn about z in two seconds, there and back
        a = round(turn * RATE)
        samples[a : a + round(2 * RATE), 2] += sign * math.pi / 2
        sign = -sign
    write_recording(of_axes(samples), tmp_path / "turned.parquet")
    done = run("earth-rate", tmp_path / "turned.parquet", *PLACE)
    assert (done.code, done.out) == (1, "")
    assert "5 times" in done.err
    assert "--channels" in done.err
    assert "--vector" in done.err
    forced = run("earth-rate", tmp_path / "turned.parquet", *PLACE, "--vector")
    assert forced.code in (0, 3)
    assert "6 poses" in forced.out
    said = run("earth-rate", tmp_path / "turned.parquet", *PLACE, "--first", "north")
    assert said.code == 1
    assert "gx, gy, gz" in said.err


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (["--vector", "--channels", "gx,gy"], 1, "three channels of rates"),
        (["--channels", "gq"], 1, "gx, gy, gz"),
        (["--channels", "gx,gy"], 1, "--channels"),
        (["--channels", "gx", "--bias-uncertainty", "1deg/h"], 1, "three axes"),
        (["--vector", "--settling"], 2, "--vector"),
        (["--bias-uncertainty", "much"], 2, "rate of rotation"),
    ],
)
def test_what_cannot_be_done_is_said(run: Run, logs: Path, options: list[str], code: int, words: str) -> None:
    done = run("earth-rate", logs / "rest.parquet", *PLACE, *options)
    assert (done.code, done.out) == (code, "")
    assert words in done.err


def test_volts_and_slow_logs(run: Run, logs: Path, tmp_path: Path) -> None:
    samples = rates()
    volts = 2.5 + samples[:, :1] / math.radians(1) * 0.024
    lines = ["time [s],g [V]", *(f"{i / RATE:.2f},{v:.9f}" for i, v in enumerate(volts[:2000, 0]))]
    (tmp_path / "volts.csv").write_text("\n".join(lines), encoding="utf-8")
    for command in (
        ["earth-rate"],
        ["north", "--model", GOOD, "--headings", str(tmp_path / "volts.csv")],
    ):
        done = run(command[0], tmp_path / "volts.csv", *PLACE, *command[1:])
        assert done.code == 1
        assert "--scale-factor" in done.err
    slow = samples[:: round(RATE)]
    write_recording(of_axes(slow, rate=1.0, force=False), tmp_path / "slow.parquet")
    done = run("earth-rate", tmp_path / "slow.parquet", *PLACE)
    assert done.code == 0, done.err


# -- figures and reports ------------------------------------------------------------------------------------


def test_a_rate_vector_is_drawn_from_its_record(logs: Path) -> None:
    record = al.read(logs / "rest.parquet")
    found = measure_rate_vector(record, latitude=LATITUDE)
    assert len(sheet_of(found).panels) == 4  # the length and the means: the result holds no samples
    whole = sheet_of(found, recording=record)
    assert len(whole.panels) == 7
    (length,) = sheet_of(found, view="length").panels
    assert length.curves[0].y[0] == pytest.approx(found.length / DEG_H)
    means = sheet_of(found, recording=record, view="means").panels
    for i, panel in enumerate(means):
        assert float(panel.curves[0].y.mean()) == pytest.approx(found.vector[i] / DEG_H, abs=0.05)
    spans = sheet_of(found, recording=record, view="record").panels[0].spans
    moved = [s for s in spans if s.kind == "disturbed" and s.start * 60 < KNOCK[1] and s.stop * 60 > KNOCK[0]]
    assert moved and min(s.start for s in moved) * 60 <= KNOCK[0]
    with pytest.raises(InputError, match="recording="):
        sheet_of(found, view="record")


def test_a_record_without_rest_has_a_report(run: Run, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    moving = BASE + 0.1 * np.cumsum(rng.standard_normal((6000, 3)), axis=0) * WHITE * 100
    write_recording(of_axes(moving), tmp_path / "moving.parquet")
    done = run("earth-rate", tmp_path / "moving.parquet", *PLACE, "--out", tmp_path / "out")
    assert done.code == 0, done.err
    assert done.out.startswith("Not resolved. ")
    assert "NaN" not in (tmp_path / "out" / "rate-vector.json").read_text(encoding="utf-8")


# -- the null test ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def east_west(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log with a bias of 3 deg/h that follows the turns, one without, and the list of positions."""
    place = tmp_path_factory.mktemp("null")
    for name, bias in (("bias", 3.0), ("none", 0.0)):
        motion = Motion.positions(
            [math.radians(90), math.radians(270)],
            dwell=60.0,
            coherent_bias=bias * DEG_H,
            coherent_heading=math.radians(90),
        )
        log = simulate(
            model_of(GOOD), rate=10.0, duration=1200.0, seed=3, unit="deg/h", latitude=LATITUDE, motion=motion
        )
        write_recording(log, place / f"{name}.parquet")
    rows = [f"{60 * k + 3},{60 * k + 60},{(90, 270)[k % 2]}" for k in range(20)]
    (place / "positions.csv").write_text("\n".join(["start,stop,heading", *rows, ""]), encoding="utf-8")
    return place


def test_a_bias_that_follows_the_turns_is_found(run: Run, east_west: Path, tmp_path: Path) -> None:
    options = [*PLACE, "--model", GOOD, "--headings", east_west / "positions.csv", "--null"]
    done = run("north", east_west / "bias.parquet", *options, "--out", tmp_path / "out")
    assert done.code == 0, done.err
    assert done.out.startswith("A bias follows the turns. ")
    document = json.loads((tmp_path / "out" / "east-west-null.json").read_text(encoding="utf-8"))
    bias = document["following"]
    assert bias["lower"] < 3 * DEG_H < bias["upper"]
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "A bias follows the turns." in page
    assert "banner fatal" in page
    none = run("north", east_west / "none.parquet", *options, "--heading-uncertainty", "1deg")
    assert none.out.startswith("No bias that follows the turns. ")
    row = next(line.split() for line in none.out.splitlines() if line.startswith("heading "))
    # a heading off by 1 deg lets in so much of the Earth
    share = 100 * math.cos(LATITUDE) * math.radians(1)
    assert float(row[2]) == pytest.approx(share, rel=0.05)


@pytest.mark.parametrize(
    "wrong",
    [["--rotation", "1deg/s"], ["--misalignment", "0.1deg"], ["--plot", "null.pdf"]],
)
def test_the_null_test_refuses_what_it_has_no_use_for(run: Run, east_west: Path, wrong: list[str]) -> None:
    listed = [] if wrong[0] == "--rotation" else ["--headings", str(east_west / "positions.csv")]
    done = run("north", east_west / "none.parquet", *PLACE, "--model", GOOD, "--null", *listed, *wrong)
    assert (done.code, done.out) == (2, "")
    assert "null" in done.err


# -- reports of any document --------------------------------------------------------------------------------


@pytest.mark.long
def test_every_document_gives_its_report_again(run: Run, logs: Path, east_west: Path, tmp_path: Path) -> None:
    rest, log, listed = logs / "rest.parquet", east_west / "none.parquet", east_west / "positions.csv"
    one = ["--model", GOOD, "--channels", "gx"]
    for name, arguments in {
        "rate-vector": ["earth-rate", rest, *PLACE],
        "earth-rate": ["earth-rate", rest, *PLACE, *one],
        "filter": ["filter", rest, *one, "--accept", "not_at_rest", "--accept", "disturbance"],
        "north": ["north", log, *PLACE, "--model", GOOD, "--headings", listed],
        "east-west-null": ["north", log, *PLACE, "--model", GOOD, "--headings", listed, "--null"],
        "plan": ["plan", "--model", GOOD, *PLACE, "--dwells", "30", "--durations", "1h"],
    }.items():
        made = run(*arguments, "--out", tmp_path / name)
        assert made.code in (0, 3), made.err
        again = tmp_path / f"{name}.html"
        done = run("report", tmp_path / name / f"{name}.json", "-o", again)
        assert done.code == 0, done.err
        assert without_links(again) == without_links(tmp_path / name / "report.html")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nothing", "not JSON (Expecting value: line 1 column 1 (char 0)): expected a result"),
        ("[1, 2]", "names no format"),
        ('{"format": "allanite-poem"}', "allanite-poem"),
        ('{"format": "allanite-north", "version": 3}', "version 3"),
        ('{"format": "allanite-north", "version": 1}', "missing"),
        ('{"format": "allanite-position-plan", "version": 1, "what": 3}', "'heading' is expected, not 3"),
        (
            '{"format": "allanite-calibration-estimate", "version": 1, "verdict": 3}',
            "'calibrated' is expected, not 3",
        ),
        ('{"format": "allanite-rate-vector", "version": 1, "channels": 3}', "channels: a list is expected"),
    ],
)
def test_a_file_that_is_no_document_is_named(run: Run, tmp_path: Path, text: str, words: str) -> None:
    place = tmp_path / "file.json"
    place.write_text(text, encoding="utf-8")
    done = run("report", place, "-o", tmp_path / "report.html")
    assert (done.code, done.out) == (1, "")
    assert words in done.err
    assert not (tmp_path / "report.html").exists()
    with pytest.raises(FormatError):
        render_file(place, tmp_path / "report.html")


def test_a_result_without_its_record_has_a_report_too(logs: Path) -> None:
    found: Any = measure_rate_vector(al.read(logs / "rest.parquet"))
    page = html_of(found)
    assert "Resolved." in page
    assert 'id="record-figure"' not in page
