# SPDX-License-Identifier: BSD-3-Clause
"""What a fleet comes to."""

from __future__ import annotations

from allanite.quantities.verdict import Tone, Verdict

__all__ = ["CapabilityVerdict", "FleetVerdict"]


class FleetVerdict(Verdict):
    """Does any unit stand out?"""

    STAND_OUT = "stand out", "units stand out", Tone.WARNING
    NONE_STANDS_OUT = "none stands out", "no unit stands out", Tone.GOOD


class CapabilityVerdict(Verdict):
    """Do the units keep a limit?"""

    DOES_NOT_MEET = "does not meet", "the fleet does not meet its limits", Tone.FATAL
    CANNOT_TELL = "cannot tell", "the logs cannot tell whether the fleet meets its limits", Tone.WARNING
    MEETS = "meets", "the fleet meets its limits", Tone.GOOD
