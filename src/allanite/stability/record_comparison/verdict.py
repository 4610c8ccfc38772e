# SPDX-License-Identifier: BSD-3-Clause
"""What a comparison of records comes to."""

from __future__ import annotations

from allanite.quantities.verdict import Tone, Verdict

__all__ = ["ComparisonVerdict"]


class ComparisonVerdict(Verdict):
    """Is the noise the same in all records?"""

    DIFFER = "differ", "the records differ", Tone.WARNING
    NO_DIFFERENCE = "no difference", "no difference seen", Tone.GOOD
