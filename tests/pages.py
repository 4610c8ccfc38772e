# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of reports look for in a page."""

from __future__ import annotations

import html
import re
from html.parser import HTMLParser

__all__ = ["Balance", "document_of", "text_of"]

_HIDDEN = re.compile(r"<(script|style)\b")
_VOID = {"meta", "link", "img", "br", "hr", "input"}


class Balance(HTMLParser):
    """Collects tags that are not closed in order, and identities."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.wrong: list[str] = []
        self.ids: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.ids += [value for key, value in attrs if key == "id" and value]
        if tag not in _VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)


def document_of(page: str) -> str:
    """The page without the scripts and the style, which are megabytes: their ends are looked for as text."""
    parts, at = [], 0
    while begin := _HIDDEN.search(page, at):
        parts.append(page[at : begin.start()])
        before, closing, _ = page[begin.end() :].partition(f"</{begin[1]}>")
        at = begin.end() + len(before) + len(closing)
    return "".join([*parts, page[at:]])


def text_of(page: str) -> str:
    """The words of the page; a tag counts as a blank."""
    bare = re.sub(r"<[^>]+>", " ", re.sub(r'src="[^"]*"', "", document_of(page)))
    return " ".join(html.unescape(bare).split())
