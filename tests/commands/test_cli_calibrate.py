# SPDX-License-Identifier: BSD-3-Clause
"""`allanite calibrate` from end to end, on twins of a unit turned by hand whose errors are known."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

import allanite as al
from allanite.commands.calibration import calibration_of
from allanite.commands.cli.options import Numbers
from allanite.errors import DataQualityError, InputError
from allanite.experiments.calibration import CalibrationEstimate
from allanite.files.recording_file import write_recording
from allanite.filtering.simulation import UnitMotion, simulate_unit
from allanite.recording.calibration import Calibration, parameter_names
from allanite.recording.records import ArrayColumn
from allanite.study.model_file import model_of, save_models
from shell import Run

LATITUDE = 48.1
SIZES = {
    "accelerometer.bias": 0.3,
    "accelerometer.scale": 0.01,
    "accelerometer.misalignment": 0.008,
    "gyro.bias": 0.01,
    "gyro.scale": 0.01,
    "gyro.misalignment": 0.01,
}
MODELS = {
    "gyro": model_of("N=0.3 deg/√h, B=8 deg/h"),
    "accelerometer": model_of("N=0.06 m/s/√h, B=30 µg"),
}


def errors() -> Calibration:
    """The true errors of the unit."""
    rng = np.random.default_rng(3)
    names = (*parameter_names("accelerometer", frame="z"), *parameter_names("gyro"))
    values = [(".scale_" in n) + SIZES[n.rpartition("_")[0]] * rng.uniform(-1, 1) for n in names]
    return Calibration(
        names=names,
        values=np.array(values),
        covariance=np.zeros((21, 21)),
        status=("held",) * 21,
        units={"accelerometer": "m/s²", "gyro": "rad/s"},
    )


def recorded(seed: int, motion: UnitMotion, truth: Calibration) -> al.Recording:
    return simulate_unit(
        MODELS,
        rate=50.0,
        motion=motion,
        latitude=math.radians(LATITUDE),
        calibration=truth,
        seed=seed,
    )


@pytest.fixture(scope="module")
def unit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the log of a unit in sixteen positions, the list of its rests, and the models of its channels."""
    place = tmp_path_factory.mktemp("unit")
    attitudes = np.concatenate(
        [
            UnitMotion.faces(dwell=8.0).attitudes,
            UnitMotion.many(10, seed=5, dwell=8.0).attitudes,
        ]
    )
    motion = UnitMotion.positions(
        attitudes, dwell=[20.0] + [6.0] * 15, turn=(1.5, 2.5), pointing_sd=0.05, tremor=0.01
    )
    log = recorded(1, motion, errors())
    write_recording(log, place / "unit.parquet")
    rests = log.history[-1]["motion"]["positions"]
    rows = [f"{p['start'] + 0.3},{p['stop'] - 0.3}" for p in rests]
    (place / "rests.csv").write_text("\n".join(["start,stop", *rows]), encoding="utf-8")
    channels = {n: MODELS["gyro" if n.startswith("gyro") else "accelerometer"] for n in log.names}
    save_models({n: m.to_json() for n, m in channels.items()}, place / "models.json")
    return place


@pytest.fixture(scope="module")
def measured(unit: Path) -> dict[str, Any]:
    return dict(calibration_of(unit / "unit.parquet", latitude=math.radians(LATITUDE)).plain)


def altered(unit: Path, target: Path, start: float, stop: float, name: str, by: float) -> Path:
    """The log with something added to one channel for a while."""
    log = al.read(unit / "unit.parquet")
    i = log.index(name)
    samples = np.array(log.values(name))
    samples[round(start * 50) : round(stop * 50)] += by
    columns = [*log.columns[:i], ArrayColumn(samples), *log.columns[i + 1 :]]
    write_recording(replace(log, columns=tuple(columns)), target)
    return target


# -- from end to end ----------------------------------------------------------------------------------------


