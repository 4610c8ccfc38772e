# Specification: `ros2 topic echo --csv`: the fields of a message, depth first; sensor_msgs/Imu of common_interfaces.
# SPDX-License-Identifier: BSD-3-Clause
"""Rows that are the fields of a ROS message in their order: without a header, or with a column for each message."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from allanite.files.readers.delimited.dialect import Dialect, split

__all__ = ["named_as_message", "named_by_parents"]

_AXES = frozenset("xyzw")


def _covariance(name: str) -> list[str]:
    return [f"{name}_covariance[{k}]" for k in range(9)]


_ORIENTATION = [f"orientation.{axis}" for axis in "xyzw"]
_RATE, _ACCELERATION = (
    [f"{name}.{axis}" for axis in "xyz"] for name in ("angular_velocity", "linear_acceleration")
)
_STAMP = ["header.stamp.sec", "header.stamp.nanosec", "header.frame_id"]
_IMU = (
    *_STAMP,
    *_ORIENTATION,
    *_covariance("orientation"),
    *_RATE,
    *_covariance("angular_velocity"),
    *_ACCELERATION,
    *_covariance("linear_acceleration"),
)
_KINDS = [{"i"}, {"i"}, {"x", "e"}] + [{"i", "f"}] * (len(_IMU) - len(_STAMP))
_CONSTANT = [k for k, name in enumerate(_IMU) if "covariance" in name]


def named_as_message(dialect: Dialect, lines: Sequence[str]) -> Dialect:
    """The dialect with the names of sensor_msgs/Imu, where rows without names have its fields."""
    if any(dialect.headings) or len(dialect.kinds) != len(_IMU):
        return dialect
    if not all(kind in kinds for kind, kinds in zip(dialect.kinds, _KINDS, strict=True)):
        return dialect
    rows = [
        split(line, dialect.delimiter, dialect.quoted) for line in lines[dialect.skip : dialect.skip + 100]
    ]
    rows = [row for row in rows if len(row) == len(_IMU)]
    if any(len({row[k] for row in rows}) > 1 for k in _CONSTANT):
        return dialect
    guess = "40 columns without names have the order of sensor_msgs/Imu: named so"
    return replace(dialect, headings=_IMU, guesses=(*dialect.guesses, guess))


def named_by_parents(dialect: Dialect) -> Dialect:
    """The dialect with angular_velocity.x for x behind an empty column called angular_velocity."""
    headings, parent = list(dialect.headings), ""
    for i, (heading, kind) in enumerate(zip(dialect.headings, dialect.kinds, strict=True)):
        if parent and heading in _AXES:
            headings[i] = f"{parent}.{heading}"
        else:
            parent = heading if kind == "e" else ""
    return replace(dialect, headings=tuple(headings))
