# SPDX-License-Identifier: BSD-3-Clause
"""What it costs: seconds and memory of a week at 32 Hz, and what becomes of a file of a billion samples.

    python -m verification.scoreboard.cost NAME FILE MEMORY COUNT

Each contender runs in a process of its own. The week is the same array for all, 100 log-spaced lags, the best of the
rounds; the billion float32 samples (2.5 V, 1 mV of white noise) lie in a .npy file that is mapped, octave lags, and the
process may allocate 16 GiB, not a byte more.
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import resource
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["run_billion", "run_week"]

Json = dict[str, Any]
Array = NDArray[np.float64]
Lags = NDArray[np.int64]
Say = Callable[[str], None]

WEEK, BILLION = 19_353_600, 1_000_000_000
#: Bytes that a process may allocate on the billion samples.
MEMORY = 16 << 30
ROUNDS = 2


def log_lags(n: int, count: int = 100) -> Lags:
    return np.unique(np.round(np.geomspace(1, n // 10, count)).astype(np.int64))


def octaves(n: int) -> Lags:
    return 1 << np.arange((n // 10).bit_length())


# -- contenders: samples and lags in, deviation out ------------------------------------------------------------------


def _allantools(y: NDArray[Any], lags: Lags) -> Array:
    from allantools import oadev

    return np.asarray(oadev(y, rate=1.0, data_type="freq", taus=lags)[1])


def _avar(y: NDArray[Any], lags: Lags) -> Array:
    """In float64 and without its mean: in float32 the running sum loses the noise."""
    import avar

    z = np.asarray(y, dtype=np.float64)
    return np.asarray(np.sqrt(avar.variance(z - z.mean(), lags)))


def _allan_variance(y: NDArray[Any], lags: Lags) -> Array:
    """Its own log grid of as many lags."""
    from allan_variance import compute_avar

    return np.asarray(
        np.sqrt(compute_avar(y, tau_min=int(lags[0]), tau_max=int(lags[-1]), n_clusters=len(lags))[1])
    )


def _allanite(y: NDArray[Any], lags: Lags, threads: int = 1) -> Array:
    import allanite as al

    record = al.Recording.from_rate(y, rate=1.0, unit="V")
    curve = al.allan_curve(record, taus=lags.astype(np.float64), threads=threads)
    return np.asarray(curve.deviation[:, 0])


CONTENDERS: dict[str, tuple[str, Callable[[NDArray[Any], Lags], Array]]] = {
    "allantools": ("allantools", _allantools),
    "avar": ("avar", _avar),
    "allan-variance": ("allan-variance", _allan_variance),
    "allanite": ("allanite", _allanite),
    "allanite, 2 threads": ("allanite", lambda y, lags: _allanite(y, lags, threads=2)),
}


def _able() -> list[str]:
    from importlib.metadata import PackageNotFoundError, version

    found = []
    for name, (package, _) in CONTENDERS.items():
        with contextlib.suppress(PackageNotFoundError):
            if version(package):
                found.append(name)
    return found


# -- in a process of its own -------------------------------------------------------------------------------------------


def _here(name: str, path: Path, memory: int, count: int) -> Json:
    """Seconds and peak memory of one call in this process; `count` log-spaced lags, 0: octaves."""
    call = CONTENDERS[name][1]
    few = np.random.default_rng(1).standard_normal(4096)
    with contextlib.redirect_stdout(io.StringIO()):
        call(few, octaves(4096))  # imports and first call are not timed
    before = _allocated()
    if memory:
        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    y = np.load(path, mmap_mode="r" if memory else None)
    lags = log_lags(len(y), count) if count else octaves(len(y))
    watch = _Watch()
    begun = time.perf_counter()
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            sigma = call(y, lags)
    except MemoryError as failure:
        return {
            "seconds": time.perf_counter() - begun,
            "failure": str(failure).split(" for")[0] or "MemoryError",
        }
    seconds, peak = time.perf_counter() - begun, watch.stop()
    short = lags <= max(len(y) // 100_000, 1)  # where chance is below a percent
    error = np.abs(sigma[: short.sum()] * np.sqrt(lags[short]) / 1e-3 - 1)
    return {
        "seconds": seconds,
        "memory": peak - before,
        "lags": len(sigma),
        "error": float(np.max(error)),
    }


class _Watch(threading.Thread):
    """The highest memory that the process allocates; pages of the mapped file, which the system may drop, left out."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self._done, self._highest = threading.Event(), 0
        self.start()

    def run(self) -> None:
        while not self._done.wait(0.01):
            self._highest = max(self._highest, _allocated())

    def stop(self) -> int:
        self._done.set()
        self.join()
        return max(self._highest, _allocated())


def _allocated() -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("RssAnon:"):
            return 1024 * int(line.split()[1])
    return 0


def _apart(name: str, path: Path, memory: int = 0, count: int = 0) -> Json:
    command = [sys.executable, "-m", __spec__.name, name, str(path), str(memory), str(count)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        return {"seconds": math.nan, "failure": f"ended with {done.returncode}: {done.stderr.strip()[-80:]}"}
    return dict(json.loads(done.stdout))


# -- the two tables ----------------------------------------------------------------------------------------------------


def run_week(n: int, say: Say, folder: Path) -> list[Json]:
    """Seconds of n float64 samples, the best of the rounds, and peak memory over the size of the samples."""
    path = folder / "scoreboard-week.npy"
    np.save(path, 2.5 + 1e-3 * np.random.default_rng(8).standard_normal(n))
    best: dict[str, Json] = {}
    for _ in range(ROUNDS):
        for name in _able():
            run = _apart(name, path, count=100)
            if name not in best or run["seconds"] < best[name]["seconds"]:
                best[name] = run
    path.unlink()
    say(f"scoreboard, a week at 32 Hz: {n} samples")
    return [
        {
            "tool": name,
            "samples": n,
            "lags": run.get("lags"),
            "seconds": run["seconds"],
            "memory_over_samples": run["memory"] / (8 * n) if "memory" in run else None,
        }
        for name, run in best.items()
    ]


def run_billion(n: int, say: Say, folder: Path) -> list[Json]:
    """n float32 samples from a file, 16 GiB to allocate: seconds, memory, or how it failed."""
    path = folder / "scoreboard-billion.npy"
    out = np.lib.format.open_memmap(path, mode="w+", dtype=np.float32, shape=(n,))
    rng = np.random.Generator(np.random.SFC64(9))
    for start in range(0, n, 1 << 22):
        out[start : start + (1 << 22)] = 2.5 + 1e-3 * rng.standard_normal(min(1 << 22, n - start))
    del out
    rows = []
    for name in _able():
        if name.endswith("2 threads"):
            continue  # one pass over the file is one thread
        run = _apart(name, path, memory=MEMORY)
        rows.append(
            {
                "tool": name,
                "samples": n,
                "outcome": f"fails: {run['failure']}" if "failure" in run else "done",
                "seconds": run["seconds"],
                "memory_GiB": run["memory"] / 2**30 if "memory" in run else None,
                "largest_error_at_short_lags": run.get("error"),
            }
        )
        say(f"scoreboard, {n} samples from a file, {name}: {rows[-1]['outcome']}")
    path.unlink()
    return rows


if __name__ == "__main__":
    given = sys.argv[1:]
    print(json.dumps(_here(given[0], Path(given[1]), int(given[2]), int(given[3]))))
