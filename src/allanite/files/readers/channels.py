# SPDX-License-Identifier: BSD-3-Clause
"""Which columns are channels, and in which units: what the file says, and what the caller says instead."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from allanite.errors import InputError
from allanite.files.readers.asked_units import refuse_open_unit, refuse_unit_of_no_sensor
from allanite.files.readers.headings import FITTING, Heading, canonical_group
from allanite.files.readers.integration_times import namesake
from allanite.files.readers.table import Options, Table
from allanite.quantities.units import QuantityKind, parse_scale_factor, parse_unit
from allanite.recording.channel_names import unit_option
from allanite.recording.increment_names import names_increments, unit_per_sample
from allanite.recording.records import Channel, Kind, Sampling

__all__ = ["channels_of", "selected", "units_differ"]

_COEFFICIENTS = ("_N", "_K", "_R", "_Q", "_PSD", "SCALE_FACTOR")
_SAMPLES_IN = {
    "GYRO": "deg/s, deg/h or rad/s",
    "ACCEL": "m/s², g, mg or µg",
    "VOLTAGE": "V",
    "COUNTS": "LSB",
    "SCALE": "LSB or V, with scale_factor= (--scale-factor)",
}
_VOLTS = re.compile(r"[_ .]([mµu]?V)$")


def channels_of(
    table: Table,
    options: Options,
    named: Mapping[int, Heading],
    chosen: Sequence[int],
    guesses: list[str],
) -> tuple[dict[int, Channel], frozenset[int]]:
    """The channel of each chosen column, by its number, and which columns hold increments of an angle or a velocity.

    What had to be guessed is added to `guesses`.

    Raises
    ------
    InputError
        A unit or a scale factor that fits no channel, or a unit that has to be asked for.
    """
    if table.channels is not None:
        ours = {c.name: c for c in table.channels}
        known = {i: ours[table.headings[i]] for i in named if table.headings[i] in ours}
        if len(known) == len(named) and options.unit is None and options.scale_factor is None:
            shown = {i: c.name if c.name.isprintable() else named[i].name for i, c in known.items()}
            return {i: replace(c, name=shown[i]) for i, c in known.items()}, frozenset()
    units = _per_channel(options.unit, named, "unit")
    stated_per_sample = {i for i, h in named.items() if unit_per_sample(units.get(i, h.unit)) is not None}
    units = {i: unit_per_sample(unit) or unit for i, unit in units.items()}
    named = {i: replace(h, unit=unit_per_sample(h.unit) or h.unit) for i, h in named.items()}
    factors = _per_channel(options.scale_factor, named, "scale factor")
    for i, stated in units.items():
        _refuse_no_sample(named[i].name, stated)
    _refuse_unfitting(options.unit, units, named)
    result, increments = {}, set[int]()
    for i in chosen:
        heading, given, factor = named[i], units.get(i), factors.get(i)
        if given is not None and isinstance(options.unit, str) and not _fits(given, heading):
            guesses.append(f"unit {given!r} cannot be that of {heading.name}: the unit of the file is kept")
            given = None
        if given is not None and heading.unit and given != heading.unit:
            guesses.append(f"{heading.name} is read in {given!r} as stated; the file says {heading.unit!r}")
        if isinstance(options.scale_factor, str) and factor is not None and not _factor_fits(factor, heading):
            factor = None
        increment = i in stated_per_sample or names_increments(heading.name)
        if given is None and factor is None and not increment:
            refuse_open_unit(heading)
        if factor is None:
            refuse_unit_of_no_sensor(heading, heading.unit if given is None else given)
        result[i] = _channel(heading, given, factor, options.sampling, guesses)
        if i in stated_per_sample and not result[i].kind.integrated:
            raise InputError(
                f"channel {heading.name}: {result[i].unit!r} is not the unit of an angle or a velocity, which a sample "
                "adds to: write deg/sample, rad/sample or m/s/sample"
            )
        if increment and result[i].kind in (Kind.RATE, Kind.ACCELERATION):
            _refuse_rate_of_increment(result[i], i, table)
        if increment and result[i].kind.integrated:
            increments.add(i)
    return result, frozenset(increments)


def _refuse_rate_of_increment(channel: Channel, place: int, table: Table) -> None:
    """Refuse a rate in a column whose name, and whose own column of intervals, say that it holds increments."""
    interval = namesake(place, table)
    if interval is not None:
        raise InputError(
            f"channel {channel.name}: {channel.unit!r} is the unit of a rate, but by its name and by column "
            f"{table.headings[interval]} beside it the samples are increments over that interval. State the unit of "
            f"the increments, {unit_option([channel.name])}: they are divided by the interval. If the samples are "
            "rates, rename the column"
        )


def _channel(
    heading: Heading, given: str | None, factor: str | None, sampling: Sampling, guesses: list[str]
) -> Channel:
    unit = heading.unit if given is None else given
    if factor is not None and not unit:
        sample = parse_scale_factor(factor).sample
        volts = _VOLTS.search(heading.name)
        if sample is QuantityKind.COUNTS:
            unit = "LSB"
        elif sample is QuantityKind.VOLTAGE:
            unit = volts[1] if volts else "V"
            guesses.append(
                f"{heading.name} is taken to be in {unit}, as its scale factor needs; --unit {heading.name}=mV if not"
            )
    if given is None and unit and not _known(unit):
        guesses.append(f"unit {unit!r} of {heading.name} is not a known unit: read as unknown")
        unit = ""
    if given is None and unit and heading.group != "other" and _of_no_sample(unit):
        guesses.append(
            f"unit {unit!r} of {heading.name} is that of {_of_no_sample(unit)}, not of samples: ignored"
        )
    if given is None and factor is None and heading.group in ("other", "counter", "identity", "time"):
        return Channel(name=heading.name, kind=Kind.OTHER, unit=unit, scale=1.0, sampling=sampling)
    if given is None and not unit and heading.group == "temperature":
        return Channel(name=heading.name, kind=Kind.TEMPERATURE, unit="", scale=1.0, sampling=sampling)
    try:
        return Channel.of(heading.name, unit, sampling=sampling, scale_factor=factor)
    except InputError as error:
        raise InputError(f"channel {heading.name}: {error}") from None


def units_differ(unit: str, stated: str) -> bool:
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
    reason = _of_no_sample(unit)
    if reason:
        begin = parse_unit(unit).quantity.name.split("_")[0]
        raise InputError(
            f"channel {name}: {unit!r} is a unit of {reason}, not of samples: did you mean {_SAMPLES_IN[begin]}?"
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
            f"unit {option!r} fits none of the channels {', '.join(h.name for h in named.values())}; name "
            f"its channels: unit={{'name': 'unit'}} (--unit name=unit)"
        )


def _per_channel(
    option: str | Mapping[str, str] | None, named: Mapping[int, Heading], what: str
) -> dict[int, str]:
    """Column number -> text, from one text for all or a mapping by channel, group or beginning of the name."""
    if option is None:
        return {}
    if isinstance(option, str):
        return {i: option for i, h in named.items() if h.group not in ("other", "temperature", "counter")}
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
    return {QuantityKind.ANGLE_RATE: "gyro", QuantityKind.ACCELERATION: "acc"}.get(
        parse_unit(unit).quantity, ""
    )


def _is_prefix(key: str, heading: Heading) -> bool:
    return heading.name.lower().startswith(key.lower()) and heading.group not in ("other", "temperature")


def selected(wanted: Sequence[str] | None, named: Mapping[int, Heading], table: Table) -> list[int]:
    """Numbers of the columns that are asked for, by name or group, in the order of asking; all, where none is.

    Raises
    ------
    InputError
        A name that there is not, or a file without any channel.
    """
    if not named:
        aside = "".join(f" ({g})" for g in table.guesses)
        raise InputError(f"this {table.format} file has a time column and no other numbers{aside}")
    if wanted is None:
        return list(named)
    if isinstance(wanted, str):
        wanted = [wanted]
    chosen: list[int] = []
    for word in wanted:
        places = [i for i, h in named.items() if _is_name(word, h) or table.headings[i].strip() == word]
        places = places or [i for i, h in named.items() if _is_group(word, h)]
        if not places and word.lower() == table.prefix.lower():  # the kind of the rows means all of them
            places = list(named)
        if not places:
            raise InputError(
                f"no channel {word!r}; there are: {', '.join(h.name for h in named.values())} (or a group: gyro, acc)"
            )
        chosen += [i for i in places if i not in chosen]
    return chosen
