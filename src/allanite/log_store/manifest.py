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
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from allanite.errors import StorageError
from allanite.log_store.disk import Disk
from allanite.log_store.host_clock import host_ns

__all__ = ["NAME", "Line", "Manifest", "is_locked", "read_manifest", "read_manifest_on"]

NAME: Final = "manifest.jsonl"

#: A line of a manifest: what happened, both clocks, and facts.
Line = Mapping[str, Any]


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

    def add(self, kind: str, *facts: Line) -> None:
        """Append a line with the time of both clocks for each of the facts, and return when they are on the medium.

        What fails is tried once more, from the bytes on: a second sync alone would seem to succeed.

        Raises
        ------
        OSError
            What the disk says.
        """
        times = {"kind": kind, "utc_ns": time.time_ns(), "monotonic_ns": host_ns()}
        lines = (_signed(json.dumps({**times, **each}, ensure_ascii=False)) for each in facts)
        data = b"".join(line.encode() + b"\n" for line in lines)
        before = os.fstat(self._descriptor).st_size
        try:
            self._put(data)
        except OSError:
            self._take_back(before)
            self._put(data)

    def _put(self, data: bytes) -> None:
        if self._torn:  # what a failed write has left must not spoil this one
            data = b"\n" + data
        self._torn = True
        self._disk.write_whole(self._descriptor, data)
        self._torn = False
        self._disk.sync(self._descriptor)

    def _take_back(self, size: int) -> None:
        """A line that failed; nobody who reads has relied on it."""
        with suppress(OSError):
            self._disk.cut(self._descriptor, size)
            self._torn = False

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


def read_manifest_on(folder: Path, offset: int) -> tuple[tuple[dict[str, Any], ...], int]:
    """The lines of a manifest behind a byte, as far as they are whole and verify, and the byte behind them."""
    try:
        with (folder / NAME).open("rb") as file:
            file.seek(offset)
            data = file.read()
    except FileNotFoundError:
        return (), offset
    whole = data[: data.rfind(b"\n") + 1]
    events = (_verified(line) for line in whole.split(b"\n") if line)
    return tuple(event for event in events if event is not None), offset + len(whole)


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
