# SPDX-License-Identifier: BSD-3-Clause
"""A run from its first sample to its end: one thread listens, this one writes."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from allanite.acquisition.capture.clock import HostClock
from allanite.acquisition.capture.device_lock import locked_device
from allanite.acquisition.capture.listener import Listener, Patience
from allanite.acquisition.capture.stopping import Stop
from allanite.acquisition.capture.writer import Captured, Progress, Writer
from allanite.acquisition.instruments import Identity, Instrument
from allanite.errors import InputError
from allanite.files.store import Header, LogStore

__all__ = ["capture"]

#: Seconds of samples that wait for a disk that stalls.
_ROOM = 30.0
_LEAST_ROOM = 4096  # samples


def capture(
    instrument: Instrument,
    folder: str | os.PathLike[str] | Callable[[Identity], Path],
    *,
    duration: float | None = None,
    stop: Stop | None = None,
    patience: Patience | None = None,
    scale_date: str | None = None,
    clock: HostClock | None = None,
    rotate_seconds: float = 600.0,
    progress: Callable[[Progress], None] | None = None,
    happened: Callable[[str, Mapping[str, Any]], None] | None = None,
) -> Captured:
    """Record an instrument into a run.

    The device is locked against a second recorder before anything is sent or written. Where the instrument comes back
    with other settings the run goes on as another part, and parts are never read as one.

    Parameters
    ----------
    instrument : Instrument
        Instrument, not yet opened.
    folder : path, or callable
        Folder of the run, created if necessary. A callable makes it from the identity of the instrument.
    duration : float, optional [s]
        Of the instrument's own time: so many samples at its rate, missing ones included. Where the instrument is silent
        or gone, the clock of the host ends the run, two seconds later. By default until `stop`.
    stop : Stop, optional
        Ends the run when it is asked.
    patience : Patience, optional
        Longest silence to tolerate.
    scale_date : str, optional
        Date of the scale factors.
    clock : HostClock, optional
        Clock of the host.
    rotate_seconds : float [s]
        Length of a segment; see `LogStore.create`.
    progress : callable, optional
        Called with the progress, at most some times a second.
    happened : callable, optional
        Called immediately for every event besides samples: its kind ("lost", "silence", "reconnected", "remark",
        "facts", "rate", "gap", "change", "clock", "disk") and its facts.

    Raises
    ------
    InputError
        A duration that is not positive.
    InstrumentError
        Another recorder has it, it does not answer, is another one after a reconnection, did not come back, or gave
        no sample in the whole duration. What was recorded is kept.
    StorageError
        The disk refuses, or the folder holds a run. What was acknowledged is kept.
    """
    if duration is not None and not duration > 0:
        raise InputError(f"the duration of a run must be positive, not {duration!r} s")
    clock, patience, stop = clock or HostClock(), patience or Patience(), stop or Stop()
    with locked_device(instrument.device) as lock:
        try:
            identity = instrument.open()
            header = _header(instrument, identity, scale_date)
            place = folder(identity) if callable(folder) else folder
            with LogStore.create(place, header, rotate_seconds=rotate_seconds) as store:
                if lock is not None:
                    lock.say(store.folder)
                listener = Listener(
                    instrument,
                    identity,
                    room=max(int(_ROOM * instrument.rate), _LEAST_ROOM),
                    patience=patience,
                    header=header,
                    describe=lambda answered: _header(instrument, answered, scale_date),
                )
                writer = Writer(store, duration, clock, progress, happened)
                _listen_and_write(instrument, listener, writer, stop)
                return writer.finish(identity, stop)
        finally:
            instrument.close()


def _listen_and_write(instrument: Instrument, listener: Listener, writer: Writer, stop: Stop) -> None:
    """The run itself; returns when all that came is written.

    Raises
    ------
    InstrumentError, StorageError
        As of `capture`.
    """
    writer.look()
    instrument.start()
    listener.start()
    try:
        over = writer.run(listener, stop)
    finally:
        listener.abandon()
        listener.join()
        instrument.stop()
    if listener.failure is not None and not over:
        raise listener.failure


def _header(instrument: Instrument, identity: Identity, scale_date: str | None) -> Header:
    settings = dict(instrument.settings)
    aperture = settings.get("aperture")
    return Header(
        channels=instrument.channels,
        rate=instrument.rate,
        instrument=identity.to_json(),
        settings=settings,
        aperture=float(aperture) if isinstance(aperture, int | float) else None,
        scale_date=scale_date,
    )
