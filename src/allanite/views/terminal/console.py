# SPDX-License-Identifier: BSD-3-Clause
"""Where text goes: the console on stdout, plain tables, and a progress bar on stderr.

What an instrument or a file calls itself commands no terminal: streams and consoles show it as `printable` does.
"""

from __future__ import annotations

import errno
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from typing import TYPE_CHECKING, Any

from allanite.plain_files.printable import Shielded, printable

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
    from rich.segment import Segment
    from rich.table import Column, Table

__all__ = ["BETWEEN", "WIDE", "Advance", "console", "is_terminal", "listen", "progress", "table_of"]

Advance = Callable[..., None]

_listener: Advance | None = None

#: Columns where nobody looks: a pipe or a file.
WIDE = 400
#: Cells with more characters are words rather than numbers.
_WORDS = 30
#: Blanks between two columns.
BETWEEN = 3


@contextmanager
def progress(*, quiet: bool = False) -> Iterator[Advance | None]:
    """A bar on stderr from the first step on; None where stderr is no terminal, or with `quiet`.

    What it gives is called with a fraction and, if there is one, the name of the step.
    """
    if _listener is not None:
        yield _listener
        return
    if quiet or not is_terminal(sys.stderr) or os.environ.get("TERM") == "dumb":
        yield None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description:<24}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %")
    bar = Progress(
        *columns, TimeRemainingColumn(), console=_console_class()(file=_bare(sys.stderr)), transient=True
    )
    task = bar.add_task("", total=1.0)

    def advance(fraction: float, text: str = "") -> None:
        bar.start()
        bar.update(task, completed=fraction, description=text or None)

    try:
        yield advance
    finally:
        with suppress(OSError):  # the terminal may be gone by now
            bar.stop()


def listen(advance: Advance | None) -> None:
    """Tell the progress of every command of this process to somebody else, in place of a bar."""
    global _listener
    _listener = advance


def is_terminal(stream: Any) -> bool:
    """Whether somebody looks at a stream: one that was closed when the program began is None."""
    return stream is not None and bool(stream.isatty())


def console() -> Console:
    looked_at = is_terminal(sys.stdout)
    fixed = {} if looked_at or "COLUMNS" in os.environ else {"width": WIDE, "height": 25}
    bare = _bare(sys.stdout)
    file = bare if looked_at else _Trimmed(bare)
    return _console_class()(file=file, highlight=False, markup=False, emoji=False, **fixed)  # type: ignore[arg-type]


@cache
def _console_class() -> type[Console]:
    from rich.console import Console
    from rich.segment import Segment

    class ShieldedConsole(Console):
        """Escapes the text of what is rendered; colors and the cursor are the console's own."""

        def on_broken_pipe(
            self,
        ) -> None:  # rich would leave with exit code 1; the program has one place for it
            raise BrokenPipeError(errno.EPIPE, "the reader of stdout has gone")

        def render(
            self, renderable: RenderableType, options: ConsoleOptions | None = None
        ) -> Iterable[Segment]:
            for segment in super().render(renderable, options):
                yield (
                    segment
                    if segment.control
                    else Segment(printable(segment.text, lines=True), segment.style)
                )

    return ShieldedConsole


def _bare(stream: Any) -> Any:
    """The stream behind a shielded one: consoles color their own text."""
    return stream.bare if isinstance(stream, Shielded) else stream


class _Trimmed:
    """A pipe or a file without the blanks that would fill up a line of a terminal; or nothing, where stdout is none."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        if self._stream is not None:
            self._stream.write(re.sub(r"[ \t]+\n", "\n", text))
        return len(text)

    def flush(self) -> None:
        if self._stream is not None:
            self._stream.flush()

    def isatty(self) -> bool:
        return False

    @property
    def encoding(self) -> str:
        return getattr(self._stream, "encoding", None) or "utf-8"


def table_of(heads: Sequence[str], *, between: int = BETWEEN) -> Table:
    """A plain table: where a row is wider than the terminal, its words go on below; nothing is cut off."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    class Folding(Table):
        def __rich_console__(self, out: Console, options: ConsoleOptions) -> RenderResult:
            for least in (_WORDS, 0):  # first the columns of words, then all
                if sum(_needed(column) + between for column in self.columns) - between > options.max_width:
                    for column in self.columns:
                        column.no_wrap = column.no_wrap and max(_lengths(column)) <= least
            yield from super().__rich_console__(out, options)

    padding = (0, min(between - 1, 1), 0, max(between - 2, 0))  # beside the divider
    table = Folding(box=box.SIMPLE_HEAD, padding=padding, pad_edge=False, show_edge=False)
    for head in heads:
        table.add_column(Text(head), no_wrap=True, overflow="fold")
    return table


def _needed(column: Column) -> int:
    """Columns of the terminal without which words are cut."""
    return max(_lengths(column, words=not column.no_wrap))


def _lengths(column: Column, *, words: bool = False) -> Iterator[int]:
    from rich.cells import cell_len

    for cell in (column.header, *column.cells):
        for line in str(cell).splitlines() or [""]:
            yield from map(cell_len, line.split() or [""]) if words else (cell_len(line),)
