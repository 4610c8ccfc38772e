# SPDX-License-Identifier: BSD-3-Clause
"""PX4 ULog files, written byte by byte from the definition of the format: values are exact."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from allanite.errors import InputError
from allanite.files.readers import read, ulog
from allanite.recording.health.examination import check
from flight_log_writers import (
    SENSOR_COMBINED,
    combined,
    data,
    definition,
    dropout,
    flag_bits,
    message,
    subscription,
    ulog_header,
)  # fmt: skip
from hostile_files import inline, mutations, outcomes, tally

pytest.importorskip("pyulog", reason="the extra allanite[px4] is not installed")

RNG = np.random.default_rng(6)
GYRO = RNG.normal(size=(100, 3)).astype(np.float32)
ACCEL = (RNG.normal(size=(100, 3)) + [0, 0, 9.8]).astype(np.float32)
SENSOR_GYRO = "uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float x;float y;float z;"
SENSOR_GYRO += "float temperature;uint32_t error_count;uint8_t[3] clip_counter;uint8_t samples;"
VEHICLE_IMU = "uint64_t timestamp;uint64_t timestamp_sample;float[3] delta_angle;float[3] delta_velocity;"
VEHICLE_IMU += "uint32_t delta_angle_dt;uint32_t delta_velocity_dt;uint8_t delta_angle_clipping;"
FIFO = "uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float dt;float scale;uint8_t samples;"
FIFO += "int16_t[32] x;int16_t[32] y;int16_t[32] z;"


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """The child's function without the child: the sandbox has tests of its own, and the samples go through it."""
    monkeypatch.setattr(ulog, "run", inline)


def write(folder: Path, *pieces: bytes, name: str = "log.ulg") -> Path:
    path = folder / name
    path.write_bytes(b"".join(pieces))
    return path


def combined_log(skip: range = range(0), **more: int) -> list[bytes]:
    rows = [combined(1, 10**7 + 4000 * k, GYRO[k], ACCEL[k], **more) for k in range(100) if k not in skip]
    return [
        ulog_header(10**7),
        definition("sensor_combined", SENSOR_COMBINED),
        subscription(1, "sensor_combined"),
        *rows,
    ]


def test_sensor_combined(tmp_path: Path) -> None:
    recording = read(write(tmp_path, *combined_log()))
    assert recording.names == ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
    assert [c.unit for c in recording.channels] == ["rad/s"] * 3 + ["m/s²"] * 3
    assert (recording.rate, recording.n_samples) == (250.0, 100)
    assert {str(c.dtype) for c in recording.columns} == {"float32"}
    for i, axis in enumerate("xyz"):
        assert np.array_equal(recording.values(f"gyro_{axis}"), GYRO[:, i].astype(float))
        assert np.array_equal(recording.values(f"acc_{axis}"), ACCEL[:, i].astype(float))
    assert recording.notes["source"]["guesses"] == []


def test_what_the_logger_dropped_is_a_gap(tmp_path: Path) -> None:
    pieces = combined_log(skip=range(40, 48))
    recording = read(write(tmp_path, *pieces[:43], dropout(32), *pieces[43:]))
    assert recording.n_samples == 100
    assert np.flatnonzero(np.isnan(recording.values("acc_x"))).tolist() == list(range(40, 48))
    assert recording.notes["source"]["dropouts"] == 1
    assert any("for 32 ms together" in g for g in recording.notes["source"]["guesses"])


def test_marks_of_the_driver_are_told_and_old_samples_are_missing(tmp_path: Path) -> None:
    pieces = combined_log()
    pieces[3 + 20] = combined(1, 10**7 + 80_000, GYRO[20], ACCEL[20], relative=0x7FFFFFFF)
    pieces[3 + 30] = combined(1, 10**7 + 120_000, GYRO[30], ACCEL[30], gyro_clip=2)
    recording = read(write(tmp_path, *pieces))
    assert np.flatnonzero(np.isnan(recording.values("acc_z"))).tolist() == [20]
    assert not np.isnan(recording.values("gyro_z")).any()
    said = " ".join(recording.notes["source"]["guesses"])
    assert "marks 1 sample as clipped" in said and "1 accelerometer sample is marked as not new" in said


