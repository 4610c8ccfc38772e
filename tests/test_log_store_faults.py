# SPDX-License-Identifier: BSD-3-Clause
"""The log store in bad weather: kill -9, damaged bytes, full and failing disks, and what `recover` makes of it.

Rows Q1 to Q4 and Q12 of the test battery, a sample of each; `verification/log_store.py` runs them in full.
"""

from __future__ import annotations

import errno
import json
import os
import random
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import DataQualityError, FormatError, StorageError
from allanite.log_store import Disk, LogStore, open_run, recover
from allanite.log_store.segment import Segment
from log_store_runs import (
    HEADER,
    batch_of,
    kill_writer,
    numbers_of,
    start_writer,
    values_of,
    write_run,
)
from shell import Run

FIRST = "000001.arrows"


def ends_of(path: Path) -> list[int]:
    """Bytes at which the opening and the batches of a segment end."""
    segment = Segment.load(path)
    return [segment.offset, *(m.end for m in segment.messages())]


# -- Q1, Q12: death -----------------------------------------------------------------------------------------


def test_q1_nothing_acknowledged_is_lost_by_kill_9(tmp_path: Path) -> None:
    delays = random.Random(6)
    folders = [tmp_path / f"run{k}" for k in range(6)]
    writers = [(folder, start_writer(folder)) for folder in folders]
    for folder, writer in writers:
        found = kill_writer(writer, folder, delays.uniform(0.0, 0.1))
        assert found.acknowledged <= found.stored and found.status == "unfinished"
        recovered = recover(folder, folder.with_name(f"{folder.name}-recovered"))
        assert recovered.kept == found.stored + 1
        assert recovered.exit_code == (3 if found.torn else 0)
        assert recovered.lost == 0 and len(recovered.losses) == found.torn


def test_q12_a_writer_that_lives_keeps_its_run_and_a_dead_one_does_not(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    writer = start_writer(folder)
    assert writer.stdout is not None
    writer.stdout.readline()
    with pytest.raises(StorageError, match="being written by another process"):
        LogStore.create(folder, HEADER)
    with pytest.raises(StorageError, match="still being recorded"):
        recover(folder, tmp_path / "out")
    assert open_run(folder).status == "recording"
    assert al.read(folder).n_samples > 0
    kill_writer(writer, folder, 0.0)
    assert open_run(folder).status == "unfinished"


# -- Q2: damaged bytes --------------------------------------------------------------------------------------


def test_q2_a_cut_leaves_the_exact_prefix(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 320, 32))
    (folder / "manifest.jsonl").unlink()  # it would say that the end is missing
    whole = (folder / FIRST).read_bytes()
    ends = ends_of(folder / FIRST)
    for cut in sorted({*range(ends[-4], len(whole) + 1, 41), *ends[-4:], *(e + 1 for e in ends[-4:])}):
        (folder / FIRST).write_bytes(whole[:cut])
        batches = sum(end <= cut for end in ends) - 1
        assert numbers_of(folder) == list(range(32 * batches)), cut


def test_q2_a_flipped_bit_is_never_a_wrong_value_and_costs_one_batch(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 320, 32))
    whole = (folder / FIRST).read_bytes()
    ends = ends_of(folder / FIRST)
    for place in range(ends[-3], ends[-2], 23):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << place % 8
        (folder / FIRST).write_bytes(damaged)
        assert numbers_of(folder) == list(range(256)), place
        found = recover(folder, None)
        assert (found.kept, found.lost, found.exit_code) == (288, 32, 3), place
        assert [(x.file, x.offset, x.size, x.rows) for x in found.losses] == [
            (FIRST, ends[-3], ends[-2] - ends[-3], 32)
        ]


def test_q2_a_damaged_opening_gives_nothing_rather_than_a_wrong_header(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 128, 32))
    whole = (folder / FIRST).read_bytes()
    for place in range(0, ends_of(folder / FIRST)[0], 31):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << place % 8
        (folder / FIRST).write_bytes(damaged)
        assert numbers_of(folder) == [], place
        assert open_run(folder).header == HEADER
        assert recover(folder, None).kept == 128, place  # with what the manifest says


