# SPDX-License-Identifier: BSD-3-Clause
"""What the benchmarks make of their times: rows that grew, exponents, the parts of a job. Nothing here is timed."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("benchmarks", reason="the benchmarks are not in the source package")

from benchmarks import growth, job_profile, jobs, processes
from benchmarks.jobs import Job
from benchmarks.records import RECORDS

from allanite.commands.registry import COMMANDS


def row(value: float, *, ratio: float = 1.0, unit: str = "s", **more: Any) -> dict[str, Any]:
    return {"value": value, "most": value, "ratio": ratio, "unit": unit, "wall": 2.0, "memory": 99.6, **more}


# ---- jobs -----------------------------------------------------------------------------------------------------------


def test_a_job_grew_if_its_ratio_to_the_reference_did() -> None:
    assert jobs.grown(1.16, 1.0) and not jobs.grown(1.14, 1.0) and not jobs.grown(9.0, None)
    assert jobs.change(row(1, ratio=2.0), None) == "new"
    assert jobs.change(row(1, ratio=2.2), 2.0) == "+10 %"
    assert jobs.change(row(1, ratio=2.4), 2.0) == "**+20 %**"
    assert jobs.change(row(1, ratio=1.5), 2.0) == "-25 %"


def test_rows_that_grew_are_red() -> None:
    text = "| a | +3 % |\n| b | **+20 %** |\n"
    assert jobs.reddened(text) == "| a | +3 % |\n\033[31m| b | **+20 %** |\033[0m\n"


def test_the_table_has_wanted_values_peers_and_parts() -> None:
    peer = Job(name="Other", beside="read")
    read = Job(name="read", wanted=1.1, than="Other", memory=300.0)
    size = Job(name="report", size="report.html", wanted=1.5)
    rows = {"read": row(2.5, most=2.71), "read: Other": row(2.0), "report": row(0.158, unit="MB")}
    rooms = [("fitting.design", 0.06), ("fitting.sets", 0.04), ("views", 0.03), ("study", 0.03)]
    parts = [("import numpy", 0.6), ("lazy_dataclasses", 0.2), *rooms, ("files.readers.csv", 0.04)]
    rows["read"]["parts"] = jobs.by_room(parts)
    del rows["report"]["wall"], rows["report"]["memory"]
    assert jobs.exceeds(read, {**rows, "read": row(2.54)}) and not jobs.exceeds(read, rows)
    assert not jobs.exceeds(read, {"read": rows["read"]}), "a peer that is not installed says nothing"
    header, cells = jobs.table(rows, {"read": 1.0}, (read, peer, size))
    assert len(header) == len(cells[0]) == len(cells[1])
    assert cells[0][:-1] == [
        "read",
        "2.20 s, 1.1 × Other, 300 MiB",
        "2.50 to 2.71 s",
        "2.00 s",
        "100",
        "Other 2.00 s, 100 MiB",
        "+0 %",
    ]
    imports = "imports 2.00 s (numpy 1.50 s, lazy_dataclasses 0.50 s)"
    assert cells[0][-1] == f"{imports}, fitting 0.25 s (design 0.15 s), files.readers 0.10 s, 2 others 0.15 s"
    assert cells[1] == ["report", "1.50 MB", "0.16 MB", "", "", "", "new", ""]


def test_amounts_have_three_digits() -> None:
    assert [jobs._amount(x, "s") for x in (0.034, 9.994, 12.34, 99.96, 123.4)] == [
        "0.03 s",
        "9.99 s",
        "12.3 s",
        "100.0 s",
        "123 s",
    ]


def test_what_looks_grown_is_measured_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    slow, calm = Job(name="slow"), Job(name="calm", wanted=0.5, command=("info",))
    times = {slow: iter([3.0, 1.0, 1.0]), calm: iter([1.0]), jobs._REFERENCE: iter([1.0] * 5)}

    def measured(job: Job, _: Path) -> dict[str, Any]:
        value = next(times[job])
        return {"cpu": value, "value": value, "wall": value, "memory": 1.0}

    monkeypatch.setattr(jobs, "measured", measured)
    monkeypatch.setattr(jobs, "parts_of", lambda job, _: [(job.name, 1.0)])
    monkeypatch.setattr(jobs, "rounds_of", again := Rounds(jobs.rounds_of))
    rows = jobs.measure_all([slow, calm], tmp_path, 1, {"slow": 1.0, "calm": 1.0})
    assert again.asked == [["slow", "calm"], ["slow"]]
    assert rows["slow"]["ratio"] == 2.0 and rows["slow"]["value"] == 1.0 and rows["slow"]["most"] == 3.0
    assert "parts" not in rows["slow"] and rows["calm"]["parts"][0]["name"] == "calm"


class Rounds:
    """The rounds, with the names of the jobs that each was asked for."""

    def __init__(self, work: Any) -> None:
        self.work, self.asked = work, list[list[str]]()

    def __call__(self, chosen: list[Job], *rest: Any) -> None:
        self.asked.append([job.name for job in chosen])
        self.work(chosen, *rest)


def test_the_last_commit_is_compared_not_the_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(jobs, "RESULTS", tmp_path)
    assert jobs.last_committed() == {}
    place = tmp_path / "jobs.json"
    place.write_text(
        json.dumps({"jobs": {"a": {"ratio": 2.0, "rounds": 2}, "once": {"ratio": 1.0, "rounds": 1}}})
    )
    identity = ("-c", "user.name=a", "-c", "user.email=a@example.org")
    for words in (["init", "-q"], ["add", "jobs.json"], [*identity, "commit", "-qm", "Table"]):
        subprocess.run(["git", *words], cwd=tmp_path, check=True, capture_output=True)
    place.write_text(json.dumps({"jobs": {"a": {"ratio": 3.0, "rounds": 2}}}))
    assert jobs.last_committed() == {"a": 2.0}


def test_every_job_has_its_records_and_its_peers_have_their_job() -> None:
    names = {job.name for job in jobs.JOBS if not job.beside}
    assert len({jobs.key_of(job) for job in jobs.JOBS}) == len(jobs.JOBS)
    for job in jobs.JOBS:
        assert set(job.records) <= RECORDS.keys() and (not job.beside or job.beside in names)
        assert bool(job.command) + bool(job.python) + bool(job.call) + bool(job.size) == 1
        assert not job.than or any(peer.name == job.than and peer.beside == job.name for peer in jobs.JOBS)


# ---- parts ----------------------------------------------------------------------------------------------------------


def test_a_library_counts_where_it_was_called_from() -> None:
    main = ("/x/src/allanite/__main__.py", 1, "main")
    fit = ("/x/src/allanite/fitting/moments.py", 5, "fit")
    curve = ("/x/src/allanite/noise/allan/__init__.py", 5, "curve")
    solve = ("/x/site-packages/scipy/linalg/basic.py", 7, "solve")
    inner = ("~", 0, "<built-in dot>")
    finder = ("<frozen importlib._bootstrap>", 9, "_find_and_load")
    scipy = ("/x/site-packages/scipy/__init__.py", 1, "<module>")
    stats = {
        main: (1, 1, 1.0, 10.0, {}),
        fit: (1, 1, 2.0, 5.0, {main: (1, 1, 2.0, 5.0)}),
        curve: (1, 1, 1.0, 2.0, {main: (1, 1, 1.0, 2.0)}),
        solve: (4, 4, 1.0, 4.0, {fit: (3, 3, 0.75, 3.0), curve: (1, 1, 0.25, 1.0)}),
        inner: (9, 9, 3.0, 3.0, {solve: (9, 9, 3.0, 3.0)}),
        finder: (2, 2, 0.5, 2.0, {main: (1, 1, 0.25, 1.0), scipy: (1, 1, 0.25, 1.0)}),
        scipy: (1, 1, 1.5, 1.75, {finder: (1, 1, 1.5, 1.75)}),
    }
    whole: Any = SimpleNamespace(stats=stats)
    shares = {name: 10 * share for name, share in job_profile.parts(whole)}
    assert shares == pytest.approx(
        {
            "fitting.moments": 2 + 3.0,
            "noise.allan": 1 + 1.0,
            "import scipy": 1.5 + 0.25,
            "__main__": 1.0,
            "import allanite": 0.25,
        }
    )
    assert "fitting.moments.fit" in dict(job_profile.parts(whole, functions=True))


def test_a_process_is_measured_with_what_it_wrote(tmp_path: Path) -> None:
    run = processes.spent([sys.executable, "-c", "print(sum(range(10)))"], tmp_path)
    assert run["output"] == "45\n" and 0 < run["cpu"] and 0 < run["wall"] and 1 < run["memory"]
    refused = [sys.executable, "-c", "raise SystemExit(3)"]
    assert processes.spent(refused, tmp_path, codes=(0, 3))["output"] == ""
    with pytest.raises(SystemExit, match="exit code 3"):
        processes.spent(refused, tmp_path)


# ---- growth ---------------------------------------------------------------------------------------------------------

SIZES = np.array(growth.SIZES)


@pytest.mark.parametrize(
    ("time", "power"),
    [
        (lambda n: 3.0 + 1e-7 * n, 1.0),
        (lambda n: 0.5 + 1e-7 * (n - 3e4), 1.0),
        (lambda n: 1.0 + 1e-13 * n**2, 2.0),
        (lambda n: 2.0 + 1e-4 * np.sqrt(n), 0.52),
        (lambda n: 1.0 + 1e-8 * n * np.log2(n), 1.059),
    ],
)
def test_the_exponent_is_that_of_the_growth_without_the_start(time: Any, power: float) -> None:
    line = growth.exponent(SIZES, time(SIZES.astype(float)), 0.0)
    assert line is not None and line[0] == pytest.approx(power, abs=0.01) and line[1] == 0.0


def test_the_uncertainty_of_an_exponent_is_its_scatter() -> None:
    rng, times = np.random.default_rng(26), 1.0 + 2e-7 * SIZES
    line = growth.exponent(SIZES, times, 0.03)
    assert line is not None
    drawn = [growth.exponent(SIZES, times * (1 + 0.03 * rng.standard_normal(4)), 0.03) for _ in range(2000)]
    scatter = float(np.std([one[0] for one in drawn if one]))
    assert line[1] == pytest.approx(scatter, rel=0.15)  # the start-up is shared by both differences
    assert growth.exponent(SIZES, [1.0, 1.0, 1.01, 1.02], 0.03) is None


def test_scatter_is_pooled_over_repeated_runs() -> None:
    rng = np.random.default_rng(2)
    pairs = np.exp(0.05 * rng.standard_normal((4000, 2)))
    runs = [[{"times": pair.tolist()} for pair in pairs], [{"times": [9.0]}]]
    assert growth.scatter(runs) == pytest.approx(0.05, rel=0.04)
    assert growth.scatter([]) == 0.0


def run(n: int, channels: int, cpu: float, memory: float) -> dict[str, Any]:
    return {"samples": n, "channels": channels, "cpu": cpu, "memory": memory, "times": [cpu]}


def test_a_row_states_growth_along_samples_and_channels() -> None:
    runs = [run(int(n), 1, 1 + 1e-7 * n, 100 + 8 * n / 2**20) for n in SIZES]
    runs += [run(100_000, 10, 1.3, 110.0), run(100_000, 100, 80.0, 150.0)]
    cells = growth.row_of("info", runs, 0.01)
    assert len(cells) == len(growth.HEADER)
    assert cells == [
        "info",
        "1.0 / 1.1 / 2.0 / 11.0",
        "1.00 ± 0.01",
        "101 / 108 / 176 / 863",
        "8.0",
        "1.0 / 1.3 / 80.0",
        "**2.34 ± 0.02**",
        "101 / 110 / 150",
        "",
    ]
    assert not growth.above((1.10, 0.03)) and growth.above((1.12, 0.03))
    short = growth.row_of("align", [{**r, "channels": 6} for r in runs[:3]], 0.01)
    assert short[5:8] == ["", "", ""] and short[-1].endswith("; up to 1e7 samples")


def test_every_command_that_reads_a_record_is_measured_or_named() -> None:
    reading = {command.name for command in COMMANDS.values() if command.reads}
    measured = {case.command[0] for case in growth.CASES.values()}
    missing = {name for name in reading - measured if name.partition(" ")[0] not in growth._UNMEASURED}
    assert not missing


def test_a_case_names_its_records() -> None:
    compare, info = growth.CASES["compare"], growth.CASES["info"]
    assert compare.arguments(1000, 2)[:3] == ["compare", "units-1000-2/000.npy", "units-1000-2/001.npy"]
    assert info.arguments(1000, 10)[:2] == ["info", "columns-1000-10.npy"]
    assert growth.points_of(info)[-2:] == [(100_000, 10), (100_000, 100)]
