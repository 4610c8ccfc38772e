# SPDX-License-Identifier: BSD-3-Clause
"""Commands that are refused, each with the files that it is refused for: what `test_error_advice` carries out.

Files lie in a folder, and have names, that a shell takes in quotes only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

__all__ = ["Refusal", "numbers", "table"]

N = 600
Content = str | bytes | Callable[[Path], object]


@dataclass(frozen=True, kw_only=True)
class Refusal:
    """A command that is refused, and what its user adds to the ways out that the message names."""

    line: str
    """As typed, without the name of the program; a word that is a key of `files` becomes its path."""
    says: tuple[str, ...]
    """What the message holds and the source as well: by this the table is known to be complete."""
    files: Mapping[str, Content] = field(default_factory=dict)
    adds: Mapping[str, str] = field(default_factory=dict)
    """See `copied_advice.ways_in`."""
    instead: tuple[str, ...] = ()
    """Options of the line that every way takes the place of."""
    later: Mapping[str, str] = field(default_factory=dict)
    """Ways that end at another error, which holds this text; the reason stands beside it."""


def numbers(n: int = N, channels: int = 3, seed: int = 1) -> np.ndarray:
    """Noise of sensors at rest."""
    return np.random.default_rng(seed).standard_normal((n, channels)) * 0.05 + 0.3


def table(heads: str, *columns: np.ndarray | list[str], y: np.ndarray | None = None, before: str = "") -> str:
    """Text of a table; columns of words or numbers first, then those of `y`."""
    cells = [[f"{v:.9g}" if isinstance(v, (float, np.floating)) else str(v) for v in c] for c in columns]
    if y is not None:
        cells += [[f"{v:.6f}" for v in c] for c in y.T]
    rows = [",".join(row) for row in zip(*cells, strict=True)]
    return before + "\n".join([*([heads] if heads else []), *rows, ""])
