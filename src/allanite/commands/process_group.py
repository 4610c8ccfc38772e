# SPDX-License-Identifier: BSD-3-Clause
"""A process that leads a group, ended with all that it has started."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

__all__ = ["end_group", "end_own_group"]


def end_group(leader: int) -> None:
    """End a process that leads a group, and all that it has started, without asking them."""
    if sys.platform == "win32":
        _end_tree(leader)
        return
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(leader, signal.SIGKILL)


def end_own_group() -> None:
    """End this process without asking it; all of its group, if it leads one."""
    if sys.platform == "win32":
        _end_tree(os.getpid())
        return
    leads_group = os.getpgrp() == os.getpid()
    os.killpg(0, signal.SIGKILL) if leads_group else os.kill(os.getpid(), signal.SIGKILL)


def _end_tree(root: int) -> None:
    """Windows knows no groups that can be ended; it knows who started whom."""
    program = Path(os.environ["SYSTEMROOT"]) / "System32" / "taskkill.exe"
    subprocess.run([program, "/F", "/T", "/PID", str(root)], capture_output=True, check=False)
