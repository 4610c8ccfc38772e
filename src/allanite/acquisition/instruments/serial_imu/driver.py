# SPDX-License-Identifier: BSD-3-Clause
"""A described device on a serial port as an instrument.

The driver joins three things: the port, the framer, and the clock of the host. The clock tells what a counter cannot:
how often it turned while nothing came, and how long a device was away that began to count anew.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from allanite.acquisition.instruments import Block, Flag, Identity, InstrumentTimeout, host_ns
from allanite.acquisition.instruments.port_names import network_device, refusal_of_port
from allanite.acquisition.instruments.serial_imu.description import Description, read_description
from allanite.acquisition.instruments.serial_imu.framing import Framer, Samples
from allanite.acquisition.instruments.serial_imu.layout import PortSettings
from allanite.acquisition.instruments.serial_imu.port import SerialPort
from allanite.acquisition.instruments.serial_imu.tally import Tally
from allanite.errors import InputError, InstrumentError
from allanite.plain_files.counted import plural
from allanite.recording.records import Channel

__all__ = ["SerialImu"]

#: The host reads late by this much, now and then [s]; what the clock says of a gap is worth no more.
JITTER = 0.05
#: The port is emptied that often [s]: a kernel keeps 4096 bytes, 36 ms at a million baud.
_POLL = 0.01
#: A wait for the first sample is cut into such slices, so that somebody who interrupts is heard [s].
_SLICE = 0.25
#: Half a frame that stays half for so many intervals of a sample, and at least so long [s], is given up.
_PATIENCE = (20, 0.5)
#: After a silence that may have lost samples a block gathers so long: what was kept on the way comes in a burst [s].
_BURST = 0.5
#: With so many bytes at once there are more: no waiting [bytes].
_PLENTY = 1024


class _Port(Protocol):
    def read(self, timeout: float) -> bytes: ...
    def write(self, payload: bytes) -> None: ...
    def close(self) -> None: ...
    def usb_serial_number(self) -> str: ...


class SerialImu:
    """A device that sends frames or lines over a serial port: an `allanite.instruments.Instrument`.

    Parameters
    ----------
    port : str
        "/dev/ttyUSB0", "COM3", "socket://host:port"; see `allanite.acquisition.instruments.port_names`.
    description : Description or path
        Description of the device, see `read_description`.
    gather : float [s]
        `read` waits this long for more after the first bytes, so that a block holds several samples.
    connect : callable, optional
        Function that opens the port; for tests.

    Raises
    ------
    InputError
        A name that is no port, or a file, a folder, a pipe or a disk.
    FormatError
        The description is wrong; see `read_description`.

    Notes
    -----
    Nothing is reconnected in here. After an `InstrumentError` call `close`, `open`, `start`: counts go on, and the
    first sample is flagged RESYNC. Where the device has a counter, the number of the sample tells how long it was away.
    """

    def __init__(
        self,
        port: str,
        description: Description | str | os.PathLike[str],
        *,
        gather: float = 0.1,
        connect: Callable[[str, PortSettings], _Port] = SerialPort,
    ) -> None:
        if refusal := refusal_of_port(port):
            raise InputError(refusal)
        self.description = (
            description if isinstance(description, Description) else read_description(description)
        )
        self._name, self._connect, self._gather = port, connect, gather
        self._port: _Port | None = None
        self._framer = Framer(self.description)
        self._told = Tally()
        self._channels = self.description.channels
        self._clock = NumbersByClock(self.description)
        self._interrupted = False

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels in the order of the description."""
        return self._channels

    @property
    def rate(self) -> float:
        """Samples per second that the description states [Hz]."""
        return self.description.rate

    @property
    def settings(self) -> Mapping[str, object]:
        """Port and description: all that decides how bytes became numbers."""
        stated = self.description.model_dump(mode="json", by_alias=True, exclude_defaults=True)
        return {"port": self._name, "line": self.description.port.model_dump(), "description": stated}

    @property
    def device(self) -> str:
        """The port, whatever the links are called that lead to it; an address in the network."""
        if (address := network_device(self._name)) is not None:
            return address
        path = os.path.realpath(self._name)
        return path if os.path.exists(path) else self._name  # noqa: PTH110

    @property
    def tally(self) -> Tally:
        """What was dropped since the first `open`, and why."""
        return self._framer.tally

    # -- the instrument -----------------------------------------------------------------------------------

    def open(self) -> Identity:
        """Open the port and, if the description says how, ask who is there.

        Raises
        ------
        InstrumentError
            No port, or no answer that fits.
        """
        self.close()
        self._port = self._connect(self._name, self.description.port)
        try:
            identity = self._ask()
            serial = identity.get("serial") or self.description.serial or self._port.usb_serial_number()
        except InstrumentError:
            self.close()
            raise
        return Identity(
            maker=self.description.maker,
            model=self.description.model,
            serial=serial,
            firmware=identity.get("firmware", ""),
        )

    def start(self) -> None:
        """Send the start command; a device that always sends needs none."""
        self._interrupted = False
        for text in self.description.start:
            self._opened().write(text.payload)

    def read(self, timeout: float) -> Block:
        """Samples that have come, waiting at most `timeout` seconds for the first of them.

        Raises
        ------
        InstrumentTimeout
            Nothing came, or bytes but no frame.
        InstrumentError
            The port is gone.
        """
        received = 0
        deadline = time.monotonic() + timeout
        parts: list[Samples] = []
        heard, until = 0, deadline
        while not parts or time.monotonic() < until:
            try:
                arrived = self._opened().read(
                    max(min(until - time.monotonic(), _POLL if parts else _SLICE), 0.0)
                )
            except InstrumentError:
                if not parts:
                    raise
                break  # what has come is given; the next read says that the port is gone
            now = host_ns()
            heard += len(arrived)
            self._give_up_halves(bool(arrived), now)
            samples = self._framer.feed(arrived)
            if len(samples):
                received = now
                if not parts:
                    gather = _BURST if self._clock.may_have_lost else self._gather
                    until = min(
                        time.monotonic() + gather, max(deadline, time.monotonic() + gather - self._gather)
                    )
                parts.append(samples)
            elif not parts and (self._interrupted or time.monotonic() >= deadline):
                self._refuse(timeout, heard)
            if parts and len(arrived) < _PLENTY:  # let bytes gather: one wake-up each few milliseconds
                time.sleep(max(min(until - time.monotonic(), _POLL), 0.0))
        return self._block(_joined(parts), received)

    def interrupt(self) -> None:
        """A `read` that waits ends soon."""
        self._interrupted = True

    def stop(self) -> None:
        """Send the stop command; a lost port is no error."""
        if self._port is None:
            return
        try:
            for text in self.description.stop:
                self._port.write(text.payload)
        except InstrumentError:
            return

    def close(self) -> None:
        """Give the port back."""
        if self._port is not None:
            self._port.close()
            self._port = None
            self._framer.cut()

    # -- inside -------------------------------------------------------------------------------------------

    def _opened(self) -> _Port:
        if self._port is None:
            raise InstrumentError(f"{self._name} is not open: call open() first")
        return self._port

    def _ask(self) -> dict[str, str]:
        question = self.description.identity
        if question is None:
            return {}
        port = self._opened()
        port.write(question.ask.payload)
        pattern = re.compile(question.answer.encode("utf-8"))
        heard, deadline = b"", time.monotonic() + question.seconds
        while (left := deadline - time.monotonic()) > 0:
            heard = (heard + port.read(left))[-8192:]  # samples may come in between
            if match := pattern.search(heard):
                given = {name: text or b"" for name, text in match.groupdict().items()}
                return {name: text.decode("latin-1").strip() for name, text in given.items()}
        raise InstrumentError(
            f"{self._name}: no answer to the identity query within {question.seconds:g} s. Is it the "
            f"device of the description ({self.description.model}), and {self.description.port.baud} baud?"
        )

    def _give_up_halves(self, arrived: bool, now: int) -> None:
        """The rest of a frame that does not come is not the beginning of another one."""
        intervals, seconds = _PATIENCE
        patience = max(intervals / self.rate, seconds)
        if not arrived and self._framer.pending and self._clock.silent(now) > patience:
            self._framer.cut()
        if arrived:
            self._clock.heard(now)

    def _refuse(self, timeout: float, heard: int) -> None:
        if not heard:
            raise InstrumentTimeout(f"{self._name}: no data within {timeout:g} s")
        if self._framer.held:
            raise InstrumentTimeout(
                f"{self._name}: the counter jumped back, and {plural(self._framer.held, 'frame', 'wait')} for proof "
                "that the device restarted"
            )
        fresh = self._framer.tally.since(self._told)
        raise InstrumentTimeout(
            f"{self._name}: {heard} bytes arrived within {timeout:g} s but no sample of {self.description.model} "
            f"({'; '.join(fresh.sentences()) or 'no whole frame yet'}). Check the description and the baud rate"
        )

    def _block(self, samples: Samples, received: int) -> Block:
        silence, shift = self._clock.silence, self._clock.shift
        placed = self._clock.placed(samples, received)
        tally = self._framer.tally
        fresh = tally.since(self._told)
        if (
            shift := self._clock.shift - shift
        ):  # what only the clock has seen, whole turns of the counter among it
            fresh.jumps, fresh.lost = max(fresh.jumps, 1), fresh.lost + shift
        remarks = fresh.sentences()
        if placed.counter is None and placed is not samples:
            remarks = (*remarks, _UNCOUNTED.format(silence))
        self._told = tally
        return Block(
            values=placed.values,
            flags=placed.flags,
            counter=placed.counter,
            received_ns=received,
            remarks=remarks,
        )


