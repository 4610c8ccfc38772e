# SPDX-License-Identifier: BSD-3-Clause
"""What a selection of terms comes to."""

from __future__ import annotations

from allanite.quantities.verdict import Tone, Verdict

__all__ = ["SelectionVerdict"]


class SelectionVerdict(Verdict):
    """Is it clear which terms a record has?"""

    UNEXPLAINED = "unexplained", "no set of terms explains the record", Tone.WARNING
    OPEN = "open", "more than one set of terms is possible", Tone.WARNING
    CLEAR = "clear", "the terms are clear", Tone.GOOD
