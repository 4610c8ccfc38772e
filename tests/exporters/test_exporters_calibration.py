# SPDX-License-Identifier: BSD-3-Clause
"""Calibrations in the files of other programs: what the consumer's own equation makes of raw samples.

Each consumer's equation is written here from its definition. It is applied to raw samples that were made of true
vectors, with nothing but the numbers in the file.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import allanite as al
import sample_study
from allanite import __version__
from allanite.errors import InputError, StorageError
from allanite.exporters import export, exporter
from allanite.exporters.triads import lower_and_rotation, propagated, upper_and_rotation
from allanite.noise import NoiseModel, White
from allanite.quantities.attitude import rotation
from allanite.recording.calibration import Calibration, parameter_names
from shell import Run

Array = NDArray[np.float64]
GOLDEN = Path(__file__).parents[1] / "published"
YAML_FLOAT = re.compile(r"[-+]?[0-9]+\.[0-9]*([eE][-+][0-9]+)?")


def calibration(
    frame: Any = "z",
    *,
    counts: bool = False,
    sensors: Any = ("accelerometer", "gyro"),
    quadratic: bool = False,
    gravity_sensitivity: bool = False,
) -> Calibration:
    """A unit with errors of some per cent, correlated as after a measurement."""
    rng = np.random.default_rng(17)
    names: tuple[str, ...] = ()
    for sensor in sensors:
        own = frame if sensor == "accelerometer" or len(sensors) == 1 else None
        names += parameter_names(
            sensor, frame=own, quadratic=quadratic, gravity_sensitivity=gravity_sensitivity
        )
    usual = {"accelerometer": (415.0, 33000.0), "gyro": (4770.0, 32500.0)}
    values = np.empty(len(names))
    sds = np.empty(len(names))
    for i, name in enumerate(names):
        scale, bias = usual[name.partition(".")[0]] if counts else (1.0, 0.0)
        kind = name.partition(".")[2].split("_")[0]
        centre = {"bias": bias, "scale": scale, "misalignment": 0.0, "quadratic": 0.0, "gravity": 0.0}[kind]
        spread = {"bias": 0.05, "scale": 0.02, "misalignment": 0.03, "quadratic": 1e-5, "gravity": 1e-3}[kind]
        unit = {"bias": scale, "scale": scale, "gravity": scale}.get(kind, 1.0)
        values[i], sds[i] = centre + spread * unit * rng.standard_normal(), 1e-3 * spread * unit
    mixing = np.eye(len(names)) + 0.1 * rng.standard_normal((len(names),) * 2)
    half = sds[:, None] * mixing
    units = {s: "LSB" if counts else {"accelerometer": "m/s²", "gyro": "rad/s"}[s] for s in sensors}
    return Calibration(
        names=names,
        values=values,
        covariance=half @ half.T,
        status=("estimated",) * len(names),
        frame=frame,
        channels={s: tuple(f"{s}_{a}" for a in "xyz") for s in sensors},
        units=units,
        gravity=9.81744,
        date="2026-02-03",
        source="unit 7.csv",
    )


def true_vectors() -> tuple[Array, Array]:
    rng = np.random.default_rng(3)
    return 9.8 * rng.standard_normal((20, 3)), 2.0 * rng.standard_normal((20, 3))


def blocks(text: str) -> dict[str, Any]:
    """Keys and matrices of the one sensor of a kalibr_imu_chain.yaml, as a reader of YAML 1.1 takes them."""
    first, *lines = text.splitlines()
    assert first == "%YAML:1.0"
    found: dict[str, Any] = {}
    key = ""
    for line in (line.split("#")[0].rstrip() for line in lines):
        if not line or line == "imu0:":
            continue
        assert line.startswith("  ")
        if line.startswith("    - ["):
            row = [cell.strip() for cell in line.partition("[")[2].rstrip(" ]").split(",")]
            assert all(YAML_FLOAT.fullmatch(cell) for cell in row), row
            found[key] = [*(found[key] or []), [float(cell) for cell in row]]
            continue
        key, _, value = (part.strip() for part in line.partition(":"))
        found[key] = float(value) if YAML_FLOAT.fullmatch(value) else value.strip('"')
    return {k: np.array(v) if isinstance(v, list) else v for k, v in found.items()}


def biases(text: str, key: str) -> Array:
    """Out of the comment."""
    line = next(line for line in text.splitlines() if line.startswith(f"# {key} ["))
    return np.array([float(v) for v in re.findall(r"(\S+) \(sd", line)])


def openvins_reads(text: str, force: Array, rate: Array, bias: tuple[Array, Array]) -> tuple[Array, Array]:
    """Acceleration and rate along the axes of the consumer's IMU, by its own equation."""
    k = blocks(text)
    a = np.linalg.solve(k["Ta"], (force - bias[0]).T)
    a = k["R_IMUtoACC"].T @ a
    w = np.linalg.solve(k["Tw"], (rate - bias[1]).T - k["Tg"] @ a)
    return a.T, (k["R_IMUtoGYRO"].T @ w).T


