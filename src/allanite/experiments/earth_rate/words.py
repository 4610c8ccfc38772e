# SPDX-License-Identifier: BSD-3-Clause
"""What a measurement of the Earth rate found, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from allanite.experiments.earth_rate.quantile import needs_more
from allanite.experiments.earth_rate.verdict import (
    EarthRateVerdict,
    NoiseOrigin,
    RateCheckKind,
    RateRemark,
    failures,
)
from allanite.experiments.reversals.sides import is_vertical
from allanite.plain_files.counted import plural
from allanite.quantities.earth import DEG_H, EARTH_RATE
from allanite.quantities.residual_tests import SEEN, grave, inflation_of, scatter_words, size_words
from allanite.quantities.units import STANDARD_GRAVITY
from allanite.recording.channel_names import for_shell

if TYPE_CHECKING:
    from allanite.experiments.earth_rate.results import EarthRateEstimate, RateCheck

__all__ = ["advice", "check_name", "check_says", "reason", "remarked", "widened_words"]

_NAMES = {
    RateCheckKind.SIZE: "size of the noise",
    RateCheckKind.SCATTER: "scatter of the dwells",
    RateCheckKind.CONSTANCY: "constancy of the rate",
    RateCheckKind.ORDER: "order of the turns",
}


# -- checks -------------------------------------------------------------------------------------------------


def check_name(check: RateCheck) -> str:
    """What was asked; of a temperature its channel."""
    return check.channel or _NAMES.get(check.kind, check.kind)


def check_says(check: RateCheck) -> str:
    """What it means and what to do, when it did not pass."""
    match check.kind:
        case RateCheckKind.SIZE:
            return size_words(check.ratio)
        case RateCheckKind.WARM_UP:
            return (
                "the level drifts as after power-on, beyond what the noise model allows: wait longer before the record "
                "begins, or fit the warm-up beside the rate (--warm-up)"
            )
        case RateCheckKind.SETTLING:
            return (
                "a rotation in the direction of the turn goes on after it and adds to the rate: leave out more time "
                "after each turn (--dead-time), or fit it beside the rate (--settling)"
            )
        case RateCheckKind.TEMPERATURE:
            name = check.channel
            return (
                f"the level follows the temperature: fit it beside the rate (--temperature {for_shell(name)})"
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
                f"from {check.at:.0f} s on the alternation is another: a turn was missed or counted twice there; "
                "correct it with a file of turns"
            )


# -- the reason ---------------------------------------------------------------------------------------------


def reason(estimate: EarthRateEstimate) -> str:
    """Why the verdict is what it is, in one or two sentences."""
    match estimate.verdict:
        case EarthRateVerdict.NOT_SEPARABLE:
            return _one_constant(estimate)
        case EarthRateVerdict.INCONSISTENT:
            first, *others = grave(failures(estimate.checks))
            also = f" (also: {', '.join(c.name for c in others)})" if others else ""
            return f"the residuals contradict the noise model: {first.says}{also}"
        case EarthRateVerdict.NOT_RESOLVED:
            return _too_small(estimate)
        case EarthRateVerdict.CONTRADICTS:
            return _excluded(estimate)
    together = (
        "; but it is the rate of the Earth and the g-sensitivity of the axis together"
        if estimate.verdict is EarthRateVerdict.WITH_GRAVITY
        else ""
    )
    return f"{_size(estimate)} from zero, and the interval holds the known rate{together}"


def _size(estimate: EarthRateEstimate) -> str:
    """How many standard deviations there are between the rate and zero."""
    widened = "" if estimate.inflation == 1 else f", widened {estimate.inflation:.2f} times"
    return f"{abs(estimate.rate) / estimate.total_sd:.1f} standard deviations{widened}"


def widened_words(estimate: EarthRateEstimate) -> str:
    """Why the noise is widened; "" where it is not."""
    if estimate.inflation <= 1:
        return ""
    asked = inflation_of(estimate.checks) > 0.999 * estimate.inflation
    why = (
        "see the checks"
        if asked
        else "the pairs of dwells scatter as much, and the noise is of this record alone"
    )
    return f"The noise is widened {estimate.inflation:.2f} times: {why}."


def _too_small(estimate: EarthRateEstimate) -> str:
    few = " and more, for the noise is known from few dwells"
    more = few if needs_more(estimate.model_source, estimate.n_pairs) else ""
    quiet = "".join(f"; {c.says}" for c in failures(estimate.checks) if c.widens and c.ratio < 1)
    return f"the rate is {_size(estimate)} from zero, {SEEN:g} are needed{more}{quiet}"


def _excluded(estimate: EarthRateEstimate) -> str:
    low, high = (end / DEG_H for end in estimate.interval)
    return (
        f"the interval {low:.2f} to {high:.2f} deg/h excludes the known {EARTH_RATE / DEG_H:.3f} deg/h "
        f"({abs(estimate.deviation):.1f} standard deviations): {_gravity(estimate)}an error that follows the turns, or "
        "the scale factor, the latitude, the direction of the first dwell"
    )


def _gravity(estimate: EarthRateEstimate) -> str:
    """The g-sensitivity that would explain the rate of a vertical axis."""
    needed = estimate.g_sensitivity
    if needed is None:
        return ""
    value, sd = (x / DEG_H * STANDARD_GRAVITY for x in (needed.value, needed.sd))
    return f"a g-sensitivity of {value:.3g} deg/h/g (standard deviation {sd:.2g}), "


def _one_constant(estimate: EarthRateEstimate) -> str:
    turns = estimate.reversals.turns
    if estimate.one_sided:
        known = any(d.sign for d in estimate.reversals.dwells)
        left = "dwells of one direction only" if known else "no dwell of known direction"
        return f"{plural(len(turns), 'turn', 'leave')} {left}: rate and bias are one constant"
    level, sd = (x / DEG_H for x in estimate.bias)
    from_record = estimate.model_source is NoiseOrigin.RECORD
    least = ", at least: the noise was fitted to this very record" if from_record else ""
    digits = max(0, 1 - math.floor(math.log10(sd))) if 0 < sd < math.inf else 2
    constant = f"{level:.{digits}f} deg/h (standard deviation {sd:.2g}{least})"
    biases = [f"{level - part / DEG_H:.{digits}f} {words}" for part, words in _directions(estimate)]
    return (
        f"without reversals the rate and the bias are one constant, {constant}, and no filter tells them apart. Under "
        f"the known rate the bias is {', '.join(biases)}"
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


# -- advice -------------------------------------------------------------------------------------------------


def advice(estimate: EarthRateEstimate) -> tuple[str, ...]:
    """What to do, or to know: what the checks that did not pass say, then the remarks."""
    return (*_of_checks(estimate), *(words for _, words in remarked(estimate)))


def _of_checks(estimate: EarthRateEstimate) -> list[str]:
    """What the failed checks say, but for what a drift that is named already makes of the turns."""
    if estimate.verdict is EarthRateVerdict.NOT_SEPARABLE:
        return []
    failed = failures(estimate.checks)
    drifts = any(c.kind is RateCheckKind.WARM_UP for c in failed)
    return [c.says for c in failed if not (drifts and c.kind is RateCheckKind.ORDER)]


def remarked(estimate: EarthRateEstimate) -> Iterator[tuple[RateRemark, str]]:
    """What is to be known or done beside the checks, each with its code."""
    if estimate.verdict is EarthRateVerdict.NOT_SEPARABLE:
        yield from _of_turns(estimate)
    elif estimate.bounds_sum:
        words = (
            "turning the axis over reverses gravity along it, too: the result bounds the Earth rate and the "
            "g-sensitivity of the axis together. State the g-sensitivity (--g-sensitivity 0.1deg/h/g) to have the "
            "Earth rate by itself"
        )
        yield RateRemark.WITH_GRAVITY, words
    if estimate.reversals.turns and not is_vertical(estimate.first):
        yield from _of_the_first(estimate)
    if fit := estimate.settling:
        words = (
            "a rotation that settles after each turn may be the cause, though the residuals alone do not show it: "
            f"fitted beside, with {fit.T:.2g} s, it makes the rate {fit.rate / DEG_H:.2f} deg/h (standard deviation "
            f"{fit.sd / DEG_H:.2g}). Leave out more time after each turn (--dead-time), or fit it (--settling)"
        )
        yield RateRemark.SETTLING, words
    if two := estimate.undecided:
        words = (
            f"the record at rest does not decide between {two.family} and {two.other}; the interval is that of "
            f"{two.family}, the wider one: with {two.other} it would be {100 * two.narrower:.0f} % narrower"
        )
        yield RateRemark.UNDECIDED, words


def _of_turns(estimate: EarthRateEstimate) -> Iterator[tuple[RateRemark, str]]:
    """Where rate and bias are one constant."""
    if estimate.one_sided:
        words = "a shorter dead time (--dead-time), or a file of turns (--turns FILE), may give more dwells"
        yield RateRemark.MORE_DWELLS, words
        return
    yield RateRemark.TURN, "turn the sensor by 180 deg, and back, at least a few times"
    if not estimate.reversals.turns:
        first = ", with --first north, south, up or down" if estimate.first == "unknown" else ""
        words = (
            "if it was turned, and the signal does not show it, say when: --dwell SECONDS for even intervals, else "
            f"--turns FILE{first}"
        )
        yield RateRemark.STATE_TURNS, words


def _of_the_first(estimate: EarthRateEstimate) -> Iterator[tuple[RateRemark, str]]:
    """Where the direction of the first dwell is not known, or not what it was said to be."""
    over, upright = estimate.turned_over, _upright(estimate)
    if over is not None and over.along:
        words = f"{over.says}: the axis was turned between up and down. Say so: --first {over.first}"
        yield RateRemark.TURNED_OVER, words
    elif estimate.first == "unknown":
        words = (
            "the direction of the first dwell is not known: the sign of the rate is a choice. State it: --first north "
            "or --first south; if the axis was turned over, between up and down: "
            f"{upright or '--first up or --first down'}"
        )
        yield RateRemark.STATE_FIRST, words
    elif upright:
        yield RateRemark.PERHAPS_OVER, f"if the axis was turned over, between up and down: {upright}"


def _upright(estimate: EarthRateEstimate) -> str:
    """The rate that a vertical axis would make of it."""
    if estimate.rate_if_up is None:
        return ""
    up = estimate.rate_if_up / DEG_H
    return f"with --first up it is {up:.1f} deg/h, with --first down {-up:.1f} deg/h"
