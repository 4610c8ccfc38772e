# SPDX-License-Identifier: BSD-3-Clause
"""What may be said of an alignment, with its reason and advice."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from allanite.experiments.alignment.directions import largest_sd
from allanite.experiments.alignment.questions import TURNS
from allanite.experiments.alignment.results import AlignmentEstimate, fixed
from allanite.experiments.north.circle import CIRCLE
from allanite.quantities.earth import DEG_H, EARTH_RATE
from allanite.quantities.residual_tests import SEEN, ResidualTest, grave

__all__ = ["CALIBRATE", "CERTAIN", "SMALL_BIAS", "TURN", "Outlook", "judge"]

#: Confidence at which a horizontal rate that is not the Earth's takes the heading away: of good records one in a
#: thousand.
CERTAIN = 0.999
#: What one attitude shows beyond this may be a slow, even rotation [rad/s].
SLOW_TURN = math.radians(0.1)
#: Biases that show to be below the Earth's horizontal rate over this may point by it without their being known.
SMALL_BIAS = 10.0
#: Cosine between the downwards of the unit and the true one: below, it lies on its back.
UPSIDE_DOWN = -0.7
TURN = "turn the unit by 180 deg about the vertical, or through several positions: that tells the biases from the Earth"
CALIBRATE = "or calibrate the biases of the gyros (allanite calibrate) and say how well they repeat"

_NOMINAL = (
    "scale factors and misalignments are taken as nominal, and the biases of the accelerometers as zero: their errors "
    "are not in the intervals"
)
_NO_BIAS = (
    "nothing is known of the biases of the gyros, and one attitude cannot show them: across the heading they are taken "
    "to be no larger than the length and the vertical part of the rotation show them to be"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outlook:
    """What the verdict rests on besides the estimate.

    Attributes
    ----------
    one_attitude : bool
    apparent : float [rad/s]
        Length of what the gyros show in the longest stand.
    excluded : bool
        The horizontal rate is not that of the Earth, at `CERTAIN`.
    bias : float [rad/s]
        Of one attitude: size of the biases by the length and the vertical part of the rotation; NaN of several.
    assumed : bool
        The biases were taken to be as large as that, for nothing was known of them.
    lost : int
        Stretches that no turn connects.
    remarks : tuple of str
    """

    one_attitude: bool
    apparent: float
    excluded: bool = False
    bias: float = math.nan
    assumed: bool = False
    lost: int = 0
    remarks: tuple[str, ...] = ()


def judge(estimate: AlignmentEstimate, outlook: Outlook) -> AlignmentEstimate:
    """The same with verdict, reason, advice and statement; no heading where there is none."""
    verdict, reason, advice = _verdict(estimate, outlook)
    failed = tuple(c.says for c in estimate.checks if not c.passed and c.says not in reason)
    hidden = verdict == "no north" or estimate.interval.full or _refuted(estimate, outlook)
    statements = [] if estimate.calibrated else [_NOMINAL]
    if verdict == "bias not known":
        statements.insert(0, _NO_BIAS)
    more = (*failed, *_remarks(estimate, outlook, hidden))
    judged = replace(
        estimate, verdict=verdict, reason=reason, advice=(*advice, *more), statement="; ".join(statements)
    )
    return _without_heading(judged) if hidden else judged


def _refuted(estimate: AlignmentEstimate, outlook: Outlook) -> bool:
    """One attitude points by what is known of the biases: that is wrong, and they are too large to do without."""
    wrong = outlook.excluded or bool(_bad(estimate))
    return outlook.one_attitude and wrong and SMALL_BIAS * outlook.bias >= estimate.expected_rate


def _remarks(estimate: AlignmentEstimate, outlook: Outlook, hidden: bool) -> list[str]:
    out = list(outlook.remarks)
    if outlook.lost:
        which = "one stretch" if outlook.lost == 1 else f"{outlook.lost} stretches"
        out.append(
            f"{which} at rest at the beginning {'was' if outlook.lost == 1 else 'were'} left out: samples are missing "
            "while the unit was turned, so that no azimuth connects what lies before to the rest"
        )
    if estimate.naive is not None and estimate.naive.flagged and not hidden:
        out.append(
            f"the plain mean of the first {estimate.naive.duration:.0f} s would have said "
            f"{math.degrees(estimate.naive.heading):.1f} deg: do not use it, for {estimate.naive.says}"
        )
    if estimate.stands and all(math.cos(s.roll) * math.cos(s.pitch) < UPSIDE_DOWN for s in estimate.stands):
        out.append(
            f"the unit lies on its back all the time: do its axes x, y, z point {estimate.axes} (--axes)?"
        )
    return out


def _without_heading(estimate: AlignmentEstimate) -> AlignmentEstimate:
    """Nor one among what stands beside it, where somebody would take it from."""
    ends = {
        name: replace(getattr(estimate, name), heading=math.nan, heading_sd=math.inf, interval=CIRCLE)
        for name in ("first", "last")
    }
    coarse = tuple(replace(c, heading=math.nan) for c in estimate.coarse)
    naive = None if estimate.naive is None else replace(estimate.naive, heading=math.nan)
    n = len(estimate.running.time)
    nothing = {name: fixed(np.full(n, math.nan)) for name in ("heading", "start")}
    wide = {"sd": fixed(np.full(n, math.inf)), "width": fixed(np.full(n, CIRCLE.width))}
    running = replace(estimate.running, **nothing, **wide)
    return replace(estimate, **ends, coarse=coarse, naive=naive, running=running, budget={})


def _verdict(estimate: AlignmentEstimate, outlook: Outlook) -> tuple[str, str, tuple[str, ...]]:
    if not math.isfinite(estimate.horizontal_covariance[0, 0]):
        return _inseparable(estimate, outlook)
    if _hides(estimate, outlook):
        return _hidden(estimate, outlook)
    bad, turn = _bad(estimate), (TURN,) if outlook.one_attitude else ()
    if estimate.interval.full or estimate.signal_to_noise < SEEN or _expected(estimate) < SEEN:
        # what widened everything until nothing is left is the reason, not the noise
        return _torn(estimate, bad[0]) if bad and _widened(estimate) else _too_weak(estimate)
    if bad:
        return "inconsistent", f"{bad[0].name}: {bad[0].says}", turn
    if outlook.excluded:
        reason = (
            f"{_rate_words(estimate)}: biases larger than was said, scale factor, latitude, leveling, or a unit that "
            "was not at rest"
        )
        return "inconsistent with Earth", reason, turn
    if outlook.assumed:
        reason = (
            f"{math.degrees(estimate.heading):.2f} deg if the biases are small: length and vertical part of the "
            f"rotation agree with the Earth to {outlook.bias / DEG_H:.2g} deg/h, but a bias across the heading "
            "is not seen"
        )
        advice = "state how well the biases are known (bias_repeatability, --gyro-bias)"
        return "bias not known", reason, (advice, TURN)
    size = f"{estimate.signal_to_noise:.4g} standard deviations from zero"
    return "resolved", f"{size}, and the horizontal rate is that of the Earth", ()


def _bad(estimate: AlignmentEstimate) -> list[ResidualTest]:
    return grave([c for c in estimate.checks if c.name != TURNS])


def _widened(estimate: AlignmentEstimate) -> bool:
    """Could the sensors tell by their noise?"""
    return _expected(estimate) * estimate.inflation >= SEEN


def _torn(estimate: AlignmentEstimate, check: ResidualTest) -> tuple[str, str, tuple[str, ...]]:
    return "no north", f"{check.says}; that leaves {_left(estimate)}", ()


def _left(estimate: AlignmentEstimate) -> str:
    sd = largest_sd(estimate.horizontal_covariance) / DEG_H
    earth = estimate.expected_rate / DEG_H
    return (
        f"{sd:.3g} deg/h (1 sd) in the horizontal rate, of which the Earth is {earth:.4g} deg/h; "
        f"{SEEN:g} standard deviations are needed"
    )


def _rate_words(estimate: AlignmentEstimate) -> str:
    low, high = (x / DEG_H for x in estimate.horizontal_interval)
    return (
        f"the horizontal rate, {low:.4g} to {high:.4g} deg/h, is not the {estimate.expected_rate / DEG_H:.4g} deg/h "
        "that the latitude gives"
    )


def _hides(estimate: AlignmentEstimate, outlook: Outlook) -> bool:
    """Is what the gyros show beside the Earth as large as the Earth?"""
    if outlook.one_attitude:
        return (outlook.excluded or bool(_bad(estimate))) and outlook.bias >= estimate.expected_rate
    return outlook.excluded and estimate.horizontal_interval[0] > 2 * estimate.expected_rate


def _hidden(estimate: AlignmentEstimate, outlook: Outlook) -> tuple[str, str, tuple[str, ...]]:
    earth = f"the Earth's horizontal rate is {estimate.expected_rate / DEG_H:.4g} deg/h"
    if outlook.one_attitude:
        reason = (
            f"the biases of the gyros are not what was said of them: length and vertical part of what they show are "
            f"off by {outlook.bias / DEG_H:.3g} deg/h, and {earth}"
        )
        return "no north", reason, (TURN, CALIBRATE)
    reason = (
        f"{_rate_words(estimate)}: something that changes with the attitude of the gyros, or with time, is larger than "
        "the Earth's rotation"
    )
    return (
        "no north",
        reason,
        ("rest for longer in each position, and let the unit warm up; or take better gyros",),
    )


def _inseparable(estimate: AlignmentEstimate, outlook: Outlook) -> tuple[str, str, tuple[str, ...]]:
    apparent, earth = outlook.apparent / DEG_H, EARTH_RATE / DEG_H
    if outlook.one_attitude:
        excess = abs(apparent - earth)
        reason = (
            f"one attitude, and nothing is known of the biases of the gyros: what they show, {apparent:.4g} deg/h, "
            f"holds biases of {excess:.3g} deg/h or more, and the Earth is {earth:.4g} deg/h"
            if excess > 0.1 * earth
            else "one attitude, and nothing is known of the biases of the gyros: any heading is possible"
        )
    else:
        reason = "the attitudes do not tell the biases of the gyros from the Earth's rotation"
    advice = (TURN, CALIBRATE)
    if outlook.one_attitude and outlook.apparent > SLOW_TURN:
        return (
            "no north",
            reason,
            (*advice, "if the unit turned all the time, say so (rotation=True, --rotating)"),
        )
    return "no north", reason, advice


def _expected(estimate: AlignmentEstimate) -> float:
    """The Earth's horizontal rate in standard deviations of the worse direction: what these sensors can tell.

    A vector of noise alone is long enough at times. Whether a heading is given depends on the sensors, not on luck.
    """
    worst = largest_sd(estimate.horizontal_covariance)
    return estimate.expected_rate / worst if worst > 0 else math.inf


def _too_weak(estimate: AlignmentEstimate) -> tuple[str, str, tuple[str, ...]]:
    contributions = {n: v for n, v in estimate.budget.items() if n != "together"}
    source = max(contributions, key=lambda n: contributions[n]) if contributions else "gyro noise"
    words = {
        "gyro noise": ("the noise of the gyros leaves", ("record for longer, or with gyros of less noise",)),
        "gyro bias": ("the biases of the gyros leave", (TURN, CALIBRATE)),
        "turns": ("the azimuth of the turns leaves", ("turn faster, and rest for longer between the turns",)),
    }
    cause, advice = words.get(source, (f"the {source} leaves", ()))
    reason = f"{cause} {_left(estimate)}"
    if _expected(estimate) >= SEEN:  # the sensors could see it, and did not
        evidence = f"the horizontal rate is {estimate.signal_to_noise:.3g} standard deviations from zero"
        return "no north", f"{evidence}, where the Earth would be {_expected(estimate):.3g}", (
            "is this the right latitude, and do the gyros work? their axes may not see the ground turn",
        )  # fmt: skip
    return "no north", reason, advice
