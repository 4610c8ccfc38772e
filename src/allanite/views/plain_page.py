# SPDX-License-Identifier: BSD-3-Clause
"""What the report of a result says, as plain data: for the page of `allanite serve`, whose script draws it."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import asdict

from allanite.errors import FormatError
from allanite.views.blocks import (
    Cards,
    Cell,
    Coefficients,
    Details,
    Drawn,
    Equation,
    Findings,
    PageBlock,
    References,
    TableBlock,
)
from allanite.views.pieces import finding_rows
from allanite.views.report import page_of
from allanite.views.wording.powers import raised_powers
from allanite.views.wording.study import CoefficientWording

__all__ = ["plain_page"]


def plain_page(result: object, *, only: Collection[str] | None = None) -> dict[str, object]:
    """What the report of a result says, without its method and provenance.

    Parameters
    ----------
    only : collection of str, optional
        Ids of the sections that are wanted.

    Returns
    -------
    dict
        "title", "kicker", "facts", and "sections", each with an "id", a "title" and "blocks" as
        `allanite.views.blocks` names their kinds and fields; numbers as people write them.

    Raises
    ------
    InputError
        Nothing that has a report of sections.
    FormatError
        A document that is damaged.
    """
    try:
        page = page_of(result)
        sections = [
            {"id": s.id, "title": s.title, "blocks": [*_blocks(s.blocks)]}
            for s in page.sections
            if not s.background and (only is None or s.id in only)
        ]
    except (ArithmeticError, AttributeError, LookupError, TypeError) as error:
        raise FormatError(f"the document is damaged: {type(error).__name__}: {error}") from error
    facts = [[name, _with_powers(value)] for name, value in page.facts]
    return {"title": page.title, "kicker": page.kicker, "facts": facts, "sections": sections}


def _blocks(blocks: Iterable[PageBlock]) -> Iterator[dict[str, object]]:
    for block in blocks:
        if not isinstance(block, (Equation, References)):
            yield {"kind": block.kind, **_fields(block)}


def _fields(block: PageBlock) -> dict[str, object]:
    match block:
        case Drawn(figure):
            return {"id": figure.id, "caption": figure.caption, "words": figure.words, "spec": figure.spec}
        case TableBlock(heads, rows, caption):
            cells = [[[*map(_cell, row)], kept] for row, kept in rows]
            return {"heads": _with_powers(heads), "rows": cells, "caption": caption}
        case Coefficients():
            return _coefficients(block)
        case Cards(items):
            return {"items": [[title, [*_blocks(inner)]] for title, inner in items]}
        case Details(summary, inner):
            return {"summary": summary, "blocks": [*_blocks(inner)]}
        case Findings(findings, rate):
            return {"rows": [asdict(row) for kind in finding_rows(findings, rate) for row in kind]}
        case _:
            return {name: _with_powers(value) for name, value in asdict(block).items()}


def _coefficients(block: Coefficients) -> dict[str, object]:
    """As a table: what is small in a report stands below."""
    heads = ["Channel", *block.columns]
    rows = [
        [[_cell(Cell(text=name)), *(_coefficient(read, si=block.si) for read in cells)], False]
        for name, cells in block.rows
    ]
    return {"kind": "table", "heads": heads, "rows": rows, "caption": block.caption}


def _coefficient(read: CoefficientWording | None, *, si: bool) -> dict[str, object]:
    if read is None:
        return _cell(Cell(text="–"))
    value, below = (read.si, read.si_range) if si else (read.value, read.range)
    starred = f"{value} *" if read.equivalent else value
    return _cell(Cell(text=starred, below=below, look="value" if read.supported else "limit"))


def _cell(cell: Cell) -> dict[str, object]:
    return {name: _with_powers(value) for name, value in asdict(cell).items()}


def _with_powers(value: object) -> object:
    """1.2e-05 as 1.2 × 10⁻⁵, in texts and lists of them."""
    if isinstance(value, str):
        return raised_powers(value)
    if isinstance(value, Sequence):
        return [_with_powers(part) for part in value]
    return value
