# SPDX-License-Identifier: BSD-3-Clause
"""Lengths of record that are advised, in words; `allanite.fitting.advice` predicts them."""

from __future__ import annotations

import math

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.result import Result

__all__ = ["Advice", "span"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Advice(Result):
    """One line of advice.

    Attributes
    ----------
    symbol : str
        Symbol of the coefficient.
    target : float
        Relative standard deviation aimed at.
    duration : float [s]
        Length of record that reaches it; infinite (null in a document) where none does.
    reached : bool
        The present record reaches it.
    resolved : bool
        The record resolves the coefficient; otherwise one of half its limit is to stand out.
    """

    symbol: str
    target: float
    duration: float
    reached: bool
    resolved: bool

    @property
    def text(self) -> str:
        """In a sentence."""
        name = {"T": "T_b", "sigma": "B_equiv"}.get(self.symbol, self.symbol)
        if not math.isfinite(self.duration):
            return f"{name}: no record of reasonable length decides it"
        if self.resolved:
            aim = f"{name} to {100 * self.target:.0f} % (1 sd)"
            if self.reached:
                return f"this record determines {aim}"
            return f"a record of about {span(self.duration)} would determine {aim}"
        if self.reached:
            return f"this record would reveal {name} at half its limit"
        return f"a record of {span(self.duration)} would reveal {name} or halve its limit"


def span(seconds: float) -> str:
    """A duration in the unit people would use."""
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.2g} {unit}" if seconds / size < 100 else f"{seconds / size:.0f} {unit}"
    return f"{seconds:.2g} s"
