# SPDX-License-Identifier: BSD-3-Clause
"""ArduPilot dataflash logs, written byte by byte from the definition of their records: values are exact."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from allanite.errors import AllaniteError, DataQualityError, FormatError, InputError
from allanite.files.readers import ardupilot, read
from allanite.files.readers.ardupilot import records
from allanite.recording.health.examination import check
from allanite.recording.records import Kind
from flight_log_writers import ACC, FMT_ITSELF, GYR, IMU, ISBD, ISBH, fmt, imu, record
from hostile_files import inline, mutations, outcomes, tally

RNG = np.random.default_rng(5)
GYRO = RNG.normal(size=(60, 3)).astype(np.float32)
ACCEL = (RNG.normal(size=(60, 3)) + [0, 0, 9.8]).astype(np.float32)
DEFINED = FMT_ITSELF + fmt(*IMU) + fmt(*GYR) + fmt(*ACC)


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """The child's function without the child: the sandbox has tests of its own, and the samples go through it."""
    monkeypatch.setattr(ardupilot, "run", inline)


def write(folder: Path, *pieces: bytes) -> Path:
    path = folder / "log.BIN"
    path.write_bytes(b"".join(pieces))
    return path


def imu_rows(first: int = 0, last: int = 60, instances: int = 1, step: int = 20_000) -> list[bytes]:
    return [
        imu(1_000_000 + k * step, i, GYRO[k] + i, ACCEL[k], T=40.0 + i)
        for k in range(first, last)
        for i in range(instances)
    ]


# -- values ------------------------------------------------------------------------------------------------


def test_imu_messages_are_split_by_their_instance(tmp_path: Path) -> None:
    path = write(tmp_path, DEFINED, *imu_rows(instances=2))
    recording = read(path)
    assert recording.names == ("GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ", "temperature")
    assert [c.unit for c in recording.channels] == ["rad/s"] * 3 + ["m/s²"] * 3 + ["°C"]
    assert [c.kind for c in recording.channels][-1] is Kind.TEMPERATURE
    assert (recording.rate, recording.n_samples) == (50.0, 60)
    assert {str(c.dtype) for c in recording.columns} == {"float32"}
    for i, axis in enumerate("XYZ"):
        assert np.array_equal(recording.values(f"Gyr{axis}"), GYRO[:, i].astype(float))
        assert np.array_equal(recording.values(f"Acc{axis}"), ACCEL[:, i].astype(float))
    source = recording.notes["source"]
    assert source["topic"] == "IMU[0]"
    assert [c.split(":")[0] for c in source["contents"]] == [
        "IMU[0] (60 rows, 50 Hz",
        "IMU[1] (60 rows, 50 Hz",
    ]
    assert any("IMU[1]" in g for g in source["guesses"])
    other = read(path, topic="IMU[1]", channels=["gyro", "temperature"])
    assert np.array_equal(other.values("GyrX"), (GYRO[:, 0] + np.float32(1)).astype(float))
    assert set(other.values("temperature")) == {41.0}
    assert np.array_equal(read(path, topic="imu").values("GyrZ"), recording.values("GyrZ"))


def test_raw_rates_have_their_own_clocks_and_the_fastest_is_read(tmp_path: Path) -> None:
    """GYR at 1 kHz and ACC at 500 Hz beside IMU at 50 Hz; the stamps of writing come in bursts."""
    rows = list(imu_rows(0, 10))
    for k in range(60):
        written = 1_000_000 + k // 10 * 10_000
        rows.append(record(GYR[0], GYR[2], [written, 0, 990_000 + 1000 * k, *GYRO[k]]))
        rows.append(record(ACC[0], ACC[2], [written, 0, 980_000 + 2000 * k, *ACCEL[k]]))
    path = write(tmp_path, DEFINED, *rows)
    gyro = read(path)
    assert gyro.names == ("GyrX", "GyrY", "GyrZ")
    assert gyro.rate == 1000.0
    assert gyro.notes["timebase"]["jitter_rms_s"] < 1e-12
    assert np.array_equal(gyro.values("GyrY"), GYRO[:, 1].astype(float))
    assert any("SampleUS" in g for g in gyro.notes["source"]["guesses"])
    acc = read(path, channels=["acc"])
    assert (acc.names, acc.rate) == (("AccX", "AccY", "AccZ"), 500.0)
    with pytest.raises(InputError, match=r"no message of an inertial sensor with the channels mag.*GYR\[0\]"):
        read(path, channels=["mag"])
    with pytest.raises(InputError, match=r"no message 'BARO'.*IMU\[0\]"):
        read(path, topic="BARO")


