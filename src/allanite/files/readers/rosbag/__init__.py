# Specification: ROS bag format 2.0, rosbag2 storage (SQLite, MCAP), sensor_msgs/Imu, /Temperature, /MagneticField.
# SPDX-License-Identifier: BSD-3-Clause
"""sensor_msgs/Imu from ROS 1 bags and ROS 2 folders, .db3 and .mcap files, without ROS, in a child process.

Units are fixed by the message definition (rad/s, m/s²), time is the header stamp. The containers are taken apart here,
chunk by chunk (`bag1`, `mcap`, `sqlite`); `types` finds the samples in the definitions of the messages, `decoding`
makes numbers of them, with rosbags as the judge; `companions` keeps temperature and magnetic field beside.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from allanite.errors import DataQualityError
from allanite.files.readers.sandbox import run
from allanite.files.readers.table import Options, Table
from allanite.plain_files.extras import require
from allanite.recording.records import ArrayColumn, Column, Spliced

NAME: Final = "ROS"
OPTIONS: Final = frozenset({"topic"})

_MAGICS = (b"#ROSBAG V", b"\x89MCAP0\r\n", b"SQLite format 3\x00")
_SUFFIXES = ("*.db3", "*.mcap", "*.db3.zstd", "*.mcap.zstd")
_SPARE_MEMORY = 768 << 20
_MEMORY_PER_BYTE = 8  # columns of packed messages are larger than the file


def sniff(head: bytes, path: Path) -> bool:
    """True for the magic strings of the three containers, and for a folder that holds one of the last two."""
    if path.is_dir():
        return (path / "metadata.yaml").exists() or any(any(path.glob(s)) for s in _SUFFIXES)
    return any(head.startswith(magic) for magic in _MAGICS)


def read(path: Path, options: Options) -> Table:
    """Read the IMU messages of one topic, and the temperature and magnetic field that fit to them.

    Raises
    ------
    InputError
        No Imu messages (the message lists the topics found), or the extra `ros` is not installed.
    FormatError
        A damaged recording.
    LimitError
        It needs more memory or time than it may, or unpacks to too much.
    DataQualityError
        The topic has no messages.
    """
    require("rosbags", "ros", f"{path.name} is a ROS recording; reading it")
    size = _size(path)
    head, arrays = run(
        f"{__name__}.table:table_in",
        [str(path), options.topic, options.channel_names],
        imports=["pyarrow", "rosbags.typesys"],
        memory=_SPARE_MEMORY + _MEMORY_PER_BYTE * size,
        seconds=60 + size / 1e6,
        name=path.name,
    )
    headings = tuple(head["headings"])
    rows = len(arrays[headings[0]])
    if rows == 0:
        raise DataQualityError(f"{path.name}: topic {head['source']['topic']} has no messages")
    columns: list[Column] = [ArrayColumn(arrays[h]) for h in headings]
    for companion in head["companions"]:
        columns.append(_sparse(ArrayColumn(arrays[companion["name"]]), arrays[companion["rows"]], rows))
    return Table(
        format=NAME,
        headings=(*headings, *(c["name"] for c in head["companions"])),
        columns=tuple(columns),
        units=(*head["units"], *(c["unit"] for c in head["companions"])),
        units_from="metadata" if any(head["units"]) else "none",
        time_units={0: "ns"},
        source={"size_bytes": size, **head["source"]},
        guesses=tuple(head["guesses"]),
    )


def _size(path: Path) -> int:
    return (
        sum(p.stat().st_size for p in path.iterdir() if p.is_file()) if path.is_dir() else path.stat().st_size
    )


def _sparse(column: Column, rows: np.ndarray, length: int) -> Column:
    """Samples at some rows of a longer table."""
    begins = np.concatenate(([0], np.flatnonzero(np.diff(rows) != 1) + 1)) if len(rows) else rows
    if len(begins) == 1 and len(rows) == length:
        return column
    return Spliced(column, np.append(begins, len(rows)), np.asarray(rows)[begins], length)