def many_topics(folder: Path) -> Path:
    """sensor_combined at 250 Hz, two sensor_gyro at 1 Hz, vehicle_imu at 200 Hz, and something else."""
    pieces = combined_log()
    pieces[1:1] = [
        definition("sensor_gyro", SENSOR_GYRO),
        definition("vehicle_imu", VEHICLE_IMU),
        definition("battery", "uint64_t timestamp;float voltage_v;"),
    ]
    pieces += [
        subscription(2, "sensor_gyro", 0),
        subscription(3, "sensor_gyro", 1),
        subscription(4, "vehicle_imu"),
    ]
    pieces += [subscription(5, "battery")]
    for k in range(20):
        for i in (0, 1):
            at = 10**7 + 1_000_000 * k
            pieces.append(data(2 + i, "QQI4fI4B", at + 300, at, 7, *(GYRO[k] + i), 35.5 + i, 0, 0, 0, 0, 8))
        pieces.append(data(5, "Qf", 10**7 + 1000 * k, 16.5))
    for k in range(80):
        at = 10**7 + 5000 * k
        pieces.append(
            data(4, "QQ6f2IB", at + 100 * (k % 7), at, *(GYRO[k] * 0.005), *(ACCEL[k] * 0.005), 5000, 5000, 0)
        )
    return write(folder, *pieces, name="topics.ulg")


def test_the_fast_message_is_read_and_the_others_are_listed(tmp_path: Path) -> None:
    path = many_topics(tmp_path)
    first = read(path)
    assert first.notes["source"]["topic"] == "sensor_combined[0]"
    assert [c.split(" ")[0] for c in first.notes["source"]["contents"]] == [
        "sensor_combined[0]", "vehicle_imu[0]", "sensor_gyro[0]", "sensor_gyro[1]",
    ]  # fmt: skip
    assert any("choose another (vehicle_imu[0]" in g for g in first.notes["source"]["guesses"])
    slow = read(path, topic="sensor_gyro[1]")
    assert (slow.rate, slow.names[-1]) == (1.0, "temperature")
    assert np.array_equal(slow.values("gyro_y"), (GYRO[:20, 1] + np.float32(1)).astype(float))
    assert set(slow.values("temperature")) == {36.5}
    warm = read(path, channels=["gyro", "temperature"])
    assert warm.notes["source"]["topic"] == "sensor_gyro[0]"
    voltage = read(path, topic="battery")
    assert (voltage.rate, voltage.names, voltage.values("voltage_v")[0]) == (1000.0, ("voltage_v",), 16.5)
    with pytest.raises(
        InputError, match=r"no message 'barometer'; the log defines: battery, sensor_combined"
    ):
        read(path, topic="barometer")
    with pytest.raises(InputError, match=r"no message 'sensor_gyro\[2\]'.*sensor_gyro\[0\]"):
        read(path, topic="sensor_gyro[2]")


def test_increments_become_mean_rates_at_the_time_of_the_sample(tmp_path: Path) -> None:
    recording = read(many_topics(tmp_path), topic="vehicle_imu")
    assert recording.rate == 200.0
    assert recording.notes["timebase"]["jitter_rms_s"] < 1e-9  # the stamps of the sending jitter by 600 us
    wanted = (GYRO[:80, 2] * 0.005).astype(np.float32).astype(float) / (5000 * 1e-6)
    assert np.array_equal(recording.values("gyro_z"), wanted)
    assert any("increments over the interval" in g for g in recording.notes["source"]["guesses"])


