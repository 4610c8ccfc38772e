# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of PX4's EKF2 (discrete at EKF2_PREDICT_US, 10 ms), in the form of a parameter file of QGroundControl.

The discretisation (`allanite.exporters.imu.autopilot`) is that of predictCovariance in its EKF/covariance.cpp.
"""

from __future__ import annotations

from allanite.exporters.imu import ACCELEROMETER, GYROSCOPE, Slot
from allanite.exporters.imu.autopilot import autopilot_writer

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "px4"
FILE_NAME = "px4_ekf2.params"
SUMMARY = "PX4 EKF2: EKF2_GYR_NOISE, EKF2_ACC_NOISE and their biases, as lower bounds in comments"
TAKES = "study"
TERMS = ("N", "K")

write = autopilot_writer(
    name="PX4 EKF2",
    file=FILE_NAME,
    slots=(
        Slot("EKF2_GYR_NOISE", GYROSCOPE, "noise", "rad/s"),
        Slot("EKF2_ACC_NOISE", ACCELEROMETER, "noise", "m/s^2"),
        Slot("EKF2_GYR_B_NOISE", GYROSCOPE, "walk", "rad/s^2"),
        Slot("EKF2_ACC_B_NOISE", ACCELEROMETER, "walk", "m/s^3"),
    ),
    line="1\t1\t{key}\t{value}\t9",
    rate=100.0,  # 1e6/EKF2_PREDICT_US
    read=(
        "read in PX4, EKF/covariance.cpp: (dt noise)^2 of delta angle and (dt bias noise)^2 of the bias a step",
        "its defaults, 0.015 rad/s and 1e-3 rad/s^2, are N = 5.2 deg/sqrt(h) and K = 1240 deg/h/sqrt(h)",
    ),
)
