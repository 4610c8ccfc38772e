# SPDX-License-Identifier: BSD-3-Clause
"""`allanite characterize` on a week of a six-axis sensor at 32 Hz, from a Parquet file to the report.

    python -m benchmarks.characterize_speed [FOLDER]

The log is simulated into a temporary folder inside FOLDER (default: the working directory).
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from allanite import simulate
from allanite.noise import NoiseModel, RandomWalk, White

from .machine import describe, save

RATE = 32.0
DURATION = 604_800.0
GYRO = NoiseModel(terms=(White(N=2e-4), RandomWalk(K=1e-6)))
ACCELEROMETER = NoiseModel(terms=(White(N=1e-3), RandomWalk(K=1e-5)))


def write_log(path: Path) -> int:
    """Six columns of float32 with their units in the names, and time stamps in nanoseconds."""
    columns, n = {}, round(RATE * DURATION)
    columns["time"] = pa.array((np.arange(n) * (1e9 / RATE)).astype(np.int64), pa.timestamp("ns"))
    for i, axis in enumerate("xyz"):
        for name, model in ((f"gyro_{axis} [rad/s]", GYRO), (f"acc_{axis} [m/s^2]", ACCELEROMETER)):
            record = simulate(model, rate=RATE, duration=DURATION, seed=i)
            columns[name] = pa.array(record.values(record.names[0]).astype(np.float32))
    pq.write_table(pa.table(columns), path, compression="zstd")
    return n


def main(folder: Path) -> None:
    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        log = Path(temporary) / "week.parquet"
        n = write_log(log)
        size = log.stat().st_size
        command = [
            sys.executable,
            "-m",
            "allanite",
            "characterize",
            str(log),
            "--out",
            str(Path(temporary) / "out"),
        ]
        start = time.perf_counter()
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        seconds = time.perf_counter() - start
    if done.returncode:
        raise SystemExit(
            f"characterize failed with exit code {done.returncode}\n{done.stdout}\n{done.stderr}"
        )
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
    result = {
        "machine": describe("pyarrow"),
        "n_samples": n,
        "n_channels": 6,
        "seconds": seconds,
        "memory_gib": memory,
        "notes": [
            f"{n} samples of 6 float32 channels, {size / 2**20:.0f} MiB of Parquet; every file of the output written"
        ],
    }
    rows = [["allanite characterize", f"{seconds:.1f}", f"{memory:.2f}"]]
    header = ["command", "seconds", "memory of the process, GiB"]
    print(
        save("characterize_speed", "A week of six axes at 32 Hz, from file to report", result, header, rows)
    )


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
