# SPDX-License-Identifier: BSD-3-Clause
"""The serial IMU against a bad line: row Q7 of the test battery in numbers, and what a fast device costs.

Every sample that comes out is compared with the one that was sent under its number.
"""

from __future__ import annotations

import multiprocessing
import random
import tempfile
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from allanite.acquisition.capture import capture
from allanite.acquisition.instruments import Flag
from allanite.acquisition.instruments.serial_imu import Description, Framer, SerialImu
from allanite.acquisition.instruments.serial_imu.encoding import Encoder
from allanite.acquisition.instruments.serial_imu.faults import ImuFault, noise, wire
from allanite.acquisition.instruments.serial_imu.simulator import SimulatedImu
from allanite.files.store import open_run

__all__ = ["run_held", "run_streams"]

Json = dict[str, Any]
#: Half of what the last place of a sample is worth, and a little.
_ROUNDED = 0.6e-4
_KINDS = ("garbage", "partial", "flipped", "doubled", "replayed", "lost", "overload")


def _device(rate: float, checksum: str | None, length: int) -> Description:
    fields = [
        {
            "name": f"ch{i}",
            "at": 4 + 3 * i,
            "type": "i24",
            "unit": "deg/s",
            "scale": 1e-4,
            "overload": [-8388608],
        }
        for i in range(6)
    ]
    frame: Json = {
        "header": "A5 5A",
        "length": length,
        "counter": {"at": 2, "type": "u16"},
        "fields": fields,
        "checksum": None if checksum is None else {"kind": checksum, "from": 2},
    }
    return Description.of({"model": "X1", "rate": rate, "frame": frame})


def run_streams(trials: int, seed: int, *, samples: int = 100) -> list[Json]:
    """Streams with random faults, cut at random places: samples that are wrong, and those lost beside the faults."""
    draw = random.Random(seed)
    rows = []
    for checksum, length in (
        ("crc32", 26),
        ("crc16-ccitt", 24),
        ("fletcher16", 24),
        ("sum8", 23),
        (None, 22),
    ):
        described = _device(200.0, checksum, length)
        row = {"checksum": checksum or "none", "streams": trials, "samples": 0, "wrong": 0, "not_in_order": 0}
        row |= {"differ_when_cut": 0, "frames_hurt": 0, "frames_lost": 0}
        for _ in range(trials):
            faults = [
                ImuFault(kind=draw.choice(_KINDS), at=at, size=draw.randint(1, 40))  # type: ignore[arg-type]
                for at in draw.sample(range(3, samples - 1), 8)  # samples are numbered from the first one
            ]
            _one(described, faults, samples, draw, row)
        rows.append(row)
    return rows


def _one(
    described: Description, faults: list[ImuFault], samples: int, draw: random.Random, row: Json
) -> None:
    source = noise(len(described.channels), draw.randint(0, 1 << 30))
    stream = list(wire(Encoder(described), source, faults, rate=described.rate, total=samples))
    sent = b"".join(what for _, what in stream if isinstance(what, bytes))
    came = {number for number, _ in stream}
    whole = Framer(described)
    found = whole.feed(sent)
    pieces, parts = sorted(draw.sample(range(len(sent)), 12)), Framer(described)
    again = [parts.feed(sent[a:b]) for a, b in zip([0, *pieces], [*pieces, len(sent)], strict=True)]
    row["differ_when_cut"] += parts.tally != whole.tally or not np.array_equal(
        np.concatenate([p.values for p in again]), found.values, equal_nan=True
    )
    assert found.counter is not None
    true = source(0, samples)
    sound = found.flags & Flag.OVERLOAD == 0
    told, numbers = found.values[sound], found.counter[sound]
    apart = np.abs(told - true[np.minimum(numbers, samples - 1)]) > _ROUNDED
    row["samples"] += len(found)
    row["wrong"] += int((apart.any(axis=1) | (numbers >= samples)).sum())
    row["not_in_order"] += int((np.diff(found.counter) <= 0).sum())
    length = described.frame.length if described.frame is not None else 0
    hurt = {f.at for f in faults if f.kind == "flipped" or (f.kind == "partial" and f.size < length)}  # type: ignore[operator]
    row["frames_hurt"] += len(hurt & came)
    row["frames_lost"] += len(came) - len(found)


def run_held(seconds: float, *, rate: float = 2000.0) -> list[Json]:
    """Six channels over a pseudo-terminal in real time through the capture to disk, the device in a process of its own.

    The share of a core is the processor time of the whole recording process: both threads, the kernel on its behalf,
    connecting and closing.
    """
    described = _device(rate, "crc32", 26)
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(
        target=_send, args=(described.model_dump(mode="json", by_alias=True), there), daemon=True
    )
    process.start()
    imu = SerialImu(here.recv(), described)
    with tempfile.TemporaryDirectory() as name:
        begin, worked = time.monotonic(), time.process_time()
        done = capture(imu, Path(name) / "run", duration=seconds)
        worked, gone = time.process_time() - worked, time.monotonic() - begin
        here.send("end")
        process.join(10.0)
        stored, wrong = _wrong_samples(Path(name) / "run")
    return [
        {
            "seconds": round(gone, 1),
            "samples": stored,
            "due": round(seconds * rate),
            "missing": done.missing,
            "dropped": done.dropped,
            "wrong": wrong,
            "samples_per_second": round(stored / gone, 1),
            "skipped_bytes": imu.tally.skipped,
            "percent_of_a_core": round(100 * worked / gone, 1),
        }
    ]


def _wrong_samples(folder: Path) -> tuple[int, int]:
    """How many samples are stored, and how many of them are not what was sent under their number."""
    source, stored, wrong, first = noise(6), 0, 0, None
    for batch in open_run(folder).batches():
        if first is None:  # some samples may have gone by before the port was opened
            sent = source(0, 20_000)
            first = int(np.argmin(np.abs(sent - batch.values[0]).sum(axis=1)))
        true = source(first + batch.first, batch.last - batch.first + 1)[batch.counter - batch.first]
        wrong += int((np.abs(batch.values - true) > _ROUNDED).any(axis=1).sum())
        stored += len(batch)
    return stored, wrong


def _send(entries: Json, told: Connection) -> None:
    with SimulatedImu(Description.of(entries)) as device:
        told.send(device.port)
        told.recv()
