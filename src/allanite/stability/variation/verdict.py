# SPDX-License-Identifier: BSD-3-Clause
"""What the analysis of a variation comes to."""

from __future__ import annotations

from enum import StrEnum

from allanite.quantities.verdict import Tone, Verdict

__all__ = ["ModelSource", "VariationVerdict"]


class VariationVerdict(Verdict):
    """Is the noise the same all the time?"""

    CHANGES = "changes", "the noise changes", Tone.WARNING
    FLUCTUATES = "fluctuates", "the noise fluctuates", Tone.WARNING
    CONSTANT = "constant", "constant within its intervals", Tone.GOOD


class ModelSource(StrEnum):
    """Where the noise model comes from by which windows scatter."""

    GIVEN = "given"
    FITTED = "fitted"
    ROUGH = "rough"
