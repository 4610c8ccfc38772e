# Specification: RFC 8259 (JSON).
# SPDX-License-Identifier: BSD-3-Clause
"""A log as one JSON document, handed on as one object a line.

Its samples are objects in a list, lists of equal length under their names, or what pandas writes: columns with their
rows, or each column by its index. Facts beside them (a rate, a unit) become lines before the first one.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from allanite.errors import FormatError, LimitError
from allanite.files.readers.delimited.streams import TextStream
from allanite.files.readers.spool import to_file
from allanite.plain_files.limits import DEPTH, JSON_BYTES, JSON_OBJECTS, refuse_more

__all__ = ["as_lines"]

_FEWEST = 3  # samples
_HEAD = 1 << 16
_OF_LINES = re.compile(rb"\s*(?:\[\s*)?\{[^\r\n]*\}[ \t]*,?[ \t]*[\r\n]+[ \t]*\{")
_DOCUMENT = re.compile(rb'\s*(?:\{\s*["}]|\[\s*[\[{])')
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
            f"{name} is one JSON document of {stream.size >> 20} MiB; up to {JSON_BYTES >> 20} MiB are read at once. "
            "Write one object a line, or a table: CSV or Parquet"
        )
    text = stream.file.read()
    refuse_more(
        text.count(b"{") + text.count(b"["),
        JSON_OBJECTS,
        "objects and lists",
        name,
        "Write one object a line",
    )
    try:
        document = json.loads(text.replace(b"\x00", b"").decode(stream.codec, "replace"))
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{name} is JSON, and damaged: {error}") from None
    samples = _samples(document, 0)
    if samples is None:
        raise FormatError(
            f"{name} is JSON, and no log of samples: write them as a table, CSV or Parquet, or one object a line"
        )
    facts = _facts(document) if isinstance(document, dict) else []
    stream.file.close()
    file = to_file(_written(facts, samples))
    size = file.seek(0, 2)
    file.seek(0)
    return replace(stream, file=file, size=size, encoding="utf-8")


def _first_line_is_one(stream: TextStream, start: int) -> bool:
    """True if the first line is an object and another one follows: long lines of one object each."""
    line = stream.file.readline(1 << 20)
    follows = stream.file.readline(64)
    stream.file.seek(start)
    return line.rstrip().endswith(b"}") and follows.lstrip().startswith(b"{")


def _written(facts: list[str], samples: Iterator[Mapping[str, Any]]) -> Iterator[bytes]:
    lines = [f"# {fact}" for fact in facts]
    for sample in samples:
        lines.append(json.dumps(sample, separators=(",", ":")))
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


def _samples(document: Any, depth: int) -> Iterator[Mapping[str, Any]] | None:
    """The samples of a document as objects; None where it holds none."""
    if depth > DEPTH:
        return None
    if isinstance(document, list):
        objects = [sample for sample in document if isinstance(sample, dict)]
        return iter(objects) if len(objects) >= max(_FEWEST, len(document) // 2) else None
    if not isinstance(document, dict):
        return None
    names, rows = document.get("columns"), document.get("data")
    if isinstance(names, list) and isinstance(rows, list) and _is_table(names, rows):
        return (dict(zip(map(str, names), row, strict=True)) for row in rows)
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
