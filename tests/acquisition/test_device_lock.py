# SPDX-License-Identifier: BSD-3-Clause
"""The lock of a device between users who do not trust each other."""

from __future__ import annotations

import json
import os
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from allanite.acquisition.capture import device_lock
from allanite.acquisition.capture.device_lock import locked_device
from allanite.errors import InstrumentError

_DEVICE = "/dev/ttyX"


@pytest.fixture
def lock(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Where the lock lies: a folder that everybody may write to, and reach."""
    with tempfile.TemporaryDirectory(prefix="allanite-locks-") as folder:
        Path(folder).chmod(0o1777)
        monkeypatch.setattr(device_lock, "_SHARED", (Path(folder),))
        yield device_lock._path_of(_DEVICE)


def refusal() -> str:
    with pytest.raises(InstrumentError) as refused, locked_device(_DEVICE):
        pass
    return str(refused.value)


@contextmanager
def held_by_another(lock: Path) -> Iterator[int]:
    """Another process holds the lock that is there; its number."""
    code = "import fcntl, sys; f = open(sys.argv[1]); fcntl.flock(f, fcntl.LOCK_EX); print(1, flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", code, lock], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None and process.stdin is not None
        process.stdout.readline()
        yield process.pid
        process.stdin.close()


@pytest.mark.parametrize("mask", [0o000, 0o022, 0o077, 0o777])
def test_others_can_lock_it_and_cannot_write_into_it(lock: Path, mask: int) -> None:
    before = os.umask(mask)
    try:
        with locked_device(_DEVICE):
            assert stat.S_IMODE(lock.stat().st_mode) == 0o644
    finally:
        os.umask(before)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can be two users")
def test_a_lock_that_another_user_left_is_taken_and_one_that_is_held_refuses(lock: Path) -> None:
    lock.write_text(json.dumps({"device": _DEVICE, "process": os.getpid()}))
    lock.chmod(0o644)
    code = (
        "import os, sys; from pathlib import Path\n"
        "from allanite.acquisition.capture import device_lock as d\n"
        "from allanite.errors import InstrumentError\n"
        "os.setgid(65534); os.setuid(65534); d._SHARED = (Path(sys.argv[1]),)\n"
        "try:\n"
        "    with d.locked_device(sys.argv[2]) as lock: print('taken')\n"
        "except InstrumentError as error: print(error)\n"
    )
    ask = [sys.executable, "-c", code, str(lock.parent), _DEVICE]
    done = subprocess.run(ask, capture_output=True, text=True, check=True)
    assert done.stdout == "taken\n" and lock.exists()  # the file of root stays, as it was
    with locked_device(_DEVICE):
        done = subprocess.run(ask, capture_output=True, text=True, check=True)
    assert f"is being recorded by process {os.getpid()}" in done.stdout


def test_what_is_not_a_regular_file_is_refused_and_does_not_hang(lock: Path) -> None:
    os.mkfifo(lock)
    assert "cannot be locked" in refusal()
    lock.unlink()
    lock.symlink_to(lock.parent / "elsewhere")
    assert "cannot be locked" in refusal() and not (lock.parent / "elsewhere").exists()


def test_nobody_is_told_to_stop_a_process_that_does_not_hold_it(lock: Path) -> None:
    """A file left by the dead, or written by somebody else, names a process that is not the holder's."""
    for process in (2**22 + 1, -1, "1; reboot", None, [1]):
        lock.write_text(json.dumps({"device": _DEVICE, "process": process, "run": "/x"}))
        with held_by_another(lock):
            assert "by another process: stop that one (kill PID)" in refusal()
    lock.write_text("\xff{")
    with held_by_another(lock):
        assert "by another process" in refusal()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can be two users")
def test_a_process_of_another_user_than_the_file_s_is_not_named(lock: Path) -> None:
    lock.write_text(json.dumps({"device": _DEVICE, "process": os.getpid()}))
    os.chown(lock, 65534, 65534)
    with held_by_another(lock):
        assert "by another process: stop that one (kill PID)" in refusal()