def test_q2_damage_in_the_middle_is_a_gap_and_recover_finds_what_is_behind(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 640, 32), rotate_bytes=12_000)
    path = folder / "000002.arrows"
    numbers = numbers_of(folder)
    data = bytearray(path.read_bytes())
    place = ends_of(path)[1]
    data[place : place + 40] = bytes(40)
    path.write_bytes(data)
    prefix = al.read(folder)
    assert np.isnan(prefix.values("gyro_z")).sum() > 32
    assert any("000002.arrows is damaged" in g for g in prefix.notes["source"]["guesses"])
    found = recover(folder, tmp_path / "out")
    assert (found.kept, found.lost, found.exit_code) == (len(numbers) - 32, 32, 3)
    healed = al.read(tmp_path / "out")
    assert np.isnan(healed.values("gyro_z")).sum() == 32
    assert np.array_equal(
        numbers_of(tmp_path / "out"), np.setdiff1d(numbers, numbers_of_gap(tmp_path / "out"))
    )


def numbers_of_gap(folder: Path) -> list[int]:
    return [n for gap in open_run(folder).gaps for n in range(gap.counter, gap.counter + gap.count)]


def test_a_segment_that_is_gone_is_named(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 640, 32), rotate_bytes=12_000)
    gone = next(e for e in open_run(folder).manifest if e.get("segment") == "000002.arrows")
    (folder / "000002.arrows").unlink()
    found = recover(folder, None)
    assert [(x.file, x.rows, x.why) for x in found.losses] == [
        (gone["segment"], gone["rows"], "the file is missing")
    ]
    assert len(numbers_of(folder)) == 640 - gone["rows"]
    assert open_run(folder).survey().faults == {"000002.arrows": "the file is missing"}


def test_a_finished_run_that_is_cut_between_two_batches_says_so(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 320, 32))
    os.truncate(folder / FIRST, ends_of(folder / FIRST)[-2])
    assert open_run(folder).survey().faults == {FIRST: "its end is missing"}
    found = recover(folder, None)
    assert (found.kept, found.lost, found.exit_code) == (288, 32, 3)


def test_zeros_garbage_and_another_runs_batches_are_not_read(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 96, 32))
    other = write_run(tmp_path / "other", range(0, 192, 32))
    (folder / "manifest.jsonl").unlink()
    path = folder / FIRST
    whole = path.read_bytes()[:-8]
    foreign = (other / FIRST).read_bytes()
    for tail in (
        bytes(4096),
        b"\xff" * 999,
        random.Random(1).randbytes(5000),
        foreign[ends_of(other / FIRST)[3] :],
    ):
        path.write_bytes(whole + tail)
        assert numbers_of(folder) == list(range(96))
        assert recover(folder, None).kept == 96


def test_every_damaged_line_of_a_manifest_is_left_out(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 96, 32))
    path = folder / "manifest.jsonl"
    whole = path.read_bytes()
    events = open_run(folder).manifest
    for place in range(0, len(whole), 17):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << place % 8
        path.write_bytes(damaged)
        run = open_run(folder)
        assert run.damaged_lines >= 1 and all(e in events for e in run.manifest)
        assert numbers_of(folder) == list(range(96))
    path.write_bytes(whole[:-10])  # torn by a crash
    assert open_run(folder).status == "unfinished"
    assert recover(folder, None).exit_code == 3


# -- Q3, Q4: the disk ---------------------------------------------------------------------------------------


class Failing(Disk):
    """A disk some of whose calls fail, those that are still ahead."""

    def __init__(self) -> None:
        self.writes: dict[int, Callable[[int, bytes], int]] = {}
        self.syncs: dict[int, int] = {}
        self.written = self.synced = 0

    def write(self, descriptor: int, data: bytes) -> int:
        self.written += 1
        return self.writes.pop(self.written, super().write)(descriptor, data)

    def sync(self, descriptor: int) -> None:
        self.synced += 1
        if self.synced in self.syncs:
            raise OSError(self.syncs.pop(self.synced), "injected")
        super().sync(descriptor)


def full(descriptor: int, data: bytes) -> int:
    raise OSError(errno.ENOSPC, "No space left on device")


