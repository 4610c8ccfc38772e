# SPDX-License-Identifier: BSD-3-Clause
"""A billion samples from disk (4 GB): one pass, less than 1 GB of memory, and no digits lost.

    python -m benchmarks.billion_samples [FOLDER] [SAMPLES]

The samples are whole numbers of 0.1 uV on 2.5 V: sums of their differences can be taken exactly, in integers. They are
written to a temporary file in FOLDER (default: the working directory), once as int32 counts and once as float32.
The engine reads each file in pieces, stops half-way, is saved, loaded and goes on; the sums from counts must equal the
exact ones. float32 at 2.5 V has steps of 0.24 uV, so there the noise is known only to its rounding.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels

from .machine import describe, save
from .processes import peak_bytes, result_of

CHUNK = 1 << 16
LEVEL = 25_000_000  # 2.5 V in steps of 0.1 uV
Lags = NDArray[np.int64]


def write(path: Path, n: int, dtype: str) -> None:
    """White noise of 10 counts on the offset, in pieces."""
    generator = np.random.Generator(np.random.SFC64(11))
    with path.open("wb") as file:
        for start in range(0, n, 1 << 22):
            counts = LEVEL + np.rint(10 * generator.standard_normal(min(1 << 22, n - start)))
            (counts.astype(np.int32) if dtype == "int32" else (1e-7 * counts).astype(np.float32)).tofile(file)


def octaves(n: int) -> Lags:
    return np.array([1 << k for k in range((n // 3).bit_length())], dtype=np.int64)


def engine(path: Path, dtype: str, n: int) -> dict[str, Any]:
    """Sums of squares from the online kernel, saved and loaded half-way."""
    plan = (octaves(n), 2, 64, 1024)
    n_numbers, n_counters = _kernels.online_allan_size(*plan)
    numbers, counters = np.zeros(n_numbers), np.zeros(n_counters, np.int64)
    offset = float(np.fromfile(path, dtype, 50_000).astype(np.float64).mean())
    start_time = time.perf_counter()
    for start in range(0, n, CHUNK):
        if start == n // CHUNK // 2 * CHUNK:
            saved = numbers.tobytes(), counters.tobytes()
            numbers, counters = (
                np.frombuffer(bytearray(saved[0])),
                np.frombuffer(bytearray(saved[1]), np.int64),
            )
        piece = np.fromfile(path, dtype, CHUNK, offset=4 * start)
        _kernels.online_allan_feed(numbers, counters, *plan, piece.astype(np.float64), offset)
    sums, counts = _kernels.online_allan_read(numbers, counters, *plan)
    return {
        "seconds": time.perf_counter() - start_time,
        "sums": sums.tolist(),
        "counts": counts.tolist(),
        "resident_gib": peak_bytes() / 2**30,
    }


def exact_sums(path: Path, n: int) -> list[int]:
    """The same sums in integers. From 128 samples on, each octave has the phase of the one before, decimated by two."""
    x = np.zeros(n + 1, np.int64)  # 8 GB for a billion: the oracle, not the engine
    np.cumsum(np.memmap(path, dtype=np.int32, mode="r"), out=x[1:])
    sums, lag = [], 1
    for m in octaves(n).tolist():
        if m >= 128:
            x, lag = x[::2], 64
        else:
            lag = m
        sums.append(sum(_squares(x, lag, i, 1 << 22) for i in range(0, len(x) - 2 * lag, 1 << 22)))
    return sums


def _squares(x: NDArray[np.int64], lag: int, start: int, length: int) -> int:
    stop = min(start + length, len(x) - 2 * lag)
    d = x[start + 2 * lag : stop + 2 * lag] - 2 * x[start + lag : stop + lag] + x[start:stop]
    high, low = np.divmod(d, 1 << 16)  # d² may pass 63 bits once summed
    return (int(np.dot(high, high)) << 32) + (int(np.dot(high, low)) << 17) + int(np.dot(low, low))


def main(folder: Path, n: int) -> None:
    runs = {}
    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        path = Path(temporary) / "samples"
        for dtype in ("float32", "int32"):
            write(path, n, dtype)
            runs[dtype] = result_of("billion_samples", "engine", str(path), dtype, str(n))
        exact = exact_sums(path, n)
    difference = max(abs(s / e - 1) for s, e in zip(runs["int32"]["sums"], exact, strict=True))
    for run in runs.values():
        run.pop("sums")
    result = {
        "machine": describe(),
        "n_samples": n,
        "runs": runs,
        "difference": difference,
        "notes": [
            f"{n} samples, {len(exact)} octave lags, one thread; the engine was saved and loaded half-way",
            f"largest relative difference of a sum from integer arithmetic (int32 file): {difference:.1e}",
        ],
    }
    rows = [
        [d, f"{r['seconds']:.1f}", f"{n / r['seconds'] / 1e6:.0f}", f"{r['resident_gib']:.2f}"]
        for d, r in runs.items()
    ]
    header = ["file", "seconds", "million samples per second", "memory of the process, GiB"]
    print(save("billion_samples", "A billion samples from disk", result, header, rows))


if __name__ == "__main__":
    if sys.argv[1:2] == ["engine"]:
        print(json.dumps(engine(Path(sys.argv[2]), sys.argv[3], int(sys.argv[4]))))
    else:
        main(
            Path(sys.argv[1] if len(sys.argv) > 1 else "."), int(sys.argv[2]) if len(sys.argv) > 2 else 10**9
        )
