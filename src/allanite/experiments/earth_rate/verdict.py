# SPDX-License-Identifier: BSD-3-Clause
"""The verdict on an Earth rate, with its reason and advice."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from allanite.experiments.reversals.sides import is_vertical
from allanite.plain_files.counted import plural
from allanite.quantities.earth import DEG_H, EARTH_RATE
from allanite.quantities.residual_tests import SEEN, ResidualTest, grave
from allanite.quantities.units import STANDARD_GRAVITY

if TYPE_CHECKING:
    from allanite.experiments.earth_rate.results import EarthRateEstimate
    from allanite.experiments.reversals.turned_over import TurnedOver

__all__ = ["CONTRADICTS", "WITH_GRAVITY", "direction_to_state", "judge", "settling_that_explains"]

Verdict = tuple[str, str, tuple[str, ...]]

CONTRADICTS = "inconsistent with Earth"
"""The verdict on a rate that excludes the known one."""

WITH_GRAVITY = "not separable from g-sensitivity"
"""The verdict on a rate that may hold what follows gravity."""

_TOGETHER = "; but it is the rate of the Earth and the g-sensitivity of the axis together"
_BOUNDS = (
    "turning the axis over reverses gravity along it, too: the result bounds the Earth rate and the g-sensitivity of "
    "the axis together. State the g-sensitivity (--g-sensitivity 0.1deg/h/g) to have the Earth rate by itself"
)

_TURN = "turn the sensor by 180 deg, and back, at least a few times"
_MORE_DWELLS = ("a shorter dead time (--dead-time), or a file of turns (--turns FILE), may give more dwells",)

#: A cause before its consequences: a drift also makes the dwells scatter and the alternation look another.
_CAUSES = ("warm-up", "settling", "order of the turns", "constancy of the rate", "scatter of the dwells")


def judge(estimate: EarthRateEstimate, *, separable: bool, sure: float) -> Verdict:
    """Verdict, reason and advice.

    Parameters
    ----------
    sure : float [rad/s]
        Half the width of the interval that a rate of zero is in with the probability of three standard deviations.
    """
    if not separable:
        return _not_separable(estimate)
    failed = sorted((c for c in estimate.checks if not c.passed), key=_rank)
    advice = _advice(estimate, failed)
    widened = "" if estimate.inflation == 1 else f", widened {estimate.inflation:.2f} times"
    size = f"{abs(estimate.rate) / estimate.total_sd:.1f} standard deviations"
    bad = grave(failed)
    if bad:
        others = f" (also: {', '.join(c.name for c in bad[1:])})" if bad[1:] else ""
        return "inconsistent", f"the residuals contradict the noise model: {bad[0].says}{others}", advice
    if abs(estimate.rate) < sure:
        few = (
            ""
            if sure <= SEEN * estimate.total_sd * 1.001
            else " and more, for the noise is known from few dwells"
        )
        quiet = "".join(f"; {c.says}" for c in failed if c.widens and c.ratio < 1)
        return (
            "not resolved",
            f"the rate is {size}{widened} from zero, {SEEN:g} are needed{few}{quiet}",
            advice,
        )
    low, high = estimate.interval
    if not low <= EARTH_RATE <= high:
        span = f"{low / DEG_H:.2f} to {high / DEG_H:.2f} deg/h"
        reason = (
            f"the interval {span} excludes the known {EARTH_RATE / DEG_H:.3f} deg/h ({abs(estimate.deviation):.1f} "
            f"standard deviations): {_gravity(estimate)}an error that follows the turns, or the scale factor, the "
            "latitude, the direction of the first dwell"
        )
        return CONTRADICTS, reason, advice
    seen = f"{size}{widened} from zero, and the interval holds the known rate"
    return (WITH_GRAVITY, f"{seen}{_TOGETHER}", advice) if estimate.bounds_sum else ("resolved", seen, advice)


def _gravity(estimate: EarthRateEstimate) -> str:
    """The g-sensitivity that would explain the rate of a vertical axis."""
    found = estimate.g_sensitivity
    if found is None:
        return ""
    value, sd = (x / DEG_H * STANDARD_GRAVITY for x in (found.value, found.sd))
    return f"a g-sensitivity of {value:.3g} deg/h/g (standard deviation {sd:.2g}), "


def settling_that_explains(estimate: EarthRateEstimate, rate: float, sd: float, T: float) -> tuple[str, ...]:
    """What to say of a settling too small to be seen by itself, where it brings the rate back to the known one.

    Parameters
    ----------
    rate, sd : float [rad/s]
        With the settling fitted beside.
    T : float [s]
        Its time constant.
    """
    if estimate.verdict != CONTRADICTS or not abs(rate - EARTH_RATE) < min(
        SEEN * sd, abs(estimate.rate - EARTH_RATE)
    ):
        return ()
    says = (
        f"a rotation that settles after each turn may be the cause, though the residuals alone do not show it: fitted "
        f"beside, with {T:.2g} s, it makes the rate {rate / DEG_H:.2f} deg/h (standard deviation {sd / DEG_H:.2g}). "
        "Leave out more time after each turn (--dead-time), or fit it (--settling)"
    )
    return (says,)


def _rank(check: ResidualTest) -> int:
    """The size of the noise comes first where it speaks of another sensor, last where it does not."""
    if check.name == "size of the noise":
        return -1 if grave([check]) or check.ratio < 1 else len(_CAUSES)
    if check.name in _CAUSES:
        return _CAUSES.index(check.name)
    return 1  # a companion channel, like the temperature


def _advice(estimate: EarthRateEstimate, failed: list[ResidualTest]) -> tuple[str, ...]:
    """What the failed checks say, but for what a drift that is named already makes of the turns."""
    drifts = any(c.name == "warm-up" for c in failed)
    advice = tuple(c.says for c in failed if not (drifts and c.name == "order of the turns"))
    if estimate.bounds_sum:
        advice += (_BOUNDS,)
    return advice


def direction_to_state(
    estimate: EarthRateEstimate, over: TurnedOver | None, *, along_first: float
) -> tuple[str, ...]:
    """What is to be said of the direction of the first dwell, where it is not known, or not what it was said to be.

    Parameters
    ----------
    over : TurnedOver or None
        What the accelerometers of the record say.
    along_first : float [rad/s]
        The measured component along the direction of the first dwell.
    """
    if is_vertical(estimate.first) or not estimate.reversals.turns:
        return ()
    if over is not None and over.along:
        return (f"{over.says}: the axis was turned between up and down. Say so: --first {over.first}",)
    upright = _upright(estimate, along_first)
    if estimate.first != "unknown":
        return (f"if the axis was turned over, between up and down: {upright}",) if upright else ()
    says = (
        "the direction of the first dwell is not known: the sign of the rate is a choice. State it: --first north or "
        f"--first south; if the axis was turned over, between up and down: {upright or '--first up or --first down'}"
    )
    return (says,)


def _upright(estimate: EarthRateEstimate, along_first: float) -> str:
    """The rate that a vertical axis would make of it, where a level one contradicts the Earth and that one does not."""
    if estimate.verdict != CONTRADICTS or not estimate.latitude:
        return ""
    tangent = math.tan(estimate.latitude)
    low, high = sorted(abs(end / tangent) for end in estimate.interval)
    if not low <= EARTH_RATE <= high:
        return ""
    up = along_first / math.sin(estimate.latitude) / DEG_H
    return f"with --first up it is {up:.1f} deg/h, with --first down {-up:.1f} deg/h"


def _not_separable(estimate: EarthRateEstimate) -> Verdict:
    reversals = estimate.reversals
    directions = {d.sign for d in reversals.dwells} - {0}
    if reversals.turns and len(directions) < 2:
        left = "no dwell of known direction" if not directions else "dwells of one direction only"
        reason = f"{plural(len(reversals.turns), 'turn', 'leave')} {left}: rate and bias are one constant"
        return "not separable", reason, _MORE_DWELLS
    level, sd = (x / DEG_H for x in estimate.bias)
    known = "" if estimate.model_source == "given" else ", at least: the noise was fitted to this very record"
    digits = max(0, 1 - math.floor(math.log10(sd))) if 0 < sd < math.inf else 2
    constant = f"{level:.{digits}f} deg/h (standard deviation {sd:.2g}{known})"
    biases = [f"{level - seen / DEG_H:.{digits}f} {words}" for seen, words in _directions(estimate)]
    reason = (
        f"without reversals the rate and the bias are one constant, {constant}, and no filter tells them apart. Under "
        f"the known rate the bias is {', '.join(biases)}"
    )
    return "not separable", reason, (_TURN, *(() if estimate.reversals.turns else (_unseen(estimate),)))


def _unseen(estimate: EarthRateEstimate) -> str:
    """What to say of a record that shows no turns: it may have some."""
    first = ", with --first north, south, up or down" if estimate.first == "unknown" else ""
    return (
        "if it was turned, and the signal does not show it, say when: --dwell SECONDS for even intervals, else --turns "
        f"FILE{first}"
    )


def _directions(estimate: EarthRateEstimate) -> list[tuple[float, str]]:
    """What the axis would see of the Earth [rad/s], by the direction that it may have had; up and down where said."""
    north, up = (EARTH_RATE * part(estimate.latitude) for part in (math.cos, math.sin))
    if is_vertical(estimate.first):
        return [(up, "deg/h if the axis points up"), (-up, "if down")]
    return [
        (north, "deg/h if the axis points north"),
        (-north, "if south"),
        (0.0, "if east or west"),
        (up, "if up"),
        (-up, "if down"),
    ]
