# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of ROS: containers against those of rosbags, messages wherever they stand, companions, torn files."""

from __future__ import annotations

import importlib.util
import re
import shutil
import sqlite3
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="the extra allanite[ros] is not installed")

import pyarrow as pa

from allanite.errors import DataQualityError, FormatError, InputError, LimitError
from allanite.exporters import export
from allanite.files.readers import read, rosbag
from allanite.files.readers.rosbag import decoding
from allanite.files.readers.rosbag.bag1 import Bag1
from allanite.files.readers.rosbag.mcap import Mcap
from allanite.files.readers.rosbag.sqlite import Sqlite
from allanite.files.readers.rosbag.storage import Storage
from allanite.noise import NoiseModel, RandomWalk, White
from allanite.recording.records import Kind, Recording
from hostile_files import inline, mutations, outcomes, tally
from ros_writers import (
    IMU,
    MAGNETIC,
    TEMPERATURE,
    Types,
    channel,
    chunk,
    mcap,
    message,
    record,
    schema,
    write,
)

N = 200
RNG = np.random.default_rng(15)
STAMPS = 1_700_000_000 * 10**9 + np.arange(N) * 5_000_000
GYRO, ACC, MAG = RNG.normal(size=(3, N, 3))
ONE, TWO = Types(False), Types(True)
SIX = ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """The child's function without the child: the sandbox has tests of its own, and the samples go through it."""
    monkeypatch.setattr(rosbag, "run", inline)


def imus(types: Types, topic: str = "/imu/data_raw", rows: Any = range(N), **more: Any) -> list[Any]:
    return [
        (
            topic,
            IMU,
            int(STAMPS[k]) + 900_000 + 200_000 * (k % 3),
            types.imu(STAMPS[k], GYRO[k], ACC[k], **more),
        )
        for k in rows
    ]


def merged(*streams: list[Any]) -> list[Any]:
    return sorted((m for s in streams for m in s), key=lambda m: m[2])


def remarks(recording: Recording) -> str:
    return " | ".join(recording.notes["source"]["guesses"])


def whole(recording: Recording, rows: Any = slice(None)) -> bool:
    table = np.column_stack((GYRO, ACC))[rows]
    return recording.rate == 200.0 and all(
        np.array_equal(recording.values(n), table[:, i]) for i, n in enumerate(SIX)
    )


# -- containers --------------------------------------------------------------------------------------------


def by_rosbags(path: Path) -> list[tuple[str, int, bytes]]:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        return [(c.topic, t, bytes(raw)) for c, t, raw in reader.messages()]


def by_us(storage: Storage) -> list[tuple[str, int, bytes]]:
    topics = {c.key: c.topic for c in storage.connections}
    rows = [
        (topics[key], t, raw)
        for batch in storage.batches(topics)
        for key, (received, messages) in batch.items()
        for t, raw in zip(received, messages, strict=True)
    ]
    assert {c.topic: c.count for c in storage.connections} == {
        topic: sum(r[0] == topic for r in rows) for topic in topics.values()
    }
    storage.close()
    return sorted(rows, key=lambda r: (r[1], r[0]))


@pytest.mark.parametrize(
    ("name", "packed"),
    [("a.bag", ""), ("a.bag", "bz2"), ("a.bag", "lz4"), ("a.db3", ""), ("a.mcap", ""), ("a.mcap", "storage")],
)
def test_every_message_is_the_one_that_rosbags_finds(tmp_path: Path, name: str, packed: str) -> None:
    types = ONE if name.endswith(".bag") else TWO
    text = [("/chatter", "std_msgs/msg/String", int(STAMPS[k]), types.make("std_msgs/msg/String", data="x" * k))
            for k in range(50)]  # fmt: skip
    path = write(types, tmp_path / name, merged(imus(types), text), packed)
    opened: Storage = {".bag": Bag1, ".db3": Sqlite, ".mcap": Mcap}[path.suffix](path)  # type: ignore[abstract]
    ours, theirs = by_us(opened), by_rosbags(path)
    assert len(ours) == N + 50
    assert ours == sorted(theirs, key=lambda r: (r[1], r[0]))
    recording = read(path)
    assert whole(recording)
    assert recording.start == STAMPS[0]
    assert recording.names == SIX