def _joined(parts: list[Samples]) -> Samples:
    if len(parts) == 1:
        return parts[0]
    jumps, before = [], 0
    for part in parts:
        jumps += [replace(jump, index=before + jump.index) for jump in part.jumps]
        before += len(part)
    counters = [part.counter for part in parts if part.counter is not None]
    return Samples(
        values=np.concatenate([part.values for part in parts]),
        flags=np.concatenate([part.flags for part in parts]),
        counter=np.concatenate(counters) if counters else None,
        jumps=tuple(jumps),
    )


#: Why a gap is where a device without a counter was silent.
_UNCOUNTED = (
    "nothing came for {:.2f} s from a device without a counter: the host clock determines the missing samples"
)


class NumbersByClock:
    """Numbers of samples where the counter leaves them open: nearest to what the clock of the host says.

    Without a counter a sample that comes after a silence is marked RESYNC where fewer came than the time calls for:
    who numbers them then asks the clock.

    A counter is trusted where it goes on, and in small gaps. A far jump is as large as the clock says, put right by
    what the counter went forward where both agree. Where the clock ran on by whole turns more than the counter, it
    turned while nothing came.
    """

    def __init__(self, described: Description) -> None:
        counter = described.counter
        self._turn = 0.0 if counter is None else counter.turns_at / counter.step
        self._rate = described.rate
        self._shift = 0
        self._last: tuple[int, int] | None = None
        self._heard: int | None = None
        self._counts = counter is not None
        self._longest = 0  # silence since the last block [ns]

    @property
    def shift(self) -> int:
        """By how many samples the clock has corrected the counter so far."""
        return self._shift

    @property
    def silence(self) -> float:
        """The longest time without a byte since the last block [s]."""
        return self._longest * 1e-9

    @property
    def may_have_lost(self) -> bool:
        """Nothing came for so long that samples may be missing of which no counter tells."""
        intervals, seconds = _PATIENCE
        return not self._counts and self.silence >= max(intervals / self._rate, seconds)

    def heard(self, now: int) -> None:
        """Bytes have come."""
        if self._heard is not None:
            self._longest = max(self._longest, now - self._heard)
        self._heard = now

    def silent(self, now: int) -> float:
        """For how long none have [s]."""
        return 0.0 if self._heard is None else (now - self._heard) * 1e-9

    def placed(self, samples: Samples, now: int) -> Samples:
        """The same samples with their numbers put right; `now` [ns] is when the last of them was there."""
        if samples.counter is None:
            return self._uncounted(samples, now)
        self._longest = 0
        numbers, flags = samples.counter + self._shift, samples.flags.copy()
        if self._last is not None:
            number, then = self._last
            gone = (now - then) * 1e-9 * self._rate
            self._settle(numbers, flags, samples, number, gone)
        self._last = int(numbers[-1]), now
        return replace(samples, flags=flags, counter=numbers)

    def _uncounted(self, samples: Samples, now: int) -> Samples:
        """Marked where fewer samples came after a silence than the time calls for."""
        silent, before = self.may_have_lost, self._last
        self._longest, self._last = 0, (0, now)
        if before is None or not silent:
            return samples
        gone = (now - before[1]) * 1e-9 * self._rate
        if gone - len(samples) <= self._allowed(gone):
            return samples
        flags = samples.flags.copy()
        flags[0] |= Flag.RESYNC
        return replace(samples, flags=flags)

    def _allowed(self, gone: float) -> float:
        """By how many samples the clock and the counter may differ."""
        return 2 + self._rate * JITTER + 0.02 * gone

    def _settle(
        self,
        numbers: NDArray[np.int64],
        flags: NDArray[np.uint8],
        samples: Samples,
        last: int,
        gone: float,
    ) -> None:
        """Shift, in place, what follows a jump that the clock contradicts."""
        short = gone - float(numbers[-1] - last)
        allowed = self._allowed(gone)
        if abs(short) <= allowed:
            return
        before = np.concatenate([[last], numbers[:-1]])
        far = [jump for jump in samples.jumps if jump.far]
        if far:
            jump = max(far, key=lambda j: int(numbers[j.index] - before[j.index]))
            at, step = jump.index, int(numbers[jump.index] - before[jump.index])
            wanted = max(step + short, 1.0)
            turned = jump.turned + self._turn * round((wanted - jump.turned) / self._turn)
            agree = turned >= 1 and abs(turned - wanted) <= allowed
            shift = round(turned if agree else wanted) - step
        else:
            at = max((j.index for j in samples.jumps), key=lambda i: numbers[i] - before[i], default=0)
            shift = round(self._turn * round(short / self._turn)) if short > 0.75 * self._turn else 0
        if shift:
            numbers[at:] += shift
            flags[at] |= Flag.RESYNC
            self._shift += shift
