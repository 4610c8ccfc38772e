# SPDX-License-Identifier: BSD-3-Clause
"""The command `in-motion`, its files, and its models in other programs' files."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.commands import measure
from allanite.errors import InputError
from allanite.exporters import EXPORTERS, exporter
from allanite.exporters.imu.usage import Usage
from allanite.noise import NoiseModel, Sinusoid, White
from allanite.study.model_file import load_models
from allanite.views.figures import sheet_of
from allanite.views.registry import document_of
from allanite.views.result_page import view_of
from shell import Run

GYRO, ACCELEROMETER = al.model_of("N=0.3 deg/√h, B=5 deg/h"), al.model_of("N=0.05 m/s/√h, B=30 µg")
RATE = 200.0


def _log(place: Path, names: str, models: tuple[NoiseModel, NoiseModel], seed: int, duration: float) -> Path:
    by_name = dict(zip(names.split(), models, strict=True))
    return al.write_recording(al.simulate(by_name, rate=RATE, duration=duration, seed=seed), place)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("logs")
    rotor = [Sinusoid(amplitude=0.02 / k, frequency=31.7 * k) for k in (1, 2, 3)]
    moved = (
        NoiseModel.of(White(N=2e-3), *GYRO.terms[1:], *rotor),
        NoiseModel.of(White(N=1e-2), *ACCELEROMETER.terms[1:], kind="acceleration"),
    )
    return (
        _log(folder / "rest.parquet", "gyro_x acc_x", (GYRO, ACCELEROMETER), 1, 200.0),
        _log(folder / "flown.parquet", "gyro_x acc_x", moved, 2, 100.0),
    )


@pytest.fixture(scope="module")
def document(logs: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("document") / "in-motion.json"
    measured = measure("in-motion", logs)
    place.write_text(json.dumps(measured.plain, allow_nan=False), encoding="utf-8")
    return place


def test_verdict_tables_figure_and_models(logs: tuple[Path, Path], tmp_path: Path, run: Run) -> None:
    out, told = tmp_path / "out", tmp_path / "told.json"
    done = run("in-motion", *logs, "--out", out, "--plot", tmp_path / "m.png", "-o", told)
    assert done.code == 0, done.err
    assert done.out.startswith("More noise in motion.") and "lines at 1, 2 and 3 times 31.70 Hz" in done.out
    assert "cannot tell vibration of the body from noise of the sensor" in done.out
    assert (tmp_path / "m.png").stat().st_size > 10_000
    bands = list(csv.DictReader((out / "bands.csv").open(encoding="utf-8")))
    assert {row["channel"] for row in bands} == {"gyro_x", "acc_x"}
    assert all(float(row["inflation_lower"]) > 5 for row in bands if float(row["lower_hz"]) > 10)
    lines = list(csv.DictReader((out / "lines.csv").open(encoding="utf-8")))
    assert [row["order"] for row in lines] == ["1", "2", "3"]
    models, _ = load_models(told)
    assert models["gyro_x"].term("white").N > 2e-3 and models["gyro_x"].in_motion.lines > 0.01
    saved = document_of(json.loads((out / "in-motion.json").read_text(encoding="utf-8")))
    assert [s.id for s in view_of(saved).sections][:4] == ["verdict", "told", "bands", "lines"]
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "What to tell a filter" in page and "Satterthwaite" in page


@pytest.mark.long
def test_quantities_without_more_noise_are_told_as_at_rest(tmp_path: Path, run: Run) -> None:
    quiet = [_log(tmp_path / f"{i}.parquet", "g a", (GYRO, ACCELEROMETER), 10 + i, 100.0) for i in (1, 2)]
    done = run("in-motion", *quiet, "-o", tmp_path / "told.json")
    assert done.code == 0 and done.out.startswith("No more noise in motion.")
    text = run("export", "kalibr", tmp_path / "told.json", "--rate", 200).out
    assert "N as at rest: 2.parquet shows no more noise" in text
    rest = al.fit(al.read(quiet[0]), method="spectral", channel="g")
    value = float(re.search(r"gyroscope_noise_density: (\S+)", text)[1])
    assert value == pytest.approx(rest.term("white").N, rel=1e-6)


NOISE = [name for name in EXPORTERS if isinstance(getattr(exporter(name), "USAGE", None), Usage)]


@pytest.mark.parametrize("name", [*NOISE, "cpp"])
def test_every_file_takes_the_document_and_states_the_reason(document: Path, name: str) -> None:
    options = {"channel": "gyro_x"} if name == "cpp" else {}
    needed = {"correlation_time": 100.0} if _needs_time(name) else {}
    models, rate = load_models(document)
    assert rate == RATE
    text = al.export(name, models, rate=rate, **options, **needed)
    assert "N IN MOTION (flown.parquet)" in text and "upper limit of the sensor's own" in text
    assert "slow changes in flown.parquet may be movement of the body" in text


def _needs_time(name: str) -> bool:
    try:
        al.export(name, {"gyro": GYRO, "acc": ACCELEROMETER}, rate=RATE)
    except InputError as fault:
        return "correlation" in str(fault)
    return False


def test_the_document_goes_straight_into_an_export(document: Path, run: Run) -> None:
    done = run("export", "kalibr", document)
    assert done.code == 0, done.err
    told = load_models(document)[0]["gyro_x"].term("white").N
    assert float(re.search(r"gyroscope_noise_density: (\S+)", done.out)[1]) == pytest.approx(told, rel=1e-6)
    assert "of a sensor IN MOTION" in done.out and "update_rate: 200.0" in done.out


@pytest.mark.long
def test_faults_of_a_log_in_motion_are_reported_and_its_motion_is_none(
    logs: tuple[Path, Path], tmp_path: Path, run: Run
) -> None:
    y = al.read(logs[1]).values("gyro_x").copy()
    y = np.clip(y + 0.5 * np.sin(np.arange(len(y)) / 900.0), -0.45, 0.45)
    clipped = al.write_recording(
        al.Recording.from_rate(y, rate=RATE, unit="rad/s", names=["gyro_x"]), tmp_path / "clipped.parquet"
    )
    done = run("in-motion", logs[0], clipped)
    assert done.code == 1 and "--accept clipping" in done.err and "not_at_rest" not in done.err
    done = run("in-motion", logs[0], clipped, "--accept", "clipping")
    assert done.code == 0 and "clipped.parquet: gyro_x: the largest value" in " ".join(done.out.split())


def test_figures(document: Path) -> None:
    result = document_of(json.loads(document.read_text(encoding="utf-8"))).result
    assert len(sheet_of(result).rows) == 3 and len(sheet_of(result, view="inflation").rows) == 1
    with pytest.raises(InputError, match="no view 'curve'"):
        sheet_of(result, view="curve")


@pytest.mark.long
def test_one_log_is_refused_and_two_are_taken(logs: tuple[Path, Path], run: Run) -> None:
    done = run("in-motion", logs[0])
    assert done.code == 1 and "state the log at rest, then those in motion" in done.err
    assert run("in-motion", *logs, "--channels", "gyro_x").code == 0


@pytest.mark.long
def test_pairs_and_units_are_stated_as_the_refusals_say(tmp_path: Path, run: Run) -> None:
    y = np.random.default_rng(1).standard_normal((6000, 2)) * 1e-3
    for name, heads in (
        ("rest", "first [rad/s],second [rad/s]"),
        ("moved", "a [rad/s],b [rad/s]"),
        ("raw", "a,b"),
    ):
        np.savetxt(tmp_path / f"{name}.csv", y + len(name), delimiter=",", header=heads, comments="")
    rest, moved, raw = (tmp_path / f"{name}.csv" for name in ("rest", "moved", "raw"))
    done = run("in-motion", rest, moved, "--rate", 100)
    assert done.code == 1 and "state pairs, --match gx,gyro_x" in done.err
    assert run("in-motion", rest, moved, "--rate", 100, "--match", "first,a").code == 0
    done = run("in-motion", rest, moved, "--rate", 100, "--match", "first,a,b")
    assert done.code == 1 and "by two, at rest and in motion" in done.err
    done = run("in-motion", rest, raw, "--rate", 100, "--match", "first,a")
    assert done.code == 1 and "state the units of both (--unit)" in done.err
    done = run("in-motion", rest, raw, "--rate", 100, "--match", "first,a", "--unit", f"{raw}=rad/s")
    assert done.code == 0, done.err
