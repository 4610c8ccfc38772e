# SPDX-License-Identifier: BSD-3-Clause
"""What a comparison of the noise in motion with that at rest comes to."""

from __future__ import annotations

from allanite.quantities.verdict import Tone, Verdict

__all__ = ["MotionVerdict"]


class MotionVerdict(Verdict):
    """Is there more noise in motion?"""

    INFLATED = "inflated", "more noise in motion", Tone.WARNING
    LOWER = "lower", "less noise in motion than at rest", Tone.WARNING
    UNCHANGED = "unchanged", "no more noise in motion", Tone.GOOD
