# SPDX-License-Identifier: BSD-3-Clause
"""A described device and its driver in a time that is only counted: who waits at the port moves the clock."""

from __future__ import annotations

import math
import types
from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest

from allanite.acquisition.instruments.serial_imu import Description, driver
from allanite.acquisition.instruments.serial_imu.encoding import Encoder
from allanite.acquisition.instruments.serial_imu.faults import noise, wire
from allanite.acquisition.instruments.serial_imu.layout import PortSettings
from virtual_meter import SECOND, VirtualClock


@dataclass(slots=True)
class VirtualPort:
    """A port at which a device sends `total` samples from its start on, and then nothing for ever."""

    described: Description
    clock: VirtualClock
    total: int
    _began: int | None = None
    _frames: Iterator[tuple[int, object]] = field(init=False)
    _sent: int = 0

    def __post_init__(self) -> None:
        channels = len(self.described.measured)
        self._frames = wire(
            Encoder(self.described), noise(channels), rate=self.described.rate, total=self.total
        )

    def __call__(self, name: str, settings: PortSettings) -> VirtualPort:
        return self

    def read(self, timeout: float) -> bytes:
        deadline = self.clock.ns + math.ceil(timeout * SECOND)
        self.clock.ns = max(self.clock.ns, min(deadline, self._due()))
        said = b""
        while self._due() <= self.clock.ns:
            _, frame = next(self._frames)
            assert isinstance(frame, bytes)
            said += frame
            self._sent += 1
        return said

    def write(self, payload: bytes) -> None:
        self._began = self.clock.ns if self._began is None else self._began

    def close(self) -> None:
        """Nothing is held."""

    def usb_serial_number(self) -> str:
        return "USB7"

    def silent(self) -> float:
        """For how long nothing has come [s]."""
        assert self._began is not None
        return (self.clock.ns - self._began) / SECOND - self._sent / self.described.rate

    def _due(self) -> int:
        if self._began is None or self._sent >= self.total:
            return 1 << 62
        return self._began + round((self._sent + 1) / self.described.rate * SECOND)


def follow(clock: VirtualClock, monkeypatch: pytest.MonkeyPatch) -> None:
    """The driver goes by this clock."""
    monkeypatch.setattr(driver, "host_ns", clock.now)
    monkeypatch.setattr(driver, "time", types.SimpleNamespace(monotonic=clock.seconds, sleep=clock.pass_by))