def imu_tk_reads(text: str, raw: Array) -> Array:
    """x = T K (y - b); the first 21 numbers of the file, in whatever lines they stand."""
    numbers = np.array([float(word) for word in text.split()[:21]])
    t, k, b = numbers[:9].reshape(3, 3), numbers[9:18].reshape(3, 3), numbers[18:]
    assert np.allclose(np.diag(t), 1.0, atol=1e-12)
    assert np.count_nonzero(k - np.diag(np.diag(k))) == 0
    return (t @ k @ (raw - b).T).T


# -- the consumers' own equations ----------------------------------------------------------------------------


@pytest.mark.parametrize("frame", ["z", "x"])
@pytest.mark.parametrize("counts", [False, True])
def test_imu_tk_reads_the_true_vectors(frame: str, counts: bool, tmp_path: Path) -> None:
    cal = calibration(frame, counts=counts)
    export("imu-tk", cal, tmp_path / "out")
    for sensor, name, true in zip(cal.sensors, ("imu_acc", "imu_gyro"), true_vectors(), strict=True):
        raw = cal.errors(sensor).seen(true)
        read = imu_tk_reads((tmp_path / "out" / f"{name}.calib").read_text(), raw)
        assert np.abs(read - cal.errors(sensor).true(raw)).max() < 1e-9
        assert np.abs(read - true).max() < 1e-9


def test_imu_tk_keeps_the_triangle_of_its_own_accelerometers() -> None:
    text = exporter("imu_tk").write(calibration("z").to_json())["imu_acc.calib"]
    t = np.array([float(w) for w in text.split()[:9]]).reshape(3, 3)
    assert t[1, 0] == t[2, 0] == t[2, 1] == 0.0


def test_imu_tk_covariance_is_that_of_its_own_parameters() -> None:
    """Against the scatter of parameters of drawn calibrations: 4000 draws know a standard deviation to 1.1 %."""
    cal = calibration("z")
    written = json.loads(exporter("imu_tk").write(cal.to_json())["imu_covariance.json"])
    assert len(written["names"]) == 24
    rng = np.random.default_rng(5)
    half = np.linalg.cholesky(cal.covariance + 1e-18 * np.eye(len(cal.names)))
    drawn = []
    for _ in range(4000):
        other = cal.with_values(cal.values + half @ rng.standard_normal(len(cal.names)))
        inverse = np.linalg.inv(other.errors("gyro").matrix)
        drawn.append([*np.diag(inverse), inverse[0, 1] / inverse[1, 1], other.errors("gyro").bias[2]])
    places = [written["names"].index(f"gyro.{n}") for n in ("K_x", "K_y", "K_z", "T_xy", "b_z")]
    stated = np.array(written["covariance"])[np.ix_(places, places)]
    seen = np.cov(np.array(drawn).T)
    sd = np.sqrt(np.diag(stated))
    assert np.abs(np.sqrt(np.diag(seen)) / sd - 1).max() < 5 * 0.0112
    assert np.abs((seen - stated) / np.outer(sd, sd)).max() < 5 / np.sqrt(4000)


@pytest.mark.parametrize("frame", ["z", "x"])
@pytest.mark.parametrize("convention", ["kalibr", "rpng"])
@pytest.mark.parametrize("following", [False, True])
def test_openvins_reads_the_true_vectors(frame: str, convention: str, following: bool) -> None:
    """Of gyros that follow gravity as well: Tg takes the true force along the axes of the consumer's IMU."""
    cal = calibration(frame, gravity_sensitivity=following)
    text = export("openvins", cal, intrinsics=convention)
    stated = re.search(r"rotation vector \[(.*)\] rad", text)
    assert stated is not None
    turn = rotation(np.array([float(v) for v in stated[1].split(",")]))
    force, rate = true_vectors()
    seen = [cal.errors(s).seen(v, force=force) for s, v in zip(cal.sensors, (force, rate), strict=True)]
    assert blocks(text)["Tg"].any() == following
    exact = tuple(cal.errors(s).bias for s in cal.sensors)
    read = openvins_reads(text, seen[0], seen[1], exact)  # type: ignore[arg-type]
    made = exporter("openvins").intrinsics_of(cal, convention)  # type: ignore[attr-defined]
    for found, true in zip(read, (force, rate), strict=True):
        assert np.abs(found @ made.body_to_imu - true).max() < 1e-9
        assert np.abs(found @ turn - true).max() < 1e-7  # nine decimals in the comment
    for key, sensor in (("b_a", "accelerometer"), ("b_w", "gyro")):
        assert np.allclose(biases(text, key), cal.errors(sensor).bias, rtol=1e-6)


