# SPDX-License-Identifier: BSD-3-Clause
"""The frozen results, which stand in results.toml."""

from __future__ import annotations

import tomllib
from pathlib import Path

__all__ = ["EXACT", "NEEDS", "RESULTS"]

_TABLE = tomllib.loads(Path(__file__).with_name("results.toml").read_text(encoding="utf-8"))

RESULTS: dict[str, tuple[str, ...]] = {name: tuple(row["commands"]) for name, row in _TABLE.items()}
#: Result -> results whose files it takes.
NEEDS: dict[str, tuple[str, ...]] = {
    name: tuple(row["needs"]) for name, row in _TABLE.items() if "needs" in row
}
#: Results whose tables depend on no fit.
EXACT = frozenset(name for name, row in _TABLE.items() if row.get("exact"))
