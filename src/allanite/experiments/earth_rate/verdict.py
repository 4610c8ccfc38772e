# SPDX-License-Identifier: BSD-3-Clause
"""What a measurement of the Earth rate comes to: its verdict, and what it has to remark."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import TYPE_CHECKING

from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.residual_tests import SEEN, grave
from allanite.quantities.verdict import Tone, Verdict

if TYPE_CHECKING:
    from allanite.experiments.earth_rate.results import EarthRateEstimate, RateCheck

__all__ = ["EarthRateVerdict", "NoiseOrigin", "RateCheckKind", "RateRemark", "explains", "failures", "judge"]


class EarthRateVerdict(Verdict):
    """Is the number a measurement of the Earth's rotation?"""

    INCONSISTENT = "inconsistent", "inconsistent", Tone.FATAL
    CONTRADICTS = "inconsistent with Earth", "inconsistent with Earth", Tone.FATAL
    NOT_SEPARABLE = "not separable", "not separable", Tone.WARNING
    WITH_GRAVITY = "not separable from g-sensitivity", "not separable from g-sensitivity", Tone.WARNING
    NOT_RESOLVED = "not resolved", "not resolved", Tone.WARNING
    RESOLVED = "resolved", "resolved", Tone.GOOD


class NoiseOrigin(StrEnum):
    """Where the noise model comes from."""

    GIVEN = "given"
    RECORD = "this record"


class RateCheckKind(StrEnum):
    """What is asked of the residuals."""

    SIZE = "size"
    WARM_UP = "warm-up"
    SETTLING = "settling"
    TEMPERATURE = "temperature"
    SCATTER = "scatter"
    CONSTANCY = "constancy"
    ORDER = "order"


class RateRemark(StrEnum):
    """What is to be known or done, beside the checks that did not pass."""

    TURN = "turn the sensor"
    STATE_TURNS = "state the turns"
    MORE_DWELLS = "get more dwells"
    WITH_GRAVITY = "state the g-sensitivity"
    TURNED_OVER = "was turned over"
    STATE_FIRST = "state the first direction"
    PERHAPS_OVER = "perhaps turned over"
    SETTLING = "perhaps a settling"
    UNDECIDED = "noise family undecided"


#: A cause before its consequences: a drift also makes the dwells scatter and the alternation look another.
_CAUSES = (
    RateCheckKind.WARM_UP,
    RateCheckKind.SETTLING,
    RateCheckKind.ORDER,
    RateCheckKind.CONSTANCY,
    RateCheckKind.SCATTER,
)


def judge(estimate: EarthRateEstimate, *, separable: bool) -> EarthRateVerdict:
    """The verdict on an estimate."""
    if not separable:
        return EarthRateVerdict.NOT_SEPARABLE
    if grave(estimate.checks):
        return EarthRateVerdict.INCONSISTENT
    if not estimate.rotation.resolved:
        return EarthRateVerdict.NOT_RESOLVED
    low, high = estimate.interval
    if not low <= EARTH_RATE <= high:
        return EarthRateVerdict.CONTRADICTS
    return EarthRateVerdict.WITH_GRAVITY if estimate.bounds_sum else EarthRateVerdict.RESOLVED


def failures(checks: Iterable[RateCheck]) -> list[RateCheck]:
    """Checks that did not pass, the cause before its consequences."""
    return sorted((c for c in checks if not c.passed), key=_rank)


def _rank(check: RateCheck) -> int:
    """The size of the noise comes first where it speaks of another sensor, last where it does not."""
    if check.kind is RateCheckKind.SIZE:
        return -1 if grave([check]) or check.ratio < 1 else len(_CAUSES)
    return _CAUSES.index(check.kind) if check.kind in _CAUSES else 1


def explains(estimate: EarthRateEstimate, rate: float, sd: float) -> bool:
    """Whether a settling too small to be seen by itself brings the rate back to the known one.

    Parameters
    ----------
    rate, sd : float [rad/s]
        With the settling fitted beside.
    """
    return abs(rate - EARTH_RATE) < min(SEEN * sd, abs(estimate.rate - EARTH_RATE))
