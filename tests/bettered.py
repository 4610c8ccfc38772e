# SPDX-License-Identifier: BSD-3-Clause
"""Sentences of documents of version 1 as they are worded now.

``bettered.json`` holds the pairs, former and present, with ``{0}`` for the first value in the former one. Whoever
words a sentence anew adds a pair: what a document of version 1 says must not change in any other way.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

__all__ = ["bettered"]

_PAIRS: list[tuple[str, str]] = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
_VALUE = re.compile(r"\{(\d)\}")


def _pattern(former: str) -> re.Pattern[str]:
    """Literal words, and any value where one stands; the same value where it stands again."""
    parts = _VALUE.split(former)
    known: set[str] = set()
    text = re.escape(parts[0])
    for name, words in zip(parts[1::2], parts[2::2], strict=True):
        text += f"(?P=v{name})" if name in known else f"(?P<v{name}>.*?)"
        text += re.escape(words)
        known.add(name)
    return re.compile(text)


_PATTERNS = [(_pattern(former), _VALUE.sub(r"\\g<v\1>", present)) for former, present in _PAIRS]


def bettered(value: Any) -> Any:
    """Texts of version 1 (one, or any number of them in lists) as they are worded now."""
    if isinstance(value, str):
        for pattern, present in _PATTERNS:
            value = pattern.sub(present, value)
        return value
    if isinstance(value, dict):
        return {key: bettered(part) for key, part in value.items()}
    return [bettered(part) for part in value] if isinstance(value, list) else value
