# SPDX-License-Identifier: BSD-3-Clause
"""What Windows and macOS lack: without it the package imports, and goes from a log to its results."""

from __future__ import annotations

import os
import subprocess
import sys
import types
from pathlib import Path

import pytest

from allanite.commands.fleet.jobs import workers
from allanite.commands.page import captures
from allanite.errors import WorkerError
from allanite.plain_files import durable, file_lock

_ROOT = Path(__file__).parents[1]
#: Takes away what POSIX systems alone have, once the libraries of others are loaded, which may rely on it.
_AWAY = """
import importlib, os, pkgutil, select, signal, subprocess, sys, tempfile
import numpy, pyarrow.csv, pyarrow.parquet, scipy.optimize, scipy.stats, scipy.signal
import click, pydantic, rich.console, ruamel.yaml, jinja2, starlette, uvicorn, uvicorn.protocols.http.h11_impl
for name in ("fcntl", "resource", "pwd", "grp", "termios", "tty", "pty"):
    sys.modules[name] = None
for module, names in (
    (os, "fork killpg getpgrp setsid getuid geteuid sysconf fdatasync posix_fallocate fchmod pread pwrite "
         "O_CLOEXEC O_NOFOLLOW O_NONBLOCK O_NOCTTY O_DIRECTORY sched_getaffinity"),
    (signal, "SIGKILL SIGHUP"),
    (select, "poll"),
):
    for name in names.split():
        delattr(module, name)
"""
_IMPORT = """
import allanite
names = [m.name for m in pkgutil.walk_packages(allanite.__path__, "allanite.") if not m.name.endswith("__main__")]
for name in names:
    importlib.import_module(name)
print(len(names))
"""


def without_posix(code: str, *arguments: str | Path) -> str:
    command = [sys.executable, "-c", _AWAY + code, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_module_imports_without_what_posix_alone_has() -> None:
    assert int(without_posix(_IMPORT)) > 500


@pytest.mark.long
def test_a_log_becomes_its_results_without_what_posix_alone_has() -> None:
    code = "import runpy; runpy.run_path(sys.argv[1], run_name='__main__')"
    said = without_posix(code, _ROOT / "packaging" / "first_result.py")
    assert said.endswith("first result: as expected\n")


@pytest.mark.long
def test_what_was_taken_away_is_missed_where_it_is_used() -> None:
    with pytest.raises(AssertionError, match="fcntl"):
        without_posix("import fcntl")
    with pytest.raises(AssertionError, match="killpg"):
        without_posix("os.killpg")


# -- locks -------------------------------------------------------------------------------------------------------------

#: Locks of bytes as Windows has them, made of those of POSIX: they lie where the file stands, and are of a process.
_BYTES = """
import fcntl, os, sys, types
def locking(descriptor, mode, size):
    fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB, size, os.lseek(descriptor, 0, os.SEEK_CUR))
stand_in = types.SimpleNamespace(locking=locking, LK_NBLCK=2)
"""
_ASK = (
    _BYTES
    + """
from allanite.plain_files import file_lock
sys.modules["msvcrt"], sys.platform = stand_in, "win32"
with open(sys.argv[1], "r+b") as file:
    print(file_lock.is_locked(file.fileno()), file.read())
"""
)


def asked(path: Path) -> str:
    return subprocess.run(
        [sys.executable, "-c", _ASK, path], capture_output=True, text=True, check=True
    ).stdout.strip()


def test_a_lock_of_windows_leaves_the_content_to_readers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names: dict[str, object] = {}
    exec(_BYTES, names)
    path = tmp_path / "lock"
    path.write_bytes(b"content")
    assert asked(path) == "False b'content'"
    with path.open("r+b") as file:
        file.seek(3)
        with monkeypatch.context() as windows:
            windows.setitem(sys.modules, "msvcrt", names["stand_in"])
            windows.setattr(file_lock, "sys", types.SimpleNamespace(platform="win32"))
            assert file_lock.try_lock(file.fileno())
        assert file.tell() == 3
        assert asked(path) == "True b'content'"
    assert asked(path) == "False b'content'" and path.stat().st_size == 7


def test_a_lock_is_of_one_process_and_ends_with_its_file(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    with path.open("wb") as file, path.open("rb") as other:
        assert not file_lock.is_locked(other.fileno())
    with path.open("wb") as file, path.open("rb") as other:
        assert file_lock.try_lock(file.fileno())
        assert file_lock.is_locked(other.fileno()) and not file_lock.try_lock(other.fileno())
    with path.open("rb") as other:
        assert not file_lock.is_locked(other.fileno())


# -- media, processes --------------------------------------------------------------------------------------------------


def test_data_are_synced_whatever_calls_a_system_has(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    called: list[str] = []
    monkeypatch.setattr(os, "fdatasync", lambda descriptor: called.append("data"))
    monkeypatch.setattr(os, "fsync", lambda descriptor: called.append("file"))
    with (tmp_path / "x").open("wb") as file:
        durable.sync_data(file.fileno())
        monkeypatch.delattr(os, "fdatasync")
        durable.sync_data(file.fileno())
    durable.synced(tmp_path)
    assert called == ["data", "file", "file"]
    monkeypatch.setattr(durable, "_WINDOWS", True)
    durable.synced(tmp_path)
    assert len(called) == 3
    durable.synced(tmp_path / "x")
    assert len(called) == 4


def test_a_limit_of_memory_that_macos_refuses_is_not_set() -> None:
    code = (
        "import sys, resource; from allanite.plain_files.process_limits import limit_memory\n"
        "sys.platform = sys.argv[1]; limit_memory(1 << 40)\n"
        "print(resource.getrlimit(resource.RLIMIT_AS)[0], resource.getrlimit(resource.RLIMIT_CORE)[0])\n"
    )
    for platform, wanted in (("darwin", "-1 0"), ("linux", f"{1 << 40} 0")):
        done = subprocess.run(
            [sys.executable, "-c", code, platform], capture_output=True, text=True, check=True
        )
        assert done.stdout.strip() == wanted


def test_a_fleet_without_fork_says_where_it_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "fork")
    with pytest.raises(WorkerError, match="Subsystem for Linux"), workers():
        pass


def test_a_recorder_whose_process_cannot_be_told_from_another_is_not_taken_for_alive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(captures, "_began", lambda pid: "")
    known = captures._Capture(
        id="x",
        instrument="",
        command="",
        out=tmp_path,
        pid=os.getpid(),
        began="",
        started=0.0,
        log=tmp_path / "log",
    )
    assert not known.alive
