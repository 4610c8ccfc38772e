# SPDX-License-Identifier: BSD-3-Clause
"""What users read is American English, without the phrases that docs/contributing/writing.md retires."""

from __future__ import annotations

import ast
import re
import statistics
from collections.abc import Iterator
from pathlib import Path

import pytest

import allanite
from raised_texts import raised_texts

PACKAGE = Path(allanite.__file__).parent
ROOT = Path(__file__).parents[1]
GUIDE = ROOT / "docs" / "contributing" / "writing.md"

RETIRED = (
    r"that (allanite|we) looks? for", r"in spite of", r"\banew\b", r"nobody knows", r"hangs? together",
    r"\btake[ns]? off\b", r"\bstands? out after\b", r"so long after", r"is there, K or", r"is no chance",
    r"one above another",
)  # fmt: skip
#: "quantisation" is the code of a finding and of a term, which documents keep.
_STEMS = (
    "character digit discret emphas equal final general initial linear local maxim minim neutral normal optim organ "
    "parametr penal random real recogn serial special stabil standard summar symbol synchron util visual"
)
BRITISH = (
    rf"(?i)\b({'|'.join(_STEMS.split())})is(e|es|ed|er|ing|ation)\b", r"(?i)\banalys(e|ed|er|ing)\b",
    r"(?i)\b(lev|lab|mod)ell(ed|ing)\b", r"(?i)\b(neighb|behavi|col|fav|hon)our", r"\bcentred?\b",
    r"(?i)\bgrey\b",
)  # fmt: skip


def sentences(path: Path) -> Iterator[str]:
    """The texts of a module that somebody may read: strings with a blank in them that are no docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    described = ast.Module | ast.ClassDef | ast.FunctionDef
    nodes = [n for n in ast.walk(tree) if isinstance(n, described) and n.body]
    docs = {id(n.body[0].value) for n in nodes if isinstance(n.body[0], ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            text = re.sub(r"`[^`]*`", "", node.value)
            if " " in text.strip():
                yield text


def prose(path: Path) -> str:
    """A document without its blocks of code, code spans, quoted codes and addresses."""
    text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)
    return re.sub(r"`[^`]*`|\"\w+\"|\]\([^)]*\)", "", text)


def retired(text: str) -> list[str]:
    return [m[0] for pattern in (*RETIRED, *BRITISH) for m in re.finditer(pattern, text)]


def test_what_the_package_says_is_free_of_them() -> None:
    left = {
        f"{path.relative_to(PACKAGE)}: {phrase}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for text in sentences(path)
        for phrase in retired(text)
    }
    assert not left


@pytest.mark.parametrize(
    "page",
    [
        p
        for p in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
        if p != GUIDE
    ],
    ids=lambda p: p.stem,
)
def test_what_a_document_says_is_free_of_them(page: Path) -> None:
    assert not retired(prose(page))


def test_the_patterns_find_what_they_are_for() -> None:
    assert retired("a noise model of a record, otherwise precise; the unit has arisen") == []
    for text in (
        "begins anew",
        "was taken off",
        "characterised",
        "neighbouring",
        "modelled",
        "minimises",
        "in spite of",
    ):
        assert retired(text), text


def test_most_messages_are_short() -> None:
    """Half of the error messages have at most 25 words; what a message adds to its sentence counts."""
    lengths = [len(text.split()) for _, text in raised_texts(re.compile(r"\w \w"))]
    assert len(lengths) > 1000
    assert statistics.median(lengths) <= 25
