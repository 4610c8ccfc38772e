# SPDX-License-Identifier: BSD-3-Clause
"""Which programs read a file, and which number goes where: what a module writes by, and what the documents show."""

from __future__ import annotations

from allanite.exporters.imu.slots import Slot
from allanite.lazy_dataclasses import dataclass

__all__ = ["Program", "Usage"]


@dataclass(frozen=True, slots=True)
class Program:
    """A program that reads the file.

    Attributes
    ----------
    name : str
    source : str
        Where its formula was read: repository and path.
    """

    name: str
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Usage:
    """What the programs make of a file.

    Attributes
    ----------
    programs : tuple of Program
    slots : tuple of Slot
        The places of the numbers, each with its formula.
    trap : str
        What goes wrong with other numbers; a line at the head of the file, in ASCII.
    lost : str
        What the file has no place for; the same.
    """

    programs: tuple[Program, ...]
    slots: tuple[Slot, ...]
    trap: str
    lost: str = ""

    @property
    def cautions(self) -> tuple[str, ...]:
        """The lines of the head."""
        return (f"CAUTION: {self.trap}", *([f"LOST: {self.lost}"] if self.lost else []))
