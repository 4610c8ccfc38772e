# SPDX-License-Identifier: BSD-3-Clause
"""What a shell completes: commands, options, choices, consumers, findings and files, and how soon."""

from __future__ import annotations

import os
import re
import resource
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from allanite.commands.cli import cli
from allanite.exporters import EXPORTERS
from allanite.recording.health.catalogue import CATALOGUE

GUIDE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "install.md"
LIMIT = 0.3  # [s] of processor time, from the Tab key to the names


def completed(words: str, shell: str = "bash") -> list[tuple[str, str]]:
    """Type and word of each completion of a line that ends where the cursor stands."""
    line = shlex.split(words) + ([""] if words.endswith(" ") else [])
    variables = {
        "_ALLANITE_COMPLETE": f"{shell}_complete",
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(line) - 1),
    }
    done = subprocess.run(
        [sys.executable, "-m", "allanite"],
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        check=False,
        timeout=30,
    )
    assert done.stderr == ""
    pairs = [row.partition(",") for row in done.stdout.splitlines()]
    return [(kind, word) for kind, _, word in pairs]


def words_of(line: str) -> set[str]:
    return {word for _, word in completed(line)}


def test_commands_and_those_below_them() -> None:
    assert words_of("allanite ") == set(cli.commands)
    assert words_of("allanite ch") == {"characterize"}
    assert words_of("allanite fleet ") == set(cli.commands["fleet"].commands)  # type: ignore[attr-defined]


def test_options_and_choices() -> None:
    assert {"--unit", "--plot", "--accept"} <= words_of("allanite characterize --")
    assert words_of("allanite allan log.csv --engine ") == {"exact", "decimated", "auto"}
    assert words_of("allanite info log.csv --samp") == {"--sampling"}


def test_consumers_and_findings() -> None:
    assert words_of("allanite export ") == {name.replace("_", "-") for name in EXPORTERS}
    assert words_of("allanite export gaz") == {"gazebo", "gazebo-classic"}
    fatal = words_of("allanite characterize log.csv --accept ")
    assert {"clipping", "broken_up"} <= fatal <= CATALOGUE.keys() and "repaired" not in fatal


@pytest.mark.parametrize(
    "line",
    [
        "allanite characterize gy",
        "allanite allan gy",
        "allanite fit gy",
        "allanite compare a.csv gy",
        "allanite diff a.json gy",
        "allanite simulate st",
        "allanite export kalibr st",
        "allanite filter log.csv --model st",
        "allanite fleet run gy",
        "allanite characterize log.csv --floor gy",
        "allanite serve gy",
    ],
)
def test_where_a_file_is_due_the_shell_completes_files(line: str) -> None:
    ((kind, word),) = completed(line)
    assert kind == "file" and word == line.split()[-1]


@pytest.mark.parametrize("line", ["allanite ", "allanite characterize --", "allanite export "])
def test_it_takes_less_than_the_blink_of_an_eye(line: str) -> None:
    taken = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        completed(line)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        taken.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    assert min(taken) < LIMIT, taken


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_line_of_the_guide_is_that_of_the_shell(shell: str) -> None:
    (line,) = re.findall(
        rf"\| `([^`]*_ALLANITE_COMPLETE={shell}_source[^`]*)` \|", GUIDE.read_text(encoding="utf-8")
    )
    (command,) = re.findall(r"_ALLANITE_COMPLETE=\w+ allanite", line)
    assert command == f"_ALLANITE_COMPLETE={shell}_source allanite"
    done = subprocess.run(
        [sys.executable, "-m", "allanite"],
        env={**os.environ, "_ALLANITE_COMPLETE": f"{shell}_source"},
        capture_output=True,
        text=True,
        check=False,
        timeout=30,
    )
    assert f"_ALLANITE_COMPLETE={shell}_complete" in done.stdout


@pytest.mark.skipif(not shutil.which("bash"), reason="there is no bash")
def test_bash_completes_by_the_line_of_the_guide(tmp_path: Path) -> None:
    program = tmp_path / "allanite"
    program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m allanite "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    (line,) = re.findall(r"\| `(eval [^`]*bash_source[^`]*)` \|", GUIDE.read_text(encoding="utf-8"))
    script = (
        f"{line}\nCOMP_WORDS=(allanite export gaz)\nCOMP_CWORD=2\n"
        '_allanite_completion allanite gaz export\necho "${COMPREPLY[@]}"\n'
    )
    done = subprocess.run(
        ["bash", "-c", script],
        env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.stdout.split() == ["gazebo", "gazebo-classic"], done.stderr
