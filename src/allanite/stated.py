# SPDX-License-Identifier: BSD-3-Clause
"""Uncertainties that no record shows: what the user knows of the set-up."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

from allanite.errors import InputError

__all__ = ["Stated"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stated:
    """Standard uncertainties that only the user knows; they enter the interval and the budget.

    Attributes
    ----------
    scale : float
        Of the scale factor, relative.
    latitude : float [rad]
    tilt : float [rad]
        Of the turntable's axis from the vertical, in the north-south plane.
    heading : float [rad]
        Of the direction of the sensitive axis in each dwell.
    """

    scale: float = 0.0
    latitude: float = 0.0
    tilt: float = 0.0
    heading: float = 0.0

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not (isinstance(value, (int, float)) and math.isfinite(value) and value >= 0):
                raise InputError(
                    f"the stated uncertainty of {name} must be finite and not negative, not {value!r}"
                )

    def budget(self, latitude: float) -> dict[str, float]:
        """What each contributes to the standard uncertainty of the Earth rate, relative to it.

        The mean of the dwells is Omega (1 + e) [cos(latitude) cos(heading) + tilt sin(latitude)], so a tilt and an
        error of latitude count tan(latitude) times. An error of heading is of second order: heading^2/2, whose root
        mean square is sqrt(3)/2 of the variance.
        """
        slope = abs(math.tan(latitude))
        return {
            "scale factor": self.scale,
            "latitude": slope * self.latitude,
            "tilt": slope * self.tilt,
            "heading": math.sqrt(3) / 2 * self.heading**2,
        }
