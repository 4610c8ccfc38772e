# SPDX-License-Identifier: BSD-3-Clause
"""The verdict on a search for north, with its reason and advice; and the checks of the residuals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from allanite.quantities.earth import DEG_H
from allanite.quantities.residual_tests import SEEN, ResidualTest, alarm, grave

if TYPE_CHECKING:
    from allanite.experiments.north.results import NorthEstimate

__all__ = [
    "REASONS",
    "advice_of",
    "drift_check",
    "judge",
]

#: What makes positions scatter.
REASONS = "an error changes from position to position (heading, tilt, residual rotation, a bias by position)"


def drift_check(chi2: float) -> ResidualTest:
    """Does the vector change through the record?"""
    return alarm(
        "constancy of the heading",
        chi2,
        2,
        "the Earth's rotation seems to move or to grow through the record: the table turned against the ground, or its "
        "rate or its headings are not what was given",
    )


def advice_of(checks: Sequence[ResidualTest]) -> tuple[str, ...]:
    """What the failed checks say."""
    return tuple(c.says for c in checks if not c.passed)


def judge(estimate: NorthEstimate, rank: int) -> tuple[str, str, tuple[str, ...]]:
    """Verdict, reason and advice."""
    advice = advice_of(estimate.checks)
    bad = grave(estimate.checks)
    if rank < 2:
        return _undetermined(estimate, rank, advice)
    if bad:
        names = ", ".join(c.name for c in bad)
        return "inconsistent", f"the residuals contradict the noise model ({names}): {bad[0].says}", advice
    low, high = (x / DEG_H for x in estimate.horizontal_interval)
    expected = estimate.expected_rate / DEG_H
    size = f"{estimate.signal_to_noise:.4g} standard deviations" + (
        "" if estimate.inflation == 1 else f", widened {estimate.inflation:.2f} times,"
    )
    excluded = not low <= expected <= high
    if any(arc.full for arc in estimate.interval):
        reason = f"the horizontal rate is {size} from zero: every direction is possible"
        if excluded:
            reason += (
                f", and at most {high:.3g} of the Earth's {expected:.4g} deg/h is there: the table did not turn, or "
                "the axes are not horizontal"
            )
        return "no north", reason, (*advice, *(() if excluded else ("record for longer, with more turns",)))
    if excluded:
        reason = (
            f"the horizontal rate, {low:.4g} to {high:.4g} deg/h, excludes the {expected:.4g} deg/h that the latitude "
            "gives: scale factor, latitude, tilt, headings, or a bias that follows the turns"
        )
        return "inconsistent with Earth", reason, advice
    if estimate.signal_to_noise < SEEN:
        return "not resolved", f"the horizontal rate is {size} from zero, {SEEN:g} are needed", advice
    return "north found", f"{size} from zero, and the horizontal rate is that of the Earth", advice


def _undetermined(
    estimate: NorthEstimate, rank: int, advice: tuple[str, ...]
) -> tuple[str, str, tuple[str, ...]]:
    if rank == 0:
        reason = (
            "the axis kept its direction: bias and Earth are one constant, and every direction is possible"
        )
        return (
            "no north",
            reason,
            (*advice, "turn the table to at least three positions, or two with two axes"),
        )
    more = (
        *advice,
        "a second axis across the first, or positions that do not lie on one line, decide between the two",
    )
    limitation = (
        "two axes are required, or positions not on one line: opposite positions of one axis see one component of the "
        "Earth's rotation only"
    )
    if not estimate.interval:
        return (
            "inconsistent with Earth",
            f"{limitation}, and it is more than the Earth gives at this latitude",
            more,
        )
    azimuths = " or ".join(f"{math.degrees(a):.3g}" for a in estimate.candidates)
    return "not resolved", f"{limitation}. Under the known rate the azimuth is {azimuths} deg", more