def test_a_unit_is_calibrated_and_everything_is_left_behind(run: Run, unit: Path, tmp_path: Path) -> None:
    out = tmp_path / "calibration"
    done = run(
        "calibrate", unit / "unit.parquet", "--model", unit / "models.json", "--latitude", LATITUDE,
        "--out", out, "--plot", tmp_path / "sphere.pdf",
    )  # fmt: skip
    assert done.code == 0, done.err
    assert done.out.startswith("Calibrated. 16 positions determine all 21 parameters")
    for words in (
        "Accelerometers",
        "Bias x",
        "Scale factor z",
        "Misalignment zy",
        "9.80900 m/s²",
        "models.json",
    ):
        assert words in done.out
    truth, found = errors(), Calibration.load(out / "calibration.json")
    assert found.names == truth.names
    # 21 normal deviates: all within 4.2 in 99.94 % of records.
    assert np.abs((found.values - truth.values) / found.sd).max() < 4.2
    assert found.channels["gyro"] == ("gyro_x", "gyro_y", "gyro_z")
    document = json.loads((out / "calibration.json").read_text(encoding="utf-8"))
    assert (document["spans_source"], document["model_source"]) == ("found", "given")
    assert len(document["overviews"]) == 6
    with (out / "positions.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["number"] for row in rows] == [str(i) for i in range(1, 17)]
    assert np.hypot.reduce([float(rows[3][f"up_{a}"]) for a in "xyz"]) == pytest.approx(1.0, abs=1e-5)
    page = (out / "report.html").read_text(encoding="utf-8")
    for figure in ("sphere", "residuals-figure", "parameters-figure", "correlation", "log-figure"):
        assert f'class="live" id="{figure}"' in page
    assert (tmp_path / "sphere.pdf").read_bytes().startswith(b"%PDF")
    again = run("calibrate", unit / "unit.parquet", "--out", out)
    assert again.code == 1 and "--force" in again.err


@pytest.mark.long
def test_the_calibration_is_taken_off_the_log(unit: Path, measured: dict[str, Any]) -> None:
    log = Calibration.from_json(measured).apply(al.read(unit / "unit.parquet"))
    force = np.stack([log.values(f"acc_{a}") for a in "xyz"])
    for p in measured["positions"]:
        mean = force[:, round(p["start"] * 50) : round(p["stop"] * 50)].mean(axis=1)
        assert np.linalg.norm(mean) - measured["gravity"] == pytest.approx(p["excess"], abs=2e-5)


@pytest.mark.long
def test_positions_can_be_listed_and_left_out(run: Run, unit: Path, measured: dict[str, Any]) -> None:
    done = run(
        "calibrate", unit / "unit.parquet", "--latitude", LATITUDE, "--spans", unit / "rests.csv",
        "--without", "7,12", "--json",
    )  # fmt: skip
    assert done.code == 0, done.err
    document = json.loads(done.out)
    assert document["spans_source"] == "given"
    assert [p["number"] for p in document["positions"] if not p["used"]] == [7, 12]
    for one, other in zip(document["parameters"], measured["parameters"], strict=True):
        # 14 of the same 16 positions: the difference is smaller than either error.
        assert abs(one["value"] - other["value"]) < 3 * one["sd"], one["name"]


@pytest.mark.long
def test_a_part_has_its_own_positions_and_says_what_it_leaves_open(run: Run, unit: Path) -> None:
    done = run("calibrate", unit / "unit.parquet", "--latitude", LATITUDE, "--to", "28s")
    assert done.code == 0, done.err
    assert done.out.startswith("Partly calibrated. 2 positions")
    assert "Not observable " in done.out and "not observable, assumed" in done.out
    assert "→" in done.out


def test_listed_times_count_from_the_start_of_the_log(unit: Path, measured: dict[str, Any]) -> None:
    starts = [p["start"] for p in measured["positions"]]
    cut = starts[3] - 1.0
    found = calibration_of(
        unit / "unit.parquet", latitude=math.radians(LATITUDE), spans=unit / "rests.csv", start=cut
    ).plain
    assert len(found["positions"]) == 13
    assert found["positions"][0]["start"] == pytest.approx(starts[3] - cut, abs=0.5)
    with pytest.raises(InputError, match="none of the listed spans"):
        calibration_of(unit / "unit.parquet", spans=unit / "rests.csv", start=20.2, stop=20.4)


@pytest.mark.long
def test_a_position_that_contradicts_the_others_is_named(
    run: Run, unit: Path, tmp_path: Path, measured: Any
) -> None:
    odd = measured["positions"][8]
    log = altered(unit, tmp_path / "odd.parquet", odd["start"] - 0.5, odd["stop"] + 0.5, "acc_z", 0.05)
    done = run("calibrate", log, "--latitude", LATITUDE)
    assert done.code == 0, done.err
    line = next(row for row in done.out.splitlines() if row.rstrip().endswith("outlier"))
    assert line.split()[0] == "9"
    assert "Position 9 contradicts" in done.out and "--without 9" in done.out


def test_triads_can_be_calibrated_alone(run: Run, unit: Path) -> None:
    found = calibration_of(unit / "unit.parquet", latitude=math.radians(LATITUDE), channels=["acc"]).plain
    assert found["earth"] is None and not found["turns"]
    assert {row["name"].partition(".")[0] for row in found["parameters"]} == {"accelerometer"}


@pytest.mark.long
def test_counts_need_names_and_come_back_in_counts(run: Run, unit: Path, tmp_path: Path) -> None:
    log = al.read(unit / "unit.parquet")
    counts = np.column_stack([np.rint(log.values(n) * (5e3 if "acc" in n else 2e4) + 3e4) for n in log.names])
    names = ["g1", "g2", "g3", "a1", "a2", "a3"]
    raw = al.Recording.from_rate(counts, rate=50.0, unit="counts", names=names)
    write_recording(raw, tmp_path / "raw.parquet")
    assert run("calibrate", tmp_path / "raw.parquet").code == 1
    done = run(
        "calibrate", tmp_path / "raw.parquet", "--latitude", LATITUDE, "--gyro", "g1,g2,g3",
        "--accelerometer", "a1,a2,a3", "--json",
    )  # fmt: skip
    assert done.code == 0, done.err
    found = Calibration.from_json(json.loads(done.out))
    truth = errors()
    for sensor, gain in (("accelerometer", 5e3), ("gyro", 2e4)):
        for axis in "xyz":
            scale, sd = found[f"{sensor}.scale_{axis}"]
            assert abs(scale - gain * truth[f"{sensor}.scale_{axis}"][0]) < 4.2 * sd
            bias, sd = found[f"{sensor}.bias_{axis}"]
            assert abs(bias - 3e4 - gain * truth[f"{sensor}.bias_{axis}"][0]) < 4.2 * sd


def test_what_positions_do_to_a_record_is_no_fault(measured: dict[str, Any]) -> None:
    assert {f["severity"] for f in measured["findings"]} <= {"info"}


# -- what is refused ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options",
    [
        ["--without", "x"],
        ["--without", "0"],
        ["--frame", "y"],
        ["--height", "500"],
        ["--latitude", "95"],
        ["--spans", "nowhere.csv"],
    ],
)
def test_wrong_usage_ends_with_two(run: Run, unit: Path, options: list[str]) -> None:
    done = run("calibrate", unit / "unit.parquet", *options)
    assert (done.code, done.out) == (2, "")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--gravity", "9.2"], "9.7 to 9.9"),
        (["--gyro", "gyro_x,gyro_y"], "three different channels"),
        (["--without", "99"], "no position 99"),
        (["--reference-temperature", "25"], "temperature"),
        (["--plot", "sphere.doc"], ".pdf"),
        (["--model", "N=0.1 deg/√h"], "model"),
    ],
)
def test_a_failure_ends_with_one_and_says_why(run: Run, unit: Path, options: list[str], words: str) -> None:
    done = run("calibrate", unit / "unit.parquet", *options)
    assert (done.code, done.out) == (1, "")
    assert words in done.err


