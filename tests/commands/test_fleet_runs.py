# SPDX-License-Identifier: BSD-3-Clause
"""fleet run: one table of many logs, each done once, and whatever a log does it costs its own row."""

from __future__ import annotations

import json
import math
import os
import signal
from concurrent.futures import Future, ProcessPoolExecutor
from datetime import datetime

import numpy as np
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

import allanite as al
from allanite.commands.fleet import running
from allanite.commands.fleet.folder import FleetFolder
from allanite.commands.fleet.labels import LogLabels
from allanite.commands.fleet.pattern import PathPattern, date_of
from allanite.commands.fleet.table import COLUMNS
from allanite.fitting.families import FLICKER
from allanite.stability.fleet.levels import LEVELS, profile_of
from allanite.stability.record_comparison.evidence import evidence_of
from allanite.stability.record_comparison.series import record_of
from fleet_logs import PATTERN, column, rows_without_times, write_fleet, write_log


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A fleet of four logs, done once for the tests that read it."""
    folder = tmp_path_factory.mktemp("fleet")
    write_fleet(folder / "logs", 4)
    (folder / "units.csv").write_text("unit,customer,hours\nu000,ACME,12\nu001,Borg,8.5\n")
    steps = []
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        run = al.fleet(
            "logs/**/*.csv",
            pattern=PATTERN,
            metadata="units.csv",
            out=folder / "fleet",
            max_workers=2,
            keep=True,
            progress=lambda fraction, words: steps.append((fraction, words)),
        )
    return folder, run, steps


@pytest.mark.long
def test_the_table_has_the_columns_that_are_declared(made):
    folder, run, _ = made
    schema = pq.read_table(folder / run.path).schema
    names = [c.name for c in COLUMNS]
    place = names.index("temperature") + 1
    assert schema.names == [*names[:place], "customer", "hours", *names[place:]]
    assert str(schema.field("profile").type) == "fixed_size_list<element: float>[9]"
    assert {c.type for c in COLUMNS if c.name in ("temperature", "estimate")} == {"float64"}


def test_each_log_channel_and_coefficient_is_one_row_with_its_labels(made):
    folder, run, _ = made
    rows = pq.read_table(folder / run.path).to_pylist()
    keys = [(r["log"], r["channel"], r["term"]) for r in rows]
    assert len(set(keys)) == len(keys)
    assert {(c, t) for _, c, t in keys} >= {(c, t) for c in ("gyro_x", "gyro_y") for t in "QNBKR"}
    first = rows[0]
    assert first["log"] == "logs/L0/u000_2026-10-01_-20C.csv"
    assert (first["unit"], first["lot"], first["temperature"]) == ("u000", "L0", -20.0)
    assert str(first["date"]) == "2026-10-01 00:00:00"
    assert (first["customer"], first["hours"]) == ("ACME", 12.0)
    assert (first["rate"], first["span"], first["samples"]) == (pytest.approx(100), pytest.approx(12), 1200)
    assert first["version"] == al.__version__ and first["seconds"] > 0 and first["error"] is None
    assert {r["customer"] for r in rows if r["unit"] == "u003"} == {None}


def test_numbers_are_those_of_the_study(made):
    folder, run, _ = made
    log = "logs/L1/u001_2026-10-02_40C.csv"
    study = al.characterize(al.read(folder / log))
    for estimate in study.models["gyro_x"].estimates:
        row = next(
            r for r in run_rows(folder, run, log) if (r["channel"], r["term"]) == ("gyro_x", estimate.symbol)
        )
        assert row["upper"] == (estimate.upper if math.isfinite(estimate.upper) else None)
        assert row["estimate"] == (estimate.value if estimate.supported else None)
        assert row["status"] == ("resolved" if estimate.supported else "upper_limit")
        assert row["unit_of_measure"] == {"N": "rad/s/√Hz", "Q": "rad", "R": "rad/s²"}.get(
            estimate.symbol, row["unit_of_measure"]
        )


def run_rows(folder, run, log):
    return [r for r in pq.read_table(folder / run.path).to_pylist() if r["log"] == log]


def test_profiles_are_what_the_record_says_under_the_flicker_family(made):
    folder, run, _ = made
    log = "logs/L0/u002_2026-10-03_-20C.csv"
    study = al.characterize(al.read(folder / log))
    evidence = evidence_of(record_of(study).series("gyro_y"), FLICKER, 0.95)
    for term in FLICKER:
        row = next(r for r in run_rows(folder, run, log) if (r["channel"], r["term"]) == ("gyro_y", term))
        levels = np.array(row["profile"])
        inside = np.isfinite(levels)
        root = evidence.profiles[term].root(levels[inside])
        assert inside.any()
        np.testing.assert_allclose(
            root, np.array(LEVELS)[inside], atol=0.02
        )  # flat chords of a traced profile
        assert profile_of(levels, row["root_at_zero"]).best == pytest.approx(
            evidence.profiles[term].best, abs=1e-5
        )


def test_an_upper_limit_is_a_limit_in_its_profile(made):
    folder, run, _ = made
    rows = [
        r
        for r in pq.read_table(folder / run.path).to_pylist()
        if r["status"] == "upper_limit" and r["profile"]
    ]
    assert rows
    for row in rows:
        assert row["estimate"] is None and row["lower"] == 0
        profile = profile_of(np.array(row["profile"]), row["root_at_zero"])
        assert profile.interval[0] == -math.inf and math.isfinite(profile.interval[1])


def test_progress_counts_logs_and_says_what_is_left(made):
    _, _, steps = made
    assert [fraction for fraction, _ in steps] == [0.25, 0.5, 0.75, 1.0]
    assert steps[0][1].startswith("1 of 4 logs, ") and steps[0][1].endswith(" left")
    assert steps[-1][1] == "4 of 4 logs"


def test_a_kept_study_is_read_and_any_other_is_made_again(made, monkeypatch):
    folder, run, _ = made
    monkeypatch.chdir(folder)
    log = "logs/L0/u000_2026-10-01_-20C.csv"
    saved = list((folder / "fleet" / "studies").glob("*.json"))
    assert len(saved) == 4
    kept = run.study(log)
    for place in saved:
        place.rename(place.with_suffix(".away"))
    again = run.study(log)
    for place in saved:
        place.with_suffix(".away").rename(place)
    assert again.to_json()["channels"] == kept.to_json()["channels"]
    assert kept.provenance.sha256 == column(run.path, "sha256", log=log)[0]
    with pytest.raises(al.InputError, match=r"no log 'logs/none\.csv'"):
        run.study("logs/none.csv")


@pytest.mark.long
def test_other_programs_read_the_table_in_one_line(made, monkeypatch):
    folder, _, _ = made
    monkeypatch.chdir(folder)
    table = pq.read_table("fleet/fleet.parquet")
    white = table.filter(pc.equal(table["term"], "N"))
    pandas = pytest.importorskip("pandas")
    assert len(pandas.read_parquet("fleet/fleet.parquet").query("term == 'N'")) == len(white) == 8
    duckdb = pytest.importorskip("duckdb")
    counted = duckdb.sql(
        "SELECT lot, count(estimate) FROM 'fleet/fleet.parquet' WHERE term = 'N' GROUP BY lot"
    )
    assert sorted(counted.fetchall()) == [("L0", 4), ("L1", 4)]
    assert (
        duckdb.sql("SELECT len(profile) FROM 'fleet/fleet.parquet' WHERE term = 'N'").fetchall() == [(9,)] * 8
    )
    polars = pytest.importorskip("polars")
    frame = polars.scan_parquet("fleet/fleet.parquet").filter(polars.col("term") == "N").collect()
    assert [[*profile] for profile in frame["profile"]] == white["profile"].to_pylist()


def test_processes_of_an_executor_do_logs_too(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_fleet(tmp_path / "logs", 1)
    with ProcessPoolExecutor(1) as pool:
        assert al.fleet("logs/**/*.csv", out="fleet", executor=pool).failed == ()
        pool.shutdown()
        write_log(tmp_path / "logs" / "b.csv", seed=3)
        with pytest.raises(al.WorkerError, match="takes no more logs"):
            al.fleet("logs/**/*.csv", out="fleet", executor=pool)


def test_an_option_that_read_does_not_take_is_refused_before_any_log(tmp_path):
    with pytest.raises(al.InputError, match="fleet takes no option speed; those of read are: unit, time"):
        al.fleet(tmp_path / "*.csv", out=tmp_path / "fleet", speed=3)


# -- nothing twice ------------------------------------------------------------------------------------------


class Counting:
    """An executor that does a task at once, and counts them."""

    _max_workers = 1

    def __init__(self, fails: int = 0) -> None:
        self.logs: list[str] = []
        self.fails = fails

    def submit(self, function, task):
        self.logs.append(task["log"])
        future: Future = Future()
        if len(self.logs) <= self.fails:
            future.set_exception(ConnectionError("worker lost"))
        else:
            future.set_result(function(task))
        return future


def test_only_what_changed_is_done_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    logs = write_fleet(tmp_path / "logs", 3)
    first = Counting()
    run = al.fleet("logs/**/*.csv", out="fleet", executor=first)
    assert (len(first.logs), run.done, run.kept, run.failed) == (3, 3, 0, ())
    before = rows_without_times(run.path)

    assert column(run.path, "temperature", channel="gyro_x", term="N") == [pytest.approx(25, abs=0.01)] * 3
    again = Counting()
    assert al.fleet("logs/**/*.csv", out="fleet", executor=again).kept == 3
    assert again.logs == []

    os.utime(logs[0])  # touched: looked at, and not characterized
    write_log(logs[1], seed=77)  # changed
    third = Counting()
    run = al.fleet("logs/**/*.csv", out="fleet", executor=third)
    assert third.logs == ["logs/L0/u000_2026-10-01_-20C.csv", "logs/L1/u001_2026-10-02_40C.csv"]
    after = rows_without_times(run.path)
    changed = {row["log"] for row in after if row not in before}
    assert changed == {"logs/L1/u001_2026-10-02_40C.csv"}

    fourth = Counting()
    al.fleet("logs/**/*.csv", out="fleet", executor=fourth, channels=["gyro_x"])
    assert len(fourth.logs) == 3
    assert set(column(run.path, "channel")) == {"gyro_x"}


def test_labels_are_those_of_the_last_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_fleet(tmp_path / "logs", 2)
    run = al.fleet("logs/**/*.csv", out="fleet", executor=Counting())
    assert set(column(run.path, "unit")) == {"u000_2026-10-01_-20C", "u001_2026-10-02_40C"}
    untouched = Counting()
    al.fleet("logs/**/*.csv", out="fleet", pattern=PATTERN, executor=untouched)
    assert untouched.logs == []
    assert set(column(run.path, "unit")) == {"u000", "u001"}
    assert set(column(run.path, "temperature")) == {-20.0, 40.0}


def test_a_lost_worker_costs_another_attempt_and_nothing_else(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_fleet(tmp_path / "logs", 1)
    losing = Counting(fails=2)
    assert al.fleet("logs/**/*.csv", out="fleet", executor=losing, retries=2).failed == ()
    assert len(losing.logs) == 3


def test_a_log_that_no_worker_brings_to_an_end_is_a_row_and_is_tried_by_the_next_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_fleet(tmp_path / "logs", 1)
    run = al.fleet("logs/**/*.csv", out="fleet", executor=Counting(fails=2), retries=1)
    assert len(run.failed) == 1
    assert column(run.path, "error") == ["WorkerError: worker lost (ConnectionError)"]
    assert al.fleet("logs/**/*.csv", out="fleet", executor=Counting()).failed == ()


# -- logs that fail -----------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_log_that_fails_hangs_swells_or_crashes_is_one_row(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    good = write_fleet(tmp_path / "logs", 1)[0]
    (tmp_path / "logs" / "empty.csv").write_text("")
    (tmp_path / "logs" / "words.csv").write_text("hello\nworld\n")
    run = al.fleet(["logs/**/*.csv"], out="fleet", max_workers=1)
    assert run.failed == ("logs/empty.csv", "logs/words.csv")
    failed = [r for r in pq.read_table(run.path).to_pylist() if r["status"] == "error"]
    assert [(r["log"], r["channel"], r["term"]) for r in failed] == [
        (name, None, None) for name in run.failed
    ]
    assert all(r["error"].partition(":")[0].endswith("Error") and len(r["sha256"]) == 64 for r in failed)
    assert {r["status"] for r in run_rows(tmp_path, run, str(good.relative_to(tmp_path)))} >= {"resolved"}
    errors_of_logs_are_not_tried_again = Counting()
    al.fleet(["logs/**/*.csv"], out="fleet", executor=errors_of_logs_are_not_tried_again)
    assert errors_of_logs_are_not_tried_again.logs == []


@pytest.mark.long
@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"timeout": 0.01}, "LimitError: took more than 0.01 s; allow more (--timeout) or read a part"),
        ({"memory": 1e6}, "LimitError: took more than 1 MiB of memory; allow more (--memory)"),
    ],
)
def test_limits_end_the_process_of_a_log_and_the_next_run_tries_again(tmp_path, monkeypatch, limits, message):
    monkeypatch.chdir(tmp_path)
    write_log(tmp_path / "a.csv", seed=1)
    run = al.fleet("a.csv", out="fleet", max_workers=1, **limits)
    assert column(run.path, "error") == [message]
    assert al.fleet("a.csv", out="fleet", max_workers=1).failed == ()


def test_a_process_that_dies_of_a_log_is_a_row(tmp_path, monkeypatch):
    # no reader is known to crash: a child that kills itself shows what would follow
    from allanite.commands.fleet import log_process, one_log

    def dies(task):
        os.kill(os.getpid(), signal.SIGKILL)

    monkeypatch.setattr(one_log, "log_outcome", dies)
    reading, writing = os.pipe()
    answers = os.open(os.devnull, os.O_WRONLY)
    task = {"log": "a.csv", "place": "a.csv", "timeout": 60, "memory": None}
    lines = log_process._TaskLines(reading)
    answer = json.loads(log_process._answer(task, lines, answers))
    assert answer["error"] == "Crash: the process of this log ended by SIGKILL; the log may be damaged"
    assert answer["again"]
    os.close(writing)
    assert log_process._answer({**task, "timeout": 60}, lines, answers) is None  # nobody waits any more
    os.close(answers)
    os.close(reading)


def test_one_run_at_a_time_writes_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_log(tmp_path / "a.csv", seed=1)
    with FleetFolder("fleet").locked(), pytest.raises(al.StorageError, match="another run writes fleet"):
        al.fleet("a.csv", out="fleet", executor=Counting())


def test_a_table_of_something_else_is_not_replaced(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_log(tmp_path / "a.csv", seed=1)
    (tmp_path / "fleet.parquet").write_bytes(b"mine")
    with pytest.raises(al.StorageError, match=r"fleet\.parquet is not of a fleet run"):
        al.fleet("a.csv", out=".", executor=Counting())
    with pytest.raises(al.InputError, match=r"b\*\.csv: no such log"):
        al.fleet("b*.csv", out="fleet", executor=Counting())


@pytest.mark.parametrize("commits", ["0 1 2 1 3 4", "0 1 2 3 4 1"], ids=["among those merged", "after them"])
def test_many_parts_become_one(tmp_path, monkeypatch, commits):
    from allanite.commands.fleet import folder as folders

    monkeypatch.setattr(folders, "_MERGE", 3)
    fleet = FleetFolder(tmp_path)

    def row(log, channel):
        return {"log": log, "channel": channel, "status": "resolved", "_stamp": "1 1", "_key": "k"}

    with fleet.locked():
        for k in commits.split():
            again = f"log{k}" in fleet.logs
            fleet.commit([row(f"log{k}", channel) for channel in ("z" if again else "xy")])
        assert len(list((tmp_path / ".fleet" / "parts").iterdir())) == 3
        fleet.compact(LogLabels())
    assert list((tmp_path / ".fleet" / "parts").iterdir()) == []
    table = pq.read_table(fleet.table)
    assert table["log"].to_pylist() == ["log0", "log0", "log1", *(f"log{k}" for k in (2, 3, 4) for _ in "xy")]
    assert table["channel"].to_pylist() == ["x", "y", "z", *"xyxyxy"]
    reopened = FleetFolder(tmp_path)
    reopened.load()
    assert reopened.logs == fleet.logs and len(fleet.logs) == 5


# -- labels -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pattern", "path", "fields"),
    [
        ("{unit}.csv", "a/b/IMU_7.csv", {"unit": "IMU_7"}),
        ("{lot}/{unit}_{date}.csv", "x/L/u_1_20261002.csv", {"lot": "L", "unit": "u_1", "date": "20261002"}),
        ("{unit}_{temperature}C*.csv", "A_-20.5C_rep2.csv", {"unit": "A", "temperature": "-20.5"}),
        ("{unit}/{unit}.csv", "A/A.csv", {"unit": "A"}),
        ("{unit}/{unit}.csv", "A/B.csv", None),
        ("lot {lot}/{unit}.csv", "all/lot 7/u.csv", {"lot": "7", "unit": "u"}),
        ("{unit}.csv", "a.csv.gz", None),
    ],
)
def test_patterns_match_the_end_of_a_path(pattern, path, fields):
    assert PathPattern(pattern).fields(path) == fields


@pytest.mark.parametrize(
    ("text", "iso"),
    [
        ("2026-10-02", "2026-10-02T00:00:00"),
        ("20261002-083000", "2026-10-02T08:30:00"),
        ("2026-10-02T08:30", "2026-10-02T08:30:00"),
        ("2026-10-02T08:30:00.5Z", "2026-10-02T08:30:00.500000"),
        ("2026-10-02T08:30:00+02:00", "2026-10-02T06:30:00"),
    ],
)
def test_dates_as_people_write_them(text, iso):
    assert date_of(text).isoformat() == iso


def test_a_log_that_does_not_match_is_a_row_and_none_that_does_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_fleet(tmp_path / "logs", 1)
    write_log(tmp_path / "logs" / "stray.csv", seed=5)
    working = Counting()
    run = al.fleet("logs/**/*.csv", out="fleet", pattern=PATTERN, executor=working)
    assert working.logs == ["logs/L0/u000_2026-10-01_-20C.csv"]
    assert column(run.path, "error", log="logs/stray.csv") == [
        f"InputError: the path does not match the pattern '{PATTERN}'"
    ]
    with pytest.raises(al.InputError, match="nor does any other of 2 logs"):
        al.fleet("logs/**/*.csv", out="fleet", pattern="{lot}/{unit}.bag", executor=working)


@pytest.mark.parametrize(
    ("pattern", "metadata", "message"),
    [
        ("plain.csv", None, "no placeholder"),
        ("{a b}.csv", None, "letters, digits"),
        ("{term}.csv", None, "term: the table of results has such a column"),
        (None, "serial,lot\n1,2\n", "needs a column 'unit' or 'log'"),
        (None, "unit,lot\na,1\na,2\n", "has a unit twice"),
        (None, "unit,rate\na,1\n", "rate: the table of results has such a column"),
    ],
)
def test_labels_that_name_nothing_are_refused(tmp_path, pattern, metadata, message):
    path = None
    if metadata is not None:
        path = tmp_path / "units.csv"
        path.write_text(metadata)
    with pytest.raises(al.InputError, match=message):
        LogLabels(pattern, path)


def test_metadata_by_log_and_by_unit(tmp_path):
    by_log = tmp_path / "logs.csv"
    by_log.write_text("log,unit,date,temperature,note\na/x.csv,U7,2026-01-02,-5,\ny.csv,U8,,,slow\n")
    labels = LogLabels(None, by_log)
    assert labels.of("a/x.csv")["unit"] == "U7" and labels.of("a/x.csv")["temperature"] == -5.0
    assert labels.of("b/y.csv") == {
        "unit": "U8",
        "lot": None,
        "date": None,
        "temperature": None,
        "note": "slow",
    }
    assert labels.of("c/z.csv")["unit"] == "z"
    bad = tmp_path / "bad.csv"
    bad.write_text("unit,date\nz,tomorrow\n")
    assert "'tomorrow' is no date" in LogLabels(None, bad).refusal("z.csv")


def test_a_name_of_digits_in_the_metadata_keeps_all_of_them(tmp_path):
    """Units 007 and 07 are two; so are 12345678901234567 and ...8, which one double stands for."""
    units = ("007", "07", "12345678901234567", "12345678901234568")
    sheet = tmp_path / "units.csv"
    rows = ["unit,lot,date,temperature,firmware,batch,hours", *(f"{u},{u},20260102,-5,1.1{'0' * i},{u},{i}.5"
            for i, u in enumerate(units))]  # fmt: skip
    sheet.write_text("\n".join(rows))
    labels = LogLabels("{unit}.csv", sheet)
    for i, unit in enumerate(units):
        of_log = labels.of(f"{unit}.csv")
        assert (of_log["unit"], of_log["lot"], of_log["batch"]) == (unit, unit, unit)
        assert of_log["firmware"] == f"1.1{'0' * i}" and of_log["hours"] == i + 0.5
        assert of_log["temperature"] == -5.0 and of_log["date"] == datetime(2026, 1, 2)


# -- the command --------------------------------------------------------------------------------------------


@pytest.mark.long
def test_the_command_says_what_it_did(tmp_path, run, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_fleet(tmp_path / "logs", 2)
    (tmp_path / "logs" / "L0" / "u009_2026-10-09_0C.csv").write_text("")
    options = ("fleet", "run", "logs/**/*.csv", "--pattern", PATTERN, "--out", "fleet", "--workers", "1")
    done = run(*options)
    assert done.code == 3, done.err
    assert done.out == (
        "3 logs done\n1 log failed; the column error says why:\n"
        "  logs/L0/u009_2026-10-09_0C.csv: FormatError: u009_2026-10-09_0C.csv is empty\nwrote fleet/fleet.parquet\n"
    )
    (tmp_path / "logs" / "L0" / "u009_2026-10-09_0C.csv").unlink()
    again = run(*options, "--json")
    assert json.loads(again.out) == {
        "table": "fleet/fleet.parquet",
        "done": 0,
        "kept": 2,
        "failed": [],
    }


def test_sizes_of_memory(run):
    refused = run("fleet", "run", "x", "--out", "f", "--memory", "lots")
    assert refused.code == 2 and "write 800MB or 2GiB" in refused.err
    assert running.TIMEOUT == 3600


@pytest.mark.long
def test_logs_without_a_unit_are_run_again_alone(tmp_path, run, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "logs").mkdir()
    rng = np.random.default_rng(1)
    for i in range(5):
        head = "t [s],gyro_z" if i == 3 else "t [s],gyro_z [deg/s]"
        rows = (f"{k / 10:.1f},{x:.6f}" for k, x in enumerate(rng.normal(0.2, 0.01, 2000)))
        (tmp_path / "logs" / f"u{i}.csv").write_text("\n".join([head, *rows]))
    options = ("--out", "fleet", "--workers", "1")
    assert run("fleet", "run", "logs/*.csv", *options).code == 0
    refused = run("fleet", "report", "fleet")
    assert refused.code == 1 and "in 4 logs" in refused.err and "logs/u3.csv" in refused.err
    assert run("fleet", "run", "logs/u3.csv", "--unit", "gyro_z=deg/s", *options).code == 0
    assert "5 of 5" in run("fleet", "report", "fleet").out
