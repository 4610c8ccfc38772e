# SPDX-License-Identifier: BSD-3-Clause
"""Comments in Markdown that make a site of it: GitHub shows the list, Sphinx cards and a table of contents.

``<!-- cards -->`` makes cards of the list that follows, ``<!-- pages -->`` leaves what follows as it is. Either way,
the pages to which that list or table links become the children of this page, in its order. The text of its card is the
title of a page in the table of contents; other pages keep their own. ``<!-- thumbnails -->`` makes an overview of the
sections of a page by their first pictures; GitHub shows none.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePosixPath
from posixpath import normpath

__all__ = ["PAGES", "children", "for_sphinx"]

#: What is on the site. Its root is that of the repository, so that a link leads to one place here and on GitHub.
PAGES = (
    "docs/**/*.md",
    "docs/notebooks/*.ipynb",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    "firmware/README.md",
    "examples/seed_paper/README.md",
    "benchmarks/results/*.md",
    "verification/results/*.md",
)

_ASKS = re.compile(r"^<!-- (?P<what>cards|pages) -->\n+(?P<block>(?:.+\n)+)", re.M)
_LINK = re.compile(r"\[(?P<text>[^\]]+)\]\((?P<target>[^)#\s:]+\.(?:md|ipynb))\)")
_THUMBNAILS = "<!-- thumbnails -->\n"
_SECTION = re.compile(
    r"^## (?P<title>.+)\n(?P<text>(?:(?!## ).*\n)*?)!\[[^\]]*\]\((?P<picture>[^)]+)\)", re.M
)
_COMMENT = re.compile(r"<!--.*?-->\n?", re.S)


def children(text: str, document: str) -> Iterator[tuple[str, str]]:
    """Title, empty where it is that of the page itself, and document of each child of a page.

    Documents are paths from the root without a suffix.
    """
    for ask in _ASKS.finditer(text):
        for link in _LINK.finditer(ask["block"]):
            at = PurePosixPath(document).parent / link["target"]
            child = normpath(at).removesuffix(".md").removesuffix(".ipynb")
            yield link["text"] if ask["what"] == "cards" else "", child


def for_sphinx(text: str, document: str) -> str:
    """A page with its cards marked for the style sheet, its children in a hidden table of contents, no comments."""
    inside = list(children(text, document))
    text = text.replace(_THUMBNAILS, "".join(_thumbnails(text)))
    shown = _COMMENT.sub("", _ASKS.sub(_marked, text))
    if not inside:
        return shown
    entries = "".join(f"{title} </{name}>\n" if title else f"/{name}\n" for title, name in inside)
    return f"{shown}\n```{{toctree}}\n:hidden:\n\n{entries}```\n"


def _marked(ask: re.Match[str]) -> str:
    return ("{.cards}\n" if ask["what"] == "cards" else "") + ask["block"]


def _thumbnails(text: str) -> Iterator[str]:
    """A list of the sections that have a picture, each with its first."""
    yield "{.thumbnails}\n"
    for section in _SECTION.finditer(text):
        anchor = re.sub(r"[^\w\- ]", "", section["title"].lower()).replace(" ", "-")
        yield f"* [![]({section['picture']}) {section['title']}](#{anchor})\n"
