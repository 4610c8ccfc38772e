# SPDX-License-Identifier: BSD-3-Clause
"""Child processes that do the work: one is always ready, each is a group of processes that is ended as one.

What they are told and what they say are lines of JSON; see `allanite.commands.cli.child`.
"""

from __future__ import annotations

import json
import os
import queue
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import Any

from allanite.commands.page.replies import Refused
from allanite.commands.process_group import end_group

__all__ = ["Child", "Nursery", "Quick"]

Json = Mapping[str, Any]


class Child:
    """A process that waits for a task."""

    def __init__(self) -> None:
        self.scratch = tempfile.mkdtemp(prefix="allanite-page.")
        self._lock, self._ended = threading.Lock(), False
        self._process = subprocess.Popen(
            [sys.executable, "-m", "allanite.commands.cli.child"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            # What is kept of a log does not depend on a file of the bench, which may change.
            env={**os.environ, "PYTHONUNBUFFERED": "1", "ALLANITE_CONFIG": "none"},
        )

    def tell(self, task: Json) -> None:
        """Give it a task."""
        assert self._process.stdin is not None  # noqa: S101 - it is a pipe
        line = json.dumps({"scratch": self.scratch, **task}) + "\n"
        with suppress(BrokenPipeError):
            self._process.stdin.write(line.encode())
            self._process.stdin.flush()

    def words(self) -> Iterator[Json]:
        """What it says, until it is silent for ever."""
        assert self._process.stdout is not None  # noqa: S101
        for line in self._process.stdout:
            with suppress(ValueError):
                yield json.loads(line)

    def died(self) -> str:
        """How it ended, in words; waits for it."""
        code = self._process.wait()
        return f"by signal {-code} ({signal.Signals(-code).name})" if code < 0 else f"with status {code}"

    def end(self) -> None:
        """End it and all it has started, at once, and remove what it left."""
        with self._lock:
            if self._ended:
                return
            self._ended = True
            end_group(self._process.pid)
            self._process.wait()
            with suppress(OSError):
                if self._process.stdin is not None:
                    self._process.stdin.close()
        shutil.rmtree(self.scratch, ignore_errors=True)


class Nursery:
    """Keeps one child ready, so that work begins at once."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._spare: Child | None = None
        self._closed = False

    def take(self) -> Child:
        """A child that does one task."""
        with self._lock:
            child, self._spare = self._spare or Child(), None
        return child

    def prepare(self) -> None:
        """Have one ready."""
        with self._lock:
            if self._spare is None and not self._closed:
                self._spare = Child()

    def close(self) -> None:
        """End the one that waits."""
        with self._lock:
            self._closed = True
            if self._spare is not None:
                self._spare.end()
                self._spare = None


class Quick:
    """One child for answers that somebody waits for, one after the other; it is ended when it takes too long."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._lock = threading.Lock()
        self._child: Child | None = None
        self._answers: queue.SimpleQueue[Json | None] = queue.SimpleQueue()

    def prepare(self) -> None:
        """Have it ready, with what draws results."""
        with self._lock:
            self._alive().tell({"task": "warm"})

    def ask(self, task: Json) -> Json:
        """Do a task; the word about its end.

        Raises
        ------
        Refused
            It took too long, or died of it.
        """
        with self._lock:
            child = self._alive()
            child.tell(task)
            try:
                answer = self._answers.get(timeout=self._seconds)
            except queue.Empty:
                self._drop()
                raise Refused(503, f"this took more than {self._seconds:g} s: start it as a job") from None
            if answer is None:
                how = child.died()
                self._drop()
                raise Refused(400, f"the drawing process died {how}: the file may be damaged")
            return answer

    def close(self) -> None:
        """End it."""
        child = self._child  # not under the lock, which somebody may hold who waits for it
        if child is not None:
            child.end()

    def _alive(self) -> Child:
        if self._child is None:
            self._child, self._answers = Child(), queue.SimpleQueue()
            _thread(_listen, self._child, self._answers)
        return self._child

    def _drop(self) -> None:
        if self._child is not None:
            self._child.end()
        self._child = None


def _listen(child: Child, answers: queue.SimpleQueue[Json | None]) -> None:
    for word in child.words():
        if "ended" in word:
            answers.put(word["ended"])
    answers.put(None)


def _thread(work: Callable[..., None], *arguments: Any) -> None:
    threading.Thread(target=work, args=arguments, daemon=True).start()
