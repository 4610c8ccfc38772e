# Specification: National Instruments, "TDMS File Format Internal Structure"; waveform properties wf_*.
# SPDX-License-Identifier: BSD-3-Clause
"""LabVIEW TDMS files, through npTDMS, in a child process.

One group is read: its channels of the greatest length, scaled as their properties say (raw values with slopes, tables,
DAQmx scalers). Time is `wf_increment`, where no channel holds time stamps; units are `unit_string`. Copies that
SignalExpress keeps at lower rates (DecimationLevel) are never read unasked.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, InputError
from allanite.files.readers.contents import FilePart, choose_part, listed
from allanite.files.readers.headings import read_heading
from allanite.files.readers.packed_values import as_stored
from allanite.files.readers.sandbox import run
from allanite.files.readers.spool import GrowingColumn, refuse_bomb
from allanite.files.readers.stated_rate import StatedRate, chosen_rate, keyed_statement
from allanite.files.readers.table import Options, Table
from allanite.files.readers.tdms_starts import starts_of, times_of
from allanite.plain_files.extras import require
from allanite.plain_files.limits import PARTS, refuse_more
from allanite.plain_files.regular_file import open_regular, regular
from allanite.recording.records import ArrayColumn

NAME: Final = "LabVIEW TDMS"
OPTIONS: Final = frozenset({"variable"})

_MAGIC = b"TDSm"
_SPARE_MEMORY = 512 << 20
_PIECE = 1 << 20  # samples read at once
#: Before this a start time was not set: LabVIEW counts from 1904 [ns since 1970].
_NOT_SET = 0
_UNIT_KEYS: Final = ("unit_string", "NI_UnitDescription", "NI_Unit", "Unit", "unit")
_STEP_KEYS: Final = ("wf_increment",)
_START: Final = "wf_start_time"
_TIME: Final = "time"  # heading of the times of several acquisitions

Arrays = dict[str, NDArray[Any]]


def sniff(head: bytes, path: Path) -> bool:
    """True for the tag of a first segment."""
    return head.startswith(_MAGIC)


def read(path: Path, options: Options) -> Table:
    """Read one group; ``variable`` is its name, or "group/channel".

    Raises
    ------
    InputError
        The extra `labview` is not installed; no such group; channels of different rates.
    FormatError
        A damaged file.
    LimitError
        It promises more samples than it can hold.
    DataQualityError
        No samples.
    """
    require("nptdms", "labview", f"{path.name} is a LabVIEW TDMS file; reading it")
    size = path.stat().st_size
    facts, arrays = run(
        f"{__name__}:table_in",
        [str(path), options.variable, options.channel_names],
        imports=["nptdms"],
        memory=_SPARE_MEMORY + 40 * size,
        seconds=20 + size / 5e6,
        name=path.name,
    )
    columns = [arrays[str(i)] for i in range(len(facts["headings"]))]
    if not columns or len(columns[0]) == 0:
        raise DataQualityError(f"{path.name}: the group {facts['source']['group']} has no samples")
    time_units = {}
    for i, column in enumerate(columns):
        if column.dtype.kind == "M":
            time_units[i] = "iso8601"
            columns[i] = column.astype("datetime64[ns]").view(np.int64)
    return Table(
        format=NAME,
        headings=tuple(facts["headings"]),
        columns=tuple(ArrayColumn(c) for c in columns),
        units=tuple(facts["units"]),
        units_from="metadata" if any(facts["units"]) else "none",
        time_units=time_units,
        rate=facts["rate"],
        rate_from=facts["rate_from"],
        start=None if time_units else facts["start"],
        source={"size_bytes": size, **facts["source"]},
        guesses=tuple(facts["guesses"]),
    )


# -- in the child ------------------------------------------------------------------------------------------


def table_in(path: str, variable: str | None, channels: list[str] | None) -> tuple[dict[str, Any], Arrays]:
    """The group that is asked for (or the best one), and everything that is to be said of it.

    The arguments are those of `allanite.files.readers.read`.
    """
    from nptdms import TdmsFile

    name, size = Path(path).name, Path(path).stat().st_size
    with TdmsFile.open(regular(path)) as file:
        parts_in_all = sum(1 + len(group.channels()) for group in file.groups())
        refuse_more(parts_in_all, PARTS, "groups and channels", name, "Export only the needed ones")
        groups = {g.name: [c for c in g.channels() if _is_number(c)] for g in file.groups()}
        parts = [_part(g, groups[g.name]) for g in file.groups()]
        group, one = _split(variable, groups)
        wanted = channels if one is None else None
        part, guesses = choose_part(parts, group, wanted, file=name, option="variable", what="group")
        several = [c for c in groups[part.name] if one is None or c.name == one or _is_time(c)]
        cut = _cut(file)
        taken, length, left = _longest(several, one, cut)
        for channel in taken:
            refuse_bomb(size, length * max(_type_of(channel).itemsize, 1), f"{name}:{channel.name}")
        steps = {c.name: _step(c) for c in taken if not _is_time(c)}
        rates = sorted({s for s in steps.values() if s is not None})
        if len(rates) > 1 and not any(_is_time(c) for c in taken):
            listing = ", ".join(f"{k} {1 / s:g} Hz" if s else f"{k} (no rate)" for k, s in steps.items())
            raise InputError(
                f"{name}: channels of different rates in {part.name}; read one: variable= of {listing}"
            )
        arrays = {str(i): _samples(channel, length) for i, channel in enumerate(taken)}
        stated = _stated(taken, file[part.name], file) if not rates else StatedRate()
        start = _start(taken[0].properties) if taken else None
        headings, stored = [c.name for c in taken], [_as_stored(c) for c in taken]
        units, unapplied = [unit for unit, _ in stored], [note for _, notes in stored for note in notes]
        if len(rates) == 1 and start is not None and not any(_is_time(c) for c in taken):
            with open_regular(Path(path)) as whole:
                starts = starts_of(whole, size, taken[0].path)
            start += starts[0][0] - starts[-1][0] if starts else 0  # the library has the last one
            times = times_of(starts, length, rates[0])
            if times is not None:
                arrays[str(len(headings))] = times
                headings, units, rates = [*headings, _TIME], [*units, ""], []
                left = [*left, f"acquisitions placed by their {_START}: it is set {len(starts)} times"]
        facts = {
            "headings": headings,
            "units": units,
            "rate": float(f"{1.0 / rates[0]:.14g}") if rates else stated.rate,
            "rate_from": "property wf_increment" if rates else stated.where,
            "start": start,
            "guesses": [*guesses, *left, *stated.guesses, *unapplied],
            "source": {"group": part.name, "contents": listed(parts)},
        }
    return facts, arrays


def _cut(file: Any) -> dict[str, int]:
    """Path of a channel -> samples that its last segment promises and does not hold: the file broke off there."""
    statuses = (file.file_status.channel_statuses or {}) if file.file_status is not None else {}
    return {path: int(s.expected_length - s.read_length) for path, s in statuses.items()}


def _split(variable: str | None, groups: Mapping[str, Any]) -> tuple[str | None, str | None]:
    """Group and channel of "group", "group/channel" or the name of a channel that is there once."""
    if variable is None or variable in groups:
        return variable, None
    for group, channels in groups.items():
        if variable.startswith(f"{group}/") and variable[len(group) + 1 :] in [c.name for c in channels]:
            return group, variable[len(group) + 1 :]
    holding = [g for g, channels in groups.items() if variable in [c.name for c in channels]]
    return (holding[0], variable) if len(holding) == 1 else (variable, None)


def _part(group: Any, channels: list[Any]) -> FilePart:
    longest = max((len(c) for c in channels), default=0)
    step = next((s for c in channels if len(c) == longest and (s := _step(c))), None)
    copy = any(
        int(p.get("DecimationLevel", 0) or 0) > 0
        for p in [group.properties, *(c.properties for c in channels)]
    )
    names = tuple(c.name for c in channels if not _is_time(c))
    return FilePart(
        name=group.name, rows=longest, columns=names, rate=None if step is None else 1.0 / step, spare=copy
    )


def _longest(
    channels: list[Any], one: str | None, cut: Mapping[str, int]
) -> tuple[list[Any], int, list[str]]:
    """Channels as long as the longest one, or as the one that is asked for; how much of them is there; remarks."""
    promised = {c.name: len(c) + cut.get(c.path, 0) for c in channels}
    length = max((n for name, n in promised.items() if one in (None, name)), default=0)
    taken = [c for c in channels if promised[c.name] == length]
    there = min((len(c) for c in taken), default=0)
    others = [f"{c.name} ({len(c)} samples)" for c in channels if promised[c.name] != length]
    remarks = [f"channels of another length left out: {', '.join(others)}"] if others else []
    if there < length:
        remarks.append(
            f"the file ends within its last segment: {there} samples are there, {length} were declared"
        )
    return taken, there, remarks


def _type_of(channel: Any) -> np.dtype[Any]:
    kind: np.dtype[Any] = np.dtype(channel.dtype)
    return kind


def _is_number(channel: Any) -> bool:
    return _type_of(channel).kind in "iufM" and len(channel) >= 0


def _is_time(channel: Any) -> bool:
    return _type_of(channel).kind == "M" or read_heading(channel.name).group == "time"


def _step(channel: Any) -> float | None:
    """Sample interval [s]."""
    for key in _STEP_KEYS:
        try:
            step = float(channel.properties.get(key, 0.0))
        except (TypeError, ValueError):
            continue
        if math.isfinite(step) and step > 0:
            return step
    return None


def _stated(channels: list[Any], group: Any, file: Any) -> StatedRate:
    """The rate by a property such as SampleRate: of a channel, else of the group, else of the file."""
    for properties in (*(c.properties for c in channels), group.properties, file.properties):
        numbers = {str(k): float(v) for k, v in properties.items() if isinstance(v, (int, float, np.number))}
        stated = chosen_rate(keyed_statement(key, value, "property") for key, value in numbers.items())
        if stated.rate is not None:
            return stated
    return StatedRate()


def _start(properties: Mapping[str, Any]) -> int | None:
    """UTC of the first sample [ns since 1970]; None where LabVIEW left it at its zero, 1904."""
    moment = properties.get(_START)
    if not isinstance(moment, np.datetime64):
        return None
    start = int(moment.astype("datetime64[ns]").astype(np.int64))
    try:
        offset = float(properties.get("wf_start_offset", 0.0))
    except (TypeError, ValueError):
        offset = 0.0
    return start + round(offset * 1e9) if start > _NOT_SET and math.isfinite(offset) else None


def _as_stored(channel: Any) -> tuple[str, list[str]]:
    properties = channel.properties
    unit = next((str(properties[k]).strip() for k in _UNIT_KEYS if str(properties.get(k, "")).strip()), "")
    if _is_time(channel):
        return unit, []
    return as_stored(channel.name, _type_of(channel), properties, unit, applied=())


def _samples(channel: Any, length: int) -> NDArray[Any]:
    """The first samples, scaled, piece by piece."""
    kind = _type_of(channel)
    kept = np.dtype("datetime64[us]").newbyteorder("=") if kind.kind == "M" else kind.newbyteorder("=")
    growing = GrowingColumn(kept)
    for start in range(0, length, _PIECE):
        growing.append(np.asarray(channel.read_data(start, min(_PIECE, length - start))))
    return growing.finish_array()
