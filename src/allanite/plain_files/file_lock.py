# SPDX-License-Identifier: BSD-3-Clause
"""Locks of files between processes. The system releases them when the process that holds them ends, however it ends."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import Final

with suppress(ImportError):  # Windows has none
    import fcntl

__all__ = ["is_locked", "try_lock"]

#: Windows locks bytes, and lets no other process read them: the one that is locked lies behind what the file will hold.
_BYTE: Final = 1 << 40


def try_lock(descriptor: int) -> bool:
    """Lock an open file for this process alone, until it is closed; False while another process holds it."""
    if sys.platform == "win32":
        return _try_byte(descriptor)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def is_locked(descriptor: int) -> bool:
    """Whether another process holds an open file; it is not locked by asking, once it is closed."""
    if sys.platform == "win32":
        return not _try_byte(descriptor)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    return False


def _try_byte(descriptor: int) -> bool:
    import msvcrt

    place = os.lseek(descriptor, 0, os.SEEK_CUR)
    os.lseek(descriptor, _BYTE, os.SEEK_SET)
    try:
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]  # of Windows alone
    except OSError:
        return False
    finally:
        os.lseek(descriptor, place, os.SEEK_SET)
    return True
