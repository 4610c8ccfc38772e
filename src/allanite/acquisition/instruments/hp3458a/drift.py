# SPDX-License-Identifier: BSD-3-Clause
"""How far the clock of the meter is off that of the host, from the readings themselves.

A reading comes late by what the host and the bus need, and never too early: the smallest lateness of each window lies
on a line whose slope is the difference of the two clocks. A pause is then measured with the rate the meter had before
it, and not with the one it should have.
"""

from __future__ import annotations

import math
from dataclasses import field

import numpy as np

from allanite.lazy_dataclasses import dataclass

__all__ = ["Drift", "RateError"]

#: Standard uncertainty of the rate of a meter of which nothing is known yet: TIMER is good to a hundredth of a percent.
UNKNOWN = 1e-4
#: A quartz in a room keeps the rate that was measured before a pause to about so much.
WANDER = 1e-6
#: Points kept: every second one goes when there are so many.
MOST = 128
#: Points below which a line says nothing.
FEWEST = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class RateError:
    """Relative: by `value` longer than told is a period of the meter for the host, with its standard uncertainty."""

    value: float = 0.0
    uncertainty: float = UNKNOWN


@dataclass(slots=True)
class Drift:
    """The smallest lateness of windows of one stretch of readings, and what earlier stretches have said."""

    _numbers: list[int] = field(default_factory=list)
    _late: list[float] = field(default_factory=list)  # [ns]
    _every: int = 1
    _seen: int = 0
    _period_ns: float = 1.0
    _former: RateError = field(default_factory=RateError)
    _known: RateError | None = field(default_factory=RateError)  # None: to be found anew

    def add(self, number: int, late: float, period_ns: float) -> None:
        """The reading of a window that came earliest for its number: late by so many ns."""
        self._period_ns = period_ns
        self._seen += 1
        if self._seen % self._every:
            return
        self._numbers.append(number)
        self._late.append(late)
        if len(self._numbers) >= MOST:
            self._numbers, self._late = self._numbers[1::2], self._late[1::2]
            self._every *= 2
        self._known = None

    def restart(self) -> None:
        """What follows has another phase; the rate of the meter stays what it was."""
        self._former = self.error()
        self._numbers, self._late, self._every, self._seen = [], [], 1, 0
        self._known = self._former

    def error(self) -> RateError:
        """By the line through the points of this stretch, or of the one before where that says more.

        Notes
        -----
        The slope is the median of those of all pairs (Theil and Sen): windows in which the host was busy throughout do
        not bend it. Its uncertainty is that of a straight line with the scatter of the points about it, the scatter
        from the median of their distances; what a quartz wanders is added in quadrature.
        """
        if self._known is None:
            self._known = self._found()
        return self._known

    def _found(self) -> RateError:
        if len(self._numbers) < FEWEST:
            return self._former
        x = np.asarray(self._numbers, dtype=float)
        y = np.asarray(self._late)
        i, j = np.triu_indices(len(x), 1)
        slope = float(np.median((y[j] - y[i]) / (x[j] - x[i])))
        left = y - slope * x
        scatter = 1.4826 * float(np.median(np.abs(left - np.median(left)))) * math.sqrt(len(x) / (len(x) - 2))
        of_line = scatter / math.sqrt(float(((x - x.mean()) ** 2).sum())) / self._period_ns
        error = RateError(value=slope / self._period_ns, uncertainty=math.hypot(of_line, WANDER))
        return min(error, self._former, key=lambda rate: rate.uncertainty)
