# SPDX-License-Identifier: BSD-3-Clause
"""Files that are either written whole or not at all, and that never replace another by accident."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from allanite.errors import StorageError
from allanite.plain_files.durable import synced
from allanite.plain_files.loggers import logger_of

__all__ = ["fresh", "make_folder", "refuse_existing"]

_LOG = logger_of(__name__)


@contextmanager
def fresh(path: str | os.PathLike[str], *, force: bool = False, durable: bool = False) -> Iterator[Path]:
    """Give a place to write to; when the block ends without an error, the file stands at `path`.

    Parameters
    ----------
    path : path
        Its folder must exist.
    force : bool
        Replace a file that is there.
    durable : bool
        The file is on the medium when the block has ended: a loss of power does not take it.

    Raises
    ------
    StorageError
        The file exists, the folder does not, the name is none, or the disk refuses.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> with fresh(folder / "note.txt") as place:
    ...     _ = place.write_text("whole")
    >>> (folder / "note.txt").read_text()
    'whole'
    """
    target = Path(path)
    refuse_existing(target, force=force)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.name}.", suffix=target.suffix, dir=target.parent)
        os.close(handle)
    except (OSError, ValueError) as error:
        raise _refusal("write", target, error) from None
    place = Path(name)
    try:
        yield place
        place.chmod(0o666 & ~_umask())
        if durable:
            synced(place)
        place.replace(target)
        _LOG.info("wrote %s", target)
        if durable:
            synced(target.parent)
    except OSError as error:
        raise _refusal("write", target, error) from error
    finally:
        place.unlink(missing_ok=True)


def refuse_existing(*paths: str | os.PathLike[str], force: bool) -> None:
    """Raise unless none of the files exists, or `force` is given.

    Raises
    ------
    StorageError
        Names the files that exist, or a name that none can have.
    """
    there = [str(p) for p in paths if _exists(p)]
    if there and not force:
        raise StorageError(
            f"{', '.join(there)} exists; use --force (force=True) to replace it, or choose another place"
        )


def make_folder(path: str | os.PathLike[str]) -> Path:
    """Make a folder, and those above it, if it is not there.

    Raises
    ------
    StorageError
        A file stands in its place, or the disk refuses.
    """
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise _refusal("make the folder", path, error) from None
    return Path(path)


def _exists(path: str | os.PathLike[str]) -> bool:
    try:
        Path(path).stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except (
        OSError,
        ValueError,
    ) as error:  # too long for a name, a NUL in it, a folder that may not be entered
        raise _refusal("write", path, error) from None
    return True


def _refusal(what: str, path: str | os.PathLike[str], error: OSError | ValueError) -> StorageError:
    reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
    shown = str(path).replace("\0", "\\0")
    return StorageError(f"cannot {what} {shown}: {reason}; choose another name or place")


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
