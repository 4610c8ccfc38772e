# SPDX-License-Identifier: BSD-3-Clause
"""What a plan of positions comes to: the codes of its verdict and its remarks."""

from __future__ import annotations

from enum import StrEnum

from allanite.quantities.verdict import Tone, Verdict

__all__ = ["PositionPlanRemark", "PositionPlanVerdict"]


class PositionPlanVerdict(Verdict):
    """Are the goals reached?"""

    NOT_DETERMINED = "not determined", "goals not reached", Tone.WARNING
    NOT_REACHED = "not reached", "goals not reached", Tone.WARNING
    REACHED = "reached", "goals reached", Tone.GOOD


class PositionPlanRemark(StrEnum):
    """What a reader of the plan must know."""

    OPEN = "parameters not determined"
    NO_WHITE = "no white noise"
    NO_LATITUDE = "no latitude"
    EARTH_UNSEEN = "Earth not seen"
    NO_NORTH = "no north"
    NO_FORCE = "no accelerometers"
