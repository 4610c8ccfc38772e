# SPDX-License-Identifier: BSD-3-Clause
"""What a combination comes to: the codes of its verdict, its faults and its remarks."""

from __future__ import annotations

from enum import StrEnum

from allanite.quantities.verdict import Tone, Verdict

__all__ = ["CombinationRemark", "CombinationVerdict", "FaultKind"]


class CombinationVerdict(Verdict):
    """Do the sensors contradict each other?"""

    CONTRADICTION = "sensors contradict each other", "sensors contradict each other", Tone.FATAL
    FAULT = "a sensor is at fault", "a sensor is at fault", Tone.WARNING
    AGREE = "sensors agree", "sensors agree", Tone.GOOD


class FaultKind(StrEnum):
    """What a sensor does that the others do not."""

    STEP = "step"
    DRIFT = "drift"
    SPIKE = "spike"
    NOISE = "noise"
    STUCK = "stuck"
    OTHER = "other"


class CombinationRemark(StrEnum):
    """What is to be known, beside the faults."""

    SHARED = "noise is shared"
    MOTION = "motion looks like shared noise"
    UNUSUAL = "noise unlike the models"
    MOVED = "record not at rest"
    EVERYWHERE = "faults in every window"
    LEFT_OUT = "sensors left out"
    STAYS = "a fault stays in"
