# SPDX-License-Identifier: BSD-3-Clause
"""What the pages of all measurements share: their order, the verdict, the budget, pictures of several views."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from allanite.views.blocks import (
    Banner,
    Page,
    PageBlock,
    Section,
    bullets,
    drawn,
    page_of,
    pairs,
    provenance,
)
from allanite.views.wording import channel_names, sentence, tone

__all__ = ["judgement", "known_facts", "measurement_page", "views"]

Json = Mapping[str, Any]


def measurement_page(
    document: Json,
    *,
    title: str,
    kicker: str,
    facts: Sequence[tuple[str, str]],
    parts: Mapping[str, Callable[[Json], Sequence[PageBlock]]],
    titles: Mapping[str, str] | None = None,
) -> Page:
    """The page of a result: its parts in their order, and where it comes from.

    Parameters
    ----------
    parts : mapping of str to callable
        Blocks of a section out of the document, by the section's id.
    titles : mapping of str to str, optional
        Of sections that are not called like their id.
    """
    named = {part: part.capitalize() for part in parts} | dict(titles or {})
    sections = [Section(id=part, title=named[part], blocks=made(document)) for part, made in parts.items()]
    return page_of(title=title, kicker=kicker, facts=facts, sections=[*sections, provenance(document)])


def judgement(document: Json, advice: Sequence[str] | None = None) -> list[PageBlock]:
    """The verdict with its reason, and what to do or to know; `advice` in place of that of the document."""
    verdict, names = document["verdict"], channel_names(document)
    return [
        Banner(tone(verdict), sentence(verdict), sentence(document["reason"], names)),
        *bullets([sentence(words, names) for words in (document["advice"] if advice is None else advice)]),
    ]


def known_facts(facts: Sequence[tuple[str, str]]) -> PageBlock:
    """Facts as their wording names them."""
    return pairs([(name.capitalize(), words) for name, words in facts])


def views(document: Json, pictures: Sequence[tuple[str, ...]]) -> list[PageBlock]:
    """Figures of a result, each a view with its caption, and words in its place where they are not the caption."""
    return [
        block
        for view, caption, *words in pictures
        for block in drawn(view, document, caption, words[0] if words else caption, view=view)
    ]
