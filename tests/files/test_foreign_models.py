# SPDX-License-Identifier: BSD-3-Clause
"""Noise models out of the files of other programs: round trips to the last digit, and what is refused."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import allanite as al
from allanite.errors import FormatError, InputError
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.study.model_file import load_models
from shell import Run

MODELS = {
    "gyro": NoiseModel.of(White(N=8.72664626e-05), RandomWalk(K=4.0401139e-07)),
    "accelerometer": NoiseModel.of(White(N=5.000001e-4), RandomWalk(K=8.1722e-07), kind="acceleration"),
}
KALIBR = """\
rostopic: /imu0
update_rate: 200.0
accelerometer_noise_density: 2.0e-3
accelerometer_random_walk: 3e-3
gyroscope_noise_density: 1.7e-4
gyroscope_random_walk: 1.9e-5
"""
IMU_UTILS = """\
%YAML:1.0
---
type: IMU
name: A3
Gyr:
   unit: " rad/s"
   avg-axis:
      gyr_n: 1.0351286977809465e-04
      gyr_w: 2.9438676109223402e-05
Acc:
   unit: " m/s^2"
   avg-axis:
      acc_n: 1.0351286977809465e-02
      acc_w: 2.9438676109223402e-04
"""


def written(folder: Path, text: str, name: str = "imu.yaml") -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def values(model: NoiseModel) -> list[float]:
    return [getattr(t, s) for t in model.terms for s in t.symbols]


# -- round trips ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["kalibr", "openvins", "orb_slam3", "okvis"])
def test_what_was_exported_is_read_to_the_last_digit(name: str, tmp_path: Path) -> None:
    place = tmp_path / "imu.yaml"
    text = al.export(name, MODELS, place, rate=200.0, walk="k-only")
    models, rate = load_models(place)
    assert rate == 200.0
    assert list(models) == ["gyro", "accelerometer"]
    for key, model in models.items():
        assert model.kind == MODELS[key].kind
        assert values(model) == [float(f"{v:.6e}") for v in values(MODELS[key])]
        assert place.name in model.verdict
    again = al.export(name, models, rate=rate, walk="k-only")
    assert [li for li in again.splitlines() if "#" not in li[:6]] == [
        li for li in text.splitlines() if "#" not in li[:6]
    ]


def test_parameters_of_matlab_are_read_to_the_last_digit(tmp_path: Path) -> None:
    models = {
        key: NoiseModel.of(m.terms[0], Flicker(B=2.4240684e-05), m.terms[1], kind=m.kind)
        for key, m in MODELS.items()
    }
    al.export("matlab", models, tmp_path / "m", rate=200.0)
    found, rate = load_models(tmp_path / "m" / "imu_sensor.json")
    assert rate == 200.0
    for key, model in found.items():
        assert [t.type for t in model.terms] == ["white", "flicker", "random_walk"]
        assert values(model) == pytest.approx(values(models[key]), rel=1e-6)  # seven digits of sqrt(2) N
    al.export("matlab", found, tmp_path / "again", rate=rate)
    for part in ("Gyroscope", "Accelerometer"):
        first, second = (
            json.loads((tmp_path / folder / "imu_sensor.json").read_text())["allanite"][part]
            for folder in ("m", "again")
        )
        assert first.keys() == second.keys()
        for name, row in first.items():
            assert row == pytest.approx(second[name], rel=1e-6)


def test_numbers_of_a_hand_written_imu_yaml(tmp_path: Path) -> None:
    models, rate = load_models(written(tmp_path, KALIBR))
    assert rate == 200.0
    assert values(models["gyro"]) == [1.7e-4, 1.9e-5]
    assert values(models["accelerometer"]) == [2e-3, 3e-3]
    one, _ = load_models(written(tmp_path, KALIBR.replace("3e-3", "0.0"), "one.yml"))
    assert str(one["accelerometer"]) == "NoiseModel(N=0.002)"
    alone = "\n".join(line for line in KALIBR.splitlines() if not line.startswith(("acc", "update")))
    models, rate = load_models(written(tmp_path, alone, "alone.yaml"))
    assert (list(models), rate) == (["gyro"], None)


def test_settings_with_tags_of_opencv_are_read(tmp_path: Path) -> None:
    text = (
        "%YAML:1.0\n\nIMU.T_b_c1: !!opencv-matrix\n   rows: 1\n   cols: 1\n   dt: f\n   data: [1.0]\n"
        "IMU.NoiseGyro: 1.7e-4 # 1.6968e-04\nIMU.NoiseAcc: 2.0e-3\nIMU.GyroWalk: 1.9e-05\nIMU.AccWalk: 3.0e-03\n"
        "IMU.Frequency: 200.0\n"
    )
    models, rate = load_models(written(tmp_path, text))
    assert rate == 200.0
    assert values(models["gyro"]) == [1.7e-4, 1.9e-5]


def test_sides_and_filter_of_matlab(tmp_path: Path) -> None:
    """Half the band: N is the density over sqrt(2), and K sqrt(2) times its walk; one pole is a correlation time."""
    phi, rate = math.exp(-1 / (100 * 50.0)), 100.0
    gyro = {
        "NoiseDensity": [1e-4, 2e-4, 1e-4], "BiasInstability": 1e-5, "RandomWalk": 1e-7, "NoiseType": "double-sided",
        "MeasurementRange": "inf",
        "BiasInstabilityCoefficients": {"Numerator": math.sqrt(1 - phi**2), "Denominator": [1.0, -phi]},
    }  # fmt: skip
    place = written(tmp_path, json.dumps({"SampleRate": rate, "Gyroscope": gyro}), "imu.json")
    models, own = load_models(place)
    assert own == rate
    assert list(models) == ["gyro_x", "gyro_y", "gyro_z"]
    white, bias, walk = models["gyro_y"].terms
    assert isinstance(white, White) and white.N == pytest.approx(2e-4 / math.sqrt(2))
    assert isinstance(walk, RandomWalk) and walk.K == pytest.approx(1e-7 * math.sqrt(2))
    assert isinstance(bias, GaussMarkov)
    assert (bias.sigma, bias.T) == pytest.approx((1e-5, 50.0), rel=1e-9)


@pytest.mark.parametrize("name", ["imu", "imu.txt", "imu.conf", "imu.yaml.bak", "imu.json"])
def test_the_content_decides_and_not_the_name(name: str, tmp_path: Path) -> None:
    models, rate = load_models(written(tmp_path, KALIBR, name))
    assert rate == 200.0 and values(models["gyro"]) == [1.7e-4, 1.9e-5]
    sheet = "gyro: {angle_random_walk: 0.3 deg/√h}\n"
    assert load_models(written(tmp_path, sheet, name))[0]["gyro"].terms[0].N == pytest.approx(8.72664626e-05)
    with pytest.raises(InputError, match="is from imu_utils"):
        load_models(written(tmp_path, IMU_UTILS, name))
    for other in ("{", "1, 2, 3", "some: thing\n", "\0\1"):
        with pytest.raises(FormatError, match=r"is not JSON .*: expected a study"):
            load_models(written(tmp_path, other, name))


def test_a_data_sheet_stays_a_data_sheet(tmp_path: Path) -> None:
    text = "accelerometer:\n  velocity_random_walk: 0.06 m/s/√h\n  acceleration_random_walk: 30 µg/√h\n"
    models, rate = load_models(written(tmp_path, text))
    assert (list(models), rate) == (["accelerometer"], None)
    with pytest.raises(InputError, match="did you mean"):
        load_models(written(tmp_path, text.replace("30 µg/√h", "30 µg"), "wrong.yaml"))
    with pytest.raises(InputError, match="nearest: "):
        load_models(written(tmp_path, text.replace("m/s/√h", "metr/s/√h"), "spelt.yaml"))


# -- refusals ------------------------------------------------------------------------------------------------------

PART: dict[str, Any] = {"Gyroscope": {"NoiseDensity": 1e-4}}


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        (IMU_UTILS, InputError, "bias instabilities, not random walks"),
        (
            "%YAML:1.0\nimu_topic: /imu0\nacc_n: 0.1\ngyr_n: 0.01\nacc_w: 0.001\ngyr_w: 1.0e-4\n", InputError,
            "one step at the rate of the IMU",
        ),
        (
            "imu_topic: /imu\nimu_rate: 400\nmeasure_rate: 100\nsequence_time: 10800\n", InputError,
            "configuration of allan_variance_ros",
        ),
        (KALIBR.replace("gyroscope_noise_density", "gyroscope_noise_densty"), InputError,
         "did you mean 'gyroscope_noise_density'"),
        (KALIBR.replace("gyroscope_noise", "gyroscop_noise"), InputError, "did you mean 'gyroscope_noise_density'"),
        ("gyroscope_noise_density: 1.0e-4\n", InputError, "needs gyroscope_random_walk"),
        ("gyroscope_noise_density:\ngyroscope_random_walk:\n", InputError, "fill in gyroscope_noise_density"),
        ("gyroscope_noise_density: 0\ngyroscope_random_walk: 0\n", InputError, "is zero: that is not"),
        (KALIBR.replace("1.7e-4", "'about 1e-4'"), FormatError, "is not a number"),
        (KALIBR.replace("1.7e-4", "-1.7e-4"), FormatError, "negative"),
        (KALIBR.replace("1.7e-4", ".inf"), FormatError, "not a number"),
        (KALIBR.replace("200.0", "0"), FormatError, "update_rate is zero"),
        ("{", FormatError, "is not YAML"),
    ],
)  # fmt: skip
def test_what_is_refused(text: str, error: type[Exception], words: str, tmp_path: Path) -> None:
    with pytest.raises(error, match=words):
        load_models(written(tmp_path, text))


@pytest.mark.parametrize(
    ("found", "error", "words"),
    [
        ({"a": PART, "b": PART}, InputError, r"several parts \(a, b\)"),
        ({"Gyroscope": {"NoiseDensty": 1e-4}}, InputError, "did you mean 'NoiseDensity'"),
        ({"Gyroscope": {"NoiseDensity": 1e-4, "NoiseType": "one-sided"}}, InputError, "did you mean 'single-sided'"),
        ({"Gyroscope": {"NoiseDensity": [1e-4, 1e-4]}}, FormatError, "has 2 values"),
        ({"Gyroscope": {"NoiseDensity": "small"}}, FormatError, "not a number"),
        ({"Gyroscope": {"NoiseDensity": 0}}, InputError, "is zero: that is not"),
        (
            {"Gyroscope": {"NoiseDensity": 1, "BiasInstability": 1, "BiasInstabilityCoefficients":
                           {"Numerator": 0.1, "Denominator": [1, -0.99]}}},
            InputError, "no SampleRate",
        ),
        (
            {"Gyroscope": {"NoiseDensity": 1, "BiasInstabilityCoefficients": {"Numerator": 1, "Denominator": [1, 2]}}},
            FormatError, "its pole at -2",
        ),
        (
            {"Gyroscope": {"NoiseDensity": 1, "BiasInstabilityCoefficients": {"Numerator": 1}}},
            FormatError, "Denominator",
        ),
        ({"gyro": 3}, FormatError, "or the parameters of MATLAB's imuSensor"),
    ],
)  # fmt: skip
def test_what_is_refused_of_matlab(found: Any, error: type[Exception], words: str, tmp_path: Path) -> None:
    with pytest.raises(error, match=words):
        load_models(written(tmp_path, json.dumps(found), "imu.json"))


def test_published_files_of_imu_utils_are_refused(real_data: Callable[[str], Path]) -> None:
    for place in sorted(real_data("imu_utils_curves").glob("*.yaml")):
        with pytest.raises(InputError, match=r"imu_utils.*not what their names suggest"):
            load_models(place)


# -- every command ---------------------------------------------------------------------------------------------------


def test_the_file_that_a_model_was_read_from_is_named_in_the_next(run: Run, tmp_path: Path) -> None:
    place = tmp_path / "theirs.yaml"
    place.write_text(KALIBR, encoding="utf-8")
    done = run("export", "vins", place, "--walk", "k-only")
    assert done.code == 0, done.err
    assert (
        f"# from theirs.yaml, SHA-256 {hashlib.sha256(place.read_bytes()).hexdigest()}, for 200.0 Hz"
        in done.out
    )
    assert "for 100.0 Hz" in run("export", "vins", place, "--walk", "k-only", "--rate", "100").out


def test_commands_take_such_files(run: Run, tmp_path: Path) -> None:
    imu = written(tmp_path, KALIBR)
    twin = tmp_path / "twin.parquet"
    done = run("simulate", imu, "--duration", "20s", "-o", twin)
    assert done.code == 0, done.err
    assert "4000 samples" in done.out
    vins = run("export", "vins", imu, "--walk", "k-only")
    assert vins.code == 0, vins.err
    assert f"gyr_n: {1.7e-4 * 20:.6e}" in vins.out
    sheet = written(
        tmp_path, "gyro: {angle_random_walk: 0.3 deg/√h, rate_random_walk: 5 deg/h/√h}", "sheet.yaml"
    )
    assert "pass --rate" in run("export", "kalibr", sheet).err
    assert run("export", "kalibr", sheet, "--rate", "200").code == 0
    assert "a bound needs a study" in run("export", "kalibr", imu, "--overbound", "95%").err
