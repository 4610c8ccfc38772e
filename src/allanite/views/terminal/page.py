# SPDX-License-Identifier: BSD-3-Clause
"""A page as text: its verdict, tables, advice and facts; figures, equations and references are for a report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from allanite.quantities.display_units import read_in_si
from allanite.recording.health.finding import Severity
from allanite.study.result_document import Reportable
from allanite.views.blocks import (
    Banner,
    Bullets,
    Cell,
    Coefficients,
    Findings,
    Page,
    PageBlock,
    Pairs,
    Subheading,
    TableBlock,
)
from allanite.views.blocks import Text as PlainText
from allanite.views.result_page import view_of
from allanite.views.terminal.coefficients import say_coefficients
from allanite.views.terminal.console import console
from allanite.views.terminal.parts import (
    TONES,
    say_facts,
    say_files,
    say_indented,
    say_rows,
)
from allanite.views.terminal.study import show_finding_lines, show_findings, show_movement
from allanite.views.terminal.style import BRIEF, TerminalStyle

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

    from allanite.study.results import ChannelModels

__all__ = ["show_blocks", "show_document", "show_models", "show_page"]


#: Columns of the bar of a whole.
_LONGEST = 20
#: Findings that say what an interval holds: shown with every result.
_OF_INTERVALS = {"scale_uncertain"}


def show_document(
    document: Reportable,
    files: Sequence[object] = (),
    notes: Sequence[str] = (),
    *,
    style: TerminalStyle = BRIEF,
) -> None:
    """The document of a command."""
    with read_in_si(style.si):
        page = view_of(document)
    show_page(page, files, notes, style=style)


def show_page(
    page: Page, files: Sequence[object] = (), notes: Sequence[str] = (), *, style: TerminalStyle = BRIEF
) -> None:
    """A page: its answer first, then what was found in the record, and at its end notes and files."""
    out = console()
    if not style.quiet:
        with read_in_si(style.si):
            blocks = list(page.blocks())
        findings = [block for block in blocks if isinstance(block, Findings)]
        for each in (block for block in findings if block.first):
            show_movement(each.findings)
        show_blocks(blocks, style=style)
        for each in findings:
            _show_findings(each, style)
    for note in notes:
        out.print(note, soft_wrap=True)
    say_files(out, files)


def _show_findings(block: Findings, style: TerminalStyle) -> None:
    """Those of a study in a line each or in full; of another result the grave ones, and what its intervals lack."""
    if not block.first:
        show_findings(
            [f for f in block.findings if f.severity is not Severity.INFO or f.code in _OF_INTERVALS]
        )
    elif style.details:
        show_findings(block.findings)
    else:
        show_finding_lines(block.findings)


def show_blocks(blocks: Iterable[PageBlock], *, style: TerminalStyle = BRIEF) -> None:
    """Blocks one below the other, those that a terminal shows."""
    out = console()
    for block in blocks:
        _show(out, block, style)


def show_models(channels: Sequence[ChannelModels], *, style: TerminalStyle = BRIEF) -> None:
    """The coefficients of models that were fitted."""
    from allanite.views.study import parameter_blocks

    with read_in_si(style.si):
        blocks = list(parameter_blocks(channels))
    show_blocks(blocks, style=style)


def _show(out: Console, block: PageBlock, style: TerminalStyle) -> None:
    from rich.text import Text

    match block:
        case Banner(tone, head, words, brief=True):
            out.print(Text.assemble((head, TONES[tone]), f" {words}"))
            out.print()
        case TableBlock(heads, rows, brief=True):
            say_rows(out, heads, [[_cell(cell, kept=kept) for cell in cells] for cells, kept in rows])
        case PlainText(words, brief=brief, detail=detail) if brief or (detail and style.details):
            out.print(words)
            out.print()
        case Subheading(words, brief=True):
            out.print(words, style="bold")
        case Bullets(items, brief=True):
            for words in items:
                say_indented(out, f"→ {words}")
            out.print()
        case Coefficients():
            say_coefficients(out, block, si=style.si)
        case Pairs(rows, brief=True):
            say_facts(out, *((name, value) for name, value in rows if isinstance(value, str)))
        case _:
            pass


def _cell(cell: Cell, *, kept: bool) -> Text:
    """Its words, with the interval of a value, in the colour of an answer; those of a row that stands out in bold."""
    from rich.text import Text

    interval = f" {cell.below}" if cell.look == "value" and cell.below else ""
    if cell.share is not None:
        bar = "█" * round(_LONGEST * cell.share) or "▏"
        return Text(f"{bar.ljust(_LONGEST)} {cell.text}")
    return Text.assemble(
        (cell.text, TONES.get(cell.look, "bold" if kept or cell.look == "value best" else "")), interval
    )
