# Specification: RFC 8259 (JSON).
# SPDX-License-Identifier: BSD-3-Clause
"""A log as one JSON document, handed on as one object a line.

Its samples are objects in a list, lists of equal length under their names, rows of numbers without names, or what
pandas writes: columns with their rows, each column by its index, or each row by it. Facts beside them (a rate, a unit)
become lines before the first one.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import NoneType
from typing import Any, Final

from allanite.errors import FormatError, LimitError
from allanite.files.readers.delimited.dates import date_format
from allanite.files.readers.delimited.streams import TextStream
from allanite.files.readers.spool import to_file
from allanite.plain_files.limits import DEPTH, JSON_BYTES, JSON_OBJECTS, refuse_more

__all__ = ["as_lines"]

Sample = Mapping[str, Any] | Sequence[Any]

_FEWEST = 3  # samples
_HEAD = 1 << 16
_OF_LINES = re.compile(rb"\s*(?:\[\s*)?\{[^\r\n]*\}[ \t]*,?[ \t]*[\r\n]+[ \t]*\{")
_DOCUMENT = re.compile(rb'\s*(?:\{\s*["}]|\[\s*[\[{])')
_OF_EPOCH = 9  # digits: shorter whole numbers are those of rows
_LINES: Final = 4096  # that are joined before they go to the file


def as_lines(stream: TextStream, name: str) -> TextStream:
    """The text itself, or one object a line where it is one JSON document.

    Raises
    ------
    FormatError
        A document that is damaged, or holds no samples.
    LimitError
        A document of more bytes than are read at once.
    """
    start = stream.file.tell()
    head = stream.file.read(_HEAD)
    stream.file.seek(start)
    if not _DOCUMENT.match(head) or _OF_LINES.match(head) or _first_line_is_one(stream, start):
        return stream
    if stream.size > JSON_BYTES:
        raise LimitError(
            f"{name} is one JSON document of {stream.size >> 20} MiB; up to {JSON_BYTES >> 20} MiB can be "
            "read. Write one object per line, or a table: CSV or Parquet"
        )
    text = stream.file.read()
    refuse_more(
        text.count(b"{") + text.count(b"["),
        JSON_OBJECTS,
        "objects and lists",
        name,
        "Write one object per line",
    )
    try:
        document = json.loads(text.replace(b"\x00", b"").decode(stream.codec, "replace"))
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{name} is damaged JSON: {error}") from None
    samples = _samples(document, 0)
    if samples is None:
        raise FormatError(
            f"{name} is JSON, but not a log of samples: write them as a table, CSV or Parquet, or one object per line"
        )
    facts = _facts(document) if isinstance(document, dict) else []
    stream.file.close()
    file = to_file(_written(facts, samples))
    size = file.seek(0, 2)
    file.seek(0)
    return replace(stream, file=file, size=size, encoding="utf-8")


def _first_line_is_one(stream: TextStream, start: int) -> bool:
    """True if the first line is an object or a list, and another one follows: one in each line."""
    line = stream.file.readline(1 << 20)
    follows = stream.file.readline(64)
    stream.file.seek(start)
    return any(
        line.rstrip().endswith(end) and follows.lstrip().startswith(begin)
        for begin, end in ((b"{", b"}"), (b"[", b"]"))
    )


def _written(facts: list[str], samples: Iterator[Sample]) -> Iterator[bytes]:
    lines = [f"# {fact}" for fact in facts]
    for sample in samples:
        line = json.dumps(sample, separators=(",", ":"))
        lines.append(line if isinstance(sample, Mapping) else line[1:-1])
        if len(lines) >= _LINES:
            yield ("\n".join(lines) + "\n").encode()
            lines = []
    yield ("\n".join(lines) + "\n").encode() if lines else b""


def _facts(document: Mapping[str, Any]) -> list[str]:
    """Words and numbers beside the samples, at most one level below."""
    inner = [value for value in document.values() if isinstance(value, dict)]
    return [
        f"{' '.join(str(key).split())}: {' '.join(str(value).split())}"
        for members in (document, *inner)
        for key, value in members.items()
        if isinstance(value, (str, int, float)) and not isinstance(value, bool)
    ][:100]


def _samples(document: Any, depth: int) -> Iterator[Sample] | None:
    """The samples of a document as objects, or as rows without names; None where it holds none."""
    if depth > DEPTH:
        return None
    if isinstance(document, list):
        if _is_matrix(document):
            return iter(document)
        objects = [sample for sample in document if isinstance(sample, dict)]
        return iter(objects) if len(objects) >= max(_FEWEST, len(document) // 2) else None
    if not isinstance(document, dict):
        return None
    names, rows = document.get("columns"), document.get("data")
    if isinstance(names, list) and isinstance(rows, list) and _is_table(names, rows):
        return (dict(zip(map(str, names), row, strict=True)) for row in rows)
    if (rows := _by_row(document)) is not None:
        return rows
    columns = _by_index(document) or _columns(document, "", 0)
    lengths = Counter(len(values) for values in columns.values())
    if lengths:
        count = max(lengths, key=lambda n: (lengths[n], n))
        columns = {key: values for key, values in columns.items() if len(values) == count}
        return (dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True))
    inside = (_samples(value, depth + 1) for value in _longest_first(document.values()))
    return next((samples for samples in inside if samples is not None), None)


def _longest_first(values: Any) -> list[Any]:
    return sorted((v for v in values if isinstance(v, (list, dict))), key=len, reverse=True)


def _is_table(names: Sequence[Any], rows: Sequence[Any]) -> bool:
    return len(rows) >= _FEWEST and all(isinstance(row, list) and len(row) == len(names) for row in rows)


def _is_matrix(rows: Sequence[Any]) -> bool:
    """True for rows of numbers, all of one width, more of them than columns."""
    width = len(rows[0]) if rows and isinstance(rows[0], list) else 0
    return 0 < width < len(rows) and all(
        isinstance(row, list)
        and len(row) == width
        and all(isinstance(v, (int, float, NoneType)) for v in row)
        for row in rows
    )


def _by_row(document: Mapping[str, Any]) -> Iterator[Mapping[str, Any]] | None:
    """Rows by their numbers or dates: {"0": {"gx": 0.1, "gy": 0.2}, "1": ...}."""
    rows = list(document.values())
    if len(rows) < _FEWEST or not all(isinstance(r, dict) and r.keys() == rows[0].keys() for r in rows):
        return None
    if any(isinstance(v, (dict, list)) for v in rows[0].values()):
        return None
    if all(key.isdigit() and len(key) < _OF_EPOCH for key in document):
        return iter(rows)
    timed = all(key.isdigit() or date_format(key) for key in document)
    return ({"time": key, **row} for key, row in document.items()) if timed else None


def _by_index(document: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Columns that are objects with one and the same index: {"gx": {"0": 0.1, "1": 0.2}}."""
    columns = list(document.values())
    if not columns or not all(isinstance(c, dict) and len(c) >= _FEWEST for c in columns):
        return {}
    index = list(columns[0])
    plain = all(key.lstrip("-").isdigit() for key in index) and all(list(c) == index for c in columns)
    return {str(name): list(column.values()) for name, column in document.items()} if plain else {}


def _columns(document: Mapping[str, Any], prefix: str, depth: int) -> dict[str, list[Any]]:
    """Lists of numbers or words under their names, those of objects inside, too."""
    columns: dict[str, list[Any]] = {}
    for key, value in document.items():
        name = f"{prefix}_{key}" if prefix else str(key)
        if isinstance(value, dict) and depth < DEPTH:
            columns |= _columns(value, name, depth + 1)
        elif (
            isinstance(value, list) and len(value) >= _FEWEST and not any(isinstance(v, dict) for v in value)
        ):
            columns[name] = value
    return columns
