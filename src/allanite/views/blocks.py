# SPDX-License-Identifier: BSD-3-Clause
"""Blocks of a page: what stands in a section, one under another, whatever draws it.

A view makes a `Page` of a result; ``report`` draws it as HTML, ``terminal`` its verdicts, tables and facts, and
``plain_page`` hands it to the page of `allanite serve`. A new kind of block is one class here, and a branch in each.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.display_units import si_unit
from allanite.recording.health.finding import Finding
from allanite.views.figures import sheet_of
from allanite.views.pieces import Figure, origin_rows
from allanite.views.wording.study import ChannelGroup, CoefficientWording, KeyNumber, headings, readings

if TYPE_CHECKING:
    from allanite.study.results import ChannelModels

__all__ = [
    "Banner",
    "Bullets",
    "Cards",
    "Cell",
    "CoefficientHead",
    "Coefficients",
    "Details",
    "Drawn",
    "Equation",
    "Findings",
    "Hero",
    "KeyNumbers",
    "Page",
    "PageBlock",
    "Pairs",
    "References",
    "Section",
    "Subheading",
    "TableBlock",
    "Text",
    "bullets",
    "drawn",
    "equation",
    "figures_of",
    "page_of",
    "pairs",
    "provenance",
    "table",
]


@dataclass(frozen=True, slots=True)
class PageBlock:
    """What stands in a section."""

    kind: ClassVar[str]


@dataclass(frozen=True, slots=True)
class Banner(PageBlock):
    """The verdict: `tone` is "good", "warning" or "fatal". Those that are not `brief` stay out of a terminal."""

    kind = "banner"
    tone: str
    head: str
    text: str
    brief: bool = True


@dataclass(frozen=True, slots=True)
class Hero(PageBlock):
    """The one number, large."""

    kind = "hero"
    value: str
    unit: str
    interval: str
    beside: str
    tone: str


@dataclass(frozen=True, slots=True)
class KeyNumbers(PageBlock):
    """The numbers that answer the question, large and side by side; a terminal has them in its table."""

    kind = "numbers"
    items: Sequence[KeyNumber]


@dataclass(frozen=True, slots=True)
class Text(PageBlock):
    """A paragraph; a note is small and grey. A terminal shows those that are `brief`, and a `detail` when asked."""

    kind = "text"
    text: str
    note: bool = False
    brief: bool = False
    detail: bool = False


@dataclass(frozen=True, slots=True)
class Subheading(PageBlock):
    """A heading within a section. A terminal shows those that are `brief`."""

    kind = "heading"
    text: str
    brief: bool = False


@dataclass(frozen=True, slots=True)
class Bullets(PageBlock):
    """What to do, or to know. Those that are not `brief` stay out of a terminal."""

    kind = "bullets"
    items: Sequence[str]
    brief: bool = True


@dataclass(frozen=True, slots=True)
class Equation(PageBlock):
    """By the name of its macro in ``equations.html``."""

    kind = "equation"
    name: str


@dataclass(frozen=True, slots=True)
class References(PageBlock):
    """Numbered references."""

    kind = "references"
    items: Sequence[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """A cell of a table: words, small words below, and a look ("", "value", "limit", "si", "good", "fatal").

    A terminal shows what is below a value beside it, and of other cells the words alone; a `share` of the whole it
    shows as a bar, which a page draws in a figure.
    """

    text: str
    below: str = ""
    look: str = ""
    share: float | None = None


@dataclass(frozen=True, slots=True)
class TableBlock(PageBlock):
    """A table, its first column the names of the rows; a row is its cells, and whether it stands out.

    Those that are not `brief` stay out of a terminal.
    """

    kind = "table"
    heads: Sequence[str]
    rows: Sequence[tuple[Sequence[Cell], bool]]
    caption: str = ""
    brief: bool = True


@dataclass(frozen=True, slots=True)
class Coefficients(PageBlock):
    """Noise coefficients of channels that share their units, a row for each channel, in people's units or in SI."""

    kind = "coefficients"
    group: ChannelGroup[ChannelModels]
    si: bool = False

    @property
    def heads(self) -> Mapping[str, CoefficientHead]:
        """By column."""
        g = self.group
        return {
            s: CoefficientHead(symbol=head, unit=unit, name=g.name_of(s), si=si_unit(g.kind, s, g.unit))
            for s, (head, unit) in headings(g).items()
        }

    @property
    def rows(self) -> Sequence[tuple[str, Sequence[CoefficientWording | None]]]:
        """Name of each channel, and what it says of each column."""
        columns = list(self.heads)
        by_channel = [(c.name, readings(c)) for c in self.group.channels]
        return [(name, [read.get(s) for s in columns]) for name, read in by_channel]

    @property
    def columns(self) -> Sequence[str]:
        """What stands over each column, in one line."""
        return [f"{h.symbol} [{h.si if self.si else h.unit}]" for h in self.heads.values()]

    @property
    def caption(self) -> str:
        """What the table is."""
        return (
            f"{self.group.title}: noise coefficients{' in SI' if self.si else ''} with their 95 % intervals."
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class CoefficientHead:
    """What stands over a column of coefficients."""

    symbol: str
    unit: str
    name: str
    si: str


@dataclass(frozen=True, slots=True)
class Pairs(PageBlock):
    """Names with their values; `verbatim`: minus signs and powers as they are.

    A value of several texts is a first line with a list below it. Those that are not `brief` stay out of a terminal.
    """

    kind = "pairs"
    rows: Sequence[tuple[str, str | tuple[str, ...]]]
    verbatim: bool = False
    brief: bool = True


@dataclass(frozen=True, slots=True)
class Cards(PageBlock):
    """Boxes side by side, each with a title and blocks (no figures)."""

    kind = "cards"
    items: Sequence[tuple[str, Sequence[PageBlock]]]


@dataclass(frozen=True, slots=True)
class Details(PageBlock):
    """Blocks that are folded away."""

    kind = "details"
    summary: str
    blocks: Sequence[PageBlock]


@dataclass(frozen=True, slots=True)
class Drawn(PageBlock):
    """A figure."""

    kind = "figure"
    figure: Figure


@dataclass(frozen=True, slots=True)
class Findings(PageBlock):
    """What was found in the record; its `rate` [Hz] turns samples into times.

    Where they come `first`, a terminal ends with a line for each kind; otherwise with the grave ones.
    """

    kind = "findings"
    findings: Sequence[Finding]
    rate: float
    first: bool = False


# -- pages --------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A part of the page with an entry in its navigation."""

    id: str
    title: str
    blocks: Sequence[PageBlock]
    short: str = ""  # in the navigation

    @property
    def background(self) -> bool:
        """How the result was made: a report folds it away, the page of `allanite serve` leaves it to the report."""
        return self.id in ("method", "provenance")


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """What a result says, in its order.

    Attributes
    ----------
    title : str
    kicker : str
        What the page is about, above the title.
    facts : sequence of (str, str)
        Beside the title.
    sections : sequence of Section
        Those that hold something.
    """

    title: str
    kicker: str
    facts: Sequence[tuple[str, str]]
    sections: Sequence[Section]

    def blocks(self) -> Iterator[PageBlock]:
        """All blocks, one after another."""
        for section in self.sections:
            yield from section.blocks


def page_of(
    *, title: str, kicker: str, facts: Sequence[tuple[str, str]], sections: Sequence[Section]
) -> Page:
    """A page; facts and sections that say nothing are left out."""
    return Page(
        title=title,
        kicker=kicker,
        facts=[(name, value) for name, value in facts if value],
        sections=[s for s in sections if s.blocks],
    )


def figures_of(blocks: Iterable[PageBlock]) -> Iterator[Figure]:
    """The figures among blocks, those that are folded away too."""
    for block in blocks:
        if isinstance(block, Drawn):
            yield block.figure
        elif isinstance(block, Details):
            yield from figures_of(block.blocks)


# -- words ------------------------------------------------------------------------------------------------


def bullets(items: Sequence[str], *, brief: bool = True) -> list[PageBlock]:
    """A list; nothing where there are no items."""
    return [Bullets(items, brief)] if items else []


def equation(*names: str) -> list[PageBlock]:
    """Equations."""
    return [Equation(name) for name in names]


# -- tables -----------------------------------------------------------------------------------------------


def table(
    heads: Sequence[str],
    rows: Sequence[Sequence[str | Cell]],
    *,
    caption: str = "",
    kept: Sequence[bool] = (),
    brief: bool = True,
) -> list[PageBlock]:
    """A table; nothing where there are no rows. `kept` rows stand out."""
    cells = [[c if isinstance(c, Cell) else Cell(text=c) for c in row] for row in rows]
    marks = list(kept) or [False] * len(cells)
    return [TableBlock(heads, list(zip(cells, marks, strict=True)), caption, brief)] if rows else []


def pairs(
    rows: Sequence[tuple[str, str | tuple[str, ...]]], *, verbatim: bool = False, brief: bool = True
) -> PageBlock:
    """Names with their values; those without a value are left out."""
    return Pairs([(name, value) for name, value in rows if value], verbatim=verbatim, brief=brief)


# -- figures and the rest ---------------------------------------------------------------------------------


def drawn(id_: str, obj: object, caption: str, words: str, **options: object) -> list[PageBlock]:
    """The figure of a result; nothing where the result has nothing to draw under these options."""
    try:
        sheet = sheet_of(obj, **options)
    except InputError:
        return []
    return [Drawn(Figure(id=id_, caption=caption, words=words, sheet=sheet))]


def provenance(
    made: Mapping[str, object], format_: str, version: int, history: Iterable[Mapping[str, object]] = ()
) -> Section:
    """The last section of every page; see `origin_rows`."""
    rows = origin_rows(made, format_, version, history)
    return Section(id="provenance", title="Provenance", blocks=[pairs(rows, verbatim=True, brief=False)])
