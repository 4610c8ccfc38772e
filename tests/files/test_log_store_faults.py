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
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.commands.monitor import RunWatch
from allanite.errors import DataQualityError, FormatError, StorageError
from allanite.files.store import Disk, LogStore, open_run, recover, writing
from allanite.files.store.segment import Segment
from log_store_runs import (
    HEADER,
    batch_of,
    gaps_of,
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
    folders = [tmp_path / f"run{k}" for k in range(3)]
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


def broken_off(folder: Path, n: int = 10) -> Path:
    """A run as the death of its writer leaves it: acknowledged batches, no end."""
    with LogStore.create(folder.with_name("alive"), HEADER) as store:
        fill(store, n)
        shutil.copytree(store.folder, folder)
    return folder


def flipped(folder: Path, place: int, mask: int = 1) -> None:
    data = bytearray((folder / FIRST).read_bytes())
    data[place] ^= mask
    (folder / FIRST).write_bytes(data)


@pytest.mark.parametrize("behind", [True, False], ids=["amid", "the last one"])
@pytest.mark.parametrize("where", ["length", "size of the metadata"])
def test_q2_a_damaged_length_in_a_run_that_broke_off_is_no_batch_being_written(
    tmp_path: Path, run: Run, where: str, behind: bool
) -> None:
    folder = broken_off(tmp_path / "run")
    ends = ends_of(folder / FIRST)
    start = ends[4 if behind else 9]
    whole = (folder / FIRST).read_bytes()
    place = whole.index(b"bytes=", start) + 6 if where == "length" else start + 6
    flipped(folder, place, 8 if where == "length" else 0x10)
    found = open_run(folder).survey()
    kept = 128 if behind else 288
    assert not found.torn and found.n_samples == kept
    assert "the length of a batch is damaged" in found.faults[FIRST]
    assert (recover(folder, None).lost, recover(folder, None).kept) == ((32, 288) if behind else (0, 288))
    assert recover(folder, None).exit_code == 3
    told = run("info", folder).out + run("info", folder).err
    assert "recover" in told and "never acknowledged" not in told
    watched = RunWatch(folder).look()
    assert (watched["samples"], watched["missing"]) == (288, 32 if behind else 0)


def test_q2_a_damaged_opening_of_a_run_that_broke_off_is_no_segment_being_begun(tmp_path: Path) -> None:
    folder = broken_off(tmp_path / "run")
    flipped(folder, 6, 0x10)  # its length
    found = recover(folder, None)
    assert (found.kept, found.lost, found.exit_code) == (320, 0, 0)  # with what the manifest says
    with pytest.raises(DataQualityError, match=f"{FIRST}: it does not begin with a complete Arrow schema"):
        open_run(folder).survey()


def test_q1_a_batch_that_was_being_written_is_torn_wherever_it_is_cut(tmp_path: Path) -> None:
    folder = broken_off(tmp_path / "run", 3)
    whole = (folder / FIRST).read_bytes()
    ends = ends_of(folder / FIRST)
    for cut in (1, 7, 8, 100, 300, ends[3] - ends[2] - 1):
        (folder / FIRST).write_bytes(whole[: ends[2] + cut])
        found = open_run(folder).survey()
        assert found.torn and not found.faults and found.n_samples == 64, cut


def test_a_segment_that_is_not_the_one_that_was_closed_is_named(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 320, 32))
    assert recover(folder, None).exit_code == 0
    other = LogStore.create(tmp_path / "other", HEADER)
    identity = open_run(folder).manifest[0]["run"]
    other._opening = writing.Opening.of(HEADER, identity)  # of the same run: every batch verifies
    other._segment = writing._OpenSegment(tmp_path / "other", 2, other._opening, Disk())
    for k in range(10):
        batch = batch_of(32 * k)
        other.append(replace(batch, values=batch.values + 1.0))
    other.close()
    (folder / FIRST).write_bytes((tmp_path / "other" / "000002.arrows").read_bytes())
    found = recover(folder, None)
    assert found.exit_code == 3 and "SHA-256" in found.losses[0].why
    (folder / FIRST).write_bytes(b"")
    flipped_end = write_run(tmp_path / "third", range(0, 320, 32))
    size = (flipped_end / FIRST).stat().st_size
    flipped(flipped_end, size - 1)  # in the mark of the end: no sample is touched
    assert recover(flipped_end, None).exit_code == 0


