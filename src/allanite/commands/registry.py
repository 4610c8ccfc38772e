# SPDX-License-Identifier: BSD-3-Clause
"""The commands that are declared. To add one: its module, and a line here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from allanite.commands.characterize import CHARACTERIZE
from allanite.commands.declaration import Command
from allanite.commands.earth_rate import EARTH_RATE
from allanite.commands.variation import VARIATION

if TYPE_CHECKING:
    from allanite.commands.measurement import MeasurementResult

__all__ = ["COMMANDS", "measure"]

COMMANDS: Mapping[str, Command] = {command.name: command for command in (CHARACTERIZE, VARIATION, EARTH_RATE)}


def measure(name: str, log: str, **options: object) -> MeasurementResult:
    """Carry out a command on a log; see `Command.measure`."""
    return COMMANDS[name].measure(log, **options)  # type: ignore[arg-type]
