# SPDX-License-Identifier: BSD-3-Clause
"""Blocks of a page: what stands in a section, one under another, as plain data for ``sections.html``.

A page of a measurement is a list of sections, and a section a list of these. A new kind of block is one function
here and one branch in the template.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from allanite.errors import InputError
from allanite.views.figures import sheet_of
from allanite.views.figures.panel import DARK, LIGHT
from allanite.views.report.pieces import Figure, finding_row, provenance_rows

__all__ = [
    "Block",
    "Cell",
    "Section",
    "banner",
    "bullets",
    "cards",
    "details",
    "drawn",
    "equation",
    "findings",
    "heading",
    "hero",
    "page_of",
    "pairs",
    "provenance",
    "references",
    "shown",
    "table",
    "text",
]

Json = Mapping[str, Any]
Block = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A part of the page with an entry in its navigation."""

    id: str
    title: str
    blocks: Sequence[Block]
    short: str = ""  # in the navigation


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """A cell of a table: words, small words below, and a look ("", "value", "limit", "si", "good", "fatal")."""

    text: str
    below: str = ""
    look: str = ""


def page_of(
    *, title: str, kicker: str, facts: Sequence[tuple[str, str]], sections: Sequence[Section]
) -> dict[str, Any]:
    """Everything that ``sections.html`` needs; sections without a block are left out."""
    filled = [s for s in sections if s.blocks]
    figures = {f.id: f.spec for s in filled for f in _figures(s.blocks)}
    return {
        "title": title,
        "kicker": kicker,
        "facts": [(name, value) for name, value in facts if value],
        "sections": filled,
        "figures": figures,
        "palettes": {"light": LIGHT, "dark": DARK},
    }


def _figures(blocks: Iterable[Block]) -> Iterable[Figure]:
    for block in blocks:
        if block["kind"] == "figure":
            yield block["figure"]
        elif block["kind"] == "details":
            yield from _figures(block["blocks"])


# -- words ------------------------------------------------------------------------------------------------


def banner(tone: str, head: str, words: str) -> Block:
    """The verdict: `tone` is "good", "warning" or "fatal"."""
    return {"kind": "banner", "tone": tone, "head": head, "text": words}


def hero(value: str, unit: str, interval: str, beside: str, tone: str) -> Block:
    """The one number, large."""
    return {
        "kind": "hero",
        "value": value,
        "unit": unit,
        "interval": interval,
        "beside": beside,
        "tone": tone,
    }


def text(words: str, *, note: bool = False) -> Block:
    """A paragraph; a note is small and grey."""
    return {"kind": "text", "text": words, "note": note}


def heading(words: str) -> Block:
    """A heading within a section."""
    return {"kind": "heading", "text": words}


def bullets(items: Sequence[str]) -> list[Block]:
    """A list; nothing where there are no items."""
    return [{"kind": "bullets", "items": items}] if items else []


def equation(*names: str) -> list[Block]:
    """Equations by the names of the macros in ``equations.html``."""
    return [{"kind": "equation", "name": name} for name in names]


def references(items: Sequence[str]) -> Block:
    """Numbered references."""
    return {"kind": "references", "items": items}


# -- tables -----------------------------------------------------------------------------------------------


def table(
    heads: Sequence[str],
    rows: Sequence[Sequence[str | Cell]],
    *,
    caption: str = "",
    kept: Sequence[bool] = (),
) -> list[Block]:
    """A table, its first column the names of the rows; nothing where there are no rows. `kept` rows stand out."""
    cells = [[c if isinstance(c, Cell) else Cell(text=c) for c in row] for row in rows]
    marks = list(kept) or [False] * len(cells)
    made = {"kind": "table", "heads": heads, "rows": list(zip(cells, marks, strict=True)), "caption": caption}
    return [made] if rows else []


def pairs(rows: Sequence[tuple[str, str | tuple[str, ...]]], *, verbatim: bool = False) -> Block:
    """Names with their values; those without a value are left out. `verbatim`: minus signs and powers as they are.

    A value of several texts is a first line with a list below it.
    """
    return {"kind": "pairs", "rows": [(name, value) for name, value in rows if value], "verbatim": verbatim}


def cards(items: Sequence[tuple[str, Sequence[Block]]]) -> Block:
    """Boxes side by side, each with a title and blocks (no figures)."""
    return {"kind": "cards", "items": items}


def details(summary: str, blocks: Sequence[Block]) -> Block:
    """Blocks that are folded away."""
    return {"kind": "details", "summary": summary, "blocks": blocks}


# -- figures and the rest ---------------------------------------------------------------------------------


def shown(figure: Figure) -> Block:
    """A figure."""
    return {"kind": "figure", "figure": figure}


def drawn(id_: str, obj: object, caption: str, words: str, **options: Any) -> list[Block]:
    """The figure of a result; nothing where the result has nothing to draw under these options."""
    try:
        sheet = sheet_of(obj, **options)
    except InputError:
        return []
    return [shown(Figure.of(id_, sheet, caption, words))]


def findings(document: Json) -> list[Block]:
    """What was found in the record; nothing where nobody looked."""
    if "findings" not in document:
        return []
    from allanite.views.wording import finding_kinds

    rate = document["recording"]["rate"]
    kinds = [[finding_row(f, rate) for f in kind] for kind in finding_kinds(document["findings"])]
    return [{"kind": "findings", "rows": kinds}]


def provenance(document: Json) -> Section:
    """The last section of every page."""
    return Section(
        id="provenance", title="Provenance", blocks=[pairs(provenance_rows(document), verbatim=True)]
    )
