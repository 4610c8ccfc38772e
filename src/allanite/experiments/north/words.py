# SPDX-License-Identifier: BSD-3-Clause
"""What a search for north and the null test come to, in sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence

from allanite.experiments.north.checks import NorthCheck
from allanite.experiments.north.verdict import NorthRemark
from allanite.quantities.earth import DEG_H
from allanite.quantities.residual_tests import SEEN, grave

__all__ = [
    "BEYOND_EARTH",
    "KEPT_DIRECTION",
    "NO_TURNS",
    "REMARKS",
    "contradicted",
    "excluded",
    "follows",
    "no_bias",
    "nowhere",
    "resolved",
    "too_small",
    "two_azimuths",
]

REMARKS = {
    NorthRemark.TURN: "turn the table to at least three positions, or two with two axes",
    NorthRemark.SECOND_AXIS: (
        "a second axis across the first, or positions that are not on one line, decide between the two"
    ),
    NorthRemark.LONGER: "record longer, with more turns",
}
KEPT_DIRECTION = (
    "the axis kept its direction: bias and Earth rate cannot be separated, and every direction is possible"
)
_ONE_COMPONENT = (
    "two axes are required, or positions not on one line: opposite positions of one axis see only one component of the "
    "Earth's rotation"
)
BEYOND_EARTH = f"{_ONE_COMPONENT}, and it exceeds the Earth's rate at this latitude"
NO_TURNS = "without turns between east and west the bias and its change cannot be separated"


def contradicted(checks: Sequence[NorthCheck]) -> str:
    """Which checks contradict the noise model."""
    bad = grave(checks)
    names = ", ".join(c.name for c in bad)
    return f"the residuals contradict the noise model ({names}): {bad[0].says}"


# -- north --------------------------------------------------------------------------------------------------


def two_azimuths(candidates: Sequence[float]) -> str:
    """Why one component tells two directions, or one where they are the same."""
    azimuths = " or ".join(f"{math.degrees(a):.3g}" for a in candidates)
    return f"{_ONE_COMPONENT}. With the known rate the azimuth is {azimuths} deg"


def _distance(signal_to_noise: float, inflation: float) -> str:
    widened = "" if inflation == 1 else f" (widened {inflation:.2f} times)"
    return f"{signal_to_noise:.4g} standard deviations{widened}"


def nowhere(signal_to_noise: float, inflation: float, most: float, expected: float, *, excludes: bool) -> str:
    """Why every direction is possible; whether the interval, `most` at its upper end, `excludes` the Earth."""
    reason = f"the horizontal rate is {_distance(signal_to_noise, inflation)} from zero: every direction is possible"
    if not excludes:
        return reason
    return (
        f"{reason}, and it is at most {most / DEG_H:.3g} deg/h where the Earth's is {expected / DEG_H:.4g}: the table "
        "did not turn, or the axes are not horizontal"
    )


def excluded(low: float, high: float, expected: float) -> str:
    """Why the horizontal rate is not that of the Earth."""
    return (
        f"the horizontal rate, {low / DEG_H:.4g} to {high / DEG_H:.4g} deg/h, excludes the {expected / DEG_H:.4g} "
        "deg/h expected at this latitude: scale factor, latitude, tilt, headings, or a bias that follows the turns"
    )


def too_small(signal_to_noise: float, inflation: float) -> str:
    """Why north is not resolved."""
    return f"the horizontal rate is {_distance(signal_to_noise, inflation)} from zero; {SEEN:g} are required"


def resolved(signal_to_noise: float, inflation: float) -> str:
    """Why the azimuth is one of north."""
    return (
        f"{_distance(signal_to_noise, inflation)} from zero, and the horizontal rate agrees with the Earth's"
    )


# -- null test ----------------------------------------------------------------------------------------------


def _bias(value: float, sd: float) -> str:
    value, sd = value / DEG_H, sd / DEG_H
    digits = max(0, 1 - math.floor(math.log10(sd))) if 0 < sd < math.inf else 2
    return f"{value:.{digits}f} +- {sd:.2g} deg/h (1 sd)"


def no_bias(value: float, sd: float, limit: float) -> str:
    """Up to where a bias that follows the turns is excluded."""
    return f"none above {limit / DEG_H:.3g} deg/h; the turns give {_bias(value, sd)}"


def follows(value: float, sd: float, error_of_rate: float) -> str:
    """What a bias that follows the turns does to an Earth rate."""
    return (
        f"{_bias(value, sd)} reverses between east and west, where the Earth adds nothing: an Earth rate measured with "
        f"these turns may be wrong by {error_of_rate / DEG_H:.3g} deg/h"
    )
