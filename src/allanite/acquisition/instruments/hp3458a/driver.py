# SPDX-License-Identifier: BSD-3-Clause
"""Driver of the 3458A: sets it up with every setting read back, and turns its stream of bytes into blocks.

The meter numbers no reading, so the counter of a block is ours: readings that follow one another are counted, and
`Pace` asks the clock where counting cannot tell. What is not certain is left out and said.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace

from allanite.acquisition.instruments import Block, Identity, InstrumentTimeout, host_ns
from allanite.acquisition.instruments.hp3458a import commands
from allanite.acquisition.instruments.hp3458a.commands import MeterSettings
from allanite.acquisition.instruments.hp3458a.conversation import QUIET, Conversation
from allanite.acquisition.instruments.hp3458a.pace import Pace
from allanite.acquisition.instruments.hp3458a.resources import device_of
from allanite.acquisition.instruments.hp3458a.stream import IntegerStream, LineStream, Stream
from allanite.acquisition.instruments.hp3458a.transports import Transport, open_transport
from allanite.errors import InputError, InstrumentError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural
from allanite.recording.records import Channel

__all__ = ["HP3458A"]

#: A query that an older meter does not know is given less than others [s].
OPTIONAL_ANSWER = 1.0
#: Characters of CALSTR? that are kept: so many it holds.
CALIBRATION_TEXT = 75
#: A block that took longer than its readings by so many seconds and three periods came after a silence; readings that
#: may have queued up in it.
LATE, LONGEST_QUEUE = 0.05, 10_000
#: A wait is cut into such slices [s], except so close to the instant at which a reading is due [s].
SLICE, NEAR = 0.25, 1.0
#: After a silence the clock is asked for so long [s], at least with one reading and at most with so many.
ASSURANCE, MOST_ASSURING = 0.1, 16
#: Seconds of readings in one block, and their largest number.
BLOCK, LARGEST_BLOCK = 0.1, 65536


@dataclass(frozen=True, slots=True, kw_only=True)
class _Heard:
    """Bytes that came, and what is known of the time.

    `at_ns`: when the last of them was there. `awaited`: the host waited for it, so that its lateness is not that of a
    queue. `broken_off`: less came than was asked for. `silent`: it is all that came since a silence.
    """

    data: bytes
    at_ns: int
    awaited: bool
    broken_off: bool
    silent: bool = False


class HP3458A:
    """One meter.

    Parameters
    ----------
    resource : str or callable
        Resource as for `open_transport`, or a function that returns a transport.
    settings : MeterSettings
        Settings of the meter.
    name : str
        Name of the channel.
    scale_factor : str, optional
        Scale factor of the sensor at the input, e.g. ``"24.0 mV/(deg/s)"``.
    speed : float or None
        Of the meter's time against ours: 1 for a real one. None for a simulator without pace: then there is no clock
        to compare with, and each rejected line counts as one reading lost.
    block : float [s]
        Span of one block in the meter's time.

    Notes
    -----
    1. The meter tells no serial number. The number of its calibrations (CALNUM?) and the text that the laboratory
       left (CALSTR?) stand for it: both stay as they are for as long as nobody calibrates it.
    2. Its temperature can only be asked while it does not measure: at the start and at each new arming. It is a fact of
       the block that follows.
    """

    def __init__(
        self,
        resource: str | Callable[[], Transport],
        settings: MeterSettings,
        *,
        name: str = "voltage",
        scale_factor: str | None = None,
        speed: float | None = 1.0,
        block: float = BLOCK,
    ) -> None:
        if speed is not None and not speed > 0:
            raise InputError(f"3458A: speed {speed!r} must be positive, or None for a simulator without pace")
        self._connect: Callable[[], Transport] = (
            (lambda: open_transport(resource)) if isinstance(resource, str) else resource
        )
        self._device = device_of(resource) if isinstance(resource, str) else ""
        self._asked = settings
        self._channel = Channel.of(
            name, "V", sampling="mean", aperture=_planned_aperture(settings), scale_factor=scale_factor
        )
        self._speed = speed
        self._block = min(max(round(settings.rate * block), 1), LARGEST_BLOCK)
        self._period = settings.period
        self._settings: dict[str, object] = {}
        self._facts: dict[str, object] = {}  # for the next block
        self._told: list[str] = []  # remarks for it
        self._scale = 0.0
        self._link: Transport | None = None
        self._talk: Conversation | None = None
        self._pace = Pace(period_ns=self._period * 1e9, speed=speed)
        self._stream: Stream | None = None
        self._armed_at = self._heard_at = 0
        self._origin = host_ns()
        self._running = False
        self._interrupted = False
        self._out_of_step = self._broken_off = False

    @property
    def channels(self) -> tuple[Channel, ...]:
        """One channel in volts, with the aperture read back."""
        return (self._channel,)

    @property
    def rate(self) -> float:
        """Readings per second [Hz], by the TIMER read back."""
        return 1 / self._period

    @property
    def settings(self) -> Mapping[str, object]:
        """Every setting by name, read back; the lines sent; aperture, period and the factor sqrt(Ts/Ta)."""
        return self._settings

    @property
    def device(self) -> str:
        """The meter or the adapter before it."""
        return self._device

    # ---- opening -------------------------------------------------------------------------------------------------

    def open(self) -> Identity:
        """Clear, set, read everything back.

        Raises
        ------
        InstrumentError
            No link, another model, an error of the meter, or a setting that reads back otherwise.
        """
        self.close()
        self._link = self._connect()
        self._talk = Conversation(self._link, commands.trigger_lines(self._asked))
        try:
            return self._set_up(self._talk)
        except BaseException:
            self.close()
            raise

    def _set_up(self, talk: Conversation) -> Identity:
        if not talk.bring_to_rest():
            raise InstrumentError(
                "3458A: it keeps sending after a device clear; is another program reading it? Switch it off and on"
            )
        base, *rest = commands.base_lines(self._asked)
        sent = [*commands.CLEAR, base, *rest]
        talk.send(commands.CLEAR[1])
        talk.send(base)
        talk.agree()
        identity = self._identify(talk)
        talk.ask("ERR?")  # errors of whoever used it before are not ours
        for line in rest:
            talk.send(line)
        self._refuse_errors(talk)
        self._read_back(talk)
        self._settings["sent"] = sent
        return identity

    def _identify(self, talk: Conversation) -> Identity:
        model = talk.ask("ID?").strip()
        if model != "HP3458A":
            raise InstrumentError(
                f"this is not a 3458A: ID? answers {model!r} instead of 'HP3458A'; check the address"
            )
        firmware = talk.ask("REV?").strip()
        serial = f"CALNUM {talk.ask('CALNUM?').strip()}"
        try:
            text = talk.ask("CALSTR?", OPTIONAL_ANSWER).strip().strip('"')[:CALIBRATION_TEXT]
        except InstrumentTimeout:
            text = ""
        serial = f"{serial} {text}".strip()
        return Identity(maker="Agilent/HP", model="3458A", serial=serial, firmware=firmware)

    def _refuse_errors(self, talk: Conversation) -> None:
        errors = talk.ask("ERRSTR?").strip()
        if not errors.startswith("0"):
            raise InstrumentError(
                f"3458A: it reports {errors!r} after its settings were sent; the meter does not accept "
                "one of the settings"
            )
        self._settings = {"errors": errors}

    def _read_back(self, talk: Conversation) -> None:
        problems = []
        for readback in commands.read_backs(self._asked):
            got = commands.numbers_of(readback.query, talk.ask(readback.query).encode())
            problem = commands.refusals(readback, got)
            if problem and not readback.is_setting:  # the readings do not depend on it
                self._told.append(f"{problem}; left out")
                continue
            answers = self._settings if readback.is_setting else self._facts
            answers[readback.name] = got[0] if len(got) == 1 else got
            if problem:
                problems.append(problem)
        if problems:
            raise InstrumentError("3458A: settings did not take: " + "; ".join(problems))
        aperture, period = self._number("aperture"), self._number("timer")
        self._scale, self._period = self._number("scale"), period
        self._settings |= {
            "period": period,
            "aliasing_factor": commands.aliasing_factor(aperture, period),
        }
        self._channel = replace(self._channel, sampling="mean", aperture=aperture)
        self._pace.set_period(period * 1e9)

    def _number(self, name: str) -> float:
        value = self._settings[name]
        assert isinstance(value, float)  # noqa: S101
        return value

    # ---- measuring -----------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Arm. A second start in the life of this object continues the counter, with RESYNC on its first sample.

        Raises
        ------
        InstrumentError
            A meter that was started before has other settings now: open it again.
        """
        first = self._stream is None
        self._interrupted = False
        self._stream = self._new_stream()
        if not first:
            self._recover()
        else:
            self._arm()

    def read(self, timeout: float) -> Block:
        """What has come; see `Instrument.read`."""
        stream = self._stream
        if self._link is None or stream is None or not self._running:
            raise InputError("3458A: read before start; call open and start first")
        remarks: list[str] = []
        if self._out_of_step:
            self._recover()
            remarks.append("settings queried and armed again; the readings meanwhile are missing")
        elif stream.left <= 0:
            self._rearm(f"its counter of {self._asked.readings_per_arm} readings was full", remarks)
        heard = self._gather(stream, timeout)
        if not heard.data and self._count_is_over():
            self._rearm("it ended its count before all readings arrived", remarks)
            heard = self._gather(stream, timeout)
        self._broken_off = heard.broken_off
        if not heard.data:
            # At a high rate the clock cannot tell what was lost meanwhile: arm anew.
            self._out_of_step = self._speed is not None and not self._pace.judges
            raise InstrumentTimeout(f"3458A: no reading within {timeout:g} s")
        self._heard_at = heard.at_ns
        decoded = stream.feed(
            heard.data,
            round(heard.at_ns * (self._speed or 1.0)),
            awaited=heard.awaited,
            silent=heard.silent,
        )
        # Brought to rest by the next read, so that nothing can go wrong before these samples are given.
        self._out_of_step = not decoded.in_step
        facts, self._facts = self._facts, {}
        remarks, self._told = [*self._told, *remarks], []
        return Block(
            values=decoded.values[:, None],
            flags=decoded.flags,
            counter=decoded.counter,
            received_ns=self._received(heard.at_ns),
            remarks=(*remarks, *decoded.remarks),
            facts=facts,
            gap_uncertainty=decoded.uncertainty,
        )

    def _received(self, at_ns: int) -> int:
        """That time in the meter's scale; for a meter without pace by the number of its readings."""
        if self._speed is None:
            return self._origin + round(self._pace.count * self._period * 1e9)
        return round(at_ns * self._speed)

    def interrupt(self) -> None:
        """A `read` that waits ends soon."""
        self._interrupted = True

    def stop(self) -> None:
        """Device clear, hold, drain, and back to the state of the front panel; a lost link is no error here."""
        self._running = False
        if self._talk is None:
            return
        try:
            self._talk.bring_to_rest()
            self._talk.send(commands.STOP)
        except InstrumentError:
            # A link that is gone has nothing to stop.
            return

    def close(self) -> None:
        """Give the link back."""
        self._running = False
        if self._link is not None:
            self._link.close()
            self._link = self._talk = None

    def _new_stream(self) -> Stream:
        if self._asked.format == "ASCII":
            return LineStream(pace=self._pace, range_volts=self._asked.range_volts)
        return IntegerStream(pace=self._pace, scale=self._scale, range_volts=self._asked.range_volts)

    @property
    def _step(self) -> float:
        """Time between readings on our clock [s]."""
        return self._period / (self._speed or 1.0)

    def _gather(self, stream: Stream, timeout: float) -> _Heard:
        """Bytes of at most one block: its first reading, and the others if they follow at their pace.

        So that what came before a silence is not taken for what came after it.
        """
        count = min(self._block, max(stream.left, 1))
        wanted = count * stream.width - stream.begun % stream.width
        if not self._pace.judges:
            return self._heard(wanted, timeout + (count - 1) * self._step, stream)
        first = self._heard(wanted - (count - 1) * stream.width, timeout, stream)
        late = (first.at_ns - self._heard_at) * 1e-9 > 4 * self._step + LATE
        if first.broken_off:
            return first
        if late or self._broken_off:
            return self._all_of(stream, first)
        if count == 1:
            return first
        allowed = (count + 2) * self._step + LATE
        try:
            rest = self._heard((count - 1) * stream.width, allowed, stream)
        except InstrumentError:  # what has come is given; the next read says that the link is gone
            return replace(first, broken_off=True)
        both = replace(rest, data=first.data + rest.data)
        stood_still = not rest.broken_off and (rest.at_ns - first.at_ns) * 1e-9 > allowed  # the host itself
        return self._all_of(stream, both) if stood_still else both

    def _heard(self, wanted: int, timeout: float, stream: Stream) -> _Heard:
        asked = time.monotonic()
        data = self._waited_for(wanted, timeout, stream)
        waited, whole = time.monotonic() - asked, len(data) == wanted
        # What came before a read ran out of time says nothing of the clock.
        return _Heard(
            data=data, at_ns=host_ns(), awaited=whole and waited > 0.3 * self._step, broken_off=not whole
        )

    def _heard_more(self, wanted: int, timeout: float, stream: Stream) -> _Heard:
        """As `_heard`. Where the link is gone nothing more comes: what has come is given, and the next read says so."""
        try:
            return self._heard(wanted, timeout, stream)
        except InstrumentError:
            return _Heard(data=b"", at_ns=host_ns(), awaited=False, broken_off=True)

    def _waited_for(self, wanted: int, timeout: float, stream: Stream) -> bytes:
        """So many bytes, fewer where time is up, the link is gone or somebody interrupts."""
        deadline, data = time.monotonic() + timeout, b""
        while True:
            left = max(deadline - time.monotonic(), 0.0)
            wait = min(left, self._longest_wait())
            try:
                data += self._wire().read_bytes(wanted - len(data), wait, message=stream.message)
            except InstrumentError:
                if not data:
                    raise
                return data  # what has come is given; the next read says that the link is gone
            if len(data) >= wanted or wait >= left or self._interrupted:
                return data

    def _longest_wait(self) -> float:
        """So long until somebody is heard who interrupts [s]; never across the instant at which a reading is due.

        A bus that runs out of time amid a reading may lose the bytes that it has.
        """
        late = (host_ns() - self._heard_at) * 1e-9 - self._step
        return min(-late - NEAR, SLICE) if late < -NEAR - QUIET else max(NEAR - late, SLICE)

    def _all_of(self, stream: Stream, heard: _Heard) -> _Heard:
        """After a silence: everything that was on its way, up to readings that had to be waited for.

        A host only ever delays, so the least late of some of them says when the last one was there.
        """
        data, last = heard.data, heard
        arrivals: list[
            tuple[int, int]
        ] = []  # when each was there that was waited for, and how many had come by then
        for _ in range(LONGEST_QUEUE):
            begun = (stream.begun + len(data)) % stream.width
            more = self._heard_more(stream.width - begun, 2 * self._step, stream)
            data += more.data
            if more.broken_off:
                # When the last one came nobody knows unless it was waited for: the next one will tell.
                return self._least_late(
                    replace(last, data=data, broken_off=not last.awaited), stream, arrivals
                )
            last = more
            if not more.awaited:
                continue
            count = len(data)
            more = self._heard_more(stream.width, 0.0, stream)  # a busy host is slow with a queue too
            data += more.data
            if more.broken_off:
                arrivals.append((last.at_ns, count // stream.width))
                if len(arrivals) >= min(max(ASSURANCE / self._step, 1), MOST_ASSURING):
                    break
                continue
            last = more
        return self._least_late(replace(last, data=data), stream, arrivals)

    def _least_late(self, heard: _Heard, stream: Stream, arrivals: list[tuple[int, int]]) -> _Heard:
        """All that came since a silence, timed by the least late of the readings seen."""
        if not heard.awaited or not arrivals:
            return replace(heard, silent=True)
        count, step = arrivals[-1][1], self._step * 1e9
        return replace(heard, at_ns=min(at + round((count - n) * step) for at, n in arrivals), silent=True)

    # ---- arming --------------------------------------------------------------------------------------------------

    def _arm(self) -> None:
        assert self._stream is not None  # noqa: S101
        self._stream.armed(self._asked.readings_per_arm)
        self._linked().send(commands.ARM)
        self._armed_at = self._clock()
        self._heard_at = host_ns()
        self._broken_off = False
        self._running = True

    def _rearm(self, why: str, remarks: list[str]) -> None:
        """New zero, all settings and the temperature asked back, new count. The meter is idle here."""
        talk = self._linked()
        left_over, _ = talk.drain(min(max(3 * self._period, QUIET / 5), 1.0))
        if left_over:
            remarks.append(plural(len(left_over), "byte", "were left aside, beyond the count"))
        if not self._asked.autozero:
            talk.send(commands.REZERO)
        talk.agree()
        self._read_back(talk)
        self._resume()
        remarks.append(f"armed again, because {why}; the readings meanwhile are missing")

    def _recover(self) -> None:
        """Bring a meter of unknown state to rest, see that its settings are ours, arm."""
        talk = self._linked()
        talk.bring_to_rest()
        talk.agree()
        self._read_back(talk)
        self._resume()

    def _resume(self) -> None:
        assert self._stream is not None  # noqa: S101
        self._stream.interrupted()
        self._out_of_step = False
        self._arm()

    def _count_is_over(self) -> bool:
        """True when the meter must have given all readings of its count, whatever we saw of them."""
        if self._speed is None:
            return False
        return self._clock() - self._armed_at > self._pace.longest(self._asked.readings_per_arm + 1)

    # ---- wire ----------------------------------------------------------------------------------------------------

    def _clock(self) -> int:
        """Time of the host in the meter's scale [ns]; it goes on while the host sleeps."""
        return round(host_ns() * (self._speed or 1.0))

    def _wire(self) -> Transport:
        if self._link is None:
            raise InstrumentError("3458A: not connected; call open first")
        return self._link

    def _linked(self) -> Conversation:
        if self._talk is None:
            raise InstrumentError("3458A: not connected; call open first")
        return self._talk


def _planned_aperture(settings: MeterSettings) -> float | None:
    """Aperture before the meter is asked; in periods of a mains that nobody has measured yet there is none."""
    command, number = settings.integration
    return number if command == "APER" else None
