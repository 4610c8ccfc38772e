# SPDX-License-Identifier: BSD-3-Clause
"""Documents of an earlier version: plain data as they come, in the form that the present version reads."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

__all__ = ["checks_of_kind", "entries", "first_match", "members", "quantity_entry", "texts"]

Entry = Mapping[str, object]


def members(value: object) -> Sequence[object]:
    """Those of a list; of anything else none."""
    return value if isinstance(value, Sequence) and not isinstance(value, str) else []


def entries(value: object) -> list[Entry]:
    """The objects in a list."""
    return [v for v in members(value) if isinstance(v, Mapping)]


def texts(value: object) -> list[str]:
    """What a list holds, as texts."""
    return [str(v) for v in members(value)]


def first_match(pattern: re.Pattern[str], lines: Iterable[str]) -> re.Match[str] | None:
    """Where a pattern is first found in texts."""
    return next((match for words in lines if (match := pattern.search(words))), None)


def quantity_entry(value: object, ends: object, unit: str, *, resolved: bool) -> dict[str, object]:
    """A `Quantity` of a value and the pair of its ends."""
    lower, upper = pair if len(pair := members(ends)) == 2 else (None, None)
    status = "resolved" if resolved else "not resolved"
    return {"value": value, "lower": lower, "upper": upper, "unit": unit, "status": status}


def checks_of_kind(tests: object, kinds: Mapping[str, str]) -> list[dict[str, object]]:
    """Tests that were told by their names, with the codes of what they asked."""
    return [{**test, "kind": kinds.get(str(test.get("name")), test.get("name"))} for test in entries(tests)]
