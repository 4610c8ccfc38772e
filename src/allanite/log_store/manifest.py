# SPDX-License-Identifier: BSD-3-Clause
"""The manifest of a run: one line for each thing that happened, appended and never changed.

A line is a JSON object; its last key is the CRC-32 of the line as it would be without that key. A line that does not
agree with it (cut by a crash, or damaged) is left out and counted. The writer of a run keeps its manifest locked, until
it closes it or dies; readers do not care.
"""

from __future__ import annotations

import fcntl
import json
import os
import time
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from allanite.errors import StorageError
from allanite.log_store.disk import Disk

__all__ = ["NAME", "Manifest", "is_locked", "read_manifest"]

NAME: Final = "manifest.jsonl"

Event = Mapping[str, Any]


class Manifest:
    """The manifest of a new run, locked against a second writer.

    Raises
    ------
    StorageError
        Somebody writes to the folder, or it holds a run already.
    OSError
        What the disk says.
    """

    def __init__(self, folder: Path, disk: Disk) -> None:
        self._disk = disk
        self._torn = False
        self._descriptor = disk.open_or_create(folder / NAME)
        try:
            _lock(self._descriptor, folder)
            if os.fstat(self._descriptor).st_size:
                raise StorageError(
                    f"{folder} holds a run already, and a run is never continued: choose another folder"
                )
        except BaseException:
            disk.close(self._descriptor)
            raise

    def add(self, kind: str, facts: Event) -> None:
        """Append a line with the time of both clocks, and return when it is on the medium.

        Raises
        ------
        OSError
            What the disk says.
        """
        line = {"kind": kind, "utc_ns": time.time_ns(), "monotonic_ns": time.monotonic_ns(), **facts}
        data = _signed(json.dumps(line, ensure_ascii=False)).encode() + b"\n"
        if self._torn:  # what a failed write has left must not spoil this one
            data = b"\n" + data
        self._torn = True
        self._disk.write_whole(self._descriptor, data)
        self._torn = False
        self._disk.sync(self._descriptor)

    def close(self) -> None:
        """Unlock."""
        self._disk.close(self._descriptor)


def read_manifest(folder: Path) -> tuple[tuple[dict[str, Any], ...], int]:
    """The lines of a manifest, and how many are damaged; none where there is no manifest."""
    try:
        data = (folder / NAME).read_bytes()
    except FileNotFoundError:
        return (), 0
    lines = [line for line in data.split(b"\n") if line]
    events = [event for line in lines if (event := _verified(line)) is not None]
    return tuple(events), len(lines) - len(events)


def is_locked(folder: Path) -> bool:
    """True while somebody writes to a run."""
    try:
        descriptor = os.open(folder / NAME, os.O_RDONLY | os.O_CLOEXEC)
    except FileNotFoundError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False


def _lock(descriptor: int, folder: Path) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise StorageError(
            f"{folder} is being written by another process: stop that one, or choose another folder; reading is free"
        ) from None


def _signed(line: str) -> str:
    return f'{line[:-1]}, "crc32": "{zlib.crc32(line.encode()):08x}"}}'


def _verified(data: bytes) -> dict[str, Any] | None:
    try:
        line = data.decode()
        unsigned = line[: line.rindex(', "crc32": ')] + "}"
        return json.loads(unsigned) if _signed(unsigned) == line else None
    except ValueError:
        return None
