# SPDX-License-Identifier: BSD-3-Clause
"""When was the sensor turned? Turns, the positions between them, and the dwells that a regression may use.

`find_reversals` reads the turns off the signal alone; `periodic_reversals`, `read_turns` and `read_positions` take
them from a period or a file and hold them against the signal. All four give a `Reversals`.

Three words are kept apart. A *turn* is the stretch in which the sensor moved; a *position* is all that lies between
two turns; a *dwell* is a usable piece of a position: without the dead time after the turn, a guard before the next,
and the disturbed stretches (knocks, frozen readings) inside it.
"""

from allanite.experiments.reversals.apart import PositionsApart
from allanite.experiments.reversals.by_file import BETWEEN, joined_files, joined_positions
from allanite.experiments.reversals.detection import find_reversals
from allanite.experiments.reversals.schedule import periodic_reversals, placed, read_positions, read_turns
from allanite.experiments.reversals.turns import Disturbance, Dwell, Position, Reversals, Turn

__all__ = [
    "BETWEEN",
    "Disturbance",
    "Dwell",
    "Position",
    "PositionsApart",
    "Reversals",
    "Turn",
    "find_reversals",
    "joined_files",
    "joined_positions",
    "periodic_reversals",
    "placed",
    "read_positions",
    "read_turns",
]
