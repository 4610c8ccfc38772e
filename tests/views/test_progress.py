# SPDX-License-Identifier: BSD-3-Clause
"""The bar of a long call: below the cell of a notebook, on a terminal, and nowhere else."""

from __future__ import annotations

import inspect
import os
import pty
import re
import subprocess
import sys
from collections.abc import Iterator
from typing import Any, get_args

import pytest

import allanite as al

_CALL = """
import time
import allanite as al

model = al.NoiseModel.of(al.White(N=1e-4))
with al.progress_bar() as bar:
    for i in range(5):
        time.sleep(0.12)
        bar(0.2 * i, "drawing <samples>")
    al.simulate(model, rate=100.0, duration=60.0, seed=1, progress=bar)
"""


@pytest.fixture(scope="module")
def kernel() -> Iterator[Any]:
    """A kernel of Jupyter."""
    pytest.importorskip("ipykernel", reason="ipykernel is not installed")
    manager = pytest.importorskip("jupyter_client.manager")
    running, client = manager.start_new_kernel(kernel_name="python3")
    yield client
    client.stop_channels()
    running.shutdown_kernel(now=True)


def messages(kernel: Any, code: str) -> list[tuple[str, dict[str, Any]]]:
    """What a cell shows, in its order."""
    shown: list[tuple[str, dict[str, Any]]] = []
    reply = kernel.execute_interactive(
        code, output_hook=lambda message: shown.append((message["msg_type"], message["content"])), timeout=60
    )
    assert reply["content"]["status"] == "ok", reply["content"]
    return [(kind, content) for kind, content in shown if kind not in ("status", "execute_input")]


def test_a_notebook_shows_one_bar_that_moves_and_is_gone_at_the_end(kernel: Any) -> None:
    shown = messages(kernel, _CALL)
    kinds = [kind for kind, _ in shown]
    assert kinds == ["display_data", *["update_display_data"] * (len(kinds) - 1)]
    assert len({content["transient"]["display_id"] for _, content in shown}) == 1
    *bars, last = [content["data"]["text/html"] for _, content in shown]
    done = [float(re.findall(r'value="([\d.]+)"', bar)[0]) for bar in bars]
    assert done == sorted(done) and done[0] == 0.0 and len(set(done)) > 3
    assert "20 % drawing &lt;samples&gt;" in bars[2] and last == ""


def test_a_call_that_fails_leaves_no_bar(kernel: Any) -> None:
    code = "try:\n    with al.progress_bar() as bar:\n        raise ValueError\nexcept ValueError:\n    pass"
    shown = messages(kernel, "import allanite as al\n" + code)
    assert [content["data"]["text/html"] for _, content in shown][-1] == ""


def test_a_terminal_shows_it_on_stderr() -> None:
    reader, writer = pty.openpty()
    done = subprocess.run(
        [sys.executable, "-c", _CALL],
        stdout=subprocess.PIPE,
        stderr=writer,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100"},
        check=True,
        timeout=60,
    )
    os.close(writer)
    assert done.stdout == b"" and "drawing <samples>" in os.read(reader, 1 << 16).decode()
    os.close(reader)


def test_a_pipe_is_shown_nothing() -> None:
    done = subprocess.run([sys.executable, "-c", _CALL], capture_output=True, check=True, timeout=60)
    assert (done.stdout, done.stderr) == (b"", b"")


def test_every_function_that_takes_progress_takes_the_bar() -> None:
    """It is called with a fraction, or with a fraction and a text."""
    takes = {}
    for name, value in ((name, getattr(al, name)) for name in al.__all__):
        if inspect.isfunction(value) and "progress" in (stated := inspect.signature(value).parameters):
            called, _ = get_args(eval(stated["progress"].annotation, value.__globals__))
            takes[name] = get_args(called)[0]
    assert {"allan_curve", "characterize", "check", "select", "simulate", "filter_recording"} <= takes.keys()
    assert all(given in ([float], [float, str]) for given in takes.values()), takes
