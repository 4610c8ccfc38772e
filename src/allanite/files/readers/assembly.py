# SPDX-License-Identifier: BSD-3-Clause
"""From the columns of a file to a Recording: one place for all formats.

A reader returns a `Table`: columns as they stand in the file, and what the file says about them. Here the
columns become time, channels and companions, units are settled, and the samples are put on an even grid.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from allanite.errors import DataQualityError, InputError
from allanite.files.readers.asked_units import refuse_open_unit
from allanite.files.readers.clock_table import as_clock
from allanite.files.readers.column_look import is_counter
from allanite.files.readers.headings import FITTING, Heading, canonical_group, read_heading, with_unit
from allanite.files.readers.numbering import clocks_beside, numbering_of, unseen_by_stamps
from allanite.files.readers.part import Rows, rows_between
from allanite.files.readers.stamp_table import StampTable, TimeChoice
from allanite.files.readers.stamps import choose_time, growing
from allanite.files.readers.timebase import Stamps, Timebase, even_grid, fit_grid
from allanite.plain_files.limits import COLUMNS, refuse_more
from allanite.quantities.units import Quantity, parse_scale_factor, parse_unit
from allanite.recording.position_rows import ADVICE, MOST, are_positions
from allanite.recording.records import Channel, Column, Kind, Recording, Sampling, Spliced, checked_rate

__all__ = ["Options", "Table", "assemble", "time_of"]

_INERTIAL = {Quantity.ANGLE_RATE, Quantity.ANGLE, Quantity.ACCELERATION, Quantity.VELOCITY}
_COEFFICIENTS = ("_N", "_K", "_R", "_Q", "_PSD", "SCALE_FACTOR")
_SAMPLES_IN = {
    "GYRO": "deg/s, deg/h or rad/s",
    "ACCEL": "m/s², g, mg or µg",
    "VOLTAGE": "V",
    "COUNTS": "LSB",
    "SCALE": "LSB or V, with scale_factor= (--scale-factor)",
}
#: A rate in the name of a file: static_200Hz.csv, imu-1kHz, 62p5hz.
_RATE_IN_NAME = re.compile(r"(?<![\d.])(\d+(?:[.p]\d+)?)[ _-]?(k?)(?:hz|sps)(?![a-z])", re.IGNORECASE)
#: A column that numbers positions, or says how they lay.
_OF_POSITIONS = re.compile(
    r"(?:pose|position|heading|azimuth)(?:_?(?:no|nr|id|number|name|deg))?", re.IGNORECASE
)
_COMPANIONS = ("other", "temperature", "counter", "identity", "time")
_VOLTS = re.compile(r"[_ .]([mµu]?V)$")


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What the caller says about a file; see `allanite.files.readers.read`."""

    unit: str | Mapping[str, str] | None = None
    rate: float | None = None
    channels: Sequence[str] | None = None
    sampling: Sampling = "mean"
    scale_factor: str | Mapping[str, str] | None = None
    delimiter: str | None = None
    decimal: str | None = None
    topic: str | None = None
    variable: str | None = None
    layout: str | os.PathLike[str] | Mapping[str, Any] | None = None
    time: str | None = None
    start: float | None = None
    stop: float | None = None
    kind: str | None = None
    carrier: float | None = None

    @property
    def channel_names(self) -> list[str] | None:
        """The channels that are asked for; one alone may be given without a list."""
        if self.channels is None:
            return None
        return [self.channels] if isinstance(self.channels, str) else list(self.channels)


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Columns of a file, before anybody has said which is what.

    Attributes
    ----------
    format : str
        Name of the format, for messages and notes.
    headings : tuple of str
        As they stand in the file; "" where there is none.
    columns : tuple of Column
        One per heading, equally long.
    numbers : tuple of int
        Numbers of the columns in the file, from 1, where some of the file are not among them.
    units : tuple of str
        Units that the file gives apart from the headings (a units row, metadata); "" where there is none.
    units_from : str
        Where `units` come from: "units row", "preamble", "cells" (behind the numbers), "metadata", "layout", "none".
    time_units : dict of column number to unit
        Columns that hold dates, already in ns since 1970 UTC.
    questions : dict of column number to str
        What is asked of the caller where such a column is time: the order of its dates.
    stamps : TimeChoice or None
        Time that the reader knows for sure (message stamps).
    rate : float or None [Hz]
        Rate that the file states.
    rate_from : str
        Where it states it.
    text : dict or None
        Facts about a text file.
    source : dict
        Facts about the file.
    prefix : str
        Begins the names of columns that have none: the kind of the rows.
    guesses : tuple of str
        What had to be guessed, in words.
    channels : tuple of Channel or None
        Channels in full, where the file is one of our own.
    """

    format: str
    headings: tuple[str, ...]
    columns: tuple[Column, ...]
    numbers: tuple[int, ...] = ()
    units: tuple[str, ...] = ()
    units_from: str = "none"
    time_units: dict[int, str] = field(default_factory=dict)
    questions: dict[int, str] = field(default_factory=dict)
    stamps: TimeChoice | None = None
    rate: float | None = None
    rate_from: str = ""
    start: int | None = None
    text: dict[str, Any] | None = None
    source: dict[str, Any] = field(default_factory=dict)
    prefix: str = ""
    guesses: tuple[str, ...] = ()
    channels: tuple[Channel, ...] | None = None
    history: tuple[Mapping[str, Any], ...] = ()


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
        raise DataQualityError(f"{name}: there are no samples in this {table.format} file")
    refuse_more(
        len(table.columns), COLUMNS, "columns", name, "Write those that are needed to a file of their own"
    )
    if options.kind is not None:
        table, options = as_clock(table, options, name)
    headings = _headings(table)
    time = time_of(table, options, name)
    rows = None
    if time is not None and options.rate is None and (options.start, options.stop) != (None, None):
        rows = rows_between(time.stamps, options.start, options.stop)
        table, time = _part(table, rows), _time_of_part(time, rows)
    guesses = [*table.guesses, *(time.guesses if time else ())]
    used = set(time.used) if time else set()
    counters, told = numbering_of(headings, table.columns, used, timed=time is not None)
    guesses += told
    used |= {counter.place for counter in counters}
    if time is not None and options.kind is None:
        used |= clocks_beside(time.stamps, headings, table.columns, used, guesses)
    places = [i for i in range(len(headings)) if i not in used]
    named = _named(headings, places, table.prefix)
    base = _grid(table, options, time, [counter.numbers for counter in counters], name, guesses)
    if time and options.rate is None:
        guesses += unseen_by_stamps(counters, base.facts["missing"])
    chosen = _selected(options.channels, named, table)
    channels = _channels(table, options, named, chosen, guesses)
    columns = tuple(_placed(table.columns[i], base) for i in chosen)
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
        other = {channels[i].name: named[i].unit for i in chosen if _differs(channels[i].unit, named[i].unit)}
        step |= {"units_set_aside": other} if other else {}
    history = [*table.history, step]
    if rows is not None:
        history.append({"step": "window", "start_s": rows.first, "stop_s": rows.last + 1.0 / base.rate})
    recording = Recording(
        channels=tuple(channels[i] for i in chosen),
        columns=columns,
        rate=base.rate,
        start=table.start if table.start is not None else (time.start if time else None),
        history=tuple(history),
        source=name,
        notes=_notes(table, base, units_from, guesses),
    )
    if rows is not None or (options.start, options.stop) == (None, None):
        return recording
    return recording.window(options.start, options.stop)


def _part(table: Table, rows: Rows) -> Table:
    start = None if table.start is None else table.start + round(rows.first * 1e9)
    return replace(table, columns=tuple(rows.of_column(c) for c in table.columns), start=start)


def _time_of_part(time: TimeChoice, rows: Rows) -> TimeChoice:
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
    said = options.unit.values() if isinstance(options.unit, Mapping) else [options.unit or ""]
    return any(
        group in FITTING for group in (read_heading(prefix).group, *(h.group for h in headings))
    ) or any(
        _known(unit) and parse_unit(unit).quantity in _INERTIAL
        for unit in (*said, *(h.unit for h in headings))
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
    own = dict(zip(nameless, _names_of_kind(prefix, len(nameless)), strict=True)) if prefix else {}
    seen: dict[str, int] = {}
    result = {}
    for number, i in enumerate(places):
        heading = replace(read_heading(own[i]), unit=headings[i].unit) if i in own else headings[i]
        name = heading.name or f"ch{number}"
        seen[name] = seen.get(name, 0) + 1
        result[i] = replace(heading, name=name if seen[name] == 1 else f"{name}_{seen[name]}")
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
        return even_grid(n, rate, source="rate argument", nominal=table.rate)
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
    if table.rate is not None:
        rate = checked_rate(table.rate)
        if counters:
            return _counted(counters[0], rate, table.rate_from, table.rate, guesses)
        return even_grid(n, rate, source=table.rate_from, nominal=table.rate)
    hints = [*guesses, *([ADVICE] if _is_of_positions(table) else [])]
    raise _no_rate(_stamp_table(table, options, name), bool(counters), options, hints)


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
    why = f" (the name of the file says {value} Hz)" if stated else ", RATE in samples per second"
    rate = f"the rate, --rate {value} (rate={value} in Python){why}"
    if maybe:
        ways = " or ".join(f"--time {table.option(i)}:UNIT" for i in maybe[:3])
        columns = ", ".join(table.label(i) for i in maybe[:3])
        grow = f"column {columns} only grows" if len(maybe) == 1 else f"columns {columns} only grow"
        if any(is_counter(table.columns[i]) for i in maybe[:3]):
            grow += " (row numbers, or whole seconds)"
        return InputError(
            f"{table.file}: no column is named as time, and the file states no rate, but {grow}. If that is time, say "
            f"so with its unit (s, ms, us, ns): {ways}; if not, give {rate}"
        )
    none = "no column is time, as was said," if options.time is not None else "no time column"
    more = " (a column of row numbers is not taken for time)" if counters else ""
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
            "the sample numbers are not in order, or jump beyond the length of the record: gaps cannot be told from "
            "them"
        )
        return plain
    keep = ("gaps", "missing", "gap_places", "duplicates", "duplicate_rows", "backward", "backward_rows")
    facts = plain.facts | {key: fitted.facts[key] for key in keep}
    return replace(fitted, rate=rate, facts=facts)


# -- channels ----------------------------------------------------------------------------------------------


def _channels(
    table: Table,
    options: Options,
    named: Mapping[int, Heading],
    chosen: Sequence[int],
    guesses: list[str],
) -> dict[int, Channel]:
    if table.channels is not None:
        ours = {c.name: c for c in table.channels}
        known = {i: ours[table.headings[i]] for i in named if table.headings[i] in ours}
        if len(known) == len(named) and options.unit is None and options.scale_factor is None:
            shown = {i: c.name if c.name.isprintable() else named[i].name for i, c in known.items()}
            return {i: replace(c, name=shown[i]) for i, c in known.items()}
    units = _per_channel(options.unit, named, "unit")
    factors = _per_channel(options.scale_factor, named, "scale factor")
    for i, said in units.items():
        _refuse_no_sample(named[i].name, said)
    _refuse_unfitting(options.unit, units, named)
    result = {}
    for i in chosen:
        heading, given, factor = named[i], units.get(i), factors.get(i)
        if given is not None and isinstance(options.unit, str) and not _fits(given, heading):
            guesses.append(f"unit {given!r} cannot be that of {heading.name}: left as the file has it")
            given = None
        if given is not None and heading.unit and given != heading.unit:
            guesses.append(f"{heading.name} is read in {given!r} as was said; the file says {heading.unit!r}")
        if isinstance(options.scale_factor, str) and factor is not None and not _factor_fits(factor, heading):
            factor = None
        if given is None and factor is None:
            refuse_open_unit(heading)
        result[i] = _channel(heading, given, factor, options.sampling, guesses)
    return result


def _channel(
    heading: Heading, given: str | None, factor: str | None, sampling: Sampling, guesses: list[str]
) -> Channel:
    unit = heading.unit if given is None else given
    if factor is not None and not unit:
        sample = parse_scale_factor(factor).sample
        volts = _VOLTS.search(heading.name)
        if sample is Quantity.COUNTS:
            unit = "LSB"
        elif sample is Quantity.VOLTAGE:
            unit = volts[1] if volts else "V"
            guesses.append(
                f"{heading.name} is taken to be in {unit}, as its scale factor needs; --unit {heading.name}=mV if not"
            )
    if given is None and unit and not _known(unit):
        guesses.append(f"unit {unit!r} of {heading.name} is not known: read as unknown")
        unit = ""
    if given is None and unit and heading.group != "other" and _of_no_sample(unit):
        guesses.append(
            f"unit {unit!r} of {heading.name} is that of {_of_no_sample(unit)}, not of samples: left aside"
        )
    if given is None and factor is None and heading.group in ("other", "counter", "identity", "time"):
        return Channel(name=heading.name, kind=Kind.OTHER, unit=unit, scale=1.0, sampling=sampling)
    if given is None and not unit and heading.group == "temperature":
        return Channel(name=heading.name, kind=Kind.TEMPERATURE, unit="", scale=1.0, sampling=sampling)
    try:
        return Channel.of(heading.name, unit, sampling=sampling, scale_factor=factor)
    except InputError as error:
        raise InputError(f"channel {heading.name}: {error}") from None


def _differs(unit: str, stated: str) -> bool:
    """Not the same unit, whatever it is called."""
    if not stated or not _known(stated) or unit == stated:
        return False
    mine, other = parse_unit(unit) if unit and _known(unit) else None, parse_unit(stated)
    return mine is None or (mine.quantity, mine.factor) != (other.quantity, other.factor)


def _known(unit: str) -> bool:
    try:
        parse_unit(unit)
    except InputError:
        return False
    return True


def _of_no_sample(unit: str) -> str:
    """What a unit measures that no sample is in: a coefficient of noise, or a scale factor; "" of all others."""
    if unit == "unknown" or not _known(unit):
        return ""
    quantity = parse_unit(unit).quantity
    return quantity.value if quantity.name.endswith(_COEFFICIENTS) else ""


def _refuse_no_sample(name: str, unit: str) -> None:
    said = _of_no_sample(unit)
    if said:
        begin = parse_unit(unit).quantity.name.split("_")[0]
        raise InputError(
            f"channel {name}: {unit!r} is a unit of {said}, not of samples: did you mean {_SAMPLES_IN[begin]}?"
        )


def _fits(unit: str, heading: Heading) -> bool:
    if unit in ("", "unknown"):
        return True
    if heading.group in FITTING:
        return parse_unit(unit).quantity in FITTING[heading.group]
    return heading.group == ""


def _factor_fits(factor: str, heading: Heading) -> bool:
    if heading.group in FITTING:
        return parse_scale_factor(factor).physical in FITTING[heading.group]
    return heading.group == ""


def _refuse_unfitting(
    option: str | Mapping[str, str] | None, units: Mapping[int, str], named: Mapping[int, Heading]
) -> None:
    if isinstance(option, str) and units and not any(_fits(u, named[i]) for i, u in units.items()):
        raise InputError(
            f"unit {option!r} fits none of the channels {', '.join(h.name for h in named.values())}; name the "
            "channels it is meant for: unit={'name': 'unit'} (--unit name=unit)"
        )


def _per_channel(
    option: str | Mapping[str, str] | None, named: Mapping[int, Heading], what: str
) -> dict[int, str]:
    """Column number -> text, from one text for all or a mapping by channel, group or beginning of the name."""
    if option is None:
        return {}
    if isinstance(option, str):
        return {i: option for i, h in named.items() if h.group not in ("other", "temperature", "counter")}
    if not isinstance(option, Mapping):
        raise InputError(f"{what} must be a text or a mapping of channel or group to text, not {option!r}")
    result: dict[int, str] = {}
    for rank in (_is_prefix, _is_group, _is_name):  # the closest match is written last
        for key, text in option.items():
            result.update({i: str(text) for i, h in named.items() if rank(str(key), h)})
    for key in option:
        if not any(rank(str(key), h) for rank in (_is_prefix, _is_group, _is_name) for h in named.values()):
            groups = sorted({h.group for h in named.values()} & {"gyro", "acc"})
            raise InputError(
                f"{what} for {key!r}: there is no such channel or group; channels: "
                f"{', '.join(h.name for h in named.values())}; groups: {', '.join(groups) or 'none'}"
            )
    return result


def _is_name(key: str, heading: Heading) -> bool:
    return key.lower() == heading.name.lower()


def _is_group(key: str, heading: Heading) -> bool:
    if key.lower() in {k.value for k in Kind} and heading.unit and _known(heading.unit):
        return Channel.of("x", heading.unit).kind.value == key.lower()
    group = heading.group or _group_by_unit(heading.unit)
    return group != "" and canonical_group(key) == group


def _group_by_unit(unit: str) -> str:
    """The group of a name that says nothing (w_RS_S_x), where the unit leaves no doubt."""
    if not unit or not _known(unit):
        return ""
    return {Quantity.ANGLE_RATE: "gyro", Quantity.ACCELERATION: "acc"}.get(parse_unit(unit).quantity, "")


def _is_prefix(key: str, heading: Heading) -> bool:
    return heading.name.lower().startswith(key.lower()) and heading.group not in ("other", "temperature")


def _selected(wanted: Sequence[str] | None, named: Mapping[int, Heading], table: Table) -> list[int]:
    if not named:
        aside = "".join(f" ({g})" for g in table.guesses)
        raise InputError(
            f"this {table.format} file holds a time column and nothing else that is a number{aside}"
        )
    if wanted is None:
        return list(named)
    if isinstance(wanted, str):
        wanted = [wanted]
    chosen: list[int] = []
    for word in wanted:
        found = [i for i, h in named.items() if _is_name(word, h) or table.headings[i].strip() == word]
        found = found or [i for i, h in named.items() if _is_group(word, h)]
        if not found and word.lower() == table.prefix.lower():  # the kind of the rows means all of them
            found = list(named)
        if not found:
            raise InputError(
                f"no channel {word!r}; there are: {', '.join(h.name for h in named.values())} (or a group: gyro, acc)"
            )
        chosen += [i for i in found if i not in chosen]
    return chosen


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
    if table.text is not None:
        notes["text"] = {**table.text, "units_from": units_from, "guesses": list(guesses)}
    else:
        source |= {"units_from": units_from, "guesses": list(guesses)}
    return notes
