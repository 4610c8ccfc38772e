# SPDX-License-Identifier: BSD-3-Clause
"""Questions put to the residuals of a search for north or a null test, and what a failed one means."""

from __future__ import annotations

from allanite.experiments.north.verdict import NorthCheckKind
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.residual_tests import CheckResult, scatter_words, size_words

__all__ = ["NorthCheck"]

_NAMES = {
    NorthCheckKind.SIZE: "size of the noise",
    NorthCheckKind.CONSTANCY: "constancy of the heading",
    NorthCheckKind.SCATTER: "scatter of the positions",
}
_REASONS = "an error changes from position to position (heading, tilt, residual rotation, a bias by position)"


@dataclass(frozen=True, slots=True, kw_only=True)
class NorthCheck(CheckResult):
    """One question put to the residuals.

    Attributes
    ----------
    kind : NorthCheckKind
        "size" of the noise, "constancy" of the heading, "scatter" of the positions.
    """

    kind: NorthCheckKind

    @property
    def name(self) -> str:
        """What was asked."""
        return _NAMES[self.kind]

    @property
    def says(self) -> str:
        """What it means and what to do, when it did not pass."""
        match self.kind:
            case NorthCheckKind.SIZE:
                return size_words(self.ratio)
            case NorthCheckKind.SCATTER:
                return scatter_words("positions", self.ratio, _REASONS)
            case NorthCheckKind.CONSTANCY:
                return (
                    "the Earth's rotation appears to change direction or size during the record: the table turned "
                    "relative to the ground, or its rate or headings differ from those given"
                )
