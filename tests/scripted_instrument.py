# SPDX-License-Identifier: BSD-3-Clause
"""An instrument that follows a script, for tests of what records it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from allanite.acquisition.capture import Patience
from allanite.acquisition.instruments import Block, Identity, InstrumentTimeout
from allanite.errors import InstrumentError
from allanite.recording.records import Channel, Kind

RATE = 100.0
GYRO = Channel(name="gyro", kind=Kind.RATE, unit="rad/s", scale=1.0, sampling="mean")
QUICK = Patience(timeout=0.01, silences=3, reconnections=3, full=0.0, pause=0.001, longest_pause=0.002)
SAME = Identity(maker="Maker", model="M1", serial="7")
PATIENT = Patience(timeout=0.01, silences=3, reconnections=600, full=0.0, pause=0.001, longest_pause=0.002)
GONE = (SAME, *[InstrumentError("no such port")] * 600)

Step = Block | Exception | Callable[[], Block]


class Scripted:
    """An instrument that does what its script says, call by call of `read`."""

    def __init__(
        self, script: list[Step], identities: tuple[Identity | Exception, ...] = (), wait: float = 0.0
    ) -> None:
        self.steps: Iterator[Step] = iter(script)
        self.identities = iter(identities)
        self.wait = wait
        self.calls: list[str] = []
        self.interrupted = threading.Event()
        self.over = threading.Event()  # all that the script gave has been handed on

    @property
    def channels(self) -> tuple[Channel, ...]:
        return (GYRO,)

    @property
    def rate(self) -> float:
        return RATE

    @property
    def settings(self) -> Mapping[str, object]:
        return {"aperture": 0.005, "range": 10}

    @property
    def device(self) -> str:
        return ""

    def open(self) -> Identity:
        self.calls.append("open")
        found = next(self.identities, SAME)
        if isinstance(found, Exception):
            raise found
        return found

    def start(self) -> None:
        self.calls.append("start")

    def read(self, timeout: float) -> Block:
        time.sleep(self.wait)
        step = next(self.steps, None)
        if step is None:
            self.over.set()
            self.interrupted.wait(timeout)
            raise InstrumentTimeout("nothing came in 10 ms")
        if isinstance(step, Exception):
            raise step
        return step if isinstance(step, Block) else step()

    def interrupt(self) -> None:
        self.interrupted.set()

    def stop(self) -> None:
        self.calls.append("stop")

    def close(self) -> None:
        self.calls.append("close")


def block(
    first: int, n: int = 10, *, counter: bool = True, flags: int = 0, remarks: tuple[str, ...] = ()
) -> Block:
    number = np.arange(first, first + n, dtype=np.int64)
    marks = np.zeros(n, dtype=np.uint8)
    marks[0] = flags
    return Block(
        values=number[:, None].astype(float),
        flags=marks,
        counter=number if counter else None,
        remarks=remarks,
    )
