# SPDX-License-Identifier: BSD-3-Clause
"""The noise of FAST-LIO2, part `mapping` of its configuration (variances of one sample, at the rate of the IMU).

Its filter adds (dt f_w) Q (dt f_w)' in a step (IKFoM_toolkit/esekfom/esekfom.hpp, predict), with gyr_cov, acc_cov,
b_gyr_cov and b_acc_cov on the diagonal of Q (IMU_Processing.hpp). So an angle gets dt^2 gyr_cov, which is N^2 dt where
gyr_cov = N^2 f, and a bias gets dt^2 b_gyr_cov, which is walk^2 dt where b_gyr_cov = walk^2 f.
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
    sample_writer,
    white_and_walk,
)

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "fast_lio"
FILE_NAME = "fast_lio_imu.yaml"
SUMMARY = "FAST-LIO2: acc_cov, gyr_cov, b_acc_cov, b_gyr_cov, variances of one sample at the rate of the IMU"
TAKES = "study"
USAGE = Usage(
    programs=(
        Program(
            "FAST-LIO2",
            "hku-mars/FAST_LIO: src/IMU_Processing.hpp, include/IKFoM_toolkit/esekfom/esekfom.hpp",
        ),
    ),
    slots=(
        Slot("acc_cov", ACCELEROMETER, N.of_a_sample.squared, "m^2/s^4"),
        Slot("gyr_cov", GYROSCOPE, N.of_a_sample.squared, "rad^2/s^2"),
        Slot("b_acc_cov", ACCELEROMETER, WALK.of_a_sample.squared, "m^2/s^6"),
        Slot("b_gyr_cov", GYROSCOPE, WALK.of_a_sample.squared, "rad^2/s^4"),
    ),
    trap="enter variances of one sample: N is far too large there, and N^2 is too small by the rate",
)
CONSUMER = Consumer(
    name="FAST-LIO2",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "gyr_cov, acc_cov = N^2 f; b_gyr_cov, b_acc_cov = walk^2 f: a step adds dt^2 times them",
        "acceleration in m/s^2, to which FAST-LIO2 scales the samples by their mean at the start",
        "its defaults at 200 Hz, gyr_cov 0.1 and b_gyr_cov 1e-4, are N = 77 deg/sqrt(h) and K = 8750 deg/h/sqrt(h)",
    ),
)
TERMS = CONSUMER.terms


def _template(imu: WalkImu, rate: float) -> list[str]:
    """A part of the configuration file, in place of the four lines there."""
    lines = imu.lines(USAGE.slots, "    {key}: {value}  # {unit}", "    # {key}:  # {unit}", rate=rate)
    return [*imu.comment(), "", "mapping:", *lines]


write = sample_writer(_template, white_and_walk, CONSUMER)