def test_fifo_packets_are_taken_apart(tmp_path: Path) -> None:
    raw = RNG.integers(-3000, 3000, size=(30, 32, 3))
    pieces = [ulog_header(), definition("sensor_gyro_fifo", FIFO), subscription(1, "sensor_gyro_fifo")]
    for k in range(30):
        last = 10**6 + 1000 * (k + 1) - 125
        pieces.append(data(1, "QQIffB96h", last + 50, last, 1, 125.0, 0.5, 8, *raw[k].T.ravel().tolist()))
    recording = read(write(tmp_path, *pieces))
    assert (recording.rate, recording.n_samples) == (8000.0, 240)
    assert np.array_equal(recording.values("gyro_x"), raw[:, :8, 0].ravel() * 0.5)


def test_appended_sections_follow(tmp_path: Path) -> None:
    pieces = combined_log()
    head = [ulog_header()[:16], b"", *pieces[1:3]]
    first, second = pieces[3:63], pieces[63:]
    size = len(head[0]) + len(flag_bits()) + sum(map(len, head[2:])) + sum(map(len, first))
    head[1] = flag_bits([size])
    recording = read(write(tmp_path, *head, *first, subscription(1, "sensor_combined"), *second))
    assert recording.n_samples == 100
    assert np.array_equal(recording.values("gyro_x"), GYRO[:, 0].astype(float))


def test_logs_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="defines: battery"):
        read(
            write(
                tmp_path, ulog_header(), definition("battery", "uint64_t timestamp;"), message("I", b"\x01x1")
            )
        )
    pieces = combined_log()
    pieces[1] = definition("sensor_combined", "uint64_t timestamp;float[3] rate;")
    pieces[3:] = [data(1, "Q3f", 1000 * k, 1, 2, 3) for k in range(9)]
    unknown = read(write(tmp_path, *pieces))
    assert unknown.names == ("rate_0", "rate_1", "rate_2")
    assert [c.unit for c in unknown.channels] == [""] * 3
    assert any("has no field 'gyro_rad[0]'" in g for g in unknown.notes["source"]["guesses"])
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r'pip install "allanite\[px4\]"'):
        read(tmp_path / "log.ulg")


def test_damaged_logs_harm_nothing(tmp_path: Path) -> None:
    sound = many_topics(tmp_path)
    files = []
    for i, mutant in enumerate(mutations(sound.read_bytes(), 60)):
        files.append(tmp_path / f"{i}.ulg")
        files[-1].write_bytes(mutant)
    found = tally(outcomes(sound, files))
    assert set(found) == {"read", "refused"}, found


# -- real logs ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "rows", "median", "longest"),
    [
        ("mcap_test_ulog.ulg", 1297, 5.01e-3, None),
        ("sample_appended_multiple.ulg", 2373, 4e-3, 16e-3),
        ("sample_log_small.ulg", 1298, 5e-3, 161e-3),
        ("sample.ulg", 17_070, 4e-3, 64.8e-3),
    ],
)
def test_real_logs(
    real_data: Callable[[str], Path], name: str, rows: int, median: float, longest: float | None
) -> None:
    recording = read(real_data(f"formats_px4_ardupilot/{name}"))
    facts = recording.notes["timebase"]
    assert recording.n_samples - facts["missing"] == rows
    assert 1 / facts["median_rate"] == pytest.approx(median, rel=0.03)
    if longest is not None:
        # A gap of k missing samples is a jump of k + 1 intervals.
        assert max(b - a + 1 for a, b in facts["gap_places"]) / recording.rate == pytest.approx(
            longest, rel=0.1
        )
    # The logger of that one takes five samples of its sensor together, and sometimes six.
    assert ("off_grid" in {f.code for f in check(recording)}) == (name == "sample_appended_multiple.ulg")
    assert recording.notes["source"]["dropouts"] == {"sample.ulg": 4, "sample_log_small.ulg": 1}.get(name, 0)
