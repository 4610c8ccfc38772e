# SPDX-License-Identifier: BSD-3-Clause
"""Uncertainties that no record shows: what the user knows of the set-up."""

from __future__ import annotations

import math
from dataclasses import asdict

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass

__all__ = ["SetupUncertainty"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SetupUncertainty:
    """Standard uncertainties that only the user knows; they enter the interval and the budget.

    Attributes
    ----------
    scale : float
        Relative standard uncertainty of the scale factor.
    latitude : float [rad]
        Standard uncertainty of the latitude.
    tilt : float [rad]
        Tilt of the turntable's axis from the vertical, in the north-south plane; for a sensitive axis that is turned
        between up and down, its tilt from the vertical in each plane.
    heading : float [rad]
        Uncertainty of the direction of a level sensitive axis in each dwell.
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
        if not self.scale < 1:
            raise InputError(
                f"the stated uncertainty of the scale factor is {100 * self.scale:g} %: it must be below 100 %. It is "
                f"a fraction: {self.scale:g} % is {self.scale / 100:g}, --scale-uncertainty {self.scale:g}%"
            )

    def budget(self, latitude: float) -> dict[str, float]:
        """What each contributes to the standard uncertainty of the Earth rate of a level axis, relative to it.

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

    def budget_of_vertical(self, latitude: float) -> dict[str, float]:
        """The same of an axis that is turned between up and down.

        An axis that leans by t towards north, and by u towards east, sees
        Omega [sin(latitude) (1 - (t^2 + u^2)/2) + cos(latitude) t], and all of it is reversed when the axis is turned
        over: a lean counts cot(latitude) times in the first order, and the root mean square of (t^2 + u^2)/2 is
        sqrt(2) of the variance. An error of latitude counts cot(latitude) times. There is no heading.
        """
        slope = abs(1 / math.tan(latitude))
        return {
            "scale factor": self.scale,
            "latitude": slope * self.latitude,
            "tilt": math.hypot(slope * self.tilt, math.sqrt(2) * self.tilt**2),
        }
