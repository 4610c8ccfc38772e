# SPDX-License-Identifier: BSD-3-Clause
"""A small YAML file as plain data, with the line on which each entry stands."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from allanite.errors import FormatError, InputError

__all__ = ["LineNumbers", "read_yaml"]

#: A larger file is no description [bytes]; more entries come only from aliases of aliases.
_MOST_BYTES, _MOST_ENTRIES = 1 << 18, 20_000

#: Line, counted from 1, by the path of keys and positions.
LineNumbers = dict[tuple[str | int, ...], int]


def read_yaml(place: Path) -> tuple[Any, LineNumbers]:
    """Plain dictionaries, lists, texts and numbers, and the line of each entry.

    Raises
    ------
    InputError
        No such file.
    FormatError
        Not YAML, not text, or too large.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        if place.stat().st_size > _MOST_BYTES:
            raise FormatError(f"{place} has {place.stat().st_size} bytes: that is no description of a device")
        found = YAML(typ="rt", pure=True).load(place.read_text(encoding="utf-8-sig"))
        lines: LineNumbers = {}
        return _plain(found, (), lines), lines
    except FileNotFoundError:
        raise InputError(f"no such file: {place}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(f"{place} cannot be read: {error}") from None
    except (YAMLError, ValueError, RecursionError) as error:
        said = " ".join(str(error).split())[:200]
        raise FormatError(f"{place} is not YAML: {said}") from None


def _plain(node: Any, path: tuple[str | int, ...], lines: LineNumbers) -> Any:
    """The node without what a round trip of YAML keeps; notes the lines on the way."""
    if len(lines) > _MOST_ENTRIES:
        raise ValueError(f"more than {_MOST_ENTRIES} entries")
    if isinstance(node, Mapping):
        made = {}
        for key, value in node.items():
            step = key if isinstance(key, int) else str(key)
            lines[(*path, step)] = node.lc.key(key)[0] + 1  # type: ignore[attr-defined]
            made[str(key)] = _plain(value, (*path, step), lines)
        return made
    if isinstance(node, list):
        items = []
        for i, value in enumerate(node):
            lines[(*path, i)] = node.lc.item(i)[0] + 1  # type: ignore[attr-defined]
            items.append(_plain(value, (*path, i), lines))
        return items
    if isinstance(node, (bool, type(None))):
        return node
    for plain in (int, float, str):
        if isinstance(node, plain):
            return plain(node)
    return str(node)
