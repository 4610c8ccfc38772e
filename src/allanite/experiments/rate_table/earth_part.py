# SPDX-License-Identifier: BSD-3-Clause
"""The Earth on a turning table: what is constant is part of the bias, what turns averages over whole revolutions."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.rate_table.motion import RateSteps
from allanite.quantities.earth import EARTH_RATE

__all__ = ["AXES", "EarthPart"]

Array = NDArray[np.float64]

AXES = ("vertical", "up", "down", "horizontal", "unknown")
"""Of the table: vertical without saying which way its positive direction points, or with it."""
#: A step that ends this far from a whole turn, as a part of a turn, and turns no more often than this.
WHOLE, MANY = 0.02, 20.0


class EarthPart:
    """What the Earth adds on a table of this axis.

    Parameters
    ----------
    axis : str
        One of `AXES`: "up" and "down" say where the positive rotation of the table points.
    latitude : float or None [rad]
    """

    def __init__(self, axis: str, latitude: float | None) -> None:
        if axis not in AXES:
            raise InputError(f"the axis of the table is one of {', '.join(AXES)}, not {axis!r}")
        if latitude is not None and not (math.isfinite(latitude) and abs(latitude) <= math.pi / 2):
            raise InputError(f"latitude {latitude!r} lies beyond a pole; from Python it is in radians")
        self.axis, self.latitude = axis, latitude

    @property
    def along(self) -> float | None:
        """Constant part on the table's axis, positive in its positive direction [rad/s]; None where not known."""
        if self.latitude is None or self.axis not in ("up", "down", "vertical"):
            return None
        return EARTH_RATE * math.sin(self.latitude) * (-1.0 if self.axis == "down" else 1.0)

    @property
    def across(self) -> float:
        """Largest part that turns with the table [rad/s]."""
        if self.latitude is None or self.axis in ("horizontal", "unknown"):
            return EARTH_RATE
        return EARTH_RATE * math.cos(self.latitude)

    def wobble(
        self, table: RateSteps, used: NDArray[np.int64], length: Array, misalignment: float
    ) -> tuple[float, float]:
        """Standard uncertainties of scale factor (relative) and bias [rad/s] by what turns and does not average.

        A sensitive axis at the angle m from the table's sees m times the part of the Earth across it, with the cosine
        of the table's angle. Over a step by the angle A its mean is at most 2 sin(A/2)/A of it, at an unknown phase.
        """
        rate = table.rate[used]
        left = np.abs(np.sinc(rate * length / (2 * math.pi)))
        variance = (misalignment * self.across * left) ** 2 / 2
        x = rate - rate.mean()
        if not (x**2).sum():
            return 0.0, 0.0
        weight = x / (x**2).sum()
        level = 1 / len(rate) - rate.mean() * weight
        return math.sqrt(float((weight**2 * variance).sum())), math.sqrt(float((level**2 * variance).sum()))


def not_whole(table: RateSteps, used: NDArray[np.int64], length: Array) -> int:
    """Steps that turn, but not by whole revolutions."""
    turns = np.abs(table.rate[used]) * length / (2 * math.pi)
    return int(np.count_nonzero((turns > 0) & (turns < MANY) & (np.abs(turns - np.round(turns)) > WHOLE)))
