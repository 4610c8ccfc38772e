# SPDX-License-Identifier: BSD-3-Clause
"""Every command and every Python block of the documents runs, page by page, in an empty folder.

Fenced ``console`` blocks hold commands (``$ allanite ...``) and, optionally, output: each line of output shown must
come out of the command (runs of blanks count as one; a line with an ellipsis matches anything there). Fenced
``python`` blocks of one page share their names. Comments that a reader does not see steer the test::

    <!-- run: allanite simulate ... -->     prepares a file that the page uses
    <!-- skip: reason -->                   the next block is not run
    <!-- exit: 1 -->                        the commands of the next block end with this code
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PIECES = re.compile(
    r"<!-- (?P<verb>run|skip|exit): (?P<text>.*?) -->|^```(?P<language>console|python)\n(?P<body>.*?)^```$",
    re.M | re.S,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One thing to run: a command with the output shown below it, or a Python block."""

    line: int
    command: str = ""
    code: int = 0
    output: tuple[str, ...] = ()
    python: str = ""


def commands(body: str, line: int, code: int) -> Iterator[Step]:
    """The commands of a console block; a command goes on after a backslash."""
    joined = body.replace("\\\n", " ")
    for chunk in re.split(r"^\$ ", joined, flags=re.M)[1:]:
        command, *output = chunk.splitlines()
        lines = tuple(text for text in output if text.strip())
        yield Step(line=line, command=command.strip(), code=code, output=lines)


def steps(page: Path) -> list[Step]:
    """What to run on a page, in its order."""
    text = page.read_text(encoding="utf-8")
    found: list[Step] = []
    skip, code = False, 0
    for piece in PIECES.finditer(text):
        line = text.count("\n", 0, piece.start()) + 1
        if piece["verb"] == "skip":
            skip = True
        elif piece["verb"] == "exit":
            code = int(piece["text"])
        elif piece["verb"] == "run":
            found.append(Step(line=line, command=" ".join(piece["text"].split())))
        elif skip:
            skip = False
        elif piece["language"] == "console":
            found += commands(piece["body"], line, code)
            code = 0
        else:
            found.append(Step(line=line, python=piece["body"]))
    return found


def shown(wanted: str, text: str) -> bool:
    """True when a line of output printed in a document comes out of the command."""
    parts = [re.escape(" ".join(part.split())) for part in re.split(r"…|\.\.\.", wanted)]
    squeezed = "\n".join(" ".join(line.split()) for line in text.splitlines())
    return re.search(".*".join(parts), squeezed) is not None


def assert_command_runs(step: Step, where: str) -> None:
    program, *words = shlex.split(step.command, comments=True)
    assert program == "allanite", (
        f"{where}: only allanite itself is run here; put a skip comment before the block"
    )
    done = subprocess.run(
        [sys.executable, "-m", "allanite", *words],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "COLUMNS": "120", "NO_COLOR": "1"},
        check=False,
    )
    report = f"{where}: $ {step.command}\n{done.stdout}\n{done.stderr}"
    assert done.returncode == step.code, report
    for wanted in step.output:
        assert shown(wanted, done.stdout + done.stderr), f"{report}\ndoes not contain: {wanted}"


def assert_python_runs(step: Step, page: Path, names: dict[str, object]) -> None:
    # Empty lines put the block on its own line numbers, so that a traceback points into the page.
    exec(compile("\n" * step.line + step.python, str(page), "exec"), names)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_page_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "__main__"}
    for step in steps(page):
        if step.command:
            assert_command_runs(step, f"{page.name}:{step.line}")
        else:
            assert_python_runs(step, page, names)


def test_the_reader_of_pages_sees_commands_output_and_comments(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "<!-- run: allanite a -->\n```console\n$ allanite b \\\n    --c\nout … 1\n$ allanite d\n```\n"
        "<!-- skip: slow -->\n```console\n$ make demo\n```\n```python\nx = 1\n```\n"
        "<!-- exit: 1 -->\n```console\n$ allanite e\n```\n",
        encoding="utf-8",
    )
    found = [(step.command.split(), step.output, step.python, step.code) for step in steps(page)]
    assert found == [
        (["allanite", "a"], (), "", 0),
        (["allanite", "b", "--c"], ("out … 1",), "", 0),
        (["allanite", "d"], (), "", 0),
        ([], (), "x = 1\n", 0),
        (["allanite", "e"], (), "", 1),
    ]
    assert shown("out … 1", "a\nout  put   1\n")
    assert not shown("out … 1", "out\n1\n")


def test_units_of_the_reference_are_understood_and_alike() -> None:
    from allanite.units import parse_unit

    page = (ROOT / "docs" / "reference" / "units.md").read_text(encoding="utf-8")
    rows = [row.split("|")[1:4] for row in re.findall(r"^\| .* \|$", page, re.M) if row.count("|") == 4]
    rows = [row for row in rows if row[1].strip() not in ("", "SI unit") and "," not in row[0]]
    assert len(rows) == 12
    for name, si, others in rows:
        canonical = parse_unit(si.strip())
        assert canonical.factor == 1.0, si
        for text in others.split(","):
            assert parse_unit(text.strip()).quantity is canonical.quantity, f"{text} is not a unit of {name}"
