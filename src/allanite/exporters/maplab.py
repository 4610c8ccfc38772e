# SPDX-License-Identifier: BSD-3-Clause
"""imu-sigmas.yaml of maplab, and `sigmas` of an IMU in its sensors.yaml (continuous densities in SI).

Its integrator adds the squares of these to the derivative of the covariance (imu-integrator-rk4, imu-integrator-inl.h);
the names are those of sensors/src/imu.cc.
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

NAME = "maplab"
FILE_NAME = "maplab_imu.yaml"
SUMMARY = "maplab: imu-sigmas.yaml, noise densities of gyro, acc and their bias random walks, continuous, SI"
TAKES = "study"
USAGE = Usage(
    programs=(
        Program(
            "maplab",
            "ethz-asl/maplab: algorithms/imu-integrator-rk4/include/imu-integrator/imu-integrator-inl.h",
        ),
    ),
    slots=(
        Slot("gyro_noise_density", GYROSCOPE, N, "rad/s/sqrt(Hz)"),
        Slot("gyro_bias_random_walk_noise_density", GYROSCOPE, WALK, "rad/s^2/sqrt(Hz)"),
        Slot("acc_noise_density", ACCELEROMETER, N, "m/s^2/sqrt(Hz)"),
        Slot("acc_bias_random_walk_noise_density", ACCELEROMETER, WALK, "m/s^3/sqrt(Hz)"),
    ),
    trap="all four keys are required under these names; those of Kalibr are not read",
)
CONSUMER = Consumer(
    name="maplab",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous-time root densities in SI units, two-sided; maplab integrates their squares itself",
        "in sensors.yaml the same lines stand under sigmas: of the IMU",
    ),
)
TERMS = CONSUMER.terms


def _template(imu: WalkImu) -> list[str]:
    """imu-sigmas.yaml."""
    lines = imu.lines(USAGE.slots, "{key}: {value}  # {unit}", "# {key}:  # {unit}")
    return [*imu.comment(), "", *lines]


write = writer(_template, white_and_walk, CONSUMER)
