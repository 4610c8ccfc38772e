# SPDX-License-Identifier: BSD-3-Clause
"""A run from its first sample to its end: one thread listens, this one writes."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from allanite.capture.clock import ClockWatch, HostClock
from allanite.capture.listener import Event, Listener, Patience
from allanite.capture.numbering import Numbered
from allanite.capture.space import batch_seconds, space_of
from allanite.capture.stopping import Stop
from allanite.errors import InputError
from allanite.instruments import Identity, Instrument
from allanite.log_store import Batch, Header, LogStore

__all__ = ["Captured", "Progress", "capture"]

#: Seconds of samples that wait for a disk that stalls.
_ROOM = 30.0
_LEAST_ROOM = 4096  # samples
#: Between looks at the clocks and at the disk [s].
_LOOK = 60.0
_PATIENT = 0.25  # wait for samples [s]


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How a run is going.

    Attributes
    ----------
    samples, missing : int
        Written, and known to be missing.
    share : float or None
        Of the planned duration.
    values : tuple of float
        Last sample, in the channels' own units.
    free_seconds : float [s]
        For how long the disk lasts.
    remark : str
        The last thing that happened besides samples; "" in the normal course.
    """

    samples: int = 0
    missing: int = 0
    share: float | None = None
    values: tuple[float, ...] = ()
    free_seconds: float = float("inf")
    remark: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Captured:
    """A run that has ended.

    Attributes
    ----------
    folder : Path
    identity : Identity
    samples : int
        Stored.
    missing, gaps : int
        Samples that did not come, and in how many stretches.
    dropped : int
        Of the missing ones, those for which the host was too slow.
    status, reason : str
        "success", or "abort" and who asked for it.
    """

    folder: Path
    identity: Identity
    samples: int
    missing: int
    gaps: int
    dropped: int
    status: str
    reason: str


