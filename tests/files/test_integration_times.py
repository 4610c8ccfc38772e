# SPDX-License-Identifier: BSD-3-Clause
"""Samples that gathered during a part of their interval only: the log says so, and N is too large by a known factor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.files.readers import read, ulog
from allanite.files.readers.headings import read_heading
from allanite.recording.channel_names import unit_option
from allanite.recording.health.examination import check
from allanite.recording.records import Recording
from flight_log_writers import SENSOR_COMBINED, combined, data, definition, subscription, ulog_header
from hostile_files import inline

DT, N = 4000, 2e-4  # µs between samples of the sensor; its white noise [rad/s/sqrt(Hz)]
ROWS = 3000
VEHICLE_IMU = (
    "uint64_t timestamp;uint64_t timestamp_sample;float[3] delta_angle;float[3] delta_velocity;"
    "uint16_t delta_angle_dt;uint16_t delta_velocity_dt;uint8_t delta_velocity_clipping;"
)
DIALECTS = (
    "vehicle_imu.ulg",
    "sensor_combined.ulg",
    "vehicle_imu.csv",
    "sensor_combined.csv",
    "vehicle_imu.parquet",
)
UNITS = {"delta_angle": "rad", "delta_velocity": "m/s"}


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ulog, "run", inline)


def rates(every: int, kept: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps [µs], gyro and accelerometer of the messages that were logged: each a mean over DT."""
    rng = np.random.default_rng(every)
    times = 10**7 + DT * every * np.arange(ROWS)
    noise = rng.normal(0.0, N / np.sqrt(DT * 1e-6), (ROWS, 6))
    keep = slice(None) if kept is None else kept
    return times[keep], noise[keep, :3] + 0.01, noise[keep, 3:] + [0, 0, 9.8]


def log(folder: Path, dialect: str, every: int, kept: np.ndarray | None = None) -> Recording:
    times, gyro, acc = rates(every, kept)
    message, _, suffix = dialect.partition(".")
    path, step = folder / dialect, DT * 1e-6
    if suffix == "ulg":
        pytest.importorskip("pyulog")
        if message == "vehicle_imu":
            rows = [
                data(1, "QQ6f2HB", t + 300, t, *(g * step), *(a * step), DT, DT, 0)
                for t, g, a in zip(times.tolist(), gyro, acc, strict=True)
            ]
            fields = VEHICLE_IMU
        else:
            fields = SENSOR_COMBINED
            rows = [combined(1, t, g, a) for t, g, a in zip(times.tolist(), gyro, acc, strict=True)]
        head = [ulog_header(10**7), definition(message, fields), subscription(1, message)]
        path.write_bytes(b"".join([*head, *rows]))
        return read(path)
    increments = message == "vehicle_imu"
    names = ("delta_angle", "delta_velocity") if increments else ("gyro_rad", "accelerometer_m_s2")
    columns = {"timestamp": times}
    for name, of, samples in zip(names, ("gyro", "accelerometer"), (gyro, acc), strict=True):
        columns |= {f"{name}[{i}]": samples[:, i] * (step if increments else 1.0) for i in range(3)}
        columns |= {f"{name}_dt" if increments else f"{of}_integral_dt": np.full(len(times), DT)}
    columns |= {
        "accel_device_id": np.full(len(times), 1310988),
        "accelerometer_timestamp_relative": 0 * times,
    }
    if suffix == "csv":
        cells = zip(*(c.tolist() for c in columns.values()), strict=True)
        path.write_text("\n".join([",".join(columns), *(",".join(map(str, row)) for row in cells)]) + "\n")
    else:
        pandas = pytest.importorskip("pandas")
        pytest.importorskip("pyarrow")
        pandas.DataFrame(columns).to_parquet(path)
    return read(path, time="timestamp:us", unit=UNITS if increments else None)


def found(recording: Recording, code: str) -> list[str]:
    return [f.message for f in check(recording) if f.code == code]


