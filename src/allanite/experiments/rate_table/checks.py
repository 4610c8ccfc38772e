# SPDX-License-Identifier: BSD-3-Clause
"""Questions put to the residuals of a run on a rate table, and what a failed one means."""

from __future__ import annotations

import math

from allanite.experiments.rate_table.verdict import TableCheckKind
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.residual_tests import FOREIGN, CheckResult, scatter_words, size_words

__all__ = ["TableCheck"]

_NAMES = {
    TableCheckKind.AGREEMENT: "agreement with the table",
    TableCheckKind.SIZE: "size of the noise",
    TableCheckKind.SHAPE: "shape of the response",
    TableCheckKind.POWERS: "shape of the response",
    TableCheckKind.CONSTANCY: "constancy of the scale factor",
}
_WIDENED = "(the interval is widened for it)"


@dataclass(frozen=True, slots=True, kw_only=True)
class TableCheck(CheckResult):
    """One question put to the residuals.

    Attributes
    ----------
    kind : TableCheckKind
        "agreement" with the table, "size" of the noise, "noise against the rate", "scatter of the steps" or of the
        "repeats", "shape" of the response by the means of the rates or by "higher powers", "hysteresis", "constancy" of
        the scale factor.
    rate : float [rad/s]
        At which the noise differs most from that at rest; NaN of the others.
    value : float
        Part of the signal that is left, the noise at the rate over that of the model, or the hysteresis at rest over
        full scale; NaN of the others.
    """

    kind: TableCheckKind
    rate: float = math.nan
    value: float = math.nan

    @property
    def name(self) -> str:
        """What was asked."""
        return _NAMES.get(self.kind, self.kind)

    @property
    def grave(self) -> bool:
        """A table of another record, or a model of another sensor; all else widens, or is said."""
        foreign = self.kind is TableCheckKind.SIZE and self.ratio > FOREIGN
        return not self.passed and (foreign or self.kind is TableCheckKind.AGREEMENT)

    @property
    def says(self) -> str:
        """What it means and what to do, when it did not pass."""
        match self.kind:
            case TableCheckKind.AGREEMENT:
                return (
                    f"the record does not follow the table: {100 * self.value:.3g} % of the signal remains; check the "
                    "times and the unit of the table's rates, and that its rows are close enough to show each change"
                )
            case TableCheckKind.SIZE:
                return size_words(self.ratio)
            case TableCheckKind.BY_RATE:
                return (
                    f"the noise depends on the rate: at {math.degrees(self.rate):.4g} deg/s it is {self.value:.2f} "
                    "times that of the model (jitter of the table or the sensor); samples at such rates have less "
                    "weight"
                )
            case TableCheckKind.STEPS:
                reasons = (
                    f"the rate of the table, its seat or the sensor changes from step to step {_WIDENED}"
                )
                return scatter_words("steps", self.ratio, reasons)
            case TableCheckKind.REPEATS:
                reasons = (
                    "the same rate gives different outputs: hysteresis, warm-up, the rate of the table, or its seat "
                    f"{_WIDENED}"
                )
                return scatter_words("repeats", self.ratio, reasons)
            case TableCheckKind.SHAPE:
                return (
                    f"the response differs from the fitted curve: the means of the rates lie {self.ratio:.2f} times as "
                    "far from it as the noise allows; fit a higher degree (--nonlinearity 3), or asymmetry "
                    "(--nonlinearity sign)"
                )
            case TableCheckKind.POWERS:
                return (
                    "the response differs from the fitted curve: it contains higher powers of the rate; fit a higher "
                    "degree (--nonlinearity 3)"
                )
            case TableCheckKind.HYSTERESIS:
                return (
                    "the output differs between rising and falling rates, at rest by "
                    f"{1e6 * self.value:.3g} ppm of full scale: hysteresis, or a sensor that has not settled"
                )
            case TableCheckKind.CONSTANCY:
                return (
                    "the scale factor changes during the record: let the sensor and the table warm up, or fit a "
                    "temperature with it (--temperature)"
                )