def test_openvins_conventions_are_kept() -> None:
    """Lower triangles and the accelerometers' axes, or upper triangles and the gyros' axes; rotations are rotations."""
    for frame in ("z", "x"):
        k = blocks(export("openvins", calibration(frame), intrinsics="kalibr"))
        assert not np.triu(k["Tw"], 1).any()
        assert not np.triu(k["Ta"], 1).any()
        assert np.array_equal(k["R_IMUtoACC"], np.eye(3))
        assert np.allclose(k["R_IMUtoGYRO"] @ k["R_IMUtoGYRO"].T, np.eye(3), atol=1e-11)
        k = blocks(export("openvins", calibration(frame), intrinsics="rpng"))
        assert not np.tril(k["Tw"], -1).any()
        assert not np.tril(k["Ta"], -1).any()
        assert np.array_equal(k["R_IMUtoGYRO"], np.eye(3))
        assert np.linalg.det(k["R_IMUtoACC"]) == pytest.approx(1.0, abs=1e-11)


def test_a_calibration_of_frame_x_is_the_kalibr_convention_already() -> None:
    cal = calibration("x")
    made = exporter("openvins").intrinsics_of(cal, "kalibr")  # type: ignore[attr-defined]
    assert np.allclose(made.body_to_imu, np.eye(3), atol=1e-15)
    assert np.allclose(made.accelerometer, cal.errors("accelerometer").matrix, atol=1e-15)


@pytest.mark.parametrize("sensor", ["accelerometer", "gyro"])
@pytest.mark.parametrize("convention", ["kalibr", "rpng"])
def test_one_triad_alone_leaves_the_other_perfect_and_says_so(sensor: str, convention: str) -> None:
    text = export("openvins", calibration(sensors=(sensor,)), intrinsics=convention)
    other = "gyro" if sensor == "accelerometer" else "accelerometer"
    assert f"# {other}: NOT CALIBRATED, taken as perfect" in text
    assert np.array_equal(blocks(text)["Tw" if other == "gyro" else "Ta"], np.eye(3))


# -- triangles and rotations -----------------------------------------------------------------------------------


