# SPDX-License-Identifier: BSD-3-Clause
"""The few calls that a run makes to the file system, in one place, so that tests can let each of them fail."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Final

from allanite.plain_files.durable import sync_data, synced

__all__ = ["Disk"]

_APPEND: Final = (
    os.O_WRONLY | os.O_CREAT | os.O_APPEND | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
)


class Disk:
    """The file system as it is."""

    def create(self, path: Path) -> int:
        """Open a new file for appending; its descriptor."""
        return os.open(path, _APPEND | os.O_EXCL, 0o666)

    def open_or_create(self, path: Path) -> int:
        """Open a file for appending, whether it is there or not; its descriptor."""
        return os.open(path, _APPEND, 0o666)

    def reserve(self, path: Path, size: int) -> None:
        """Make a file that takes so many bytes of the disk.

        On a file system that copies on write, what it takes is not always what it gives back.
        """
        descriptor = self.create(path)
        try:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(descriptor, 0, size)
            else:
                self.write_whole(descriptor, bytes(size))
            os.fsync(descriptor)
        finally:
            self.close(descriptor)

    def remove(self, path: Path) -> None:
        """Remove a file, if it is there."""
        path.unlink(missing_ok=True)

    def cut(self, descriptor: int, size: int) -> None:
        """Take back what was appended behind a byte."""
        os.ftruncate(descriptor, size)

    def write(self, descriptor: int, data: bytes) -> int:
        """Write once; the number of bytes that went in."""
        return os.write(descriptor, data)

    def sync(self, descriptor: int) -> None:
        """Return when the data are on the medium."""
        sync_data(descriptor)

    def sync_folder(self, folder: Path) -> None:
        """Return when the names of the files in a folder are on the medium."""
        synced(folder)

    def close(self, descriptor: int) -> None:
        """Let go of a file; what a failed close means is said by the sync before it."""
        os.close(descriptor)

    def write_whole(self, descriptor: int, data: bytes) -> None:
        """Write at once and in whole.

        Raises
        ------
        OSError
            Also when fewer bytes went in than were given: the disk is about to be full.
        """
        done = self.write(descriptor, data)
        if done != len(data):
            raise OSError(errno.ENOSPC, f"only {done} of {len(data)} bytes were written")
