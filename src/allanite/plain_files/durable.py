# SPDX-License-Identifier: BSD-3-Clause
"""What a loss of power does not take: data and names that are on the medium."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

__all__ = ["sync_data", "synced"]

_WINDOWS: Final = os.name == "nt"


def sync_data(descriptor: int) -> None:
    """Return when the data of an open file are on the medium.

    Raises
    ------
    OSError
        What the disk says.
    """
    if sys.platform == "darwin":  # fsync leaves the data in the cache of the drive
        import fcntl

        with suppress(OSError):  # some file systems of a network know no such call
            fcntl.fcntl(descriptor, fcntl.F_FULLFSYNC)
            return
    getattr(os, "fdatasync", os.fsync)(descriptor)


def synced(path: Path) -> None:
    """Return when a file, or the names in a folder, are on the medium.

    Raises
    ------
    OSError
        What the disk says.
    """
    if _WINDOWS and path.is_dir():  # cannot be opened there; NTFS keeps a journal of its names
        return
    descriptor = os.open(path, os.O_RDWR if _WINDOWS else os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