def short(descriptor: int, data: bytes) -> int:
    return os.write(descriptor, data[:400])


def fill(store: LogStore, n: int = 10) -> int | None:
    """Append so many batches, each acknowledged; the last acknowledged sample."""
    for k in range(n):
        store.append(batch_of(32 * k))
        store.sync()
    return store.acknowledged


@pytest.mark.parametrize("fault", [full, short], ids=["ENOSPC", "short"])
def test_q3_a_write_that_fails_once_ends_its_segment_and_loses_nothing(
    tmp_path: Path, fault: Callable[[int, bytes], int]
) -> None:
    disk = Failing()
    with LogStore.create(tmp_path / "run", HEADER, disk=disk) as store:
        disk.writes[disk.written + 4] = fault
        assert fill(store) == 319
    assert numbers_of(tmp_path / "run") == list(range(320))
    run = open_run(tmp_path / "run")
    assert [bool(e.get("error")) for e in run.manifest if e["kind"] == "closed"] == [True, False]
    assert run.gaps == () and run.survey().faults == {} and recover(run.folder, None).exit_code == 0


def test_q3_a_failed_sync_is_never_tried_again_on_its_file(tmp_path: Path) -> None:
    disk = Failing()
    with LogStore.create(tmp_path / "run", HEADER, disk=disk) as store:
        disk.syncs[disk.synced + 4] = errno.EIO
        assert fill(store) == 319
    assert numbers_of(tmp_path / "run") == list(range(320))  # what both segments hold is read once
    first, second = (e for e in open_run(tmp_path / "run").manifest if e["kind"] == "closed")
    assert (first["last"], first["rows"], second["first"]) == (95, 96, 96)
    assert "the disk fails: save what is on it" in first["error"]
    assert al.read(tmp_path / "run").n_samples == 320


@pytest.mark.parametrize(
    ("code", "advice"),
    [(errno.ENOSPC, "make room"), (errno.EIO, "the disk fails"), (errno.EROFS, "read-only")],
)
def test_q3_a_disk_that_goes_on_failing_ends_the_run(tmp_path: Path, code: int, advice: str) -> None:
    disk = Failing()
    store = LogStore.create(tmp_path / "run", HEADER, disk=disk)
    disk.syncs = dict.fromkeys(range(disk.synced + 4, 1000), code)
    with pytest.raises(StorageError, match=f"{advice}.*all up to sample 95 is stored"):
        fill(store)
    assert store.acknowledged == 95
    with pytest.raises(StorageError, match="is closed"):
        store.append(batch_of(3200))
    assert set(range(96)) <= set(numbers_of(tmp_path / "run"))
    assert open_run(tmp_path / "run").status == "unfinished"  # and unlocked


@pytest.mark.parametrize("n", [1, 2, 50, 511, 512, 600])
def test_q4_dev_full_is_an_error_every_time(tmp_path: Path, n: int) -> None:
    disk = Failing()
    store = LogStore.create(tmp_path / "run", HEADER, disk=disk)
    device = os.open("/dev/full", os.O_WRONLY)
    disk.writes = dict.fromkeys(range(disk.written + 1, 1000), lambda _, data: os.write(device, data))
    with pytest.raises(StorageError, match=r"No space left.*make room.*nothing was stored"):
        store.append(batch_of(0, n))
    os.close(device)


def test_a_run_that_cannot_begin_leaves_no_lock(tmp_path: Path) -> None:
    disk = Failing()
    disk.writes = {2: full}
    with pytest.raises(StorageError, match=r"no run can be begun.*make room"):
        LogStore.create(tmp_path / "run", HEADER, disk=disk)
    with pytest.raises(StorageError, match="holds a run already"):
        LogStore.create(tmp_path / "run", HEADER)


def test_the_manifest_survives_a_line_that_failed(tmp_path: Path) -> None:
    disk = Failing()
    with LogStore.create(tmp_path / "run", HEADER, disk=disk) as store:
        store.append(batch_of(0))
        disk.writes[disk.written + 1] = lambda descriptor, data: os.write(descriptor, data[:20])
        with pytest.raises(StorageError, match="manifest"):
            store.note("temperature", value=36.5)
        store.note("temperature", value=36.6)
    run = open_run(tmp_path / "run")
    assert [e["value"] for e in run.manifest if e["kind"] == "temperature"] == [36.6]
    assert run.damaged_lines == 1 and run.status == "success"