def numbers_of_gap(folder: Path) -> list[int]:
    return [n for first, count in gaps_of(folder) for n in range(first, first + count)]


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
    assert (
        gaps_of(run.folder) == [] and run.survey().faults == {} and recover(run.folder, None).exit_code == 0
    )


def test_q3_a_failed_sync_is_never_tried_again_on_its_file(tmp_path: Path) -> None:
    disk = Failing()
    with LogStore.create(tmp_path / "run", HEADER, disk=disk) as store:
        disk.syncs[disk.synced + 4] = errno.EIO
        assert fill(store) == 319
    assert numbers_of(tmp_path / "run") == list(range(320))  # what both segments hold is read once
    first, second = (e for e in open_run(tmp_path / "run").manifest if e["kind"] == "closed")
    assert (first["last"], first["rows"], second["first"]) == (95, 96, 96)
    assert "the disk is failing: save its data" in first["error"]
    assert al.read(tmp_path / "run").n_samples == 320


@pytest.mark.parametrize(
    ("code", "advice"),
    [(errno.ENOSPC, "make room"), (errno.EIO, "the disk is failing"), (errno.EROFS, "read-only")],
)
def test_q3_a_disk_that_goes_on_failing_ends_the_run(tmp_path: Path, code: int, advice: str) -> None:
    disk = Failing()
    store = LogStore.create(tmp_path / "run", HEADER, disk=disk)
    disk.syncs = dict.fromkeys(range(disk.synced + 4, 1000), code)
    with pytest.raises(StorageError, match=f"{advice}.*everything up to sample 95 is stored"):
        fill(store)
    assert store.acknowledged == 95
    with pytest.raises(StorageError, match="is closed"):
        store.append(batch_of(3200))
    assert set(range(96)) <= set(numbers_of(tmp_path / "run"))
    run = open_run(tmp_path / "run")
    assert run.status == "fail" and advice in run.reason  # and unlocked


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
    with pytest.raises(StorageError, match=r"cannot start a run.*make room"):
        LogStore.create(tmp_path / "run", HEADER, disk=disk)
    with pytest.raises(StorageError, match="already contains a run"):
        LogStore.create(tmp_path / "run", HEADER)


def test_a_line_of_the_manifest_is_on_the_medium_before_anything_else_is_done(tmp_path: Path) -> None:
    class Told(Disk):
        def __init__(self) -> None:
            self.calls: list[tuple[str, int]] = []

        def write(self, descriptor: int, data: bytes) -> int:
            self.calls.append(("write", descriptor))
            return super().write(descriptor, data)

        def sync(self, descriptor: int) -> None:
            self.calls.append(("sync", descriptor))
            super().sync(descriptor)

    disk = Told()
    with LogStore.create(tmp_path / "run", HEADER, disk=disk) as store:
        for _ in range(2):
            before = len(disk.calls)
            store.note("temperature", celsius=25.0)
            (wrote, line), (synced, same) = disk.calls[before:]
            assert (wrote, synced) == ("write", "sync") and line == same


def test_the_manifest_survives_a_line_that_failed(tmp_path: Path) -> None:
    disk = Failing()
    with LogStore.create(tmp_path / "run", HEADER, disk=disk) as store:
        store.append(batch_of(0))
        disk.writes[disk.written + 1] = lambda descriptor, data: os.write(descriptor, data[:20])
        store.note("temperature", value=36.5)  # tried once more
        disk.syncs[disk.synced + 1] = errno.EIO
        store.note("temperature", value=36.6)
        disk.writes = dict.fromkeys((disk.written + 1, disk.written + 2), full)
        with pytest.raises(StorageError, match=r"manifest.*make room"):
            store.note("temperature", value=36.7)
        store.note("temperature", value=36.8)
    run = open_run(tmp_path / "run")
    assert [e["value"] for e in run.manifest if e["kind"] == "temperature"] == [36.5, 36.6, 36.8]
    assert run.damaged_lines == 0 and run.status == "success"


