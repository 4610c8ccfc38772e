# SPDX-License-Identifier: BSD-3-Clause
"""The commands that are declared. To add one: its module, and a line here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from allanite.commands.align import ALIGN
from allanite.commands.characterize import CHARACTERIZE
from allanite.commands.combine import COMBINE
from allanite.commands.compare import COMPARE
from allanite.commands.datasheet import DATASHEET
from allanite.commands.dead_reckon import DEAD_RECKON
from allanite.commands.declaration import Command, Place
from allanite.commands.earth_rate import EARTH_RATE
from allanite.commands.environment import ENVIRONMENT
from allanite.commands.north import NORTH
from allanite.commands.overbound import OVERBOUND
from allanite.commands.plan import PLAN
from allanite.commands.position_plan import PLAN_POSITIONS
from allanite.commands.rate_table import RATE_TABLE
from allanite.commands.select import SELECT
from allanite.commands.shared_noise import COMMON
from allanite.commands.spectrum import SPECTRUM
from allanite.commands.variation import VARIATION

if TYPE_CHECKING:
    from allanite.commands.measurement import MeasurementResult

__all__ = ["COMMANDS", "measure"]

COMMANDS: Mapping[str, Command] = {
    command.name: command
    for command in (
        CHARACTERIZE,
        SPECTRUM,
        VARIATION,
        SELECT,
        COMPARE,
        COMMON,
        ENVIRONMENT,
        PLAN,
        PLAN_POSITIONS,
        EARTH_RATE,
        NORTH,
        ALIGN,
        RATE_TABLE,
        COMBINE,
        DEAD_RECKON,
        DATASHEET,
        OVERBOUND,
    )
}


def measure(name: str, log: Place | Sequence[Place] = (), **options: object) -> MeasurementResult:
    """Carry out a command on a log, on several, or on none; see `Command.measure`."""
    return COMMANDS[name].measure(log, **options)  # type: ignore[arg-type]
