# SPDX-License-Identifier: BSD-3-Clause
"""Which logs there are: files and runs in folders, and whatever an address of fsspec names."""

from __future__ import annotations

import glob
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from allanite.errors import InputError
from allanite.files.readers import run as runs
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.extras import require

__all__ = ["LogAddress", "file_system", "logs_of"]


@dataclass(frozen=True, slots=True)
class LogAddress:
    """A log.

    Attributes
    ----------
    name : str
        As it was given.
    place : str
        Where a worker reads it: an absolute path, or an address.
    stamp : str
        Size and time of the last change: another one means that the log may have changed.
    """

    name: str
    place: str
    stamp: str


def logs_of(globs: Sequence[str], folder: Path, *, none_is_fine: bool = False) -> list[LogAddress]:
    """The logs that globs name, each once, by name; relative ones begin in `folder`.

    Raises
    ------
    InputError
        A glob that names nothing, unless that is fine; an address of an unknown kind, or one that is not reached.
    """
    made: dict[str, LogAddress] = {}
    for pattern in globs:
        named = {log.name: log for log in _logs(pattern, folder)}
        if not (named or none_is_fine):
            raise InputError(
                f"{pattern}: no such log; quote the pattern, and write ** for folders of any depth"
            )
        made |= named
    return [made[name] for name in sorted(made)]


def _logs(pattern: str, folder: Path) -> Iterable[LogAddress]:
    return _remote(pattern) if "://" in pattern else _local(pattern, folder)


def _local(pattern: str, folder: Path) -> Iterator[LogAddress]:
    names = [pattern] if (folder / pattern).exists() else _globbed(pattern, folder)
    for name in names:
        place = folder / name
        if place.is_file():
            yield LogAddress(name, str(place), _stamp(place))
        elif place.is_dir() and runs.sniff(b"", place):
            stamps = (f"{part.name} {_stamp(part)}" for part in sorted(place.iterdir()))
            yield LogAddress(name, str(place), "; ".join(stamps))


def _globbed(pattern: str, folder: Path) -> list[str]:
    return glob.glob(pattern, root_dir=folder, recursive=True)  # noqa: PTH207 - absolute patterns are none for Path


def _stamp(file: Path) -> str:
    facts = file.stat()
    return f"{facts.st_size} {facts.st_mtime_ns}"


def _remote(pattern: str) -> Iterator[LogAddress]:
    try:
        system, path = file_system(pattern)
        entries = system.glob(path, detail=True)
    except (OSError, ValueError, ImportError) as fault:
        raise InputError(f"{pattern} cannot be listed: {fault}") from None
    for name, facts in entries.items():
        if facts.get("type") != "directory":
            changed = next(
                (str(facts[key]) for key in ("ETag", "LastModified", "mtime") if facts.get(key)), ""
            )
            address = system.unstrip_protocol(name)
            yield LogAddress(address, address, f"{facts.get('size')} {changed}")


def file_system(address: str) -> tuple[Any, str]:
    """The file system of fsspec behind an address, and the path in it; nothing of it is remembered from before.

    Raises
    ------
    InputError
        There is no fsspec.
    """
    require("fsspec", "cluster", f"the address {address}")
    from fsspec.core import url_to_fs

    system, path = url_to_fs(address)
    system.invalidate_cache()
    return system, path
