# SPDX-License-Identifier: BSD-3-Clause
"""The numbers of a file in SI, those of each triad, and the lines in which a format holds them.

A format is a tuple of `Slot`: which number of which sensor stands under which key, in which unit. `ImuNumbers.lines`
renders them by two patterns, one for a number and one for a slot that the study leaves open: a comment to fill in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from allanite.exporters.imu.preamble import rate_text
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.units import parse_unit

__all__ = ["ImuNumbers", "Slot"]


@dataclass(frozen=True, slots=True)
class Slot:
    """A place of a file for a number of one triad.

    Attributes
    ----------
    key : str
        As the format calls it.
    sensor : str
        `GYROSCOPE` or `ACCELEROMETER`.
    of : str
        Which number: the name of an attribute of the numbers.
    unit : str
        That the file has it in, written as `allanite.quantities.units.parse_unit` reads it.
    """

    key: str
    sensor: str
    of: Literal["noise", "walk", "sigma"]
    unit: str

    def left_open(self, blank: str) -> str:
        """A comment to fill in, by a pattern with {key} and {unit}."""
        return blank.format(key=self.key, unit=self.unit)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuNumbers:
    """What every file has; the bias is that of `WalkImu` or `MarkovImu`.

    Attributes
    ----------
    rate : float [Hz]
        Of the record.
    comments : tuple of str
        The head of the file, without a comment sign.
    noise : mapping of str to tuple of float
        N of each sensor in SI: one number, or three; no entry where the study holds none.
    style : str
        Format of a number.
    """

    rate: float
    comments: tuple[str, ...]
    noise: Mapping[str, tuple[float, ...]]
    style: str

    def text(self, value: float) -> str:
        """A number as the file has it."""
        return format(value, self.style)

    def row(self, values: Sequence[float], count: int = 3) -> str:
        """Numbers for each axis, the one of all repeated, between brackets."""
        given = tuple(values) * (count if len(values) == 1 else 1)
        return "[" + ", ".join(self.text(v) for v in given) + "]"

    def comment(self, sign: str = "#") -> list[str]:
        """The head as comment lines."""
        return [f"{sign} {line}".rstrip() for line in self.comments]

    @property
    def frequency(self) -> str:
        """The rate as a file of YAML has it."""
        return rate_text(self.rate)

    def lines(self, slots: Sequence[Slot], line: str, blank: str = "") -> list[str]:
        """A line for each slot.

        Parameters
        ----------
        line : str
            Pattern with {key}, {unit}, and {value}, one number, or {row}, those of three axes.
        blank : str
            Pattern of a slot that the study leaves open, with {key} and {unit}; an empty one leaves the line out.
        """
        lines = []
        for slot in slots:
            by_sensor: Mapping[str, tuple[float, ...]] = getattr(self, slot.of)
            if slot.sensor in by_sensor:
                values = [v / parse_unit(slot.unit).factor for v in by_sensor[slot.sensor]]
                value, row = self.text(values[0]), self.row(values)
                lines.append(line.format(key=slot.key, value=value, row=row, unit=slot.unit))
            elif blank:
                lines.append(slot.left_open(blank))
        return lines
