# SPDX-License-Identifier: BSD-3-Clause
"""What is kept of what the program leaves: terminal text, documents, tables, reports, figures, files of consumers."""

from __future__ import annotations

import csv
import importlib.metadata
import io
import json
import os
import platform
import re
import shlex
import sys
import warnings
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from datetime import UTC, datetime, timedelta
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

from tests.frozen.compared import digest, lines_of, list_line

__all__ = ["Text", "called", "document", "kept", "normal", "report", "spread"]

Text = dict[str, str]
_BEGUN = datetime.now(UTC)
_STAMP = re.compile(r"\d{4}-?\d\d-?\d\d[T ]\d\d:?\d\d:?\d\d(?:\.\d+)?(?:Z|\+00:00)?")
_ROWS = 16
_SEPARATE = {
    "p",
    "li",
    "tr",
    "h1",
    "h2",
    "h3",
    "h4",
    "dt",
    "summary",
    "figcaption",
    "caption",
    "article",
    "section",
    "nav",
    "div",
}
_SILENT = {"script", "style", "title"}


def called(command: str, columns: int) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of the program, which runs in this process as the console would start it."""
    from allanite.__main__ import main

    out, err = (
        io.TextIOWrapper(io.BytesIO(), encoding="utf-8"),
        io.TextIOWrapper(io.BytesIO(), encoding="utf-8"),
    )
    before = sys.argv, warnings.showwarning, os.environ.get("COLUMNS")
    os.environ.update(COLUMNS=str(columns), NO_COLOR="1", TERM="dumb")
    sys.argv = ["allanite", *(match for word in shlex.split(command) for match in _matches(word))]
    code: object = 0
    try:
        with redirect_stdout(out), redirect_stderr(err), warnings.catch_warnings():
            try:
                main()
            except SystemExit as left:
                code = left.code
    finally:
        sys.argv, warnings.showwarning, width = before
        if width is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = width
    texts = []
    for stream in (out, err):
        stream.flush()
        buffer = stream.detach()
        assert isinstance(buffer, io.BytesIO)
        texts.append(normal(buffer.getvalue().decode()))
    return int(code or 0) if isinstance(code, int | None) else 1, texts[0], texts[1]


def _matches(word: str) -> list[str]:
    """What a shell would put in place of a word."""
    return sorted(str(p) for p in Path().glob(word)) if word.endswith("*") else [word]


def normal(text: str) -> str:
    """Without what differs from run to run: folder, versions, moments of this run, hashes of files."""
    text = text.replace(str(Path.cwd()), "<folder>")
    for version in _versions():
        text = re.sub(rf"(?<![\d.]){re.escape(version)}(?![\d.]*\d)", "<version>", text)
    text = re.sub(r"\ballanite(?:\.[a-z_]+)+\.([a-z_]{3,})\b", r"<\1>", text)  # modules may move
    text = re.sub(r"\b[0-9a-f]{64}\b", "<sha256>", text)
    text = re.sub(r"\b[\d.]+ [MGT]B free", "<size> free", text)
    text = _STAMP.sub(_moment, text)
    return text.replace(f"{_BEGUN:%Y-%m-%d}", "<today>")


def _versions() -> list[str]:
    parts = ("allanite", "numpy", "scipy", "pyarrow", "matplotlib")
    found = [platform.python_version(), *(importlib.metadata.version(p) for p in parts)]
    return [v for v in found if v.count(".") > 1]


def _moment(stamp: re.Match[str]) -> str:
    digits = re.sub(r"\D", "", stamp[0])[:14]
    moment = datetime.strptime(digits, "%Y%m%d%H%M%S").replace(tzinfo=UTC)
    return (
        "<now>"
        if _BEGUN - timedelta(hours=1) <= moment <= datetime.now(UTC) + timedelta(hours=1)
        else stamp[0]
    )


def kept(path: Path, exact: bool = False) -> tuple[str, str]:
    """The door through which a file came, and what is kept of it."""
    kind = path.suffix.lower()
    if kind in (".parquet", ".mat", ".pdf", ".png", ".npz", ".arrows", ".jsonl"):
        return "files", "(binary)\n"
    text = path.read_text(encoding="utf-8")
    if kind == ".json":
        return "document", document(text, exact)
    if kind == ".csv":
        return "tables", spread(text, exact)
    if kind == ".html":
        return "report", report(text)
    if kind == ".svg":
        return "figure", "\n".join(words_of_figure(text)) + "\n"
    return "files", normal(text)


def words_of_figure(svg: str) -> Iterator[str]:
    """What is written in a figure, in its order; lines below one another are one."""
    for words in re.findall(r"<text[^>]*>(.*?)</text>", svg):
        yield unescape(re.sub(r"<tspan[^>]*>", " ", words).replace("</tspan>", ""))


def document(text: str, exact: bool = False) -> str:
    return normal("\n".join(lines_of(json.loads(text), exact=exact)) + "\n")


def spread(text: str, exact: bool = False) -> str:
    """A table: rows of a short one, columns of a long one."""
    comments = [line for line in text.splitlines() if line.startswith("#")]
    heads, *rows = csv.reader(line for line in text.splitlines() if not line.startswith("#"))
    lines = [*comments, ",".join(heads)]
    if len(rows) <= _ROWS:
        named = [
            (f"{i} {c}", c, cell) for i, row in enumerate(rows) for c, cell in zip(heads, row, strict=True)
        ]
        lines += [_cell(place, cell, exact or c in _PLAIN) for place, c, cell in named]
    else:
        for c, column in zip(heads, zip(*rows, strict=True), strict=True):
            lines.append(_column(c, column, exact or c in _PLAIN))
    return normal("\n".join(lines) + "\n")


_PLAIN = {"tau", "tau_s", "deviation", "count", "lag", "frequency", "frequency_hz", "density"}


def _cell(place: str, cell: str, exact: bool) -> str:
    number = _number(cell)
    return f"{place} = {cell!r}" if number is None else list_line(place, [number], exact)


def _column(name: str, cells: tuple[str, ...], exact: bool) -> str:
    numbers = [_number(c or "nan") for c in cells]
    if all(n is not None for n in numbers):
        return list_line(name, [n for n in numbers if n is not None], exact)
    return f"{name} = {len(cells)} texts, {list(cells[:3])} .. {list(cells[-3:])}, digest {digest(cells)}"


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None


class _Blocks(HTMLParser):
    """Text of a page, a line for each block; cells of a row between bars."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = [""]
        self.silent = 0
        self.figures = False
        self.data = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.figures = tag == "script" and given.get("id") == "figure-data"
        self.silent += tag in _SILENT
        if tag in _SEPARATE:
            mark = {"h1": "# ", "h2": "## ", "h3": "### ", "h4": "#### ", "li": "* "}.get(tag, "")
            look = f"({given['class']}) " if tag == "p" and given.get("class") else ""
            self.lines.append(mark + look)
        elif tag in ("td", "th"):
            self.lines[-1] += " | "
        elif tag in ("br", "span", "sub", "sup", "dd"):
            self.lines[-1] += " "
        elif tag == "img":
            self.lines.append(f"image: {given.get('alt')}")

    def handle_endtag(self, tag: str) -> None:
        self.silent -= tag in _SILENT
        self.figures = False
        if tag in ("p", "h1", "h2", "h3", "h4", "div", "section"):
            self.lines.append("")

    def handle_data(self, data: str) -> None:
        if self.figures:
            self.data += data
        elif not self.silent:
            self.lines[-1] += data


def report(text: str) -> str:
    """Blocks of a report in their order, then the words and the points of its figures."""
    page = _Blocks()
    page.feed(text)
    lines = [" ".join(line.split()) for line in page.lines]
    figures = json.loads(page.data) if page.data else {}
    for name, figure in figures.items():
        lines += [f"figure {name}: {line}" for line in _figure(figure)]
    return normal("\n".join(line for line in lines if line) + "\n")


_NUMBERS = ("x", "y", "lower", "upper", "low", "high", "start", "stop", "at", "limits")
_WORDS = ("title", "label", "text", "name", "words", "band_label", "hollow_label")


def _figure(value: object, path: str = "") -> Iterator[str]:
    """Words and numbers of a figure; nothing of its colors and outlines."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if key in _NUMBERS and not isinstance(inner, dict):
                yield from lines_of(inner, f"{path}.{key}")
            elif key in _WORDS and inner:
                yield f"{path}.{key} = {inner!r}"
            elif key != "legend":  # of the curves' own words
                yield from _figure(inner, f"{path}.{key}")
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from _figure(inner, f"{path}[{i}]")
