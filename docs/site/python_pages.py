# SPDX-License-Identifier: BSD-3-Clause
"""The public names of Python from their docstrings, a page for each topic of docs/reference/python.md.

Names are lazy, so that autodoc finds none by itself: each is asked for.
"""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

__all__ = ["MODULES", "index_page", "names_of", "topics", "write_pages"]

#: A name that several have is that of the last.
MODULES = ("allanite.compat", "allanite.instruments", "allanite")

_SECTION = re.compile(r"^## (?P<name>\S+)\n\n(?P<summary>.*)$", re.M)
_ROW = re.compile(r"^\| (?P<topic>\S.*?) \| (?P<links>\[`.*) \|$", re.M)


class Topic(NamedTuple):
    """A row of the table at the top of docs/reference/python.md."""

    title: str
    module: str
    names: list[str]

    @property
    def file(self) -> str:
        """Name of its page, without a suffix."""
        return re.sub(r"\W+", "-", self.title.lower()).removeprefix("allanite-")


def names_of(module: str) -> list[str]:
    """The public names of a module."""
    return list(importlib.import_module(module).__all__)


def topics(text: str) -> Iterator[Topic]:
    """The topics of docs/reference/python.md; a module beside allanite is one of its own."""
    for row in _ROW.finditer(text):
        names = re.findall(r"\[`(\w+)`\]", row["links"])
        module = row["topic"].strip("`") if row["topic"].startswith("`") else "allanite"
        title = module if module != "allanite" else row["topic"].capitalize()
        yield Topic(title, module, names)


def write_pages(text: str, folder: Path) -> None:
    """A page for each topic; one that has not changed is left alone, so that Sphinx need not read it again."""
    folder.mkdir(parents=True, exist_ok=True)
    pages = {f"{topic.file}.rst": _page(topic) for topic in topics(text)}
    for stale in {path.name for path in folder.glob("*.rst")} - pages.keys():
        (folder / stale).unlink()
    for name, page in pages.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != page:
            path.write_text(page, encoding="utf-8")


def _page(topic: Topic) -> str:
    parts = [topic.title, "=" * len(topic.title), ""]
    for name in topic.names:
        if inspect.isclass(getattr(importlib.import_module(topic.module), name)):
            parts += [f".. autoclass:: {topic.module}.{name}", "   :members:", ""]
        else:
            parts += [f".. autofunction:: {topic.module}.{name}", ""]
    return "\n".join(parts)


def index_page(text: str) -> str:
    """docs/reference/python.md with a table for each topic: its names, and what they are."""
    head, _, _ = text.partition("| for | names |")
    summaries = {section["name"]: section["summary"] for section in _SECTION.finditer(text)}
    parts, entries = [head], []
    for topic in topics(text):
        parts.append(f"## {topic.title}\n\n| name | |\n|---|---|")
        for name in topic.names:
            key = f"{topic.module}.{name}".removeprefix("allanite.")
            parts.append(f"| {{py:obj}}`{name} <{topic.module}.{name}>` | {summaries[key]} |")
        parts.append("")
        entries.append(f"python/{topic.file}")
    return "\n".join([*parts, "```{toctree}", ":hidden:", "", *entries, "```", ""])
