# SPDX-License-Identifier: BSD-3-Clause
"""The manifest of a run: one line for each thing that happened, appended and never changed.

A line is a JSON object; its last key is the CRC-32 of the line as it would be without that key. A line that does not
agree with it (cut by a crash, or damaged) is left out and counted. The writer of a run keeps its manifest locked, until
it closes it or dies; readers do not care.
"""

from __future__ import annotations

import json
import os
import re
import time
import zlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from allanite.errors import StorageError
from allanite.files.store.disk import Disk
from allanite.files.store.host_clock import host_ns
from allanite.plain_files.file_lock import is_locked as is_held
from allanite.plain_files.file_lock import try_lock
from allanite.plain_files.json_values import parse_plain
from allanite.plain_files.limits import LINES, refuse_more
from allanite.plain_files.regular_file import open_regular, read_regular

__all__ = ["NAME", "Line", "Manifest", "is_locked", "is_sound", "read_manifest", "read_manifest_on"]

NAME: Final = "manifest.jsonl"

#: A line of a manifest: what happened, both clocks, and facts.
Line = Mapping[str, Any]


def _is_number(value: Any) -> bool:
    """A whole number of 64 bits."""
    return type(value) is int and -(1 << 63) <= value < 1 << 63


def _is_count(value: Any) -> bool:
    return _is_number(value) and value >= 0


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_segment(value: Any) -> bool:
    return isinstance(value, str) and re.fullmatch(r"\d{6,}\.arrows", value, re.ASCII) is not None


def _or_none(sound: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: value is None or sound(value)


#: What every line holds, and what those of some kinds hold as well; a line with anything else there is damaged.
_EVERY: Final = {"kind": _is_text, "utc_ns": _is_number, "monotonic_ns": _is_number}
_NEEDED: Final[Mapping[str, Mapping[str, Callable[[Any], bool]]]] = {
    "run": {"run": _is_text, "header": lambda value: isinstance(value, dict)},
    "closed": {
        "segment": _is_segment,
        "bytes": _is_count,
        "sha256": _is_text,
        "first": _or_none(_is_number),
        "last": _or_none(_is_number),
    },
    "end": {"status": _is_text, "reason": _is_text},
}
#: What lines of some kinds may hold, and then so.
_FREE: Final[Mapping[str, Mapping[str, Callable[[Any], bool]]]] = {
    "change": {"segment": _is_segment},
    "end": {"last": _or_none(_is_number), "written": _or_none(_is_number)},
    "gap": {"counter": _is_number, "samples": _is_count},
    "plan": {"samples": _or_none(_is_count)},
    "remark": {"more": _is_count},
}


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
                    f"{folder} already contains a run, and a run is never continued: choose another folder"
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
        data = read_regular(folder / NAME)
    except FileNotFoundError:
        return (), 0
    refuse_more(data.count(b"\n"), LINES, "lines", str(folder / NAME), "Divide the run")
    lines = [line for line in data.split(b"\n") if line]
    events = [event for line in lines if (event := _verified(line)) is not None]
    return tuple(events), len(lines) - len(events)


def read_manifest_on(folder: Path, offset: int) -> tuple[tuple[dict[str, Any], ...], int]:
    """The lines of a manifest behind a byte, as far as they are whole and verify, and the byte behind them."""
    try:
        with open_regular(folder / NAME) as file:
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
        with open_regular(folder / NAME) as file:
            return is_held(file.fileno())
    except FileNotFoundError:
        return False


def _lock(descriptor: int, folder: Path) -> None:
    if not try_lock(descriptor):
        raise StorageError(
            f"{folder} is being written by another process: stop that one, or choose another folder. "
            "Reading is possible"
        )


def _signed(line: str) -> str:
    return f'{line[:-1]}, "crc32": "{zlib.crc32(line.encode()):08x}"}}'


def _verified(data: bytes) -> dict[str, Any] | None:
    try:
        line = data.decode()
        unsigned = line[: line.rindex(', "crc32": ')] + "}"
        event = parse_plain(unsigned) if _signed(unsigned) == line else None
    except ValueError:
        return None
    return event if is_sound(event) else None


def is_sound(event: Any) -> bool:
    """Whether a line holds what its kind needs, as it needs it."""
    if not isinstance(event, Mapping) or not all(
        key in event and sound(event[key]) for key, sound in _EVERY.items()
    ):
        return False
    needed, free = (table.get(event["kind"], {}) for table in (_NEEDED, _FREE))
    return all(key in event and sound(event[key]) for key, sound in needed.items()) and all(
        sound(event[key]) for key, sound in free.items() if key in event
    )
