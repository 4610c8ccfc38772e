# SPDX-License-Identifier: BSD-3-Clause
"""What a share of records may be for a row to hold, and what the row would not let pass.

A gate holds with 99.9 % probability if the true share is the stated one. Its power is the other half of what it says:
the nearest true shares that it rejects with 90 % probability. Between these and the stated share, a row says nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from scipy.optimize import brentq
from scipy.stats import binom

__all__ = ["Ends", "Gate", "at_least", "at_most", "within"]

Json = dict[str, Any]

#: Probability that a gate holds at the stated share, and that it rejects those that the row names.
HOLDS, REJECTS = 0.999, 0.90


class Ends(StrEnum):
    """Which shares are wrong: those too far on either side, those too small, or those too large."""

    BOTH = "both"
    LOWER = "lower"
    UPPER = "upper"


@dataclass(frozen=True, slots=True, kw_only=True)
class Gate:
    """Shares of so many records that agree with the stated one.

    Attributes
    ----------
    stated : float
        Share that is claimed.
    records : int
        How many are counted.
    ends : Ends
        Where a one-sided claim ("at least 95 %", "at most 5 %") has its end.
    """

    stated: float
    records: int
    ends: Ends = Ends.BOTH

    @property
    def low(self) -> float:
        """Least share that holds; 0 where none is too small."""
        if self.ends is Ends.UPPER:
            return 0.0
        return float(binom.ppf(self._tail, self.records, self.stated)) / self.records

    @property
    def high(self) -> float:
        """Greatest share that holds; 1 where none is too large."""
        if self.ends is Ends.LOWER:
            return 1.0
        return float(binom.ppf(1 - self._tail, self.records, self.stated)) / self.records

    @property
    def rejects(self) -> tuple[float | None, float | None]:
        """Nearest true shares below and above the stated one that are rejected with 90 % probability, if any."""
        return self._rejected(below=True), self._rejected(below=False)

    def holds(self, *shares: float) -> bool:
        """Whether all of these agree with the stated share, up to rounding."""
        slack = 1e-9
        return all(self.low - slack <= share <= self.high + slack for share in shares)

    def columns(self) -> Json:
        """Cells of a table: the gate and its power."""
        below, above = self.rejects
        words = [
            f"{name} {share:.3f}" for name, share in (("below", below), ("above", above)) if share is not None
        ]
        return {"gate": [self.low, self.high], "rejects": ", ".join(words) or "nothing"}

    @property
    def _tail(self) -> float:
        return (1 - HOLDS) / 2 if self.ends is Ends.BOTH else 1 - HOLDS

    def _passing(self, truth: float) -> float:
        """Probability that a row holds if this is the true share."""
        least, most = math.ceil(self.low * self.records - 0.5), math.floor(self.high * self.records + 0.5)
        return float(binom.cdf(most, self.records, truth) - binom.cdf(least - 1, self.records, truth))

    def _rejected(self, *, below: bool) -> float | None:
        end = 0.0 if below else 1.0
        too_far: Callable[[float], float] = lambda truth: self._passing(truth) - (1 - REJECTS)  # noqa: E731
        if self.ends is (Ends.UPPER if below else Ends.LOWER) or too_far(end) > 0:
            return None
        return float(brentq(too_far, end, self.stated, xtol=1e-6))


def within(records: int, stated: float = 0.95) -> Gate:
    """Neither fewer nor more than stated."""
    return Gate(stated=stated, records=records)


def at_least(records: int, stated: float = 0.95) -> Gate:
    """Not fewer than stated: of one-sided sets, which may cover more."""
    return Gate(stated=stated, records=records, ends=Ends.LOWER)


def at_most(records: int, stated: float = 0.05) -> Gate:
    """Not more than stated: of false alarms."""
    return Gate(stated=stated, records=records, ends=Ends.UPPER)
