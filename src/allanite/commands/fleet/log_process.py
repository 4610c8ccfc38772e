# SPDX-License-Identifier: BSD-3-Clause
"""A process that characterizes logs: it forks a child for each, and watches its time and memory.

A line of JSON on standard input is a task, a line on standard output its outcome. It has imported all that a log needs
before it forks, and never reads a log itself: so a child begins at once, a log that crashes, hangs or swells costs its
child alone, and the memory of this process stays as it is. When standard input ends, this process and its child do.
"""

from __future__ import annotations

import gc
import json
import mmap
import os
import select
import shutil
import signal
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from allanite.commands.fleet import one_log
from allanite.plain_files.process_limits import limit_memory, limit_processor_time, memory_of_machine

__all__ = ["main"]

Json = Mapping[str, Any]

_LOOK = 0.05  # s between two looks at the memory of a child
_SHARE = 0.8  # of the memory of the machine, shared by its processors, where no limit is given
_CHUNK = 1 << 16


def main() -> None:
    """Do what comes, until standard input ends."""
    tasks = _TaskLines(os.dup(0))
    answers = os.fdopen(os.dup(1), "wb")
    _hide_streams()
    _warm()
    while (line := tasks.next()) is not None:
        task = json.loads(line)
        _import_scheme(str(task["place"]))
        answer = _answer(task, tasks, answers.fileno())
        if answer is None:
            break
        answers.write(answer + b"\n")
        answers.flush()


def _hide_streams() -> None:
    """What libraries print is nobody's."""
    with open(os.devnull, "r+b") as nothing:  # noqa: PTH123 - a device
        for stream in (0, 1, 2):
            os.dup2(nothing.fileno(), stream)


class _TaskLines:
    """Lines of a pipe, and whether its other end is gone."""

    def __init__(self, descriptor: int) -> None:
        self.descriptor, self._held = descriptor, b""

    def next(self) -> bytes | None:
        while b"\n" not in self._held:
            data = os.read(self.descriptor, _CHUNK)
            if not data:
                return None
            self._held += data
        line, _, self._held = self._held.partition(b"\n")
        return line


def _warm() -> None:
    """Import what a log needs, by characterizing a short record; nothing here starts a thread that stays."""
    import pyarrow.csv
    import pyarrow.parquet  # noqa: F401

    from allanite.commands.fleet.rows import rows_of
    from allanite.files.readers import READERS
    from allanite.filtering.simulation import simulate
    from allanite.noise import NoiseModel, White
    from allanite.study.characterization import characterize

    for reader in READERS:
        import_module(f"allanite.files.readers.{reader}")
    record = simulate(NoiseModel(terms=(White(N=1.0),)), rate=100.0, duration=40.0, seed=1)
    rows_of(characterize(record, threads=1))
    gc.collect()
    gc.freeze()  # a child that looks for cycles would copy every page of what is loaded


def _import_scheme(place: str) -> None:
    """What fetches from an address, before the fork."""
    if "://" in place:
        with suppress(Exception):  # the child says why
            import fsspec

            fsspec.get_filesystem_class(place.partition("://")[0])


def _answer(task: Json, tasks: _TaskLines, answers: int) -> bytes | None:
    """The outcome of a task as one line; None where nobody waits for it any more."""
    scratch = tempfile.mkdtemp(prefix="allanite-fleet.")
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        for descriptor in (
            tasks.descriptor,
            answers,
            reading,
        ):  # their other ends are to see its loss
            os.close(descriptor)
        _work(task, scratch, writing)
    os.close(writing)
    try:
        return _watched(task, child, reading, tasks.descriptor)
    finally:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(child, signal.SIGKILL)
        with suppress(ChildProcessError):
            os.waitpid(child, 0)
        os.close(reading)
        shutil.rmtree(scratch, ignore_errors=True)


def _work(task: Json, scratch: str, writing: int) -> None:
    """The child: do the task, say what came of it, and be gone."""
    code = 1
    try:
        os.setsid()
        os.environ["TMPDIR"] = tempfile.tempdir = scratch
        _limit(float(task["timeout"]))
        line = json.dumps(one_log.log_outcome(task)).encode()
        with os.fdopen(writing, "wb") as out:
            out.write(line)
        code = 0
    finally:
        os._exit(code)


def _limit(seconds: float) -> None:
    """No more memory than the machine has, no core file, and an end also where nobody watches any more."""
    with suppress(OSError, ValueError):
        limit_memory()
        limit_processor_time(int(seconds * (os.cpu_count() or 1)) + 60, grace=60)


def _watched(task: Json, child: int, reading: int, asking: int) -> bytes | None:
    """What a child says; the reason why it was ended, where it met a limit or died; None at the end of the input."""
    end = time.monotonic() + float(task["timeout"])
    most = task.get("memory") or _usual_memory()
    said_so_far = b""
    while True:
        ready, _, _ = select.select([reading, asking], [], [], _LOOK)
        if asking in ready:
            return None
        if reading in ready:
            data = os.read(reading, _CHUNK)
            if not data:
                return said_so_far if _ended_well(child) else _failed(_death(child))
            said_so_far += data
        if time.monotonic() > end:
            return _failed(
                f"LimitError: took more than {task['timeout']:g} s; allow more (--timeout) or read a part"
            )
        if _resident(child) > most:
            return _failed(
                f"LimitError: took more than {most / 2**20:.0f} MiB of memory; allow more (--memory)"
            )


_STATUS: dict[int, int] = {}


def _ended_well(child: int) -> bool:
    _, _STATUS[child] = os.waitpid(child, 0)
    return _STATUS[child] == 0


def _death(child: int) -> str:
    code = os.waitstatus_to_exitcode(_STATUS.pop(child))
    how = f"by {signal.Signals(-code).name}" if code < 0 else f"with status {code}"
    return f"Crash: the process of this log ended {how}; the log may be damaged"


def _failed(words: str) -> bytes:
    """The outcome of a log that met a limit: the next run tries it again."""
    return json.dumps({"sha256": None, "rows": [], "error": words, "findings": [], "again": True}).encode()


def _usual_memory() -> float:
    return _SHARE * memory_of_machine() / (os.cpu_count() or 1)


def _resident(child: int) -> int:
    """Memory of a process [bytes]; 0 where the system does not say."""
    with suppress(OSError, ValueError, IndexError):
        return int(Path(f"/proc/{child}/statm").read_text().split()[1]) * mmap.PAGESIZE
    return 0


if __name__ == "__main__":
    main()
