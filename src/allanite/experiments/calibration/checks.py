# SPDX-License-Identifier: BSD-3-Clause
"""Questions put to the residuals of a self-calibration, and what a failed one means."""

from __future__ import annotations

import math

from allanite.experiments.calibration import words
from allanite.experiments.calibration.verdict import CalibrationCheckKind
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.residual_tests import CheckResult

__all__ = ["CalibrationCheck"]

#: What makes observations scatter beyond the noise.
_REASONS = {
    CalibrationCheckKind.FORCES: (
        "the unit moved at rest, the accelerometers are not linear (quadratic terms), or their biases follow the "
        "temperature"
    ),
    CalibrationCheckKind.RATES: (
        "the unit turned at rest, or the gyro biases follow gravity or the temperature"
    ),
    CalibrationCheckKind.TURNS: (
        "the turns were too fast or too rough for the sample rate, the gyros are not linear, or the clocks of gyros "
        "and accelerometers differ"
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationCheck(CheckResult):
    """One question put to the residuals.

    Attributes
    ----------
    kind : CalibrationCheckKind
        "scatter of the accelerometers at rest", "scatter of the gyros at rest", "scatter of the turns", "rate of the
        Earth", "accelerometers alone".
    value, expected : float [rad/s]
        Of the rate of the Earth: what the gyros see, and what is known; NaN of the others.
    parameter : str
        Of the accelerometers alone: what they see most differently, "bias_z"; "" of the others.
    """

    kind: CalibrationCheckKind
    value: float = math.nan
    expected: float = math.nan
    parameter: str = ""

    @property
    def name(self) -> str:
        """What was asked."""
        return str(self.kind)

    @property
    def of_rests(self) -> bool:
        """It is about the scatter at rest."""
        return self.kind in (CalibrationCheckKind.FORCES, CalibrationCheckKind.RATES)

    @property
    def says(self) -> str:
        """What it means and what to do, when it did not pass."""
        match self.kind:
            case CalibrationCheckKind.EARTH:
                return words.earth_seen(self.value, self.expected)
            case CalibrationCheckKind.ALONE:
                return words.alone(self.parameter)
        what = self.kind.removeprefix("scatter of the ")
        return words.scattered(what, self.ratio, _REASONS[self.kind])
