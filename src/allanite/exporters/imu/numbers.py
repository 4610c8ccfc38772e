# SPDX-License-Identifier: BSD-3-Clause
"""The numbers of a file in SI, those of each triad, and the lines in which a format holds them.

A format is a tuple of `Slot`. `ImuNumbers.lines` renders them by two patterns, one for a number and one for a slot that
the study leaves open: a comment to fill in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from allanite.exporters.imu.preamble import rate_text
from allanite.exporters.imu.slots import Slot
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.units import parse_unit

__all__ = ["ImuNumbers"]


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

    def values(self, slot: Slot, rate: float | None = None) -> tuple[float, ...]:
        """The numbers of a slot as the file has them: one, three, or none where the study leaves it open.

        Parameters
        ----------
        rate : float, optional [Hz]
            Of the samples; that of the record by default.
        """
        by_sensor: Mapping[str, tuple[float, ...]] = getattr(self, slot.formula.of)
        factor = 1.0 if slot.formula.power == 2 else parse_unit(slot.unit).factor
        rate = self.rate if rate is None else rate
        return tuple(slot.formula(v, rate) / factor for v in by_sensor.get(slot.sensor, ()))

    def lines(
        self, slots: Sequence[Slot], line: str, blank: str = "", *, rate: float | None = None
    ) -> list[str]:
        """A line for each key of each slot.

        Parameters
        ----------
        line : str
            Pattern with {key}, {unit}, and {value}, one number, or {row}, those of three axes.
        blank : str
            Pattern of a slot that the study leaves open, with {key} and {unit}; an empty one leaves the line out.
        rate : float, optional [Hz]
            Of the samples; that of the record by default.
        """
        lines = []
        for slot in slots:
            values = self.values(slot, rate)
            if not values:
                lines += [slot.left_open(blank)] if blank else []
                continue
            row = self.row(values)
            for i, key in enumerate(slot.keys):
                value = self.text(values[i if len(values) == 3 else 0])
                lines.append(line.format(key=key, value=value, row=row, unit=slot.unit))
        return lines
