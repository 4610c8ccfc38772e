# SPDX-License-Identifier: BSD-3-Clause
"""The log store against death, damage and failing disks: rows Q1 to Q4 of the test battery in full, and what it costs.

Every sample that is read back is compared with what was written; a wrong value ends the run. The runs, and the writer
that is killed, are those of `tests/log_store_runs.py`.
"""

from __future__ import annotations

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

from allanite.errors import StorageError
from allanite.log_store import Disk, Header, LogStore, compact, open_run, recover
from allanite.log_store.segment import Segment
from allanite.recording import Channel

__all__ = ["run_cost", "run_cuts", "run_deaths", "run_disks", "run_flips", "run_full", "run_week"]

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
from allanite.log_store import LogStore
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
    """A week at 32 Hz, as fast as it goes: counts, memory, descriptors, and the time to read it."""
    batches = round(share * WEEK)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "run"
        begun = time.perf_counter()
        with LogStore.create(folder, HEADER) as store:
            for k in range(batches):
                if k == batches // 10:
                    before = _resident(), _descriptors()
                store.append(batch_of(32 * k))
            after = _resident(), _descriptors()
        written = time.perf_counter() - begun
        begun = time.perf_counter()
        survey = open_run(folder).survey()
        read = time.perf_counter() - begun
        size = sum(p.stat().st_size for p in folder.iterdir())
    return [
        {
            "samples": survey.n_samples,
            "right": survey.n_samples == 32 * batches,
            "days": survey.n_samples / RATE / 86400,
            "GB": size * 1e-9,
            "write_s": written,
            "verify_s": read,
            "memory_growth_MB": (after[0] - before[0]) * 1e-6,
            "descriptors": [before[1], after[1]],
        }
    ]


# -- parts --------------------------------------------------------------------------------------------------


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
        return numbers_of(folder)
    except FormatError:
        return []


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