def test_triangle_times_rotation() -> None:
    matrix = np.eye(3) + 0.3 * np.random.default_rng(1).standard_normal((3, 3))
    for split, clean in ((lower_and_rotation, np.triu), (upper_and_rotation, np.tril)):
        triangle, turn = split(matrix)
        assert np.allclose(triangle @ turn, matrix, atol=1e-14)
        assert np.allclose(turn @ turn.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(turn) == pytest.approx(1.0)
        assert np.abs(clean(triangle, 1 if clean is np.triu else -1)).max() < 1e-14
        assert (np.diag(triangle) > 0).all()


def test_left_handed_axes_are_refused() -> None:
    with pytest.raises(InputError, match="right-handed"):
        lower_and_rotation(np.diag([1.0, -1.0, 1.0]))


def test_propagation_is_exact_for_linear_functions() -> None:
    cal = calibration(counts=True)
    weights = np.random.default_rng(2).standard_normal((4, len(cal.names)))
    centre, covariance = propagated(cal, lambda c: weights @ c.values)
    assert np.allclose(centre, weights @ cal.values)
    assert np.allclose(covariance, weights @ cal.covariance @ weights.T, rtol=1e-6)


# -- noise, words, refusals --------------------------------------------------------------------------------------


def test_openvins_takes_the_noise_of_a_study_like_kalibr() -> None:
    models = {"g": NoiseModel.of(White(N=1e-4)), "a": NoiseModel.of(White(N=1e-3), kind="acceleration")}
    with pytest.raises(InputError, match="walk"):
        export("openvins", calibration(), model=models, rate=200.0)
    study = sample_study.build()
    k = blocks(export("openvins", calibration(), model=study))
    lines = [line for line in export("kalibr", study).splitlines() if line[:1] not in ("#", "")]
    for calibrated, title in ((True, "IMU intrinsics and noise"), (False, "IMU noise")):
        given = (calibration(), {"model": study}) if calibrated else (study, {})
        text = export("openvins", given[0], **given[1])
        assert text.startswith(f"%YAML:1.0\n\n# {title} for OpenVINS, written by allanite")
        assert text.count("written by allanite") == 1, "the title stands there once"
    flat = dict(line.split("#")[0].replace(" ", "").split(":") for line in lines)
    assert flat.pop("rostopic") == k["rostopic"]
    assert {key: float(value) for key, value in flat.items()} == {key: k[key] for key in flat}
    assert k["time_offset"] == 0.0
    assert np.array_equal(k["T_i_b"], np.eye(4))


def test_without_a_model_the_lines_of_the_noise_are_left_open() -> None:
    text = export("openvins", calibration())
    assert "  # gyroscope_noise_density:  # rad/s/sqrt(Hz)" in text
    assert "gyroscope_noise_density" not in blocks(text)


def test_what_has_no_place_in_a_file_is_said() -> None:
    cal = calibration(quadratic=True)
    for text in (export("openvins", cal), export("imu-tk", cal)):
        assert "LEFT OUT: up to" in text
    following = calibration(gravity_sensitivity=True)
    text = exporter("imu_tk").write(following.to_json())["imu_gyro.calib"]
    assert "gyro: its biases follow gravity, which has no place here and is LEFT OUT: up to" in text
    assert "follow gravity" not in export("openvins", following)
    assert "Tg:  # effect of acceleration on the gyros, rad/s per m/s^2; sd up to" in export(
        "openvins", following
    )
    status = ("assumed",) + cal.status[1:]
    assumed = Calibration.from_json({**cal.to_json(), "status": status})
    assert "NOT DETERMINED by the measurement, taken as nominal: accelerometer.bias_x" in export(
        "openvins", assumed
    )


@pytest.mark.parametrize(
    ("name", "given", "options", "message"),
    [
        ("openvins", calibration(counts=True), {}, "calibrated in 'LSB'"),
        ("openvins", calibration(), {"intrinsics": "upper"}, "kalibr or rpng"),
        ("openvins", {"format": "allanite-study"}, {}, "takes a calibration"),
        ("imu-tk", 3, {}, "not a int"),
        ("imu-tk", calibration(), {"walk": "k-only"}, "no option walk=; there are: none"),
        ("kalibr", calibration(), {}, "has no noise"),
    ],
)
def test_what_cannot_be_exported_is_refused(name: str, given: Any, options: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        export(name, given, **options)


def test_files_are_written_all_or_none(tmp_path: Path) -> None:
    (tmp_path / "imu_gyro.calib").write_text("mine")
    with pytest.raises(StorageError, match="--force"):
        export("imu-tk", calibration(), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["imu_gyro.calib"]
    export("imu-tk", {"calibration": calibration().to_json()}, tmp_path, force=True)
    assert len(list(tmp_path.iterdir())) == 3


def test_the_command_takes_a_calibration(run: Run, tmp_path: Path) -> None:
    (tmp_path / "cal.json").write_text(json.dumps(calibration().to_json()))
    (tmp_path / "study.json").write_text(json.dumps(sample_study.build()))
    cal, chain = str(tmp_path / "cal.json"), str(tmp_path / "chain.yaml")
    assert run("export", "openvins", cal, "--model", str(tmp_path / "study.json"), "-o", chain).code == 0
    assert "gyroscope_noise_density" in blocks(Path(chain).read_text())
    shown = run("export", "openvins", cal, "--intrinsics", "rpng").out
    assert blocks(shown)["model"] == "rpng"
    assert run("export", "imu-tk", cal, "-o", str(tmp_path / "tk")).code == 0
    assert sorted(p.name for p in (tmp_path / "tk").iterdir()) == [
        "imu_acc.calib", "imu_covariance.json", "imu_gyro.calib"
    ]  # fmt: skip
    assert run("export", "imu-tk", str(tmp_path / "study.json")).code == 1
    assert run("export", "kalibr", cal).code == 1
    assert "a calibration has none" in run("export", "openvins", cal, "--rate", "100").err


# -- golden files ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "golden", ["openvins_kalibr_imu_chain.yaml", "imu_tk_acc.calib", "imu_tk_gyro.calib"]
)
def test_golden_files(golden: str) -> None:
    if golden.startswith("openvins"):
        made = al.export("openvins", calibration("z"), model=sample_study.build())
    else:
        texts = exporter("imu_tk").write(calibration("z", counts=True).to_json())
        made = texts[golden.replace("imu_tk", "imu")]
    assert made.replace(__version__, "VERSION") == (GOLDEN / golden).read_text(encoding="utf-8")
