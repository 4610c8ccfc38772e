# SPDX-License-Identifier: BSD-3-Clause
"""What a hostile input is, and the digits that several have."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

__all__ = ["DEEP", "DIGITS", "RATE", "HostileShape", "Write", "holding", "zipped"]

#: Ends of the names of those that take more than half a second.
_LONG = (
    "100 000 empty chunks", "5000 fields", "a column that is calculated without end", "a hundred thousand gaps",
    "a hundred thousand lines", "many anchors", "many empty members", "many empty segments", "many segments",
    "many subscriptions", "many tables", "many triggers", "quarter of a megabyte of comments",
    "layout, quarter of a megabyte of entries", "too many row groups",
)  # fmt: skip

Write = Callable[[Path], Any]

DIGITS = "7" * 5000
RATE = {"rate": 100.0}
#: How deep an expression is nested that the parsers of this package are given.
DEEP = 50_000


@dataclass(frozen=True, slots=True, kw_only=True)
class HostileShape:
    """A file, and what must become of it.

    Attributes
    ----------
    name : str
    file : str
        Name of the file, or of the folder.
    write : callable
        Writes it to a path.
    role : str
        How it is opened; see `hostile_files.ROLES`.
    says : str
        What the refusal matches; "" where it may be read as well.
    options : dict
        For `read`.
    """

    name: str
    file: str
    write: Write
    role: str = "log"
    says: str = ""
    options: dict[str, Any] = field(default_factory=dict)

    @property
    def long(self) -> bool:
        """It takes more than half a second to write or to open: for the long run."""
        return self.name.endswith(_LONG)


def holding(data: bytes | str) -> Write:
    """Writes these bytes."""
    return lambda path: path.write_bytes(data.encode() if isinstance(data, str) else data)


def zipped(path: Path, members: dict[str, bytes]) -> None:
    """A zip of these members."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
