# Specification: PX4 User Guide, "ULog File Format", versions 0 and 1; message definitions of PX4 (msg/*.msg).
# SPDX-License-Identifier: BSD-3-Clause
"""PX4 flight logs (.ulg), through pyulog, in a child process.

Read are sensor_combined, sensor_gyro, sensor_accel, vehicle_imu and the FIFO messages, instance by instance, or any
other message by its name. Units are those of the message definitions. What the logger dropped, or a sensor did not
deliver, is missing in the stamps and so becomes a gap.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError, InputError
from allanite.files.readers.contents import FilePart, choose_part, listed, message_table
from allanite.files.readers.sandbox import run
from allanite.files.readers.table import Options, Table
from allanite.plain_files.counted import plural
from allanite.plain_files.extras import require
from allanite.plain_files.limits import COLUMNS, PARTS, refuse_more
from allanite.plain_files.regular_file import open_regular, regular

NAME: Final = "PX4 ULog"
OPTIONS: Final = frozenset({"topic"})

_MAGIC = b"ULog\x01\x12\x35"
_SPARE_MEMORY = 512 << 20
_MEMORY_PER_BYTE = 6  # the library holds the messages, and their columns are made from them
_NOT_NEW = 0x7FFFFFFF  # accelerometer_timestamp_relative of a sample that is no new one
_LARGEST_FIFO = 64
_DEFAULT_RATE: Final = 400.0  # of IMU_GYRO_RATEMAX, at which the drivers publish [Hz]
_BEGIN: Final = 16  # bytes in front of the first message
_DEFINING: Final = (b"B", b"F", b"I", b"M", b"P", b"Q")  # messages before the first one of data
_LOGGING: Final = (b"A", b"L", b"C")  # which may be one of these
_LARGEST_MESSAGE: Final = 10_000  # bytes; a longer one of no known type is damaged
_FIELD: Final = re.compile(r"\s*([A-Za-z_]\w*)(?:\[(\d{1,9})\])?\s", re.ASCII)  # type, and its length
_DEEPEST: Final = 32
_ADVICE: Final = "No autopilot logs such messages"

Columns = dict[str, NDArray[Any]]
Message = dict[str, NDArray[Any]]


def sniff(head: bytes, path: Path) -> bool:
    """True for the magic string."""
    return head.startswith(_MAGIC)


def read(path: Path, options: Options) -> Table:
    """Read one message, one instance of it.

    Raises
    ------
    InputError
        The extra `px4` is not installed; no message of an inertial sensor, or not the one asked for.
    FormatError
        The file is damaged at its beginning.
    LimitError
        It needs more memory than there is.
    DataQualityError
        No samples.
    """
    require("pyulog", "px4", f"{path.name} is a PX4 ULog; reading it")
    size = path.stat().st_size
    facts, arrays = run(
        f"{__name__}:table_in",
        [str(path), options.topic, options.channel_names],
        imports=["pyulog"],
        memory=_SPARE_MEMORY + _MEMORY_PER_BYTE * size,
        seconds=30 + size / 2e6,
        name=path.name,
    )
    return message_table(facts, arrays, path, NAME)


# -- in the child ------------------------------------------------------------------------------------------


def table_in(path: str, topic: str | None, channels: list[str] | None) -> tuple[dict[str, Any], Columns]:
    """The table that is asked for (or the best one), and everything that is to be said of it.

    The arguments are those of `allanite.files.readers.read`.
    """
    from pyulog import ULog

    name = Path(path).name
    _refuse_formats(path, name)
    names = [*_KNOWN, *([topic.split("[")[0]] if topic else [])]
    log = ULog(str(regular(path)), message_name_filter_list=names)
    messages = _messages(log)
    if not messages and topic is None:
        raise InputError(f"{name}: no message of an inertial sensor; the log defines: {_defined(log)}")
    parts = [_part(key, message) for key, message in messages.items()]
    parts.sort(key=lambda p: (p.rank, p.name))
    if topic is not None and not any(p.name.split("[")[0] == topic.split("[")[0] for p in parts):
        raise InputError(f"{name}: no message {topic!r}; the log defines: {_defined(log)}")
    part, guesses = choose_part(parts, topic, channels, file=name, option="topic", what="message")
    stamps, columns, units, more = _table(part.name.split("[")[0], messages[part.name])
    columns = {"timestamp_us": stamps, **columns}
    source = {"topic": part.name, "contents": listed(parts), "dropouts": len(log.dropouts)}
    facts = {
        "headings": list(columns),
        "units": ["us", *units],
        "guesses": [*guesses, *more, *_remarks(log)],
        "apertures": _apertures(part.name.split("[")[0], messages[part.name], units),
        "source": source | _sensor_rate(part.name.split("[")[0], log),
    }
    return facts, columns


def _refuse_formats(path: str, name: str) -> None:
    """Raise at what the library would not come to an end with.

    Formats grow as they are put together: each may hold others, and those others in turn. And where the file ends in
    the middle of a damaged message, the library goes back and back. All that is in front of the first message of data.
    """
    lines: dict[str, str] = {}
    with open_regular(path) as file:
        file.seek(_BEGIN)
        while len(head := file.read(3)) == 3 and head[2:] not in _LOGGING:
            size, form = int.from_bytes(head[:2], "little"), head[2:]
            body = file.read(size)
            if len(body) < size:
                raise FormatError(f"{name}: the log ends within its definitions, before the first message")
            if form not in _DEFINING and (form == b"\0" or not 0 < size <= _LARGEST_MESSAGE):
                file.seek(-2 - size, 1)  # damaged: the library goes on at the next byte
            if form == b"F":
                kind, _, fields = body.decode("latin-1").partition(":")
                lines.setdefault(kind, fields)
                refuse_more(len(lines), PARTS, "formats of messages", name, _ADVICE)
    sizes: dict[str, int] = {}
    for kind in lines:
        refuse_more(_size(kind, lines, sizes, 0), COLUMNS, f"fields in messages of {kind}", name, _ADVICE)


def _size(kind: str, lines: Mapping[str, str], known: dict[str, int], depth: int) -> int:
    """Numbers in a message of a type, those of what it holds included; no more than just too many."""
    if kind not in lines:
        return 1
    if depth > _DEEPEST:
        return COLUMNS + 1
    if kind not in known:
        total = 0
        for word in lines[kind].split(";"):
            match = _FIELD.match(word)
            if match is not None:
                total += min(int(match[2] or 1), COLUMNS + 1) * _size(match[1], lines, known, depth + 1)
            if total > COLUMNS:
                break
        known[kind] = total
    return known[kind]


def _messages(log: Any) -> dict[str, Message]:
    """Name with instance -> fields. Messages of appended sections follow those of the section before."""
    together: dict[str, list[Message]] = {}
    for item in log.data_list:
        if "timestamp" in item.data:
            together.setdefault(f"{item.name}[{item.multi_id}]", []).append(item.data)
    joined: dict[str, Message] = {}
    for key, several in together.items():
        fields = [f for f in several[0] if all(f in one for one in several)]
        joined[key] = {f: np.concatenate([one[f] for one in several]) for f in fields}
    return joined


def _defined(log: Any) -> str:
    names = sorted(str(n) for n in log.message_formats if n)
    return ", ".join(names[:80]) or "none"


def _part(key: str, message: Message) -> FilePart:
    kind = key.split("[")[0]
    stamps, columns, _, _ = _table(kind, message)
    span = (float(stamps[-1]) - float(stamps[0])) * 1e-6 if len(stamps) > 1 else 0.0
    return FilePart(
        name=key,
        rows=len(stamps),
        columns=tuple(columns),
        rate=(len(stamps) - 1) / span if span > 0 else None,
        rank=list(_KNOWN).index(kind) if kind in _KNOWN else len(_KNOWN),
    )


def _remarks(log: Any) -> list[str]:
    remarks = []
    if log.dropouts:
        total = sum(int(d.duration) for d in log.dropouts)
        remarks.append(
            f"the logger dropped messages {plural(len(log.dropouts), 'time')}, for {total} ms together: gaps"
        )
    if log.file_corruption:
        remarks.append("the log is damaged in places: messages there are skipped")
    return remarks


# -- messages ----------------------------------------------------------------------------------------------

_Made = tuple[NDArray[Any], Columns, list[str], list[str]]


def _table(kind: str, message: Message) -> _Made:
    """Stamps [µs], channels, their units, and remarks of one message."""
    make = _KNOWN.get(kind, _anything)
    try:
        return make(message)
    except KeyError as error:
        stamps, columns, units, _ = _anything(message)
        remarks = f"this version of {kind} has no field {error}: its fields are read unchanged, without units"
        return stamps, columns, units, [remarks]


def _triad(message: Message, field: str, name: str) -> Columns:
    return {f"{name}_{axis}": message[f"{field}[{i}]"] for i, axis in enumerate("xyz")}


def _sampled(message: Message) -> tuple[NDArray[Any], list[str]]:
    """When the samples were taken, not when the message was sent, where the message says so."""
    stamps = message.get("timestamp_sample")
    if stamps is not None and len(stamps) and (stamps > 0).all():
        return stamps, ["time is timestamp_sample, the time of each sample"]
    return message["timestamp"], []


def _clipped(message: Message, *fields: str) -> list[str]:
    bad = np.zeros(len(message["timestamp"]), dtype=bool)
    for field in (f for f in message if f.split("[")[0] in fields):
        bad |= message[field] != 0
    return [f"the driver marks {plural(int(bad.sum()), 'sample')} as clipped"] if bad.any() else []


def _sensor_combined(message: Message) -> _Made:
    gyro, acc = _triad(message, "gyro_rad", "gyro"), _triad(message, "accelerometer_m_s2", "acc")
    remarks = _clipped(message, "gyro_clipping", "accelerometer_clipping")
    late = message.get("accelerometer_timestamp_relative")
    if late is not None and (late == _NOT_NEW).any():
        old = late == _NOT_NEW
        acc = {k: np.where(old, np.float32(np.nan), v) for k, v in acc.items()}
        remarks.append(f"{plural(int(old.sum()), 'accelerometer sample', 'are marked')} as not new: missing")
    return message["timestamp"], {**gyro, **acc}, ["rad/s"] * 3 + ["m/s²"] * 3, remarks


def _vehicle_imu(message: Message) -> _Made:
    """Increments over their interval: their quotient is the mean rate of that interval."""
    stamps, remarks = _sampled(message)
    columns: Columns = {}
    for field, name in (("delta_angle", "gyro"), ("delta_velocity", "acc")):
        interval = message[f"{field}_dt"].astype(np.float64) * 1e-6
        with np.errstate(divide="ignore", invalid="ignore"):
            rates = {k: v / interval for k, v in _triad(message, field, name).items()}
        columns |= {k: np.where(interval > 0, v, np.nan) for k, v in rates.items()}
    remarks.append("rates are the increments over the interval that each message states (delta_angle_dt)")
    remarks += _clipped(message, "delta_angle_clipping", "delta_velocity_clipping")
    return stamps, columns, ["rad/s"] * 3 + ["m/s²"] * 3, remarks


#: Message -> group of its channels -> field with the time over which each sample was integrated [us].
_INTEGRATED: Final = {
    "sensor_combined": {"gyro": "gyro_integral_dt", "acc": "accelerometer_integral_dt"},
    "vehicle_imu": {"gyro": "delta_angle_dt", "acc": "delta_velocity_dt"},
}


def _apertures(kind: str, message: Message, units: list[str]) -> dict[str, float]:
    """Typical integration time of each channel [s]: that of the messages, however far apart they were logged."""
    apertures: dict[str, float] = {}
    for group, field in _INTEGRATED.get(kind, {}).items() if any(units) else ():
        spans = message[field] if field in message else np.zeros(0)
        spans = spans[spans > 0]
        if len(spans):
            apertures |= {f"{group}_{axis}": float(np.median(spans)) * 1e-6 for axis in "xyz"}
    return apertures


def _sensor_rate(kind: str, log: Any) -> dict[str, Any]:
    """At what rate the drivers publish, of which the logger keeps a message now and then."""
    if kind not in ("sensor_gyro", "sensor_accel"):
        return {}
    stated = log.initial_parameters.get("IMU_GYRO_RATEMAX")
    rate, where = (_DEFAULT_RATE, "the default of") if stated is None else (float(stated), "parameter")
    return {
        "sensor_rate": {
            "hz": rate,
            "from": f"{where} IMU_GYRO_RATEMAX",
            "advice": "log at the full rate (SDLOG_PROFILE, bit 5 of high rate), or the FIFO messages",
        }
    }


def _sensor(name: str, unit: str) -> Callable[[Message], _Made]:
    def made(message: Message) -> _Made:
        stamps, remarks = _sampled(message)
        columns = {f"{name}_{axis}": message[axis] for axis in "xyz"}
        units = [unit] * 3
        if "temperature" in message:
            columns["temperature"], units = message["temperature"], [*units, "°C"]
        return stamps, columns, units, remarks + _clipped(message, "clip_counter")

    return made


def _fifo(name: str, unit: str) -> Callable[[Message], _Made]:
    """Raw samples in packets: `samples` of them, `dt` apart, the last one at timestamp_sample."""

    def made(message: Message) -> _Made:
        stamps, remarks = _sampled(message)
        width = sum(1 for f in message if f.startswith("x["))
        if not 0 < width <= _LARGEST_FIFO:
            raise KeyError("x[]")
        count = np.minimum(message["samples"].astype(np.int64), width)
        used = np.arange(width) < count[:, None]
        steps = message["dt"].astype(np.float64)[:, None] * (np.arange(width) - (count[:, None] - 1))
        times = (stamps.astype(np.float64)[:, None] + steps)[used]
        columns: Columns = {}
        for axis in "xyz":
            raw = np.stack([message[f"{axis}[{i}]"] for i in range(width)], axis=1)
            columns[f"{name}_{axis}"] = (raw * message["scale"].astype(np.float64)[:, None])[used]
        return times, columns, [unit] * 3, [*remarks, "raw samples from the FIFO of the sensor"]

    return made


def _anything(message: Message) -> _Made:
    columns = {k: v for k, v in message.items() if not k.startswith("timestamp") and v.dtype.kind in "iuf"}
    return message["timestamp"], columns, [""] * len(columns), []


#: Messages that are read without being asked for, best first among those that are about as fast.
_KNOWN: Final[dict[str, Callable[[Message], _Made]]] = {
    "sensor_combined": _sensor_combined,
    "vehicle_imu": _vehicle_imu,
    "sensor_gyro": _sensor("gyro", "rad/s"),
    "sensor_accel": _sensor("acc", "m/s²"),
    "sensor_gyro_fifo": _fifo("gyro", "rad/s"),
    "sensor_accel_fifo": _fifo("acc", "m/s²"),
}
