# SPDX-License-Identifier: BSD-3-Clause
"""Small YAML files that a person writes, as plain data; on demand with the line on which each entry stands.

References
----------
.. [1] YAML 1.2, https://yaml.org/spec/1.2.2/
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

from allanite.errors import AllaniteError, FormatError, InputError, LimitError
from allanite.plain_files.limits import DEPTH, DIGITS, DOCUMENT_BYTES, ENTRIES
from allanite.plain_files.regular_file import read_regular_text

__all__ = ["LineNumbers", "read_yaml", "read_yaml_lines", "read_yaml_texts"]

_STANDARD = "tag:yaml.org,2002:"
#: A tag that names a language and a type of it.
_LANGUAGE_TAG = re.compile(rf"(?:{_STANDARD}|!)\w+/")
#: Ways in which the parser fails, besides its own errors, on what is no YAML (a date that is none).
_FAILURES = (ValueError, ArithmeticError, RecursionError, AttributeError, LookupError, TypeError)

#: Line, counted from 1, by the path of keys and positions.
LineNumbers = dict[tuple[str | int, ...], int]


def read_yaml(place: Path, what: str) -> Any:
    """The content of a file.

    Parameters
    ----------
    place : Path
    what : str
        For messages: what the file should be, "data sheet".

    Raises
    ------
    InputError
        No such file, or no regular one.
    FormatError
        Not YAML, not text, or with tags of a programming language.
    LimitError
        Too large, too deep, or with more entries than a person writes.
    """
    with _refusals_of(place):
        content = _loaded(_text(place, what), "safe")
        _refuse_digits(content)
        return content


def read_yaml_texts(place: Path, what: str) -> Any:
    """The content of a file with all values as texts; a first line ``%YAML:1.0`` of OpenCV, which is none, is left out.

    Parameters and errors are those of `read_yaml`.
    """
    with _refusals_of(place):
        return _loaded(_text(place, what), "base")


def read_yaml_lines(place: Path, what: str) -> tuple[Any, LineNumbers]:
    """Plain dictionaries whose keys are texts, lists, texts and numbers; and the line of each entry.

    Parameters and errors are those of `read_yaml`.
    """
    lines: LineNumbers = {}
    with _refusals_of(place):
        return _plain(_loaded(_text(place, what), "rt"), (), lines), lines


def _loaded(text: str, kind: Literal["safe", "base", "rt"]) -> Any:
    from ruamel.yaml import YAML

    return YAML(typ=kind, pure=True).load(text)


def _text(place: Path, what: str) -> str:
    try:
        text = read_regular_text(place, DOCUMENT_BYTES)
    except LimitError as error:
        raise FormatError(f"{error}: that is not a {what}") from None
    first, end, rest = text.partition("\n")
    if first.strip().startswith("%YAML:"):
        text = end + rest  # the lines keep their numbers
    _refuse_excess(text, place)
    return text


def _refuse_excess(text: str, place: Path) -> None:
    """Walk through a document before anything is made of it; raise at what is too deep, too many, or a program.

    What stands behind an alias counts each time: nine lines of aliases of aliases are a billion entries. A tag that
    asks for an object of a program is ``!!python/object:os.system``, ``!ruby/object:Set``.
    """
    from ruamel.yaml import YAML

    sizes: dict[str, int] = {}  # entries behind an anchor
    within: list[tuple[str | None, int]] = []  # anchor of what is open, and the entries before it
    entries = 0
    for event in YAML(typ="safe", pure=True).parse(text):
        kind, line = type(event).__name__, event.start_mark.line + 1
        tag, anchor = getattr(event, "tag", None) or "", getattr(event, "anchor", None)
        if _LANGUAGE_TAG.match(tag):
            raise FormatError(
                f"{place}, line {line}: the tag {tag.removeprefix(_STANDARD)} belongs to a programming "
                "language and is not read; write plain text, numbers and lists"
            )
        if kind in ("SequenceStartEvent", "MappingStartEvent"):
            within.append((anchor, entries))
            entries += 1
        elif kind in ("SequenceEndEvent", "MappingEndEvent"):
            anchor, before = within.pop()
            sizes |= {anchor: entries - before} if anchor else {}
        elif kind == "ScalarEvent":
            entries += 1
            sizes |= {anchor: 1} if anchor else {}
        elif kind == "AliasEvent":
            if anchor not in sizes:
                raise ValueError(f"line {line}: the alias *{anchor} refers to nothing complete above it")
            entries += sizes[anchor]
        if len(within) > DEPTH:
            raise LimitError(
                f"{place}, line {line}: lists and mappings more than {DEPTH} deep. Reduce the nesting"
            )
        if entries > ENTRIES:
            raise LimitError(
                f"{place}, line {line}: more than {ENTRIES} entries, counting aliases each time. Split "
                "the file, or remove the aliases"
            )


def _refuse_digits(node: Any) -> None:
    """Raise at a whole number that no other program can read, and that cannot even be printed."""
    if isinstance(node, Mapping):
        for key, value in node.items():
            _refuse_digits(key)
            _refuse_digits(value)
    elif isinstance(node, (list, tuple, set)):
        for value in node:
            _refuse_digits(value)
    elif isinstance(node, int) and abs(node) >= 10**DIGITS:
        raise ValueError(f"a whole number of more than {DIGITS} digits")


@contextmanager
def _refusals_of(place: Path) -> Iterator[None]:
    """What goes wrong while the file is read, as errors that name it."""
    from ruamel.yaml.error import YAMLError

    try:
        yield
    except AllaniteError:  # some of them are errors of a value, too
        raise
    except FileNotFoundError:
        raise InputError(f"no such file: {place}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(f"{place} cannot be read: {error}") from None
    except (YAMLError, *_FAILURES) as error:
        reason = " ".join(str(error).split())[:200]
        raise FormatError(f"{place} is not YAML: {reason}") from None


def _plain(node: Any, path: tuple[str | int, ...], lines: LineNumbers) -> Any:
    """The node without what a round trip of YAML keeps; notes the lines on the way."""
    if isinstance(node, Mapping):
        made = {}
        positions = node.lc.data or {}  # type: ignore[attr-defined]  # none of what `<<` merges: its lines are elsewhere
        for key, value in node.items():
            step = key if isinstance(key, int) else str(key)
            if key in positions:
                lines[(*path, step)] = positions[key][0] + 1
            made[str(key)] = _plain(value, (*path, step), lines)
        return made
    if isinstance(node, list):
        items = []
        for i, value in enumerate(node):
            lines[(*path, i)] = node.lc.item(i)[0] + 1  # type: ignore[attr-defined]
            items.append(_plain(value, (*path, i), lines))
        return items
    if isinstance(node, (bool, bytes, type(None))):
        return node
    _refuse_digits(node)
    for plain in (int, float, str):
        if isinstance(node, plain):
            return plain(node)
    return str(node)
