# SPDX-License-Identifier: BSD-3-Clause
"""What taking the noise of sensors apart comes to."""

from __future__ import annotations

from allanite.quantities.verdict import Tone, Verdict

__all__ = ["SeparationVerdict"]


class SeparationVerdict(Verdict):
    """Do the sensors share noise?"""

    OPPOSITE = "opposite sign", "the sensors share noise of opposite sign", Tone.WARNING
    NOT_SHARED = "not shared", "no shared noise is seen", Tone.GOOD
    SHARED = "shared", "noise is shared", Tone.GOOD
