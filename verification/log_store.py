# SPDX-License-Identifier: BSD-3-Clause
"""The log store against death, damage and failing disks: rows Q1 to Q4 of the test battery in full, what it costs, and
a week through the whole capture (Q13).

Every sample that is read back is compared with what was written; a wrong value ends the run. The runs, and the writer
that is killed, are those of `tests/log_store_runs.py`.
"""

from __future__ import annotations

import multiprocessing
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from tests.log_store_runs import (
    HEADER,
    RATE,
    batch_of,
    kill_writer,
    numbers_of,
    start_writer,
    write_run,
)

import allanite as al
from allanite.acquisition.capture import Progress, capture
from allanite.acquisition.instruments.hp3458a import HP3458A, MeterSettings
from allanite.acquisition.instruments.hp3458a.commands import LONGEST_COUNT
from allanite.acquisition.instruments.hp3458a.simulated_meter import SimulatedMeter
from allanite.acquisition.instruments.hp3458a.simulator import MeterSimulator
from allanite.commands.monitor import RunWatch
from allanite.errors import StorageError
from allanite.files.store import Batch, Disk, Header, LogStore, compact, open_run, recover
from allanite.files.store.segment import Segment
from allanite.recording.records import Channel

__all__ = [
    "run_cost",
    "run_cuts",
    "run_deaths",
    "run_disks",
    "run_flips",
    "run_full",
    "run_monitor",
    "run_week",
]

Json = dict[str, Any]
Say = Callable[[str], None]
ROOT = Path(__file__).resolve().parent.parent
FIRST = "000001.arrows"
WEEK = 7 * 24 * 3600


def run_deaths(kills: int, seed: int, say: Say) -> list[Json]:
    """Q1: a writer killed at random moments."""
    delays = random.Random(seed)
    row = {"kills": kills, "acknowledged_lost": 0, "torn": 0, "recover_wrong": 0}
    for k in range(kills):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name) / "run"
            found = kill_writer(start_writer(folder), folder, delays.uniform(0.0, 0.5))
            recovered = recover(folder, Path(name) / "out")
            right = recovered.kept == found.stored + 1 and recovered.exit_code == (3 if found.torn else 0)
            row["acknowledged_lost"] += max(found.acknowledged - found.stored, 0)
            row["torn"] += found.torn
            row["recover_wrong"] += not (right and numbers_of(Path(name) / "out")[-1] == found.stored)
        if k % 20 == 19:
            say(f"{k + 1} of {kills} kills: {row}")
    return [row]


def run_cuts(step: int = 1) -> list[Json]:
    """Q2: the file cut at every byte of its last three batches."""
    with tempfile.TemporaryDirectory() as name:
        folder, whole, ends = _ten_batches(Path(name))
        cuts = range(ends[-4], len(whole) + 1, step)
        wrong = 0
        for cut in cuts:
            (folder / FIRST).write_bytes(whole[:cut])
            wrong += numbers_of(folder) != list(range(32 * (sum(end <= cut for end in ends) - 1)))
    return [{"what": "cut", "trials": len(cuts), "not_the_exact_prefix": wrong}]


def run_flips(step: int = 1) -> list[Json]:
    """Q2: every bit of one batch, and of the opening, flipped."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder, whole, ends = _ten_batches(Path(name))
        for what, span, prefix, kept in (
            ("bits of a batch", range(8 * ends[5], 8 * ends[6], step), 160, 288),
            ("bits of the opening", range(0, 8 * ends[0], step), 0, 0),
        ):
            wrong = unrecovered = 0
            for bit in span:
                damaged = bytearray(whole)
                damaged[bit // 8] ^= 1 << bit % 8
                (folder / FIRST).write_bytes(damaged)
                if prefix:
                    wrong += numbers_of(folder) != list(range(prefix))
                    unrecovered += recover(folder, None).kept != kept
                else:
                    wrong += _read(folder) != []
            rows.append(
                {
                    "what": what,
                    "trials": len(span),
                    "not_the_exact_prefix": wrong,
                    "not_recovered": unrecovered,
                }
            )
    return rows


def run_full(counts: Iterable[int] = range(1, 601)) -> list[Json]:
    """Q4: batches of 1 to 600 samples to a full device."""
    device = os.open("/dev/full", os.O_WRONLY)
    silent, slowest = 0, 0.0

    class Full(Disk):
        armed = False

        def write(self, descriptor: int, data: bytes) -> int:
            return os.write(device if self.armed else descriptor, data)

    trials = list(counts)
    for n in trials:
        with tempfile.TemporaryDirectory() as name:
            disk = Full()
            store = LogStore.create(Path(name) / "run", HEADER, disk=disk)
            disk.armed = True
            begun = time.perf_counter()
            try:
                store.append(batch_of(0, n))
                silent += 1
            except StorageError:
                slowest = max(slowest, time.perf_counter() - begun)
    os.close(device)
    return [{"what": "/dev/full", "trials": len(trials), "without_an_error": silent, "slowest_s": slowest}]


_WRITER = """
import sys, time
from pathlib import Path
from allanite.errors import StorageError
from allanite.files.store import LogStore
from tests.log_store_runs import HEADER, batch_of
store = LogStore.create(Path(sys.argv[1]), HEADER)
try:
    for k in range(40):
        begun = time.perf_counter()
        store.append(batch_of(32 * k))
        store.sync()
        print("acknowledged", store.acknowledged, flush=True)
    store.close()
