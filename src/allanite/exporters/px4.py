# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of PX4's EKF2 (discrete at EKF2_PREDICT_US, 10 ms), in the form of a parameter file of QGroundControl.

The discretisation (`allanite.exporters.imu.autopilot`) is that of predictCovariance in its EKF/covariance.cpp.
"""

from __future__ import annotations

from allanite.exporters.imu import ACCELEROMETER, GYROSCOPE, WALK, N, Program, Slot, Usage
from allanite.exporters.imu.autopilot import LOWER_BOUNDS, autopilot_writer

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "px4"
FILE_NAME = "px4_ekf2.params"
SUMMARY = "PX4 EKF2: EKF2_GYR_NOISE, EKF2_ACC_NOISE and their biases, as lower bounds in comments"
TAKES = "study"
TERMS = ("N", "K")
USAGE = Usage(
    programs=(Program("PX4 EKF2", "PX4/PX4-Autopilot: src/modules/ekf2/EKF/covariance.cpp"),),
    slots=(
        Slot("EKF2_GYR_NOISE", GYROSCOPE, N.of_a_sample, "rad/s"),
        Slot("EKF2_ACC_NOISE", ACCELEROMETER, N.of_a_sample, "m/s^2"),
        Slot("EKF2_GYR_B_NOISE", GYROSCOPE, WALK.of_a_sample, "rad/s^2"),
        Slot("EKF2_ACC_B_NOISE", ACCELEROMETER, WALK.of_a_sample, "m/s^3"),
    ),
    trap=LOWER_BOUNDS,
)

write = autopilot_writer(
    name="PX4 EKF2",
    file=FILE_NAME,
    usage=USAGE,
    line="1\t1\t{key}\t{value}\t9",
    rate=100.0,  # 1e6/EKF2_PREDICT_US
    read=(
        "read in PX4, EKF/covariance.cpp: (dt noise)^2 of delta angle and (dt bias noise)^2 of the bias a step",
        "the bias noise only while the variance of the bias is below the square of the noise",
        "its defaults, 0.015 rad/s and 1e-3 rad/s^2, are N = 5.2 deg/sqrt(h) and K = 1240 deg/h/sqrt(h)",
    ),
)
