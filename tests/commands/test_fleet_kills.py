# SPDX-License-Identifier: BSD-3-Clause
"""A fleet run that is killed at any moment goes on, and its table is that of a run that nobody disturbed."""

from __future__ import annotations

import os
import random
import select
import signal
import subprocess
import sys
import time

import pytest

from allanite.commands.fleet.running import fleet
from fleet_logs import PATTERN, rows_without_times, write_fleet

LOGS, KILLS = 5, 3
#: Also where the tests run in the background of a shell, which ignores Ctrl-C for them.
_PROGRAM = (
    "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
    "from allanite.__main__ import main\nmain()"
)
_PATIENCE = 120.0  # s for a step of a run on a busy machine


def started(folder):
    """A run in a process group of its own."""
    return subprocess.Popen(
        [
            sys.executable, "-c", _PROGRAM, "fleet", "run", "logs/**/*.csv", "--pattern", PATTERN, "--out", "fleet",
            "--workers", "1",
        ],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )  # fmt: skip


def done_by(run, folder, count, pause=0.0):
    """Wait until a run has kept so many logs more, or has ended, and then for a moment."""
    parts = folder / "fleet" / ".fleet" / "parts"

    def kept():
        return len(list(parts.glob("[0-9]*"))) if parts.is_dir() else 0

    goal, end = kept() + count, time.monotonic() + _PATIENCE
    while kept() < goal and run.poll() is None:
        assert time.monotonic() < end, "the run makes no progress"
        time.sleep(0.005)
    select.select([], [], [], pause)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    write_fleet(folder / "logs", LOGS)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        return rows_without_times(fleet("logs/**/*.csv", pattern=PATTERN, out="fleet").path)


@pytest.mark.long
def test_a_run_that_is_killed_three_times_ends_with_the_same_table(tmp_path, undisturbed):
    write_fleet(tmp_path / "logs", LOGS)
    moments = random.Random(25)
    for k in range(KILLS):
        run = started(tmp_path)
        done_by(run, tmp_path, count=k % 2, pause=moments.uniform(0.0, 0.25))
        assert run.poll() is None, "the run had ended before it was killed"
        os.killpg(run.pid, signal.SIGKILL)
        run.communicate()
    last = started(tmp_path)
    _, words = last.communicate(timeout=_PATIENCE)
    assert last.returncode == 0, words
    assert rows_without_times(tmp_path / "fleet" / "fleet.parquet") == undisturbed
    hidden = [p.name for p in (tmp_path / "fleet").iterdir() if p.name.startswith(".fleet.parquet")]
    assert hidden == [] and list((tmp_path / "fleet" / ".fleet" / "parts").iterdir()) == []


@pytest.mark.long
def test_ctrl_c_keeps_what_is_done_and_leaves_no_process(tmp_path, undisturbed):
    write_fleet(tmp_path / "logs", LOGS)
    run = started(tmp_path)
    done_by(run, tmp_path, count=2)
    run.send_signal(signal.SIGINT)
    _, words = run.communicate(timeout=_PATIENCE)
    assert run.returncode == 130 and b"interrupted" in words
    kept = rows_without_times(tmp_path / "fleet" / "fleet.parquet")
    assert len({row["log"] for row in kept}) >= 2
    assert [row for row in kept if row not in undisturbed] == []
    assert started(tmp_path).wait(timeout=_PATIENCE) == 0
    assert rows_without_times(tmp_path / "fleet" / "fleet.parquet") == undisturbed