@pytest.mark.parametrize("packed", ["file", "message"])
def test_recordings_packed_by_ros(tmp_path: Path, packed: str) -> None:
    folder = write(TWO, tmp_path / "a.db3", imus(TWO), packed)
    assert whole(read(folder))
    (folder / "metadata.yaml").unlink()
    assert whole(read(folder))


def test_a_recording_in_several_files_is_read_as_a_whole(tmp_path: Path) -> None:
    folder = tmp_path / "split"
    folder.mkdir()
    for k, rows in enumerate((range(120, N), range(120))):
        write(TWO, folder / f"split_{k}.db3", imus(TWO, rows=rows))
        shutil.rmtree(folder / f"split_{k}_folder")
    assert whole(read(folder))
    write(TWO, folder / "other.mcap", imus(TWO))
    with pytest.raises(InputError, match=r"both \.db3 and \.mcap"):
        read(folder)
    empty = tmp_path / "empty"
    empty.mkdir()
    (empty / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    with pytest.raises(InputError, match="neither"):
        read(empty)


def test_mcap_without_summary_lz4_and_messages_of_ros_1(tmp_path: Path) -> None:
    two = [message(1, int(m[2]), TWO.bytes_of(m[3], IMU)) for m in imus(TWO)]
    head = schema(7, "sensor_msgs/msg/Imu", TWO.store.generate_msgdef(IMU)[0]) + channel(1, 7, "/imu0")
    body = b"".join(two)
    packed = pa.compress(body, codec="lz4", asbytes=True)
    one = [message(1, int(m[2]), ONE.bytes_of(m[3], IMU)) for m in imus(ONE)]
    head1 = schema(7, "sensor_msgs/Imu", ONE.store.generate_msgdef(IMU)[0], "ros1msg") + channel(
        1, 7, "/imu0", "ros1"
    )
    for content in (
        mcap(head, chunk(body, packed, "lz4")),
        mcap(chunk(head + body)),
        mcap(head, body),
        mcap(head1, *one, profile="ros1"),
    ):
        (tmp_path / "a.mcap").write_bytes(content)
        assert whole(read(tmp_path / "a.mcap"))


def test_the_content_decides_and_a_name_is_no_address(tmp_path: Path) -> None:
    """As an SQLite URI, %41.db3 is the file A.db3 beside it, and what follows a ? is an option."""
    write(TWO, tmp_path / "A.db3", imus(TWO, "/imu0", rows=range(50)))
    sound = write(TWO, tmp_path / "b.db3", imus(TWO))
    for name in ("%41.db3", "a?mode=memory.db3", "a#b.db3", "recording.bin"):
        shutil.copy(sound, tmp_path / name)
        recording = read(tmp_path / name)
        assert whole(recording)
        assert recording.notes["source"]["topic"] == "/imu/data_raw"


# -- decoding ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("types", [ONE, TWO], ids=["ros1", "ros2"])
def test_fast_and_slow_give_the_same_bits(
    tmp_path: Path, types: Types, monkeypatch: pytest.MonkeyPatch
) -> None:
    suffix = "mcap" if types.two else "bag"
    path = write(types, tmp_path / f"a.{suffix}", imus(types))
    seen: list[int] = []
    slowly = decoding.Decoder._one_by_one
    monkeypatch.setattr(
        decoding.Decoder, "_one_by_one", lambda self, raws: seen.append(len(raws)) or slowly(self, raws)
    )
    fast = read(path)
    assert seen == [100, 100]  # the first and the last hundred, and no more
    monkeypatch.setattr(decoding.Decoder, "_alike", lambda self, messages: False)
    slow = read(path)
    assert whole(fast)
    assert all(np.array_equal(fast.values(n), slow.values(n)) for n in SIX)
    frames = imus(types, rows=range(0, N, 2), frame="a") + imus(
        types, rows=range(1, N, 2), frame="a long name"
    )
    assert whole(read(write(types, tmp_path / f"b.{suffix}", merged(frames))))


def test_a_layout_that_deceives_is_caught_by_the_full_decoder(tmp_path: Path) -> None:
    """A definition of the same name with a field more: at the offsets from the end there are other numbers."""
    fields, rest = TWO.store.generate_msgdef(IMU)[0].split("=" * 80, 1)
    definition = f"{fields}float64 voltage\n{'=' * 80}{rest}"
    rows = [message(1, int(m[2]), TWO.bytes_of(m[3], IMU) + struct.pack("<d", 5.0)) for m in imus(TWO)]
    (tmp_path / "a.mcap").write_bytes(
        mcap(schema(7, "sensor_msgs/msg/Imu", definition), channel(1, 7, "/imu"), *rows)
    )
    assert whole(read(tmp_path / "a.mcap"))


def test_big_endian_messages(tmp_path: Path) -> None:
    rows = [(t, k, r, bytes(TWO.store.serialize_cdr(m, k, little_endian=False))) for t, k, r, m in imus(TWO)]
    assert whole(read(write(TWO, tmp_path / "a.db3", rows)))


def test_absent_triads_and_stamps_that_are_zero(tmp_path: Path) -> None:
    recording = read(write(TWO, tmp_path / "a.db3", imus(TWO, mark=-1.0)))
    assert recording.names == SIX[:3]
    assert "covariance -1" in remarks(recording)
    rows = [("/imu0", IMU, int(s), TWO.imu(0, w, a)) for s, w, a in zip(STAMPS, GYRO, ACC, strict=True)]
    recording = read(write(TWO, tmp_path / "b.db3", rows))
    assert whole(recording)
    assert recording.start == STAMPS[0]
    assert "times of reception" in remarks(recording)


def test_header_stamps_not_reception_with_gaps_and_repeated_messages(tmp_path: Path) -> None:
    rows = [k for k in range(N) if not 60 <= k < 70]
    rows.insert(20, 20)
    late = [
        (t, k, -(-int(r) // 40_000_000) * 40_000_000, m) for t, k, r, m in imus(TWO, rows=rows)
    ]  # in bursts
    recording = read(write(TWO, tmp_path / "a.db3", late))
    facts = recording.notes["timebase"]
    assert (facts["duplicates"], facts["gaps"], facts["missing"]) == (1, 1, 10)


# -- topics ------------------------------------------------------------------------------------------------

NESTED = {
    "maker_msgs/msg/Inner": "sensor_msgs/Imu imu\nfloat32 voltage\n",
    "maker_msgs/msg/Outer": "std_msgs/Header header\nmaker_msgs/Inner left\nmaker_msgs/Inner right\n",
    "maker_msgs/msg/Batch": "std_msgs/Header header\nsensor_msgs/Imu[] samples\n",
    "maker_msgs/msg/Other": "std_msgs/Header header\ngeometry_msgs/Vector3 angular_velocity\n"
    "geometry_msgs/Vector3 linear_acceleration\n",
}


def nested(types: Types, topic: str, kind: str) -> list[Any]:
    made = []
    for k in range(0, N, 4 if kind == "Batch" else 1):
        header = types.header(STAMPS[k])
        some = [types.imu(STAMPS[j], GYRO[j], ACC[j]) for j in range(k, k + 4 if kind == "Batch" else k + 1)]
        full = f"maker_msgs/msg/{kind}"
        if kind == "Outer":
            inner = [
                types.make(
                    "maker_msgs/msg/Inner", imu=types.imu(STAMPS[k], sign * GYRO[k], ACC[k]), voltage=5.0
                )
                for sign in (1, -1)
            ]
            made.append(
                (topic, full, int(STAMPS[k]), types.make(full, header=header, left=inner[0], right=inner[1]))
            )
        elif kind == "Inner":
            made.append((topic, full, int(STAMPS[k]), types.make(full, imu=some[0], voltage=5.0)))
        elif kind == "Batch":
            made.append((topic, full, int(STAMPS[k]), types.make(full, header=header, samples=some)))
        else:
            vectors = {"angular_velocity": types.vector(GYRO[k]), "linear_acceleration": types.vector(ACC[k])}
            made.append((topic, full, int(STAMPS[k]), types.make(full, header=header, **vectors)))
    return made


@pytest.mark.parametrize("two", [False, True], ids=["bag", "mcap"])
def test_imu_messages_wherever_they_stand(tmp_path: Path, two: bool) -> None:
    types, suffix = Types(two, NESTED), "mcap" if two else "bag"
    recording = read(write(types, tmp_path / f"a.{suffix}", nested(types, "/driver", "Inner")))
    assert whole(recording)
    assert (recording.notes["source"]["topic"], recording["gyro_x"].unit) == ("/driver", "rad/s")
    both = write(types, tmp_path / f"b.{suffix}", nested(types, "/driver", "Outer"))
    assert whole(read(both))
    assert "/driver.left.imu was read; choose another (/driver.right.imu) with --topic" in remarks(read(both))
    right = read(both, topic="/driver.right.imu")
    assert np.array_equal(right.values("gyro_y"), -GYRO[:, 1])
    with pytest.raises(InputError, match=r"several Imu messages in /driver.*/driver\.right\.imu"):
        read(both, topic="/driver")
    batch = write(types, tmp_path / f"c.{suffix}", nested(types, "/driver", "Batch"))
    assert whole(read(batch))
    assert whole(read(batch, topic="/driver"))
    every_fourth = read(batch, topic="driver.samples[1]")
    assert np.array_equal(every_fourth.values("gyro_x"), GYRO[1::4, 0])
    assert every_fourth.rate == 50.0


def test_several_instruments_in_one_list_are_not_one(tmp_path: Path) -> None:
    types = Types(True, NESTED)
    rows = [
        ("/all", "maker_msgs/msg/Batch", int(s), types.make("maker_msgs/msg/Batch", header=types.header(s), samples=[
            types.imu(s, sign * GYRO[k], ACC[k]) for sign in (1, -1)]))
        for k, s in enumerate(STAMPS)
    ]  # fmt: skip
    path = write(types, tmp_path / "a.mcap", rows)
    with pytest.raises(InputError, match=r"2 samples with the same time.*/all\.samples\[0\]"):
        read(path)
    assert np.array_equal(read(path, topic="/all.samples[1]").values("gyro_z"), -GYRO[:, 2])


def test_what_only_looks_like_an_imu_has_no_units(tmp_path: Path) -> None:
    types = Types(True, NESTED)
    path = write(types, tmp_path / "a.mcap", nested(types, "/raw", "Other"))
    recording = read(path)
    assert {c.kind for c in recording.channels} == {Kind.UNKNOWN}
    assert "units are unknown" in remarks(recording)
    known = read(path, unit={"gyro": "rad/s", "acc": "m/s²"})
    assert whole(known)
    assert known["acc_x"].kind is Kind.ACCELERATION
    beside = write(types, tmp_path / "b.mcap", merged(nested(types, "/a", "Other"), imus(types, "/z")))
    assert read(beside).notes["source"]["topic"] == "/z"


@pytest.mark.parametrize(
    ("topics", "taken"),
    [
        (["/imu/data", "/imu/data_raw", "/imu0"], "/imu/data_raw"),
        (["/imu0", "/imu/data"], "/imu/data"),
        (["/left/imu", "/imu0"], "/imu0"),
        (["/left/imu", "/robot/imu/data_raw"], "/robot/imu/data_raw"),
        (["/right/imu", "/left/imu"], "/left/imu"),
    ],
)
def test_the_sensible_topic_is_read_and_the_others_are_named(
    tmp_path: Path, topics: list[str], taken: str
) -> None:
    path = write(TWO, tmp_path / "a.db3", merged(*(imus(TWO, t, rows=range(20)) for t in topics)))
    recording = read(path)
    source = recording.notes["source"]
    assert source["topic"] == taken
    assert all(t in remarks(recording) for t in topics)
    assert source["topics"] == sorted(f"{t} (sensor_msgs/msg/Imu, 20)" for t in topics)
    assert read(path, topic=topics[0]).notes["source"]["topic"] == topics[0]
    with pytest.raises(InputError, match=r"/imu/absent is not there; found: .*/imu"):
        read(path, topic="/imu/absent")


@pytest.mark.parametrize("two", [False, True])
def test_exports_for_kalibr_name_the_topic_of_the_bag(tmp_path: Path, two: bool) -> None:
    types, place = (TWO, tmp_path / "A.db3") if two else (ONE, tmp_path / "A.bag")
    write(types, place, imus(types, "/camera/imu"))
    log = read(place)
    models = [NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-7)).to_json()]
    gyro = {"name": "gyro_x", "kind": "rate", "unit": "rad/s", "models": models}
    facts = {"rate": log.rate, "history": [dict(step) for step in log.history]}
    study = {"provenance": {}, "recording": facts, "channels": [gyro]}
    for name in ("kalibr", "openvins"):
        assert re.search(r"^ *rostopic: /camera/imu$", export(name, study), re.M)
        assert re.search(r"^ *rostopic: /imu9$", export(name, study, rostopic="/imu9"), re.M)
        for steps in ([], [{"step": "read", "format": "ULog", "topic": "sensor_combined"}]):
            other = {**study, "recording": {**facts, "history": steps}}
            assert re.search(r"^ *rostopic: /imu0  # PLACEHOLDER: .*--rostopic", export(name, other), re.M)
        inner = [{"step": "read", "format": "ROS", "topic": "/driver.left.imu"}]
        said = export(name, {**study, "recording": {**facts, "history": inner}})
        assert "/imu0  # PLACEHOLDER: the log is of several topics, or of a message that is no Imu" in said


def test_a_topic_without_samples_or_of_another_kind(tmp_path: Path) -> None:
    rows = [("/t", TEMPERATURE, int(s), TWO.temperature(s, 20.0)) for s in STAMPS[:5]]
    path = write(TWO, tmp_path / "a.db3", rows)
    with pytest.raises(
        InputError, match=r"no topic with messages of an Imu; found: /t \(sensor_msgs/msg/Temp"
    ):
        read(path)
    with pytest.raises(InputError, match="/t holds no Imu messages"):
        read(path, topic="/t")
    base = sqlite3.connect(path)
    base.execute("UPDATE topics SET type = 'sensor_msgs/msg/Imu'")
    base.execute("DELETE FROM messages")
    base.execute("DELETE FROM message_definitions")
    base.commit()
    base.close()
    with pytest.raises(DataQualityError, match="/t has no messages"):
        read(path)


# -- companions --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("two", [False, True], ids=["bag", "db3"])
def test_temperature_and_magnetic_field_are_kept_beside(tmp_path: Path, two: bool) -> None:
    types = TWO if two else ONE
    degrees = 20 + np.arange(N // 20) / 16
    warm = [("/imu/temperature", TEMPERATURE, int(STAMPS[k * 20]) + 10**6,
             types.temperature(STAMPS[k * 20] + 1_200_000, v)) for k, v in enumerate(degrees)]  # fmt: skip
    field = [("/imu/mag", MAGNETIC, int(s), types.magnetic(s, m)) for s, m in zip(STAMPS, MAG, strict=True)]
    path = write(types, tmp_path / ("a.db3" if two else "a.bag"), merged(imus(types), warm, field))
    recording = read(path)
    assert whole(recording)
    assert recording.names == (*SIX, "temperature", "mag_x", "mag_y", "mag_z")
    assert [recording[n].unit for n in ("temperature", "mag_y")] == ["°C", "T"]
    assert recording["temperature"].kind is Kind.TEMPERATURE
    expected = np.full(N, np.nan)
    expected[::20] = degrees
    assert np.array_equal(recording.values("temperature"), expected, equal_nan=True)
    assert np.array_equal(recording.values("mag_z"), MAG[:, 2])
    assert "temperature from /imu/temperature" in remarks(recording)
    assert read(path, channels=["gyro"]).names == SIX[:3]
    assert "temperature" not in remarks(read(path, channels=["gyro"]))
    assert read(path, channels=["acc_x", "temp"]).names == ("acc_x", "temperature")


@pytest.mark.parametrize(
    ("stamps", "why"),
    [
        (STAMPS[:40], "20% of the time"),
        (STAMPS + 10**12, "0% of the time"),
        (STAMPS[::-1], "not in order"),
        (np.repeat(STAMPS, 3) + np.tile([0, 10, 20], N), "more samples than the IMU"),
    ],
    ids=["short", "another clock", "backward", "faster"],
)
def test_a_companion_that_does_not_fit_is_left_out(tmp_path: Path, stamps: Any, why: str) -> None:
    warm = [("/t", TEMPERATURE, int(STAMPS[0]) + k, TWO.temperature(s, 20)) for k, s in enumerate(stamps)]
    recording = read(write(TWO, tmp_path / "a.db3", merged(imus(TWO), warm)))
    assert recording.names == SIX
    assert why in remarks(recording)


def test_a_companion_over_a_gap_of_the_imu(tmp_path: Path) -> None:
    warm = [("/t", TEMPERATURE, int(s), TWO.temperature(s, k)) for k, s in enumerate(STAMPS[::10])]
    rows = [k for k in range(N) if not 95 <= k < 105]
    recording = read(write(TWO, tmp_path / "a.db3", merged(imus(TWO, rows=rows), warm)))
    expected = np.full(N, np.nan)
    expected[::10] = np.arange(20)
    expected[100] = np.nan
    assert np.array_equal(recording.values("temperature"), expected, equal_nan=True)
    assert "1 sample outside" in remarks(recording)


def test_of_several_companions_the_one_of_the_same_instrument(tmp_path: Path) -> None:
    def warm(topic: str, value: float) -> list[Any]:
        return [(topic, TEMPERATURE, int(s), TWO.temperature(s, value)) for s in STAMPS]

    path = write(
        TWO, tmp_path / "a.db3", merged(imus(TWO, "/a/imu/data"), warm("/b/temp", 1), warm("/a/temp", 2))
    )
    assert read(path).values("temperature")[0] == 2.0
    path = write(
        TWO, tmp_path / "b.db3", merged(imus(TWO, "/a/imu/data"), warm("/b/temp", 1), warm("/c/temp", 2))
    )
    recording = read(path)
    assert recording.names == SIX
    assert "temperature could be any of /b/temp, /c/temp: none is added to /a/imu/data" in remarks(recording)


# -- torn and hostile files ---------------------------------------------------------------------------------


def test_a_bag_that_was_not_closed_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    content = bytearray(write(ONE, tmp_path / "a.bag", imus(ONE)).read_bytes())
    at = content.index(b"index_pos=") + 10
    content[at : at + 8] = bytes(8)
    (tmp_path / "open.bag").write_bytes(content)
    recording = read(tmp_path / "open.bag")
    assert whole(recording)
    assert "has no index" in remarks(recording)
    (tmp_path / "cut.bag").write_bytes(content[: len(content) // 2])
    recording = read(tmp_path / "cut.bag")
    assert 50 < recording.n_samples < 150
    assert whole(recording, slice(recording.n_samples))
    assert "the file ends at" in remarks(recording)


def test_an_mcap_that_was_not_finished_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    two = [message(1, int(m[2]), TWO.bytes_of(m[3], IMU)) for m in imus(TWO)]
    head = schema(7, "sensor_msgs/msg/Imu", TWO.store.generate_msgdef(IMU)[0]) + channel(1, 7, "/imu0")
    chunks = [chunk(b"".join(two[k : k + 50])) for k in range(0, N, 50)]
    content = mcap(head, *chunks, finished=False)
    (tmp_path / "a.mcap").write_bytes(content)
    assert whole(read(tmp_path / "a.mcap"))
    (tmp_path / "a.mcap").write_bytes(content[:-3000])
    recording = read(tmp_path / "a.mcap")
    assert whole(recording, slice(150))
    assert "incomplete" in remarks(recording)
    assert "the file ends at" in remarks(recording)


def test_messages_left_in_a_journal_are_not_passed_over_in_silence(tmp_path: Path) -> None:
    path = write(TWO, tmp_path / "a.db3", imus(TWO))
    (tmp_path / "a.db3-wal").write_bytes(b"x" * 100)
    recording = read(path)
    assert whole(recording)
    assert "a.db3-wal holds messages" in remarks(recording)


def test_bombs_and_lies(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    zeros = bytes(64 << 20)
    path.write_bytes(mcap(chunk(zeros, pa.compress(zeros, codec="zstd", asbytes=True), "zstd")))
    with pytest.raises(LimitError, match="bomb"):
        read(path)
    body = message(1, 1, b"x")
    path.write_bytes(mcap(chunk(body, checksum=5)))
    with pytest.raises(FormatError, match="checksum"):
        read(path)
    path.write_bytes(mcap(chunk(body, b"x" * 9, "zstd")))
    with pytest.raises(FormatError, match="damaged"):
        read(path)
    path.write_bytes(mcap(chunk(body, b"x" * 9)))
    with pytest.raises(FormatError, match="9 bytes instead of the declared 32"):
        read(path)
    path.write_bytes(mcap(chunk(body, b"x", "rar")))
    with pytest.raises(FormatError, match="rar"):
        read(path)
    path.write_bytes(mcap(record(5, struct.pack("<H", 1))))
    with pytest.raises(FormatError, match="damaged"):
        read(path)


def test_another_database_is_named_for_what_it_is(tmp_path: Path) -> None:
    base = sqlite3.connect(tmp_path / "a.db3")
    base.execute("CREATE TABLE songs (id INTEGER)")
    base.commit()
    with pytest.raises(InputError, match=r"not a ROS 2 recording; its tables: songs"):
        read(tmp_path / "a.db3")
    base.execute("CREATE TABLE messages (id, topic_id, timestamp, data)")
    base.execute("CREATE VIRTUAL TABLE topics USING fts5(id, name, type, serialization_format)")
    base.commit()
    base.close()
    with pytest.raises(InputError, match="not a ROS 2 recording"):
        read(tmp_path / "a.db3")


def test_old_and_encrypted_bags_say_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V1.2\n" + bytes(100))
    with pytest.raises(FormatError, match="rosbag fix"):
        read(tmp_path / "a.bag")
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(2))
    with pytest.raises(FormatError, match="ends within"):
        read(tmp_path / "a.bag")


def test_a_definition_that_branches_without_end_takes_no_time() -> None:
    types = {"a_msgs/msg/L0": "float64 x\n"}
    types |= {f"a_msgs/msg/L{k}": "".join(f"a_msgs/L{k - 1} f{j}\n" for j in range(60)) for k in range(1, 9)}
    from allanite.files.readers.rosbag.types import places_in

    store = Types(True, types).store
    assert places_in(store, "a_msgs/msg/L8") == []


def test_a_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(100))
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r'pip install "allanite\[ros\]"'):
        read(tmp_path / "a.bag")


@pytest.mark.parametrize(("name", "packed"), [("a.bag", "lz4"), ("a.db3", ""), ("a.mcap", "storage")])
def test_f4_mutations(tmp_path: Path, name: str, packed: str) -> None:
    types = ONE if name.endswith(".bag") else TWO
    sound = write(types, tmp_path / name, imus(types, rows=range(30)), packed)
    files = []
    for i, content in enumerate(mutations(sound.read_bytes(), 20)):
        files.append(tmp_path / f"{i}{sound.suffix}")
        files[-1].write_bytes(content)
    found = tally(outcomes(sound, files))
    assert sum(found.values()) == 20
    assert found.get("read", 0) > 0 and found.get("refused", 0) > 0
