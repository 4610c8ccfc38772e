# SPDX-License-Identifier: BSD-3-Clause
"""A place of a file for a number: which one of which sensor stands under which key, by which formula, in which unit."""

from __future__ import annotations

from allanite.exporters.imu.formulas import Formula
from allanite.lazy_dataclasses import dataclass

__all__ = ["Slot"]


@dataclass(frozen=True, slots=True)
class Slot:
    """A place of a file for a number of one triad.

    Attributes
    ----------
    key : str
        As the format calls it.
    sensor : str
        `GYROSCOPE` or `ACCELEROMETER`.
    formula : Formula
        Of the number.
    unit : str
        That the file has it in, written as `allanite.quantities.units.parse_unit` reads it; SI of a square.
    axes : str
        What follows the key for each of three axes, where each has a key of its own: "xyz".
    """

    key: str
    sensor: str
    formula: Formula
    unit: str
    axes: str = ""

    @property
    def keys(self) -> tuple[str, ...]:
        """One, or one of each axis."""
        return tuple(self.key + axis for axis in self.axes) or (self.key,)

    def left_open(self, blank: str) -> str:
        """A comment to fill in, by a pattern with {key} and {unit}."""
        return "\n".join(blank.format(key=key, unit=self.unit) for key in self.keys)
