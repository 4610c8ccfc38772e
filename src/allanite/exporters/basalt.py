# SPDX-License-Identifier: BSD-3-Clause
"""The noise of a calibration file of Basalt (continuous densities in SI, per axis).

It multiplies the noise of a sample by the root of imu_update_rate (basalt-headers, calibration.hpp), integrates it with
Jacobians of dt (imu/preintegration.h), and weighs a change of the bias over a time by std^2 times it
(linearization/imu_block.hpp).
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
from allanite.exporters.imu.json_comments import json_comments

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "basalt"
FILE_NAME = "basalt_imu.json"
SUMMARY = "Basalt: accel_noise_std, gyro_noise_std, accel_bias_std, gyro_bias_std, continuous, per axis, SI"
TAKES = "study"
USAGE = Usage(
    programs=(
        Program(
            "Basalt",
            "VladyslavUsenko/basalt: include/basalt/linearization/imu_block.hpp; VladyslavUsenko/basalt-headers: "
            "include/basalt/imu/preintegration.h",
        ),
    ),
    slots=(
        Slot("accel_noise_std", ACCELEROMETER, N, "m/s^2/sqrt(Hz)"),
        Slot("gyro_noise_std", GYROSCOPE, N, "rad/s/sqrt(Hz)"),
        Slot("accel_bias_std", ACCELEROMETER, WALK, "m/s^3/sqrt(Hz)"),
        Slot("gyro_bias_std", GYROSCOPE, WALK, "rad/s^2/sqrt(Hz)"),
    ),
    trap="std means density: noise_std is not that of a sample, and bias_std is a random walk, not a spread",
)
CONSUMER = Consumer(
    name="Basalt",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous-time root densities in SI units, two-sided; Basalt makes them discrete at imu_update_rate itself",
        "versions before the three axes had numbers of their own read one number: take the first",
    ),
    per_axis=True,
)
TERMS = CONSUMER.terms


def _template(imu: WalkImu) -> list[str]:
    """Members of value0 of the calibration file, in place of those there."""
    members = [f'  "imu_update_rate": {imu.frequency}', *imu.lines(USAGE.slots, '  "{key}": {row}')]
    return ["{", ' "value0": {', ",\n".join(members), " },", *json_comments(imu.comments, 1), "}"]


write = writer(_template, white_and_walk, CONSUMER)
