# SPDX-License-Identifier: BSD-3-Clause
"""The unit of systemd that a recording writes: the command that was typed, and when it begins again."""

from __future__ import annotations

import configparser
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from allanite.commands.unit_file import unit_text
from allanite.errors import InputError
from shell import Run

WORDS = ["record", "simulated", "--model", 'N=0.3 deg/√h, "B"=5', "--name", "100% $HOME", "--out", "my runs"]


def unit(words: list[str] = WORDS, folder: str = "/work dir") -> str:
    return unit_text(
        words, name="gyro.service", out="my runs", folder=folder, user="ada", program=(sys.executable, "-m", "allanite")
    )  # fmt: skip


def read(text: str) -> configparser.ConfigParser:
    parsed = configparser.ConfigParser(interpolation=None, strict=False)
    parsed.optionxform = str  # type: ignore[assignment,method-assign]
    parsed.read_string(text)
    return parsed


def words_of(line: str) -> list[str]:
    """As systemd reads a command line: quotes, then %% and $$."""
    return [word.replace("%%", "%").replace("$$", "$") for word in shlex.split(line)]


def test_the_command_is_the_one_that_was_typed() -> None:
    for extra in (["--unit-file", "gyro.service"], ["--unit-file=gyro.service"]):
        service = read(unit([*WORDS[:2], *extra, *WORDS[2:]]))["Service"]
        assert words_of(service["ExecStart"]) == [sys.executable, "-m", "allanite", *WORDS]
    assert (service["User"], service["WorkingDirectory"]) == ("ada", "/work dir")


def test_a_run_that_ended_is_never_begun_again() -> None:
    parsed = read(unit())
    service = parsed["Service"]
    assert service["Restart"] == "on-failure" and service["SuccessExitStatus"] == "3"
    assert service["RestartPreventExitStatus"] == "2" and service["KillSignal"] == "SIGINT"
    assert parsed["Unit"]["ConditionPathExists"] == "!/work dir/my runs/gyro.done"


@pytest.mark.parametrize(
    ("result", "system", "marked"),
    [
        ("success", "running", True),
        ("success", "degraded", True),
        ("success", "stopping", False),  # the machine goes down: another run when it is up again
        ("exit-code", "running", False),
        ("signal", "running", False),
    ],
)
def test_the_mark_of_an_end(tmp_path: Path, result: str, system: str, marked: bool) -> None:
    (tmp_path / "my runs").mkdir()
    (tmp_path / "systemctl").write_text(f"#!/bin/sh\necho {system}\n")
    (tmp_path / "systemctl").chmod(0o755)
    command = words_of(read(unit(folder=str(tmp_path)))["Service"]["ExecStopPost"])
    subprocess.run(
        command,
        env={"SERVICE_RESULT": result, "PATH": f"{tmp_path}:{os.environ['PATH']}"},
        check=True,
        timeout=20,
    )
    assert (tmp_path / "my runs" / "gyro.done").exists() is marked


def test_systemd_takes_it(tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd-analyze is not installed")
    monkeypatch.chdir(tmp_path)
    words = [
        "record",
        "simulated",
        "--model",
        "N=0.3 deg/√h",
        "--rate",
        "8",
        "--out",
        "runs",
        "--unit-file",
        "a.service",
    ]
    monkeypatch.setattr(sys, "argv", ["allanite", *words])
    done = run(*words)
    assert (done.code, done.out.strip()) == (0, "a.service") and not (tmp_path / "runs").exists()
    checked = subprocess.run(
        ["systemd-analyze", "verify", "./a.service"], capture_output=True, text=True, timeout=60, check=False
    )
    assert checked.returncode == 0 and "a.service" not in checked.stderr, checked.stderr
    assert run(*words).code == 1  # the file is there


def test_names_and_words_that_cannot_be() -> None:
    with pytest.raises(InputError, match="not a unit name"):
        unit_text([], name="gyro", out="x", folder="/", user="ada", program=["a"])
    with pytest.raises(InputError, match="line break"):
        unit(["record", "a\nb"])