def test_batches_lie_at_their_times_with_gaps_between_them(tmp_path: Path) -> None:
    raw = RNG.integers(-30_000, 30_000, size=(3, 64, 3))
    pieces = []
    for batch, at in enumerate((1_000_000, 1_100_000, 1_200_000)):
        for kind, mul in ((1, 939), (0, 208)):
            pieces.append(record(ISBH[0], ISBH[2], [at, batch, kind, 0, mul, 64, at, 2000.0]))
            for block in range(2):
                part = raw[batch, 32 * block : 32 * block + 32] + kind
                pieces.append(record(ISBD[0], ISBD[2], [at + 5, batch, block, *part.T.tolist()]))
    path = write(tmp_path, FMT_ITSELF, fmt(*ISBH), fmt(*ISBD), *pieces)
    gyro = read(path)
    assert gyro.notes["source"]["topic"] == "batch.gyro[0]"
    assert [c.unit for c in gyro.channels] == ["rad/s"] * 3
    assert gyro.rate == 2000.0
    assert gyro.n_samples == 464  # 64 samples, 136 missing, 64, 136, 64
    starts = (0, 200, 400)
    for batch, start in enumerate(starts):
        for i, axis in enumerate("XYZ"):
            assert np.array_equal(gyro.values(f"Gyr{axis}")[start : start + 64], (raw[batch, :, i] + 1) / 939)
    assert np.isnan(gyro.values("GyrX")).sum() == 272
    acc = read(path, topic="batch.acc[0]")
    assert np.array_equal(acc.values("AccZ")[:64], raw[0, :, 2] / 208)
    # One block of the second batch is lost, and one comes under the number of another batch.
    del pieces[7]
    cut = read(write(tmp_path, FMT_ITSELF, fmt(*ISBH), fmt(*ISBD), *pieces))
    assert cut.n_samples == 464
    assert np.isnan(cut.values("GyrX")[200:232]).all()
    assert np.array_equal(cut.values("GyrX")[232:264], (raw[1, 32:, 0] + 1) / 939)
    assert any("1 of 6 blocks of 32 samples are missing" in g for g in cut.notes["source"]["guesses"])


def test_every_format_letter(tmp_path: Path) -> None:
    texts = [b"abcd", b"text of 16 bytes", b"text of up to 64 bytes", list(range(-16, 16))]
    messages = {
        "ONE": (
            "QbBhHiIqQfdg",
            [-5, 200, -300, 60_000, -70_000, 4_000_000_000, -(2**40), 2**40, 0.1, 0.1, 0.5],
        ),
        "TWO": ("QcCeELMnNZa", [-12.34, 600.25, -12_345.67, 40_000_000.01, -35.3632611, 7, *texts]),
    }
    pieces = [FMT_ITSELF]
    for kind, (name, (letters, values)) in enumerate(messages.items(), start=200):
        columns = "TimeUS," + ",".join(f"v{k}" for k in range(len(values)))
        pieces += [fmt(kind, name, letters, columns)]
        pieces += [record(kind, letters, [1000 * k, *values]) for k in range(20)]
    path = write(tmp_path, *pieces)
    for name, (_, values) in messages.items():
        recording = read(path, topic=name)
        wanted = [
            np.float32(v) if name == "ONE" and k == 8 else v
            for k, v in enumerate(values)
            if k < 6 or name == "ONE"
        ]
        found = [recording.raw(n, 0, 1)[0] + recording.origin(n) for n in recording.names]
        assert found == pytest.approx(wanted, rel=1e-15)


