# SPDX-License-Identifier: BSD-3-Clause
"""What the documents tell a reader to do: commands, Python blocks and files, in the order of a page.

Fenced ``console`` blocks hold commands (``$ allanite ...``) and, optionally, output: each line of output shown must
come out of the command (runs of blanks count as one; a line with an ellipsis matches anything there). Fenced
``python`` blocks of one page share their names. Comments that a reader does not see steer the test::

    <!-- run: allanite simulate ... -->     prepares a file that the page uses
    <!-- write: sensor.json {...} -->       writes a file that the page uses
    <!-- skip: reason -->                   the next block is not run
    <!-- exit: 1 -->                        the commands of the next block end with this code
    <!-- file: sensor.json -->              the next block, of any language, is the content of this file
    <!-- python: x = 1 -->                  prepares or checks what a reader need not see; may use internals
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

__all__ = ["PAGES", "PIECES", "ROOT", "Step", "shown", "steps"]

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PIECES = re.compile(
    r"<!-- (?P<verb>run|write|skip|exit|file|python):\s(?P<text>.*?)\s-->|^```(?P<language>[a-z]*)\n(?P<body>.*?)^```$",
    re.M | re.S,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One thing to do: a command with the output shown below it, a Python block, or a file to write."""

    line: int
    command: str = ""
    code: int = 0
    output: tuple[str, ...] = ()
    python: str = ""
    file: str = ""
    content: str = ""


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
    said: dict[str, str] = {}
    for piece in PIECES.finditer(text):
        line = text.count("\n", 0, piece.start()) + 1
        if piece["verb"] == "run":
            found.append(Step(line=line, command=" ".join(piece["text"].split())))
        elif piece["verb"] == "write":
            name, content = piece["text"].split(None, 1)
            found.append(Step(line=line, file=name, content=content))
        elif piece["verb"] == "python":
            found.append(Step(line=line, python=piece["text"]))
        elif piece["verb"]:
            said[piece["verb"]] = piece["text"]
        else:
            if "file" in said:
                found.append(Step(line=line, file=said["file"], content=piece["body"]))
            elif "skip" not in said and piece["language"] == "console":
                found += commands(piece["body"], line, int(said.get("exit", 0)))
            elif "skip" not in said and piece["language"] == "python":
                found.append(Step(line=line, python=piece["body"]))
            said = {}
    return found


def shown(wanted: str, text: str) -> bool:
    """True when a line of output printed in a document comes out of the command."""
    parts = [re.escape(" ".join(part.split())) for part in re.split(r"…|\.\.\.", wanted)]
    squeezed = "\n".join(" ".join(line.split()) for line in text.splitlines())
    return re.search(".*".join(parts), squeezed) is not None
