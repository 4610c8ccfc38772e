# SPDX-License-Identifier: BSD-3-Clause
"""The log store in good weather: what goes in comes out, while it is written and afterwards."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

import allanite as al
from allanite.errors import DataQualityError, FormatError, InputError, StorageError
from allanite.files.store import Batch, Flag, Header, LogStore, ReadPosition, compact, open_run
from allanite.files.store.message import Opening, encode
from log_store_runs import BEGUN, HEADER, RATE, SECOND, batch_of, gaps_of, numbers_of, values_of, write_run

# -- header and batch ---------------------------------------------------------------------------------------


def test_header_goes_through_json() -> None:
    assert Header.from_json(json.loads(json.dumps(HEADER.to_json()))) == HEADER


def test_header_refuses_names_that_are_taken_and_what_is_no_plain_data() -> None:
    with pytest.raises(InputError, match="must differ from each other and from counter"):
        replace(HEADER, channels=(al.Channel.of("counter", "V"),))
    with pytest.raises(InputError, match="plain data"):
        replace(HEADER, settings={"range": object()})
    with pytest.raises(FormatError, match="damaged"):
        Header.from_json({"rate": 1.0})


def test_header_says_what_has_changed() -> None:
    other = replace(HEADER, settings={**HEADER.settings, "range": 10.0}, rate=16.0)
    assert HEADER.differences(HEADER) == []
    assert HEADER.differences(other) == ["rate: 32.0 → 16.0", "settings.range: 1.0 → 10.0"]


def test_batch_refuses_what_does_not_fit() -> None:
    good = batch_of(0, 4)
    with pytest.raises(InputError, match="shape"):
        replace(good, flags=np.zeros(3))
    with pytest.raises(InputError, match="must increase"):
        replace(good, counter=np.array([0, 1, 1, 2]))
    with pytest.raises(InputError, match="must not be empty"):
        Batch(counter=[], monotonic_ns=[], values=np.zeros((0, 2)), flags=[], utc_ns=0)


def test_batch_is_cut_at_a_number() -> None:
    batch = batch_of(10, 4)
    assert batch.after(None) is batch and batch.after(9) is batch and batch.after(13) is None
    rest = batch.after(11)
    assert rest is not None and rest.counter.tolist() == [12, 13]
    assert np.array_equal(rest.values, values_of(rest.counter))


# -- a finished run -----------------------------------------------------------------------------------------


def test_what_goes_in_comes_out(tmp_path: Path) -> None:
    flags = np.array([0, Flag.OVERLOAD, Flag.MISSING | Flag.RESYNC, 0], dtype=np.uint8)
    odd = replace(
        batch_of(64, 4), flags=flags, values=np.array([[1, 2], [np.nan, 3], [np.nan] * 2, [4, 5.0]])
    )
    with LogStore.create(tmp_path / "run", HEADER) as store:
        for batch in (batch_of(0), batch_of(32), odd):
            store.append(batch)
    assert store.acknowledged == 67
    run = open_run(tmp_path / "run")
    assert (run.status, run.reason, run.header, run.damaged_lines) == ("success", "", HEADER, 0)
    for found, put in zip(run.batches(), (batch_of(0), batch_of(32), odd), strict=True):
        for name in ("counter", "monotonic_ns", "values", "flags"):
            assert np.array_equal(getattr(found, name), getattr(put, name), equal_nan=name == "values")
        assert found.utc_ns == put.utc_ns


def test_segments_are_arrow_streams_that_any_library_reads(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 320, 32), rotate_bytes=8000)
    names = sorted(p.name for p in folder.glob("*.arrows"))
    assert len(names) > 1 and names[0] == "000001.arrows"
    tables = [pa.ipc.open_stream((folder / name).read_bytes()).read_all() for name in names]
    table = pa.concat_tables(tables)
    assert table.schema.names == ["counter", "monotonic_ns", "flags", "gyro_z", "temperature"]
    assert table.column("counter").to_pylist() == list(range(320))
    assert np.array_equal(table.column("gyro_z").to_numpy(), values_of(np.arange(320))[:, 0])
    assert table.schema.field("gyro_z").metadata == {b"unit": b"V"}


def test_manifest_names_closed_segments_with_their_digest(tmp_path: Path) -> None:
    import hashlib

    folder = write_run(tmp_path / "run", range(0, 320, 32), rotate_bytes=8000)
    events = open_run(folder).manifest
    assert [e["kind"] for e in events][:: len(events) - 1] == ["run", "end"]
    closed = [e for e in events if e["kind"] == "closed"]
    for event in closed:
        data = (folder / event["segment"]).read_bytes()
        assert (event["bytes"], event["sha256"]) == (len(data), hashlib.sha256(data).hexdigest())
    assert sum(e["rows"] for e in closed) == 320 and closed[-1]["last"] == 319


def test_gaps_keep_their_place_and_their_reason(tmp_path: Path) -> None:
    with LogStore.create(tmp_path / "run", HEADER) as store:
        store.append(batch_of(100))
        store.note("gap", counter=132, samples=32, reason="timeout")
        store.append(batch_of(164))
        store.append(batch_of(200))
    run = open_run(tmp_path / "run")
    assert gaps_of(run.folder) == [(132, 32), (196, 4)]
    told = al.read(run.folder).notes["source"]["missing"]
    assert [(g["position"], g["samples"], g["reason"]) for g in told] == [(32, 32, "timeout"), (96, 4, "")]
    recording = run.recording()
    expected = values_of(np.arange(100, 232))[:, 0]
    expected[32:64] = expected[96:100] = np.nan
    assert np.array_equal(recording.values("gyro_z"), expected, equal_nan=True)
    assert recording.rate == RATE and recording.start == BEGUN + 100 * round(SECOND / RATE)
    assert recording.channels == HEADER.channels
    assert recording.history[0]["settings"] == HEADER.settings


def test_columns_are_read_across_segments_in_any_order(tmp_path: Path) -> None:
    recording = open_run(write_run(tmp_path / "run", range(0, 640, 32), rotate_bytes=8000)).recording()
    expected = values_of(np.arange(640))[:, 1]
    for a, b in ((600, 640), (0, 640), (130, 131), (5, 5), (95, 400), (630, 900)):
        assert np.array_equal(recording.raw("temperature", a, b), expected[a:b])


def test_rate_is_measured_against_the_clock_of_the_host(tmp_path: Path, rng: np.random.Generator) -> None:
    with LogStore.create(tmp_path / "run", HEADER, rotate_bytes=8000) as store:
        for first in range(0, 640, 32):
            batch = batch_of(first)
            late = round(1e6 * rng.exponential())
            store.append(replace(batch, monotonic_ns=batch.counter * round(SECOND / 32.1) + late))
    measured = open_run(tmp_path / "run").survey().rate
    assert measured is not None and measured[0] == pytest.approx(32.1, abs=4 * measured[1])
    assert open_run(tmp_path / "run").recording().rate == 32.0


def test_curve_of_a_run_is_that_of_the_same_samples_in_a_file(tmp_path: Path) -> None:
    counter = np.arange(32 * 100)
    np.save(tmp_path / "same.npy", values_of(counter)[:, 0])
    of_run = al.allan_curve(
        al.read(write_run(tmp_path / "run", range(0, counter.size, 32)), channels=["gyro_z"])
    )
    of_file = al.allan_curve(
        al.read(tmp_path / "same.npy", rate=RATE, unit="V", scale_factor="24 mV/(deg/s)")
    )
    assert np.array_equal(of_run.deviation, of_file.deviation) and np.array_equal(of_run.tau, of_file.tau)


def test_appending_refuses_what_does_not_go_on(tmp_path: Path) -> None:
    with LogStore.create(tmp_path / "run", HEADER) as store:
        store.append(batch_of(0))
        with pytest.raises(InputError, match="sample 31 after sample 31"):
            store.append(batch_of(31))
        with pytest.raises(InputError, match="1 channels for a run of 2"):
            store.append(replace(batch_of(32), values=np.zeros((32, 1))))
        store.append(batch_of(32))
    with pytest.raises(StorageError, match="is closed"):
        store.append(batch_of(64))
    assert numbers_of(tmp_path / "run") == list(range(64))


@pytest.mark.parametrize(
    ("error", "status", "reason"),
    [
        (KeyboardInterrupt(), "abort", "KeyboardInterrupt"),
        (RuntimeError("the meter is silent"), "fail", "RuntimeError: the meter is silent"),
    ],
)
def test_a_run_that_is_left_says_why(tmp_path: Path, error: BaseException, status: str, reason: str) -> None:
    def broken() -> None:
        with LogStore.create(tmp_path / "run", HEADER) as store:
            store.append(batch_of(0))
            raise error

    with pytest.raises(type(error)):
        broken()
    run = open_run(tmp_path / "run")
    assert (run.status, run.reason) == (status, reason) and numbers_of(run.folder) == list(range(32))


def test_an_empty_run_has_no_samples(tmp_path: Path) -> None:
    run = open_run(write_run(tmp_path / "run", []))
    assert list(run.batches()) == [] and run.header == HEADER
    with pytest.raises(DataQualityError, match="no samples in this run yet"):
        run.recording()


def test_what_is_no_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="contains no run"):
        open_run(tmp_path)
    with pytest.raises(InputError, match="no such folder"):
        open_run(tmp_path / "nowhere")
    (tmp_path / "file").touch()
    with pytest.raises(StorageError, match="cannot make the folder"):
        LogStore.create(tmp_path / "file" / "run", HEADER)


# -- while it is written ------------------------------------------------------------------------------------


def test_q15_reading_while_recording_gives_a_prefix(tmp_path: Path) -> None:
    position, followed = None, []
    with LogStore.create(tmp_path / "run", HEADER, rotate_bytes=6000) as store:
        for first in range(0, 640, 32):
            store.append(batch_of(first))
            run = open_run(tmp_path / "run")
            assert run.status == "recording"
            assert numbers_of(run.folder) == list(range(first + 32))
            while (found := run.tail(position))[0]:
                followed += [n for b in found[0] for n in b.counter.tolist()]
                position = found[1]
            position = found[1]
            assert followed == list(range(first + 32))
    assert open_run(tmp_path / "run").status == "success"


def test_q15_half_a_batch_is_not_yet_a_batch(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with LogStore.create(folder, HEADER) as store:
        store.append(batch_of(0))
        run = open_run(folder)
        _, position = run.tail()
        message = encode(batch_of(32), 1, Opening.of(HEADER, run.manifest[0]["run"]))
        before = (folder / "000001.arrows").read_bytes()
        for cut in (0, 1, 7, 8, 100, len(message) - 1):
            (folder / "000001.arrows").write_bytes(before + message[:cut])
            assert run.tail(position) == ([], position)
            assert run.survey().n_samples == 32 and not run.survey().faults
        (folder / "000001.arrows").write_bytes(before + message)
        batches, _ = run.tail(position)
        assert [b.first for b in batches] == [32]


def test_a_recording_does_not_grow_with_its_run(tmp_path: Path) -> None:
    with LogStore.create(tmp_path / "run", HEADER) as store:
        store.append(batch_of(0))
        recording = al.read(tmp_path / "run")
        store.append(batch_of(32))
        assert recording.values("gyro_z").size == recording.n_samples == 32


def test_q12_a_second_writer_is_refused(tmp_path: Path) -> None:
    with LogStore.create(tmp_path / "run", HEADER) as store:
        with pytest.raises(StorageError, match="being written by another process"):
            LogStore.create(tmp_path / "run", HEADER)
        store.append(batch_of(0))
    with pytest.raises(StorageError, match="already contains a run"):
        LogStore.create(tmp_path / "run", HEADER)
    assert numbers_of(tmp_path / "run") == list(range(32))


def test_short_batches_are_acknowledged_together(tmp_path: Path) -> None:
    with LogStore.create(tmp_path / "run", HEADER) as store:
        store.append(batch_of(0, 1))
        store.append(batch_of(1, 1))
        assert store.acknowledged is None
        store.sync()
        assert store.acknowledged == 1


# -- parts --------------------------------------------------------------------------------------------------


def test_q16_parts_with_other_settings_are_never_merged(tmp_path: Path) -> None:
    other = replace(HEADER, settings={**HEADER.settings, "range": 10.0})
    with LogStore.create(tmp_path / "run", HEADER) as store:
        store.append(batch_of(0))
        store.change(other)
        store.append(batch_of(32))
        store.append(batch_of(64))
    run = open_run(tmp_path / "run")
    with pytest.raises(
        DataQualityError, match=r"change at 000002.arrows \(settings.range: 1.0 → 10.0\).*merged"
    ):
        run.recording()
    with pytest.raises(DataQualityError, match="--variable 1"):
        al.read(run.folder)
    assert run.recording(1).n_samples == 32
    second = al.read(run.folder, variable="2")
    assert second.n_samples == 64 and second.history[0]["settings"]["range"] == 10.0
    with pytest.raises(InputError, match="there is no part 3"):
        run.recording(3)
    with pytest.raises(InputError, match="numbered from 1"):
        al.read(run.folder, variable="x")
    batches, position = run.tail()
    with pytest.raises(DataQualityError, match=r"ReadPosition\(segment=2\)"):
        run.tail(position)
    (first,), ((second,), _) = batches, run.tail(ReadPosition(segment=2))
    assert (first.first, first.last, second.first) == (0, 31, 32) and len(second) == 64
    assert [e["differences"] for e in run.manifest if e["kind"] == "change"] == [
        ["settings.range: 1.0 → 10.0"]
    ]


# -- compaction ---------------------------------------------------------------------------------------------


def test_a_compacted_run_is_the_same_log(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", [*range(0, 640, 32), 1000, 1032], rotate_bytes=8000)
    path = compact(folder, tmp_path / "run.parquet")
    one, other = al.read(folder), al.read(path)
    for name in one.names:
        assert np.array_equal(one.values(name), other.values(name), equal_nan=True)
    assert (one.channels, one.rate, one.start) == (other.channels, other.rate, other.start)
    assert {**one.history[0], "run": ""} == {**other.history[0], "run": ""}
    assert path.stat().st_size < sum(p.stat().st_size for p in folder.iterdir())
    with pytest.raises(StorageError, match="exists"):
        compact(folder, path)


def test_compaction_waits_for_the_end_and_refuses_damage(tmp_path: Path) -> None:
    with LogStore.create(tmp_path / "run", HEADER) as store:
        store.append(batch_of(0))
        store.append(batch_of(32))
        with pytest.raises(StorageError, match="still being recorded"):
            compact(tmp_path / "run", tmp_path / "run.parquet")
    segment = tmp_path / "run" / "000001.arrows"
    data = bytearray(segment.read_bytes())
    data[-100] ^= 1
    segment.write_bytes(data)
    with pytest.raises(DataQualityError, match="recover it first"):
        compact(tmp_path / "run", tmp_path / "run.parquet")
    assert not (tmp_path / "run.parquet").exists()


# -- manners ------------------------------------------------------------------------------------------------


def test_writing_does_not_import_pandas(tmp_path: Path) -> None:
    import subprocess

    code = (
        "import sys; from pathlib import Path; from log_store_runs import write_run;"
        f"write_run(Path({str(tmp_path / 'run')!r}), [0, 32]); print('pandas' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[1],
    )
    assert done.stdout.strip() == "False"


def test_a_batch_costs_little() -> None:
    opening = Opening.of(HEADER, "0" * 16)
    data = encode(batch_of(0, 32), 0, opening)
    assert len(data) - 32 * (8 + 8 + 1 + 2 * 8) < 560
    assert isinstance(batch_of(0), Batch)
