# SPDX-License-Identifier: BSD-3-Clause
"""The table of a fleet on disk: a folder of Parquet files, each with all rows of its logs, or one file."""

from __future__ import annotations

import hashlib
from pathlib import Path

from allanite.plain_files.regular_file import file_sha256, regular

__all__ = ["TABLE", "table_files", "table_sha256"]

TABLE = "fleet.parquet"


def table_files(place: Path) -> list[Path]:
    """The files of a table; none where there is no table.

    Parameters
    ----------
    place : Path
        The folder of a fleet, its fleet.parquet, or a file.

    Raises
    ------
    InputError
        A file that is no regular one.
    """
    inner = place / TABLE
    table = inner if inner.exists() else place
    if table.is_dir():
        return [regular(file) for file in sorted(table.glob("*.parquet")) if not file.name.startswith(".")]
    return [regular(table)] if table.exists() else []


def table_sha256(place: Path) -> str | None:
    """SHA-256 of a table in hexadecimal: of its file, or of the names and digests of its files; None without one."""
    files = table_files(place)
    if len(files) == 1 and files[0].parent.name != TABLE:
        return file_sha256(files[0])
    lines = "".join(f"{file.name} {file_sha256(file)}\n" for file in files)
    return hashlib.sha256(lines.encode()).hexdigest() if files else None
