# SPDX-License-Identifier: BSD-3-Clause
"""What health says about real recordings: all that is known to be odd in them, and nothing that is not true."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from allanite.errors import DataQualityError
from allanite.recording.health.examination import check, prepare
from allanite.recording.health.finding import Finding, Severity
from allanite.recording.records import ArrayColumn, Channel, Recording
from noise_records import record

Locate = Callable[[str], Path]
SIX = ("gx", "gy", "gz", "ax", "ay", "az")
TURNED = ("ax", "ay", "az", "gx", "gy", "gz")


def recorded(samples: np.ndarray, names: tuple[str, ...], units: list[str], rate: float = 100.0) -> Recording:
    channels = tuple(Channel.of(name, unit) for name, unit in zip(names, units, strict=True))
    columns = tuple(ArrayColumn(samples[:, i]) for i in range(samples.shape[1]))
    return replace(record(samples[:, 0], rate=rate), channels=channels, columns=columns)


def table(findings: tuple[Finding, ...]) -> dict[tuple[str, str | None], Finding]:
    return {(f.code, f.channel): f for f in findings}


def serious(findings: tuple[Finding, ...]) -> set[tuple[str, str | None]]:
    return {(f.code, f.channel) for f in findings if f.severity is not Severity.INFO}


@pytest.fixture
def adis(real_data: Locate) -> Recording:
    """ADIS16405 at rest, 2.78 h; gyros in deg/s, accelerometers in g."""
    with np.load(real_data("adis16405_calgary/adis_16405_imu4.npz")) as file:
        return recorded(file["data"], SIX, ["deg/s"] * 3 + ["g"] * 3)


def test_adis16405_its_steps_impulses_and_scale_are_named(adis: Recording) -> None:
    said = table(check(adis))
    for name in SIX[:3]:
        assert "0.05 deg/s" in said["resolution_step", name].message
    for name in SIX[3:]:
        assert "0.00333 g" in said["quantisation", name].message
    assert "-17.4 deg/s" in said["spikes", "gx"].message
    assert "-0.529 g" in said["spikes", "az"].message
    assert {name for code, name in said if code == "spikes"} == {"gx", "gy", "ax", "ay", "az"}  # none in gz
    assert "9.972 m/s² (1.7 % high)" in said["gravity", None].message
    assert not [f for f in said.values() if f.severity is Severity.FATAL]


def test_adis16405_the_impulses_no_longer_bend_the_curve(adis: Recording) -> None:
    prepared, findings = prepare(adis, check(adis))
    for name in SIX:
        left = np.isnan(prepared.values(name)).sum()
        spikes = table(findings).get(("spikes", name))
        assert left == (len_of(spikes) if spikes is not None and spikes.excludes else 0)
        if spikes is not None and spikes.excludes:
            assert len(spikes.spans) <= 5  # few gaps: the long lags keep their windows
        raw, kept = (np.nanmean(np.diff(r.values(name)) ** 2) for r in (adis, prepared))
        clean = np.sort(np.abs(np.diff(adis.values(name))))[:-100]
        assert kept == pytest.approx(np.mean(clean**2), rel=1.2e-2)  # 1e-2 may be left, half of that in N
        if name == "az":
            assert raw > 1.05 * kept


def len_of(finding: Finding) -> int:
    return int(np.diff(finding.spans, axis=1).sum())


@pytest.mark.parametrize(
    ("file", "known"),
    [("example_data_tinit_calc.csv", set()), ("imu_static_test.csv", {("spikes", "az")})],
)
def test_mpu6050_static_files_are_clean_but_for_one_first_sample(
    real_data: Locate, file: str, known: set[tuple[str, str]]
) -> None:
    counts = np.loadtxt(real_data(f"tomisuarez_mpu6050/{file}"), delimiter=",", skiprows=5, dtype=np.int64)
    said = check(recorded(counts, TURNED, ["LSB"] * 6))
    assert serious(said) == known  # az begins 10 sigma off: 15708 among 14914 +- 76
    for name in ("ax", "ay", "az"):
        assert "4 counts" in table(said)["resolution_step", name].message
    for name in ("gx", "gy", "gz"):
        assert "steps (LSB) of 1 LSB" in table(said)["resolution_step", name].message


def test_mpu6050_turned_by_90_degrees_is_refused(real_data: Locate) -> None:
    counts = np.loadtxt(
        real_data("tomisuarez_mpu6050/imu_90_x_rot.csv"), delimiter=",", skiprows=5, dtype=np.int64
    )
    recording = recorded(counts, TURNED, ["LSB"] * 6)
    with pytest.raises(DataQualityError, match=r"not_at_rest \[gx\]"):
        prepare(recording, check(recording))


def test_laser_gyros_in_a_parked_vehicle_are_disturbed_at_first(real_data: Locate) -> None:
    with np.load(real_data("psins_lasergyro/lasergyro.npz")) as file:
        samples = np.hstack([file["gyro_deg_per_h"], file["acc_m_s2"]])
    said = table(check(recorded(samples, SIX, ["deg/h"] * 3 + ["m/s^2"] * 3)))
    assert not [f for f in said.values() if f.severity is Severity.FATAL]
    for name in SIX[:3]:
        assert "10 deg/h" in said["resolution_step", name].message
        assert said["disturbance", name].severity is Severity.WARNING
    assert "0.1223 m/s^2" in said["quantisation", "az"].message  # 125 ug s per 10 ms
    assert (said["disturbance", "gy"].spans[0] <= [0, 30_000]).tolist() == [
        True,
        False,
    ]  # the first 300 s, and more
    assert ("bias_removed", "gx") not in said
    assert ("gravity", None) not in said


@pytest.mark.parametrize("unit", range(5))
def test_mpu9150_turned_by_hand_is_refused(real_data: Locate, unit: int) -> None:
    samples = np.loadtxt(real_data(f"mikoff_mpu9150/imu{unit}.log"))
    recording = recorded(samples, TURNED, ["m/s^2"] * 3 + ["rad/s"] * 3)
    said = check(recording)
    assert {name for code, name in serious(said) if code == "not_at_rest"} == {"gx", "gy", "gz"}
    assert "0.001065 rad/s" in table(said)["quantisation", "gx"].message
    assert not {code for code, _ in serious(said)} - {"not_at_rest", "disturbance", "quantisation", "motion"}
    assert "the unit was turned" in table(said)["motion", None].message


def test_icosahedron_poses_clipping_and_coarse_gyro(real_data: Locate) -> None:
    path = real_data("openaxes_d20/log_imu9_2022-06-22_22-13-55.csv")
    samples = np.loadtxt(path, delimiter=";", skiprows=1, usecols=(8, 9, 10, 14, 15, 16))
    said = table(check(recorded(samples, TURNED, ["m/s^2"] * 3 + ["rad/s"] * 3, rate=100.06)))
    for name in ("gx", "gy", "gz"):
        assert said["not_at_rest", name].severity is Severity.FATAL
        assert "0.001065 rad/s" in said["quantisation", name].message
    for name in ("ax", "ay", "az"):
        assert "20.4" in said["clipping", name].message  # 2 g range of 20 bits


def test_poses_of_raw_counts_are_no_rest(real_data: Locate) -> None:
    counts = np.loadtxt(real_data("imu_tk_xsens/xsens_gyro.mat"))[:, 1:].astype(np.int64)
    said = check(recorded(counts, ("gx", "gy", "gz"), ["LSB"] * 3))
    assert serious(said) == {("not_at_rest", name) for name in ("gx", "gy", "gz")}
