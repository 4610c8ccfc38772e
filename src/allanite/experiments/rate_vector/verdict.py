# SPDX-License-Identifier: BSD-3-Clause
"""The verdict on a rate vector, with its reason and advice."""

from __future__ import annotations

import math
from dataclasses import replace

from allanite.experiments.rate_vector.results import RateVector
from allanite.plain_files.counted import plural
from allanite.quantities.earth import DEG_H, EARTH_RATE
from allanite.quantities.residual_tests import SEEN

__all__ = ["STATEMENT", "judge"]

_TURN = "turn the sensor about a known axis, which separates its biases from the Earth"

_FURTHER = "turn the sensor by half a turn about a level axis and record both poses as long as the longest"

STATEMENT = (
    "the length is |bias + Earth|: the biases of the three gyros are in it, and nothing but turning the sensor "
    "separates them from the Earth. Only a sensor whose biases are well below "
    f"{EARTH_RATE / DEG_H:.0f} deg/h measures the Earth's rotation this way"
)


def judge(rate_vector: RateVector, *, rise: float = 0.0) -> RateVector:
    """The same with verdict, reason and advice.

    Parameters
    ----------
    rate_vector : RateVector
    rise : float
        By how much even the quietest stretches move more over seconds than over parts of one; infinite where there
        are too few of them.
    """
    verdict, reason, advice = _verdict(rate_vector, rise)
    if rate_vector.turned:
        advice = tuple(_FURTHER if text == _TURN else text for text in advice)
    failed = tuple(c.says for c in rate_vector.checks if not c.passed)
    if rate_vector.turned:
        poses = f"the sensor stood in {plural(len(rate_vector.turns), 'pose')}"
        advice += (f"{poses}: the length is from all of them, the vector from the longest",)
    return replace(rate_vector, verdict=verdict, reason=reason, advice=(*failed, *advice))


def _verdict(rate_vector: RateVector, rise: float) -> tuple[str, str, tuple[str, ...]]:
    if math.isnan(rate_vector.length):
        reason = (
            f"no quiet stretch: only {rate_vector.quiet:.0f} s of {rate_vector.duration:.0f} s are at rest, in cells "
            f"of {rate_vector.cell:.1f} s"
            if math.isinf(rise)
            else f"no quiet stretch: even where the sensor moves least, it moves {math.sqrt(rise):.1f} times as much "
            "over seconds as over parts of a second, which no noise of a sensor at rest does"
        )
        return "not resolved", reason, ("record longer, with nobody near the sensor and engines off",)
    low, high = (x / DEG_H for x in rate_vector.interval)
    length, sd = rate_vector.length / DEG_H, rate_vector.total_sd / DEG_H
    grave = [c for c in rate_vector.checks if not c.passed and c.name in ("latitude", "length in each pose")]
    if rate_vector.length < SEEN * rate_vector.total_sd:
        reason = (
            f"the length, |bias + Earth|, is {length / sd:.1f} standard deviations from zero, {SEEN:g} are needed; "
            f"it is below {_text(high)} deg/h"
        )
        return "not resolved", reason, ("record longer, or with a sensor of less noise", _TURN)
    if not rate_vector.interval[0] <= EARTH_RATE <= rate_vector.interval[1]:
        reason = (
            f"the length is |bias + Earth|: its interval {_text(low)} to {_text(high)} deg/h excludes the known "
            f"{EARTH_RATE / DEG_H:.3f} deg/h, so the biases are together at least "
            f"{_text(max(low - EARTH_RATE / DEG_H, EARTH_RATE / DEG_H - high))} deg/h (or the scale factors are "
            "wrong): this is no measurement of the Earth"
        )
        return "inconsistent with Earth", reason, (_TURN,)
    if grave:
        return "inconsistent", f"{grave[0].says}: bias and Earth together are not the Earth alone", (_TURN,)
    backed = (
        "its direction agrees with the latitude"
        if _agrees(rate_vector)
        else "nothing in this record bounds them"
    )
    reason = (
        f"{length:.3f} deg/h, and the interval {low:.3f} to {high:.3f} deg/h holds the known "
        f"{EARTH_RATE / DEG_H:.3f}; this is the Earth if the biases are well below it ({backed})"
    )
    return "resolved", reason, ()


def _text(value: float) -> str:
    """Four digits, and none of them an exponent."""
    return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"


def _agrees(rate_vector: RateVector) -> bool:
    return any(c.name == "latitude" and c.passed for c in rate_vector.checks)
