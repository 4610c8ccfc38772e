# SPDX-License-Identifier: BSD-3-Clause
"""The command `spectrum`, its figure, its report, and `fit --method spectral`."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.files.recording_file import write_recording
from allanite.noise import NoiseModel, RandomWalk, Sinusoid, White
from allanite.noise.spectrum.estimation import power_spectrum
from allanite.views.figures import sheet_of
from allanite.views.report import html_of
from shell import Run

MODEL = NoiseModel.of(White(N=1e-4), RandomWalk(K=3e-6), Sinusoid(amplitude=6e-5, frequency=3.3))


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("log") / "gyro.parquet"
    return write_recording(al.simulate(MODEL, rate=20.0, duration=1200.0, seed=3), place)


@pytest.fixture(scope="module")
def model(log: Path) -> Path:
    place = log.parent / "model.json"
    place.write_text(json.dumps({"gyro": MODEL.to_json()}), encoding="utf-8")
    return place


@pytest.mark.long
def test_spectrum_with_its_model(log: Path, model: Path, tmp_path: Path, run: Run) -> None:
    out = tmp_path / "out"
    done = run("spectrum", log, "--model", model, "--out", out, "--plot", tmp_path / "s.png")
    assert done.code == 0, done.err
    assert "steady: a sinusoid" in done.out and "Model and spectrum agree." in done.out
    assert "two-sided" in done.out
    assert (tmp_path / "s.png").stat().st_size > 10_000
    rows = list(csv.DictReader((out / "spectrum.csv").open(encoding="utf-8")))
    assert float(rows[-1]["density"]) == pytest.approx(1e-8, rel=0.2)
    assert float(rows[-1]["model"]) == pytest.approx(1e-8, rel=1e-3)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "as these segments would show it" in page and "Model and spectrum agree." in page
    document = json.loads((out / "spectrum.json").read_text(encoding="utf-8"))
    assert document["format"] == "allanite-spectrum"
    assert html_of(document).count("<h2") == page.count("<h2")


def test_spectrum_by_welch_as_json(log: Path, run: Run) -> None:
    done = run("spectrum", log, "--method", "welch", "--segment", "10s", "--window", "blackman", "--json")
    document = json.loads(done.out)
    (channel,) = document["channels"]
    assert channel["spectrum"]["window"] == "blackman"
    assert channel["spectrum"]["resolution"][0] == pytest.approx(0.1)
    assert channel["expected"] is None


@pytest.mark.long
def test_a_constant_channel_has_no_density(tmp_path: Path, run: Run) -> None:
    """One of three channels is 0.5 wherever it is there: it is said to show no noise, and the others are shown."""
    rng = np.random.default_rng(1)
    y = 1e-3 * rng.standard_normal((6000, 3))
    y[:, 1] = 0.5
    y[rng.random(6000) < 0.02, 1] = np.nan
    record = al.Recording.from_rate(y, rate=50.0, unit="deg/s", names=("gx", "gy", "gz"))
    log, out = write_recording(record, tmp_path / "log.parquet"), tmp_path / "out"
    done = run("spectrum", log, "--model", "N=0.0001 deg/√h", "--plot", tmp_path / "s.png", "--out", out)
    assert "e-14" not in done.out and done.out.count("Root density") == 2
    assert "none: no noise resolved: every sample is 0.5 deg/s (resolution limit)" in done.out
    assert "fatal no_noise_resolved" in done.out
    assert done.out.count("Model and spectrum") == 2
    rows = list(csv.DictReader((out / "spectrum.csv").open(encoding="utf-8")))
    assert {row["channel"] for row in rows} == {"gx", "gz"}
    assert "no noise resolved" in (out / "report.html").read_text(encoding="utf-8")


def test_a_model_that_is_not_this_sensors(log: Path, run: Run) -> None:
    done = run("spectrum", log, "--model", "N=0.5 deg/√h")
    assert done.code == 0
    assert "Model and spectrum do not agree: from" in done.out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--segment", "10s"], "method 'welch'"),
        (["--method", "welch", "--segment", "1h"], "segments of this record"),
    ],
)
def test_wrong_choices_are_said(log: Path, run: Run, options: list[str], said: str) -> None:
    done = run("spectrum", log, *options)
    assert done.code == 1 and said in done.err


def test_fit_by_the_spectrum(log: Path, run: Run) -> None:
    done = run("fit", log, "--method", "spectral", "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)["gyro"]
    n = next(e for e in found["estimates"] if e["symbol"] == "N")
    assert n["lower"] < 1e-4 < n["upper"]
    assert "sinusoid" in [t["type"] for t in found["terms"]]


def test_figure_of_a_spectrum_alone_and_with_a_model(log: Path) -> None:
    spectrum = power_spectrum(al.read(log), "gyro")
    (alone,) = sheet_of(spectrum).panels
    assert [c.label for c in alone.curves] == ["gyro"]
    density, ratio = sheet_of(spectrum, model=MODEL).panels
    assert {"gyro", "model", "N", "K"} <= {c.label for c in density.curves}
    assert any("steady" in label.text for label in density.labels)
    assert "relative to the model" in ratio.title
    assert al.plot(spectrum, model=MODEL, interactive=True).sheet.panels
    with pytest.raises(InputError, match="needs a model"):
        sheet_of(spectrum, view="ratio")
