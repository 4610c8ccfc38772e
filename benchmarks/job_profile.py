# SPDX-License-Identifier: BSD-3-Clause
"""Where a command spends its processor time, in all of its threads.

    OMP_NUM_THREADS=1 python -m benchmarks.job_profile NAME ARGUMENT...

runs ``allanite ARGUMENT...`` under cProfile and writes the functions of allanite that take most, calls included, to
``benchmarks/profiles/NAME.txt``. The profiler itself adds some 30 %. With ``--parts`` in place of NAME it prints the
shares of the modules as JSON, each with the library functions that it calls and without other modules.
"""

from __future__ import annotations

import contextlib
import cProfile
import io
import json
import pstats
import re
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent / "profiles"
_LINES = 40
#: File, line and name.
Function = tuple[str, int, str]
_DEPTH = 30  # calls between a module and what is below it
_MODULE = re.compile(r"/allanite/(\S+)\.py$")
_PACKAGE = re.compile(r"(?:site-packages|src)/([^/]+)")
_PLACE = re.compile(r"\S*/allanite/(\S+\.py):\d+")


def profiled(job: Callable[[], object]) -> pstats.Stats:
    """Runs a job, and adds up what its threads did."""
    profiles = [cProfile.Profile(time.thread_time)]
    run = threading.Thread.run

    def traced(thread: threading.Thread) -> None:
        profiles.append(cProfile.Profile(time.thread_time))
        profiles[-1].runcall(run, thread)

    threading.Thread.run = traced  # type: ignore[method-assign]
    try:
        profiles[0].runcall(job)
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


def command(arguments: list[str]) -> None:
    """``allanite ARGUMENT...``, its imports included."""
    from allanite.__main__ import main

    sys.argv = ["allanite", *arguments]
    main()


def parts(stats: pstats.Stats, functions: bool = False) -> list[tuple[str, float]]:
    """Modules of allanite (or their functions) and imports of each package: their shares, the largest first.

    A function of a library counts where it was called from, in proportion to the time of the calls.
    """
    rows: dict[Function, Any] = stats.stats  # type: ignore[attr-defined]
    callers = {f: {g: called[3] for g, called in row[4].items()} for f, row in rows.items()}
    places = {f: place(f, functions) for f in rows}
    held = {f: Counter({name: 1.0} if name else {}) for f, name in places.items()}
    for _ in range(_DEPTH):
        held |= {f: _mixed(f, held, callers[f]) for f in rows if not places[f]}
    total: Counter[str] = Counter()
    for f, row in rows.items():
        for name, share in held[f].items():
            total[name] += share * row[2]
    whole = total.total() or 1.0
    return [(name, time / whole) for name, time in total.most_common()]


def place(function: Function, functions: bool = False) -> str:
    """The part to which a function belongs by itself; "" where its callers decide."""
    file, _, name = function
    if name == "<module>":
        package = _PACKAGE.search(file)
        return f"import {package[1].removesuffix('.py')}" if package else "import Python's"
    inside = _MODULE.search(file)
    module = inside[1].replace("/", ".").removesuffix(".__init__") if inside else ""
    return f"{module}.{name}" if module and functions else module


def _mixed(
    function: Function, held: dict[Function, Counter[str]], callers: dict[Function, float]
) -> Counter[str]:
    """What the callers of a function hold; finding a module that allanite asks for counts as the import of allanite."""
    mixed: Counter[str] = Counter()
    for caller, time_of_calls in callers.items():
        for name, share in held[caller].items():
            finds = function[2] == "_find_and_load" and not name.startswith("import ")
            mixed["import allanite" if finds else name] += share * time_of_calls
    whole = mixed.total()
    return Counter({name: time / whole for name, time in mixed.items()}) if whole else mixed


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
    name, *arguments = sys.argv[1:]
    with contextlib.redirect_stdout(io.StringIO()) if name == "--parts" else contextlib.nullcontext():
        stats = profiled(lambda: command(arguments))
    if name == "--parts":
        print(json.dumps(parts(stats)))
    else:
        FOLDER.mkdir(exist_ok=True)
        (FOLDER / f"{name}.txt").write_text(written(stats, arguments), encoding="utf-8")
