# SPDX-License-Identifier: BSD-3-Clause
"""characterize: from a recording to a complete, versioned document."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.errors import DataQualityError, FormatError, InputError, StorageError
from allanite.files.recording_file import write_recording
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from allanite.recording.records import Recording
from allanite.views.report import html_of
from shell import Run

TRUTH = NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-5))


@pytest.fixture(scope="module")
def study() -> al.Study:
    record = al.simulate(
        {"gyro_x": TRUTH, "gyro_y": NoiseModel.of(White(N=2e-4))}, rate=50.0, duration=1500.0, seed=4
    )
    return al.characterize(record)


@pytest.mark.long
def test_the_document_is_complete_and_plain(study: al.Study) -> None:
    document = study.to_json()
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["format"] == "allanite-study" and document["version"] == 2
    assert document["recording"]["samples"] == 75_000 and document["recording"]["rate"] == 50.0
    channel = study["gyro_x"]
    assert channel.curve.used.any() and channel.curve.tau.size == channel.curve.used.size
    assert channel.overview.t.size and channel.spectrum.frequency.size and channel.slopes
    k = channel.models[0].estimate("K")
    assert k is not None and k.supported and k.lower < 1e-5 < k.upper
    assert {a.symbol for a in channel.advice} >= {"K"}
    with pytest.raises(InputError, match="gyro_x, gyro_y"):
        study["gyro_z"]


def test_models_come_back(study: al.Study) -> None:
    models = study.models
    assert set(models) == {"gyro_x", "gyro_y"}
    assert [t.type for t in models["gyro_y"].terms] == ["white"]
    curve = study["gyro_x"].curve
    np.testing.assert_allclose(models["gyro_x"].adev(curve.tau)[:8], curve.deviation[:8], rtol=0.05)


def test_save_and_load(study: al.Study, tmp_path: Path) -> None:
    path = study.save(tmp_path / "study.json")
    assert al.Study.load(path).to_json() == study.to_json()
    with pytest.raises(StorageError, match="--force"):
        study.save(path)
    study.save(path, force=True)


def test_a_damaged_study_names_every_fault(study: al.Study, tmp_path: Path) -> None:
    document = study.to_json()
    del document["recording"]["rate"]
    document["channels"][1]["curve"]["dt"] = "fast"
    with pytest.raises(
        FormatError, match=r"(?s)recording\.rate is missing.*channels\[1\]\.curve\.dt: a float"
    ):
        al.Study.from_json(document)
    with pytest.raises(FormatError, match="version 9"):
        al.Study.from_json({"format": "allanite-study", "version": 9})
    with pytest.raises(InputError, match="no such file"):
        al.Study.load(tmp_path / "none.json")
    (tmp_path / "x.json").write_text("t,gyro")
    with pytest.raises(
        FormatError, match=r"x\.json is not JSON .*expected a study, study.json of 'allanite char"
    ):
        al.Study.load(tmp_path / "x.json")
    for text in ("{", "[1]", '{"format": "other"}'):
        (tmp_path / "x.json").write_text(text)
        with pytest.raises(FormatError):
            al.Study.load(tmp_path / "x.json")


@pytest.mark.long
def test_the_samples_are_fitted_where_the_curve_ends_early(run: Run, tmp_path: Path) -> None:
    """One message in fifty is lost: no long stretch is unbroken, and the curve alone sees nothing slow."""
    truth = NoiseModel.of(White(N=1e-4), RandomWalk(K=2e-5))
    whole = al.simulate({"gyro": truth}, rate=50.0, duration=1500.0, seed=12)
    y = whole.values("gyro").copy()
    y[np.random.default_rng(12).random(y.size) < 0.02] = np.nan
    record = Recording.from_rate(y, rate=50.0, unit="rad/s", names=["gyro"])
    estimates = {}
    for method in ("moments", "likelihood"):
        study = al.characterize(record, method=method)
        estimates[method] = {e.symbol: e for e in study["gyro"].models[0].estimates}
    assert not estimates["moments"]["K"].supported
    k = estimates["likelihood"]["K"]
    assert k.supported and k.lower < 2e-5 < k.upper < estimates["moments"]["K"].upper / 2
    direct = al.fit(record, method="likelihood").estimate("K")
    assert direct is not None and (k.lower, k.upper) == pytest.approx((direct.lower, direct.upper))
    page = html_of(study)
    assert "maximize the Gaussian likelihood of all samples" in page and "fitted to the samples" in page
    log = write_recording(record, tmp_path / "lossy.parquet")
    done = run("characterize", log, "--method", "likelihood", "--out", tmp_path / "out")
    assert done.code == 3, done.err  # missing samples
    assert "; K < " not in (tmp_path / "out" / "imu.yaml").read_text()  # the walk is a number, no limit
    refused = run("characterize", log, "--method", "likelihood", "--exclude", "1:2", "--out", tmp_path / "no")
    assert refused.code == 1 and "does not support exclude" in refused.err
    with pytest.raises(InputError, match="'moments' or 'likelihood'"):
        al.characterize(record, method="slopes")


def test_progress_rises_to_one() -> None:
    seen: list[float] = []
    al.characterize(
        al.simulate(NoiseModel.of(White(N=1.0)), rate=10.0, duration=200.0, seed=1),
        progress=lambda fraction, text: seen.append(fraction),
    )
    assert (
        seen[0] == 0.0
        and seen[-1] == 1.0
        and all(b >= a - 1e-12 for a, b in zip(seen, seen[1:], strict=False))
    )


def test_a_fatal_finding_refuses_and_can_be_accepted() -> None:
    y = np.clip(np.random.default_rng(1).standard_normal(20_000), -0.9, 0.9)
    record = Recording.from_rate(y, rate=10.0, unit="deg/s")
    with pytest.raises(DataQualityError, match="--accept clipping") as refused:
        al.characterize(record)
    assert refused.value.findings
    accepted = al.characterize(record, accept=["clipping"])
    assert any(f.accepted for f in accepted.findings)
    with pytest.raises(InputError, match="clippin"):
        al.characterize(record, accept=["clippin"])


@pytest.mark.long
def test_c7_a_sine_is_a_line_not_a_term() -> None:
    rate, n = 20.0, 200_000
    record = al.simulate(NoiseModel.of(White(N=1e-3)), rate=rate, duration=n / rate, seed=7)
    y = record.values("gyro") + 3e-3 * np.sin(2 * np.pi * 0.5 * np.arange(n) / rate)
    study = al.characterize(Recording.from_rate(y, rate=rate, unit="rad/s"))
    channel = study["signal"]
    assert [round(line.frequency, 3) for line in channel.spectrum.lines] == [0.5]
    assert "spectral_line" in {f.code for f in study.findings}
    model = study.models["signal"]
    assert [t.type for t in model.terms] == ["white", "sinusoid"]  # steady: a line of the model, and no noise
    assert model.terms[1].amplitude == pytest.approx(3e-3, rel=0.02)
    assert channel.curve.used.all()
    n_ = model.estimate("N")
    assert n_ is not None and n_.lower < 1e-3 < n_.upper


def test_filtered_sensor_keeps_short_lags_out() -> None:
    rng = np.random.default_rng(3)
    y = np.convolve(rng.standard_normal(200_006), np.hanning(9)[1:-1] / np.hanning(9).sum(), mode="valid")
    study = al.characterize(Recording.from_rate(y, rate=100.0, unit="rad/s"))
    assert "band_limited" in {f.code for f in study.findings}
    used = study["signal"].curve.used.tolist()
    assert not used[0] and used[-1]
    n = study.models["signal"].estimate("N")
    assert n is not None and n.lower < 0.1 < n.upper


def test_one_nan_one_overload_one_stuck_stretch_one_hole() -> None:
    rng = np.random.default_rng(11)
    y = 0.5 + 1e-3 * rng.standard_normal(200_000)
    y[777], y[5000] = np.nan, 9.9e37
    y[20_000:21_000] = y[19_999]
    y[100_000:140_000] = np.nan
    study = al.characterize(Recording.from_rate(y, rate=100.0, unit="rad/s"))
    n = study.models["signal"].estimate("N")
    assert n is not None and n.lower < 1e-4 < n.upper
    codes = {f.code for f in study.findings}
    assert any("overload" in c for c in codes) and any("stuck" in c or "frozen" in c for c in codes)
    assert study.recording.missing >= 41_000


@pytest.mark.long
def test_float32_at_one_g_and_int16_counts() -> None:
    rng = np.random.default_rng(12)
    noise = rng.standard_normal(100_000)
    g32 = (9.81 + 2e-3 * noise).astype(np.float32)
    n = al.characterize(Recording.from_rate(g32, rate=100.0, unit="m/s^2")).models["signal"].estimate("N")
    assert n is not None and n.lower < 2e-4 < n.upper
    counts = np.round(1000 + 30 * noise).astype(np.int16)
    study = al.characterize(Recording.from_rate(counts, rate=100.0, unit="LSB"))
    n = study.models["signal"].estimate("N")
    assert n is not None and n.lower < 3.0 < n.upper
    assert study["signal"].kind == "counts"


def test_short_records_give_limits_not_numbers() -> None:
    study = al.characterize(
        al.simulate(NoiseModel.of(White(N=1.0), Flicker(B=0.01)), rate=10.0, duration=100.0, seed=1)
    )
    e = study.models["gyro"].estimate("B")
    assert e is not None and not e.supported and math.isfinite(e.upper)


STATIC = [
    ("adis16405_calgary/adis_16405_imu4.npz", {"unit": {"gyro": "deg/s", "acc": "g"}}),
    ("tomisuarez_mpu6050/example_data_tinit_calc.csv", {}),
    ("tomisuarez_mpu6050/imu_static_test.csv", {}),
    ("psins_lasergyro/lasergyro.npz", {}),
    ("formats_ros/phidgets_imu_upside_down.bag", {}),
]


@pytest.mark.parametrize(("name", "options"), STATIC, ids=[n.split("/")[1] for n, _ in STATIC])
def test_every_static_recording_is_characterised(
    real_data: Callable[[str], Path], name: str, options: dict[str, object]
) -> None:
    if name.endswith(".bag"):
        pytest.importorskip("rosbags")
    record = al.read(real_data(name), **options)  # type: ignore[arg-type]
    part = record if record.n_samples < 100_000 else record.window(0.0, 600.0)
    study = al.characterize(part.select(*part.names[:3]))
    assert all(c.models or "not_fitted" in {f.code for f in study.findings} for c in study.channels)
    if "tinit" in name:  # 449 s of an MPU-6050: the floor is not reached, B is a limit
        for model in study.models.values():
            b = model.estimate("B")
            assert b is not None and not b.supported


@pytest.mark.parametrize(
    "wrong", [lambda study: study, lambda study: list(study.models), lambda study: {"x": 5}]
)
def test_saved_models_are_models_by_name(
    study: al.Study, tmp_path: Path, wrong: Callable[[Any], Any]
) -> None:
    with pytest.raises(InputError, match=r"study\.models"):
        al.save_models(wrong(study), tmp_path / "models.json")
    assert al.save_models(study.models, tmp_path / "models.json").exists()
