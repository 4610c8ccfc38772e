# SPDX-License-Identifier: BSD-3-Clause
"""Children of the page without the second of imports that each costs: forks of one process that has imported them all.

What a child does, how it is limited and how it is ended are as in the program; only its interpreter does not start.
Tests of processes as such start real ones.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

__all__ = ["Nest"]

TESTS = Path(__file__).resolve().parent
CHILD = "allanite.commands.cli.child"
#: What children import for results, figures and commands.
WARM = (
    CHILD, "allanite.commands.cli.program", "allanite.commands.page.tasks", "allanite.commands.page.documents",
    "allanite.commands.study", "allanite.files.readers.text", "allanite.recording.health.examination",
    "allanite.views.report",
    "allanite.views.terminal.page", "allanite.views.study", "allanite.views.plain_page", "allanite.views.registry",
    "allanite.views.figures.screen", "allanite.views.figures.picture", "allanite.views.figures.matplotlib",
    "matplotlib.figure", "scipy.linalg", "scipy.optimize", "scipy.special", "pyarrow.parquet",
)  # fmt: skip
#: Of a message: an environment.
_MOST = 1 << 17


class Nest:
    """The process that forks; it begins with the first child."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._line: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def subprocess(self) -> SimpleNamespace:
        """What stands for the module in `allanite.commands.page.children`."""
        return SimpleNamespace(PIPE=subprocess.PIPE, DEVNULL=subprocess.DEVNULL, Popen=self.child)

    def child(self, argv: Sequence[str], *, env: Mapping[str, str], **_: Any) -> Forked:
        """A child with pipes, which leads a group of its own."""
        assert list(argv[1:]) == ["-m", CHILD]
        task, to_child = os.pipe()
        from_child, words = os.pipe()
        pid = self._asked({"env": dict(env), "cwd": str(Path.cwd())}, (task, words))
        os.close(task)
        os.close(words)
        return Forked(self, pid, to_child, from_child)

    def code(self, pid: int) -> int:
        """Wait for the end of a child; its code as `subprocess` has it."""
        return self._asked({"wait": pid})

    def close(self) -> None:
        """End it."""
        if self._line is not None and self._process is not None:
            self._line.close()
            self._process.wait()

    def _asked(self, message: Mapping[str, Any], files: Sequence[int] = ()) -> int:
        with self._lock:
            if self._line is None:
                self._line, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
                call = (
                    f"import sys; sys.path.insert(0, {str(TESTS)!r}); import warmed_children as w; w.nest()"
                )
                self._process = subprocess.Popen([sys.executable, "-c", call], stdin=other)
                other.close()
            socket.send_fds(self._line, [json.dumps(message).encode()], files)
            return int(json.loads(self._line.recv(_MOST)))


class Forked:
    """What a page needs of `subprocess.Popen`."""

    def __init__(self, nest: Nest, pid: int, to_child: int, from_child: int) -> None:
        self.pid = pid
        self.stdin, self.stdout = os.fdopen(to_child, "wb"), os.fdopen(from_child, "rb")
        self._nest = nest
        self._lock, self._code = threading.Lock(), None

    def wait(self) -> int:
        """How it ended."""
        with self._lock:
            if self._code is None:
                self._code = self._nest.code(self.pid)
            return self._code


def nest() -> None:
    """Import everything, then fork at each message on standard input, or wait for a child."""
    for name in WARM:
        import_module(name)
    line = socket.socket(fileno=os.dup(0))
    while True:
        content, files, _, _ = socket.recv_fds(line, _MOST, 2)
        if not content:
            return
        message = json.loads(content)
        if "wait" in message:
            _, status = os.waitpid(message["wait"], 0)
            line.send(json.dumps(os.waitstatus_to_exitcode(status)).encode())
        elif os.fork() == 0:
            _begin(line, message, files)
        for file in files:
            os.close(file)


def _begin(line: socket.socket, message: Mapping[str, Any], files: Sequence[int]) -> None:
    """Be a child: a session, an environment and files of its own."""
    os.setsid()
    line.send(json.dumps(os.getpid()).encode())
    line.close()
    for number, file in enumerate(files):
        os.dup2(file, number)
        os.close(file)
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 2)
    os.close(nothing)
    os.environ.clear()
    os.environ.update(message["env"])
    os.chdir(message["cwd"])
    sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115 - a pipe, for good
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        import_module(CHILD).main()
    finally:
        os._exit(0)
