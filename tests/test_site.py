# SPDX-License-Identifier: BSD-3-Clause
"""The documents as a site: every page is reached once, every link and anchor leads somewhere.

``make site`` builds it, with warnings as errors; this file holds what is cheap enough for every run of the tests.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from cards import PAGES, children, for_sphinx
from python_pages import index_page, topics

ROOT = Path(__file__).resolve().parent.parent
DOCUMENTS = sorted({path for pattern in PAGES for path in ROOT.glob(pattern)})
LINK = re.compile(r"\]\((?P<target>[^)#\s]*)(?:#(?P<anchor>[^)\s]+))?\)")


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).with_suffix("").as_posix()


def prose(page: Path) -> str:
    """A page without its fenced blocks and inline code, where nothing is a link or a heading."""
    return re.sub(r"^```.*?^```$", "", text_of(page), flags=re.M | re.S)


def anchors(page: Path) -> set[str]:
    """The anchors of a page as GitHub, and the site, make them of its headings."""
    counted: Counter[str] = Counter()
    for heading in re.findall(r"^#+ +(.*?) *$", prose(page), re.M):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        slug = re.sub(r"[^\w\- ]", "", plain.lower()).replace(" ", "-")
        counted[slug] += 1
    return {slug if i == 0 else f"{slug}-{i}" for slug, many in counted.items() for i in range(many)}


def broken(page: Path) -> Iterator[str]:
    """The links of a page that lead nowhere."""
    for link in LINK.finditer(re.sub(r"`[^`\n]*`(?!\])", "", prose(page))):
        target, anchor = link["target"], link["anchor"]
        if re.match(r"[a-z]+:", target):
            continue
        at = (page.parent / target).resolve() if target else page
        if not at.exists():
            yield f"{target}: no such file"
        elif anchor and anchor not in anchors(at):
            yield f"{target}#{anchor}: no such heading"


@pytest.mark.parametrize(
    "page",
    sorted({*ROOT.glob("*.md"), *DOCUMENTS}),
    ids=lambda page: page.relative_to(ROOT).as_posix(),
)
def test_links_lead_somewhere(page: Path) -> None:
    assert not list(broken(page))


def test_broken_links_are_noticed(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "# One `code` & two\n\n## One\n## One\n```\n# no\n```\n[a](#one-code--two) [b](#one-1) [c](#no)\n"
    )
    (tmp_path / "other.md").write_text(
        "[x](page.md#one) [y](gone.md) [z](page.md#two) [w](https://example.org)\n"
    )
    assert list(broken(page)) == ["#no: no such heading"]
    assert list(broken(tmp_path / "other.md")) == ["gone.md: no such file", "page.md#two: no such heading"]


@pytest.mark.parametrize("page", DOCUMENTS, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_tables_have_rows_of_one_length(page: Path) -> None:
    """A bar in a cell, in code too, begins another cell unless it is escaped."""
    for table in re.findall(r"(?:^\|.*\|\n)+", prose(page), re.M):
        assert len({len(re.findall(r"(?<!\\)\|", row)) for row in table.splitlines()}) == 1, table


def test_every_document_is_the_child_of_one_page() -> None:
    parents = Counter(name for page in DOCUMENTS for _, name in children(text_of(page), name_of(page)))
    expected = {name_of(page) for page in DOCUMENTS} - {"docs/index"}
    assert parents.keys() == expected, f"on no page, or unknown: {sorted(parents.keys() ^ expected)}"
    assert not [name for name, many in parents.items() if many > 1]


def test_cards_of_a_page_are_its_table_of_contents() -> None:
    page = "# A\n<!-- run: x -->\n\n<!-- cards -->\n* **[B](b.md)** Words.\n* **[C](../c.md)** More.\n\n[D](d.md)\n"
    assert list(children(page, "docs/a")) == [("B", "docs/b"), ("C", "c")]
    shown = for_sphinx(page, "docs/a")
    assert "{.cards}\n* **[B](b.md)** Words." in shown and "<!--" not in shown
    assert shown.endswith("```{toctree}\n:hidden:\n\nB </docs/b>\nC </c>\n```\n")
    assert list(children("<!-- pages -->\n| [b](b.md) |\n", "a")) == [("", "b")]


def test_sections_with_a_picture_are_thumbnails() -> None:
    page = "# A\n\n<!-- thumbnails -->\n\n## B, c\n\nText\n\n![d](e.png)\n\n![f](g.png)\n\n## H\n\n## I\n![j](k.png)\n"
    overview, _, _ = for_sphinx(page, "docs/a").partition("\n\n## B")
    assert overview == "# A\n\n{.thumbnails}\n* [![](e.png) B, c](#b-c)\n* [![](k.png) I](#i)"


def test_every_public_name_has_its_docstring_on_the_site() -> None:
    import allanite
    from allanite import compat, instruments

    text = text_of(ROOT / "docs" / "reference" / "python.md")
    listed = {(topic.module, name) for topic in topics(text) for name in topic.names}
    public = {(m.__name__, name) for m in (allanite, instruments, compat) for name in m.__all__}
    assert listed == public - {("allanite", "__version__")}
    index = index_page(text)
    assert "| {py:obj}`fit <allanite.fit>` | " in index and "\n## fit\n" not in index
    assert len({topic.file for topic in topics(text)}) == index.count("\npython/")
