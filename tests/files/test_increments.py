# SPDX-License-Identifier: BSD-3-Clause
"""Increments of an angle or a velocity are rates over their interval, whatever calls them so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.recording.health.examination import check

N, RATE = 400, 100.0
T = np.arange(N) / RATE
STEPS = np.random.default_rng(3).normal(5e-3, 1e-3, N)
NAMES = {
    "deg": "delta_theta_x dtheta_x delta_angle_x delAngX gyro_increment_x X_DELTANG Δθx dAngX ang_inc_x d_theta_x "
    "delta_angle[0]",
    "m/s": "dvx deltaVelX delta_velocity[0] VelInc_X d_vel_y dv_z X_DELTAV delVelZ ΔVx velocity_increment",
}
CASES = [(name, unit) for unit, names in NAMES.items() for name in names.split()]
SUMS = (
    *("theta_x [deg]", "angle_x [rad]", "phase [deg]", "int_gyro_x [deg]"),
    *("vel_d [m/s]", "velocity_x [m/s]", "vel_x [m/s]", "dvl_x [m/s]"),
)


def log(folder: Path, *headings: str, columns: list[np.ndarray] | None = None) -> Path:
    path = folder / "log.csv"
    rows = np.column_stack([T, *(columns or [STEPS])])
    head = ",".join(["t [s]", *headings])
    path.write_text(
        "\n".join([head, *(",".join(f"{v:.9g}" for v in row) for row in rows)]) + "\n", encoding="utf-8"
    )
    return path


@pytest.mark.parametrize(("name", "unit"), CASES)
@pytest.mark.parametrize("door", ["header", "unit=", "memory", "parquet"])
def test_named_increments_are_rates(name: str, unit: str, door: str, tmp_path: Path) -> None:
    """At every door the samples are divided by the interval, and that is a finding and a step of the history."""
    if door == "header":
        got = al.read(log(tmp_path, f"{name} [{unit}]"))
    elif door == "unit=":
        path = log(tmp_path, name)
        got = al.read(path, unit=unit)
    elif door == "memory":
        got = al.Recording.from_samples({"t": T, f"{name} [{unit}]": STEPS}, time="t:s")
    else:
        pd = pytest.importorskip("pandas")
        pytest.importorskip("pyarrow")
        pd.DataFrame({"t_s": T, f"{name} [{unit}]": STEPS}).to_parquet(tmp_path / "log.parquet")
        got = al.read(tmp_path / "log.parquet")
    [channel] = got.channels
    assert channel.kind.value == {"deg": "rate", "m/s": "acceleration"}[unit]
    np.testing.assert_allclose(got.values(channel.name), STEPS * RATE, rtol=1e-6)
    assert channel.scale == al.parse_unit(unit).factor
    assert any("increments" in f.message for f in check(got) if f.code == "dialect_guessed")
    assert [s["channels"] for s in got.history if s["step"] == "increments"] == [[channel.name]]


@pytest.mark.parametrize("unit", ["deg/sample", "rad per sample", "arcsec/Sample"])
@pytest.mark.parametrize("stated", [True, False])
def test_a_unit_per_sample_says_so_of_any_name(unit: str, stated: bool, tmp_path: Path) -> None:
    path = log(tmp_path, "gyro_x" if stated else f"gyro_x [{unit.replace(' per ', '/')}]")
    got = al.read(path, unit=unit if stated else None)
    assert got.channels[0].kind.value == "rate"
    np.testing.assert_allclose(got.values("gyro_x"), STEPS * RATE, rtol=1e-6)
    with pytest.raises(InputError, match="not the unit of an angle or a velocity"):
        al.read(path, unit={"gyro_x": "deg/s/sample"})


@pytest.mark.parametrize(("dt_name", "scale"), [("delta_angle_dt", 1e-6), ("dt", 1.0), ("dt_ms", 1e-3)])
def test_increments_are_divided_by_the_intervals_of_their_rows(
    dt_name: str, scale: float, tmp_path: Path
) -> None:
    """As in a log of PX4 vehicle_imu, whose intervals differ from row to row; rates beside them stay."""
    spans = np.random.default_rng(4).choice([9e-3, 11e-3], N)
    path = log(tmp_path, "delta_angle[0]", "acc_x [g]", dt_name, columns=[spans * 0.3, STEPS, spans / scale])
    got = al.read(path, unit={"delta_angle": "rad"})
    assert got.names == ("delta_angle_0", "acc_x")
    np.testing.assert_allclose(got.values("delta_angle_0"), 0.3, rtol=1e-6)
    np.testing.assert_allclose(got.values("acc_x"), STEPS, rtol=1e-6)


def test_each_increment_has_the_intervals_of_its_own_name(tmp_path: Path) -> None:
    angle, velocity = np.random.default_rng(5).choice([9e-3, 11e-3], (2, N))
    path = log(
        tmp_path, "delta_angle[0]", "delta_velocity[0]", "delta_angle_dt", "delta_velocity_dt",
        columns=[angle * 2, velocity * 3, angle * 1e6, velocity * 1e6],
    )  # fmt: skip
    got = al.read(path, unit={"delta_angle": "rad", "delta_velocity": "m/s"})
    np.testing.assert_allclose(got.values("delta_angle_0"), 2.0, rtol=1e-6)
    np.testing.assert_allclose(got.values("delta_velocity_0"), 3.0, rtol=1e-6)


def test_a_scale_factor_of_increments(tmp_path: Path) -> None:
    got = al.read(
        log(tmp_path, "delta_theta_x [LSB]", columns=[np.round(STEPS * 1e5)]), scale_factor="0.01 deg/LSB"
    )
    assert got.channels[0].kind.value == "rate"
    np.testing.assert_allclose(got.values("delta_theta_x"), np.round(STEPS * 1e5) * RATE)


@pytest.mark.parametrize("heading", SUMS)
def test_running_sums_stay(heading: str, tmp_path: Path) -> None:
    got = al.read(log(tmp_path, heading))
    assert got.channels[0].kind.integrated
    np.testing.assert_allclose(got.values(got.names[0]), STEPS, rtol=1e-6)


@pytest.mark.parametrize(
    "heading",
    [
        "gyro_x [deg]",
        "angular_velocity [deg]",
        "ang_vel_x [rad]",
        "angle_rate_x [deg]",
        "acc_x [m/s]",
        "accel_point_x [m/s]",
    ],
)
def test_a_rate_in_the_unit_of_its_sum_is_asked_for(heading: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the heading says"):
        al.read(log(tmp_path, heading))


def test_inc_is_asked_for(tmp_path: Path) -> None:
    """An increment or an inclination: both options that are named run."""
    path = log(tmp_path, "inc_x [deg]")
    with pytest.raises(InputError, match=r"inc_x=deg/sample.* --unit inc_x=deg$"):
        al.read(path)
    assert al.read(path, unit={"inc_x": "deg"}).channels[0].kind.value == "angle"
    assert al.read(path, unit={"inc_x": "deg/sample"}).channels[0].kind.value == "rate"


def test_white_increments_give_their_random_walk(tmp_path: Path) -> None:
    """N of white increments of 0.001 deg each 10 ms is 0.6 deg/√h."""
    rng = np.random.default_rng(6)
    steps = rng.normal(0.0, 1e-3, 20_000)
    path = tmp_path / "log.npz"
    np.savez(path, **{"t_s": np.arange(20_000) / RATE, "delta_theta_x [deg]": steps})
    [n] = [e for e in al.fit(al.allan_curve(al.read(path))).estimates if e.symbol == "N"]
    assert np.rad2deg(n.value) * 60 == pytest.approx(0.6, rel=0.03)
