# SPDX-License-Identifier: BSD-3-Clause
"""A task on the machine that got it: handed to a process that has all loaded, one for each task at a time."""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
import threading
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from allanite import __version__
from allanite.errors import WorkerError

__all__ = ["end_processes", "run_log", "version"]

Json = Mapping[str, Any]


def version() -> str:
    """Of allanite, where a task would run."""
    return __version__


def run_log(task: Json) -> dict[str, Any]:
    """Characterize one log; see `allanite.commands.fleet.one_log`.

    Raises
    ------
    WorkerError
        Another version of allanite, or the process is lost: neither is the fault of the log.
    """
    if task["version"] != __version__:
        raise WorkerError(
            f"this worker has allanite {__version__}, the run {task['version']}: install one version"
        )
    process = _POOL.take()
    outcome = None
    try:
        outcome = process.outcome(task)
    finally:
        _POOL.give_back(process, alive=outcome is not None)
    return outcome


def end_processes() -> None:
    """End all processes of this worker at once."""
    _POOL.end()


class _LogProcess:
    """A process that waits for logs."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "allanite.commands.fleet.log_process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is for whoever started the run
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )

    def outcome(self, task: Json) -> dict[str, Any]:
        assert self._process.stdin is not None and self._process.stdout is not None  # noqa: S101 - pipes
        line = b""
        with suppress(OSError, ValueError):
            self._process.stdin.write(json.dumps(task).encode() + b"\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        if not line.endswith(b"\n"):
            raise WorkerError("the process that characterizes logs was lost; the log is tried again")
        outcome: dict[str, Any] = json.loads(line)
        return outcome

    def dismiss(self) -> None:
        """Close its input: it ends its child and itself, and whoever waits for it is told that it is lost."""
        with suppress(OSError, ValueError):
            if self._process.stdin is not None:
                self._process.stdin.close()

    def end(self) -> None:
        """The same, until it is gone."""
        self.dismiss()
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()


class _Pool:
    """Processes that wait, and those that work."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._idle: list[_LogProcess] = []
        self._busy: list[_LogProcess] = []

    def take(self) -> _LogProcess:
        with self._lock:
            process = self._idle.pop() if self._idle else _LogProcess()
            self._busy.append(process)
        return process

    def give_back(self, process: _LogProcess, *, alive: bool) -> None:
        with self._lock:
            if process in self._busy:
                self._busy.remove(process)
                if alive:
                    self._idle.append(process)
                    return
        process.end()

    def end(self) -> None:
        with self._lock:
            idle, self._idle = self._idle, []
            busy, self._busy = self._busy, []
        for process in busy:
            process.dismiss()
        for process in idle:
            process.end()


_POOL = _Pool()
atexit.register(end_processes)
