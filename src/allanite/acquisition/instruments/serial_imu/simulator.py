# SPDX-License-Identifier: BSD-3-Clause
"""A described device on a pseudo-terminal: byte for byte what a serial port would give, and as badly as asked for.

The device has a name in a folder that stays the same when it disappears and comes back, as a link that udev makes.
"""

from __future__ import annotations

import contextlib
import os
import select
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

from allanite.acquisition.instruments.serial_imu.description import Description
from allanite.acquisition.instruments.serial_imu.encoding import Encoder
from allanite.acquisition.instruments.serial_imu.faults import ImuFault, Source, Vanish, Wait, noise, wire
from allanite.errors import InputError, InstrumentError

__all__ = ["SimulatedImu"]

#: The device sends what is due that often [s].
_TICK = 0.002


class SimulatedImu:
    """A device of a description that sends on a pseudo-terminal (Linux, macOS).

    Parameters
    ----------
    description : Description
        Description of the device.
    source : callable, optional
        Samples by number: `faults.Source`; by default white noise of `seed`, one unit strong.
    faults : sequence of ImuFault
        Faults to simulate.
    speed : float
        Times the rate of the description; infinity: as fast as it is read. An absence takes as long as it says.
    total : int, optional
        Samples after which it falls silent.
    seed : int
        Seed of the noise.
    serial : str
        Serial number that it answers, where the description says how to ask.

    Notes
    -----
    A device without `start` in its description sends from `begin()` on; `with` calls that. What nobody reads
    stays in the pseudo-terminal (4096 bytes), and the device waits: a host that is late loses nothing here.
    Opening the port empties it.
    """

    def __init__(
        self,
        description: Description,
        *,
        source: Source | None = None,
        faults: Sequence[ImuFault] = (),
        speed: float = 1.0,
        total: int | None = None,
        seed: int = 0,
        serial: str = "1",
    ) -> None:
        if not speed > 0:
            raise InputError(f"speed must be positive, not {speed!r}")
        self._described, self._speed, self._serial = description, speed, serial
        self._stream = wire(
            Encoder(description),
            source or noise(len(description.measured), seed),
            faults,
            rate=description.rate,
            total=total,
        )
        self._folder = tempfile.TemporaryDirectory(prefix="imu-")
        self._name = Path(self._folder.name) / "ttyIMU"
        self._ends: tuple[int, int] | None = None
        self._ending, self._sending = threading.Event(), threading.Event()
        self._thread: threading.Thread | None = None
        self._heard = b""
        self.sent = 0

    @property
    def port(self) -> str:
        """The port to open."""
        return str(self._name)

    def begin(self) -> SimulatedImu:
        """Plug it in."""
        self._plug_in()
        if not self._described.start:
            self._sending.set()
        self._thread = threading.Thread(target=self._run, name="simulated IMU", daemon=True)
        self._thread.start()
        return self

    def end(self) -> None:
        """Unplug it; may be called twice."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(timeout=5.0)
        self._pull_out()
        self._folder.cleanup()

    def __enter__(self) -> SimulatedImu:
        return self.begin()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()

    # -- the port -----------------------------------------------------------------------------------------

    def _plug_in(self) -> None:
        try:
            import tty

            device, host = os.openpty()
            tty.setraw(host)
        except (ImportError, AttributeError, OSError) as error:
            raise InstrumentError(
                f"no pseudo-terminal: {error}. The simulator needs Linux or macOS"
            ) from None
        os.set_blocking(device, False)
        # the host's end stays open here, so that bytes wait for a program that opens it
        self._ends = device, host
        self._name.unlink(missing_ok=True)
        self._name.symlink_to(os.ttyname(host))

    def _pull_out(self) -> None:
        self._name.unlink(missing_ok=True)
        for end in self._ends or ():
            with contextlib.suppress(OSError):
                os.close(end)
        self._ends = None

    # -- the device ---------------------------------------------------------------------------------------

    def _run(self) -> None:
        due, began = 0.0, time.monotonic()
        per_second = self._described.rate * self._speed
        first: int | None = None
        for number, what in self._stream:
            if not self._sending.is_set():
                while not self._sending.is_set() and not self._ending.is_set():
                    self._listen(0.01)
                first = None
            if first is None:
                first, began = number, time.monotonic()
            if isinstance(what, bytes):
                due = began + (number - first) / per_second
                if not self._wait_until(due) or not self._send(what):
                    return
                self.sent = number + 1
                continue
            self._be_away(what)
            first = None
        while not self._ending.wait(_TICK):
            self._listen(0.0)

    def _be_away(self, absence: Wait | Vanish) -> None:
        if isinstance(absence, Vanish):
            self._pull_out()
            self._ending.wait(absence.seconds)
            if absence.serial is not None:
                self._serial = absence.serial
            if not self._ending.is_set():
                self._plug_in()
            if self._described.start:
                self._sending.clear()
        else:
            self._ending.wait(absence.seconds)

    def _wait_until(self, due: float) -> bool:
        """False when the device is to end."""
        left = due - time.monotonic()
        if left > _TICK / 2:
            self._listen(0.0)
            time.sleep(max(left, _TICK))
        return not self._ending.is_set()

    def _send(self, payload: bytes) -> bool:
        """False when the device is to end."""
        while payload and not self._ending.is_set():
            if self._ends is None:
                return True
            try:
                payload = payload[os.write(self._ends[0], payload) :]
            except BlockingIOError:
                self._listen(_TICK)
            except OSError:
                return True
        return not self._ending.is_set()

    def _listen(self, seconds: float) -> None:
        """Hear what the host sends: begin, end, or a question."""
        if self._ends is None:
            time.sleep(seconds)
            return
        ready, _, _ = select.select([self._ends[0]], [], [], seconds)
        if not ready:
            return
        with contextlib.suppress(OSError):
            self._heard = (self._heard + os.read(self._ends[0], 4096))[-4096:]
        described = self._described
        if described.start and self._consume(described.start[-1].payload):
            self._sending.set()
        if described.stop and self._consume(described.stop[-1].payload):
            self._sending.clear()
        if described.identity is not None and self._consume(described.identity.ask.payload):
            self._send(f"SN {self._serial} FW sim\r\n".encode("ascii"))

    def _consume(self, words: bytes) -> bool:
        _, separator, behind = self._heard.partition(words)
        if separator:
            self._heard = behind
        return bool(separator)
