# SPDX-License-Identifier: BSD-3-Clause
"""How fast samples come by the clock of the host, and how evenly: what an interruption is measured with."""

from __future__ import annotations

import math
from dataclasses import field

from allanite.lazy_dataclasses import dataclass

__all__ = ["Arrivals"]

#: Standard uncertainty of a rate of which nothing is known but its nominal value, relative: the oscillator of an IMU.
_UNKNOWN = 1e-2
#: Blocks that must have come before a rate is believed, and over which the scatter of their instants is averaged.
_FEWEST, _MEMORY = 10, 64
#: The interruption begins and ends anywhere within an interval of a sample: the variance of that, in samples.
_PHASE = 1 / 12


@dataclass(slots=True)
class Arrivals:
    """Blocks as they come, and the rate of the longest stretch of them that nothing interrupted.

    Attributes
    ----------
    rate : float [Hz]
        Nominal.
    """

    rate: float
    _first: tuple[int, int] | None = None  # of the stretch: number of a sample, and when it came [ns]
    _last: tuple[int, int] | None = None
    _blocks: int = 0
    _scatter: float = 0.0  # mean square of what intervals of blocks differ from their samples [s^2]
    _measured: tuple[float, float] = field(default=(0.0, math.inf))  # [Hz], and its relative uncertainty

    def take(self, number: int, now: int) -> None:
        """The last sample of a block came `now` [ns]."""
        if self._last is None or self._first is None:
            self._first = self._last = (number, now)
            self._blocks = 1
            return
        off = (now - self._last[1]) * 1e-9 - (number - self._last[0]) / self.rate
        self._blocks += 1
        self._scatter += (off * off - self._scatter) / min(self._blocks - 1, _MEMORY)
        self._last = (number, now)
        samples, seconds = number - self._first[0], (now - self._first[1]) * 1e-9
        if self._blocks >= _FEWEST and seconds > 0:
            unsure = math.sqrt(2 * self._scatter) / seconds
            if unsure <= min(self._measured[1], _UNKNOWN):
                self._measured = samples / seconds, unsure

    def interrupt(self) -> None:
        """What comes next begins a stretch of its own."""
        self._first = self._last = None

    def change(self, rate: float) -> None:
        """Samples come at another rate."""
        if rate != self.rate:
            self.rate, self._measured = rate, (0.0, math.inf)
            self.interrupt()

    def passed(self, ns: int) -> tuple[float, float]:
        """Samples that come in a time, and the standard uncertainty of that number."""
        rate, unsure = self._measured if self._measured[1] < _UNKNOWN else (self.rate, _UNKNOWN)
        samples = ns * 1e-9 * rate
        return samples, math.sqrt(_PHASE + 2 * self._scatter * rate**2 + (samples * unsure) ** 2)
