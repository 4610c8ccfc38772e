# SPDX-License-Identifier: BSD-3-Clause
"""The thread that listens: asks again where the instrument is silent, connects again where the link is gone.

What comes is numbered here, so that all that is lost later (no room in the ring) shows as a gap too. The instrument
that answers after a reconnection must be the one of before: another serial number is another recording.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from allanite.capture.numbering import Gap, Numbered, Numbering
from allanite.capture.ring import Ring
from allanite.errors import InstrumentError
from allanite.instruments import Block, Identity, Instrument, InstrumentTimeout

__all__ = ["Event", "Listener", "Patience"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """How long silence is borne.

    Attributes
    ----------
    timeout : float [s]
        Silence after which the instrument counts as silent once.
    silences : int
        In a row, after which the link is made anew.
    reconnections : int
        Attempts in a row, after which the run ends.
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
class Event:
    """Something that happened besides samples; a line of the manifest."""

    kind: str
    facts: Mapping[str, Any] = field(default_factory=dict)


class Listener(threading.Thread):
    """Reads an instrument that was opened and started until it is told to stop.

    Attributes
    ----------
    ring : Ring of Numbered or Event
    failure : InstrumentError or None
        Why it ended by itself.
    dropped : int
        Samples for which there was no room.
    """

    def __init__(
        self,
        instrument: Instrument,
        identity: Identity,
        *,
        room: int,
        patience: Patience,
    ) -> None:
        super().__init__(name="allanite-listener", daemon=True)
        self.ring: Ring[Numbered | Event] = Ring(room)
        self.failure: InstrumentError | None = None
        self.dropped = 0
        self._instrument, self._identity = instrument, identity
        self._patience = patience
        self._numbering = Numbering(instrument.rate)
        self._lost: list[Gap] = []  # of blocks for which there was no room
        self._ended = threading.Event()

    def stop(self) -> None:
        """End after what is being read."""
        self._ended.set()

    def run(self) -> None:
        """Listen."""
        silent = 0
        try:
            while not self._ended.is_set():
                try:
                    block = self._instrument.read(self._patience.timeout)
                except InstrumentTimeout as error:
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
        except InstrumentError as error:
            self.failure = error
        finally:
            self.ring.close()

    # -- samples ----------------------------------------------------------------------------------------------

    def _pass_on(self, block: Block, now: int) -> None:
        for remark in block.remarks:
            self._tell("remark", text=remark)
        if block.facts:
            self._tell("facts", **block.facts)
        taken = self._numbering.take(block, now)
        if not len(taken):
            return
        if self._lost:
            taken = _after(self._lost, taken)
        if self.ring.put(taken, len(taken), self._patience.full):
            self._lost = []
        else:
            self.dropped += len(taken)
            first = taken.gaps[0].counter if taken.gaps else int(taken.counter[0])
            reason = "the host was too slow: no room for these samples"
            self._lost = [Gap(counter=first, samples=int(taken.counter[-1]) + 1 - first, reason=reason)]

    def _tell(self, kind: str, **facts: Any) -> None:
        self.ring.put(Event(kind=kind, facts=facts), 0)

    # -- the link ---------------------------------------------------------------------------------------------

    def _reconnect(self, cause: InstrumentError) -> None:
        """Close, open and start until the same instrument answers.

        Raises
        ------
        InstrumentError
            Another instrument answers, or none in all attempts.
        """
        self._tell("lost", reason=str(cause))
        last, pause = cause, self._patience.pause
        for attempt in range(1, self._patience.reconnections + 1):
            self._instrument.close()
            if self._ended.wait(pause):
                return
            pause = min(2 * pause, self._patience.longest_pause)
            try:
                found = self._instrument.open()
                self._refuse_another(found)
                self._instrument.start()
            except _AnotherInstrument:
                raise
            except InstrumentError as error:
                last = error
                continue
            self._tell("reconnected", attempt=attempt, identity=found.to_json())
            return
        raise InstrumentError(
            f"the instrument did not come back in {self._patience.reconnections} attempts: {last}"
        ) from last

    def _refuse_another(self, found: Identity) -> None:
        if (found.maker, found.model, found.serial) != (
            self._identity.maker,
            self._identity.model,
            self._identity.serial,
        ):
            raise _AnotherInstrument(
                f"another instrument answers: {_named(found)} in place of {_named(self._identity)}. "
                "Start another recording for it"
            )


class _AnotherInstrument(InstrumentError):
    """Not the one of before: trying again is of no use."""


def _named(identity: Identity) -> str:
    return " ".join(part for part in (identity.maker, identity.model, identity.serial) if part)


def _after(lost: list[Gap], taken: Numbered) -> Numbered:
    """Samples that come after others were lost: one gap before them."""
    first = lost[0]
    gap = Gap(counter=first.counter, samples=int(taken.counter[0]) - first.counter, reason=first.reason)
    return Numbered(
        counter=taken.counter,
        monotonic_ns=taken.monotonic_ns,
        values=taken.values,
        flags=taken.flags,
        gaps=(gap, *(g for g in taken.gaps if g.counter > int(taken.counter[0]))),
    )
