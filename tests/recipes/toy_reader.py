# Specification: none; the file of a toy is a line with its name, and rows of numbers.
# SPDX-License-Identifier: BSD-3-Clause
"""A toy format."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from allanite.files.readers.arrays import table_of
from allanite.files.readers.table import Options, Table

NAME: Final = "toy"
OPTIONS: Final[frozenset[str]] = frozenset()


def sniff(head: bytes, path: Path) -> bool:
    """By its first line."""
    return head.startswith(b"TOY\n")


def read(path: Path, options: Options) -> Table:
    """Read the rows."""
    return table_of({"": np.loadtxt(path, skiprows=1, ndmin=2)}, {}, path, NAME)
