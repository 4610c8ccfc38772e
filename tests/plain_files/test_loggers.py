# SPDX-License-Identifier: BSD-3-Clause
"""The library reports what it does to whoever listens, room by room, and to nobody else."""

from __future__ import annotations

import logging
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from shell import Run

PACKAGE = Path(al.__file__ or "").parent


@pytest.fixture
def log(tmp_path: Path, rng: np.random.Generator) -> Path:
    """Stamped samples with a gap."""
    rows = np.column_stack([np.arange(3000) / 10, rng.normal(0.2, 0.01, 3000)])
    place = tmp_path / "gyro.csv"
    np.savetxt(
        place,
        np.delete(rows, slice(1000, 1100), axis=0),
        "%.9g",
        ",",
        header="t [s],gyro [deg/s]",
        comments="",
    )
    return place


def test_a_study_is_told_step_by_step_by_the_rooms_that_do_it(
    log: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO, logger="allanite"):
        study = al.characterize(al.read(log))
        al.render(study, tmp_path / "report.html")
    told = [(record.name, record.getMessage()) for record in caplog.records]
    rooms = [name for name, _ in told]
    assert set(rooms) == {
        f"allanite.{room}" for room in ("files", "recording", "noise", "fitting", "plain_files")
    }
    assert [
        rooms.index(f"allanite.{room}") for room in ("files", "recording", "noise", "fitting", "plain_files")
    ] == [*sorted(rooms.index(name) for name in set(rooms))]
    words = dict.fromkeys(rooms, "")
    for name, message in told:
        words[name] += f"{message}\n"
    assert "gyro.csv, text: <Recording gyro: 3000 samples at 10 Hz" in words["allanite.files"]
    for finding in al.check(al.read(log)):
        assert str(finding) in words["allanite.recording"]
    assert re.search(r"fit of gyro by moments: NoiseModel\(N=", words["allanite.fitting"])
    assert f"wrote {tmp_path / 'report.html'}" in words["allanite.plain_files"]
    assert all(record.levelno == logging.INFO for record in caplog.records)


def test_details_of_one_room_are_for_who_asks_for_them(log: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.DEBUG, logger="allanite.files"):
        al.check(al.read(log))
    assert {record.name for record in caplog.records} == {"allanite.files"}
    (clock,) = [r for r in caplog.records if r.levelno == logging.DEBUG]
    assert "clock line: {'source': " in clock.getMessage() and "'missing': 100" in clock.getMessage()


@pytest.mark.long
def test_a_program_that_does_not_ask_reads_nothing(log: Path) -> None:
    code = f"import allanite as al; al.characterize(al.read({str(log)!r}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")
    code += "; import logging; root = logging.getLogger(); ours = logging.getLogger('allanite')"
    code += "; print(root.handlers, [type(h).__name__ for h in ours.handlers], ours.level)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[] ['NullHandler'] 0\n"


def test_verbose_reports_on_stderr_while_the_command_runs(log: Path, run: Run) -> None:
    quiet = run("allan", log, "--json")
    steps = run("--verbose", "allan", log, "--json")
    details = run("-vv", "allan", log, "--json")
    assert steps.out == details.out == quiet.out
    assert "allanite.files: gyro.csv, text: <Recording gyro" in steps.err and "clock line" not in steps.err
    assert "allanite.noise: oadev of gyro: " in steps.err and "clock line" in details.err
    assert run("allan", log, "--json").err == quiet.err == ""


def test_loggers_are_those_of_rooms() -> None:
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert "getLogger(" not in text or path.name in ("loggers.py", "program.py"), path
        assert text.count("logger_of(") <= 1 or path.name == "loggers.py", path
