# SPDX-License-Identifier: BSD-3-Clause
"""Where a command spends its processor time, in all of its threads.

    OMP_NUM_THREADS=1 python -m benchmarks.job_profile NAME ARGUMENT...

runs ``allanite ARGUMENT...`` under cProfile and writes the functions of allanite that take most, calls included, to
``benchmarks/profiles/NAME.txt``. The profiler itself adds some 30 %.
"""

from __future__ import annotations

import cProfile
import io
import pstats
import re
import sys
import threading
import time
from pathlib import Path

FOLDER = Path(__file__).parent / "profiles"
_LINES = 40
_PLACE = re.compile(r"\S*/allanite/(\S+\.py):\d+")


def profiled(arguments: list[str]) -> pstats.Stats:
    """Runs the command, and adds up what its threads did."""
    profiles = [cProfile.Profile(time.thread_time)]
    run = threading.Thread.run

    def traced(thread: threading.Thread) -> None:
        profiles.append(cProfile.Profile(time.thread_time))
        profiles[-1].runcall(run, thread)

    threading.Thread.run = traced  # type: ignore[method-assign]
    from allanite.__main__ import main

    sys.argv = ["allanite", *arguments]
    try:
        profiles[0].runcall(main)
    except SystemExit as end:
        if end.code:
            raise
    threads = [t for t in threading.enumerate() if t is not threading.current_thread()]
    for thread in threads:
        thread.join(5)
    total = pstats.Stats(profiles[0])
    for profile in profiles[1:]:
        total.add(profile)
    return total


def written(stats: pstats.Stats, arguments: list[str]) -> str:
    """The command and the functions of allanite, the largest first."""
    text = io.StringIO()
    stats.stream = text  # type: ignore[attr-defined]
    stats.sort_stats("cumulative").print_stats(r"/allanite/")
    rows = [_PLACE.sub(r"\1 ", line) for line in text.getvalue().splitlines() if _PLACE.search(line)]
    head = f"allanite {' '.join(arguments)}\n{stats.total_tt:.1f} s under the profiler\n\n"  # type: ignore[attr-defined]
    return (
        head + "   ncalls  tottime  percall  cumtime  percall  function\n" + "\n".join(rows[:_LINES]) + "\n"
    )


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{sys.argv[1]}.txt").write_text(
        written(profiled(sys.argv[2:]), sys.argv[2:]), encoding="utf-8"
    )
