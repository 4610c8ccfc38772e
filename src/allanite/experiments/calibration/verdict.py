# SPDX-License-Identifier: BSD-3-Clause
"""What a self-calibration comes to: the codes of its verdict, its parameters, its checks and its remarks."""

from __future__ import annotations

from enum import StrEnum

from allanite.quantities.verdict import Tone, Verdict, WordedCode

__all__ = [
    "CalibrationCheckKind",
    "CalibrationNoise",
    "CalibrationRemark",
    "CalibrationVerdict",
    "ParameterNeed",
    "ParameterStatus",
]


class CalibrationVerdict(Verdict):
    """Is the unit calibrated?"""

    INCONSISTENT = "inconsistent", "inconsistent", Tone.FATAL
    NOT_CALIBRATED = "not calibrated", "not calibrated", Tone.FATAL
    PARTLY = "partly calibrated", "partly calibrated", Tone.WARNING
    CALIBRATED = "calibrated", "calibrated", Tone.GOOD


class ParameterStatus(StrEnum):
    """What the positions say of a parameter."""

    ESTIMATED = "estimated"
    ASSUMED = "assumed"
    NOT_RESOLVED = "not resolved"


class ParameterNeed(WordedCode):
    """What a parameter needs that is no certain position."""

    FORCE = (
        "accelerometers",
        (
            "gyros alone do not show their scale factors and misalignments: record the accelerometers too, or use a "
            "rate table"
        ),
    )
    TURNS = (
        "turns",
        (
            "only turns show the scale factors and misalignments of gyros, and none was recorded: let one log run "
            "while you turn the unit from position to position, or use a rate table"
        ),
    )
    POSITIONS = (
        "more positions",
        "record more positions: these are too few to estimate their scatter",
    )


class CalibrationNoise(StrEnum):
    """What tells the noise."""

    GIVEN = "given"
    RECORD = "this record"
    TABLE = "standard deviations of the table"
    SCATTER = "scatter of the positions"


class CalibrationCheckKind(StrEnum):
    """What is asked of the residuals."""

    FORCES = "scatter of the accelerometers at rest"
    RATES = "scatter of the gyros at rest"
    TURNS = "scatter of the turns"
    EARTH = "rate of the Earth"
    ALONE = "accelerometers alone"


class CalibrationRemark(StrEnum):
    """What a reader must know."""

    SD = "standard deviations of the table"
    IN_HAND = "held in the hand"
    GRAVITY = "standard gravity"
    NO_LATITUDE = "no latitude"
    NO_HEADINGS = "headings not known"
    FOLLOWS_GRAVITY = "biases follow gravity"
    TURNS = "turns not used"
    POSITIONS = "positions not used"
    SCATTER = "noise from the scatter"
