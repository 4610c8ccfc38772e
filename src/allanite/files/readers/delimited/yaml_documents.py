# Specification: what `rostopic echo` and `ros2 topic echo` print, a subset of YAML 1.2.
# SPDX-License-Identifier: BSD-3-Clause
"""Messages as a program echoes them, one YAML document each, handed on as one object a line.

Each message is a tree of `key: value` lines; `---` ends it. No more of YAML is read than such programs write: keys,
numbers, words and lists of these.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final

from allanite.files.readers.delimited.streams import TextStream, pieces
from allanite.files.readers.spool import to_file
from allanite.plain_files.limits import DEPTH

__all__ = ["as_lines"]

_HEAD: Final = 1 << 16
_FEWEST = 3  # messages
_MOST = 0.9  # of the lines
_LONGEST = 1 << 16  # lines of a message; more are no message
_END = re.compile(rb"(?m)^---[ \t]*\r?$")
_LINE = re.compile(r"(?P<indent> *)(?:(?P<item>- ?)|(?P<key>[A-Za-z_]\w*):(?: |$))(?P<value>.*)")


def as_lines(stream: TextStream, name: str) -> TextStream:
    """The text itself, or one object a line where it is a sequence of such messages."""
    start = stream.file.tell()
    head = stream.file.read(_HEAD)
    stream.file.seek(start)
    if len(_END.findall(head)) < _FEWEST or not _mostly_keys(head.decode(stream.codec, "replace")):
        return stream
    file = to_file(_written(stream, name))
    stream.file.close()
    size = file.seek(0, 2)
    file.seek(0)
    return replace(stream, file=file, size=size, encoding="utf-8")


def _mostly_keys(head: str) -> bool:
    lines = [line for line in head.splitlines()[:-1] if line.strip() and line.rstrip() != "---"]
    return sum(_LINE.fullmatch(line) is not None for line in lines) > _MOST * len(lines)


def _written(stream: TextStream, name: str) -> Iterator[bytes]:
    message: list[str] = []
    for piece, _ in pieces(stream, 0, name):
        out = []
        for line in piece.decode(stream.codec, "replace").split("\n"):
            if line.rstrip() != "---" and len(message) < _LONGEST:
                message.append(line.rstrip())
            elif message:
                out.append(_object(message))
                message = []
        yield "".join(out).encode()
    if message:  # its end is not there: so may be some of its values
        stream.unterminated = True


def _object(lines: list[str]) -> str:
    """A message as one line; one that is damaged, as its first words, which no reader takes for values."""
    tree: dict[str, Any] = {}
    open_: list[tuple[int, dict[str, Any], str]] = [(-1, tree, "")]  # indent, where, key
    for line in lines:
        if not line.strip():
            continue
        match = _LINE.fullmatch(line)
        if match is None or len(open_) > DEPTH:
            return f"{lines[0].strip() or '?'}\n"
        indent = len(match["indent"])
        if match["item"]:
            _, at, key = open_[-1]
            if not isinstance(at.get(key), list):
                at[key] = []
            at[key].append(_value(match["value"]))
            continue
        while open_[-1][0] >= indent:
            open_.pop()
        _, at, key = open_[-1]
        inside = at if not key else at[key]
        if not isinstance(inside, dict):
            return f"{lines[0].strip() or '?'}\n"
        inside[match["key"]] = _value(match["value"]) if match["value"].strip() else {}
        open_.append((indent, inside, match["key"]))
    return json.dumps(tree, separators=(",", ":")) + "\n"


def _value(text: str) -> Any:
    """A number, a list of numbers, or a word; null for what is no number."""
    text = text.strip()
    if text.lower().lstrip("+-.") in ("nan", "inf"):
        return None
    try:
        return json.loads(text)
    except ValueError:
        return text.strip("'\"")
