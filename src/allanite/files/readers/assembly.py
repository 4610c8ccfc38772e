# SPDX-License-Identifier: BSD-3-Clause
"""From the columns of a file to a Recording: one place for all formats.

A reader returns a `Table`: columns as they stand in the file, and what the file says about them. Here the
columns become time, channels and companions, units are settled, and the samples are put on an even grid.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from allanite.errors import DataQualityError, InputError
from allanite.files.readers.asked_units import is_of_sensor
from allanite.files.readers.channels import channels_of, selected, units_differ
from allanite.files.readers.clock_table import as_clock
from allanite.files.readers.column_look import is_counter, only_grows
from allanite.files.readers.headings import FITTING, Heading, measures, read_heading, with_unit
from allanite.files.readers.increments import divided
from allanite.files.readers.integration_times import with_apertures
from allanite.files.readers.kept_rows import KeptRows
from allanite.files.readers.numbering import clocks_beside, numbering_of, unseen_by_stamps
from allanite.files.readers.occupied_rows import (
    left_out_remark,
    occupied_rows,
    refuse_several_clocks,
    with_kept_stamps,
)
from allanite.files.readers.part import TableRows, rows_between
from allanite.files.readers.seams import seams_of
from allanite.files.readers.sensors_in_rows import refuse_several_sensors
from allanite.files.readers.stamp_table import StampTable, TimeChoice
from allanite.files.readers.stamps import choose_time, growing
from allanite.files.readers.table import Options, Table
from allanite.files.readers.timebase import Stamps, Timebase, even_grid, fit_grid
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.limits import COLUMNS, refuse_more
from allanite.plain_files.loggers import logger_of
from allanite.quantities.units import QuantityKind
from allanite.recording.checked_samples import checked_rate
from allanite.recording.health.catalogue import CATALOGUE
from allanite.recording.position_rows import MOST, are_positions
from allanite.recording.records import Column, Recording, Spliced

__all__ = ["assemble", "time_of"]

_LOG = logger_of(__name__)
_INERTIAL = {QuantityKind.ANGLE_RATE, QuantityKind.ANGLE, QuantityKind.ACCELERATION, QuantityKind.VELOCITY}
#: A rate in the name of a file: static_200Hz.csv, imu-1kHz, 62p5hz.
_RATE_IN_NAME = re.compile(r"(?<![\d.])(\d+(?:[.p]\d+)?)[ _-]?(k?)(?:hz|sps)(?![a-z])", re.IGNORECASE)
#: A column that numbers positions, or says how they lay.
_OF_POSITIONS = re.compile(
    r"(?:pose|position|heading|azimuth)(?:_?(?:no|nr|id|number|name|deg))?", re.IGNORECASE
)
_COMPANIONS = ("other", "temperature", "counter", "identity", "time")


def assemble(table: Table, options: Options, name: str) -> Recording:
    """The recording in a table.

    Parameters
    ----------
    name : str
        File name without folder, for messages.

    Raises
    ------
    InputError
        No rate, an unknown or unfitting unit, a channel that is not there.
    DataQualityError
        No samples, or stamps from which no grid can be built.
    """
    if not table.columns or len(table.columns[0]) == 0:
        raise DataQualityError(f"{name}: no samples in this {table.format} file")
    refuse_more(len(table.columns), COLUMNS, "columns", name, "Write only the needed ones to a separate file")
    if options.kind is not None:
        table, options = as_clock(table, options, name)
    headings = _headings(table)
    time = time_of(table, options, name)
    if table.text is None and table.channels is None and options.kind is None:
        refuse_several_sensors(table, headings, time, name)
    rows = None
    if time is not None and options.rate is None and (options.start, options.stop) != (None, None):
        rows = rows_between(time.stamps, options.start, options.stop)
        table, time = _part(table, rows), _time_of_part(time, rows)
    guesses = [*table.guesses, *(time.guesses if time else ())]
    used = set(time.used) if time else set()
    counters, remarks = numbering_of(headings, table.columns, used, timed=time is not None)
    guesses += remarks
    used |= {counter.place for counter in counters}
    if time is not None and options.kind is None:
        used |= clocks_beside(time.stamps, headings, table.columns, used, guesses)
    places = [i for i in range(len(headings)) if i not in used]
    named = _named(headings, places, table.prefix)
    chosen = selected(options.channels, named, table)
    if time is not None and options.rate is None:
        time = with_kept_stamps(time)
        refuse_several_clocks(time, table.columns, named, chosen, name)
        occupied = occupied_rows(time, [table.columns[i] for i in chosen])
        if occupied is not None:
            table, time = _picked(table, occupied), occupied.of_time(time)
            counters = [replace(c, numbers=occupied.of_column(c.numbers)) for c in counters]
            guesses.append(left_out_remark(occupied))
    base = _grid(table, options, time, [counter.numbers for counter in counters], name, guesses)
    if time and options.rate is None:
        guesses += unseen_by_stamps(counters, base.facts["missing"])
    channels, increments = channels_of(table, options, named, chosen, guesses)
    units_from = _units_from(table, options, named)
    step = {
        "step": "read",
        "file": name,
        "format": table.format,
        "rate": base.rate,
        "rate_from": base.facts["source"],
        "units_from": units_from,
    }
    if table.source.get("topic"):
        step["topic"] = table.source["topic"]
    if options.rate is not None and time is not None:
        step["stamps_set_aside"] = time.source
    if options.unit is not None:
        other = {
            channels[i].name: named[i].unit for i in chosen if units_differ(channels[i].unit, named[i].unit)
        }
        step |= {"units_set_aside": other} if other else {}
    channels = with_apertures(channels, table, base.rate, increments)
    rates = divided(channels, increments, table, base.rate)
    guesses += rates.guesses
    if options.channels is None:
        chosen = [i for i in chosen if i not in rates.used]
    history = [*table.history, step, *rates.steps]
    if rows is not None:
        history.append({"step": "window", "start_s": rows.first, "stop_s": rows.last + 1.0 / base.rate})
    recording = Recording(
        channels=tuple(rates.channels[i] for i in chosen),
        columns=tuple(_placed(rates.columns[i], base) for i in chosen),
        rate=base.rate,
        start=table.start if table.start is not None else (time.start if time else None),
        history=tuple(history),
        source=name,
        notes=_notes(table, base, units_from, guesses),
    )
    _LOG.info("%s, %s: %r", name, table.format, recording)
    _LOG.info("%s: time from %s, units from %s", name, base.facts["source"], units_from)
    _LOG.debug("%s: clock line: %s", name, base.facts)
    if rows is not None or (options.start, options.stop) == (None, None):
        return recording
    return recording.window(options.start, options.stop)


def _part(table: Table, rows: TableRows) -> Table:
    start = None if table.start is None else table.start + round(rows.first * 1e9)
    return replace(table, columns=tuple(rows.of_column(c) for c in table.columns), start=start)


def _picked(table: Table, rows: KeptRows) -> Table:
    return replace(table, columns=tuple(rows.of_column(c) for c in table.columns))


def _time_of_part(time: TimeChoice, rows: TableRows) -> TimeChoice:
    later = round(rows.first * 1e9)
    start = None if time.start is None else time.start + later
    return replace(time, stamps=rows.of_stamps(time.stamps), start=start, first_ns=time.first_ns + later)


def time_of(table: Table, options: Options, name: str) -> TimeChoice | None:
    """The time of a table, or None; `name` is the file, for messages.

    Raises
    ------
    InputError
        The option names no column, or what may be time is not settled by the file.
    """
    if table.stamps is not None and options.time is None:
        return table.stamps
    return choose_time(_stamp_table(table, options, name), options.time)


def _stamp_table(table: Table, options: Options, name: str) -> StampTable:
    headings = _headings(table)
    return StampTable(
        headings=headings,
        raw=table.headings,
        columns=table.columns,
        numbers=table.numbers or tuple(range(1, len(table.columns) + 1)),
        known_units=table.time_units,
        questions=table.questions,
        nominal=table.rate,
        inertial=_inertial(headings, options, table.prefix),
        rate_said=options.rate is not None,
        file=name,
    )


def _inertial(headings: Sequence[Heading], options: Options, prefix: str) -> bool:
    """True if a column is one of a gyro or an accelerometer: by its name, or by a unit of the file or the caller."""
    stated = options.unit.values() if isinstance(options.unit, Mapping) else [options.unit or ""]
    return any(
        group in FITTING for group in (read_heading(prefix).group, *(h.group for h in headings))
    ) or any(
        measures(unit) in _INERTIAL
        for unit in (*stated, *(h.unit for h in headings))
        if unit not in ("", "unknown")
    )


def _headings(table: Table) -> list[Heading]:
    return [_with_unit(read_heading(h), u) for h, u in zip(table.headings, _padded(table), strict=True)]


def _padded(table: Table) -> tuple[str, ...]:
    return table.units or ("",) * len(table.headings)


def _with_unit(heading: Heading, unit: str) -> Heading:
    return with_unit(heading, unit) if unit and not heading.standard else heading


def _named(headings: Sequence[Heading], places: Sequence[int], prefix: str) -> dict[int, Heading]:
    """Channel columns with names that differ: ch0, ch1, ... where the file has none, or those of the kind of row."""
    nameless = [i for i in places if not headings[i].name]
    names_of_kind = dict(zip(nameless, _names_of_kind(prefix, len(nameless)), strict=True)) if prefix else {}
    occurrences: dict[str, int] = {}
    result = {}
    for number, i in enumerate(places):
        heading = (
            replace(read_heading(names_of_kind[i]), unit=headings[i].unit)
            if i in names_of_kind
            else headings[i]
        )
        name = heading.name or f"ch{number}"
        occurrences[name] = occurrences.get(name, 0) + 1
        result[i] = replace(heading, name=name if occurrences[name] == 1 else f"{name}_{occurrences[name]}")
    return result


def _names_of_kind(prefix: str, count: int) -> list[str]:
    if count == 1:
        return [prefix]
    return [f"{prefix}_{end}" for end in ("xyz" if count == 3 else range(count))]


def _placed(column: Column, base: Timebase) -> Column:
    if len(base.grid) == 1 and base.length == len(column):
        return column
    return Spliced(column, base.source, base.grid, base.length)


# -- rate --------------------------------------------------------------------------------------------------


def _grid(
    table: Table,
    options: Options,
    time: TimeChoice | None,
    counters: Sequence[Column],
    name: str,
    guesses: list[str],
) -> Timebase:
    n = len(table.columns[0])
    if options.rate is not None:
        rate = checked_rate(options.rate)
        if counters and time is None:
            return _counted(counters[0], rate, "rate argument", table.rate, guesses)
        even = even_grid(n, rate, source="rate argument", nominal=table.rate)
        seams = [] if time is None else seams_of(time.stamps, rate)
        return replace(even, facts={**even.facts, "seams": seams}) if seams else even
    if time is not None:
        try:
            return fit_grid(
                time.stamps,
                source=time.source,
                unit=time.unit,
                nominal=table.rate,
                resolution=time.resolution,
            )
        except DataQualityError as error:
            raise DataQualityError(f"{name}: {error}") from None
    if table.rate is None and table.rate_doubt is not None:
        table = _with_settled_rate(table, options, name, guesses)
    if table.rate is not None:
        rate = checked_rate(table.rate)
        if counters:
            return _counted(counters[0], rate, table.rate_from, table.rate, guesses)
        return even_grid(n, rate, source=table.rate_from, nominal=table.rate)
    hints = [*guesses, *([CATALOGUE["rows_of_means"].advice] if _is_of_positions(table) else [])]
    raise _no_rate(_stamp_table(table, options, name), bool(counters), options, hints)


def _with_settled_rate(table: Table, options: Options, name: str, guesses: list[str]) -> Table:
    """The table with the rate that its doubtful statement means; asks where that is open."""
    doubt = table.rate_doubt
    if doubt is None:
        return table
    inertial = _inertial(_headings(table), options, table.prefix)
    settled = doubt.settled(inertial=inertial, clock=options.kind is not None)
    if settled is None:
        raise InputError(f"{name}: {doubt.asked(inertial=inertial)}")
    guesses.append(settled[1])
    return replace(table, rate=settled[0], rate_from=doubt.where)


def _is_of_positions(table: Table) -> bool:
    """True for a short table that shows gravity from many sides, or names headings or poses beside its readings."""
    n = len(table.columns[0])
    if n > MOST:
        return False
    headings = _headings(table)
    sensors = [c for c, h in zip(table.columns, headings, strict=True) if h.group not in _COMPANIONS]
    named = any(_OF_POSITIONS.fullmatch(h.name) for h in headings)
    return named or are_positions([np.asarray(c.read(0, n), dtype=np.float64) for c in sensors])


def _no_rate(table: StampTable, counters: bool, options: Options, guesses: Sequence[str]) -> InputError:
    """What is missing, and what of the file may settle it."""
    maybe = [] if options.time is not None else growing(table)
    stated = _RATE_IN_NAME.search(table.file)
    value = f"{float(stated[1].replace('p', '.')) * (1e3 if stated[2] else 1.0):g}" if stated else "RATE"
    why = f" (the file name states {value} Hz)" if stated else ", RATE in samples per second"
    rate = f"the rate, --rate {value} (rate={value} in Python){why}"
    if maybe:
        ways = " or ".join(f"--time {table.option(i)}:UNIT" for i in maybe[:3])
        columns = ", ".join(table.label(i) for i in maybe[:3])
        grow = f"column {columns} only grows" if len(maybe) == 1 else f"columns {columns} only grow"
        if not only_grows(table.columns[maybe[0]]):
            grow = f"column {columns} grows and restarts"
        if any(is_counter(table.columns[i]) for i in maybe[:3]):
            grow += " (row numbers, or whole seconds)"
        return InputError(
            f"{table.file}: no column has the name of a time, and the file states no rate, but {grow}. If "
            f"it is time, state its unit (s, ms, us, ns): {ways}; if not, pass {rate}"
        )
    none = "no column is time, as stated," if options.time is not None else "no time column"
    more = " (a column of row numbers is not used as time)" if counters else ""
    return InputError(
        f"{table.file}: {none} and no sample rate in the file{more}. Give {rate}"
        + "".join(f" ({g})" for g in guesses)
    )


#: Places for each sample that numbers may call for; beyond it they were set anew.
_FILLED = 50


@dataclass(frozen=True, slots=True)
class _Counted:
    """A column of sample numbers, as stamps."""

    column: Column
    rate: float
    first: float

    def __len__(self) -> int:
        return len(self.column)

    def read(self, start: int, stop: int) -> Any:
        return (self.column.read(start, stop) - self.first) / self.rate


def _counted(
    counter: Column, rate: float, source: str, nominal: float | None, guesses: list[str]
) -> Timebase:
    """The grid of samples that are numbered: jumps of the number are missing samples."""
    plain = even_grid(len(counter), rate, source=source, nominal=nominal)
    if len(counter) < 2:
        return plain
    stamps: Stamps = _Counted(counter, rate, float(counter.read(0, 1)[0]))
    fitted: Timebase | None
    try:
        fitted = fit_grid(stamps, source=source, unit="samples", nominal=nominal, resolution=0.0)
    except DataQualityError:
        fitted = None
    if fitted is None or abs(fitted.rate / rate - 1.0) > 1e-6 or fitted.length > _FILLED * len(counter):
        guesses.append(
            "the sample numbers are not in order, or jump beyond the length of the record: they do not show the gaps"
        )
        return plain
    keep = ("gaps", "missing", "gap_places", "duplicates", "duplicate_rows", "backward", "backward_rows")
    facts = plain.facts | {key: fitted.facts[key] for key in keep}
    return replace(fitted, rate=rate, facts=facts)


# -- notes -------------------------------------------------------------------------------------------------


def _units_from(table: Table, options: Options, named: Mapping[int, Heading]) -> str:
    if options.unit is not None or options.scale_factor is not None:
        return "argument"
    if table.units_from != "none":
        return table.units_from
    return "header" if any(h.unit for h in named.values()) else "none"


def _notes(table: Table, base: Timebase, units_from: str, guesses: Sequence[str]) -> dict[str, Any]:
    source = {"format": table.format, **table.source}
    notes: dict[str, Any] = {"timebase": base.facts, "source": source}
    lost = [heading for heading in table.left_out if is_of_sensor(read_heading(heading))]
    notes |= {"sensors_left_out": lost} if lost else {}
    if table.text is not None:
        notes["text"] = {**table.text, "units_from": units_from, "guesses": list(guesses)}
    else:
        source |= {"units_from": units_from, "guesses": list(guesses)}
    return notes
