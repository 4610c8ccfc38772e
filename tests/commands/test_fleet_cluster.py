# SPDX-License-Identifier: BSD-3-Clause
"""A fleet on the workers of a Dask scheduler over TCP: one is killed in the middle, one comes late."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

import allanite as al
from allanite.commands.fleet import jobs, worker
from fleet_logs import rows_without_times, write_fleet

distributed = pytest.importorskip("distributed")

LOGS = 8


@pytest.fixture
def scheduler(tmp_path) -> Iterator[str]:
    """The address of a scheduler in a process of its own, on this machine."""
    place = tmp_path / "scheduler.json"
    code = (
        "import asyncio\n"
        "from distributed import Scheduler\n"
        "async def main():\n"
        f"    s = await Scheduler(host='127.0.0.1', port=0, dashboard=False, scheduler_file={str(place)!r})\n"
        "    print(s.address, flush=True)\n"
        "    await s.finished()\n"
        "asyncio.run(main())\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    assert process.stdout is not None
    yield process.stdout.readline().strip()
    process.kill()
    process.communicate()


class Crew:
    """Worker processes."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.processes: list[subprocess.Popen] = []

    def add(self) -> subprocess.Popen:
        code = (
            "import asyncio\n"
            "from distributed import Worker\n"
            "async def main():\n"
            f"    w = await Worker({self.address!r}, nthreads=1, host='127.0.0.1', dashboard=False)\n"
            "    await w.finished()\n"
            "asyncio.run(main())\n"
        )
        self.processes.append(
            subprocess.Popen(
                [sys.executable, "-c", code], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
        )
        return self.processes[-1]

    def end(self) -> None:
        for process in self.processes:
            process.kill()
            process.wait()


@pytest.fixture
def crew(scheduler) -> Iterator[Crew]:
    workers = Crew(scheduler)
    yield workers
    workers.end()


@pytest.mark.long
def test_a_worker_that_is_killed_and_one_that_comes_late(tmp_path, monkeypatch, crew):
    monkeypatch.chdir(tmp_path)
    write_fleet(tmp_path / "logs", LOGS)
    first = crew.add()
    crew.add()
    steps = []
    with jobs.dask_client(crew.address) as client:
        client.wait_for_workers(2, timeout=60)

        def happens(fraction, words):
            steps.append(words)
            if len(steps) == 2:
                os.kill(first.pid, signal.SIGKILL)
                crew.add()

        run = al.fleet("logs/**/*.csv", out="fleet", client=client, progress=happens)
        client.wait_for_workers(2, timeout=60)
    assert run.failed == () and run.done == len(steps) == LOGS
    here = al.fleet("logs/**/*.csv", out="here", max_workers=1)
    assert rows_without_times(run.path) == rows_without_times(here.path)


@pytest.mark.long
def test_the_command_uses_a_scheduler_and_refuses_other_versions(tmp_path, monkeypatch, crew, run):
    monkeypatch.chdir(tmp_path)
    write_fleet(tmp_path / "logs", 1)
    crew.add()
    with distributed.Client(crew.address) as client:
        client.wait_for_workers(1, timeout=60)
    done = run("fleet", "run", "logs/**/*.csv", "--out", "fleet", "--scheduler", crew.address)
    assert done.code == 0, done.err
    monkeypatch.setattr(jobs, "__version__", "99.0")
    refused = run("fleet", "run", "logs/**/*.csv", "--out", "other", "--scheduler", crew.address)
    assert refused.code == 1
    assert "all workers need allanite 99.0: tcp://127.0.0.1:" in refused.err


def test_a_worker_of_another_version_does_no_log():
    with pytest.raises(
        al.WorkerError, match=r"this worker has allanite .*, the run 99\.0: install one version"
    ):
        worker.run_log({"log": "a.csv", "version": "99.0"})


def test_a_scheduler_that_is_not_there(run, tmp_path, monkeypatch):
    monkeypatch.setattr(jobs, "_ANSWER", 0.2)
    done = run(
        "fleet", "run", tmp_path / "*.csv", "--out", tmp_path / "f", "--scheduler", "tcp://127.0.0.1:9"
    )
    assert done.code == 1 and "no scheduler answers at tcp://127.0.0.1:9" in done.err