def test_units_are_those_that_the_log_states(tmp_path: Path) -> None:
    unit, mult = (
        (160, "UNIT", "QbZ", "TimeUS,Id,Label"),
        (162, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds"),
    )
    pieces = [FMT_ITSELF, fmt(*unit), fmt(*mult), fmt(*IMU), fmt(170, "MAGN", "QBff", "TimeUS,K,Field,Heat")]
    for letter, label in ((b"s", b"s"), (b"k", b"deg/s"), (b"G", b"Gauss"), (b"O", b"degC")):
        pieces.append(record(160, "QbZ", [0, letter[0], label]))
    pieces.append(record(162, "QBNN", [0, 133, b"s#kkkooo--O----", b""]))
    pieces.append(record(162, "QBNN", [0, 170, b"s#GO", b""]))
    rows = [
        p for k in range(30) for p in (imu_rows(k, k + 1)[0], record(170, "QBff", [1000 * k, k % 2, k, 20.0]))
    ]
    path = write(tmp_path, *pieces, *rows)
    assert [c.unit for c in read(path).channels][:4] == ["deg/s"] * 3 + ["m/s²"]
    magnetometer = read(path, topic="MAGN[1]")  # the instance column is the one whose unit is #
    assert [(c.name, c.unit) for c in magnetometer.channels] == [("Field", "Gauss"), ("Heat", "°C")]
    assert np.array_equal(magnetometer.values("Field"), np.arange(1.0, 30.0, 2.0))


def test_what_the_driver_says_of_its_samples(tmp_path: Path) -> None:
    rows = [
        imu(20_000 * k, 0, GYRO[k], ACCEL[k], EG=7 + k // 10, AH=int(k != 3), GHz=2000, AHz=1000)
        for k in range(40)
    ]
    recording = read(write(tmp_path, DEFINED, *rows))
    said = " ".join(recording.notes["source"]["guesses"])
    assert "driver of the gyro counted 3 errors" in said
    assert "accelerometer is marked as not healthy in 1 sample" in said
    (finding,) = [f for f in check(recording) if f.code == "decimated"]
    assert "runs at 2000 Hz" in finding.message and "logged at 50 Hz" in finding.message
    assert "up to 6.32 times" in finding.message and finding.severity.name == "WARNING"


# -- torn logs ---------------------------------------------------------------------------------------------


def test_garbage_is_passed_over_and_counted(tmp_path: Path) -> None:
    rows = imu_rows()
    trap = b"\xa3\x95\x85" + b"x" * 20  # looks like the beginning of an IMU record
    torn = rows[30][:17]
    pieces = [
        DEFINED,
        *rows[:20],
        trap,
        *rows[20:30],
        torn,
        *rows[31:45],
        b"\xa3\x95",
        *rows[45:],
        rows[0][:9],
    ]
    recording = read(write(tmp_path, *pieces))
    size = len(rows[0])
    # Only the record in front of the lone mark is not followed by what looks like another one, and could be torn.
    lost = size + len(trap) + len(torn) + 2 + 9
    assert recording.notes["source"]["bytes_skipped"] == lost
    assert any(f"{lost} bytes in 4 place(s)" in g for g in recording.notes["source"]["guesses"])
    assert recording.n_samples == 60
    missing = np.flatnonzero(np.isnan(recording.values("GyrX")))
    assert missing.tolist() == [30, 44]
    whole = np.delete(np.arange(60), missing)
    assert np.array_equal(recording.values("AccY")[whole], ACCEL[whole, 1].astype(float))


def test_marks_inside_of_bodies_are_no_records(tmp_path: Path) -> None:
    """A GPS-like message whose text is a whole IMU record: its bytes are not samples."""
    inner = imu_rows(0, 1)[0]
    rows = imu_rows()
    text = record(201, "QZ", [5, inner])
    pieces = [p for row in rows for p in (row, text)]
    recording = read(write(tmp_path, DEFINED, fmt(201, "MSG", "QZ", "TimeUS,Message"), *pieces))
    assert recording.n_samples == 60
    assert recording.notes["source"]["bytes_skipped"] == 0


@pytest.mark.parametrize("window", [300, 700, 4096])
def test_windows_of_any_size_find_the_same_records(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, window: int
) -> None:
    rng = np.random.default_rng(window)
    pieces = [DEFINED]
    for row in imu_rows(instances=2):
        pieces.append(row)
        if rng.random() < 0.1:
            pieces.append(rng.choice([b"\xa3\x95\x85", b"\xa3", rng.bytes(rng.integers(1, 90)), row[:20]]))
    path = write(tmp_path, *pieces)
    whole = records.find_records(path)
    monkeypatch.setattr(records, "_WINDOW", window)
    again = records.find_records(path)
    assert again.skipped == whole.skipped > 0
    for kind, places in whole.places.items():
        assert np.array_equal(again.places[kind], places)


def test_twin_of_the_chain(tmp_path: Path) -> None:
    """The records found are those of a walk that looks at one byte after the other."""
    rng = np.random.default_rng(3)
    pieces = [DEFINED]
    for row in imu_rows():
        pieces.append(row if rng.random() < 0.8 else rng.bytes(rng.integers(1, 70)))
        pieces.append(b"\xa3\x95\x85" if rng.random() < 0.1 else b"")
    path = write(tmp_path, *pieces)
    content, lengths = path.read_bytes(), {128: 89, 133: len(imu_rows()[0]), 179: 32, 176: 32}
    lengths = {k: f.length for k, f in records.find_records(path).formats.items()}

    def begins(at: int) -> bool:
        return content[at : at + 2] == b"\xa3\x95" and at + 2 < len(content) and content[at + 2] in lengths

    at, found = 0, []
    while at < len(content):
        end = at + lengths[content[at + 2]] if begins(at) else -1
        if end == len(content) or (end > 0 and begins(end)):
            found.append(at)
            at = end
        else:
            at += 1
    places = records.find_records(path).places
    assert sorted(int(p) for own in places.values() for p in own) == found
    assert len(found) > 20


def test_logs_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="FMT"):
        read(write(tmp_path, b"\xa3\x95\x80", bytes(200)))
    with pytest.raises(InputError, match="no message of an inertial sensor; there are: nothing"):
        read(
            write(tmp_path, FMT_ITSELF, fmt(201, "MSG", "QZ", "TimeUS,Message"), record(201, "QZ", [1, b"x"]))
        )
    with pytest.raises(DataQualityError, match="at least 2"):
        read(write(tmp_path, DEFINED, *imu_rows(0, 1)))
    twice = fmt(133, "IMU", "QB", "TimeUS,I")
    recording = read(write(tmp_path, DEFINED, *imu_rows(), twice))
    assert any("defines records of type 133 twice" in g for g in recording.notes["source"]["guesses"])
    with pytest.raises(InputError, match="delimiter"):
        read(write(tmp_path, DEFINED, *imu_rows()), delimiter=",")


def test_damaged_logs_harm_nothing(tmp_path: Path) -> None:
    content = DEFINED + fmt(*ISBH) + fmt(*ISBD) + b"".join(imu_rows(0, 20, 2))
    content += record(ISBH[0], ISBH[2], [1, 0, 1, 0, 900, 32, 5, 1000.0])
    content += record(ISBD[0], ISBD[2], [1, 0, 0, *([list(range(32))] * 3)])
    files = []
    for i, mutant in enumerate(mutations(content, 60)):
        files.append(tmp_path / f"{i}.BIN")
        files[-1].write_bytes(mutant)
    found = tally(outcomes(write(tmp_path, content), files))
    assert set(found) == {"read", "refused"}, found


# -- a real log --------------------------------------------------------------------------------------------


def test_real_log(real_data: Callable[[str], Path]) -> None:
    path = real_data("formats_px4_ardupilot/ardupilot_test.BIN")
    for topic in ("IMU", "IMU2"):
        recording = read(path, topic=topic)
        facts = recording.notes["timebase"]
        assert recording.n_samples - facts["missing"] == 45
        assert recording.notes["source"]["records"] > 1700
    first = read(path)
    assert first.raw("temperature", 0, 1)[0] == pytest.approx(44.4, abs=0.05)
    norm = np.sqrt(sum(np.nanmean(first.values(f"Acc{a}")) ** 2 for a in "XYZ"))
    assert norm == pytest.approx(9.81, rel=0.05)
    with pytest.raises(AllaniteError, match="no message"):
        read(path, topic="GYR1")
