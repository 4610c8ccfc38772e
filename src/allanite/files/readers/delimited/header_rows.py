# SPDX-License-Identifier: BSD-3-Clause
"""Rows of a header as one name and one unit for each column."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.files.readers.headings import is_unit, unbracketed

__all__ = ["names_and_units"]


def names_and_units(rows: Sequence[Sequence[str]], count: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of `count` columns, with those of groups above them, and units of a row of their own; "" for none."""
    empty = ("",) * count
    if not rows:
        return empty, empty
    names, units = list(rows), empty
    if _is_units_row(rows[-1]) and (len(rows) > 1 or all(unbracketed(c) != c or not c for c in rows[-1])):
        units = tuple(unbracketed(c) if is_unit(c) else "" for c in rows[-1])
        names = list(rows[:-1])
    if not names:
        return empty, units
    merged = list(names[-1])
    for upper in reversed(names[:-1]):
        merged = [f"{u} {m}".strip() for u, m in zip(_filled_forward(upper), merged, strict=True)]
    return tuple(merged), units


def _is_units_row(cells: Sequence[str]) -> bool:
    blank = ("", "-", "[-]", "1", "n/a", "none", "utc")
    units = [c for c in cells if c.lower() not in blank]
    return bool(units) and all(is_unit(c) for c in units)


def _filled_forward(cells: Sequence[str]) -> list[str]:
    """A group name stands over its first column only: it counts for the empty cells to its right."""
    filled, last = [], ""
    for cell in cells:
        last = cell or last
        filled.append(last)
    return filled
