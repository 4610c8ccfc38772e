# SPDX-License-Identifier: BSD-3-Clause
"""Where text goes: the console on stdout, plain tables, and a progress bar on stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

__all__ = ["WIDE", "Advance", "console", "progress", "table_of"]

Advance = Callable[..., None]

#: Columns where nobody looks: a pipe or a file.
WIDE = 400


@contextmanager
def progress(*, quiet: bool = False) -> Iterator[Advance | None]:
    """A bar on stderr; None where stderr is no terminal, or with `quiet`.

    What it gives is called with a fraction and, if there is one, the name of the step.
    """
    if quiet or not sys.stderr.isatty() or os.environ.get("TERM") == "dumb":
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description:<24}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %")
    with Progress(*columns, TimeRemainingColumn(), console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)

        def advance(fraction: float, text: str = "") -> None:
            bar.update(task, completed=fraction, description=text or None)

        yield advance


def console() -> Console:
    from rich.console import Console

    fixed = {} if sys.stdout.isatty() or "COLUMNS" in os.environ else {"width": WIDE, "height": 25}
    return Console(file=sys.stdout, highlight=False, markup=False, emoji=False, **fixed)  # type: ignore[arg-type]


def table_of(heads: Sequence[str]) -> Table:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for head in heads:
        table.add_column(Text(head), no_wrap=True)
    return table
