# SPDX-License-Identifier: BSD-3-Clause
"""A run out of an instrument: its folder, its warnings, its document."""

from __future__ import annotations

import os
import re
import time
import warnings
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.errors import AllaniteError, DataQualityWarning, InstrumentError, StorageError
from allanite.plain_files.atomic_file import make_folder
from allanite.recording.channel_names import for_shell

if TYPE_CHECKING:
    from allanite.acquisition.capture import Captured, Progress
    from allanite.acquisition.instruments import Identity, Instrument

__all__ = ["captured_document", "new_folder", "record_to", "run_name"]

#: Between two words about a run that goes well [s].
_GOING = 3600.0
#: Characters of a part of a folder's name; systems take 255 in all.
_LONGEST = 80
#: What writing to a terminal or a pipe that is gone ends with; a stream that is closed gives the latter.
_GONE = (OSError, ValueError)

Advance = Callable[[float, str], None]
Tell = Callable[[str, Mapping[str, Any]], None]


def record_to(
    instrument: Instrument,
    out: str | os.PathLike[str],
    *,
    name: str = "",
    duration: float | None = None,
    scale_date: str | None = None,
    progress: Advance | None = None,
    happened: Tell | None = None,
) -> Captured:
    """Record an instrument into a new folder under `out`, until the duration is over or a signal comes.

    Who is told how it goes, and cannot be told any more because a terminal or a pipe is gone, is left alone.

    Parameters
    ----------
    name : str
        Of the sensor, for the name of the folder; by default the model of the instrument.
    duration, scale_date
        As of `allanite.acquisition.capture.capture`.
    progress : callable, optional
        Told the share done and how it is going.
    happened : callable, optional
        Told what happens besides samples, as by `allanite.acquisition.capture.capture`; and "begun" with the folder and
        the instrument, "disk" before the start, "going" with numbers every hour, and "ended".

    Raises
    ------
    InstrumentError, StorageError
        As of `allanite.acquisition.capture.capture`, with the number of samples that are kept.
    """
    from allanite.acquisition.capture import capture, space_of, stopping_on_signals

    space = space_of(out, instrument.rate, len(instrument.channels), duration)
    if space.warning:
        warnings.warn(space.warning, DataQualityWarning, stacklevel=2)
    listeners = _Listeners(progress, happened)

    def begin(identity: Identity) -> Path:
        folder = listeners.folder = new_folder(
            out, run_name(name or identity.model, identity, datetime.now(UTC))
        )
        listeners.tell("begun", {"folder": str(folder), **identity.to_json()})
        return folder

    try:
        with stopping_on_signals() as stop:
            return capture(
                instrument,
                begin,
                duration=duration,
                stop=stop,
                scale_date=scale_date,
                progress=listeners.advance,
                happened=listeners.tell,
            )
    except (InstrumentError, StorageError) as error:
        error.args = (f"{error}{_kept(listeners.folder)}",)
        raise
    finally:
        listeners.tell("ended", {})


def _kept(folder: Path | None) -> str:
    """What a run that has failed holds, in words to go on with."""
    from allanite.commands.run_account import kept_in
    from allanite.files.store import open_run

    if folder is None:
        return ""
    try:
        kept = kept_in(open_run(folder))
    except (AllaniteError, OSError):  # a disk that fails is not read either
        return f". To see the stored samples: allanite recover --dry-run {for_shell(str(folder))}"
    return f". {kept} sample{'' if kept == 1 else 's'} kept in {folder}"


class _Listeners:
    """Who is told how a run goes: as long as they can be told, and the run goes on without them."""

    def __init__(self, progress: Advance | None, happened: Tell | None) -> None:
        self.folder: Path | None = None
        self._progress, self._happened = progress, happened
        self._said = time.monotonic()

    def advance(self, state: Progress) -> None:
        if self._progress is not None:
            try:
                self._progress(state.share or 0.0, _words(state))
            except _GONE:
                self._progress = None
        if time.monotonic() - self._said >= _GOING:
            self._said = time.monotonic()
            self.tell("going", {"samples": state.samples, "missing": state.missing, "share": state.share})

    def tell(self, kind: str, facts: Mapping[str, Any]) -> None:
        if self._happened is not None:
            try:
                self._happened(kind, facts)
            except _GONE:
                self._happened = None


def new_folder(out: str | os.PathLike[str], name: str) -> Path:
    """A folder of its own for a run: where another recorder has taken the name, a number is added to it.

    Raises
    ------
    StorageError
        The disk refuses.
    """
    parent = make_folder(out)
    for number in count(1):
        folder = parent / (name if number == 1 else f"{name}-{number}")
        try:
            folder.mkdir()
        except FileExistsError:
            continue
        except OSError as error:
            raise StorageError(f"cannot make the folder {folder}: {error.strerror or error}") from None
        return folder
    raise AssertionError


def run_name(name: str, identity: Identity, now: datetime) -> str:
    """<sensor>_<serial>_<UTC>, of characters that every system takes.

    >>> from allanite.acquisition.instruments import Identity
    >>> meter = Identity(maker="HP", model="3458A", serial="US 28/1")
    >>> run_name("SiRRS01-03", meter, datetime(2026, 11, 22, tzinfo=UTC))
    'SiRRS01-03_US-28-1_20261122T000000Z'
    """
    parts = [name, identity.serial, f"{now:%Y%m%dT%H%M%SZ}"]
    return "_".join(re.sub(r"[^A-Za-z0-9.-]+", "-", part)[:_LONGEST].strip("-.") for part in parts if part)


def _words(state: Progress) -> str:
    missing = f", {state.missing} missing" if state.missing else ""
    last = ", ".join(f"{v:.6g}" for v in state.values[:3])
    remark = f"; {state.remark}" if state.remark else ""
    return f"{state.samples} samples{missing}, last {last}{remark}"


def captured_document(captured: Captured) -> Mapping[str, Any]:
    """Plain data of a run that has ended."""
    return {
        "format": "allanite-captured",
        "version": 1,
        "folder": str(captured.folder),
        "instrument": captured.identity.to_json(),
        "samples": captured.samples,
        "missing": captured.missing,
        "gaps": captured.gaps,
        "overloads": captured.overloads,
        "doubtful": captured.doubtful,
        "rate": captured.rate,
        "rate_measured": captured.rate_measured,
        "remarks": captured.remarks,
        "remarks_noted": captured.remarks_noted,
        "dropped": captured.dropped,
        "status": captured.status,
        "reason": captured.reason,
    }
