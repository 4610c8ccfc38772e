# Specification: MAVLink guide, "Packet Serialization" (versions 1 and 2), and the dialect common.xml.
# SPDX-License-Identifier: BSD-3-Clause
"""MAVLink telemetry logs (.tlog), through the definitions of pymavlink, in a child process.

Read are RAW_IMU, SCALED_IMU, SCALED_IMU2, SCALED_IMU3 and HIGHRES_IMU of each system and component. Time is the
sender's own; units are those of the dialect. Packets whose checksum is wrong are left out and counted. Before each
packet a .tlog holds the time of its arrival: microseconds since 1970, eight bytes, the highest first.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.files.readers.contents import FilePart, choose_part, listed, message_table
from allanite.files.readers.sandbox import run
from allanite.files.readers.table import Options, Table
from allanite.plain_files.extras import require
from allanite.plain_files.regular_file import open_regular

NAME: Final = "MAVLink"
OPTIONS: Final = frozenset({"topic"})

_STAMP: Final = 8  # bytes before each packet
_STAMPS: Final = (946_684_800_000_000, 4_102_444_800_000_000)  # years 2000 to 2100 [us]
_VERSION_1, _VERSION_2 = 0xFE, 0xFD
_SIGNED: Final = 0x01
_SPARE_MEMORY: Final = 512 << 20
#: Messages of inertial sensors by number, the finer ones first.
_MESSAGES: Final = {
    105: "HIGHRES_IMU",
    26: "SCALED_IMU",
    116: "SCALED_IMU2",
    129: "SCALED_IMU3",
    27: "RAW_IMU",
}
_FIELDS: Final = {f"{a}{s}": f"{n}_{a}" for s, n in (("gyro", "gyro"), ("acc", "acc")) for a in "xyz"}
#: Units as the dialect writes them -> as they are read here. Milli-G is of standard gravity.
_UNITS: Final = {"mG": "mg", "mrad/s": "mrad/s", "m/s/s": "m/s²", "rad/s": "rad/s"}
_MOST_SOURCES: Final = 64

Columns = dict[str, NDArray[Any]]


def sniff(head: bytes, path: Path) -> bool:
    """True for a stamp and a packet, and the next ones right behind it."""
    at, packets = 0, 0
    while packets < 4 and at + _STAMP + 10 < len(head):
        size = _packet_size(head, at + _STAMP)
        if not (size and _STAMPS[0] < int.from_bytes(head[at : at + _STAMP], "big") < _STAMPS[1]):
            return False
        at, packets = at + _STAMP + size, packets + 1
    return packets > 1 or (packets == 1 and at == len(head))


def _packet_size(data: bytes, at: int) -> int:
    """Bytes of the packet that begins there; 0 where none does."""
    if data[at] == _VERSION_1:
        return 8 + data[at + 1]
    if data[at] == _VERSION_2:
        return 12 + data[at + 1] + (13 if data[at + 2] & _SIGNED else 0)
    return 0


def read(path: Path, options: Options) -> Table:
    """Read the messages of one type, of one sender.

    Raises
    ------
    InputError
        The extra `mavlink` is not installed; no message of an inertial sensor, or not the one asked for.
    DataQualityError
        The message asked for never comes.
    """
    require("pymavlink", "mavlink", f"{path.name} is a MAVLink telemetry log; reading it")
    size = path.stat().st_size
    facts, arrays = run(
        f"{__name__}:table_in",
        [str(path), options.topic, options.channel_names],
        imports=["pymavlink.dialects.v20.common"],
        memory=_SPARE_MEMORY + 40 * size,
        seconds=30 + size / 5e5,
        name=path.name,
    )
    return message_table(facts, arrays, path, NAME)


# -- in the child ------------------------------------------------------------------------------------------


def table_in(path: str, topic: str | None, channels: list[str] | None) -> tuple[dict[str, Any], Columns]:
    """The message that is asked for (or the best one), and everything that is to be said of it."""
    from pymavlink.dialects.v20 import common

    name = Path(path).name
    with open_regular(path) as file:
        content = file.read()
    decoder = common.MAVLink(None)
    rows: dict[tuple[str, int, int], list[list[float]]] = {}
    units: dict[str, list[str]] = {}
    damaged = lost = 0
    for packet in _packets(content):
        if isinstance(packet, int):
            lost += packet
            continue
        number = packet[5] if packet[0] == _VERSION_1 else int.from_bytes(packet[7:10], "little")
        if number not in _MESSAGES:
            continue
        try:
            message = decoder.decode(bytearray(packet))
        except (common.MAVError, ValueError, LookupError):
            damaged += 1
            continue
        kind = _MESSAGES[number]
        key = (kind, message.get_srcSystem(), message.get_srcComponent())
        if key not in rows and len(rows) == _MOST_SOURCES:
            damaged += 1
            continue
        clock = "time_usec" if "time_usec" in message.fieldnames else "time_boot_ms"
        values = [getattr(message, clock), *(getattr(message, field) for field in _FIELDS)]
        rows.setdefault(key, []).append([*values, getattr(message, "temperature", 0)])
        if kind not in units:
            by_name = message.fieldunits_by_name
            units[kind] = [
                by_name[clock],
                *(_UNITS.get(by_name[f], "") for f in _FIELDS),
                by_name["temperature"],
            ]
    if not rows:
        raise InputError(
            f"{name}: no message of an inertial sensor; supported are {', '.join(_MESSAGES.values())}"
        )
    tables = {_called(key, list(rows)): (key[0], np.array(r, dtype=np.float64)) for key, r in rows.items()}
    parts = [_part(called, kind, table, units[kind][0]) for called, (kind, table) in tables.items()]
    parts.sort(key=lambda p: (p.rank, p.name))
    part, guesses = choose_part(parts, topic, channels, file=name, option="topic", what="message")
    kind, table = tables[part.name]
    columns, units_of_columns = _columns(table, units[kind])
    if kind == "RAW_IMU":
        guesses.append(
            f"RAW_IMU is read in the units of the dialect ({units_of_columns[1]}, {units_of_columns[4]}); some "
            "autopilots send counts"
        )
    if damaged:
        guesses.append(f"{damaged} packets of inertial sensors are damaged (wrong checksum) and left out")
    if lost:
        guesses.append(f"{lost} bytes outside packets are left out")
    source = {"topic": part.name, "contents": listed(parts), "damaged_packets": damaged}
    return {
        "headings": list(columns),
        "units": units_of_columns,
        "guesses": guesses,
        "source": source,
    }, columns


def _packets(content: bytes) -> Iterator[bytes | int]:
    """Packets of a log; a number of bytes that belong to none."""
    at, lost, end = _STAMP, 0, len(content) - 12
    while at <= end:
        size = _packet_size(content, at)
        following = at + size + _STAMP
        whole = size and at + size <= len(content)
        if whole and (following >= len(content) or _packet_size(content, following) or not lost):
            if lost:
                yield lost
            lost = 0
            yield content[at : at + size]
            at = following
        else:
            lost, at = lost + 1, at + 1
    if lost:
        yield lost


def _called(key: tuple[str, int, int], keys: list[tuple[str, int, int]]) -> str:
    """The message, with its system and component where several send it."""
    kind, system, component = key
    return kind if sum(k[0] == kind for k in keys) == 1 else f"{kind}[{system}.{component}]"


def _part(name: str, kind: str, table: NDArray[np.float64], clock: str) -> FilePart:
    span = float(np.ptp(table[:, 0])) * {"us": 1e-6, "ms": 1e-3}[clock]
    return FilePart(
        name=name,
        rows=len(table),
        columns=tuple(_FIELDS.values()),
        rate=(len(table) - 1) / span if span > 0 else None,
        rank=list(_MESSAGES.values()).index(kind),
    )


def _columns(table: NDArray[np.float64], units: list[str]) -> tuple[Columns, list[str]]:
    """Named columns and their units; the temperature in °C, where one is sent."""
    columns: Columns = {f"time_{units[0]}": table[:, 0].astype(np.int64)}
    columns |= {name: table[:, i] for i, name in enumerate(_FIELDS.values(), 1)}
    sent_units = units[:-1]
    if np.any(table[:, -1] != 0):
        columns["temperature"] = table[:, -1] * (0.01 if units[-1] == "cdegC" else 1.0)
        sent_units = [*sent_units, "°C"]
    return columns, sent_units