def test_a_unit_that_never_rests_is_refused(unit: Path, tmp_path: Path) -> None:
    log, time = al.read(unit / "unit.parquet").window(0.0, 20.0), np.arange(1000) / 50.0
    columns = tuple(
        ArrayColumn(np.sin(time + k) + 9.8 * (name == "acc_z")) for k, name in enumerate(log.names)
    )
    write_recording(replace(log, columns=columns), tmp_path / "swing.parquet")
    with pytest.raises(DataQualityError, match="nowhere at rest long enough"):
        calibration_of(tmp_path / "swing.parquet", model=unit / "models.json")


def test_numbers_of_positions() -> None:
    assert Numbers()("7,12-13") == (7, (12, 13))
    for words in ("7,", "7-8-9", "0", "a", "3-0", ""):
        with pytest.raises(click.BadParameter, match="no numbers of positions"):
            Numbers()(words)
    assert Numbers()((3,)) == (3,)


# -- what is no fault, and what is --------------------------------------------------------------------------


def written(log: al.Recording, target: Path, **samples: np.ndarray) -> Path:
    """The log with other samples in some channels."""
    columns = [
        ArrayColumn(samples[n]) if n in samples else c for n, c in zip(log.names, log.columns, strict=True)
    ]
    write_recording(replace(log, columns=tuple(columns)), target)
    return target


@pytest.mark.long
def test_b16_a_log_without_noise_loses_no_position(run: Run, tmp_path: Path) -> None:
    """Its samples repeat at rest, as those of a simulation do: nothing is refused, left out or accepted by hand."""
    silent = {"gyro": model_of("N=1e-9 deg/√h"), "accelerometer": model_of("N=1e-9 m/s/√h")}
    motion = UnitMotion.icosahedron(12, dwell=6.0, turn=3.0)
    log = simulate_unit(
        silent, rate=50.0, motion=motion, latitude=math.radians(LATITUDE), calibration=errors(), seed=1
    )
    rounded = {n: np.round(log.values(n), 9) for n in log.names}
    path = written(log, tmp_path / "silent.parquet", **rounded)
    done = run("calibrate", path, "--latitude", LATITUDE, "--json")
    assert done.code == 0, done.err
    document = json.loads(done.out)
    assert document["verdict"] == "calibrated"
    assert all(p["used"] for p in document["positions"]) and len(document["positions"]) == 12
    assert not [
        f
        for f in document["findings"]
        if f["severity"] == "fatal" or (f["code"], f["severity"]) == ("clipping", "warning")
    ]
    truth = errors()
    for p in document["parameters"]:
        assert abs(p["value"] - truth[p["name"]][0]) < 1e-6, p["name"]


