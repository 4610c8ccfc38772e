# SPDX-License-Identifier: BSD-3-Clause
"""What a run on a rate table comes to: the codes of its verdict, its checks and its remarks."""

from __future__ import annotations

from enum import StrEnum

from allanite.quantities.verdict import Tone, Verdict

__all__ = ["TableCheckKind", "TableRemark", "TableVerdict"]


class TableVerdict(Verdict):
    """Is the scale factor one of this sensor?"""

    INCONSISTENT = "inconsistent", "inconsistent", Tone.FATAL
    NOT_SEPARABLE = "not separable", "not separable", Tone.WARNING
    NOT_RESOLVED = "not resolved", "not resolved", Tone.WARNING
    RESOLVED = "resolved", "resolved", Tone.GOOD


class TableCheckKind(StrEnum):
    """What is asked of the residuals."""

    AGREEMENT = "agreement"
    SIZE = "size"
    BY_RATE = "noise against the rate"
    STEPS = "scatter of the steps"
    REPEATS = "scatter of the repeats"
    SHAPE = "shape"
    POWERS = "higher powers"
    HYSTERESIS = "hysteresis"
    CONSTANCY = "constancy"


class TableRemark(StrEnum):
    """What is to be known or done, beside the checks that did not pass."""

    RATES = "record at more rates"
    DEGREE = "fit a lower degree"
    CLIPPED = "clipped"
    CLOCKS = "clocks compared"
    REPEATS = "motion repeats itself"
    UNSETTLED = "not settled"
    EARTH = "Earth in the bias"
    NOT_WHOLE = "turns are not whole"
    PLATEAUS = "steps of the encoder"
    LOWEST = "lowest frequency"
    REVERSED = "counts the other way"
