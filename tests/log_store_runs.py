# SPDX-License-Identifier: BSD-3-Clause
"""Runs whose samples follow from their numbers, so that what is read back can be checked; and a writer to be killed.

As a program it writes to a folder until it is killed, and says on stdout which sample was acknowledged last.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from allanite.files.store import Batch, Header, LogStore, open_run
from allanite.recording.records import Channel

RATE = 32.0
SECOND = 10**9
BEGUN = 1_790_000_000 * SECOND
HEADER = Header(
    channels=(
        Channel.of("gyro_z", "V", scale_factor="24 mV/(deg/s)", aperture=0.02),
        Channel.of("temperature", "degC"),
    ),
    rate=RATE,
    instrument={"maker": "none", "model": "made up", "serial": "12", "firmware": "1"},
    settings={"range": 1.0, "nplc": 1, "autozero": False},
    aperture=0.02,
    scale_date="2026-09-01",
)


def values_of(counter: np.ndarray) -> np.ndarray:
    """The samples that have these numbers."""
    return np.stack([np.sin(0.1 * counter), 20.0 + 1e-4 * counter], axis=1)


def batch_of(first: int, n: int = 32) -> Batch:
    """Samples from a number on."""
    counter = np.arange(first, first + n)
    clock = counter * round(SECOND / RATE)
    return Batch(
        counter=counter,
        monotonic_ns=clock + 5 * SECOND,
        values=values_of(counter),
        flags=np.zeros(n, dtype=np.uint8),
        utc_ns=BEGUN + int(clock[-1]),
    )


def write_run(folder: Path, firsts: Iterable[int], **options: Any) -> Path:
    """A finished run of batches of 32."""
    with LogStore.create(folder, HEADER, **options) as store:
        for first in firsts:
            store.append(batch_of(first))
    return folder


def numbers_of(folder: Path) -> list[int]:
    """Numbers of all samples that are read back; each of them is what it was."""
    found: list[int] = []
    for batch in open_run(folder).batches():
        assert np.array_equal(batch.values, values_of(batch.counter)), "a wrong value was read"
        found += batch.counter.tolist()
    return found


def gaps_of(folder: Path) -> list[tuple[int, int]]:
    """The first sample that is missing and how many, where the counter jumps."""
    found = open_run(folder).survey()
    ends = (found.begins + found.counts)[:-1]
    return [(int(a), int(b - a)) for a, b in zip(ends, found.begins[1:], strict=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Killed:
    """What a killed writer has left."""

    acknowledged: int
    stored: int
    torn: bool
    status: str


def start_writer(folder: Path) -> subprocess.Popen[bytes]:
    """A process that writes until it is killed."""
    return subprocess.Popen([sys.executable, __file__, str(folder)], stdout=subprocess.PIPE)


def kill_writer(writer: subprocess.Popen[bytes], folder: Path, delay: float) -> Killed:
    """Kill -9, so long after its first word; all that is read back is what it was, without a gap."""
    assert writer.stdout is not None
    said = writer.stdout.readline()
    time.sleep(delay)
    writer.send_signal(signal.SIGKILL)
    said += writer.stdout.read()
    writer.wait()
    writer.stdout.close()
    found = numbers_of(folder)
    assert found == list(range(len(found))), "not a prefix"
    run = open_run(folder)
    whole = said[: said.rindex(b"\n")].split()
    return Killed(
        acknowledged=int(whole[-1]), stored=found[-1], torn=run.survey().torn, status=run.status
    )  # fmt: skip


def write_for_ever(folder: Path) -> None:
    """Batches of changing length, in short segments, each acknowledged at once."""
    first = 0
    with LogStore.create(folder, HEADER, rotate_bytes=40_000) as store:
        while True:
            batch = batch_of(first, 1 + first % 97)
            store.append(batch)
            store.sync()
            first += len(batch)
            os.write(1, b"%d\n" % store.acknowledged)


if __name__ == "__main__":
    write_for_ever(Path(sys.argv[1]))
