# SPDX-License-Identifier: BSD-3-Clause
"""A page as text: its verdict, tables, advice and facts; figures, equations and references are for a report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from allanite.recording.health import Severity
from allanite.views.blocks import Banner, Bullets, Findings, Page, PageBlock, Pairs, TableBlock
from allanite.views.terminal.console import console
from allanite.views.terminal.parts import TONES, say_advice, say_facts, say_files, say_rows
from allanite.views.terminal.study import show_findings

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["show_page"]


def show_page(page: Page, files: Sequence[object] = ()) -> None:
    """A page, with what was found in the record, and the files, at its end."""
    out = console()
    blocks = list(page.blocks())
    for block in blocks:
        _show(out, block)
    for found in (b for b in blocks if isinstance(b, Findings)):
        show_findings([f for f in found.findings if f.severity is not Severity.INFO])
    say_files(out, files)


def _show(out: Console, block: PageBlock) -> None:
    from rich.text import Text

    match block:
        case Banner(tone, head, words):
            out.print(Text.assemble((head, TONES[tone]), f" {words}"))
            out.print()
        case TableBlock(heads, rows):
            say_rows(out, heads, [[cell.text for cell in cells] for cells, _ in rows])
        case Bullets(items):
            say_advice(out, items)
        case Pairs(rows, brief=True):
            say_facts(out, *((name, value) for name, value in rows if isinstance(value, str)))
        case _:
            pass
