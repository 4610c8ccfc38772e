# Specification: ROS bag format 2.0 (wiki.ros.org/Bags/Format/2.0), rosbag2 storage (sqlite3, MCAP), sensor_msgs/Imu.
# SPDX-License-Identifier: BSD-3-Clause
"""sensor_msgs/Imu from ROS 1 bags and ROS 2 folders, .db3 and .mcap files, without ROS.

Units are fixed by the message definition (rad/s, m/s²), time is the header stamp. Messages of equal length are
taken apart at fixed offsets from their end (in front stands a frame name of any length); the first and last
hundred are compared with the full decoder, which also takes whatever is not laid out so.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import AllaniteError, DataQualityError, FormatError, InputError
from allanite.readers.assembly import Options, Table
from allanite.readers.spool import GrowingColumn

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader

NAME: Final = "ROS"
OPTIONS: Final = frozenset({"topic"})

_MAGICS = {b"#ROSBAG V": ".bag", b"\x89MCAP0\r\n": ".mcap", b"SQLite format 3\x00": ".db3"}
_IMU = "sensor_msgs/msg/Imu"
#: Topics taken without asking where several are there, in this order.
_USUAL = ("/imu/data_raw", "/imu/data", "/imu0")
_BATCH = 50_000
_CHECKED = 100

# Bytes from the end of a serialised Imu message: three vectors and two covariances of float64.
_ANGULAR_VELOCITY, _ANGULAR_COVARIANCE, _ACCELERATION, _ACCELERATION_COVARIANCE = 192, 168, 96, 72
_SHORTEST = 4 + 4 + 4 + 37 * 8
_NAMES = ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
_UNITS = ("rad/s",) * 3 + ("m/s²",) * 3


def sniff(head: bytes, path: Path) -> bool:
    """True for the magic strings of the three containers, and for a folder that holds one of the last two."""
    if path.is_dir():
        return any(path.glob("*.db3")) or any(path.glob("*.mcap")) or (path / "metadata.yaml").exists()
    return any(head.startswith(magic) for magic in _MAGICS)


def read(path: Path, options: Options) -> Table:
    """Read the IMU messages of one topic.

    Raises
    ------
    InputError
        No or several IMU topics (the message lists the topics found), or the extra `ros` is not installed.
    FormatError
        A damaged bag.
    """
    try:
        with _opened(path) as reader:
            source = _choose(reader, options.topic, path.name)
            stamps, received, values, present = _messages(reader, source)
    except AllaniteError:
        raise
    except Exception as error:  # noqa: BLE001  (whatever the library raises on a damaged bag)
        raise FormatError(
            f"{path.name}: damaged or unsupported ROS recording ({type(error).__name__}: {str(error)[:200]}); "
            "an unfinished MCAP file is repaired by 'mcap recover'"
        ) from None
    if len(stamps) == 0:
        raise DataQualityError(f"{path.name}: topic {source.topic} holds no messages")
    guesses = list(source.guesses)
    if not stamps.read(0, 1000).any() and stamps.origin == 0.0:
        stamps = received
        guesses.append("the header stamps are zero: the times of reception are used")
    keep = [i for i in range(6) if present[i // 3]]
    if len(keep) < 6:
        guesses.append("channels that the messages mark as absent (covariance -1) are left out")
    return Table(
        format=NAME,
        headings=("stamp", *(_NAMES[i] for i in keep)),
        columns=(stamps, *(values[i] for i in keep)),
        units=("", *(_UNITS[i] for i in keep)),
        units_from="metadata",
        time_units={0: "ns"},
        source={
            "size_bytes": _size(path),
            "topic": source.topic,
            "message_type": source.connections[0].msgtype,
            "topics": source.listed,
        },
        guesses=tuple(guesses),
    )


def _size(path: Path) -> int:
    return (
        sum(p.stat().st_size for p in path.iterdir() if p.is_file()) if path.is_dir() else path.stat().st_size
    )


@contextmanager
def _opened(path: Path) -> Iterator[AnyReader]:
    """A bag by its content: the library asks for the right suffix, so a wrong one gets a link with the right one."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(
            f'{path.name} is a ROS recording; reading it needs one more package: pip install "allanite[ros]"'
        ) from None
    with tempfile.TemporaryDirectory(prefix="allanite-") as folder:
        place = path
        if path.is_dir() and not (path / "metadata.yaml").exists():
            place = sorted([*path.glob("*.db3"), *path.glob("*.mcap")])[0]
        elif path.is_file():
            with path.open("rb") as file:
                head = file.read(16)
            suffix = next(s for magic, s in _MAGICS.items() if head.startswith(magic))
            if path.suffix != suffix:
                place = Path(folder) / f"recording{suffix}"
                place.symlink_to(path.resolve())
        with AnyReader([place], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            yield reader


# -- the topic ---------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Source:
    """Where the Imu messages are: a topic, and the field of its messages if the Imu is nested in them."""

    topic: str
    connections: list[Any]
    field: str
    listed: list[str]
    guesses: tuple[str, ...] = ()


def _choose(reader: AnyReader, topic: str | None, name: str) -> _Source:
    listed = sorted({f"{c.topic} ({c.msgtype}, {c.msgcount})" for c in reader.connections})
    fields = {c.topic: _imu_field(reader, c.msgtype) for c in reader.connections}
    imu = sorted(t for t, f in fields.items() if f is not None)
    if topic is not None and topic not in imu:
        why = "holds no Imu messages" if topic in fields else "is not there"
        raise InputError(f"{name}: topic {topic} {why}; found: {', '.join(listed) or 'none'}")
    if not imu:
        raise InputError(f"{name}: no topic with {_IMU} messages; found: {', '.join(listed) or 'none'}")
    guesses: tuple[str, ...] = ()
    if topic is None:
        usual = [t for t in _USUAL if t in imu]
        if len(imu) > 1 and not usual:
            raise InputError(
                f"{name}: several IMU topics; choose one with topic= (--topic): {', '.join(imu)}"
            )
        topic = (usual or imu)[0]
        if len(imu) > 1:
            guesses = (f"several IMU topics ({', '.join(imu)}): {topic} is read",)
    connections = [c for c in reader.connections if c.topic == topic]
    return _Source(
        topic=topic, connections=connections, field=fields[topic] or "", listed=listed, guesses=guesses
    )


def _imu_field(reader: AnyReader, kind: str) -> str | None:
    """ "" for an Imu message, the name of the field for a message that holds one, None for all others."""
    if kind == _IMU:
        return ""
    try:
        _, definition = reader.typestore.fielddefs[kind]
    except KeyError:
        return None
    for field, (node, what) in definition:
        if int(node) == 2 and what == _IMU:  # a field of a message type, not an array
            return str(field)
    return None


# -- messages ----------------------------------------------------------------------------------------------

_Rows = tuple[NDArray[np.int64], NDArray[np.float64]]


def _messages(reader: AnyReader, source: _Source) -> tuple[Any, Any, list[Any], tuple[bool, bool]]:
    """Columns of header stamps [ns], times of reception [ns] and six values; and which triads are present."""
    stamps, received = GrowingColumn(), GrowingColumn()
    values = [GrowingColumn() for _ in range(6)]
    present = (True, True)
    stream = reader.messages(connections=source.connections)
    first = True
    while batch := list(islice(stream, _BATCH)):
        raws = [bytes(m[2]) for m in batch]
        times, rows = _decode(reader, raws, source)
        if first:
            message = _message(reader, raws[0], source)
            present = (
                message.angular_velocity_covariance[0] != -1,
                message.linear_acceleration_covariance[0] != -1,
            )
            first = False
        stamps.append(times)
        received.append(np.array([m[1] for m in batch], dtype=np.int64))
        for i, column in enumerate(values):
            column.append(np.ascontiguousarray(rows[:, i]))
    return stamps.finish(), received.finish(), [v.finish() for v in values], present


def _decode(reader: AnyReader, raws: Sequence[bytes], source: _Source) -> _Rows:
    if (
        source.field
        or len({len(r) for r in raws}) > 1
        or len(raws[0]) < _SHORTEST
        or not _little(reader, raws)
    ):
        return _slowly(reader, raws, source)
    fast = _at_offsets(raws, 4)  # after seq (ROS 1), or after the four bytes of encapsulation (ROS 2)
    for part in (slice(0, _CHECKED), slice(-_CHECKED, None)):
        times, rows = _slowly(reader, raws[part], source)
        same = np.array_equal(times, fast[0][part]) and np.array_equal(rows, fast[1][part], equal_nan=True)
        if not same:
            return _slowly(reader, raws, source)
    return fast


def _little(reader: AnyReader, raws: Sequence[bytes]) -> bool:
    """ROS 1 is always little-endian; the encapsulation of ROS 2 says so (CDR, 00 01)."""
    return not reader.is2 or all(r[:2] == b"\x00\x01" for r in raws)


def _at_offsets(raws: Sequence[bytes], stamp: int) -> _Rows:
    length = len(raws[0])
    table = np.frombuffer(b"".join(raws), dtype=np.uint8).reshape(-1, length)
    times = np.ascontiguousarray(table[:, stamp : stamp + 8]).view("<u4").astype(np.int64)
    rows = [
        np.ascontiguousarray(table[:, length - end : length - end + 24]).view("<f8")
        for end in (_ANGULAR_VELOCITY, _ACCELERATION)
    ]
    return times[:, 0] * 10**9 + times[:, 1], np.concatenate(rows, axis=1).astype(np.float64)


def _slowly(reader: AnyReader, raws: Sequence[bytes], source: _Source) -> _Rows:
    times = np.empty(len(raws), dtype=np.int64)
    rows = np.empty((len(raws), 6))
    for i, raw in enumerate(raws):
        message = _message(reader, raw, source)
        stamp, w, a = message.header.stamp, message.angular_velocity, message.linear_acceleration
        times[i] = stamp.sec * 10**9 + stamp.nanosec
        rows[i] = (w.x, w.y, w.z, a.x, a.y, a.z)
    return times, rows


def _message(reader: AnyReader, raw: bytes, source: _Source) -> Any:
    message = reader.deserialize(raw, source.connections[0].msgtype)
    return getattr(message, source.field) if source.field else message
