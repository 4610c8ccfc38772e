# SPDX-License-Identifier: BSD-3-Clause
"""How time and memory of the commands grow with the samples, the channels and the records.

    python -m benchmarks.growth [--records FOLDER] [CASE...]

Each command that reads a record at rest, on float32 at 32 Hz: 1e5, 1e6, 1e7 and 1e8 samples, and 1, 10 and 100
channels (or records) of 1e5 samples. Named cases are measured again, the others are kept. The records take 8 GB.

The exponent is that of processor time between the two largest sizes, the time at the smallest taken off each and the
smallest size as well: a start-up of any length then leaves 1 for a time that grows with the samples. Its standard
uncertainty comes from the scatter of all runs that were repeated. Memory is flat where a sample more takes no byte.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .machine import RESULTS, describe, save
from .processes import spent

Json = dict[str, Any]

SIZES = (100_000, 1_000_000, 10_000_000, 100_000_000)
CHANNELS = (1, 10, 100)
BOUND = 1.05
PICTURE = Path(__file__).parents[1] / "docs" / "images" / "growth.png"
_MODEL = "N=0.73 deg/√h, B=15 deg/h, K=15 deg/h/√h"
_NPY = ("--rate", "32", "--unit", "rad/s")
_UNMEASURED = (
    "commands that read models, curves or studies (diff, dead-reckon, plan, export, overbound, report); runs (record, "
    "monitor, recover, compact); turned units (north, calibrate, rate-table); datasheet --log and fleet, which "
    "characterize each log; innovations, which reads the log of a filter"
)
#: Exit codes of a result: done, and done with missing samples.
_CODES = (0, 3)
_OUTPUT = ("--force", "-o", "written.parquet")


@dataclass(frozen=True, kw_only=True)
class Case:
    """A command; `record` names its log for n samples and c channels, "units" a folder of c logs."""

    command: tuple[str, ...]
    record: str = "columns-{n}-{c}.npy"
    options: tuple[str, ...] = _NPY
    fewest: int = 1
    channels: tuple[int, ...] = CHANNELS
    remark: str = ""

    def arguments(self, n: int, channels: int) -> list[str]:
        """What follows ``allanite``."""
        record = self.record.format(n=n, c=channels)
        records = [f"{record}/{i:03d}.npy" for i in range(channels)] if self.by_record else [record]
        return [self.command[0], *records, *self.command[1:], *self.options]

    @property
    def by_record(self) -> bool:
        return self.record.startswith("units")


CASES: Mapping[str, Case] = {
    "info": Case(command=("info",)),
    "allan": Case(command=("allan", "-o", "curve.csv", "--force")),
    "spectrum": Case(command=("spectrum",)),
    "characterize": Case(command=("characterize", "--out", "out", "--force")),
    "fit, likelihood": Case(command=("fit", "--method", "likelihood")),
    "fit, spectral": Case(command=("fit", "--method", "spectral")),
    "select": Case(command=("select",)),
    "variation": Case(command=("variation",)),
    "filter": Case(
        command=("filter", "--model", _MODEL, *_OUTPUT), channels=(), remark="one channel at a time"
    ),
    "convert": Case(command=("convert", "written.parquet", "--force")),
    "common": Case(command=("common",), fewest=2, channels=(), remark="two or three channels"),
    "combine": Case(
        command=("combine", "--model", _MODEL, *_OUTPUT),
        fewest=2,
        channels=(2, 10, 100),
    ),
    "compare": Case(
        command=("compare",),
        record="units-{n}-{c}",
        fewest=2,
        channels=(2, 10, 100),
        remark="records in place of channels",
    ),
    "in-motion": Case(
        command=("in-motion",),
        record="units-{n}-{c}",
        fewest=2,
        channels=(2, 10),
        remark="a log at rest, the others in motion",
    ),
    "environment": Case(
        command=("environment", "--temperature", "temp"),
        record="thermometer-{n}.parquet",
        options=("--rate", "32"),
        channels=(),
        remark="one channel and its thermometer",
    ),
    "earth-rate --vector": Case(
        command=("earth-rate", "--vector", "--latitude", "48.1"),
        record="rest-{n}.parquet",
        options=("--rate", "32"),
        fewest=6,
        channels=(),
        remark="three axes of six in the log",
    ),
    "align": Case(
        command=("align", "--latitude", "48.1", "--gyro-bias", "0.1deg/h"),
        record="rest-{n}.parquet",
        options=("--rate", "32"),
        fewest=6,
        channels=(),
        remark="six axes; memory is flat from 4e6 on",
    ),
}


# ---- measuring ------------------------------------------------------------------------------------------------------


def points_of(case: Case) -> list[tuple[int, int]]:
    """Samples and channels of all runs of a case."""
    lengths = [(n, case.fewest) for n in SIZES]
    return list(dict.fromkeys([*lengths, *((SIZES[0], c) for c in case.channels)]))


def measured(case: Case, folder: Path) -> list[Json]:
    """Runs of a case; short ones are repeated."""
    runs = []
    for n, channels in points_of(case):
        record = case.record.format(n=n, c=channels)
        if not (folder / record).exists():
            spent([sys.executable, "-m", "benchmarks.records", str(folder), record])
        command = [sys.executable, "-m", "allanite", *case.arguments(n, channels)]
        done = [spent(command, folder, _CODES) for _ in range(2 if n * channels <= SIZES[1] else 1)]
        best = min(done, key=lambda run: float(run["cpu"]))
        best = {key: best[key] for key in ("cpu", "wall", "memory")}
        runs.append({"samples": n, "channels": channels, **best, "times": [run["cpu"] for run in done]})
    return runs


# ---- growth ---------------------------------------------------------------------------------------------------------


def scatter(cases: Iterable[Sequence[Json]]) -> float:
    """Relative standard deviation of a processor time, pooled over all runs that were repeated."""
    pairs = [run["times"] for runs in cases for run in runs if len(run["times"]) == 2]
    return math.sqrt(sum(math.log(a / b) ** 2 / 2 for a, b in pairs) / max(len(pairs), 1))


def exponent(sizes: Sequence[int], times: Sequence[float], relative: float) -> tuple[float, float] | None:
    """The exponent at the upper end, and its standard uncertainty; None where growth is lost in the scatter.

    Parameters
    ----------
    sizes, times : sequence, at least three
    relative : float
        Relative standard deviation of a time.
    """
    last, before = times[-1] - times[0], times[-2] - times[0]
    noise = [relative * math.hypot(t, times[0]) for t in (times[-1], times[-2])]
    if before < 2 * noise[1] or last < 2 * noise[0]:
        return None
    decades = math.log((sizes[-1] - sizes[0]) / (sizes[-2] - sizes[0]))
    value = math.log(last / before) / decades
    return value, math.hypot(noise[0] / last, noise[1] / before) / decades


def along(runs: Sequence[Json], what: str) -> list[Json]:
    """The runs along one axis: "samples" with the fewest channels, "channels" with the fewest samples."""
    other = "channels" if what == "samples" else "samples"
    least = min(run[other] for run in runs)
    return sorted((run for run in runs if run[other] == least), key=lambda run: int(run[what]))


def growth_of(runs: Sequence[Json], what: str, relative: float) -> tuple[float, float] | None:
    line = along(runs, what)
    if len(line) < 3:
        return None
    return exponent([run[what] for run in line], [run["cpu"] for run in line], relative)


def bytes_per_sample(runs: Sequence[Json]) -> float:
    """Bytes of memory that a sample more takes, between the two longest records."""
    *_, before, last = along(runs, "samples")
    return float(2**20 * (last["memory"] - before["memory"]) / (last["samples"] - before["samples"]))


def above(grown: tuple[float, float] | None) -> bool:
    """Whether an exponent exceeds the bound by more than its uncertainty explains."""
    return grown is not None and grown[0] - 2 * grown[1] > BOUND


# ---- words ----------------------------------------------------------------------------------------------------------


def exponent_words(grown: tuple[float, float] | None, runs: Sequence[Json], what: str) -> str:
    if len(along(runs, what)) < 3:
        return ""
    if grown is None:
        return "not resolved"
    words = f"{grown[0]:.2f} ± {grown[1]:.2f}"
    return f"**{words}**" if above(grown) else words


def row_of(name: str, runs: Sequence[Json], relative: float) -> list[str]:
    """Cells of a case; times and memory along the samples, and along the channels."""
    samples, channels = along(runs, "samples"), along(runs, "channels")
    many = channels if len(channels) > 1 else []
    exponents = [exponent_words(growth_of(runs, w, relative), runs, w) for w in ("samples", "channels")]
    longest = "" if samples[-1]["samples"] == SIZES[-1] else f"up to {samples[-1]['samples']:.0e} samples"
    remarks = [CASES[name].remark, longest.replace("e+0", "e")]
    return [
        name,
        " / ".join(f"{run['cpu']:.1f}" for run in samples),
        exponents[0],
        " / ".join(f"{run['memory']:.0f}" for run in samples),
        f"{bytes_per_sample(runs):.1f}",
        " / ".join(f"{run['cpu']:.1f}" for run in many),
        exponents[1],
        " / ".join(f"{run['memory']:.0f}" for run in many),
        "; ".join(filter(None, remarks)),
    ]


def document(cases: Mapping[str, Sequence[Json]], machine: Json) -> Json:
    relative = scatter(cases.values())
    measure = "processor time [s] and peak of memory [MiB] of the whole process"
    lengths = "by samples: 1e5 / 1e6 / 1e7 / 1e8 of one channel (two for common, combine and compare)"
    uncertainty = f"± is the standard uncertainty from the scatter of repeated runs, {100 * relative:.1f} %"
    notes = [
        f"{measure}; {lengths}; by channels: 1 (or 2) / 10 / 100 of 1e5 samples",
        f"{uncertainty}; bold exceeds {BOUND} by more than twice that; not resolved: no growth beyond the scatter",
        "bytes per sample: memory that one more takes between the two longest records, all channels together",
        f"not measured: {_UNMEASURED}",
    ]
    waiting = [name for name in CASES if name not in cases]
    notes += [f"not run yet: {', '.join(waiting)}"] if waiting else []
    return {"machine": machine, "scatter": relative, "cases": dict(cases), "notes": notes}


HEADER = [
    "command",
    "time by samples [s]",
    "exponent",
    "memory [MiB]",
    "bytes per sample",
    "time by channels [s]",
    "exponent of channels",
    "memory of channels [MiB]",
    "remark",
]


def draw(cases: Mapping[str, Sequence[Json]], path: Path) -> None:
    """Time over samples, memory over samples, time over channels; lines of the color of their command."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.6), layout="constrained")
    axes = figure.subplots(1, 3)
    panels = (("samples", "cpu", "processor time [s]"), ("samples", "memory", "memory [MiB]"))
    panels += (("channels", "cpu", "processor time [s]"),)
    for ax, (what, key, label) in zip(axes, panels, strict=True):
        for i, (name, runs) in enumerate(cases.items()):
            line = along(runs, what)
            if len(line) > 1:
                style = {"color": f"C{i % 10}", "marker": "osD^"[i // 10], "ls": "-" if i < 10 else "--"}
                ax.loglog([r[what] for r in line], [r[key] for r in line], ms=4, lw=1.2, label=name, **style)
        ax.set(xlabel=what if what == "samples" else "channels or records of 1e5 samples", ylabel=label)
        ax.grid(True, which="major", color="0.9")
    ends = [SIZES[-2], SIZES[-1]]
    axes[0].plot(
        ends, [30 * n / SIZES[-1] for n in ends], color="0.4", lw=3, alpha=0.5, label="in proportion"
    )
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right upper", frameon=False, fontsize=8)
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure how time and memory of the commands grow.")
    parser.add_argument("cases", nargs="*", choices=[[], *CASES], metavar="CASE")
    parser.add_argument("--records", type=Path, help="keep the records here")
    given = parser.parse_args()
    place = RESULTS / "growth.json"
    done: Json = json.loads(place.read_text())["cases"] if given.cases and place.exists() else {}
    with tempfile.TemporaryDirectory() as temporary:
        for name in given.cases or CASES:
            done[name] = measured(CASES[name], (given.records or Path(temporary)).resolve())
            print(name, [(r["samples"], r["channels"], round(r["cpu"], 2)) for r in done[name]], flush=True)
            result = document({key: done[key] for key in CASES if key in done}, describe("pyarrow", "scipy"))
            rows = [row_of(key, runs, result["scatter"]) for key, runs in result["cases"].items()]
            text = save("growth", "How time and memory of the commands grow", result, HEADER, rows)
    print(text)
    draw(result["cases"], PICTURE)


if __name__ == "__main__":
    main()