def capture(
    instrument: Instrument,
    folder: str | os.PathLike[str] | Callable[[Identity], Path],
    *,
    duration: float | None = None,
    stop: Stop | None = None,
    patience: Patience | None = None,
    scale_date: str | None = None,
    clock: HostClock | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Captured:
    """Record an instrument into a run.

    Parameters
    ----------
    instrument : Instrument
        Not yet opened.
    folder : path, or callable
        Of the run; made if it is not there. A callable makes it of the identity of the instrument.
    duration : float, optional [s]
        Of the instrument's own time: so many samples at its rate, missing ones included. By default until `stop`.
    stop : Stop, optional
        Ends the run when it is asked.
    patience : Patience, optional
        How long silence is borne.
    scale_date : str, optional
        When the scale factors were determined.
    clock : HostClock, optional
    progress : callable, optional
        Told how it is going, some times a second at most.

    Raises
    ------
    InputError
        A duration that is not positive.
    InstrumentError
        It does not answer, is another one after a reconnection, or did not come back. What was recorded is kept.
    StorageError
        The disk refuses, or the folder holds a run. What was acknowledged is kept.
    """
    if duration is not None and not duration > 0:
        raise InputError(f"the duration of a run must be positive, not {duration!r} s")
    clock, patience = clock or HostClock(), patience or Patience()
    try:
        identity = instrument.open()
        header = _header(instrument, identity, scale_date)
        place = folder(identity) if callable(folder) else folder
        with LogStore.create(place, header) as store:
            room = max(int(_ROOM * instrument.rate), _LEAST_ROOM)
            listener = Listener(instrument, identity, room=room, patience=patience)
            writer = _Writer(store, header, duration, clock, progress)
            writer.look()
            instrument.start()
            listener.start()
            try:
                writer.run(listener, stop or Stop())
            finally:
                listener.stop()
                listener.join()
                instrument.stop()
            if listener.failure is not None:
                raise listener.failure
            return writer.finish(identity, listener.dropped, stop or Stop())
    finally:
        instrument.close()


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


@dataclass(slots=True)
class _Writer:
    """Samples into batches, everything else into the manifest."""

    store: LogStore
    header: Header
    duration: float | None
    clock: HostClock
    progress: Callable[[Progress], None] | None
    _waiting: list[Numbered] = field(default_factory=list)
    _since: int = 0
    _looked: int = 0
    _gaps: int = 0
    _state: Progress = field(default_factory=Progress)
    _watch: ClockWatch = field(init=False)

    def __post_init__(self) -> None:
        self._watch = ClockWatch(self.clock)

    @property
    def _limit(self) -> int | None:
        return None if self.duration is None else round(self.duration * self.header.rate)

    def run(self, listener: Listener, stop: Stop) -> None:
        """Until the duration is over, somebody asks for the end, or the listener has given up."""
        over = False
        while not over and not stop.asked and not listener.ring.exhausted:
            item = listener.ring.take(_PATIENT)
            if isinstance(item, Event):
                self.store.note(item.kind, **item.facts)
                self._state = replace(self._state, remark=str(item.facts.get("reason", item.kind)))
            elif item is not None:
                over = self._collect(item)
            if self._is_due():
                self._write()
            if self.clock.now() - self._looked > _LOOK * 1e9:
                self.look()
        self._write()

    def finish(self, identity: Identity, dropped: int, stop: Stop) -> Captured:
        """Close the run."""
        status = "abort" if stop.asked else "success"
        self.store.close("abort" if stop.asked else "success", stop.reason)
        return Captured(
            folder=self.store.folder,
            identity=identity,
            samples=self._state.samples,
            missing=self._state.missing,
            gaps=self._gaps,
            dropped=dropped,
            status=status,
            reason=stop.reason,
        )

    # -- samples ----------------------------------------------------------------------------------------------

    def _collect(self, item: Numbered) -> bool:
        """Keep samples for the next batch; whether the planned duration is over."""
        limit = self._limit
        kept = item if limit is None else _before(item, limit)
        if len(kept):
            self._since = self._since if self._waiting else self.clock.now()
            self._waiting.append(kept)
        return limit is not None and int(item.counter[-1]) + 1 >= limit

    def _is_due(self) -> bool:
        if not self._waiting:
            return False
        seconds = batch_seconds(self.header.rate)
        held = sum(len(w) for w in self._waiting)
        return held >= seconds * self.header.rate or self.clock.now() - self._since >= seconds * 1e9

    def _write(self) -> None:
        if not self._waiting:
            self.store.sync()
            return
        parts, self._waiting = self._waiting, []
        gaps = [gap for part in parts for gap in part.gaps]
        for gap in gaps:
            self.store.note("gap", counter=gap.counter, samples=gap.samples, reason=gap.reason)
        values = np.concatenate([p.values for p in parts])
        counter = np.concatenate([p.counter for p in parts])
        self.store.append(
            Batch(
                counter=counter,
                monotonic_ns=np.concatenate([p.monotonic_ns for p in parts]),
                values=values,
                flags=np.concatenate([p.flags for p in parts]),
                utc_ns=self.clock.utc(),
            )
        )
        self._gaps += len(gaps)
        self._state = replace(
            self._state,
            samples=self._state.samples + len(values),
            missing=self._state.missing + sum(g.samples for g in gaps),
            share=None if self._limit is None else (int(counter[-1]) + 1) / self._limit,
            values=tuple(values[-1].tolist()),
        )
        if self.progress is not None:
            self.progress(self._state)

    # -- besides ----------------------------------------------------------------------------------------------

    def look(self) -> None:
        """At the clocks and at the disk."""
        self._looked = self.clock.now()
        for event in self._watch.look():
            self.store.note("clock", what=event.what, seconds=event.seconds)
        left = None if self.duration is None else self.duration * (1 - (self._state.share or 0.0))
        space = space_of(self.store.folder, self.header.rate, len(self.header.channels), left)
        facts: dict[str, Any] = {"free": space.free, "seconds": round(space.seconds)}
        self.store.note("pair", now_ns=self.clock.now(), utc_ns=self.clock.utc(), **facts)
        remark = self._state.remark if space.enough else "the disk will be full before the run is over"
        self._state = replace(self._state, free_seconds=space.seconds, remark=remark)


def _before(item: Numbered, limit: int) -> Numbered:
    """The samples whose number lies below the limit."""
    n = int(np.searchsorted(item.counter, limit))
    if n == len(item):
        return item
    return Numbered(
        counter=item.counter[:n],
        monotonic_ns=item.monotonic_ns[:n],
        values=item.values[:n],
        flags=item.flags[:n],
        gaps=tuple(g for g in item.gaps if n and g.counter < int(item.counter[n - 1])),
    )
