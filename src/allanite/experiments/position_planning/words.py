# SPDX-License-Identifier: BSD-3-Clause
"""What a plan of positions comes to, in sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from allanite.experiments.position_planning.verdict import PositionPlanRemark
from allanite.plain_files.counted import plural

__all__ = [
    "REMARKS",
    "given_time",
    "heading",
    "heading_not_reached",
    "not_determined",
    "not_reached",
    "open_parameters",
    "reached",
]

REMARKS: Mapping[PositionPlanRemark, str] = {
    PositionPlanRemark.NO_WHITE: "a model has no white noise, but every sensor does: the plan is optimistic",
    PositionPlanRemark.NO_LATITUDE: (
        "no latitude is given: the plan assumes 45 deg and an unknown rotation of the Earth"
    ),
    PositionPlanRemark.EARTH_UNSEEN: (
        "these gyros do not resolve the Earth's rotation in this time: it stays in their biases"
    ),
    PositionPlanRemark.NO_NORTH: (
        "these gyros do not resolve the Earth's rotation well enough in this time to give north"
    ),
    PositionPlanRemark.NO_FORCE: "no accelerometer noise is given: the plan assumes perfect accelerometers",
}
_MORE = {"faces": "edges, or all 26 positions", "edges": "corners"}


def _time(seconds: float) -> str:
    return f"{seconds / 60:.3g} min" if seconds >= 120 else f"{seconds:.3g} s"


def open_parameters(names: Sequence[str], candidates: str) -> str:
    """Which parameters stay open, and which further positions may determine them."""
    hint = f": allow {_MORE[candidates]}" if candidates in _MORE else ""
    return f"these positions do not determine {', '.join(names)}{hint}"


# -- a calibration ------------------------------------------------------------------------------------------


def given_time(count: int, total: float, last: str, ratio: float) -> str:
    """How near to the goals positions come in a length of record that was given."""
    near = f"{last} reaches {ratio:.2g} times its goal, all others are closer"
    return f"{plural(count, 'position')} in {_time(total)}: {near}"


def reached(count: int, total: float, last: str, *, shortest: bool) -> str:
    """When the goals are reached, and what takes the time."""
    why = ", with the shortest rests" if shortest else f"; {last} takes the longest"
    return f"{plural(count, 'position', 'reach')} the goals in {_time(total)}{why}"


def not_determined(last: str) -> str:
    """Which goal no position reaches."""
    return f"the goals are not reached: no allowed position determines {last}"


def not_reached(last: str, ratio: float) -> str:
    """Which goal slow noise forbids."""
    return (
        f"the goals are not reached with rests of up to an hour: {last} reaches {ratio:.2g} times its goal, because "
        "slow noise does not average out"
    )


# -- a heading ----------------------------------------------------------------------------------------------


def _wanted(goal: float) -> str:
    return f"a heading to {math.degrees(goal):.3g} deg (one standard deviation)"


def heading_not_reached(goal: float, sd: float) -> str:
    """What is left after the longest record."""
    left = f"after six hours it is {math.degrees(sd):.3g} deg"
    if not math.isfinite(sd):
        left = "the bias of these gyros hides the Earth"
    return f"{_wanted(goal)} is not reached: {left}"


def heading(goal: float, sd: float, total: float, scheme: str, *, given: bool) -> str:
    """When the heading is known, and with which scheme; in a `given` length of record, how well."""
    if given:
        return f"{_time(total)} of {scheme}: a heading to {math.degrees(sd):.3g} deg"
    return f"{_wanted(goal)} is reached after {_time(total)} with {scheme}"
