# SPDX-License-Identifier: BSD-3-Clause
"""Self-calibration of real units, and of a simulated one whose truth is published."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from allanite.experiments.calibration import calibrate, calibrate_means
from allanite.experiments.static_spans import find_rests, means_of
from allanite.recording.records import Channel, Recording
from allanite.recording.sample_columns import ArrayColumn

G = 9.81744
ACC = tuple(f"acc_{a}" for a in "xyz")
GYRO = tuple(f"gyro_{a}" for a in "xyz")
Locate = Callable[[str], Path]


def unit(acc, gyro, rate: float, units: tuple[str, str]) -> Recording:
    columns = [ArrayColumn(np.ascontiguousarray(s[:, k])) for s in (acc, gyro) for k in range(3)]
    channels = [Channel.of(n, u) for names, u in zip((ACC, GYRO), units, strict=True) for n in names]
    return Recording(channels=tuple(channels), columns=tuple(columns), rate=rate)


def row(found, kind: str) -> np.ndarray:
    return np.array([found[f"{kind}_{a}"].value for a in "xyz"])


def test_xsens_meets_its_certificate(real_data: Locate) -> None:
    """Scales within 0.3 %, offsets of the accelerometers within 5 counts; the gyros' bias follows gravity."""
    acc = np.loadtxt(real_data("imu_tk_xsens/xsens_acc.mat"))[:, 1:].astype(np.int32)
    gyro = np.loadtxt(real_data("imu_tk_xsens/xsens_gyro.mat"))[:, 1:].astype(np.int32)
    found = calibrate(unit(acc, gyro, 100.0, ("LSB", "LSB")), gyro=GYRO, accelerometer=ACC, gravity=G)
    assert found.verdict == "calibrated" and len(found.positions) >= 38 and not found.outliers
    assert row(found, "accelerometer.scale") == pytest.approx([415, 413, 415], rel=3e-3)
    assert row(found, "gyro.scale") == pytest.approx([4778, 4758, 4766], rel=3e-3)
    assert np.abs(row(found, "accelerometer.bias") - [33123, 33276, 32360]).max() < 5
    # an independent fit to the same file, its residual 1 mm/s^2, that knows nothing of the gyros
    other = {"bias": (33123.8, 33275.1, 32364.5), "scale": (414.42, 412.03, 414.62)}
    for kind, values in other.items():
        for a, value in zip("xyz", values, strict=True):
            p = found[f"accelerometer.{kind}_{a}"]
            assert p.interval[0] <= value <= p.interval[1]
    # the certificate's offsets of the gyros differ by what gravity and another day make of them
    follows = found.calibration.errors("gyro").gravity_sensitivity
    assert 0.1 < math.degrees(np.abs(follows).max() / 4770 * G) < 0.2
    assert all(s.ratio < 1.15 for s in found.scatter)  # with it the noise explains every residual


def test_the_means_of_xsens_alone_give_the_same_accelerometers(real_data: Locate) -> None:
    """Without the log: their noise by their scatter, which an independent program put at 1 mm/s^2 for one length."""
    acc = np.loadtxt(real_data("imu_tk_xsens/xsens_acc.mat"))[:, 1:].astype(np.int32)
    gyro = np.loadtxt(real_data("imu_tk_xsens/xsens_gyro.mat"))[:, 1:].astype(np.int32)
    whole = unit(acc, gyro, 100.0, ("LSB", "LSB"))
    spans = find_rests(whole, gyro=GYRO, accelerometer=ACC).array
    means = np.array([acc[a:b].mean(axis=0) for a, b in spans])
    kept = means_of(unit(means, means, 1.0, ("LSB", "LSB")).select(*ACC))
    found = calibrate_means(kept, accelerometer=ACC, gravity=G)
    (scatter,) = found.scatter
    assert found.verdict == "calibrated" and scatter.sd_dof == pytest.approx(len(spans) - 9, abs=0.5)
    assert 3e-4 < scatter.sd < 3e-3
    other = {"bias": (33123.8, 33275.1, 32364.5), "scale": (414.42, 412.03, 414.62)}
    for kind, values in other.items():
        for a, value in zip("xyz", values, strict=True):
            p = found[f"accelerometer.{kind}_{a}"]
            assert p.interval[0] <= value <= p.interval[1]