except StorageError:
    print("StorageError", time.perf_counter() - begun)
"""


def run_disks(say: Say) -> list[Json]:
    """Q3: faults put into the system calls from outside, by strace, at changing places; none without strace."""
    if shutil.which("strace") is None:
        return []
    faults = {
        "ENOSPC once": "write:error=ENOSPC:when={}",
        "ENOSPC for good": "write:error=ENOSPC:when={}+",
        "short write": "write:retval=400:when={}",
        "EIO on fdatasync once": "fdatasync:error=EIO:when={}",
        "EIO on fdatasync for good": "fdatasync:error=EIO:when={}+",
        "kill at fdatasync": "fdatasync:signal=SIGKILL:when={}",
    }
    rows = []
    for name, fault in faults.items():
        row: Json = {"fault": name, "trials": 0, "acknowledged_lost": 0, "errors": 0, "slowest_error_s": 0.0}
        for place in (3, 4, 7, 12, 20, 33):
            done = _traced(fault.format(place))
            row["trials"] += 1
            row["acknowledged_lost"] += max(done["acknowledged"] + 1 - done["stored"], 0)
            row["errors"] += done["error"]
            row["slowest_error_s"] = max(row["slowest_error_s"], done["seconds"])
        say(str(row))
        rows.append(row)
    return rows


def run_cost(n: int = 2000) -> list[Json]:
    """Time to put a batch, the sync aside and with it, and what it takes on disk."""
    rows = []
    for what, rate, channels, seconds in (
        ("32 Hz, 1 channel", 32, 1, 1.0),
        ("2 kHz, 6 channels", 2000, 6, 0.25),
    ):
        header = Header(channels=tuple(Channel.of(f"ch{i}", "V") for i in range(channels)), rate=rate)
        samples = round(rate * seconds)
        noise = np.random.default_rng(1)
        plain, synced = [], []
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name) / "run"
            with LogStore.create(folder, header) as store:
                for k in range(n):
                    values = noise.standard_normal((samples, channels))
                    batch = replace(batch_of(k * samples, samples), values=values)
                    begun = time.perf_counter()
                    store.append(batch)
                    plain.append(time.perf_counter() - begun)
                    if k % 10 == 0:
                        begun = time.perf_counter()
                        store.sync()
                        synced.append(time.perf_counter() - begun)
            size = sum(p.stat().st_size for p in folder.glob("*.arrows"))
            packed = compact(folder, Path(name) / "run.parquet").stat().st_size
        rows.append(
            {
                "what": what,
                "batch_s": seconds,
                "put_us_p50_p99": [1e6 * float(np.quantile(plain, q)) for q in (0.5, 0.99)],
                "sync_ms_p50_p99": [1e3 * float(np.quantile(synced, q)) for q in (0.5, 0.99)],
                "bytes_per_batch": size / n,
                "GB_per_week": size / n / seconds * WEEK * 1e-9,
                "GB_per_week_compacted": packed / n / seconds * WEEK * 1e-9,
            }
        )
    return rows


def run_week(share: float = 1.0) -> list[Json]:
    """Q13: a week at 32 Hz through the capture, as fast as it goes: counts, values, memory, descriptors.

    The simulated 3458A sits in a process of its own behind a socket, is read through PyVISA a second at a time, and is
    armed again once, as in a week. Every reading tells which one it is.
    """
    n = round(share * WEEK * RATE)
    # As in a week: 16 777 215 readings to an arming, and so many segments of ten minutes.
    settings = MeterSettings(rate=RATE, readings_per_arm=max(round(LONGEST_COUNT * min(share, 1.0)), 2))
    marks: list[tuple[int, int, int]] = []

    def watch(state: Progress) -> None:
        if state.samples >= n * (len(marks) + 1) / 10:
            marks.append((state.samples, _resident(), _descriptors()))

    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_serve, args=(there,), daemon=True)
    process.start()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "run"
        meter = HP3458A(here.recv(), settings, speed=None, block=1.0)
        begun = time.perf_counter()
        done = capture(meter, folder, duration=n / RATE, rotate_seconds=0.3, progress=watch)
        written = time.perf_counter() - begun
        here.send("end")
        process.join(10.0)
        begun = time.perf_counter()
        stored, wrong = _wrong_readings(folder)
        read = time.perf_counter() - begun
        size = sum(p.stat().st_size for p in folder.iterdir())
        segments = len(list(folder.glob("*.arrows")))
    _, memory, descriptors = marks[0]
    return [
        {
            "samples": done.samples,
            "missing": done.missing,
            "due": n,
            "exact": done.samples + done.missing == n and stored == done.samples,
            "wrong": wrong,
            "armed_again": done.gaps,
            "days": n / RATE / 86400,
            "GB": size * 1e-9,
            "segments": segments,
            "write_s": written,
            "verify_s": read,
            "memory_growth_MB": (max(m for _, m, _ in marks) - memory) * 1e-6,
            "descriptors": [descriptors, max(d for _, _, d in marks)],
        }
    ]


def run_monitor(share: float = 1.0) -> list[Json]:
    """What it costs to watch a week at 32 Hz: the first look, those after it, memory; and to read the run.

    Processor time of this process. Later looks find one batch of a second each, as every second does.
    """
    n = max(round(share * WEEK), 40)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "run"
        with LogStore.create(folder, HEADER, rotate_seconds=1e9, rotate_bytes=600 * 1200) as store:
            for second in range(n - 20):
                store.append(_noise(second))
            store.sync()
            before, watch = _resident(), RunWatch(folder)
            first = _processor_time(watch.look) + _processor_time(watch.curve)
            later = []
            for second in range(n - 20, n):
                store.append(_noise(second))
                store.sync()
                later.append(_processor_time(watch.look) + _processor_time(watch.curve))
            growth, state = _resident() - before, watch.look()
        read = _processor_time(lambda: [len(block) for _, block in al.read(folder).blocks("gyro_z")])
        size = sum(p.stat().st_size for p in folder.iterdir())
        segments = len(list(folder.glob("*.arrows")))
    return [
        {
            "samples": state["samples"],
            "exact": state["samples"] == 32 * n and not state["missing"],
            "days": n / 86400,
            "GB": size * 1e-9,
            "segments": segments,
            "first_look_s": first,
            "later_look_s_median": float(np.median(later)),
            "memory_growth_MB": growth * 1e-6,
            "verify_and_read_one_channel_s": read,
        }
    ]


# -- parts --------------------------------------------------------------------------------------------------


def _noise(second: int) -> Batch:
    """A second of white noise in both channels."""
    batch: Batch = batch_of(32 * second)
    return replace(batch, values=np.random.default_rng(second).standard_normal(batch.values.shape))


def _processor_time(call: Callable[[], Any]) -> float:
    begun = time.process_time()
    call()
    return time.process_time() - begun


def _serve(told: Connection) -> None:
    """The meter of `run_week`; its readings count microvolts."""
    with MeterSimulator(SimulatedMeter(speed=None)) as simulator:
        told.send(simulator.resource)
        told.recv()


def _wrong_readings(folder: Path) -> tuple[int, int]:
    """How many readings are stored, and how many of them are not the next one that the meter made."""
    stored = wrong = 0
    for batch in open_run(folder).batches():
        made = np.arange(stored, stored + len(batch))
        wrong += int(np.count_nonzero(np.round(batch.values[:, 0] * 1e6) != made % 1_000_000))
        stored += len(batch)
    return stored, wrong


def _ten_batches(folder: Path) -> tuple[Path, bytes, list[int]]:
    """A run without its manifest, its only segment, and where the opening and the batches end in it."""
    run = write_run(folder / "run", range(0, 320, 32))
    (run / "manifest.jsonl").unlink()
    segment = Segment.load(run / FIRST)
    return run, (run / FIRST).read_bytes(), [segment.offset, *(m.end for m in segment.messages())]


def _read(folder: Path) -> list[int]:
    """What can be read of a run, where nothing may be."""
    from allanite.errors import FormatError

    try:
        read: list[int] = numbers_of(folder)
    except FormatError:
        return []
    return read


def _traced(inject: str) -> Json:
    """A writer whose calls for one segment or its manifest fail as strace is told."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "run"
        command = [
            "strace",
            "-f",
            "-qq",
            "-o",
            "/dev/null",
            "-e",
            "trace=write,fdatasync",
            "-e",
            f"inject={inject}",
        ]
        paths = [word for n in range(1, 60) for word in ("-P", str(folder / f"{n:06d}.arrows"))]
        done = subprocess.run(
            [*command, *paths, sys.executable, "-c", _WRITER, str(folder)],
            capture_output=True,
            text=True,
            cwd=ROOT,
            check=False,
            timeout=120,
        )
        stored = len(numbers_of(folder))
    acknowledged = re.findall(r"^acknowledged (\d+)$", done.stdout, re.M)
    error = re.search(r"^StorageError (\S+)$", done.stdout, re.M)
    return {
        "acknowledged": int(acknowledged[-1]) if acknowledged else -1,
        "error": error is not None,
        "seconds": float(error[1]) if error else 0.0,
        "stored": stored,
    }


def _resident() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


def _descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))
