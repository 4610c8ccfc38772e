# SPDX-License-Identifier: BSD-3-Clause
"""Which columns are time, and in what unit: by name, then by monotony, then by magnitude.

A column that counts rows (0, 1, 2, ...) is not time. A guess is never silent: it is written down in words.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.files.readers.column_look import (
    FEWEST,
    begins_anew,
    first_finite,
    is_counter,
    is_even,
    is_row_number,
    look,
    only_grows,
    rises,
    roughness,
    stands_still,
)
from allanite.files.readers.filled_stamps import KeptStamps
from allanite.files.readers.gps_week import WEEK, find_gps_clock, is_slow, names_time_of_week, unit_of_week
from allanite.files.readers.headings import Heading, counted_unit, is_second_part, may_be_time
from allanite.files.readers.packed_time import DAY, find_packed
from allanite.files.readers.row_intervals import holds_increments, interval_unit, is_period, running_sum
from allanite.files.readers.stamp_parts import find_parts, is_fraction, part_places
from allanite.files.readers.stamp_table import Scaled, StampTable, Summed, TimeChoice
from allanite.files.readers.stamp_units import EPOCH, FACTORS, StampSteps, StampUnit, candidates, tell
from allanite.files.readers.stated_time import NO_TIME, StatedTime, parse_step, stated_time
from allanite.files.readers.timebase import Stamps
from allanite.files.readers.turning import unwrapped
from allanite.quantities.units import QuantityKind, parse_unit
from allanite.recording.records import ArrayColumn, Column

__all__ = ["choose_time", "growing"]

_SHORT_NAMES = {1.0: "s", 1e-3: "ms", 1e-6: "us", 1e-9: "ns", 60.0: "min", 3600.0: "h", 86400.0: "d"}
_UNKNOWN_UNIT = re.compile(
    r"[\[({<]_*([^\[\](){}<>]+?)_*[\])}>]$"
)  # at the end of a name: no unit that is known
#: Counters of a clock whose step nobody knows.
_TICKS = re.compile(r"(?:^|_)(?:sys_?)?(?:ticks?|timer|cnt|counter)(?:_|$)|sample_?time_?fine", re.IGNORECASE)


def choose_time(table: StampTable, statement: str | None = None) -> TimeChoice | None:
    """The time column of a table, or None.

    Parameters
    ----------
    table : StampTable
    statement : str, optional
        What the caller says of time, see `allanite.files.readers.stated_time`.

    Raises
    ------
    InputError
        A column that may be time, or whose unit may be one of several; the message names the option that settles it.
        Or `statement` names no column.
    """
    if not table.columns or len(table.columns[0]) == 0:
        return None
    if statement is not None and statement.strip().lower() == NO_TIME:
        return None
    stated = None if statement is None else stated_time(statement, table.raw, table.numbers, table.file)
    intervals = _intervals(table)
    if (stated is None and table.rate_said) or len(intervals) == len(table.columns):
        intervals = {i: unit for i, unit in intervals.items() if not is_period(table.raw[i])}
    if stated is not None and stated.place in intervals:
        return _running(table, stated.place, intervals, stated)
    time = _of_gps(table, stated) or _of_packed(table, stated) or _stamped(table, stated, intervals)
    if time is not None:
        return _beside_intervals(table, time, intervals)
    if intervals:
        return _running(table, min(intervals, key=lambda i: is_period(table.raw[i])), intervals, None)
    pair = _pair_without_names(table)
    if pair is not None:
        return pair
    rising = _without_name(table)
    if rising is None:
        return None
    guesses = [f"column {table.numbers[rising]} has no name but rises evenly: read as time"]
    return _single(table, rising, (rising,), guesses)


def _stamped(table: StampTable, stated: StatedTime | None, intervals: Mapping[int, str]) -> TimeChoice | None:
    """The time in columns that are named as such."""
    headings, columns = table.headings, table.columns
    named = [i for i, h in enumerate(headings) if h.group == "time" or i in table.known_units]
    named = [i for i in named if i not in intervals]
    several = _of_parts(table, named) if _may_be_parts(table, stated) else None
    several = several or _pair(table, named, None if stated is None else stated.place)
    if stated is not None:
        if several is not None and stated.place in several.used and not stated.unit:
            return several
        return _single(table, stated.place, (*{*named, stated.place},), [], stated)
    if several is not None:
        return several
    rising = [i for i in named if rises(columns[i])]
    if not rising:
        maybe = [i for i, h in enumerate(headings) if may_be_time(h.name) and i not in intervals]
        rising = [i for i in maybe if only_grows(columns[i])]
        named += [i for i in rising if i not in named]
    guesses: list[str] = []
    if rising:
        chosen = min(rising, key=lambda i: (roughness(columns[i]), i)) if len(rising) > 1 else rising[0]
        others = [headings[i].name for i in rising if i != chosen]
        if others:
            guesses.append(
                f"several time columns: {headings[chosen].name!r} is used, not {', '.join(others)}"
            )
    elif named and not _could_be_temperature(headings, named):
        chosen = named[0]  # not in order: the time grid refuses it with its rows
    else:
        return None
    return _single(table, chosen, tuple(named), guesses)


def _may_be_parts(table: StampTable, stated: StatedTime | None) -> bool:
    """Whether parts of a date are looked at: not where another column is stated, or their faults would refuse it."""
    if stated is None:
        return True
    return not stated.unit and (stated.place in part_places(table.raw) or stated.place in table.known_units)


def _intervals(table: StampTable) -> dict[int, str]:
    """Columns of the time since the row before, with their units; one that only grows is a clock."""
    units = {i: interval_unit(text) for i, text in enumerate(table.raw)}
    return {
        i: unit
        for i, unit in units.items()
        if unit is not None
        and i not in table.known_units
        and not only_grows(table.columns[i])
        and all((part[1:][np.isfinite(part[1:])] >= 0).all() for part in look(table.columns[i]))
    }


def _running(
    table: StampTable, chosen: int, intervals: Mapping[int, str], stated: StatedTime | None
) -> TimeChoice:
    """Time as the running sum of a column of intervals."""
    column, label = table.columns[chosen], table.label(chosen)
    unit, factor = _stated(intervals[chosen])
    guesses = [f"column {label} is the interval since the previous row: time is its running sum"]
    if stated is not None and stated.factor is not None:
        unit, factor = stated.unit, stated.factor
    elif not unit:
        steps = StampSteps.of(np.concatenate([part[1:] + column.origin for part in look(column)]))
        judged_unit = None if steps is None else tell(steps, 0.0, table.nominal, table.inertial)
        if steps is not None and judged_unit is None and not table.rate_said:
            raise _which_unit(table, chosen, steps, candidates(steps, 0.0, table.inertial))
        unit, factor = (judged_unit.unit, judged_unit.factor) if judged_unit else ("s", 1.0)
        guesses.append(f"column {label}: no unit given, read as {unit}")
    if table.rate_said:
        sums: Column = column  # set aside
    else:
        sums = running_sum(column, label, table.file)
    return TimeChoice(
        stamps=Scaled(sums, factor, 0.0),
        source=f"sum of {table.headings[chosen].name or f'column {table.numbers[chosen]}'}",
        unit=unit,
        start=None,
        used=()
        if holds_increments(table.raw)
        else tuple(i for i in intervals if i == chosen or not is_period(table.raw[i])),
        first_ns=0,
        guesses=tuple(guesses),
    )


def _beside_intervals(table: StampTable, time: TimeChoice, intervals: Mapping[int, str]) -> TimeChoice:
    """The time of a table without the columns that repeat its intervals."""
    left, remarks = [], []
    for i, unit in {} if holds_increments(table.raw) else intervals.items():
        steps = np.concatenate([part[1:] for part in look(table.columns[i])]) + table.columns[i].origin
        typical = _typical(steps) * _stated(unit)[1]
        span = _typical(np.concatenate([np.diff(part) for part in look(time.stamps)]))
        scales = (1.0,) if unit else (1.0, 1e-3, 1e-6, 1e-9)
        agrees = any(abs(typical * scale - span) <= 0.05 * span for scale in scales)
        if not agrees and is_period(table.raw[i]):
            continue
        left.append(i)
        why = (
            "repeats the steps of the time stamps"
            if agrees
            else "does not agree with the steps of the time stamps"
        )
        remarks.append(f"column {table.label(i)}, the interval since the previous row, {why}: left out")
    return replace(time, used=(*time.used, *left), guesses=(*time.guesses, *remarks))


def _typical(steps: NDArray[np.float64]) -> float:
    steps = steps[np.isfinite(steps) & (steps > 0)]
    return float(np.median(steps)) if len(steps) else 0.0


def growing(table: StampTable) -> list[int]:
    """Columns that only grow, whatever they are called: they may be time. One that is named and counts rows is not."""
    return [
        i
        for i, (heading, column) in enumerate(zip(table.headings, table.columns, strict=True))
        if heading.group in ("", "other", "identity", "counter")
        and (only_grows(column) or begins_anew(column))
        and not (heading.name and is_counter(column))
    ]


def _could_be_temperature(headings: Sequence[Heading], named: list[int]) -> bool:
    return len(named) == 1 and headings[named[0]].name == "T"


def _single(
    table: StampTable,
    chosen: int,
    used: tuple[int, ...],
    guesses: list[str],
    stated: StatedTime | None = None,
) -> TimeChoice:
    """The time in one column."""
    column, heading = table.columns[chosen], table.headings[chosen]
    name = heading.name or f"column {table.numbers[chosen]}"
    unit = _unit(table, chosen, guesses, stated)
    first = first_finite(column)
    stamps: Stamps = Scaled(column, unit.factor, first)
    kept = KeptStamps.of(stamps)
    turned = None
    if chosen not in table.known_units and (kept is None or kept.fall()):
        counts = stated is not None and stated.counts
        turned = unwrapped(column, None if counts else unit.factor, stated.turn if stated else None)
    if turned is not None:
        column = turned.column
        guesses.append(f"{name} wraps at {turned.turn:.15g} {unit.unit}, {_times(turned.times)}: unwrapped")
        first = first_finite(column)
        stamps = Scaled(column, unit.factor, first)
    elif kept is not None:
        stamps = kept
    absolute = first + column.origin
    if unit.factor >= 1e-9 and round(unit.factor * 1e9) == unit.factor * 1e9:
        first_ns = round(absolute * round(unit.factor * 1e9))
    else:
        first_ns = round(absolute * unit.factor * 1e9)
    start = None if unit.epoch is None else first_ns - unit.epoch * 10**9
    spacing = None
    if column.dtype.kind == "f" and column.dtype.itemsize < 8:
        last = float(np.abs(column.read(len(column) - 1, len(column))).max())
        spacing = float(np.spacing(column.dtype.type(max(abs(first), last)))) * unit.factor
    return TimeChoice(
        stamps=stamps,
        source=name,
        unit=unit.unit,
        start=start,
        used=used,
        first_ns=first_ns,
        resolution=spacing,
        guesses=tuple(guesses),
    )


def _unit(table: StampTable, chosen: int, guesses: list[str], stated: StatedTime | None) -> StampUnit:
    """The unit of a time column: as the caller says, as the file says, or as its values tell."""
    column, heading = table.columns[chosen], table.headings[chosen]
    first = first_finite(column) + column.origin
    if chosen in table.questions:
        raise InputError(table.questions[chosen])
    if chosen in table.known_units:
        return StampUnit(table.known_units[chosen], 1e-9, _since_1970(first, 1e-9))
    if stated is not None and stated.factor is not None:
        short = stated.unit if stated.counts else _SHORT_NAMES.get(stated.factor, stated.unit)
        return StampUnit(short, stated.factor, _since_1970(first, stated.factor))
    unit, factor = _stated(heading.unit)
    inside = _UNKNOWN_UNIT.search(heading.name)
    if not unit and inside:
        counted = counted_unit(inside[1].replace("_", " "))
        step = parse_step(counted)
        unit, factor = (inside[1], step) if step else _stated(counted)
    if unit:
        return StampUnit(unit, factor, _since_1970(first, factor))
    steps = StampSteps.of(np.concatenate([np.diff(part) for part in look(column)]))
    if names_time_of_week(heading.name) and table.nominal is None:
        unit, factor = unit_of_week(column)
        if unit and steps and is_slow(column, factor) and not table.rate_said:
            raise _which_unit(table, chosen, steps, ["s", "ms"])
        if unit:
            guesses.append(f"time column {table.label(chosen)}: no unit given, read as {unit} of a GPS week")
            return StampUnit(unit, factor)
    if steps is None:
        return StampUnit("s", 1.0)  # no stamp is later than another: the time grid refuses them
    judged_unit = tell(steps, first, table.nominal, table.inertial)
    ticks = (
        table.nominal is None
        and (judged_unit is None or judged_unit.epoch is None)
        and _TICKS.search(heading.name)
    )
    if (judged_unit is None or ticks) and not table.rate_said:
        raise _which_unit(table, chosen, steps, candidates(steps, first, table.inertial), bool(ticks))
    judged_unit = judged_unit or StampUnit("s", 1.0)
    if judged_unit.epoch is None:
        reason = f"the unit {inside[1]!r} is unknown" if inside else "no unit given"
        guesses.append(f"time column {table.label(chosen)}: {reason}, read as {judged_unit.unit}")
    return judged_unit


def _which_unit(
    table: StampTable, chosen: int, steps: StampSteps, fitting: Sequence[str], ticks: bool = False
) -> InputError:
    """The question that the values of a time column leave open."""
    fitting = fitting or list(FACTORS)[:4]
    option = table.option(chosen)
    unknown = _UNKNOWN_UNIT.search(table.headings[chosen].name)
    why = f"the unit {unknown[1]!r}, which is unknown" if unknown else "no unit"
    ways = " or ".join(f"--time {option}:{unit} ({steps.rate_text(unit)})" for unit in fitting)
    if ticks:
        ways = f"--time '{option}:STEP', as in --time '{option}:1/1000 s', or {ways}"
    return InputError(
        f"{table.file}: time column {table.label(chosen)} has {why}, and its values fit several. State "
        f"which: {ways}; "
        f"in Python time='{option}:{fitting[0]}'"
    )


def _since_1970(first: float, factor: float) -> int | None:
    return 0 if EPOCH[0] <= first * factor <= EPOCH[1] else None


def _stated(unit: str) -> tuple[str, float]:
    if not unit:
        return "", 1.0
    try:
        factor = parse_unit(unit, QuantityKind.TIME).factor
    except InputError:
        return "", 1.0
    return _SHORT_NAMES.get(factor, unit), factor


# -- two columns -------------------------------------------------------------------------------------------


def _of_gps(table: StampTable, stated: StatedTime | None) -> TimeChoice | None:
    """GPS week and time of week; where the week does not go on with it, the time of week alone."""
    headings, columns = table.headings, table.columns
    clock = find_gps_clock(headings, columns, [_stated(h.unit) for h in headings])
    if clock is None or (stated is not None and stated.place not in (clock.week, clock.within)):
        return None
    if stated is not None and stated.unit and stated.place == clock.week:
        return None
    week, within = table.label(clock.week), table.label(clock.within)
    used = (clock.within, *(i for i, h in enumerate(headings) if h.group == "time" and i != clock.within))
    used = tuple(dict.fromkeys((*used, clock.week)))
    if not clock.steps:
        remark = f"column {week}, a GPS week, does not increase where {within} restarts: left out"
        of_within = stated if stated is not None and stated.place == clock.within else None
        return _single(table, clock.within, used, [remark], of_within)
    unit, factor = clock.unit, clock.factor
    if stated is not None and stated.factor is not None:
        unit, factor = stated.unit, stated.factor
    elif clock.open and not table.rate_said:
        steps = StampSteps.of(np.concatenate([np.diff(part) for part in look(columns[clock.within])]))
        raise _which_unit(table, clock.within, steps or StampSteps(1.0, True), ["s", "ms"])
    time = _sum(
        columns, headings, (clock.week, WEEK), (clock.within, factor), list(used), "gps week + s", None
    )
    if headings[clock.week].name:
        return time
    remark = f"column {week} is taken as the GPS week of column {within}, in {unit}: together they are time"
    return replace(time, source=f"column {week} + column {within}", guesses=(remark,))


def _of_packed(table: StampTable, stated: StatedTime | None) -> TimeChoice | None:
    """Time of day packed into numbers, hhmmss.sss, with the date beside it."""
    headings = table.headings
    if stated is not None and stated.factor is not None:
        return None
    packed = find_packed(headings, table.columns, table.known_units)
    if packed is None or (stated is not None and stated.place not in (packed.clock, packed.date)):
        return None
    day = packed.date
    column = ArrayColumn(packed.seconds)
    first, first_day = first_finite(column), packed.first_day
    stamps: Stamps = Scaled(column, 1.0, first)
    if (
        day is None
        and (day := next((i for i in table.known_units if _whole_days(table.columns[i])), None)) is not None
    ):
        if day in table.questions:
            raise InputError(table.questions[day])
        date = Scaled(table.columns[day], 1e-9, first_finite(table.columns[day]))
        first_day = round((date.first + table.columns[day].origin) / (DAY * 1e9))
        stamps = Summed(date, Scaled(ArrayColumn(packed.seconds % DAY), 1.0, first))
    places = [i for i in (day, packed.clock) if i is not None]
    since = round(first * 1e9) + (first_day or 0) * round(DAY * 1e9)
    form = "hhmmss" if day is None else "date + hhmmss"
    named = (i for i, h in enumerate(headings) if h.group == "time" or i in table.known_units)
    return TimeChoice(
        stamps=stamps,
        source=" + ".join(headings[i].name or f"column {table.numbers[i]}" for i in places),
        unit=form,
        start=None if first_day is None else since,
        used=tuple(dict.fromkeys((*places, *named))),
        first_ns=since,
        guesses=(
            f"column {' and '.join(table.label(i) for i in places)}: read as {form}, packed into numbers",
        ),
    )


def _pair(table: StampTable, named: list[int], one: int | None = None) -> TimeChoice | None:
    """Whole seconds with what is finer; a column that is stated is one of the two."""
    headings, columns = table.headings, table.columns
    for fine in named:
        unit, factor = _stated(headings[fine].unit)
        part = is_second_part(headings[fine].name) and unit in ("", "s")
        if (unit not in ("ms", "us", "ns") and not part) or fine in table.known_units:
            continue
        for coarse in named:
            if coarse == fine or one not in (None, coarse, fine):
                continue
            seconds = _whole_seconds(table, coarse)
            if seconds is None or not is_fraction(look(columns[coarse]), look(columns[fine]), factor):
                continue
            if coarse in table.questions:
                raise InputError(table.questions[coarse])
            first = (first_finite(columns[coarse]) + columns[coarse].origin) * seconds
            start = round(first) * 10**9 + round(first_finite(columns[fine]) * factor * 1e9)
            absolute = start if EPOCH[0] <= first <= EPOCH[1] else None
            unit = f"{table.known_units.get(coarse, 's')} + {unit or 's'}"
            return _sum(columns, headings, (coarse, seconds), (fine, factor), named, unit, absolute)
    return None


def _whole_seconds(table: StampTable, place: int) -> float | None:
    """Seconds in a unit of a column that rises by whole seconds; None for another one, as ns since 1970."""
    column = table.columns[place]
    dated = place in table.known_units
    if not dated and table.headings[place].unit not in ("", "s"):
        return None
    second = 1e9 if dated else 1.0
    values = np.concatenate([part[np.isfinite(part)] for part in look(column)])
    if not rises(column) and (np.diff(values) != 0).any():
        return None
    if not dated and len(values) and abs(values[0] + column.origin) > EPOCH[1]:
        return None
    return (
        1.0 / second
        if len(values) and ((values % second + column.origin % second) % second == 0).all()
        else None
    )


def _of_parts(table: StampTable, named: list[int]) -> TimeChoice | None:
    """Time in the parts of a date; None where another column that rises is as good."""
    columns = table.columns
    parts = find_parts(
        table.raw, columns, lambda i: [part + columns[i].origin for part in look(columns[i])], table.file
    )
    if parts is None:
        return None
    day = next((i for i in table.known_units if _whole_days(columns[i])), None) if parts.turn == DAY else None
    if any(rises(columns[i]) for i in named if i not in (day, *parts.places)):
        return None
    names = [table.headings[i].name for i in parts.places]
    first = first_finite(parts.column)
    if day is not None:
        if day in table.questions:
            raise InputError(table.questions[day])
        date = Scaled(columns[day], 1e-9, first_finite(columns[day]))
        since = round(date.first + columns[day].origin) + round(first * 1e9)
        return TimeChoice(
            stamps=Summed(date, Scaled(parts.column, 1.0, first)),
            source=" + ".join([table.headings[day].name, *names]),
            unit=f"{table.known_units[day]} + s",
            start=since,
            used=tuple({*named, *parts.places}),
            first_ns=since,
        )
    turned = None if parts.turn is None else unwrapped(parts.column, 1.0, parts.turn)
    column = parts.column if turned is None else turned.column
    first = first_finite(column)
    since = round(first * 1e9) + (parts.epoch or 0) * 10**9
    return TimeChoice(
        stamps=Scaled(column, 1.0, first),
        source=" + ".join(names),
        unit="s",
        start=None if parts.epoch is None else since,
        used=tuple({*named, *parts.places}),
        first_ns=since,
        guesses=() if turned is None else (f"{names[0]} restarts, {_times(turned.times)}: unwrapped",),
    )


def _whole_days(column: Column) -> bool:
    """Dates without a time of day."""
    day = DAY * 1e9
    values = np.concatenate([part[np.isfinite(part)] for part in look(column)])
    return len(values) > 0 and bool(((values % day + column.origin % day) % day == 0).all())


def _sum(
    columns: Sequence[Column],
    headings: Sequence[Heading],
    coarse: tuple[int, float],
    fine: tuple[int, float],
    named: list[int],
    unit: str,
    start: int | None,
) -> TimeChoice:
    parts = [Scaled(columns[i], f, first_finite(columns[i])) for i, f in (coarse, fine)]
    source = f"{headings[coarse[0]].name} + {headings[fine[0]].name}"
    first_ns = sum(round((p.first + p.column.origin) * round(p.factor * 1e9)) for p in parts)
    return TimeChoice(
        stamps=Summed(*parts), source=source, unit=unit, start=start, used=tuple(named), first_ns=first_ns
    )


def _pair_without_names(table: StampTable) -> TimeChoice | None:
    """Seconds since 1970 and what is finer, in neighboring columns without names."""
    headings, columns = table.headings, table.columns
    for coarse, fine in pairwise(range(len(columns))):
        first = first_finite(columns[coarse]) + columns[coarse].origin
        named = headings[coarse].name or headings[fine].name
        if named or not EPOCH[0] <= first <= EPOCH[1] or _whole_seconds(table, coarse) is None:
            continue
        highest = max(float(np.nanmax(part, initial=0.0)) for part in look(columns[fine]))
        unit = next((u for u in ("ms", "us", "ns") if 0.5 < highest * FACTORS[u] < 1.0), None)
        if unit is None or not is_fraction(look(columns[coarse]), look(columns[fine]), FACTORS[unit]):
            continue
        numbers = f"{table.numbers[coarse]} and {table.numbers[fine]}"
        return replace(
            _sum(
                columns,
                headings,
                (coarse, 1.0),
                (fine, FACTORS[unit]),
                [coarse, fine],
                f"s + {unit}",
                round(first) * 10**9 + round(first_finite(columns[fine]) * FACTORS[unit] * 1e9),
            ),
            source=f"columns {numbers}",
            guesses=(f"columns {numbers} have no names: read as seconds since 1970 and {unit}",),
        )
    return None


def _without_name(table: StampTable) -> int | None:
    """A column without a name that rises evenly: the first one that does not count rows or stand still, or the last.

    Raises
    ------
    InputError
        The first one only grows, but unevenly: it may be time.
    """
    headings, columns = table.headings, table.columns
    if len(columns) < 2 or len(columns[0]) < FEWEST:
        return None
    leading = next((i for i, c in enumerate(columns) if not (is_row_number(c) or stands_still(c))), None)
    for i in dict.fromkeys((leading, len(columns) - 1)):
        if i is None or headings[i].name or is_row_number(columns[i]):
            continue
        if rises(columns[i]) and all(is_even(p) for p in look(columns[i])):
            return i
        if i == leading and only_grows(columns[i]) and not table.rate_said:
            raise _is_it_time(table, i)
    return None


def _is_it_time(table: StampTable, place: int) -> InputError:
    number = table.numbers[place]
    return InputError(
        f"{table.file}: column {number} has no name and increases unevenly. If it is time, state its unit: --time "
        f"{number}:s (or ms, us, ns); if it is a channel, pass the sample rate: --time {NO_TIME} --rate RATE"
    )


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
