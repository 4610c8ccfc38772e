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
from typing import Any

from allanite.errors import FormatError, InputError

__all__ = ["LineNumbers", "read_yaml", "read_yaml_lines"]

#: A larger file was not written by a person [bytes]; more entries come only from aliases of aliases.
_MOST_BYTES, _MOST_ENTRIES = 1 << 18, 20_000
_STANDARD = "tag:yaml.org,2002:"
#: A tag that names a language and a type of it.
_LANGUAGE_TAG = re.compile(rf"(?:{_STANDARD}|!)\w+/")
#: Ways in which the parser fails, besides its own errors, on what is no YAML (an entry that contains itself).
_FAILURES = (ValueError, RecursionError, AttributeError, LookupError, TypeError)

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
        No such file.
    FormatError
        Not YAML, not text, too large, or with tags of a programming language.
    """
    from ruamel.yaml import YAML

    with _refusals_of(place):
        return YAML(typ="safe", pure=True).load(_text(place, what))


def read_yaml_lines(place: Path, what: str) -> tuple[Any, LineNumbers]:
    """Plain dictionaries whose keys are texts, lists, texts and numbers; and the line of each entry.

    Parameters and errors are those of `read_yaml`.
    """
    from ruamel.yaml import YAML

    lines: LineNumbers = {}
    with _refusals_of(place):
        return _plain(YAML(typ="rt", pure=True).load(_text(place, what)), (), lines), lines


def _text(place: Path, what: str) -> str:
    size = place.stat().st_size
    if size > _MOST_BYTES:
        raise FormatError(f"{place} has {size} bytes: that is no {what}")
    text = place.read_text(encoding="utf-8-sig")
    _refuse_language_tags(text, place)
    return text


def _refuse_language_tags(text: str, place: Path) -> None:
    """Raise at a tag that asks for an object of a program: ``!!python/object:os.system``, ``!ruby/object:Set``."""
    from ruamel.yaml import YAML

    for event in YAML(typ="safe", pure=True).parse(text) if "!" in text else ():
        tag = getattr(event, "tag", None) or ""
        if _LANGUAGE_TAG.match(tag):
            raise FormatError(
                f"{place}, line {event.start_mark.line + 1}: the tag {tag.removeprefix(_STANDARD)} is one of a "
                "programming language, and such tags are not read; write plain texts, numbers and lists"
            )


@contextmanager
def _refusals_of(place: Path) -> Iterator[None]:
    """What goes wrong while the file is read, as errors that name it."""
    from ruamel.yaml.error import YAMLError

    try:
        yield
    except FileNotFoundError:
        raise InputError(f"no such file: {place}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(f"{place} cannot be read: {error}") from None
    except (YAMLError, *_FAILURES) as error:
        said = " ".join(str(error).split())[:200]
        raise FormatError(f"{place} is not YAML: {said}") from None


def _plain(node: Any, path: tuple[str | int, ...], lines: LineNumbers) -> Any:
    """The node without what a round trip of YAML keeps; notes the lines on the way."""
    if len(lines) > _MOST_ENTRIES:
        raise ValueError(f"more than {_MOST_ENTRIES} entries")
    if isinstance(node, Mapping):
        made = {}
        own = node.lc.data or {}  # type: ignore[attr-defined]  # none of what `<<` merges: its lines are elsewhere
        for key, value in node.items():
            step = key if isinstance(key, int) else str(key)
            if key in own:
                lines[(*path, step)] = own[key][0] + 1
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
    for plain in (int, float, str):
        if isinstance(node, plain):
            return plain(node)
    return str(node)
