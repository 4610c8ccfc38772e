# SPDX-License-Identifier: BSD-3-Clause
"""How a run is told to end: by the caller, or by a signal of the system."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["Stop", "stopping_on_signals"]

_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")


class Stop:
    """A wish to end, with its reason."""

    def __init__(self) -> None:
        self._wished = threading.Event()
        self.reason = ""

    def ask(self, reason: str) -> None:
        """End soon. The first reason counts."""
        if not self._wished.is_set():
            self.reason = reason
        self._wished.set()

    @property
    def asked(self) -> bool:
        """Whether the run is to end."""
        return self._wished.is_set()


@contextmanager
def stopping_on_signals() -> Iterator[Stop]:
    """A `Stop` that SIGINT, SIGTERM and SIGHUP ask; a second SIGINT interrupts at once.

    To be used in the main thread, the only one that the system tells of signals.
    """
    stop = Stop()
    before = {}

    def asked(number: int, frame: FrameType | None) -> None:
        if number == signal.SIGINT and stop.asked:
            raise KeyboardInterrupt
        stop.ask(signal.Signals(number).name)

    for name in _SIGNALS:
        if hasattr(signal, name):
            number = getattr(signal, name)
            before[number] = signal.signal(number, asked)
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
