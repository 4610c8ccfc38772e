# SPDX-License-Identifier: BSD-3-Clause
"""Where the page reads and writes: inside the served folder, whatever links, pipes and devices lie in it."""

from __future__ import annotations

import errno
import os
from pathlib import Path

from allanite.commands.page.replies import Refused
from allanite.commands.page.settings import RESULTS, Settings
from allanite.errors import InputError
from allanite.plain_files.regular_file import open_regular

__all__ = ["is_inside", "own_folder", "read_inside"]


def is_inside(path: Path, settings: Settings) -> bool:
    """Whether a path, and every entry of a folder that is one recording, leads to a place inside the served folder.

    Results of a folder that cannot be written are in the cache, and count as inside.
    """
    roots = (settings.folder, settings.cache.resolve() / RESULTS)
    try:
        places = [path.resolve(), *(p.resolve() for p in (path.iterdir() if path.is_dir() else ()))]
    except (OSError, RuntimeError):
        return False
    return all(any(place.is_relative_to(root) for root in roots) for place in places)


def own_folder(settings: Settings, name: str) -> Path:
    """A folder that the page itself fills, made if it is not there.

    Raises
    ------
    Refused
        409: it is a link or no folder; 409 or 507: it cannot be made.
    """
    above = settings.folder if settings.writable else settings.cache.resolve()
    place = above / name
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Refused(
            507 if error.errno == errno.ENOSPC else 409, f"{name} cannot be made: {error.strerror or error}"
        ) from None
    if place.resolve() != place:
        raise Refused(
            409, f"{name} is a link, and the page writes into the served folder only: remove the link"
        )
    return place


def read_inside(path: Path, settings: Settings, most: int) -> bytes:
    """The content of a small file in the served folder.

    Raises
    ------
    Refused
        404: it is gone, is no regular file or leads out of the folder; 413: it has more than `most` bytes.
    """
    try:
        with open_regular(path) as file:
            content = file.read(most + 1)
            # What was opened, not what has taken its place since, must be inside.
            same = os.path.samestat(path.resolve(strict=True).lstat(), os.fstat(file.fileno()))
    except (OSError, InputError):
        same = False
    if not same or not is_inside(path, settings):
        raise Refused(404, f"{path.name} is gone: look at the catalogue again")
    if len(content) > most:
        raise Refused(413, f"{path.name} has more than {most} bytes")
    return content
