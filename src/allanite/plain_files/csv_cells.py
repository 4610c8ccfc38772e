# SPDX-License-Identifier: BSD-3-Clause
"""Labels in CSV tables: whatever a channel is called, its cell stays one cell, on one line, and text."""

from __future__ import annotations

from allanite.plain_files.printable import printable

__all__ = ["as_label", "heading_cell"]

#: A spreadsheet takes a cell that begins so for a formula.
_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def as_label(text: str) -> str:
    """A label out of a file stays text in a spreadsheet: one that begins like a formula gets an apostrophe.

    >>> as_label("=SUM(A1)"), as_label("-5"), as_label("gyro_x")
    ("'=SUM(A1)", '-5', 'gyro_x')
    """
    if not text.startswith(_FORMULA):
        return text
    try:
        float(text)
    except ValueError:
        return f"'{text}"
    return text


def heading_cell(text: str) -> str:
    r"""A label as one cell of a heading, on one line, quoted where it must be.

    >>> print(heading_cell("@a, b"), heading_cell("a\nb"))
    "'@a, b" a\nb
    """
    cell = as_label(printable(text))
    return '"' + cell.replace('"', '""') + '"' if any(c in cell for c in ',"') else cell
