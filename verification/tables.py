# SPDX-License-Identifier: BSD-3-Clause
"""Rows of results as they come, one table for each run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

__all__ = ["is_verdict", "write_tables"]

Json = dict[str, Any]

#: Columns that say whether a row holds; so do those that end in " pass".
_VERDICTS = ("passes", "pass", "met", "exact")


def write_tables(
    name: str, title: str, parts: dict[str, list[Json]], folder: Path, *, seed: int, date: str
) -> None:
    """Write <name>.json and <name>.md; `parts` maps a heading to its rows."""
    folder.mkdir(exist_ok=True)
    document = {"date": date, "seed": seed, **parts}
    (folder / f"{name}.json").write_text(json.dumps(document, indent=1, default=float) + "\n")
    lines = [f"# {title}", "", f"{date}, root seed {seed}; `make verify`."]
    for heading, rows in parts.items():
        columns = list(dict.fromkeys(key for row in rows for key in row))
        lines += ["", f"## {heading}", "", f"| {' | '.join(c.replace('_', ' ') for c in columns)} |"]
        lines.append("|" + "---|" * len(columns))
        lines += [f"| {' | '.join(_cell(row.get(c), is_verdict(c)) for c in columns)} |" for row in rows]
    (folder / f"{name}.md").write_text("\n".join(lines) + "\n")


def is_verdict(column: str) -> bool:
    """Whether "no" in this column is a failure."""
    return column in _VERDICTS or column.endswith(" pass")


def _cell(value: Any, bold: bool = False) -> str:
    if isinstance(value, bool):
        return "yes" if value else "**no**" if bold else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, (list, tuple)):
        return " to ".join(_cell(v) for v in value)
    if isinstance(value, dict):
        return ", ".join(f"{k} {_cell(v)}" for k, v in value.items())
    return "" if value is None else str(value)
