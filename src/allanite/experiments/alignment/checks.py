# SPDX-License-Identifier: BSD-3-Clause
"""Questions put to the residuals of an alignment, and what a failed one means."""

from __future__ import annotations

import math

from allanite.experiments.alignment.verdict import AlignmentCheckKind
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.residual_tests import CheckResult, scatter_words, size_words
from allanite.quantities.units import STANDARD_GRAVITY

__all__ = ["AlignmentCheck"]

_NAMES = {
    AlignmentCheckKind.SIZE: "size of the noise",
    AlignmentCheckKind.ACROSS: "scatter of the two directions across the axis",
    AlignmentCheckKind.CONSTANCY: "constancy of the Earth's rotation",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignmentCheck(CheckResult):
    """One question put to the residuals.

    Attributes
    ----------
    kind : AlignmentCheckKind
        "size" of the noise, "scatter of the stands", "vertical rate", "gravity", "turns against gravity"; of a rotation
        "scatter across the axis", "constancy" of the Earth's rotation; of several attitudes "latitude".
    value : float [m/s^2] or [rad]
        Of gravity how far the accelerometers are off it; of the turns how far gravity is from where they lead; the
        measured latitude; NaN of the others.
    given : float [rad]
        The latitude that was given; NaN of the others.
    """

    kind: AlignmentCheckKind
    value: float = math.nan
    given: float = math.nan

    @property
    def name(self) -> str:
        """What was asked."""
        return _NAMES.get(self.kind, self.kind)

    @property
    def says(self) -> str:
        """What it means and what to do, when it did not pass."""
        match self.kind:
            case AlignmentCheckKind.SIZE:
                return size_words(self.ratio)
            case AlignmentCheckKind.STANDS:
                causes = "leveling, turns, a bias that depends on attitude, misalignment, motion at rest"
                return scatter_words("stands", self.ratio, f"an error changes from stand to stand ({causes})")
            case AlignmentCheckKind.VERTICAL:
                return (
                    "the vertical part of the measured rotation is not the Earth's at this latitude: the biases are "
                    "larger than stated, or scale factor, latitude or leveling are wrong"
                )
            case AlignmentCheckKind.GRAVITY:
                return (
                    f"the calibrated accelerometers differ from gravity by {1e3 * self.value / STANDARD_GRAVITY:.3g} "
                    "mg: the calibration is of another sensor, its biases have changed (state bias_repeatability, "
                    "--accelerometer-bias), or latitude or height are wrong"
                )
            case AlignmentCheckKind.TURNS:
                return (
                    f"after the turns gravity is {math.degrees(self.value):.2g} deg from where the gyros predict: "
                    "scale factor, misalignment, or motion at rest; the azimuth of each turn gets the same uncertainty"
                )
            case AlignmentCheckKind.ACROSS:
                causes = "scale factors that differ, misalignment, or an error that follows the rotation"
                return scatter_words("two directions across the axis", self.ratio, causes)
            case AlignmentCheckKind.CONSTANCY:
                return (
                    "the Earth's rotation appears to grow during the record: the axis of rotation moved relative to "
                    "the ground"
                )
            case AlignmentCheckKind.LATITUDE:
                measured, given = (math.degrees(x) for x in (self.value, self.given))
                return (
                    f"the angle between gravity and the measured rotation means a latitude of {measured:.2f} deg, not "
                    f"{given:.2f}: check the latitude, its sign, the gyro axes and the leveling"
                )
