# SPDX-License-Identifier: BSD-3-Clause
"""Files that somebody names, opened to be read: only regular files, and looked at before they are opened.

Opening a FIFO waits for ever, opening a device may start something (a watchdog, a tape), and neither ends. So all
that reads the file of a user goes through here; libraries that open a path themselves get one that is `regular`.
"""

from __future__ import annotations

import hashlib
import os
import stat
from io import BufferedReader
from pathlib import Path
from typing import Final

from allanite.errors import InputError, LimitError

__all__ = ["file_sha256", "open_regular", "read_regular", "read_regular_text", "regular"]

_KINDS: Final = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe (FIFO)"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
#: Not to wait where the file was replaced by a FIFO, and not to take a terminal, since it was looked at.
_FLAGS: Final = (
    os.O_RDONLY
    | getattr(os, "O_BINARY", 0)
    | getattr(os, "O_CLOEXEC", 0)
    | getattr(os, "O_NONBLOCK", 0)
    | getattr(os, "O_NOCTTY", 0)
)


def regular(path: str | os.PathLike[str]) -> Path:
    """A path that leads to a regular file now, for a library that opens it; nothing is opened here.

    Raises
    ------
    InputError
        It leads to a FIFO, a socket, a device or a folder.
    OSError
        What the file system says: no such file, no permission.
    """
    place = Path(path)
    _refuse(place, place.stat().st_mode)
    return place


def open_regular(path: str | os.PathLike[str]) -> BufferedReader:
    """A file, opened to be read in binary; the caller closes it.

    Raises
    ------
    InputError
        It is no regular file: see `regular`.
    OSError
        What the file system says.
    """
    descriptor = os.open(regular(path), _FLAGS)
    try:
        _refuse(Path(path), os.fstat(descriptor).st_mode)
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def read_regular(path: str | os.PathLike[str], most: int | None = None) -> bytes:
    """The content of a file.

    Parameters
    ----------
    most : int, optional [bytes]
        A larger file is refused before it is read.

    Raises
    ------
    InputError
        It is no regular file: see `regular`.
    LimitError
        It is larger than `most`.
    OSError
        What the file system says.
    """
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        if most is not None and size > most:
            raise LimitError(f"{path} has {size} bytes; at most {most} are read of such a file")
        return file.read()


def read_regular_text(path: str | os.PathLike[str], most: int | None = None) -> str:
    """The content of a file in UTF-8, without its mark; parameters and errors are those of `read_regular`.

    Raises
    ------
    UnicodeDecodeError
        It is no text.
    """
    return read_regular(path, most).decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")


def _refuse(path: Path, mode: int) -> None:
    if stat.S_ISREG(mode):
        return
    kind = next((name for matches, name in _KINDS if matches(mode)), "something else")
    if kind == "a folder":
        raise InputError(f"{path} is a folder; expected a file")
    raise InputError(
        f"{path} is {kind}, not a regular file: it is not opened. Save its output to a file, or pipe it "
        "in and pass - as the name"
    )


def file_sha256(path: str | os.PathLike[str]) -> str | None:
    """SHA-256 of a file in hexadecimal; None for a folder."""
    place = Path(path)
    if not place.is_file():
        return None
    with open_regular(place) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
