# SPDX-License-Identifier: BSD-3-Clause
"""A child process of `allanite serve`: it does one thing at a time, within limits, and dies with its parent.

A line of JSON on standard input says what: ``{"task": "command", "argv": [...]}`` is a command as it would be typed;
"warm" prepares for results, and has no answer;
the others are those of `allanite.commands.page.tasks`. Lines of JSON on standard output tell how it goes and how it
ended. When standard input ends, because the server is gone, this process and all it has started end too.

It is started before there is anything to do, so that a command begins at once.
"""

from __future__ import annotations

import io
import json
import os
import queue
import sys
import tempfile
import threading
import time
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout, suppress
from typing import Any, TextIO

from allanite.commands.cli.failures import FAILED, failure
from allanite.commands.process_group import end_own_group
from allanite.errors import AllaniteError
from allanite.plain_files.json_values import plain
from allanite.plain_files.process_limits import limit_memory

__all__ = ["main"]

Json = Mapping[str, Any]

#: Seconds between two words about the progress.
_EVERY = 0.1
#: Of what a command prints, and of what it complains [characters].
_MOST = 64 << 20
#: What a damaged result raises where it is drawn: an answer, not a defect.
_DAMAGED = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)


def main() -> None:
    """Do what comes, until standard input ends."""
    out = os.fdopen(os.dup(1), "w", encoding="utf-8", buffering=1)
    with open(os.devnull, "w") as nothing:  # noqa: PTH123 - a device; what libraries print is not for the server
        os.dup2(nothing.fileno(), 1)
    _limit_memory()
    tasks = _incoming()
    _warm()
    while (line := tasks.get()) is not None:
        task = json.loads(line)
        if task["task"] == "warm":
            _warm_views()
            continue
        _say(out, {"ended": _done(task, out)})


def _incoming() -> queue.SimpleQueue[str | None]:
    """Lines of standard input; at its end, also in the middle of a task, everything here is over."""
    lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()

    def listen() -> None:
        for line in sys.stdin:
            lines.put(line)
        end_own_group()

    threading.Thread(target=listen, daemon=True).start()
    return lines


def _warm() -> None:
    """What every task needs; the rest is imported when it is wanted."""
    import numpy  # noqa: F401


def _warm_views() -> None:
    """What draws a result: whoever waits for the first one does not wait for this."""
    import allanite.study.characterization
    import allanite.views.figures.screen
    import allanite.views.plain_page
    import allanite.views.registry  # noqa: F401


def _limit_memory() -> None:
    """No more than the machine has: a file that asks for it gets a MemoryError, and the machine goes on."""
    with suppress(OSError, ValueError):
        limit_memory()


def _say(out: TextIO, word: Json) -> None:
    out.write(json.dumps(word, ensure_ascii=True) + "\n")
    out.flush()


def _done(task: Json, out: TextIO) -> Json:
    """Do it; the word about its end."""
    scratch = task.get("scratch")
    if scratch is not None:  # what is left there by a child that was killed is removed with it
        os.environ["TMPDIR"] = tempfile.tempdir = str(scratch)
    if task.get("cwd") is not None:
        os.chdir(task["cwd"])
    advance = _Advance(out)
    try:
        if task["task"] == "command":
            return _with_figure(_command(task["argv"], advance), task)
        if task["task"] == "follow":
            from allanite.commands.page.tasks import follow

            def tell(event: str, data: Json) -> None:
                _say(out, {"event": event, "data": plain(data)})

            follow(task["run"], tell, every=float(task.get("every", 1.0)))
            return {"exit": 0}
        from allanite.commands.page.tasks import TASKS

        return {"exit": 0, "result": plain(TASKS[task["task"]](task, advance))}
    except Exception as error:  # noqa: BLE001 - as a command ends
        if isinstance(error, _DAMAGED) and not isinstance(error, AllaniteError):
            return {"exit": FAILED, "message": f"damaged or unsupported: {error}"}
        code, words = failure(error)
        return {"exit": code, "message": words}


def _command(argv: list[str], advance: _Advance) -> Json:
    """Run a command of the program in this process, as the program would."""
    from allanite.commands.cli.program import main as program
    from allanite.views.terminal.console import listen

    sys.argv = ["allanite", *argv]
    listen(advance)
    printed, complained = io.StringIO(), io.StringIO()
    code: Any = 0
    with redirect_stdout(printed), redirect_stderr(complained):
        try:
            program(argv)
        except SystemExit as left:
            code = left.code
    listen(None)
    return {
        "exit": int(code or 0), "stdout": printed.getvalue()[:_MOST], "stderr": complained.getvalue()[-_MOST:]
    }  # fmt: skip


def _with_figure(end: Json, task: Json) -> Json:
    """What a command printed, drawn, where that was asked for."""
    if not task.get("figure") or end["exit"]:
        return end
    from allanite.commands.page.documents import figure_of

    return {**end, "figure": plain(figure_of(json.loads(end["stdout"])))}


class _Advance:
    """Tells the progress, now and then."""

    def __init__(self, out: TextIO) -> None:
        self._out, self._last, self._text = out, 0.0, ""

    def __call__(self, fraction: float, text: str = "") -> None:
        now = time.monotonic()
        changed = bool(text) and text != self._text
        self._text = text or self._text
        if changed or now - self._last >= _EVERY:
            self._last = now
            _say(self._out, {"progress": min(max(float(fraction), 0.0), 1.0), "step": self._text})


if __name__ == "__main__":
    main()
