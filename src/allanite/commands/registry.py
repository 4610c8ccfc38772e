# SPDX-License-Identifier: BSD-3-Clause
"""The commands that are declared: those of the analyses that `allanite.views.registry` lists."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from allanite.commands.declaration import Command, Place, loaded
from allanite.views.registry import VIEWS

if TYPE_CHECKING:
    from allanite.commands.measurement import MeasurementResult

__all__ = ["COMMANDS", "measure"]


_DECLARED: Sequence[Command] = [loaded(analysis.command) for analysis in VIEWS.values() if analysis.command]
COMMANDS: Mapping[str, Command] = {command.name: command for command in _DECLARED}


def measure(name: str, log: Place | Sequence[Place] = (), /, **options: object) -> MeasurementResult:
    """Carry out a command on a log, on several, or on none; see `Command.measure`."""
    return COMMANDS[name].measure(log, **options)  # type: ignore[arg-type]
