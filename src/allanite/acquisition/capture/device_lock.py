# SPDX-License-Identifier: BSD-3-Clause
"""One recorder for each device: two would take each other's bytes, and both runs would be wrong.

The lock is the operating system's, on a file that all users can open: it ends with the process that holds it, however
that ends, so that a lock of the dead never stands in the way. Only the owner of the file writes into it who has the
device; a lock needs no right to write.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from allanite.errors import InstrumentError
from allanite.plain_files.file_lock import try_lock

__all__ = ["DeviceLock", "locked_device"]

#: Where devices are locked for the whole machine: the first of them that everybody may write to, and nobody remove the
#: files of others from, so that all users take the same one, whatever they may do and whatever TMPDIR says.
_SHARED: Final = (Path("/run/lock"), Path("/tmp"))  # noqa: S108 - opened without following links, for no more than a lock
_FOR_ALL: Final = stat.S_ISVTX | stat.S_IWOTH


class DeviceLock:
    """A device that is locked; made by `locked_device`."""

    def __init__(self, device: str, path: Path, descriptor: int) -> None:
        self._device, self._path, self._descriptor = device, path, descriptor
        self.say()

    def say(self, run: str | os.PathLike[str] | None = None) -> None:
        """Tell who is refused what holds the device: this process, and its run once it has a folder."""
        facts = {
            "device": self._device,
            "process": os.getpid(),
            "since": f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}",
        }
        if run is not None:
            facts["run"] = str(Path(run).absolute())
        with suppress(OSError):  # the lock itself holds
            os.ftruncate(self._descriptor, 0)
            os.lseek(self._descriptor, 0, os.SEEK_SET)
            os.write(self._descriptor, json.dumps(facts).encode())

    def release(self) -> None:
        """Give the device back."""
        with suppress(OSError):  # the file of another user stays, and does no harm
            self._path.unlink()
        os.close(self._descriptor)


@contextmanager
def locked_device(device: str) -> Iterator[DeviceLock | None]:
    """Hold the lock of a device; of "" there is none.

    Parameters
    ----------
    device : str
        As `Instrument.device` names it: two names of one device are two devices here.

    Raises
    ------
    InstrumentError
        Another recorder has it, or no lock can be made.
    """
    if not device:
        yield None
        return
    lock = _taken(device)
    try:
        yield lock
    finally:
        lock.release()


def _taken(device: str) -> DeviceLock:
    path = _path_of(device)
    while True:
        try:
            descriptor = _opened(path)
        except OSError as error:
            raise InstrumentError(
                f"{device} cannot be locked against a second recorder: {path}: {error.strerror}. Make that folder "
                "writable, or set TMPDIR to one that is"
            ) from None
        if not try_lock(descriptor):
            held = _told(descriptor)
            os.close(descriptor)
            raise InstrumentError(_refusal(device, held))
        if _is_still(path, descriptor):
            return DeviceLock(device, path, descriptor)
        os.close(descriptor)  # given back and removed meanwhile: once more


def _path_of(device: str) -> Path:
    folder = next(filter(_is_for_all, _SHARED), Path(tempfile.gettempdir()))
    plain = re.sub(r"[^A-Za-z0-9.]+", "-", device).strip("-.")[-60:]
    return folder / f"allanite-{plain}-{hashlib.sha256(device.encode()).hexdigest()[:8]}.lock"


def _is_for_all(folder: Path) -> bool:
    try:
        return folder.stat().st_mode & _FOR_ALL == _FOR_ALL
    except OSError:
        return False


def _opened(path: Path) -> int:
    """The file, made if it is not there. Without O_CREAT first: the system refuses that on files of other users."""
    plain = sum(getattr(os, name, 0) for name in ("O_CLOEXEC", "O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))
    while True:
        with suppress(FileNotFoundError):
            return _regular(_for_both(path, plain))
        with suppress(FileExistsError):
            descriptor = os.open(path, plain | os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o644)
            if hasattr(os, "fchmod"):  # whatever the umask says: other users lock the same device
                os.fchmod(descriptor, 0o644)
            return descriptor


def _for_both(path: Path, plain: int) -> int:
    """Opened to write where this user may, else to read: a file of another user is locked all the same."""
    try:
        return os.open(path, plain | os.O_RDWR)
    except PermissionError:
        return os.open(path, plain | os.O_RDONLY)


def _regular(descriptor: int) -> int:
    if stat.S_ISREG(os.fstat(descriptor).st_mode):
        return descriptor
    os.close(descriptor)
    raise OSError(errno.EINVAL, "this is not a regular file")


def _is_still(path: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def _told(descriptor: int) -> dict[str, Any]:
    """What the file says of the holder, if that can be true: its process lives, and belongs to who wrote the file."""
    try:
        holder = json.loads(os.read(descriptor, 4096))
        owner = Path(f"/proc/{int(holder['process'])}").stat().st_uid
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    return holder if owner == os.fstat(descriptor).st_uid else {}


def _refusal(device: str, held: dict[str, Any]) -> str:
    who = f"process {held['process']}" if "process" in held else "another process"
    into = f" into {held['run']}" if "run" in held else ""
    since = f" since {held['since']}" if "since" in held else ""
    return (
        f"{device} is being recorded by {who}{into}{since}: stop that one (kill {held.get('process', 'PID')}), "
        "or record another device"
    )
