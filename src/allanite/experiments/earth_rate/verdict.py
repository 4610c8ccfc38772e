# SPDX-License-Identifier: BSD-3-Clause
"""What a measurement of the Earth rate comes to: the codes of its verdict, its checks and its remarks."""

from __future__ import annotations

from enum import StrEnum

from allanite.quantities.verdict import Tone, Verdict

__all__ = ["EarthRateVerdict", "NoiseOrigin", "RateCheckKind", "RateRemark"]


class EarthRateVerdict(Verdict):
    """Is the number a measurement of the Earth's rotation?"""

    INCONSISTENT = "inconsistent", "inconsistent", Tone.FATAL
    CONTRADICTS = "inconsistent with Earth", "inconsistent with Earth", Tone.FATAL
    NOT_SEPARABLE = "not separable", "not separable", Tone.WARNING
    WITH_GRAVITY = "not separable from g-sensitivity", "not separable from g-sensitivity", Tone.WARNING
    NOT_RESOLVED = "not resolved", "not resolved", Tone.WARNING
    RESOLVED = "resolved", "resolved", Tone.GOOD


class NoiseOrigin(StrEnum):
    """Where the noise model comes from."""

    GIVEN = "given"
    RECORD = "this record"


class RateCheckKind(StrEnum):
    """What is asked of the residuals."""

    SIZE = "size"
    WARM_UP = "warm-up"
    SETTLING = "settling"
    TEMPERATURE = "temperature"
    SCATTER = "scatter"
    CONSTANCY = "constancy"
    ORDER = "order"


class RateRemark(StrEnum):
    """What is to be known or done, beside the checks that did not pass."""

    TURN = "turn the sensor"
    STATE_TURNS = "state the turns"
    MORE_DWELLS = "get more dwells"
    WITH_GRAVITY = "state the g-sensitivity"
    TURNED_OVER = "was turned over"
    STATE_FIRST = "state the first direction"
    PERHAPS_OVER = "perhaps turned over"
    SETTLING = "perhaps a settling"
    UNDECIDED = "noise family undecided"
