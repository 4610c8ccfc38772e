# SPDX-License-Identifier: BSD-3-Clause
"""Contenders of a benchmark in processes of their own, so that none finds memory or caches that another left."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from collections.abc import Iterable
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


def resident_bytes() -> int:
    """Memory of this process now."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


def peak_bytes() -> int:
    """The most memory that this process has had; `ru_maxrss` would begin with that of its parent."""
    status = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))
