# SPDX-License-Identifier: BSD-3-Clause
"""How a command that failed ends: an exit code and a sentence, whatever was raised.

An error of our own says what to do. The system's says what it refused. Anything else is a defect in allanite: the user
gets a file to send in place of a traceback.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path

from allanite import __version__
from allanite.errors import AllaniteError
from allanite.plain_files.printable import printable

__all__ = ["FAILED", "INTERNAL", "failure"]

FAILED = 1
INTERNAL = 70
"""Exit code of a defect in allanite (EX_SOFTWARE of sysexits.h)."""

_HERE = Path(__file__).resolve().parent.parent


def failure(error: Exception) -> tuple[int, str]:
    """Exit code of what a command raised, and the sentence about it."""
    if isinstance(error, AllaniteError):
        return FAILED, str(error)
    if isinstance(error, MemoryError):
        return FAILED, "there is not enough memory; use a shorter record or fewer channels"
    if isinstance(error, OSError):  # a name that is too long, a folder that may not be looked into
        where = "" if error.filename is None else f"{error.filename}: "
        return FAILED, f"{where}{error.strerror or error}; give another place or name"
    return INTERNAL, _internal(error)


def _internal(error: Exception) -> str:
    what = f"internal error: {type(error).__name__} in {_place(error)}. This is a defect in allanite"
    report = _written(error)
    if report is None:
        return f"{what}; please report it with the command that you gave and: {printable(str(error))[:300]}"
    return f"{what}; please report it with {report}, which contains the command and the traceback"


def _place(error: Exception) -> str:
    """Where in allanite it was raised, or where allanite called what raised it."""
    import traceback

    ours = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if Path(frame.filename).is_relative_to(_HERE)
    ]
    if not ours:
        return "the program"
    return f"{Path(ours[-1].filename).relative_to(_HERE).as_posix()}, line {ours[-1].lineno}"


def _written(error: Exception) -> Path | None:
    """The file to send; None where nothing can be written."""
    import platform
    import tempfile
    import traceback

    lines = [
        f"allanite {__version__}, Python {platform.python_version()}, {platform.platform()}",
        f"command: {sys.argv}",
        "",
        *traceback.format_exception(error, limit=-40),
    ]
    with suppress(OSError, ValueError):
        folder = _folder()
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        handle, name = tempfile.mkstemp(prefix="internal-error-", suffix=".txt", dir=folder)
        with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write("\n".join(lines))
        return Path(name)
    return None


def _folder() -> Path:
    """Of what a program keeps about itself (XDG base directories); it is there after the command, unlike TMPDIR."""
    named = os.environ.get("XDG_STATE_HOME")
    return (Path(named) if named else Path.home() / ".local" / "state") / "allanite"
