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

    CONSTANT = "constant", "the temperature was constant within the noise of its thermometer"
    STRAIGHT = (
        "straight",
        "the temperature is linear in time: a drift of the sensor fits as well",
    )
    COLLINEAR = "collinear", "this record cannot separate it from the temperature itself"
    DRIFT = (
        "drift",
        "without a drift of the sensor it would be resolved: the temperature changed steadily with time",
    )


class LagStatus(WordedCode):
    """Does the thermometer lag behind the sensor?"""

    RESOLVED = "resolved", "a bias that depends on the rate of temperature change looks the same"
    NO_LAG = "no lag seen", "the record shows no lag between thermometer and sensor"
    COLLINEAR = (
        "collinear",
        "this record cannot separate the rate of temperature change from the temperature itself",
    )
    TOO_SMALL = "too small", "the effect of the temperature is too small to show a lag"


class HysteresisStatus(WordedCode):
    """Do warming and cooling differ at one temperature?"""

    FOUND = "found", "warming and cooling differ at the same temperature, by more than a lag explains"
    NOT_FOUND = "not found", "the record shows no difference between warming and cooling"
    ONE_WAY = "one way", "the temperature changed in one direction only"
    LITTLE_IN_COMMON = "little in common", "warming and cooling share too few temperatures"
    COLLINEAR = "collinear", "this record cannot separate the branches from the temperature and its rate"
