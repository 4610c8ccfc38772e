# SPDX-License-Identifier: BSD-3-Clause
"""What an alignment comes to: the codes of its verdict, its checks and its remarks."""

from __future__ import annotations

from enum import StrEnum

from allanite.quantities.verdict import Tone, Verdict

__all__ = ["AlignmentCheckKind", "AlignmentRemark", "AlignmentVerdict", "NoNorth"]


class AlignmentVerdict(Verdict):
    """Is the heading a measurement?"""

    INCONSISTENT = "inconsistent", "inconsistent", Tone.FATAL
    CONTRADICTS = "inconsistent with Earth", "inconsistent with Earth", Tone.FATAL
    NO_NORTH = "no north", "no north", Tone.WARNING
    BIAS_UNKNOWN = "bias not known", "bias not known", Tone.WARNING
    RESOLVED = "resolved", "resolved", Tone.GOOD


class NoNorth(StrEnum):
    """Why there is no heading."""

    BIASES = "biases not told from the Earth"
    HIDDEN = "Earth is hidden"
    TORN = "widened by a check"
    WEAK = "uncertainty too large"
    UNSEEN = "Earth not seen"


class AlignmentCheckKind(StrEnum):
    """What is asked of the residuals."""

    SIZE = "size"
    STANDS = "scatter of the stands"
    VERTICAL = "vertical rate"
    GRAVITY = "gravity"
    TURNS = "turns against gravity"
    ACROSS = "scatter across the axis"
    CONSTANCY = "constancy"
    LATITUDE = "latitude"


class AlignmentRemark(StrEnum):
    """What is to be known or done, beside the checks that did not pass."""

    TURN = "turn the unit"
    CALIBRATE = "calibrate the biases"
    ROTATING = "state the rotation"
    WARM_UP = "rest longer and warm up"
    LONGER = "record for longer"
    FASTER = "turn faster"
    DOUBT = "question latitude and gyros"
    STATE_BIAS = "state the biases"
    CHANNELS = "channels of the calibration"
    LOST = "stretches left out"
    NAIVE = "plain mean is wrong"
    UPSIDE_DOWN = "upside down"
    STATE_HEADINGS = "state the headings"
    MIRRORED = "perhaps the other hemisphere"
