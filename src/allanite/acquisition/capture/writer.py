# SPDX-License-Identifier: BSD-3-Clause
"""The thread that writes: samples into batches, everything else into the manifest."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import Any

from allanite.acquisition.capture.clock import HostClock
from allanite.acquisition.capture.gathering import Gathering
from allanite.acquisition.capture.listener import CaptureNote, Listener
from allanite.acquisition.capture.numbering import Gap, Numbered
from allanite.acquisition.capture.plan import CapturePlan
from allanite.acquisition.capture.stopping import Stop
from allanite.acquisition.capture.surroundings import Surroundings
from allanite.acquisition.instruments import Flag, Identity
from allanite.errors import InstrumentError
from allanite.files.store import Batch, Header, LogStore, Status
from allanite.lazy_dataclasses import dataclass

__all__ = ["Captured", "Progress", "Writer"]

#: Between looks at the disk, and at the clocks [s]. Two steps of the wall clock may undo each other in between.
_LOOK, _CLOCK_LOOK = 60.0, 1.0
_PATIENT = 0.25  # wait for samples [s]
#: An instrument that may just come back is waited for so long past the planned end [s].
_GRACE = 2.0
#: Remarks of the instrument written down from one look to the next; the others are counted.
_REMARKS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How a run is going.

    Attributes
    ----------
    samples, missing : int
        Written, and known to be missing.
    overloads : int
        Of the written ones, those without a value: overload or missing in one channel at least.
    share : float or None
        Of the planned duration.
    values : tuple of float
        Last sample, in the channels' own units.
    remark : str
        The last thing that happened besides samples; "" in the normal course.
    """

    samples: int = 0
    missing: int = 0
    overloads: int = 0
    share: float | None = None
    values: tuple[float, ...] = ()
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
    overloads : int
        Of the stored ones, those without a value: overload or missing in one channel at least.
    dropped : int
        Of the missing ones, those for which the host was too slow.
    doubtful, resyncs : int
        Of the stored ones, those marked as doubtful, and the first ones after an interruption.
    rate, rate_measured : float, float or None [Hz]
        Stated, and by the clock of the host where that contradicts it by more than a percent.
    remarks, remarks_noted : int
        Of the instrument: what went wrong on the wire, and how many of them have a line in the manifest.
    status, reason : str
        "success", or "abort" and who asked for it. With "success", why nothing came when the duration was over.
    """

    folder: Path
    identity: Identity
    samples: int
    missing: int
    gaps: int
    overloads: int
    dropped: int
    doubtful: int
    resyncs: int
    rate: float
    rate_measured: float | None
    remarks: int
    remarks_noted: int
    status: str
    reason: str

    @property
    def is_whole(self) -> bool:
        """Whether there are samples, all with a value and beyond doubt, at the stated rate."""
        flaws = self.missing or self.overloads or self.doubtful or self.rate_measured
        return bool(self.samples) and not flaws


@dataclass(slots=True)
class Writer:
    """Takes what a `Listener` gives, until the duration is over or it has ended.

    Parameters
    ----------
    store : LogStore
    duration : float or None [s]
    clock : HostClock
    progress : callable or None
        Told how it is going.
    happened : callable or None
        Told what happens besides samples; see `allanite.acquisition.capture.capture`.
    """

    store: LogStore
    duration: float | None
    clock: HostClock
    progress: Callable[[Progress], None] | None
    happened: Callable[[str, Mapping[str, Any]], None] | None = None
    _gathering: Gathering = field(default_factory=Gathering)
    _state: Progress = field(default_factory=Progress)
    _next: int = 0  # number of the next sample
    _gaps: int = 0
    _dropped: int = 0
    _looked: int = 0
    _looked_at_clocks: int = 0
    _heard: int = 0  # when the last sample came [ns]
    _trouble: str = ""  # why none has come since
    _gone: str = ""  # at the end of the duration
    _doubtful: int = 0
    _resyncs: int = 0
    _rate_measured: float | None = None
    _remarks: int = 0
    _remarks_noted: int = 0
    _remarks_since: int = 0  # the last look
    _plan: CapturePlan = field(init=False)
    _surroundings: Surroundings = field(init=False)

    def __post_init__(self) -> None:
        self._surroundings = Surroundings(self.store, self.clock, self._tell)
        self._plan = CapturePlan(self.duration, self.store.header.rate)
        self._note_plan()

    def run(self, listener: Listener, stop: Stop) -> bool:
        """Until the duration is over (True), or the listener has ended, by itself or because somebody asked for it.

        Raises
        ------
        InstrumentError
            The duration is over, and no sample has come.
        """
        over = False
        self._heard = self.clock.now()
        while not over and not listener.ring.exhausted:
            if stop.asked:
                listener.stop()  # what it has given is still written
            over = self._take(listener.ring.take(_PATIENT))
            now = self.clock.now()
            if self._gathering.is_due(self.store.header.rate, now):
                self._write()
            if now - self._looked > _LOOK * 1e9:
                self.look()
            elif now - self._looked_at_clocks > _CLOCK_LOOK * 1e9:
                self._look_at_clocks()
            if not over and self._is_over_in_silence(now):
                self._gone, over = self._trouble, True
        self._write()
        if self._gone:
            self._end_with_nothing()
        self._look_at_clocks()
        self._note_more_remarks()
        return over

    def finish(self, identity: Identity, stop: Stop) -> Captured:
        """Close the run."""
        status: Status = "abort" if stop.asked else "success"
        reason = stop.reason or self._gone
        self.store.close(status, reason)
        return Captured(
            folder=self.store.folder,
            identity=identity,
            samples=self._state.samples,
            missing=self._state.missing,
            gaps=self._gaps,
            overloads=self._state.overloads,
            dropped=self._dropped,
            doubtful=self._doubtful,
            resyncs=self._resyncs,
            rate=self.store.header.rate,
            rate_measured=self._rate_measured,
            remarks=self._remarks,
            remarks_noted=self._remarks_noted,
            status=status,
            reason=reason,
        )

    def look(self) -> None:
        """At the clocks and at the disk."""
        self._looked = self._looked_at_clocks = self.clock.now()
        self._note_more_remarks()
        space = self._surroundings.look(self._plan.left(self._next))
        if not space.enough:
            self._tell("disk", {"text": space.warning})

    # -- inside -----------------------------------------------------------------------------------------------

    def _look_at_clocks(self) -> None:
        self._looked_at_clocks = self.clock.now()
        self._surroundings.look_at_clocks()

    def _is_over_in_silence(self, now: int) -> bool:
        """Whether the instrument is silent or gone, and the time that was left at its last sample is well over."""
        left = self._plan.left(self._next)
        return bool(self._trouble) and left is not None and now - self._heard >= (left + _GRACE) * 1e9

    def _end_with_nothing(self) -> None:
        """All up to the planned end is missing.

        Raises
        ------
        InstrumentError
            There is no sample at all.
        """
        limit = self._plan.limit
        if limit is not None and limit > self._next:
            self._note_gaps([Gap(counter=self._next, samples=limit - self._next, reason=self._gone)])
        if not self._state.samples:
            raise InstrumentError(f"no sample came in the planned duration: {self._gone}")

    def _take(self, item: Numbered | CaptureNote | Gap | Header | None) -> bool:
        """One thing that the listener gave; whether the planned duration is over."""
        if isinstance(item, CaptureNote):
            self._note(item)
        elif isinstance(item, Gap):
            self._end_with(item)
        elif isinstance(item, Header):
            self._change(item)
        elif item is not None:
            self._heard, self._trouble = self.clock.now(), ""
            self._gathering.add(self._plan.cut(item), self._heard)
            self._next = int(item.counter[-1]) + 1
            return self._plan.is_over(item)
        elif not self._gathering:
            self.store.sync()
        return False

    def _write(self) -> None:
        if not self._gathering:
            self.store.sync()
            return
        gaps, batch = self._gathering.take(self.clock.utc())
        self._note_gaps(gaps)
        if batch is not None:
            self.store.append(batch)
            self._count(batch)
        if self.progress is not None:
            self.progress(self._state)

    def _count(self, batch: Batch) -> None:
        self._doubtful += batch.count(Flag.DOUBTFUL)
        self._resyncs += batch.count(Flag.RESYNC)
        self._state = replace(
            self._state,
            samples=self._state.samples + len(batch),
            overloads=self._state.overloads + batch.count(Flag.NO_VALUE),
            share=self._plan.share(batch.last + 1),
            values=tuple(batch.values[-1].tolist()),
        )

    def _note_gaps(self, gaps: Sequence[Gap]) -> None:
        """In one stroke: each line waits for the disk."""
        if not gaps:
            return
        self._surroundings.look_at_clocks()
        explained = [self._surroundings.explained(gap) for gap in gaps]
        lines = [_line(gap) for gap in explained]
        self.store.note_each("gap", lines)
        for line in lines:
            self._tell("gap", line)
        self._gaps += len(explained)
        self._dropped += sum(gap.dropped for gap in explained)
        self._state = replace(self._state, missing=self._state.missing + sum(g.samples for g in explained))

    def _end_with(self, gap: Gap) -> None:
        """What is missing where no sample comes after it."""
        self._write()
        cut = self._plan.cut_gap(gap)
        if cut is not None:
            self._note_gaps([cut])

    def _note(self, note: CaptureNote) -> None:
        facts = note.facts
        if note.kind in ("silence", "lost"):
            self._trouble = str(facts["reason"])
        if note.kind == "rate":
            self._rate_measured = float(facts["measured"])
        is_remark = note.kind == "remark"
        if is_remark:
            self._remarks += 1
            self._remarks_since += 1
        if not is_remark or self._remarks_since <= _REMARKS:
            self.store.note(note.kind, **facts)
            self._remarks_noted += is_remark
        self._tell(note.kind, facts)

    def _note_more_remarks(self) -> None:
        """How many there were that were not written down."""
        more = self._remarks_since - _REMARKS
        if more > 0:
            self.store.note("remark", text=f"and {more} more remarks were not recorded", more=more)
        self._remarks_since = 0

    def _change(self, header: Header) -> None:
        """Other settings: another part of the run."""
        self._write()
        differences = self.store.header.differences(header)
        self.store.change(header)
        if header.rate != self._plan.rate:
            self._plan.change(header.rate, self._next)
            self._note_plan()
        self._tell("change", {"text": "settings have changed: " + "; ".join(differences)})

    def _note_plan(self) -> None:
        """For those who watch."""
        if self.duration is not None:
            self.store.note("plan", seconds=self.duration, samples=self._plan.limit)

    def _tell(self, kind: str, facts: Mapping[str, Any]) -> None:
        self._state = replace(self._state, remark=str(facts.get("reason", facts.get("text", kind))))
        if self.happened is not None:
            self.happened(kind, facts)


def _line(gap: Gap) -> dict[str, Any]:
    """Of the manifest. The uncertainty, in samples, where a clock has told how many are missing."""
    line: dict[str, Any] = {"counter": gap.counter, "samples": gap.samples, "reason": gap.reason}
    if gap.uncertainty is not None:
        line["uncertainty"] = round(gap.uncertainty, 3)
    return line
