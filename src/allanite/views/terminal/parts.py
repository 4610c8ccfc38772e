# SPDX-License-Identifier: BSD-3-Clause
"""What results as text are made of: the verdict in its colour, tables, checks, advice, facts, findings and files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.plain_files.printable import printable
from allanite.recording.health import Finding
from allanite.views.terminal.console import table_of
from allanite.views.terminal.study import show_findings
from allanite.views.wording import check_lines, headline, sentence, tone

if TYPE_CHECKING:
    from rich.console import Console

__all__ = [
    "TONES",
    "say_advice",
    "say_checks",
    "say_end",
    "say_facts",
    "say_files",
    "say_indented",
    "say_rows",
    "say_verdict",
]

Json = Mapping[str, Any]

TONES = {"good": "bold green", "warning": "bold yellow", "fatal": "bold red"}


def say_verdict(out: Console, verdict: str, reason: str) -> None:
    """Verdict and reason in one sentence, the verdict in its colour."""
    from rich.text import Text

    text = Text(headline(verdict, reason))
    text.stylize(TONES[tone(verdict)], 0, len(verdict))
    out.print(text)
    out.print()


def say_rows(out: Console, heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A table, and an empty line; nothing where there are no rows."""
    table = table_of(heads)
    for row in rows:
        table.add_row(*row)
    if table.row_count:
        out.print(table)
        out.print()


def say_checks(out: Console, checks: Sequence[Json]) -> None:
    """What was asked of the residuals, and the answers."""
    from rich.text import Text

    answers = {True: Text("passed", "green"), False: Text("not passed", "bold red")}
    lines = ((c.name, answers[c.passed], c.measure, c.chance) for c in check_lines(checks))
    say_rows(out, ("Check", "", "χ² (expected)", ""), lines)


def say_advice(out: Console, advice: Sequence[str], names: Sequence[str] = ()) -> None:
    """Sentences behind arrows, and an empty line; `names` stay as they are written."""
    for words in advice:
        say_indented(out, f"→ {sentence(words, names)}")
    if advice:
        out.print()


def say_facts(out: Console, *facts: tuple[str, str]) -> None:
    """Names, and what there is to say of them."""
    from rich.table import Table

    grid = Table.grid(padding=(0, 2))
    for name, value in facts:
        grid.add_row(name, value)
    out.print(grid)
    out.print()


def say_indented(out: Console, text: str, style: str = "") -> None:
    """A line that starts two columns in, where it is broken, too."""
    from rich.padding import Padding
    from rich.text import Text

    out.print(Padding(Text(text, style), (0, 0, 0, 2), expand=False))


def say_files(out: Console, files: Sequence[object]) -> None:
    """What was written; files of one folder in one line."""
    folders: dict[str, list[str]] = {}
    for file in files:
        place = Path(str(file))
        folders.setdefault(str(place.parent), []).append(place.name)
    for folder, names in folders.items():
        head = str(Path(folder) / names[0])
        out.print(f"wrote {printable(', '.join([head, *names[1:]]))}", soft_wrap=True)


def say_end(out: Console, document: Json, files: Sequence[object]) -> None:
    """How every measurement ends: findings that somebody has to know, and the files."""
    show_findings([Finding.from_json(f) for f in document.get("findings", ()) if f["severity"] != "info"])
    say_files(out, files)
