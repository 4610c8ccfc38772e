# SPDX-License-Identifier: BSD-3-Clause
"""What results as text are made of: the verdict in its colour, tables, checks, advice, facts, findings and files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.plain_files.printable import printable
from allanite.views.terminal.console import table_of

if TYPE_CHECKING:
    from rich.console import Console

__all__ = [
    "TONES",
    "say_facts",
    "say_files",
    "say_indented",
    "say_rows",
]

Json = Mapping[str, Any]

TONES = {"good": "bold green", "warning": "bold yellow", "fatal": "bold red"}


def say_rows(out: Console, heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A table, and an empty line; nothing where there are no rows."""
    table = table_of(heads)
    for row in rows:
        table.add_row(*row)
    if table.row_count:
        out.print(table)
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
