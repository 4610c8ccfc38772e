# SPDX-License-Identifier: BSD-3-Clause
"""Flight logs byte by byte, from the definitions of the two formats: the inverse of what the readers do."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

#: Format letter of ArduPilot -> letter of `struct`, and what a value is divided by before it is written.
LETTERS: dict[str, tuple[str, float]] = {
    "b": ("b", 1), "B": ("B", 1), "h": ("h", 1), "H": ("H", 1), "i": ("i", 1), "I": ("I", 1), "q": ("q", 1),
    "Q": ("Q", 1), "f": ("f", 1), "d": ("d", 1), "g": ("e", 1), "c": ("h", 0.01), "C": ("H", 0.01), "e": ("i", 0.01),
    "E": ("I", 0.01), "L": ("i", 1e-7), "M": ("B", 1), "n": ("4s", 1), "N": ("16s", 1), "Z": ("64s", 1),
    "a": ("32h", 1),
}  # fmt: skip


def letters_size(letters: str) -> int:
    """Bytes of the fields."""
    return sum(struct.calcsize("<" + LETTERS[letter][0]) for letter in letters)


def fmt(kind: int, name: str, letters: str, columns: str, length: int | None = None) -> bytes:
    """The FMT record that defines a type of record."""
    size = 3 + letters_size(letters) if length is None else length
    texts = (name.encode(), letters.encode(), columns.encode())
    return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, size, *texts)


FMT_ITSELF = fmt(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")


def record(kind: int, letters: str, values: Sequence[Any]) -> bytes:
    """One record."""
    body = bytearray(b"\xa3\x95" + bytes([kind]))
    for letter, value in zip(letters, values, strict=True):
        code, unit = LETTERS[letter]
        if letter == "a":
            body += struct.pack("<32h", *value)
        elif letter in "nNZ":
            body += struct.pack("<" + code, value)
        else:
            body += struct.pack("<" + code, value if unit == 1 else round(value / unit))
    return bytes(body)


IMU = (133, "IMU", "QBffffffIIfBBHH", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz")
GYR = (179, "GYR", "QBQfff", "TimeUS,I,SampleUS,GyrX,GyrY,GyrZ")
ACC = (176, "ACC", "QBQfff", "TimeUS,I,SampleUS,AccX,AccY,AccZ")
ISBH = (190, "ISBH", "QHBBHHQf", "TimeUS,N,type,instance,mul,smp_cnt,SampleUS,smp_rate")
ISBD = (191, "ISBD", "QHHaaa", "TimeUS,N,seqno,x,y,z")


def imu(time_us: int, instance: int, gyro: Sequence[float], acc: Sequence[float], **more: float) -> bytes:
    """An IMU record of the shape IMU."""
    rest = [
        more.get(k, d)
        for k, d in (("EG", 0), ("EA", 0), ("T", 40.0), ("GH", 1), ("AH", 1), ("GHz", 0), ("AHz", 0))
    ]
    return record(IMU[0], IMU[2], [time_us, instance, *gyro, *acc, *rest])


# -- ULog --------------------------------------------------------------------------------------------------


def message(kind: str, body: bytes) -> bytes:
    """A message of a ULog: size, type, body."""
    return struct.pack("<HB", len(body), ord(kind)) + body


def ulog_header(start_us: int = 0) -> bytes:
    """Magic, version 1, start, and the flags of a file without appended data."""
    return b"ULog\x01\x12\x35\x01" + struct.pack("<Q", start_us) + flag_bits()


def flag_bits(appended: Sequence[int] = ()) -> bytes:
    """Which flags are set, and where appended data begin."""
    offsets = [*appended, 0, 0, 0][:3]
    return message("B", bytes(8) + bytes([1 if appended else 0]) + bytes(7) + struct.pack("<3Q", *offsets))


def definition(name: str, fields: str) -> bytes:
    """The format of a message: "uint64_t timestamp;float[3] gyro_rad;"."""
    return message("F", f"{name}:{fields}".encode())


def subscription(number: int, name: str, instance: int = 0) -> bytes:
    """From here on data messages with this number are of this format and instance."""
    return message("A", struct.pack("<BH", instance, number) + name.encode())


def data(number: int, layout: str, *values: Any) -> bytes:
    """A data message; `layout` as for `struct`."""
    return message("D", struct.pack("<H", number) + struct.pack("<" + layout, *values))


def dropout(milliseconds: int) -> bytes:
    """The logger lost messages for so long."""
    return message("O", struct.pack("<H", milliseconds))


SENSOR_COMBINED = (
    "uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;int32_t accelerometer_timestamp_relative;"
    "float[3] accelerometer_m_s2;uint32_t accelerometer_integral_dt;uint8_t accelerometer_clipping;"
    "uint8_t gyro_clipping;uint8_t[6] _padding0;"
)


def combined(number: int, time_us: int, gyro: Sequence[float], acc: Sequence[float], **more: int) -> bytes:
    """A sensor_combined message."""
    values = (
        time_us, *gyro, 4000, more.get("relative", 0), *acc, 4000, more.get("acc_clip", 0), more.get("gyro_clip", 0),
    )  # fmt: skip
    return data(number, "Q3fIi3fIBB", *values)