@pytest.mark.parametrize(
    ("name", "matrix", "bias"),
    [
        (
            "ADXL355",
            [0.96276, 0, 0, 0.0015751, 0.96732, 0, -0.00018891, 0.000859, 0.97079],
            [0.064447, 0.011034, 0.034253],
        ),
        (
            "BMI160",
            [0.95418, 0, 0, 0.0031573, 0.96061, 0, 0.009235, 0.00049713, 0.9501],
            [-0.033224, 0.080497, 0.01579],
        ),
    ],
)
def test_openaxes_gives_the_printed_coefficients(real_data: Locate, name: str, matrix, bias) -> None:
    """x = T a - b with T upper triangular: T = M^-1 in our frame z."""
    path = real_data("openaxes_d20/log_imu9_2022-06-22_22-13-55.csv")
    d = np.genfromtxt(path, delimiter=";", names=True, usecols=range(2, 17))
    acc, gyro = (np.stack([d[f"{n}_{k}"] for k in range(3)], 1) for n in (f"ACCEL_{name}", "GYRO"))
    found = calibrate(unit(acc, gyro, 100.06, ("m/s²", "rad/s")), gravity=G)
    assert len(found.positions) >= 30 and not found.assumed
    errors = found.calibration.errors("accelerometer")
    ours = np.linalg.inv(errors.matrix)
    printed = np.array(matrix).reshape(3, 3).T
    assert np.abs(ours - printed).max() < 1e-3
    # the biases of the BMI160 drift through the record by more than 0.01 m/s^2, which our interval holds
    miss = ours @ errors.bias - bias
    assert np.all(np.abs(miss) < [found[f"accelerometer.bias_{a}"].sd for a in "xyz"])
    assert (found.scatter[0].walk > 5e-4) == (name == "BMI160")
    # where every position counts alike, as there, all twelve numbers are the printed ones
    alike = calibrate(unit(acc, gyro, 100.06, ("m/s²", "rad/s")), gravity=G, drift=False)
    errors = alike.calibration.errors("accelerometer")
    ours = np.linalg.inv(errors.matrix)
    assert np.abs(ours - printed).max() < 1e-3
    assert np.abs(ours @ errors.bias - bias).max() < 1e-3
    assert found.inflated  # neither sensor is as quiet from position to position as within one
    gyros = np.linalg.inv(found.calibration.errors("gyro").matrix)
    assert np.diag(gyros) == pytest.approx([0.97288, 1.0062, 1.0068], abs=0.008)  # sd 0.0025


def test_simulated_turntable_holds_the_exact_truth(real_data: Locate) -> None:
    """19 positions, no noise, float32: every one of 24 parameters within its interval."""
    path = real_data("psins_sysclbt_simulated/imusysclbt.bin")
    d = np.fromfile(path, "<f4").reshape(-1, 7).astype(np.float64)
    record = unit(d[:, 3:6] * 100, d[:, :3] * 100, 100.0, ("m/s²", "rad/s"))
    # closed formulas of normal gravity differ by 1e-6 m/s^2
    found = calibrate(
        record, latitude=math.radians(34.0), frame="x", quadratic=True, stated={"gravity": 3e-6}
    )
    assert found.verdict == "calibrated" and len(found.positions) == 19
    second, hour, ug = math.radians(1 / 3600), math.radians(1) / 3600, 9.7803267714e-6
    truth = {}
    for k, a in enumerate("xyz", start=1):
        truth[f"accelerometer.bias_{a}"], truth[f"gyro.bias_{a}"] = -10 * k * ug, -0.1 * k * hour
        truth[f"accelerometer.quadratic_{a}"] = -10e-6 * k / 9.7803267714
    lower = np.array([[0, 0, 0], [10, 0, 0], [20, 30, 0]])
    full = np.array([[0, 10, 20], [30, 0, 40], [50, 60, 0]])
    for sensor, lean in (("accelerometer", lower), ("gyro", full)):
        for i, a in enumerate("xyz"):
            scale = 1 - (i + 1) * 1e-5
            truth[f"{sensor}.scale_{a}"] = scale
            for j, b in enumerate("xyz"):
                if i != j:
                    truth[f"{sensor}.misalignment_{a}{b}"] = lean[i, j] * second / scale
    for p in found.parameters:
        assert p.interval[0] <= truth[p.name] <= p.interval[1], p
    assert found["gyro.bias_x"].sd < 2e-4 * hour and found["gyro.scale_x"].sd < 2e-8
    assert found["accelerometer.bias_x"].sd < 0.02 * ug
    assert found.earth is not None and found.earth.resolved


@pytest.mark.parametrize("number", range(5))
def test_mpu9150_moved_by_hand(real_data: Locate, number: int) -> None:
    d = np.loadtxt(real_data(f"mikoff_mpu9150/imu{number}.log"))
    found = calibrate(unit(d[:, :3], d[:, 3:6], 100.0, ("m/s²", "rad/s")))
    assert found.verdict == "calibrated" and len(found.positions) >= 12
    # factory trimmed: data sheet 3 %; a hand-held calibration of consumer gyros reaches 0.1 %
    for kind in ("accelerometer.scale", "gyro.scale"):
        assert np.abs(row(found, kind) - 1).max() < 0.02
        assert max(found[f"{kind}_{a}"].sd for a in "xyz") < 2e-3
    assert found.earth is not None and not found.earth.resolved
    assert any("gravity is assumed" in r for r in found.notes)


def test_mpu6050_in_counts_with_clipped_turns(real_data: Locate) -> None:
    folder = real_data("tomisuarez_mpu6050")
    d = np.loadtxt(folder / "example_data_calibration.csv", delimiter=",", skiprows=5).astype(np.int32)
    spans = np.loadtxt(folder / "static_intervals.csv", delimiter=",").astype(int).T
    record = unit(d[:, :3], d[:, 3:6], 100.0, ("LSB", "LSB"))
    found = calibrate(record, spans=spans, gyro=GYRO, accelerometer=ACC, gravity=9.80665)
    published = np.array([6.020083e-4, 5.968449e-4, 5.859241e-4])
    assert 1 / row(found, "accelerometer.scale") == pytest.approx(published, rel=3e-3)
    published = np.array([1.373744e-4, 1.329250e-4, 1.339443e-4])
    sd = np.array([found[f"gyro.scale_{a}"].sd for a in "xyz"])
    assert np.all(np.abs(row(found, "gyro.scale") - 1 / published) < 3 * sd)
    assert {t.why for t in found.turns if not t.used} == {"clipped"}
    assert any("clipped" in r for r in found.notes)
