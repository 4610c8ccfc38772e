# SPDX-License-Identifier: BSD-3-Clause
"""What a fleet comes to."""

from __future__ import annotations

from allanite.quantities.verdict import Tone, Verdict

__all__ = ["FleetVerdict"]


class FleetVerdict(Verdict):
    """Does any unit stand out?"""

    STAND_OUT = "stand out", "units stand out", Tone.WARNING
    NONE_STANDS_OUT = "none stands out", "no unit stands out", Tone.GOOD
