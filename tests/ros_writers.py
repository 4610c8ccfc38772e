# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of ROS for tests, written by rosbags: any messages on any topics, in all three containers."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

__all__ = [
    "IMU",
    "MAGNETIC",
    "TEMPERATURE",
    "Types",
    "channel",
    "chunk",
    "mcap",
    "message",
    "record",
    "schema",
    "write",
]

IMU, MAGNETIC, TEMPERATURE = (f"sensor_msgs/msg/{n}" for n in ("Imu", "MagneticField", "Temperature"))
#: (topic, type, time of reception [ns], message)
Written = tuple[str, str, int, Any]


class Types:
    """Makes messages of ROS 1 or ROS 2."""

    def __init__(self, two: bool, more: Mapping[str, str] | None = None) -> None:
        self.two = two
        self.store = get_typestore(Stores.ROS2_HUMBLE if two else Stores.ROS1_NOETIC)
        types: dict[str, Any] = {}
        for name, text in (more or {}).items():
            types |= get_types_from_msg(text, name)
        self.store.register(types)

    def make(self, kind: str, **fields: Any) -> Any:
        return self.store.types[kind](**fields)

    def header(self, stamp: int, frame: str = "imu_link") -> Any:
        time = self.make("builtin_interfaces/msg/Time", sec=int(stamp // 10**9), nanosec=int(stamp % 10**9))
        return self.make(
            "std_msgs/msg/Header", **({} if self.two else {"seq": 7}), stamp=time, frame_id=frame
        )

    def vector(self, values: Any) -> Any:
        x, y, z = map(float, values)
        return self.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)

    def imu(self, stamp: int, gyro: Any, acc: Any, frame: str = "imu_link", mark: float = 0.0) -> Any:
        """`mark` is the first covariance of the acceleration: -1 says that there is none."""
        last = np.zeros(9)
        last[0] = mark
        return self.make(
            IMU,
            header=self.header(stamp, frame),
            orientation=self.make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
            orientation_covariance=np.zeros(9),
            angular_velocity=self.vector(gyro),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=self.vector(acc),
            linear_acceleration_covariance=last,
        )

    def temperature(self, stamp: int, value: float) -> Any:
        return self.make(TEMPERATURE, header=self.header(stamp), temperature=float(value), variance=0.0)

    def magnetic(self, stamp: int, values: Any) -> Any:
        return self.make(
            MAGNETIC,
            header=self.header(stamp),
            magnetic_field=self.vector(values),
            magnetic_field_covariance=np.zeros(9),
        )

    def bytes_of(self, message: Any, kind: str) -> bytes:
        raw = (
            self.store.serialize_cdr(message, kind) if self.two else self.store.serialize_ros1(message, kind)
        )
        return bytes(raw)


def write(
    types: Types, path: Path, messages: Iterable[Written], packed: str = "", *, chunk_bytes: int = 20_000
) -> Path:
    """A recording in the container that the suffix names (.bag, .db3, .mcap; the last two without metadata.yaml).

    `packed` is none, bz2 or lz4 (.bag); zstd or lz4 (chunks of .mcap); file or message (a folder of .db3).
    """
    if not types.two:
        bag = Writer1(path)
        bag.chunk_threshold = chunk_bytes  # small: several chunks
        if packed:
            bag.set_compression(Writer1.CompressionFormat[packed.upper()])
        with bag:
            _fill(bag, types, messages)
        return path
    folder = path.with_name(path.stem + "_folder")
    plugin = StoragePlugin.MCAP if path.suffix == ".mcap" else StoragePlugin.SQLITE3
    writer = Writer2(folder, version=9, storage_plugin=plugin)
    if packed:
        mode = CompressionMode[packed.upper()] if packed in ("file", "message") else CompressionMode.STORAGE
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        _fill(writer, types, messages)
    if packed in ("file", "message"):
        return folder
    next(folder.glob(f"*{path.suffix}")).rename(path)
    return path


def _fill(writer: Any, types: Types, rows: Iterable[Written]) -> None:
    connections: dict[tuple[str, str], Any] = {}
    for topic, kind, received, message in rows:
        if (topic, kind) not in connections:
            connections[topic, kind] = writer.add_connection(topic, kind, typestore=types.store)
        raw = message if isinstance(message, bytes) else types.bytes_of(message, kind)
        writer.write(connections[topic, kind], received, raw)


# -- MCAP by hand: what the writer above never writes ------------------------------------------------------

MAGIC = b"\x89MCAP0\r\n"


def _text(value: str | bytes) -> bytes:
    raw = value.encode() if isinstance(value, str) else value
    return struct.pack("<I", len(raw)) + raw


def record(op: int, *parts: bytes) -> bytes:
    """One record of MCAP."""
    content = b"".join(parts)
    return struct.pack("<BQ", op, len(content)) + content


def schema(key: int, kind: str, definition: str, form: str = "ros2msg") -> bytes:
    return record(3, struct.pack("<H", key), _text(kind), _text(form), _text(definition))


def channel(key: int, schema_key: int, topic: str, encoding: str = "cdr") -> bytes:
    return record(4, struct.pack("<HH", key, schema_key), _text(topic), _text(encoding), _text(b""))


def message(key: int, time: int, raw: bytes) -> bytes:
    return record(5, struct.pack("<HIQQ", key, 0, time, time), raw)


def chunk(content: bytes, packed: bytes | None = None, compression: str = "", checksum: int = 0) -> bytes:
    body = content if packed is None else packed
    return record(
        6,
        struct.pack("<QQQI", 0, 0, len(content), checksum),
        _text(compression),
        struct.pack("<Q", len(body)),
        body,
    )


def mcap(*records: bytes, profile: str = "ros2", finished: bool = True) -> bytes:
    """A file without a summary."""
    end = record(15, bytes(4)) + record(2, bytes(20)) + MAGIC if finished else b""
    return MAGIC + record(1, _text(profile), _text("by hand")) + b"".join(records) + end
