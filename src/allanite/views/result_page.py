# SPDX-License-Identifier: BSD-3-Clause
"""What the pages of all results share: their order, the verdict, advice, findings, and where they come from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module

from allanite.quantities.result import Result
from allanite.quantities.verdict import Verdict
from allanite.study.result_document import Reportable
from allanite.views.blocks import (
    Banner,
    Findings,
    Page,
    PageBlock,
    Section,
    bullets,
    drawn,
    page_of,
    provenance,
)
from allanite.views.registry import VIEWS
from allanite.views.wording.rates import sentence

__all__ = ["advice", "findings_of", "pictures", "result_page", "verdict_banner", "view_of"]


def result_page(
    document: Reportable,
    *,
    title: str,
    kicker: str,
    facts: Sequence[tuple[str, str]],
    sections: Mapping[str, tuple[str, Sequence[PageBlock]]],
) -> Page:
    """The page of a result.

    Parameters
    ----------
    sections : mapping of str to (str, sequence of PageBlock)
        Title and blocks by the section's id, in their order; where the result comes from is added.
    """
    parts = [Section(id=id_, title=name, blocks=blocks) for id_, (name, blocks) in sections.items()]
    return page_of(title=title, kicker=kicker, facts=facts, sections=[*parts, _provenance(document)])


def view_of(document: Reportable) -> Page:
    """The page of a result."""
    view: Callable[[Reportable], Page] = import_module(VIEWS[document.result.FORMAT].view).view
    return view(document)


def _provenance(document: Reportable) -> Section:
    made, record = document.provenance, document.recording
    return provenance(
        {} if made is None else made.to_json(),
        document.result.FORMAT,
        document.result.VERSION,
        () if record is None else record.history,
    )


def verdict_banner(verdict: Verdict, reason: str, names: Iterable[str] = ()) -> PageBlock:
    """The verdict in its tone, with its reason; `names` stay as they are written."""
    return Banner(verdict.tone, sentence(verdict.words), sentence(reason, names))


def advice(remarks: Iterable[str], names: Iterable[str] = ()) -> list[PageBlock]:
    """What to do, or to know."""
    return bullets([sentence(words, names) for words in remarks])


def pictures(result: Result, captions: Mapping[str, str | tuple[str, str]]) -> list[PageBlock]:
    """Figures of a result by their views: the caption, and words in place of the figure where they are not the same."""
    pairs_of = {view: (words, words) if isinstance(words, str) else words for view, words in captions.items()}
    return [
        block
        for view, (caption, words) in pairs_of.items()
        for block in drawn(view, result, caption, words, view=view)
    ]


def findings_of(document: Reportable) -> list[PageBlock]:
    """What was found in the record; nothing where nobody looked."""
    if document.findings is None or document.recording is None:
        return []
    return [Findings(document.findings, document.recording.rate)]
