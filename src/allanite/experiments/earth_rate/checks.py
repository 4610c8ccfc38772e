# SPDX-License-Identifier: BSD-3-Clause
"""Questions put to the residuals of an Earth rate, and what a failed one means."""

from __future__ import annotations

import math
from collections.abc import Iterable

from allanite.experiments.earth_rate.verdict import RateCheckKind
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.residual_tests import CheckResult, grave, scatter_words, size_words
from allanite.recording.channel_names import for_shell

__all__ = ["RateCheck", "failures"]

_NAMES = {
    RateCheckKind.SIZE: "size of the noise",
    RateCheckKind.SCATTER: "scatter of the dwells",
    RateCheckKind.CONSTANCY: "constancy of the rate",
    RateCheckKind.ORDER: "order of the turns",
}
#: A cause before its consequences: a drift also makes the dwells scatter and the alternation look another.
_CAUSES = (
    RateCheckKind.WARM_UP,
    RateCheckKind.SETTLING,
    RateCheckKind.ORDER,
    RateCheckKind.CONSTANCY,
    RateCheckKind.SCATTER,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RateCheck(CheckResult):
    """One question put to the residuals.

    Attributes
    ----------
    kind : RateCheckKind
        "size" of the noise, "warm-up", "settling" after each turn, "temperature", "scatter" of the dwells, "constancy"
        of the rate, "order" of the turns.
    channel : str
        Of a temperature; else "".
    at : float [s]
        Of the order of the turns: from here on the alternation would be another; NaN of the others.
    """

    kind: RateCheckKind
    channel: str = ""
    at: float = math.nan

    @property
    def name(self) -> str:
        """What was asked; of a temperature its channel."""
        return self.channel or _NAMES.get(self.kind, self.kind)

    @property
    def says(self) -> str:
        """What it means and what to do, when it did not pass."""
        return _meaning(self)


def failures(checks: Iterable[RateCheck]) -> list[RateCheck]:
    """Checks that did not pass, the cause before its consequences."""
    return sorted((c for c in checks if not c.passed), key=_rank)


def _rank(check: RateCheck) -> int:
    """The size of the noise comes first where it speaks of another sensor, last where it does not."""
    if check.kind is RateCheckKind.SIZE:
        return -1 if grave([check]) or check.ratio < 1 else len(_CAUSES)
    return _CAUSES.index(check.kind) if check.kind in _CAUSES else 1


def _meaning(check: RateCheck) -> str:
    """What it means and what to do, when it did not pass."""
    match check.kind:
        case RateCheckKind.SIZE:
            return size_words(check.ratio)
        case RateCheckKind.WARM_UP:
            return (
                "the level drifts as after power-on, by more than the noise model allows: wait longer before the "
                "record begins, or fit the warm-up with the rate (--warm-up)"
            )
        case RateCheckKind.SETTLING:
            return (
                "the sensor keeps rotating after each turn, which adds to the rate: leave out more time "
                "after each turn (--dead-time), or fit it with the rate (--settling)"
            )
        case RateCheckKind.TEMPERATURE:
            return (
                "the level follows the temperature: fit it with the rate (--temperature "
                f"{for_shell(check.channel)})"
            )
        case RateCheckKind.SCATTER:
            causes = "pointing, tilt, residual rotation, a bias by position"
            return scatter_words("dwells", check.ratio, f"something changes from turn to turn ({causes})")
        case RateCheckKind.CONSTANCY:
            return (
                "the alternation from turn to turn grows or fades through the record: look at the dwells, and take "
                "the part of the record that is steady"
            )
        case RateCheckKind.ORDER:
            return (
                f"at {check.at:.0f} s the order of the two directions changes: a turn was missed or counted twice; "
                "correct it with a file of turns"
            )