def test_no_descriptor_is_left_open(tmp_path: Path) -> None:
    disk = Failing()
    before = len(list(Path("/proc/self/fd").iterdir()))
    with LogStore.create(tmp_path / "run", HEADER, disk=disk, rotate_bytes=4000) as store:
        disk.writes[disk.written + 5] = full
        fill(store, 20)
    numbers_of(tmp_path / "run")
    open_run(tmp_path / "run").recording().values("gyro_z")
    assert len(list(Path("/proc/self/fd").iterdir())) == before


# -- recover ------------------------------------------------------------------------------------------------


def test_recover_hands_on_notes_parts_and_status(tmp_path: Path) -> None:
    from dataclasses import replace

    other = replace(HEADER, rate=16.0)
    with LogStore.create(tmp_path / "run", HEADER) as store:
        store.append(batch_of(0))
        store.note("gap", counter=32, reason="timeout")
        store.append(batch_of(64))
        store.change(other)
        store.append(batch_of(96))
        store.close("abort", "SIGTERM")
    found = recover(tmp_path / "run", tmp_path / "out")
    assert (found.kept, found.losses, found.exit_code, found.status) == (96, (), 0, "abort")
    run = open_run(tmp_path / "out")
    assert (run.status, run.reason) == ("abort", "SIGTERM")
    assert run.recording(2).rate == 16.0 and run.recording(1).n_samples == 96
    notes = [e for e in run.manifest if e["kind"] == "gap"]
    assert notes == [e for e in open_run(tmp_path / "run").manifest if e["kind"] == "gap"]
    with pytest.raises(StorageError, match="holds a run already"):
        recover(tmp_path / "run", tmp_path / "out")


def test_recover_of_nothing(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 96, 32))
    (folder / FIRST).write_bytes(b"\x00" * 5000)
    found = recover(folder, tmp_path / "out")
    assert (found.kept, found.lost, found.exit_code, found.out) == (0, 96, 1, None)
    assert not (tmp_path / "out").exists()
    with pytest.raises(DataQualityError, match=r"no samples.*000001.arrows"):
        al.read(folder)
    (folder / "manifest.jsonl").unlink()
    with pytest.raises(FormatError, match="no manifest and no segment"):
        recover(folder, None)


def test_command_recover(tmp_path: Path, run: Run) -> None:
    folder = write_run(tmp_path / "run", range(0, 320, 32))
    assert run("recover", folder).code == 0
    assert numbers_of(tmp_path / "run-recovered") == list(range(320))
    shutil.rmtree(tmp_path / "run-recovered")
    place = ends_of(folder / FIRST)[3] + 300
    data = bytearray((folder / FIRST).read_bytes())
    data[place] ^= 4
    (folder / FIRST).write_bytes(data)
    looked = run("recover", folder, "--dry-run")
    assert looked.code == 3 and "the checksum of a batch does not agree" in looked.out
    assert not (tmp_path / "run-recovered").exists()
    done = run("recover", folder, "-o", tmp_path / "out", "--json")
    document = json.loads(done.out)
    assert (done.code, document["kept"], document["lost"], document["out"]) == (
        3,
        288,
        32,
        str(tmp_path / "out"),
    )
    again = run("recover", folder, "-o", tmp_path / "out")
    assert again.code == 1 and "holds a run already" in again.err
    (folder / FIRST).write_bytes(b"")
    nothing = run("recover", folder, "--dry-run")
    assert nothing.code == 1 and "Nothing can be read" in nothing.out


def test_values_of_a_recovered_run_are_what_they_were(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", [0, 32, 100])
    recover(folder, tmp_path / "out")
    found = al.read(tmp_path / "out").values("temperature")
    kept = np.flatnonzero(~np.isnan(found))
    assert np.array_equal(found[kept], values_of(kept)[:, 1]) and kept.size == 96
