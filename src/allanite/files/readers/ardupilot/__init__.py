# Specification: ArduPilot, "dataflash" binary logs: AP_Logger/LogStructure.h and the documentation of log messages.
# SPDX-License-Identifier: BSD-3-Clause
"""ArduPilot dataflash logs (.BIN): IMU, GYR and ACC messages, and the batches of the batch sampler.

Every message type has a clock of its own, and every instance of a sensor is a part of its own. Units are those that
the messages are defined with (rad/s, m/s²), or that the log states itself (UNIT, FMTU). `records` finds the records,
`parts` makes tables of them; both run in a child process.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from allanite.files.readers.contents import message_table
from allanite.files.readers.sandbox import run
from allanite.files.readers.table import Options, Table

NAME: Final = "ArduPilot"
OPTIONS: Final = frozenset({"topic"})

_FIRST = b"\xa3\x95\x80"
_SELF = b"\xa3\x95\x80\x80\x59FMT"
_SPARE_MEMORY = 512 << 20


def sniff(head: bytes, path: Path) -> bool:
    """True for a first record that defines a record, and for the definition of the definitions behind some garbage."""
    return head.startswith(_FIRST) or _SELF in head


def read(path: Path, options: Options) -> Table:
    """Read the messages of one type and instance.

    Raises
    ------
    FormatError
        No record can be read.
    InputError
        No message of an inertial sensor, or not the one asked for; the error lists those that are there.
    DataQualityError
        The message asked for never comes.
    """
    size = path.stat().st_size
    facts, arrays = run(
        "allanite.files.readers.ardupilot.parts:table_in",
        [str(path), options.topic, options.channel_names],
        memory=_SPARE_MEMORY + 8 * size,
        seconds=20 + size / 1e7,
        name=path.name,
    )
    return message_table(facts, arrays, path, NAME)
