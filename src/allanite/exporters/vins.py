# SPDX-License-Identifier: BSD-3-Clause
"""The IMU part of the configuration of VINS-Mono and VINS-Fusion (discrete, at the rate of the IMU).

Its mid-point preintegration adds to the covariance in a step dt: 2 (dt/2)^2 gyr_n^2 of angle, the noise of the two
samples taken as independent, and dt^2 gyr_w^2 of bias (vins_estimator, integration_base.h). So a density N needs
gyr_n = N sqrt(2 f), and a walk needs gyr_w = walk sqrt(f): multiplied by the root of the rate, not divided.
"""

from __future__ import annotations

import math

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
    sample_writer,
    white_and_walk,
)

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "vins"
FILE_NAME = "vins_imu.yaml"
SUMMARY = "VINS-Mono and VINS-Fusion: acc_n, gyr_n, acc_w, gyr_w of one step at the rate of the IMU"
TAKES = "study"

_HALF_WEIGHTS = N.of_a_sample.times(math.sqrt(2), "√2")
USAGE = Usage(
    programs=(
        Program("VINS-Mono", "HKUST-Aerial-Robotics/VINS-Mono: vins_estimator/src/factor/integration_base.h"),
        Program(
            "VINS-Fusion", "HKUST-Aerial-Robotics/VINS-Fusion: vins_estimator/src/factor/integration_base.h"
        ),
    ),
    slots=(
        Slot("acc_n", ACCELEROMETER, _HALF_WEIGHTS, "m/s^2"),
        Slot("acc_w", ACCELEROMETER, WALK.of_a_sample, "m/s^3"),
        Slot("gyr_n", GYROSCOPE, _HALF_WEIGHTS, "rad/s"),
        Slot("gyr_w", GYROSCOPE, WALK.of_a_sample, "rad/s^2"),
    ),
    trap="n = N sqrt(f), in common use, gives half of the variance; w is multiplied by sqrt(f), not divided",
)
CONSUMER = Consumer(
    name="VINS-Mono and VINS-Fusion",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "n = N sqrt(2 f): its step takes the noise of two samples for independent, each with half the weight",
        "w = walk sqrt(f)",
    ),
)
TERMS = CONSUMER.terms


def _template(imu: WalkImu, rate: float) -> list[str]:
    """The IMU part; it goes into the configuration file in place of the four lines there."""
    lines = imu.lines(USAGE.slots, "{key}: {value}  # {unit}", "# {key}:  # {unit}", rate=rate)
    return ["%YAML:1.0", "", *imu.comment(), "", *lines]


write = sample_writer(_template, white_and_walk, CONSUMER)
