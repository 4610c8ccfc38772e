# SPDX-License-Identifier: BSD-3-Clause
"""The noise of LIO-SAM, part of its params.yaml (continuous densities in SI).

Its preintegration is GTSAM's: the covariances are the squares of imuAccNoise and imuGyrNoise, and the bias moves
between two scans by a sigma of imuAccBiasN and imuGyrBiasN times the root of the time (imuPreintegration.cpp).
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

NAME = "lio_sam"
FILE_NAME = "lio_sam_imu.yaml"
SUMMARY = "LIO-SAM: imuAccNoise, imuGyrNoise, imuAccBiasN, imuGyrBiasN, continuous, SI"
TAKES = "study"
USAGE = Usage(
    programs=(Program("LIO-SAM", "TixiaoShan/LIO-SAM: src/imuPreintegration.cpp"),),
    slots=(
        Slot("imuAccNoise", ACCELEROMETER, N, "m/s^2/sqrt(Hz)"),
        Slot("imuGyrNoise", GYROSCOPE, N, "rad/s/sqrt(Hz)"),
        Slot("imuAccBiasN", ACCELEROMETER, WALK, "m/s^3/sqrt(Hz)"),
        Slot("imuGyrBiasN", GYROSCOPE, WALK, "rad/s^2/sqrt(Hz)"),
    ),
    trap="imuAccBiasN and imuGyrBiasN are random walks, scaled by the root of the scan interval, not instabilities",
)
CONSUMER = Consumer(
    name="LIO-SAM",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous-time root densities in SI units, two-sided; LIO-SAM makes them discrete itself",
        "the ROS 2 branch has the same keys under /**: ros__parameters:",
    ),
)
TERMS = CONSUMER.terms


def _template(imu: WalkImu) -> list[str]:
    """A part of params.yaml, in place of the four lines there."""
    lines = imu.lines(USAGE.slots, "  {key}: {value}  # {unit}", "  # {key}:  # {unit}")
    return [*imu.comment(), "", "lio_sam:", *lines]


write = writer(_template, white_and_walk, CONSUMER)
