# SPDX-License-Identifier: BSD-3-Clause
"""What a record says of the environment of a sensor: the verdict, and the answers to single questions."""

from __future__ import annotations

from allanite.quantities.verdict import Tone, Verdict, WordedCode

__all__ = ["CoefficientCause", "EnvironmentVerdict", "HysteresisStatus", "LagStatus"]


class EnvironmentVerdict(Verdict):
    """Does the temperature act on the sensor? Without a thermometer: did it warm up?"""

    NOT_SEPARABLE = "not separable", "not separable", Tone.WARNING
    NOT_RESOLVED = "not resolved", "not resolved", Tone.WARNING
    WARM_UP = "warm-up found", "warm-up found", Tone.WARNING
    NO_WARM_UP = "no warm-up", "no warm-up", Tone.GOOD
    RESOLVED = "resolved", "resolved", Tone.GOOD


class CoefficientCause(WordedCode):
    """Why the record says nothing of a coefficient, or less than its interval."""

    CONSTANT = "constant", "the temperature was constant, as far as its thermometer tells"
    STRAIGHT = (
        "straight",
        "the temperature is a straight line in time: a drift of the sensor explains it as well",
    )
    COLLINEAR = "collinear", "it cannot be told from the temperature itself in this record"
    DRIFT = (
        "drift",
        "without a drift of the sensor itself it would be resolved: the temperature went with time",
    )


class LagStatus(WordedCode):
    """Does the thermometer follow behind the sensor?"""

    RESOLVED = "resolved", "a bias that depends on the rate of the temperature looks the same"
    NO_LAG = "no lag seen", "the thermometer follows the sensor without a lag that the record shows"
    COLLINEAR = (
        "collinear",
        "the rate of the temperature cannot be told from the temperature itself in this record",
    )
    TOO_SMALL = "too small", "the effect of the temperature is too small in the noise to show a lag"


class HysteresisStatus(WordedCode):
    """Do warming and cooling differ at one temperature?"""

    FOUND = "found", "warming and cooling differ at one temperature, beyond what a lag would do"
    NOT_FOUND = "not found", "warming and cooling do not differ, as far as the record tells"
    ONE_WAY = "one way", "the temperature went one way only"
    LITTLE_IN_COMMON = "little in common", "warming and cooling have too few temperatures in common"
    COLLINEAR = "collinear", "the branches cannot be told from the temperature and its rate in this record"
