# SPDX-License-Identifier: BSD-3-Clause
"""A page as text: its verdict, tables, advice and facts; figures, equations and references are for a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from allanite.quantities.result import Result
from allanite.recording.health import Severity
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Banner, Bullets, Cell, Findings, Page, PageBlock, Pairs, TableBlock
from allanite.views.blocks import Text as PlainText
from allanite.views.registry import view_of
from allanite.views.terminal.console import console
from allanite.views.terminal.measurements import show_rate_vector
from allanite.views.terminal.parts import TONES, say_advice, say_facts, say_files, say_rows
from allanite.views.terminal.study import show_findings

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

__all__ = ["show_document", "show_page"]


def show_document(
    document: Mapping[str, object] | ResultDocument[Result], files: Sequence[object] = ()
) -> None:
    """The document of a command; that of a rate vector is a mapping as yet."""
    if isinstance(document, Mapping):
        show_rate_vector(document, files)
    else:
        show_page(view_of(document), files)


def show_page(page: Page, files: Sequence[object] = ()) -> None:
    """A page, with what was found in the record, and the files, at its end."""
    out = console()
    blocks = list(page.blocks())
    for block in blocks:
        _show(out, block)
    for group in (b for b in blocks if isinstance(b, Findings)):
        show_findings([f for f in group.findings if f.severity is not Severity.INFO])
    say_files(out, files)


def _show(out: Console, block: PageBlock) -> None:
    from rich.text import Text

    match block:
        case Banner(tone, head, words):
            out.print(Text.assemble((head, TONES[tone]), f" {words}"))
            out.print()
        case TableBlock(heads, rows):
            say_rows(out, heads, [[_cell(cell, kept=kept) for cell in cells] for cells, kept in rows])
        case PlainText(words, brief=True):
            out.print(words)
            out.print()
        case Bullets(items):
            say_advice(out, items)
        case Pairs(rows, brief=True):
            say_facts(out, *((name, value) for name, value in rows if isinstance(value, str)))
        case _:
            pass


def _cell(cell: Cell, *, kept: bool) -> Text:
    """Its words, with the interval of a value, in the colour of an answer; those of a row that stands out in bold."""
    from rich.text import Text

    interval = f" {cell.below}" if cell.look == "value" and cell.below else ""
    return Text.assemble((cell.text, TONES.get(cell.look, "bold" if kept else "")), interval)
