# SPDX-License-Identifier: BSD-3-Clause
"""fleet watch: new logs as they come, each once it no longer grows."""

from __future__ import annotations

import shutil

import pytest

import allanite as al
from allanite.commands.fleet.watching import watch
from fleet_logs import column, write_log


@pytest.fixture
def fleet(tmp_path, monkeypatch):
    """A fleet of one log, made in one folder and watched from another."""
    monkeypatch.chdir(tmp_path)
    write_log(tmp_path / "logs" / "a.csv", seed=1)
    run = al.fleet("logs/*.csv", out="fleet", max_workers=1)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    return tmp_path, tmp_path / run.path


@pytest.mark.long
def test_one_look_takes_what_is_there(fleet, run):
    folder, table = fleet
    write_log(folder / "logs" / "b.csv", seed=2)
    done = run("fleet", "watch", "../fleet", "--once", "--workers", 1)
    assert (done.code, done.out) == (0, "1 log done\nwrote ../fleet/fleet.parquet\n")
    assert set(column(table, "log")) == {"logs/a.csv", "logs/b.csv"}
    shutil.rmtree(folder / "logs")
    assert run("fleet", "watch", "../fleet", "--once").out.startswith("0 logs done")
    assert set(column(table, "log")) == {"logs/a.csv", "logs/b.csv"}


@pytest.mark.long
def test_a_log_that_grows_waits(fleet, monkeypatch):
    folder, table = fleet
    looks = []

    def look_again(seconds):
        looks.append(seconds)
        if len(looks) == 1:
            write_log(folder / "logs" / "b.csv", seed=2, samples=700)
        elif len(looks) == 2:
            assert set(column(table, "log")) == {"logs/a.csv"}
            write_log(folder / "logs" / "b.csv", seed=2)
        assert len(looks) < 5

    monkeypatch.setattr("allanite.commands.fleet.watching.time.sleep", look_again)
    first = next(watch("../fleet", every=0.25, max_workers=1))
    assert first.done == 1 and looks == [0.25] * 3
    assert column(table, "samples", log="logs/b.csv", channel="gyro_x", term="N") == [1200]


@pytest.mark.long
def test_a_folder_that_is_no_fleet_is_refused_and_becomes_one(tmp_path, monkeypatch, run):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "made").mkdir()
    refused = run("fleet", "watch", "made", "--once")
    assert refused.code == 1
    assert "made is no fleet; make one: allanite fleet run 'logs/*' --out made" in refused.err
    write_log(tmp_path / "logs" / "a.csv", seed=1)
    assert run("fleet", "run", "logs/*", "--out", "made", "--workers", 1).code == 0
    assert run("fleet", "watch", "made", "--once").code == 0