@pytest.mark.parametrize("dialect", DIALECTS)
@pytest.mark.parametrize("every", [2, 5, 25, 250])
def test_messages_that_cover_a_part_of_the_time(dialect: str, every: int, tmp_path: Path) -> None:
    """Whatever wrote them, the rates are those of DT, the aperture is DT, and the factor corrects N."""
    recording = log(tmp_path, dialect, every)
    of_sensor = [c for c in recording.channels if c.kind.value in ("rate", "acceleration")]
    assert len(of_sensor) == 6
    assert [c.aperture for c in of_sensor] == pytest.approx([DT * 1e-6] * 6)
    factor = np.sqrt(every)
    (message,) = set(found(recording, "aliasing"))
    assert f"{factor:.3g} times too large" in message
    assert recording.values(of_sensor[0].name).mean() == pytest.approx(0.01, abs=5e-4)
    [n] = [
        e for e in al.fit(al.allan_curve(recording.select(of_sensor[0].name))).estimates if e.symbol == "N"
    ]
    assert n.value / factor == pytest.approx(N, rel=0.1)


@pytest.mark.parametrize("dialect", DIALECTS)
@pytest.mark.parametrize("lost", [0.0, 0.02])
def test_messages_that_cover_all_of_the_time(dialect: str, lost: float, tmp_path: Path) -> None:
    """Lost messages are gaps: they shorten no aperture."""
    kept = np.random.default_rng(1).random(ROWS) >= lost
    recording = log(tmp_path, dialect, 1, np.flatnonzero(kept))
    assert recording.rate == pytest.approx(1e6 / DT, rel=1e-6)
    assert {c.aperture for c in recording.channels} == {None}
    assert found(recording, "aliasing") == []


@pytest.mark.parametrize("dialect", ["vehicle_imu.csv", "sensor_combined.csv"])
def test_ids_intervals_and_relative_stamps_are_no_sensors(dialect: str, tmp_path: Path) -> None:
    assert found(log(tmp_path, dialect, 1), "no_noise_resolved") == []


@pytest.mark.parametrize("unit", ["rad/s", "deg/s"])
def test_a_rate_in_increments_is_a_contradiction(unit: str, tmp_path: Path) -> None:
    """The refusal names a unit that runs; the advice on a log without units names the same."""
    log(tmp_path, "vehicle_imu.csv", 1)
    path = tmp_path / "vehicle_imu.csv"
    with pytest.raises(InputError, match=r"delta_angle_dt.*--unit delta_angle_0=rad"):
        read(path, time="timestamp:us", unit={"delta_angle": unit, "delta_velocity": "m/s"})
    with pytest.raises(InputError, match=r"--unit delta_velocity_0=m/s:"):
        read(path, time="timestamp:us", unit={"delta_angle": "rad", "delta_velocity": "m/s2"})
    plain = read(path, time="timestamp:us")
    advice = " ".join(f.advice or "" for f in check(plain) if f.code == "unit_missing")
    stated = dict(part.split("=") for part in advice.split("--unit ")[1].split(","))
    assert stated == {f"{name}_{i}": u for name, u in UNITS.items() for i in range(3)}
    assert {c.kind.value for c in read(path, time="timestamp:us", unit=stated).channels} == {
        "rate",
        "acceleration",
        "other",
    }


@pytest.mark.parametrize(
    ("name", "unit"),
    [("delta_theta_x", "rad"), ("dAngX", "rad"), ("X_DELTANG", "rad"), ("gyro_increment_x", "rad"),
     ("dvx", "m/s"), ("deltaVelX", "m/s"), ("X_DELTAV", "m/s"), ("VelInc_X", "m/s"), ("velocity_increment", "m/s"),
     ("gyro_x", "deg/s"), ("acc_x", "m/s^2")],
)  # fmt: skip
def test_advice_names_the_unit_of_the_quantity(name: str, unit: str) -> None:
    assert unit_option([name]) == f"--unit {name}={unit}"


@pytest.mark.parametrize(
    "name",
    [
        "accel_device_id",
        "delta_angle_dt",
        "gyro_dt",
        "accelerometer_timestamp_relative",
        "gyro_calibration_count",
    ],
)
def test_names_of_no_sensor(name: str) -> None:
    assert read_heading(name).group == "other"
