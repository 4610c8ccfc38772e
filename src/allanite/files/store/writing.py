# SPDX-License-Identifier: BSD-3-Clause
"""The writer of a run: batches go in, and what is acknowledged is on the medium."""

from __future__ import annotations

import errno
import hashlib
import os
import secrets
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Literal, Self

from allanite.errors import InputError, StorageError
from allanite.files.store.batch import Batch
from allanite.files.store.disk import Disk
from allanite.files.store.header import Header
from allanite.files.store.manifest import Manifest
from allanite.files.store.message import END, Opening, encode
from allanite.files.store.segment import segment_name
from allanite.plain_files.atomic_file import make_folder

__all__ = ["RESERVE", "LogStore", "Status"]

Status = Literal["success", "abort", "fail"]

#: A batch so long after the last sync is synced [s]. Batches come each half second or are synced one by one: what is
#: written is never older than a second when it is synced.
_SYNC_AFTER: Final = 0.5

#: File of a run that is being written: room for its last samples and for its end on a disk that is full.
RESERVE: Final = "reserve"
#: Of it, seconds of samples, and bytes for openings and lines of the manifest.
_RESERVED_SECONDS, _RESERVED_BYTES = 2.0, 1 << 15

_ADVICE: Final = {
    errno.ENOSPC: "make room, or record to another disk",
    errno.EDQUOT: "your quota is exhausted: make room, or record to another disk",
    errno.EIO: "the disk is failing: save its data, check the kernel log (dmesg), and record to another disk",
    errno.EROFS: "the disk is read-only, perhaps because it failed: check the kernel log (dmesg)",
    errno.EACCES: "choose a writable folder",
}


class _OpenSegment:
    """The segment that is being written, and what of it is on the medium."""

    def __init__(self, folder: Path, number: int, opening: Opening, disk: Disk) -> None:
        self.name = segment_name(number)
        self.opening = opening
        self.begun = time.monotonic()
        self.size = self.rows = self.batches = 0
        self.first: int | None = None
        self.last: int | None = None
        self._disk = disk
        self._digest = hashlib.sha256()
        self._descriptor = disk.create(folder / self.name)
        try:
            self._put(opening.data)
            self.acknowledge()
            disk.sync_folder(folder)
        except OSError:
            disk.close(self._descriptor)
            with suppress(OSError):
                disk.remove(folder / self.name)  # there is nothing in it
            raise

    @property
    def is_open(self) -> bool:
        """Whether it was not let go of."""
        return self._descriptor >= 0

    def write(self, batch: Batch) -> None:
        self._put(encode(batch, self.batches, self.opening))
        self.batches += 1
        self.rows += len(batch)
        self.first = batch.first if self.first is None else self.first
        self.last = batch.last

    def acknowledge(self) -> None:
        """Sync, and remember what can be relied on from now on."""
        self._disk.sync(self._descriptor)
        self._relied_on = {
            "segment": self.name, "rows": self.rows, "first": self.first, "last": self.last, "bytes": self.size,
            "sha256": self._digest.hexdigest(),
        }  # fmt: skip

    def finish(self) -> dict[str, Any]:
        """End the stream; the facts for the manifest."""
        self._put(END)
        self.acknowledge()
        return self.abandon()

    def abandon(self) -> dict[str, Any]:
        """Let go of the file as it is: after a failed sync nothing more may be believed of it."""
        if self._descriptor >= 0:
            descriptor, self._descriptor = self._descriptor, -1
            self._disk.close(descriptor)
        return self._relied_on

    def _put(self, data: bytes) -> None:
        self._disk.write_whole(self._descriptor, data)
        self._digest.update(data)
        self.size += len(data)