@pytest.mark.long
def test_b16_a_reading_that_freezes_costs_its_position_and_is_said(
    run: Run, unit: Path, tmp_path: Path
) -> None:
    log = al.read(unit / "unit.parquet")
    rows = (unit / "rests.csv").read_text(encoding="utf-8").splitlines()
    a, b = (round(50 * float(t)) for t in rows[6].split(","))
    frozen = np.array(log.values("acc_y"))
    frozen[a - 50 : b + 50] = frozen[a]
    path = written(log, tmp_path / "frozen.parquet", acc_y=frozen)
    done = run("calibrate", path, "--latitude", LATITUDE, "--spans", unit / "rests.csv", "--json")
    document = json.loads(done.out)
    assert "stuck" in {f["code"] for f in document["findings"] if f["severity"] != "info"}
    lost = [p for p in document["positions"] if not p["used"]]
    assert [(p["number"], p["why"]) for p in lost] == [(6, "samples missing")]
    assert "positions not used" in document["remarks"]
    assert "position 6: not used, samples missing" in CalibrationEstimate.from_json(document).notes
    assert document["verdict"] == "calibrated"
    for p in document["parameters"]:
        assert abs(p["value"] - errors()[p["name"]][0]) < 5 * p["sd"], p["name"]


# -- two files ----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def two(unit: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The same log as plain numbers in two files: time, x, y, z in g, and in deg/s."""
    log = al.read(unit / "unit.parquet")
    place = tmp_path_factory.mktemp("two")
    for sensor, factor in (("acc", 1 / 9.80665), ("gyro", math.degrees(1))):
        rows = [np.arange(log.n_samples) / 50, *(factor * log.values(f"{sensor}_{a}") for a in "xyz")]
        np.savetxt(place / f"{sensor}.txt", np.transpose(rows), fmt="%.9g")
    return place / "acc.txt", place / "gyro.txt"


@pytest.mark.long
def test_accelerometers_and_gyros_in_two_files(
    run: Run, unit: Path, two: tuple[Path, Path], measured: dict[str, Any]
) -> None:
    acc, gyro = two
    done = run(
        "calibrate", acc, "--gyro-log", gyro, "--unit", "acc=g,gyro=deg/s", "--latitude", LATITUDE, "--json"
    )  # fmt: skip
    assert done.code == 0, done.err
    document = json.loads(done.out)
    assert document["source"] == "acc.txt and gyro.txt"
    assert document["calibration"]["channels"] == {
        "accelerometer": ["acc_ch0", "acc_ch1", "acc_ch2"],
        "gyro": ["gyro_ch0", "gyro_ch1", "gyro_ch2"],
    }
    for p, one in zip(document["parameters"], measured["parameters"], strict=True):
        assert abs(p["value"] - one["value"]) < 0.1 * one["sd"], p["name"]


def test_two_files_must_hold_the_same_instants(run: Run, two: tuple[Path, Path], tmp_path: Path) -> None:
    acc, gyro = two
    rows = gyro.read_text(encoding="utf-8").splitlines()
    (tmp_path / "short.txt").write_text("\n".join(rows[:-30]), encoding="utf-8")
    done = run("calibrate", acc, "--gyro-log", tmp_path / "short.txt", "--unit", "acc=g,gyro=deg/s")
    assert done.code == 1 and "have different sample times" in done.err and "50 Hz" in done.err
    done = run("calibrate", acc, "--gyro-log", gyro, "--accelerometer", "ch0,ch1")
    assert done.code == 1 and "three different channels" in done.err


def test_b_files_begun_apart_are_not_one(two: tuple[Path, Path]) -> None:
    from allanite.commands.two_logs import joined

    first, second = (
        replace(al.read(p), start=1_700_000_000_000_000_000 + k * 20_000_000) for k, p in enumerate(two)
    )
    with pytest.raises(InputError, match=r"begun 0\.02 s apart"):
        joined(first, second, first.names, second.names)
    whole, force, rate = joined(first, replace(second, start=first.start), first.names, second.names)
    assert whole.names == (*force, *rate)
    np.testing.assert_array_equal(whole.values("gyro_ch2"), second.values("ch2"))