def test_q5_a_disk_that_is_full_takes_the_last_samples_and_the_end_where_room_was_kept(
    tmp_path: Path,
) -> None:
    class Full(Disk):
        """Takes nothing more from some write on, but for the room that the reserve gave back."""

        full = False

        def write(self, descriptor: int, data: bytes) -> int:
            if self.full and (tmp_path / "run" / writing.RESERVE).exists():
                raise OSError(errno.ENOSPC, "No space left on device")
            return super().write(descriptor, data)

    disk = Full()
    store = LogStore.create(tmp_path / "run", HEADER, disk=disk)
    assert (tmp_path / "run" / writing.RESERVE).stat().st_blocks * 512 > 32_000
    fill(store, 3)
    disk.full = True
    with pytest.raises(StorageError, match=r"No space left.*everything up to sample 127 is stored$"):
        store.append(batch_of(96))
    run = open_run(tmp_path / "run")
    assert (run.status, run.reason.partition(":")[0]) == ("fail", "No space left on device")
    assert numbers_of(run.folder) == list(range(128)) and run.survey().faults == {}
    found = recover(run.folder, None)
    assert (found.kept, found.lost, found.exit_code, found.status) == (128, 0, 0, "fail")
    assert {p.name for p in run.folder.iterdir()} == {FIRST, "000002.arrows", "manifest.jsonl"}


def test_q5_samples_that_even_the_reserve_does_not_take_are_named(tmp_path: Path, run: Run) -> None:
    disk = Failing()
    store = LogStore.create(tmp_path / "run", HEADER, disk=disk)
    fill(store, 3)
    big = max(len(p.read_bytes()) for p in (tmp_path / "run").glob("*.arrows")) // 4
    disk.writes = dict.fromkeys(
        range(disk.written + 1, 10_000),
        lambda fd, data: full(fd, data) if len(data) > big else os.write(fd, data),
    )
    with pytest.raises(
        StorageError, match=r"No space left.*up to sample 95 is stored, the 32 samples after it"
    ):
        store.append(batch_of(96))
    stopped = open_run(tmp_path / "run")
    assert stopped.status == "fail" and "make room" in stopped.reason
    found = recover(stopped.folder, None)
    assert (found.kept, found.lost, found.exit_code) == (96, 32, 3) and "make room" in found.losses[0].why
    (missing,) = al.read(stopped.folder).notes["source"]["missing"]
    assert (missing["position"], missing["samples"]) == (96, 32) and "No space left" in missing["reason"]


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
    with pytest.raises(StorageError, match="already contains a run"):
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
    with pytest.raises(FormatError, match="neither the manifest nor any segment"):
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
    assert looked.code == 3 and "the checksum of a batch does not match" in looked.out
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
    assert again.code == 1 and "already contains a run" in again.err
    (folder / FIRST).write_bytes(b"")
    nothing = run("recover", folder, "--dry-run")
    assert nothing.code == 1 and "Nothing can be read" in nothing.out


def test_values_of_a_recovered_run_are_what_they_were(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", [0, 32, 100])
    recover(folder, tmp_path / "out")
    found = al.read(tmp_path / "out").values("temperature")
    kept = np.flatnonzero(~np.isnan(found))
    assert np.array_equal(found[kept], values_of(kept)[:, 1]) and kept.size == 96


@pytest.mark.parametrize("damaged", [1, 2], ids=["before the gap", "behind the gap"])
@pytest.mark.parametrize("gap", [32, 320])
def test_a_gap_that_was_noted_beside_damage_is_not_lost_as_well(
    tmp_path: Path, gap: int, damaged: int
) -> None:
    """The numbers leave out both: what did not come was noted, and only what the damage took is lost."""
    firsts = [0, 32, 64 + gap, 96 + gap, 128 + gap]
    with LogStore.create(tmp_path / "run", HEADER) as store:
        for first in firsts:
            store.append(batch_of(first))
            if first == 32:
                store.note("gap", counter=64, samples=gap, reason="silence")
    segment = tmp_path / "run" / "000001.arrows"
    data = segment.read_bytes()
    loaded = Segment.load(segment)
    ends = [message.end + loaded.offset for message in loaded.messages()]
    broken = bytearray(data)
    broken[ends[damaged] - 40] ^= 1
    segment.write_bytes(broken)
    found = recover(tmp_path / "run", None)
    assert (found.kept, found.lost) == (4 * 32, 32)
