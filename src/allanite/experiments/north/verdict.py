# SPDX-License-Identifier: BSD-3-Clause
"""What a search for north and the null test come to: the codes of verdicts, checks and remarks."""

from __future__ import annotations

from enum import StrEnum

from allanite.quantities.verdict import Tone, Verdict

__all__ = ["NorthCheckKind", "NorthRemark", "NorthVerdict", "NullVerdict"]


class NorthVerdict(Verdict):
    """Is the azimuth a measurement of north?"""

    INCONSISTENT = "inconsistent", "inconsistent", Tone.FATAL
    CONTRADICTS = "inconsistent with Earth", "inconsistent with Earth", Tone.FATAL
    NO_NORTH = "no north", "no north", Tone.WARNING
    NOT_RESOLVED = "not resolved", "not resolved", Tone.WARNING
    RESOLVED = "north found", "north found", Tone.GOOD


class NullVerdict(Verdict):
    """Does a bias follow the turns?"""

    INCONSISTENT = "inconsistent", "inconsistent", Tone.FATAL
    FOLLOWS = "a bias follows the turns", "a bias follows the turns", Tone.FATAL
    NOT_SEPARABLE = "not separable", "not separable", Tone.WARNING
    NONE = "no bias that follows the turns", "no bias that follows the turns", Tone.GOOD


class NorthCheckKind(StrEnum):
    """What is asked of the residuals."""

    SIZE = "size"
    CONSTANCY = "constancy"
    SCATTER = "scatter"


class NorthRemark(StrEnum):
    """What is to be done, beside the checks that did not pass."""

    TURN = "turn the table"
    SECOND_AXIS = "add an axis or a position"
    LONGER = "record for longer"
