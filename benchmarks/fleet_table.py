# SPDX-License-Identifier: BSD-3-Clause
"""What it takes to write the table of a fleet of 100 000 logs: processor time and memory.

    python -m benchmarks.fleet_table [--logs N]

Rows are simulated: six channels with seven coefficients each, as parts that a run left. Each step is a process of its
own: it loads what is done, takes the rows and writes the table.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from allanite.commands.fleet import folder as folders
from allanite.commands.fleet.folder import FleetFolder
from allanite.commands.fleet.labels import LogLabels
from allanite.commands.fleet.table import arrow_type

from .machine import describe, save
from .processes import peak_bytes, result_of

CHANNELS = ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
TERMS = ("Q", "N", "B", "K", "R", "sigma", "T")
PATTERN = "{lot}/{unit}_{date}_{temperature}C.bag"
PART = 200  # logs
STEPS = {
    "all logs, after a run that was interrupted before its end": "all",
    "10 logs more": "more",
    "nothing new": "none",
}


def part(logs: range, seed: int) -> pa.Table:
    """The rows of some logs."""
    rng = np.random.default_rng(seed)
    names = [f"logs/lot{i % 50}/sn{i:06d}_2026-10-{i % 28 + 1:02d}_{20 + i % 30}C.bag" for i in logs]
    per = len(CHANNELS) * len(TERMS)
    log = np.repeat(np.arange(len(names)), per)
    channel = np.tile(np.repeat(np.arange(len(CHANNELS)), len(TERMS)), len(names))
    term = np.tile(np.arange(len(TERMS)), len(names) * len(CHANNELS))
    x = -5 + rng.standard_normal(len(log))
    levels = x[:, None] + 0.05 * np.sort(rng.standard_normal((len(log), 9)), axis=1)
    of = {
        "log": np.array(names)[log],
        "sha256": np.array([hashlib.sha256(name.encode()).hexdigest() for name in names])[log],
        "channel": np.array(CHANNELS)[channel],
        "kind": np.array(["rate", "acceleration"])[channel // 3],
        "family": np.array(["flicker", "gauss-markov"])[(term > 4).astype(int)],
        "term": np.array(TERMS)[term],
        "status": np.array(["upper_limit", "resolved"])[(term % 3 > 0).astype(int)],
        "estimate": np.exp(x),
        "lower": np.exp(x - 0.1),
        "upper": np.exp(x + 0.1),
        "unit_of_measure": np.array(["rad", "rad/s/√Hz", "rad/s", "rad/s/√s", "rad/s²", "rad/s", "s"])[term],
        "p": rng.random(len(log)),
        "profile": levels.astype(np.float32).tolist(),
        "root_at_zero": np.full(len(log), -np.inf, dtype=np.float32),
        "findings": [["gap", "quantized"][: i % 3] for i in log.tolist()],
        "span": 3600 + rng.random(len(names))[log],
        "samples": 360_000 + log,
        "seconds": 5 + rng.random(len(names))[log],
        "version": np.full(len(log), "0.1.0"),
        "_stamp": np.array([f"28000000 17{i:012d}" for i in logs])[log],
        "_key": np.full(len(log), "0123456789abcdef"),
        "_temperature": 20 + rng.random(len(names))[log],
        "_start": np.full(len(log), "2026-10-02T08:30:00"),
    }
    columns = folders._OF_PART
    arrays = [pa.array(of[c.name], arrow_type(c.type)) if c.name in of else None for c in columns]
    nulls = [pa.nulls(len(log), arrow_type(c.type)) for c in columns]
    return pa.table(
        [n if a is None else a for a, n in zip(arrays, nulls, strict=True)], [c.name for c in columns]
    )


def make_parts(fleet: Path, logs: int) -> None:
    """What a run leaves that is killed before its end."""
    parts = fleet / ".fleet" / "parts"
    parts.mkdir(parents=True)
    for first in range(0, logs, PART):
        place = parts / f"{first + PART - 1:09d}.merged.parquet"
        pq.write_table(part(range(first, min(first + PART, logs)), first), place, compression="zstd")


def step(fleet: Path, what: str, logs: int) -> dict[str, float]:
    """Processor time [s] and peak of memory [MB] of this process, which writes the table."""
    more = [
        part(range(logs + 997 * i, logs + 997 * i + 1), i).to_pylist() for i in range(10 * (what == "more"))
    ]
    began = time.process_time()
    with (done := FleetFolder(fleet)).locked():
        for rows in more:
            done.commit(rows)
        done.compact(LogLabels(PATTERN))
    seconds = time.process_time() - began
    return {"seconds": seconds, "megabytes": peak_bytes() / 2**20}


def measured(logs: int) -> dict[str, Any]:
    """All steps, and the size of the table [MB]."""
    with tempfile.TemporaryDirectory() as folder:
        fleet = Path(folder) / "fleet"
        make_parts(fleet, logs)
        made: dict[str, Any] = {}
        for name, what in STEPS.items():
            made[name] = result_of("fleet_table", "--logs", str(logs), "--step", what, str(fleet))
        files = [*(fleet / "fleet.parquet").iterdir()]
        made["size"] = sum(file.stat().st_size for file in files) / 1e6
        made["files"] = len(files)
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=100_000)
    parser.add_argument("--step", nargs=2, metavar=("WHAT", "FLEET"))
    given = parser.parse_args()
    if given.step:
        print(json.dumps(step(Path(given.step[1]), given.step[0], given.logs)))
        return
    made = measured(given.logs)
    rows = [[n, f"{made[n]['seconds']:.1f}", f"{made[n]['megabytes']:.0f}"] for n in STEPS]
    notes = [
        f"{given.logs} logs, {len(CHANNELS) * len(TERMS)} rows each",
        f"the table takes {made['size']:.0f} MB in {made['files']} files",
        "memory is the peak of the whole process, with what it knows of all logs; rows are simulated",
    ]
    result = {"machine": describe("pyarrow"), "logs": given.logs, **made, "notes": notes}
    head = ["step", "processor time [s]", "memory [MB]"]
    print(save("fleet_table", "Writing the table of a fleet", result, head, rows))


if __name__ == "__main__":
    main()
