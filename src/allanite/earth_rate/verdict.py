# SPDX-License-Identifier: BSD-3-Clause
"""The verdict on an Earth rate, with its reason and advice."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from allanite.earth import EARTH_RATE

if TYPE_CHECKING:
    from allanite.earth_rate.results import Check, EarthRateEstimate

__all__ = ["judge"]

#: A rate is seen from so many standard deviations on.
SEEN = 3.0
#: Scatter beyond so many times the model's says that the model is not that of this record.
FOREIGN = 2.0
_WIDENS = ("scatter of the dwells", "size of the noise")
_DEG_H = math.pi / 180 / 3600


def judge(estimate: EarthRateEstimate, *, separable: bool) -> tuple[str, str, tuple[str, ...]]:
    """Verdict, reason and advice."""
    if not separable:
        return _not_separable(estimate)
    failed = sorted((c for c in estimate.checks if not c.passed), key=_rank)
    grave = [c for c in failed if c.name not in _WIDENS or math.sqrt(c.statistic / c.dof) > FOREIGN]
    advice = tuple(c.says for c in failed if c.name != "order of the turns" or failed[0].name != "warm-up")
    if estimate.first == "unknown":
        advice += (
            "the direction of the first dwell is not known: the sign of the rate is a choice (--first)",
        )
    widened = "" if estimate.inflation == 1 else f", widened {estimate.inflation:.2f} times"
    size = f"{abs(estimate.rate) / estimate.total_sd:.1f} standard deviations"
    if grave:
        others = f" (also: {', '.join(c.name for c in grave[1:])})" if grave[1:] else ""
        return "inconsistent", f"the residuals contradict the noise model: {grave[0].says}{others}", advice
    if abs(estimate.rate) < SEEN * estimate.total_sd:
        return "not resolved", f"the rate is {size}{widened} from zero, {SEEN:g} are needed", advice
    low, high = estimate.interval
    if not low <= EARTH_RATE <= high:
        span = f"{low / _DEG_H:.2f} to {high / _DEG_H:.2f} deg/h"
        reason = (
            f"the interval {span} excludes the known {EARTH_RATE / _DEG_H:.3f} deg/h ({abs(estimate.deviation):.1f} "
            "standard deviations): an error that follows the turns, or the scale factor, the latitude, the direction "
            "of the first dwell"
        )
        return "inconsistent with Earth", reason, advice
    return "resolved", f"{size}{widened} from zero, and the interval holds the known rate", advice


def _rank(check: Check) -> int:
    """A cause before its consequences: a drift also makes the dwells scatter and the noise large."""
    causes = ("warm-up", "settling", "order of the turns", "constancy of the rate", *_WIDENS)
    return (
        causes.index(check.name) if check.name in causes else 1
    )  # a companion channel, like the temperature


def _not_separable(estimate: EarthRateEstimate) -> tuple[str, str, tuple[str, ...]]:
    level, sd = (x / _DEG_H for x in estimate.bias)
    seen = EARTH_RATE * math.cos(estimate.latitude) / _DEG_H
    reason = (
        f"without reversals the rate and the bias are one constant, {level:.4g} +- {sd:.2g} deg/h, and no filter tells "
        f"them apart. Under the known rate the bias is {level - seen:.4g} deg/h if the axis points north, "
        f"{level + seen:.4g} if south, {level:.4g} if east or west, each +- {sd:.2g}"
    )
    return "not separable", reason, ("turn the sensor by 180 deg, and back, at least a few times",)
