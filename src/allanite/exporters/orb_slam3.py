# SPDX-License-Identifier: BSD-3-Clause
"""The IMU part of the settings of ORB-SLAM3 (continuous densities in SI; the file form is that of its EuRoC example).

It multiplies the noise by the root of IMU.Frequency and divides the walk by it. Files of version 1.0 read the frequency
as a real number; without "File.version" an integer is asked for.
"""

from __future__ import annotations

from allanite.exporters.imu import (
    ACCELEROMETER,
    GYROSCOPE,
    WALK,
    Consumer,
    N,
    Program,
    Slot,
    Usage,
    WalkImu,
    white_and_walk,
    writer,
)

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "orb_slam3"
FILE_NAME = "orb_slam3_imu.yaml"
SUMMARY = "ORB-SLAM3: IMU.NoiseGyro, IMU.NoiseAcc, IMU.GyroWalk, IMU.AccWalk, continuous, SI"
TAKES = "study"
USAGE = Usage(
    programs=(Program("ORB-SLAM3", "UZ-SLAMLab/ORB_SLAM3: src/Tracking.cc, src/ImuTypes.cc"),),
    slots=(
        Slot("IMU.NoiseGyro", GYROSCOPE, N, "rad/s/sqrt(Hz)"),
        Slot("IMU.NoiseAcc", ACCELEROMETER, N, "m/s^2/sqrt(Hz)"),
        Slot("IMU.GyroWalk", GYROSCOPE, WALK, "rad/s^2/sqrt(Hz)"),
        Slot("IMU.AccWalk", ACCELEROMETER, WALK, "m/s^3/sqrt(Hz)"),
    ),
    trap="IMU.Frequency must be the rate of the IMU, not of the camera: ORB-SLAM3 scales the noise by it",
)
CONSUMER = Consumer(
    name="ORB-SLAM3",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous-time root densities in SI units, two-sided; ORB-SLAM3 makes them discrete at IMU.Frequency itself",
        'for settings with File.version: "1.0"; older ones read IMU.Frequency as an integer',
    ),
)
TERMS = CONSUMER.terms


def _template(imu: WalkImu) -> list[str]:
    """The IMU part of a settings file."""
    return [
        *("%YAML:1.0", "", *imu.comment(), ""),
        *imu.lines(USAGE.slots, "{key}: {value}  # {unit}", "# {key}:  # {unit}"),
        f"IMU.Frequency: {imu.frequency}",
        "# IMU.T_b_c1:  # camera to IMU, from the calibration of the camera",
    ]


write = writer(_template, white_and_walk, CONSUMER)
