# SPDX-License-Identifier: BSD-3-Clause
"""Columns of a clock or counter: a time error is data, however much it looks like time."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.errors import InputError
from allanite.files.readers.column_look import rises
from allanite.files.readers.headings import Heading, read_heading
from allanite.files.readers.stated_time import stated_time
from allanite.recording.clock_channels import Shifted, clock_channel, clock_kind
from allanite.recording.records import Kind

if TYPE_CHECKING:
    from allanite.files.readers.table import Options, Table

__all__ = ["as_clock"]

#: Headings of data that a log of a sensor would have for time, or set aside as no samples.
_DATA = re.compile(
    r"phase|(^|_)(x|y|ti|tie|te|pps|1pps|offset|delay|freq\w*|ffe|ffo)(_|$)|interval|error|diff|dev",
    re.IGNORECASE,
)
_SUFFIX = re.compile(r"[_ .](s|ms|us|µs|ns|ps|fs)$")
_LATEST = 1e9  # a larger time is one since 1970, or not in seconds
_COMPANIONS = ("time", "counter", "temperature", "identity")


def as_clock(table: Table, options: Options, name: str) -> tuple[Table, Options]:
    """The table with its time column named as that, and every other column a channel of the clock.

    Raises
    ------
    InputError
        A word that is no kind, an unknown or missing unit, a scale factor, no column that could be data.
    """
    kind = clock_kind(options.kind or "")
    if options.scale_factor is not None:
        raise InputError(
            "a phase or frequency takes no scale factor: leave out --scale-factor, and pass --unit; for "
            "cycles or Hz also --carrier"
        )
    heads = [read_heading(text) for text in table.headings]
    numbers = table.numbers or tuple(range(1, len(heads) + 1))
    if options.time is None:
        time = _time(table, heads)
    elif options.time == "none":
        time = []
    else:
        time = [stated_time(options.time, table.headings, numbers, name).place]
    data = [i for i in range(len(heads)) if i not in time and _is_data(heads[i])]
    data = data or [i for i in range(len(heads)) if i not in time]
    if not data:
        raise InputError(f"{name}: no column is left for the {kind.value}: {options.time!r} is the only one")
    names = _names(heads, data, kind)
    headings, columns, channels, units = list(table.headings), list(table.columns), [], list(table.units)
    for i, label in zip(data, names, strict=True):
        suffix = _SUFFIX.search(heads[i].name) if kind is Kind.PHASE else None
        stated = (units[i] if units else "") or heads[i].unit or (suffix[1] if suffix else "")
        unit = _unit(options.unit, label, stated)
        if not unit:
            wanted = "1, ppm, ppb, or Hz" if kind is Kind.FREQUENCY else "s, ns, ps, or cycles"
            raise InputError(
                f"the unit of the {kind.value} {label} is not in the file: pass --unit (unit=): {wanted} "
                "with --carrier"
            )
        channel, offset = clock_channel(label, unit, kind, options.carrier)
        headings[i] = label
        channels.append(channel)
        if offset:
            columns[i] = Shifted(columns[i], offset)
    remarks = []
    for i in time if options.time is None else ():
        if i not in table.time_units and not heads[i].unit and not (units and units[i]):
            seconds = abs(table.columns[i].read(0, 1)[0] + table.columns[i].origin) < _LATEST
            headings[i] = "time [s]" if seconds else heads[i].name or "time"
            remarks += (
                [f"{heads[i].name or 'the first column'} is read as time in seconds"] if seconds else []
            )
    kept = sorted([*time, *data])
    left = [table.headings[i] or f"column {i + 1}" for i in range(len(heads)) if i not in kept]
    remarks += [f"columns left out: {', '.join(left)}"] if left else []
    remade = replace(
        table,
        headings=tuple(headings[i] for i in kept),
        columns=tuple(columns[i] for i in kept),
        numbers=tuple(numbers[i] for i in kept),
        units=tuple(units[i] if i in time else "" for i in kept) if units else (),
        units_from="argument" if options.unit is not None else (table.units_from if units else "header"),
        time_units={kept.index(i): u for i, u in table.time_units.items() if i in kept},
        channels=tuple(channels),
        guesses=(*table.guesses, *remarks),
    )
    return remade, replace(options, unit=None)


def _time(table: Table, heads: Sequence[Heading]) -> list[int]:
    """Columns of time: by name, or a first one without name that rises; never the only column."""
    if table.stamps is not None:
        return [i for i in table.stamps.used if i < len(heads)]
    named = [
        i
        for i, h in enumerate(heads)
        if i in table.time_units or (h.group == "time" and not _DATA.search(h.name))
    ]
    if not named and len(heads) > 1 and not heads[0].name and rises(table.columns[0]):
        named = [0]
    return named if len(named) < len(heads) else []


def _is_data(heading: Heading) -> bool:
    return _DATA.search(heading.name) is not None or heading.group not in _COMPANIONS


def _names(heads: Sequence[Heading], data: Sequence[int], kind: Kind) -> list[str]:
    """Names that no rule takes for time, and that differ."""
    plain = [heads[i].name if heads[i].group in ("", "gyro", "acc") else "" for i in data]
    made: list[str] = []
    for number, name in enumerate(plain, 1):
        label = name or (kind.value if len(data) == 1 else f"{kind.value}_{number}")
        made.append(label if label not in made else f"{label}_{number}")
    return made


def _unit(given: str | Mapping[str, str] | None, name: str, stated: str) -> str:
    if isinstance(given, Mapping):
        return str(given.get(name, stated))
    return given or stated
