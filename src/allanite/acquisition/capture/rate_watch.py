# SPDX-License-Identifier: BSD-3-Clause
"""The stated rate against the clock of the host: a device that is set to another rate makes every lag wrong.

A burst after a stall shortens one window and lengthens the one before it, so two windows in a row must agree.
"""

from __future__ import annotations

from allanite.lazy_dataclasses import dataclass

__all__ = ["RateWatch"]

#: Length of a window: at least so many seconds, and so many blocks.
_SECONDS, _BLOCKS = 10.0, 10
#: Difference that no oscillator of a working device explains, relative; two windows agree within this part of it.
_WRONG, _AGREED = 0.01, 0.2


@dataclass(slots=True)
class RateWatch:
    """Compares the stated rate with the rate of uninterrupted windows.

    Attributes
    ----------
    rate : float [Hz]
        Stated.
    contradicted : float or None [Hz]
        What the clock of the host says instead, once two windows in a row contradict the stated rate.
    """

    rate: float
    contradicted: float | None = None
    _begun: tuple[int, int] | None = None  # of the window: number of a sample, and when it came [ns]
    _blocks: int = 0
    _before: float | None = None  # rate of the window before [Hz]

    def take(self, number: int, now: int) -> None:
        """The last sample of a block came `now` [ns]."""
        if self._begun is None:
            self._begun, self._blocks = (number, now), 0
            return
        self._blocks += 1
        seconds = (now - self._begun[1]) * 1e-9
        if self._blocks < _BLOCKS or seconds < _SECONDS:
            return
        self._judge((number - self._begun[0]) / seconds)
        self._begun, self._blocks = (number, now), 0

    def interrupt(self) -> None:
        """What comes next begins a window of its own."""
        self._begun = self._before = None

    def _judge(self, measured: float) -> None:
        off = abs(measured - self.rate)
        if (
            self._before is not None
            and min(off, abs(self._before - self.rate)) > _WRONG * self.rate
            and abs(measured - self._before) < _AGREED * off
        ):
            self.contradicted = measured
        self._before = measured
