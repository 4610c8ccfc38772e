# SPDX-License-Identifier: BSD-3-Clause
"""The jobs that users wait for, beside what is wanted of them, beside other tools, and beside the last commit.

    python -m benchmarks.jobs [--rounds N] [--only PATTERN] [--records FOLDER]

Each job is a fresh process with one thread for linear algebra. Processor seconds are those of the process, its threads
and its children; they say more than the clock on a machine that does something else as well. A command counts from
its start, a filter or simulation once its modules are imported, a reading with the modules that it loads. Jobs and
peers take turns in rounds; of each the round with the least processor time counts; the table shows the most as well.

Machines differ, so a job is compared with its last commit by its ratio to a reference: a fixed task of the
interpreter, of FFTs, of sorting and of sums over memory, that runs before and after each job. The ratio is the median
of the rounds. One that looks 15 % larger than that in `HEAD` is measured in as many rounds again, and is red if it
still is. A new version of Python or NumPy moves job and reference differently: the first table after one tells little.

Where a job takes 15 % more than wanted, the last column says of what: its parts under the profiler, scaled to its
processor time. A part is a room of allanite with the library functions that it calls, and in brackets its modules or
functions that take most; "imports" are of all modules, of other packages too.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

from . import job_calls as calls
from .job_calls import STRETCH, WEEK, Call
from .machine import RESULTS, describe, save
from .processes import peak_bytes, spent

Json = dict[str, Any]
TITLE = "The jobs that users wait for"
TOLERANCE = 0.15
_NPY = ("--rate", "32", "--unit", "rad/s")
_OUT = ("--out", "out", "--force")
#: The last column names rooms until they make up so much of the job, and in them what takes so much of it.
_NAMED, _WORTH = 0.92, 0.05


@dataclass(frozen=True, kw_only=True)
class Job:
    """One row of the table, or a peer beside one.

    `command` follows ``allanite``, in the folder of the records, `python` follows the interpreter; otherwise `call` is
    what a process of this module does. `per` samples make the unit nanoseconds per sample. `wanted` is in the unit,
    with `than` as a multiple of that peer. `size` is a file whose size [MB] is the value.
    """

    name: str
    command: tuple[str, ...] = ()
    python: tuple[str, ...] = ()
    call: Call | None = None
    records: tuple[str, ...] = ()
    per: int = 0
    wanted: float | None = None
    than: str = ""
    memory: float | None = None
    size: str = ""
    beside: str = ""
    needs: str = ""

    @property
    def unit(self) -> str:
        return "MB" if self.size else "ns" if self.per else "s"


# ---- the table ------------------------------------------------------------------------------------------------------


def _oadev(load: str) -> tuple[str, ...]:
    """The Allan deviation alone, at as many lags as a report has."""
    lags = "lags = np.unique(np.round(np.geomspace(1, len(y) // 3, 100)).astype(int))"
    return "-c", f"import allantools, numpy as np; y = {load}; {lags}; allantools.oadev(y, 1.0, 'freq', lags)"


def _filtering(name: str, *, flicker: bool, wanted: float) -> tuple[Job, ...]:
    """The filter of a week, and of a stretch by other tools."""
    peers = {
        "statsmodels": calls.filtering_by_statsmodels(flicker),
        "FilterPy": calls.filtering_by_filterpy(flicker),
    }
    return (
        Job(name=name, call=calls.filtering(flicker), per=WEEK, wanted=wanted),
        Job(name="allanite, likelihood alone", beside=name, call=calls.likelihood(flicker), per=WEEK),
        *(
            Job(name=peer, beside=name, needs=peer.lower(), call=call, per=STRETCH)
            for peer, call in peers.items()
        ),
    )


def _loading(name: str) -> Job:
    """What a command cannot do without, before its first line."""
    loaded = "import click, numpy, pyarrow.csv"
    return Job(name="Click, NumPy and Arrow loaded", beside=name, python=("-c", loaded))


def _characterizing(name: str, file: str, wanted: float, memory: float | None = None) -> tuple[Job, ...]:
    """A file, and what any program that names the file by its hash does with it."""
    return (
        Job(name=name, command=("characterize", file, *_OUT), records=(file,), wanted=wanted, memory=memory),
        Job(
            name="SHA-256 and Arrow, file alone",
            beside=name,
            needs="pyarrow",
            call=calls.hashing_and_reading(file),
            records=(file,),
        ),
    )


def _compare(n: int, wanted: float | None = None, memory: float | None = None) -> Job:
    command = ("compare", *(f"curves/{i:03d}.csv" for i in range(n)))
    name = f"compare, {n} curves of 1 h"
    return Job(name=name, command=command, records=("curves",), wanted=wanted, memory=memory)


_INFO, _HOUR, _JSON = "info, 1 h, CSV", "characterize, 1 h, CSV", "characterize --json, 1 h, CSV"
_WEEK_NPY = "characterize, week, NumPy"
_ROWS = "read, 20 million rows, CSV"
JOBS: tuple[Job, ...] = (
    Job(name="import allanite", python=("-c", "import allanite"), wanted=0.25),
    Job(name="allanite --help", command=("--help",), wanted=0.2),
    Job(name=_INFO, command=("info", "hour.csv"), records=("hour.csv",), wanted=0.4),
    _loading(_INFO),
    Job(name=_HOUR, command=("characterize", "hour.csv", *_OUT), records=("hour.csv",), wanted=1.2),
    Job(
        name="AllanTools, curve alone",
        beside=_HOUR,
        needs="allantools",
        records=("hour.csv",),
        python=_oadev("np.loadtxt('hour.csv', skiprows=1, delimiter=',')[:, 1]"),
    ),
    Job(name=_JSON, command=("characterize", "hour.csv", "--json"), records=("hour.csv",), wanted=0.6),
    _loading(_JSON),
    Job(
        name="report, one channel",
        command=("report", "study.json", "-o", "report.html", "--force"),
        records=("study.json",),
        wanted=0.3,
    ),
    Job(name="report, one channel: its file", size="report.html", wanted=1.5),
    Job(
        name=_WEEK_NPY,
        command=("characterize", "week.npy", *_NPY, *_OUT),
        records=("week.npy",),
        wanted=3.0,
    ),
    Job(
        name="AllanTools, curve alone",
        beside=_WEEK_NPY,
        needs="allantools",
        records=("week.npy",),
        python=_oadev("np.load('week.npy')"),
    ),
    *_characterizing("characterize, week, Parquet", "week.parquet", 4.0),
    *_characterizing("characterize, week, CSV", "week.csv", 7.0),
    *_characterizing("characterize, week of six axes, Parquet", "six.parquet", 15.0, 512.0),
    Job(name="select, week", command=("select", "week.npy", *_NPY), records=("week.npy",), wanted=8.0),
    Job(
        name="fit --method likelihood, week",
        command=("fit", "week.npy", *_NPY, "--method", "likelihood"),
        records=("week.npy",),
        wanted=6.0,
    ),
    Job(
        name="compare, 20 logs of 1 h",
        command=("compare", *(f"hours/{i:03d}.npy" for i in range(20)), *_NPY),
        records=("hours",),
    ),
    _compare(20),
    _compare(40),
    _compare(200, wanted=15.0, memory=300.0),
    *_filtering("filter, week, white + walk", flicker=False, wanted=20.0),
    *_filtering("filter, week, with flicker", flicker=True, wanted=60.0),
    Job(name="filter, a gap each minute, white + walk", call=calls.filtering(False, 1920), per=WEEK // 4),
    Job(name="filter, a gap each minute, with flicker", call=calls.filtering(True, 1920), per=WEEK // 4),
    Job(name="simulate, week, white", call=calls.simulating(False, False), per=WEEK),
    Job(name="NumPy, normal numbers", beside="simulate, week, white", call=calls.drawing_by_numpy, per=WEEK),
    Job(name="simulate, week, white + walk", call=calls.simulating(False, True), per=WEEK),
    Job(name="simulate, week, with flicker", call=calls.simulating(True, True), per=WEEK, wanted=40.0),
    Job(
        name="AllanTools, 1/f by 80 octaves",
        beside="simulate, week, with flicker",
        needs="allantools",
        call=calls.simulating_by_allantools,
        per=STRETCH,
    ),
    Job(name=_ROWS, call=calls.reading("rows.csv"), records=("rows.csv",), wanted=1.1, than="pyarrow.csv"),
    Job(
        name="pyarrow.csv", beside=_ROWS, needs="pyarrow", call=calls.reading_by_arrow, records=("rows.csv",)
    ),
    Job(name="polars", beside=_ROWS, needs="polars", call=calls.reading_by_polars, records=("rows.csv",)),
    Job(
        name="read, 20 million rows, Parquet",
        call=calls.reading("rows.parquet"),
        records=("rows.parquet",),
        wanted=2.0,
    ),
)
_REFERENCE = Job(name="reference", call=calls.reference)


# ---- measuring ------------------------------------------------------------------------------------------------------


def called(call: Call, folder: Path) -> Json:
    """What a function takes in this process."""
    prepared = call(folder)
    wall, cpu = time.perf_counter(), _processor_seconds()
    prepared()
    cpu, wall = _processor_seconds() - cpu, time.perf_counter() - wall
    return {"cpu": cpu, "wall": wall, "memory": peak_bytes() / 2**20}


def _processor_seconds() -> float:
    child = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + child.ru_utime + child.ru_stime


def measured(job: Job, folder: Path) -> Json:
    """One run of a job: processor and clock seconds, MiB, and the value in its unit."""
    if job.size:
        return {"value": (folder / job.size).stat().st_size / 1e6}
    if job.call:
        run = _of_process("jobs", "--call", str(_all().index(job)), "--records", str(folder))
    else:
        python = job.python or ("-m", "allanite", *job.command)
        run = spent([sys.executable, *python], folder)
    run = {key: run[key] for key in ("cpu", "wall", "memory")}
    return {**run, "value": run["cpu"] * (1e9 / job.per if job.per else 1.0)}


def _all() -> tuple[Job, ...]:
    return (*JOBS, _REFERENCE)


def _of_process(module: str, *arguments: str, folder: Path | None = None) -> Any:
    output = spent([sys.executable, "-m", f"benchmarks.{module}", *arguments], folder or Path())["output"]
    return json.loads(output.splitlines()[-1])


def rounds_of(jobs: Sequence[Job], folder: Path, rounds: int, runs: dict[Job, list[Json]]) -> None:
    """Run the jobs in turns, between runs of the reference; `runs` gains theirs."""
    for _ in range(rounds):
        before = measured(_REFERENCE, folder)["cpu"]
        for job in jobs:
            run = measured(job, folder)
            after = measured(_REFERENCE, folder)["cpu"]
            scale = 1.0 if job.size else (before + after) / 2
            runs.setdefault(job, []).append({**run, "ratio": run["value"] / scale})
            before = after
            print(f"{key_of(job)}: {run['value']:.3g} {job.unit}", file=sys.stderr, flush=True)


def row_of(job: Job, runs: Sequence[Json]) -> Json:
    """What the runs of a job say together."""
    best = min(runs, key=lambda run: float(run["value"]))
    memory = {"memory": max(run["memory"] for run in runs)} if "memory" in best else {}
    return {
        "unit": job.unit,
        **best,
        **memory,
        "most": max(run["value"] for run in runs),
        "ratio": statistics.median(run["ratio"] for run in runs),
        "rounds": len(runs),
    }


def grown(ratio: float, last: float | None) -> bool:
    """Whether a job takes more, beside the reference, than the tolerance allows."""
    return last is not None and ratio > (1 + TOLERANCE) * last


def wanted_value(job: Job, rows: dict[str, Json]) -> float | None:
    """What a row may take, in its unit; a multiple of a peer that is not installed is unknown."""
    if not job.than or job.wanted is None:
        return job.wanted
    peer = rows.get(f"{job.name}: {job.than}")
    return job.wanted * peer["value"] if peer else None


def exceeds(job: Job, rows: dict[str, Json]) -> bool:
    wanted = wanted_value(job, rows)
    return wanted is not None and rows[job.name]["value"] > (1 + TOLERANCE) * wanted


def parts_of(job: Job, folder: Path) -> list[tuple[str, float]]:
    """Shares of the processor time of a job, the largest first."""
    if job.call:
        which = ("--parts", str(JOBS.index(job)), "--records", str(folder))
        return [tuple(part) for part in _of_process("jobs", *which)]
    return [tuple(part) for part in _of_process("job_profile", "--parts", *job.command, folder=folder)]


def parts_here(call: Call, folder: Path) -> list[tuple[str, float]]:
    """The same of a function, in this process, by functions."""
    from .job_profile import parts, profiled

    return parts(profiled(call(folder)), functions=True)


# ---- words ----------------------------------------------------------------------------------------------------------


def key_of(job: Job) -> str:
    return f"{job.beside}: {job.name}" if job.beside else job.name


def by_room(parts: Sequence[tuple[str, float]]) -> list[Json]:
    """The rooms that make up most of a job, what is large within them, and the others as one."""
    rooms: dict[str, list[tuple[str, float]]] = {}
    for name, share in parts:
        imported = name.startswith(("import ", "lazy_dataclasses"))
        room = "imports" if imported else ".".join(name.split(".")[:-1][:2]) or name
        within = name.removeprefix("import ") if imported else name.removeprefix(room).removeprefix(".")
        rooms.setdefault(room, []).append((within, share))
    rows = [
        {
            "name": room,
            "share": sum(share for _, share in inside),
            "within": [(name, share) for name, share in inside if name and share >= _WORTH],
        }
        for room, inside in rooms.items()
    ]
    rows.sort(key=lambda row: -float(row["share"]))
    named = 1 + sum(before < _NAMED for before in accumulate(row["share"] for row in rows))
    others = rows[named:]
    rest = {"name": f"{len(others)} others", "share": sum(row["share"] for row in others), "within": []}
    return [*rows[:named], rest] if others else rows


def reason(row: Json) -> str:
    """The parts of a job in its unit: "imports 0.50 s (numpy 0.31 s), fitting 0.40 s, 12 others 0.10 s"."""

    def amount(name: str, share: float) -> str:
        return f"{name} {_amount(share * row['value'], row['unit'])}"

    words = []
    for part in row.get("parts", []):
        within = ", ".join(amount(*inner) for inner in part["within"])
        words.append(amount(part["name"], part["share"]) + (f" ({within})" if within else ""))
    return ", ".join(words)


def change(row: Json, last: float | None) -> str:
    """By how much the ratio to the reference changed since the last commit; bold where it grew too much."""
    if last is None:
        return "new"
    words = f"{100 * (row['ratio'] / last - 1):+.0f} %"
    return f"**{words}**" if grown(row["ratio"], last) else words


def table(
    rows: dict[str, Json], last: dict[str, float], jobs: Sequence[Job] = JOBS
) -> tuple[list[str], list[list[str]]]:
    """Header and cells."""
    header = [
        "job",
        "wanted",
        "processor time",
        "clock",
        "memory [MiB]",
        "others",
        "since last commit",
        "consists of",
    ]
    cells = [_cells(job, rows, last, jobs) for job in jobs if not job.beside and job.name in rows]
    return header, cells


def _cells(job: Job, rows: dict[str, Json], last: dict[str, float], jobs: Sequence[Job]) -> list[str]:
    row = rows[job.name]
    peers = [peer for peer in jobs if peer.beside == job.name and key_of(peer) in rows]
    return [
        job.name,
        _wanted(job, rows),
        _range(row),
        _amount(row["wall"], "s") if "wall" in row else "",
        _memory(row),
        "; ".join(
            f"{peer.name} {_range(rows[key_of(peer)])}, {_memory(rows[key_of(peer)])} MiB" for peer in peers
        ),
        change(row, last.get(job.name)),
        reason(row),
    ]


def _memory(row: Json) -> str:
    return f"{row['memory']:.0f}" if "memory" in row else ""


def _wanted(job: Job, rows: dict[str, Json]) -> str:
    value = wanted_value(job, rows)
    words = [] if value is None else [_amount(value, job.unit)]
    words += [f"{job.wanted} × {job.than}"] if job.than else []
    words += [f"{job.memory:.0f} MiB"] if job.memory else []
    return ", ".join(words)


def _range(row: Json) -> str:
    least, most = (_amount(row[key], row["unit"]) for key in ("value", "most"))
    return least if least == most else f"{least.removesuffix(' ' + row['unit'])} to {most}"


def _amount(value: float, unit: str) -> str:
    """With three digits or so, two decimals at most."""
    digits = 0 if value >= 100 else 1 if value >= 10 else 2
    return f"{value:.{digits}f} {unit}"


def reddened(text: str) -> str:
    """The lines of a table that have something bold, in red."""
    return re.sub(r"^\|.*\*\*.*$", "\033[31m\\g<0>\033[0m", text, flags=re.M)


def last_committed() -> dict[str, float]:
    """Ratios of the table in HEAD; none where there is none. A single round does not tell how it scatters."""
    place = f"HEAD:./{(RESULTS / 'jobs.json').name}"
    done = subprocess.run(["git", "show", place], cwd=RESULTS, capture_output=True, text=True, check=False)
    rows = json.loads(done.stdout)["jobs"] if done.returncode == 0 else {}
    return {name: row["ratio"] for name, row in rows.items() if row["rounds"] > 1}


def measure_all(jobs: Sequence[Job], folder: Path, rounds: int, last: dict[str, float]) -> dict[str, Json]:
    """Rows by their names; those that look grown are measured again, those that take too long are taken apart."""
    runs: dict[Job, list[Json]] = {}
    rounds_of(jobs, folder, rounds, runs)
    rounds_of(
        [job for job in jobs if grown(row_of(job, runs[job])["ratio"], last.get(key_of(job)))],
        folder,
        rounds,
        runs,
    )
    rows = {key_of(job): row_of(job, runs[job]) for job in jobs}
    for job in jobs:
        if not job.size and not job.python and exceeds(job, rows):
            rows[job.name]["parts"] = by_room(parts_of(job, folder))
    return rows


def main(given: argparse.Namespace | None = None) -> None:
    given = given or _parser().parse_args([])
    absent = sorted({job.name for job in JOBS if job.needs and not importlib.util.find_spec(job.needs)})
    chosen = [job for job in JOBS if re.search(given.only, key_of(job)) and job.name not in absent]
    last = last_committed()
    with tempfile.TemporaryDirectory() as temporary:
        folder = (given.records or Path(temporary)).resolve()
        make_records(folder, chosen)
        rows = measure_all(chosen, folder, given.rounds, last)
    red = [name for name, row in rows.items() if grown(row["ratio"], last.get(name))]
    rows = {**_kept(given.only), **rows}
    rounds = sorted({row["rounds"] for row in rows.values()})
    notes = [
        f"processor time: least to most of the rounds ({' or '.join(map(str, rounds))}); clock: that of the least",
        "memory: the most of any round, of the whole process",
        f"since last commit: ratio to a reference task, bold beyond {TOLERANCE:.0%}; new after a table of one round",
        f"others filter and simulate {STRETCH} samples; AllanTools computes the curve alone, at 100 averaging times",
    ]
    notes += [f"not installed: {', '.join(absent)}"] if absent else []
    result = {"machine": describe("pyarrow", "scipy"), "jobs": rows, "notes": notes}
    print(reddened(save("jobs", TITLE, result, *table(rows, last))))
    print(f"{len(red)} grew by more than {TOLERANCE:.0%}{': ' if red else ''}{', '.join(red)}")


def _kept(only: str) -> dict[str, Json]:
    """Rows of the table that some jobs are measured again for."""
    place = RESULTS / "jobs.json"
    rows = json.loads(place.read_text())["jobs"] if only and place.exists() else {}
    return {key_of(job): rows[key_of(job)] for job in JOBS if key_of(job) in rows}


def make_records(folder: Path, jobs: Iterable[Job]) -> None:
    """Write the records of some jobs that the folder does not have yet, each in a process of its own."""
    for name in dict.fromkeys(name for job in jobs for name in job.records):
        if not (folder / name).exists():
            spent([sys.executable, "-m", "benchmarks.records", str(folder), name])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Measure the jobs that users wait for.")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument(
        "--only", default="", metavar="PATTERN", help="jobs with this in their names; others are kept"
    )
    parser.add_argument("--records", type=Path, help="keep the records here (5 GB)")
    parser.add_argument("--call", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--parts", type=int, help=argparse.SUPPRESS)
    return parser


if __name__ == "__main__":
    options = _parser().parse_args()
    if options.call is not None:
        print(json.dumps(called(_all()[options.call].call, options.records)))  # type: ignore[arg-type]
    elif options.parts is not None:
        print(json.dumps(parts_here(JOBS[options.parts].call, options.records)))  # type: ignore[arg-type]
    else:
        main(options)
