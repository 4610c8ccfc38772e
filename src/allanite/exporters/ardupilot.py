# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of ArduPilot's EKF3 (discrete at its target period, 12 ms), in the form of a parameter file.

The discretisation (`allanite.exporters.imu.autopilot`) is that of CovariancePrediction in
libraries/AP_NavEKF3/AP_NavEKF3_core.cpp: a delta angle has the variance sq(dt EK3_GYRO_P_NSE), and the bias of a
delta angle gets sq(sq(dt) EK3_GBIAS_P_NSE) in each step; likewise delta velocities. dt is the mean of the delta-angle
and delta-velocity times, which are collected to EKF_TARGET_DT = 12 ms, or to the period of the main loop where that
is longer.
"""

from __future__ import annotations

from allanite.exporters.imu import ACCELEROMETER, GYROSCOPE, WALK, N, Program, Slot, Usage
from allanite.exporters.imu.autopilot import LOWER_BOUNDS, autopilot_writer

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "ardupilot"
FILE_NAME = "ardupilot_ek3.param"
SUMMARY = "ArduPilot EKF3: EK3_GYRO_P_NSE, EK3_ACC_P_NSE and their biases, as lower bounds in comments"
TAKES = "study"
TERMS = ("N", "K")
USAGE = Usage(
    programs=(Program("ArduPilot EKF3", "ArduPilot/ardupilot: libraries/AP_NavEKF3/AP_NavEKF3_core.cpp"),),
    slots=(
        Slot("EK3_GYRO_P_NSE", GYROSCOPE, N.of_a_sample, "rad/s"),
        Slot("EK3_ACC_P_NSE", ACCELEROMETER, N.of_a_sample, "m/s^2"),
        Slot("EK3_GBIAS_P_NSE", GYROSCOPE, WALK.of_a_sample, "rad/s^2"),
        Slot("EK3_ABIAS_P_NSE", ACCELEROMETER, WALK.of_a_sample, "m/s^3"),
    ),
    trap=LOWER_BOUNDS,
)

write = autopilot_writer(
    name="ArduPilot EKF3",
    file=FILE_NAME,
    usage=USAGE,
    line="{key},{value}",
    rate=1 / 0.012,  # the lower one of 83.3 Hz and the rate of the main loop
    read=(
        "read in AP_NavEKF3_core.cpp, CovariancePrediction: sq(dt GYRO_P_NSE) of delta angle and",
        "sq(sq(dt) GBIAS_P_NSE) of its bias a step; EKF_TARGET_DT is 12 ms, longer with a main loop below 83 Hz",
    ),
)
