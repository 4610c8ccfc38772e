# SPDX-License-Identifier: BSD-3-Clause
"""Covariances of a sensor_msgs/Imu message (variances of one sample in SI, row by row): robot_localization reads them.

They are for the driver that publishes the message. In Imu.msg all zeros mean that a covariance is unknown, and -1 in
the first element that there is no such measurement. robot_localization raises a variance below 1e-9 to that (ekf.cpp),
and has no state for a bias of the IMU.
"""

from __future__ import annotations

from allanite.exporters.imu import (
    ACCELEROMETER,
    GYROSCOPE,
    Consumer,
    N,
    Program,
    Slot,
    Usage,
    WhiteImu,
    white_writer,
)

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "ros_imu"
FILE_NAME = "ros_imu.yaml"
SUMMARY = "ROS sensor_msgs/Imu, robot_localization: covariances of one sample, per axis; no bias"
TAKES = "study"
USAGE = Usage(
    programs=(
        Program("sensor_msgs/Imu", "ros/common_msgs: sensor_msgs/msg/Imu.msg"),
        Program("robot_localization", "cra-ros-pkg/robot_localization: src/ekf.cpp"),
    ),
    slots=(
        Slot("angular_velocity_covariance", GYROSCOPE, N.of_a_sample.squared, "rad^2/s^2"),
        Slot("linear_acceleration_covariance", ACCELEROMETER, N.of_a_sample.squared, "m^2/s^4"),
    ),
    trap="all zeros mean UNKNOWN, not exact; robot_localization raises variances below 1e-9 to 1e-9",
    lost="bias instability and random walk: robot_localization has no state for a bias of the IMU",
)
CONSUMER = Consumer(
    name="sensor_msgs/Imu and robot_localization",
    file=FILE_NAME,
    usage=USAGE,
    convention=("variance of a sample, N^2 f, on the diagonal of a matrix, row by row",),
    per_axis=True,
    terms=("N",),
)
TERMS = CONSUMER.terms


#: robot_localization takes no less for the variance of a measurement, rad^2/s^2 or m^2/s^4.
_LEAST = 1e-9


def _template(imu: WhiteImu, rate: float) -> list[str]:
    """Two matrices of the message."""
    lines = []
    for slot in USAGE.slots:
        values = imu.values(slot, rate)
        if not values:
            lines.append(f"# {slot.key}: [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]  # not measured")
            continue
        x, y, z = (imu.text(v) for v in values * (3 if len(values) == 1 else 1))
        raised = f"; robot_localization takes {_LEAST:.0e}" if min(values) < _LEAST else ""
        lines.append(f"{slot.key}: [{x}, 0.0, 0.0, 0.0, {y}, 0.0, 0.0, 0.0, {z}]  # {slot.unit}{raised}")
    return [*imu.comment(), "", *lines]


write = white_writer(_template, CONSUMER)
