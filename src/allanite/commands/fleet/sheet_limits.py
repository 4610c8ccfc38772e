# SPDX-License-Identifier: BSD-3-Clause
"""The values of a data sheet as limits of the coefficients of channels."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from allanite.errors import InputError

if TYPE_CHECKING:
    from allanite.recording.records import Kind

__all__ = ["ROLES", "Key", "limits_of_fleet", "sheet_limits"]

#: Sections of a data sheet, by what a channel measures.
ROLES = {"rate": "gyro", "acceleration": "accelerometer"}

Place = str | os.PathLike[str]
Key = tuple[str, str]


def sheet_limits(sheet: Place, kinds: Mapping[str, Kind]) -> Iterator[tuple[Key, float]]:
    """Channel and symbol with the value [SI] that a sheet states of them; `kinds` are those of the channels by name.

    Raises
    ------
    InputError, FormatError
        What `read_datasheet` refuses, and a statement of a channel that limits no coefficient: a unit must not pass
        with a limit that nobody looked at.
    """
    from allanite.study.datasheet import read_datasheet

    sections = read_datasheet(sheet).sections
    for channel, kind in kinds.items():
        section = sections.get(channel, sections.get(ROLES.get(kind.rate.value, "")))
        for entry in section.entries if section else ():
            if entry.symbol not in "QNBKR":
                raise InputError(
                    f"{os.fspath(sheet)}: {entry.name} ({entry.text}) cannot be checked: it limits no coefficient Q, "
                    "N, B, K or R alone. Take it out of this sheet; allanite datasheet compares it with a log"
                )
            yield (channel, entry.symbol), entry.value


def limits_of_fleet(sheet: Place, fleet: Place) -> dict[Key, float]:
    """The limits that a sheet states for the channels of a fleet.

    Raises
    ------
    InputError, FormatError
        No table of a fleet, none of whose coefficients has a value, and what `read_datasheet` refuses.
    """
    from pathlib import Path

    from allanite.recording.records import Kind
    from allanite.stability.fleet.rows import read_rows

    rows = read_rows(Path(fleet))
    kinds = {str(name): Kind(kind) for name, kind in dict(zip(rows.channel, rows.kind, strict=True)).items()}
    there = {*zip(rows.channel, rows.symbol, strict=True)}
    limits = {key: value for key, value in sheet_limits(sheet, kinds) if key in there}
    if not limits:
        names = ", ".join(f"{symbol} of {channel}" for channel, symbol in sorted(there))
        raise InputError(f"{sheet}: no value for a coefficient of the fleet; those are {names}")
    return limits
