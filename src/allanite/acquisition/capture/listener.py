# SPDX-License-Identifier: BSD-3-Clause
"""The thread that listens: asks again where the instrument is silent, connects again where the link is gone.

What comes is numbered here, so that all that is lost later (no room in the ring) shows as a gap too. The instrument
that answers after a reconnection must be the one of before: another serial number is another recording.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import Any

from allanite.acquisition.capture.numbering import BlockNumbering, Gap, Numbered
from allanite.acquisition.capture.ring import Ring
from allanite.acquisition.instruments import Block, Identity, Instrument, InstrumentTimeout, host_ns
from allanite.errors import InstrumentError
from allanite.files.store import Header
from allanite.lazy_dataclasses import dataclass

__all__ = ["CaptureNote", "Listener", "Patience"]

#: Nothing for so many intervals of a sample is no silence yet.
_PERIODS = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """How long silence is borne.

    Attributes
    ----------
    timeout : float [s]
        Silence after which the instrument counts as silent once; two intervals of a sample at least.
    silences : int
        In a row, after which the link is made anew.
    reconnections : int
        Attempts without a sample in between, after which the run ends.
    full : float [s]
        How long a full ring is waited for before samples are dropped.
    pause : float [s]
        Before the first of them; doubled from one to the next, up to `longest_pause`.
    """

    timeout: float = 2.0
    silences: int = 3
    reconnections: int = 60
    full: float = 1.0
    pause: float = 1.0
    longest_pause: float = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureNote:
    """Something that happened besides samples; a line of the manifest."""

    kind: str
    facts: Mapping[str, Any] = field(default_factory=dict)


class Listener(threading.Thread):
    """Reads an instrument that was opened and started until it is told to stop.

    Parameters
    ----------
    header : Header, optional
        Of the samples to come. With it, settings that change in mid-run are noticed.
    describe : callable, optional
        The header of the moment, for the identity that answers.

    Attributes
    ----------
    ring : Ring of Numbered, CaptureNote, Header or Gap
        A header stands before the samples that are the first to have these settings; a gap, at the end.
    failure : Exception or None
        Why it ended by itself.
    """

    def __init__(
        self,
        instrument: Instrument,
        identity: Identity,
        *,
        room: int,
        patience: Patience,
        header: Header | None = None,
        describe: Callable[[Identity], Header] | None = None,
    ) -> None:
        super().__init__(name="allanite-listener", daemon=True)
        self.ring: Ring[Numbered | CaptureNote | Header | Gap] = Ring(room)
        self.failure: Exception | None = None
        self._instrument, self._identity = instrument, identity
        self._patience, self._header, self._describe = patience, header, describe
        self._numbering = BlockNumbering(instrument.rate)
        self._lost: list[Gap] = []  # of blocks for which there was no room
        self._attempts = 0  # to make the link anew, since the last sample
        self._rate_told: float | None = None  # stated rate whose contradiction was told
        self._ended = threading.Event()

    def stop(self) -> None:
        """End after what is being read; a wait for the next sample ends at once."""
        self._ended.set()
        self._instrument.interrupt()

    def abandon(self) -> None:
        """End, and take nothing more: nobody writes it."""
        self.stop()
        self.ring.close()

    def run(self) -> None:
        """Listen."""
        try:
            self._listen()
        except Exception as error:  # noqa: BLE001 - whatever it is, the run must not seem to be whole
            self.failure = error
        finally:
            self._tell_tail()
            self.ring.close()

    def _listen(self) -> None:
        silent = 0
        while not self._ended.is_set():
            try:
                block = self._instrument.read(max(self._patience.timeout, _PERIODS / self._numbering.rate))
            except InstrumentTimeout as error:
                if self._ended.is_set():
                    return  # it was not waited for to the end: that is no silence
                silent += 1
                self._numbering.interrupt(str(error))
                self._tell("silence", number=silent, reason=str(error))
                if silent >= self._patience.silences:
                    self._reconnect(error)
                    silent = 0
            except InstrumentError as error:
                self._numbering.interrupt(str(error))
                self._reconnect(error)
                silent = 0
            else:
                silent = 0
                self._pass_on(block, block.received_ns)

    # -- samples ----------------------------------------------------------------------------------------------

    def _pass_on(self, block: Block, now: int) -> None:
        for remark in block.remarks:
            self._tell("remark", text=remark)
        if block.facts:
            self._tell("facts", **block.facts)
        if block.facts or block.remarks:  # nothing is set anew without a word
            self._look_at_settings()
        taken = self._numbering.take(block, now)
        if not len(taken):
            return
        self._attempts = 0
        self._tell_rate()
        if self._lost:
            taken = _after(self._lost, taken)
        if self.ring.put(taken, len(taken), self._patience.full):
            self._lost = []
        else:
            first = min([int(taken.counter[0]), *(gap.counter for gap in taken.gaps)])
            self._lost = [
                Gap(
                    counter=first,
                    samples=int(taken.counter[-1]) + 1 - first,
                    reason="the host was too slow: the buffer was full",
                    dropped=len(taken) + sum(gap.dropped for gap in taken.gaps),
                )
            ]

    def _look_at_settings(self) -> None:
        """Samples with other settings are never added to those of before: they are another part of the run."""
        if self._describe is None:
            return
        header = self._describe(self._identity)
        if header != self._header:
            self._header = header
            self._numbering.change(header.rate)
            self.ring.put(header, 0)

    def _tell_rate(self) -> None:
        """That samples come at another rate than the stated one: once, before a week of them is recorded."""
        measured, stated = self._numbering.contradicted, self._numbering.rate
        if measured is not None and stated != self._rate_told:
            self._rate_told = stated
            self._tell(
                "rate",
                stated=stated,
                measured=float(f"{measured:.4g}"),
                text=f"samples arrive at {measured:.4g} Hz by the host's clock, not at the stated {stated:.6g} Hz, "
                "which averaging times and coefficients use: stop, and correct the rate",
            )

    def _tell(self, kind: str, **facts: Any) -> None:
        self.ring.put(CaptureNote(kind=kind, facts=facts), 0)

    def _tell_tail(self) -> None:
        """What is missing at the end, where no sample comes after it."""
        tail = self._numbering.tail(host_ns())
        for gap in (*self._lost, *([tail] if tail else [])):
            self.ring.put(gap, 0)

    # -- the link ---------------------------------------------------------------------------------------------

    def _reconnect(self, cause: InstrumentError) -> None:
        """Close, open and start until the same instrument answers. One that opens and brings no sample is not back.

        Raises
        ------
        InstrumentError
            Another instrument answers, twice in a row, or none in all attempts.
        """
        self._tell("lost", reason=str(cause))
        last, stranger = cause, None
        while self._attempts < self._patience.reconnections:
            pause = min(self._patience.pause * 2.0 ** min(self._attempts, 60), self._patience.longest_pause)
            self._attempts += 1
            self._instrument.close()
            if self._ended.wait(pause):
                return
            try:
                identity = self._instrument.open()
                if _same(identity, self._identity):
                    self._instrument.start()
            except InstrumentError as error:
                last = error
                continue
            if _same(identity, self._identity):
                self._go_on(identity)
                return
            last = self._another(identity)
            if identity == stranger:  # once may be an answer that was damaged on the way
                raise last
            stranger = identity
        raise InstrumentError(
            f"the instrument did not come back in {self._patience.reconnections} attempts: {last}"
        ) from last

    def _go_on(self, identity: Identity) -> None:
        self._identity = identity
        self._tell("reconnected", attempt=self._attempts, identity=identity.to_json())
        self._look_at_settings()

    def _another(self, identity: Identity) -> InstrumentError:
        return InstrumentError(
            f"another instrument answers: {_named(identity)} in place of {_named(self._identity)}. "
            "Start another recording for it"
        )


def _same(one: Identity, other: Identity) -> bool:
    """Its firmware may have changed: that is a change of settings."""
    return (one.maker, one.model, one.serial) == (other.maker, other.model, other.serial)


def _named(identity: Identity) -> str:
    return " ".join(part for part in (identity.maker, identity.model, identity.serial) if part)


def _after(lost: list[Gap], taken: Numbered) -> Numbered:
    """Samples that come after others were lost: one gap before them."""
    first = lost[0]
    gap = replace(first, samples=int(taken.counter[0]) - first.counter)
    return Numbered(
        counter=taken.counter,
        monotonic_ns=taken.monotonic_ns,
        values=taken.values,
        flags=taken.flags,
        gaps=(gap, *(g for g in taken.gaps if g.counter > int(taken.counter[0]))),
    )
