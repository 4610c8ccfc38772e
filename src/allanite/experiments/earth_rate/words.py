# SPDX-License-Identifier: BSD-3-Clause
"""What a measurement of the Earth rate found, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from allanite.experiments.earth_rate.checks import RateCheck, failures
from allanite.experiments.earth_rate.verdict import NoiseOrigin, RateCheckKind, RateRemark
from allanite.experiments.reversals import Reversals
from allanite.experiments.reversals.sides import is_vertical
from allanite.experiments.reversals.turned_over import TurnedOver
from allanite.plain_files.counted import plural
from allanite.quantities.earth import DEG_H, EARTH_RATE
from allanite.quantities.residual_tests import SEEN, grave, inflation_of
from allanite.quantities.units import STANDARD_GRAVITY

__all__ = [
    "WITH_GRAVITY",
    "constant",
    "contradicted",
    "distance",
    "excluded",
    "gravity",
    "not_turned",
    "of_failures",
    "of_the_first",
    "of_turns",
    "one_direction",
    "other_way",
    "resolved",
    "too_small",
    "widened_words",
]

WITH_GRAVITY = (
    "turning the axis over also reverses gravity along it: the result is the sum of the Earth rate and the "
    "g-sensitivity of the axis. State the g-sensitivity (--g-sensitivity 0.1deg/h/g) to separate them"
)
_MORE_DIRECTIONS = "for an axis in three directions or more use allanite north, with their headings"


# -- the reason ---------------------------------------------------------------------------------------------


def distance(rate: float, sd: float, inflation: float) -> str:
    """How many standard deviations there are between the rate and zero."""
    wider = "" if inflation == 1 else f" (widened {inflation:.2f} times)"
    return f"{abs(rate) / sd:.1f} standard deviations{wider}"


def resolved(far: str, *, with_gravity: bool) -> str:
    """Why a rate is resolved: it is `far` from zero."""
    together = "; but it is the sum of the Earth rate and the g-sensitivity of the axis"
    return f"{far} from zero, and the interval includes the known rate{together if with_gravity else ''}"


def too_small(far: str, checks: Sequence[RateCheck], *, few: bool) -> str:
    """Why a rate is not resolved: it is only `far` from zero. With `few` dwells more is needed."""
    more = ", and more because few dwells give the noise" if few else ""
    quiet = "".join(f"; {c.says}" for c in failures(checks) if c.widens and c.ratio < 1)
    return f"the rate is {far} from zero; {SEEN:g} are required{more}{quiet}"


def contradicted(checks: Sequence[RateCheck]) -> str:
    """Which checks contradict the noise model."""
    first, *others = grave(failures(checks))
    also = f" (also: {', '.join(c.name for c in others)})" if others else ""
    more = f"; {_MORE_DIRECTIONS}" if first.kind is RateCheckKind.SCATTER else ""
    return f"the residuals contradict the noise model: {first.says}{more}{also}"


def excluded(interval: tuple[float, float], deviation: float, cause: str) -> str:
    """Why a rate is not that of the Earth; `cause` is named before all others."""
    low, high = (end / DEG_H for end in interval)
    return (
        f"the interval {low:.2f} to {high:.2f} deg/h excludes the known {EARTH_RATE / DEG_H:.3f} deg/h "
        f"({abs(deviation):.1f} standard deviations). Possible causes: {cause}an error that follows the turns, "
        "the scale factor, the latitude, or the direction of the first dwell"
    )


def not_turned(*, vertical: bool) -> str:
    """Why an axis that sees no rate may not have been turned between the two directions."""
    if vertical:
        return "an axis that was not turned or lies level, full turns instead of half turns, "
    return "an axis that was not turned or points east and west, full turns instead of half turns, "


def other_way(first: str) -> str:
    """That the rate is minus that of the Earth, and how the first dwell comes to be the opposite one."""
    opposite = {"north": "south", "south": "north", "up": "down", "down": "up"}.get(first, "the other way")
    return f"the first dwell points {opposite} (--first is the direction at --from, where that is given), "


def gravity(g_sensitivity: float, sd: float) -> str:
    """The g-sensitivity that would explain the rate of a vertical axis."""
    value, its_sd = (x / DEG_H * STANDARD_GRAVITY for x in (g_sensitivity, sd))
    return f"a g-sensitivity of {value:.3g} deg/h/g (standard deviation {its_sd:.2g}), "


def one_direction(reversals: Reversals) -> str:
    """Why a record with turns tells no rate."""
    known = any(d.sign for d in reversals.dwells)
    left = "dwells of one direction only" if known else "no dwell of known direction"
    return f"{plural(len(reversals.turns), 'turn', 'leave')} {left}: rate and bias cannot be separated"


def constant(bias: tuple[float, float], source: NoiseOrigin, first: str, latitude: float) -> str:
    """Why a record without turns tells no rate, and the bias for each direction that the axis may have had."""
    level, sd = (x / DEG_H for x in bias)
    least = " or more, since the noise was fitted to this record" if source is NoiseOrigin.RECORD else ""
    digits = max(0, 1 - math.floor(math.log10(sd))) if 0 < sd < math.inf else 2
    parts = (f"{level - part / DEG_H:.{digits}f} {words}" for part, words in _directions(first, latitude))
    return (
        f"without reversals no filter separates rate and bias: their sum is {level:.{digits}f} deg/h (standard "
        f"deviation {sd:.2g}{least}). With the known rate the bias is {', '.join(parts)}"
    )


def _directions(first: str, latitude: float) -> list[tuple[float, str]]:
    """What the axis would see of the Earth [rad/s], by the direction that it may have had; up and down where said."""
    north, up = (EARTH_RATE * part(latitude) for part in (math.cos, math.sin))
    if is_vertical(first):
        return [(up, "deg/h if the axis points up"), (-up, "if down")]
    return [
        (north, "deg/h if the axis points north"),
        (-north, "if south"),
        (0.0, "if east or west"),
        (up, "if up"),
        (-up, "if down"),
    ]


def widened_words(inflation: float, checks: Sequence[RateCheck]) -> str:
    """Why the noise is widened; "" where it is not."""
    if inflation <= 1:
        return ""
    asked = inflation_of(checks) > 0.999 * inflation
    pairs = "the pairs of dwells scatter that much, and the noise model comes from this record alone"
    return f"The noise is widened {inflation:.2f} times: {'see the checks' if asked else pairs}."


# -- advice -------------------------------------------------------------------------------------------------


def of_failures(checks: Sequence[RateCheck]) -> list[str]:
    """What the failed checks say, but for what a drift that is named already makes of the turns."""
    wrong = failures(checks)
    drifts = any(c.kind is RateCheckKind.WARM_UP for c in wrong)
    return [c.says for c in wrong if not (drifts and c.kind is RateCheckKind.ORDER)]


def of_turns(reversals: Reversals, first: str, *, one_sided: bool) -> Iterator[tuple[RateRemark, str]]:
    """What to do where rate and bias are one constant."""
    if one_sided:
        words = "a shorter dead time (--dead-time) or a file of turns (--turns FILE) may give more dwells"
        yield RateRemark.MORE_DWELLS, words
        return
    yield RateRemark.TURN, "turn the sensor by 180 deg and back, at least a few times"
    if not reversals.turns:
        state = ", with --first north, south, up or down" if first == "unknown" else ""
        words = (
            "if it was turned but the signal does not show it, state when: --dwell SECONDS for even intervals, "
            f"otherwise --turns FILE{state}"
        )
        yield RateRemark.STATE_TURNS, words


def of_the_first(
    first: str, over: TurnedOver | None, rate_if_up: float | None
) -> Iterator[tuple[RateRemark, str]]:
    """What to do where the direction of the first dwell is not known, or not what it was said to be."""
    upright = _upright(rate_if_up)
    if over is not None and over.along:
        words = f"{over.says}: the axis was turned between up and down. State it: --first {over.first}"
        yield RateRemark.TURNED_OVER, words
    elif first == "unknown":
        words = (
            "the direction of the first dwell is unknown, so the sign of the rate is arbitrary. State it: --first "
            "north or --first south; if the axis was turned over, between up and down: "
            f"{upright or '--first up or --first down'}"
        )
        yield RateRemark.STATE_FIRST, words
    elif upright:
        yield RateRemark.PERHAPS_OVER, f"if the axis was turned over, between up and down: {upright}"


def _upright(rate_if_up: float | None) -> str:
    """The rate that a vertical axis would make of it."""
    if rate_if_up is None:
        return ""
    up = rate_if_up / DEG_H
    return f"with --first up it is {up:.1f} deg/h, with --first down {-up:.1f} deg/h"
