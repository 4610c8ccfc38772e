# SPDX-License-Identifier: BSD-3-Clause
"""Contenders of a benchmark in processes of their own, so that none finds memory or caches that another left."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

Run = dict[str, Any]


def best_runs(module: str, names: Iterable[str], rounds: int, least: str) -> dict[str, Run]:
    """In interleaved rounds, so that a busy moment of the machine does not decide: of each the run with the least."""
    order, best = list(names), dict[str, Run]()
    for _ in range(rounds):
        for name in order:
            run = result_of(module, name)
            if name not in best or run[least] < best[name][least]:
                best[name] = run
    return best


def result_of(module: str, *arguments: str) -> Run:
    """What a benchmark prints as JSON when it is started with these arguments."""
    command = [sys.executable, "-m", f"benchmarks.{module}", *arguments]
    return dict(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))


def spent(command: Sequence[str], folder: Path = Path(), codes: Iterable[int] = (0,)) -> Run:
    """Seconds of processor and clock and the peak of memory [MiB] of a command, its children included.

    With what it wrote, as "output". The peak begins with the memory of this process, so it has to be small. `codes`
    are the exit codes of a success.
    """
    root = str(Path(__file__).resolve().parents[1])
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": root}
    environment["PYTHONDONTWRITEBYTECODE"] = ""  # users do not compile the modules in every run
    start = time.perf_counter()
    with tempfile.TemporaryFile() as file:
        process = subprocess.Popen(command, cwd=folder, env=environment, stdout=file, stderr=file)
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        file.seek(0)
        output = file.read().decode(errors="replace")
    if process.returncode not in codes:
        raise SystemExit(f"{' '.join(command)} failed with exit code {process.returncode}\n{output[-2000:]}")
    cpu = usage.ru_utime + usage.ru_stime
    return {"cpu": cpu, "wall": wall, "memory": usage.ru_maxrss / 1024, "output": output}


def resident_bytes() -> int:
    """Memory of this process now."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


def peak_bytes() -> int:
    """The most memory that this process has had; `ru_maxrss` would begin with that of its parent."""
    status = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))