class LogStore:
    """A run that is being written; made by `create`, used as a context manager.

    A write or a sync that fails ends its segment: the kernel reports a failed sync once, and a second one on the same
    file would seem to succeed. What was not acknowledged is written once more, into a new segment; if that fails as
    well, a `StorageError` says so and the store takes nothing more; room that was kept free takes the last samples and
    the end of the run. Readers drop what they then see twice.

    Attributes
    ----------
    folder : Path
    acknowledged : int or None
        Number of the last sample that is on the medium.
    """

    def __init__(
        self, folder: Path, header: Header, rotate_seconds: float, rotate_bytes: int, disk: Disk
    ) -> None:
        self.folder = folder
        self.acknowledged: int | None = None
        self._disk, self._rotate = disk, (rotate_seconds, rotate_bytes)
        self._written: int | None = None
        self._in_a_file = False  # whether any sample is
        self._waiting: list[Batch] = []  # not yet acknowledged
        self._abandoned: dict[str, Any] | None = (
            None  # facts of a segment that the manifest does not hold yet
        )
        self._synced = time.monotonic()
        self._open, self._number = True, 1
        self._opening = Opening.of(header, secrets.token_hex(8))
        self._manifest = Manifest(folder, disk)
        try:
            self._manifest.add(
                "run", {"run": self._opening.run, "process": os.getpid(), "header": header.to_json()}
            )
            disk.sync_folder(folder.parent)
            disk.reserve(folder / RESERVE, _reserved(header))
            self._segment = _OpenSegment(folder, 1, self._opening, disk)
        except BaseException:
            self._manifest.close()
            raise

    @classmethod
    def create(
        cls,
        folder: str | os.PathLike[str],
        header: Header,
        *,
        rotate_seconds: float = 600.0,
        rotate_bytes: int = 64 << 20,
        disk: Disk | None = None,
    ) -> Self:
        """Begin a run in a folder, which is made if it is not there.

        Parameters
        ----------
        folder : path
        header : Header
        rotate_seconds, rotate_bytes : float [s], int
            A segment that is older or larger is closed, and the next one begun.
        disk : Disk, optional
            Calls to the file system, for tests.

        Raises
        ------
        StorageError
            The folder holds a run, another process writes to it, or the disk refuses.
        """
        place = make_folder(folder)
        try:
            return cls(place, header, rotate_seconds, rotate_bytes, disk or Disk())
        except OSError as error:
            raise StorageError(f"cannot start a run in {place}: {_said(error)}") from error

    @property
    def header(self) -> Header:
        """The header of the part that is being written."""
        return self._opening.header

    # -- samples ----------------------------------------------------------------------------------------------

    def append(self, batch: Batch) -> None:
        """Write a batch, at once; it is acknowledged within a second if batches keep coming (see `sync`).

        Raises
        ------
        InputError
            Another number of channels than in the header, or a counter that does not go on from the last batch.
        StorageError
            The disk refuses. `acknowledged` says what is safe.
        """
        self._refuse_unfit(batch)
        if self._is_full():
            self._attempt(self._next_segment)
        self._waiting.append(batch)
        self._written = batch.last
        self._attempt(self._write_last)

    def sync(self) -> None:
        """Acknowledge what was appended: to be called when nothing has come for a while.

        Raises
        ------
        StorageError
            As of `append`.
        """
        self._refuse_closed()
        if self._waiting:
            self._attempt(self._acknowledge)

    def change(self, header: Header) -> None:
        """Go on with another header, in a new segment: the settings of the instrument have changed.

        Such a run is read part by part, never as one.

        Raises
        ------
        StorageError
            As of `append`.
        """
        self.sync()
        differences = self._opening.header.differences(header)
        self._opening = Opening.of(header, self._opening.run)
        self._attempt(self._next_segment)
        self.note("change", segment=self._segment.name, differences=differences)

    # -- what else happened -----------------------------------------------------------------------------------

    def note(self, kind: str, **facts: Any) -> None:
        """Append a line to the manifest: a gap, a step of the wall clock, a temperature, a reconnection, free space.

        Of a gap, say `counter` (number of the first sample that is missing) and `reason`.

        Raises
        ------
        StorageError
            The disk refuses.
        """
        self.note_each(kind, [facts])

    def note_each(self, kind: str, facts: Sequence[Mapping[str, Any]]) -> None:
        """Append a line for each of the facts, at the price of one; see `note`.

        Raises
        ------
        StorageError
            The disk refuses.
        """
        self._refuse_closed()
        try:
            self._manifest.add(kind, *facts)
        except OSError as error:
            raise StorageError(f"the manifest of {self.folder} cannot be written: {_said(error)}") from error

    def close(self, status: Status = "success", reason: str = "") -> None:
        """End the run: the last segment, and a line with the status. Nothing happens if it is closed.

        Raises
        ------
        StorageError
            The disk refuses. `acknowledged` says what is safe.
        """
        if not self._open:
            return
        try:
            self._give_back()
            self.sync()
            if self._open:
                self._finish_segment()
                self._end(status, reason)
        except OSError as error:
            raise self._failure(error) from error
        finally:
            self._let_go()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close("success")
        elif self._open:
            stopped = issubclass(kind, (KeyboardInterrupt, SystemExit))
            self.close("abort" if stopped else "fail", f"{kind.__name__}: {error}".removesuffix(": "))

    # -- inside -----------------------------------------------------------------------------------------------

    def _refuse_closed(self) -> None:
        if not self._open:
            raise StorageError(f"the run in {self.folder} is closed: start another one")

    def _refuse_unfit(self, batch: Batch) -> None:
        self._refuse_closed()
        channels = len(self._opening.header.channels)
        if batch.values.shape[1] != channels:
            raise InputError(
                f"a batch of {batch.values.shape[1]} channels for a run of {channels}: `change` starts another part"
            )
        if self._written is not None and batch.first <= self._written:
            raise InputError(
                f"sample {batch.first} after sample {self._written}: the counter of a run must increase; "
                "if an instrument restarts, continue from the last number"
            )

    def _attempt(self, step: Callable[[], None]) -> None:
        try:
            step()
        except OSError as error:
            self._begin_anew(error)

    def _write_last(self) -> None:
        self._segment.write(self._waiting[-1])
        self._in_a_file = True
        if time.monotonic() - self._synced >= _SYNC_AFTER:
            self._acknowledge()

    def _acknowledge(self) -> None:
        self._segment.acknowledge()
        self.acknowledged = self._written
        self._waiting.clear()
        self._synced = time.monotonic()

    def _is_full(self) -> bool:
        seconds, size = self._rotate
        return self._segment.size >= size or time.monotonic() - self._segment.begun >= seconds

    def _next_segment(self) -> None:
        self._finish_segment()
        self._open_segment()

    def _finish_segment(self) -> None:
        facts = self._segment.finish()
        self.acknowledged = self._written
        self._waiting.clear()
        self._manifest.add("closed", facts)

    def _open_segment(self) -> None:
        self._number += 1
        self._segment = _OpenSegment(self.folder, self._number, self._opening, self._disk)

    def _begin_anew(self, error: OSError) -> None:
        """After a failed write or sync: a new segment for all that is not acknowledged, or the end."""
        try:
            self._write_anew(error)
        except OSError as second:
            self._end_by(second)
            raise self._failure(second) from error

    def _write_anew(self, error: OSError) -> None:
        if self._segment.is_open:
            self._abandoned = {**self._segment.abandon(), "error": _said(error)}
        if self._abandoned is not None:
            self._manifest.add("closed", self._abandoned)
            self._abandoned = None
        self._open_segment()
        for batch in self._waiting:
            self._segment.write(batch)
            self._in_a_file = True
        self._acknowledge()

    def _end_by(self, error: OSError) -> None:
        """End the run in the room that was kept free for it: what waits, what of it is lost, and why."""
        self._give_back()
        with suppress(OSError):
            self._write_anew(error)
            self._finish_segment()
        with suppress(OSError):
            if self._waiting and self._written is not None:
                first = 0 if self.acknowledged is None else self.acknowledged + 1
                lost = {"counter": first, "samples": self._written + 1 - first, "reason": _said(error)}
                self._manifest.add("gap", lost)
        with suppress(OSError):  # without its end the run is one that broke off
            self._end("fail", _said(error))
        self._let_go()

    def _end(self, status: Status, reason: str) -> None:
        facts = {"status": status, "reason": reason, "last": self.acknowledged, "written": self._written}
        self._manifest.add("end", facts)

    def _give_back(self) -> None:
        """The room that was reserved."""
        with suppress(OSError):
            self._disk.remove(self.folder / RESERVE)

    def _let_go(self) -> None:
        """Close the files, whatever the disk says to it, and unlock."""
        self._open = False
        self._give_back()
        for release in (self._segment.abandon, self._manifest.close):
            try:
                release()
            except OSError:
                continue  # closed all the same

    def _failure(self, error: OSError) -> StorageError:
        lost = sum(map(len, self._waiting))
        if self.acknowledged is not None:
            safe = f"everything up to sample {self.acknowledged} is stored"
        else:
            safe = "no sample is confirmed on disk" if self._in_a_file else "nothing was stored"
        after = " after it" if self.acknowledged is not None else ""
        return StorageError(
            f"the run in {self.folder} cannot continue: {_said(error)}; {safe}"
            + (f", the {lost} samples{after} may be lost" if lost else "")
        )


def _reserved(header: Header) -> int:
    """Bytes for the samples that may wait, and for the end."""
    each = 17 + 8 * len(header.channels)
    return _RESERVED_BYTES + round(_RESERVED_SECONDS * header.rate * each)


def _said(error: OSError) -> str:
    """What the disk said, and what to do."""
    reason = error.strerror or str(error)
    advice = _ADVICE.get(error.errno or 0)
    return f"{reason}: {advice}" if advice else reason
