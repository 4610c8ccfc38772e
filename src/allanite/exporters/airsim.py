# SPDX-License-Identifier: BSD-3-Clause
"""The IMU of AirSim, an element of its settings.json (deg/sqrt(h), mg/sqrt(Hz), deg/h, ug, s).

ImuSimple adds white noise of the density over the root of the time since the last sample, which it takes for no less
than 1 ms, and moves the bias in that time by GyroBiasStability/sqrt(GyroBiasStabilityTau) times its root: a walk, which
never settles. The time tau is a scale and nothing else; this file keeps the defaults of it.
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
    white_and_walk,
    writer,
)
from allanite.exporters.imu.json_comments import json_comments

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "airsim"
FILE_NAME = "airsim_imu.json"
SUMMARY = "AirSim: AngularRandomWalk, VelocityRandomWalk and a bias that walks, of the Imu in settings.json"
TAKES = "study"

#: Key of tau and its default [s]: what AirSim divides the stability by the root of.
_TAUS = {GYROSCOPE: ("GyroBiasStabilityTau", 500.0), ACCELEROMETER: ("AccelBiasStabilityTau", 800.0)}
_STABILITY = {sensor: WALK.times(math.sqrt(tau), f"√{tau:.0f}") for sensor, (_, tau) in _TAUS.items()}
USAGE = Usage(
    programs=(
        Program(
            "AirSim",
            "microsoft/AirSim: AirLib/include/sensors/imu/ImuSimple.hpp, ImuSimpleParams.hpp",
        ),
    ),
    slots=(
        Slot("AngularRandomWalk", GYROSCOPE, N, "deg/sqrt(h)"),
        Slot("GyroBiasStability", GYROSCOPE, _STABILITY[GYROSCOPE], "deg/h"),
        Slot("VelocityRandomWalk", ACCELEROMETER, N, "mg/sqrt(Hz)"),
        Slot("AccelBiasStability", ACCELEROMETER, _STABILITY[ACCELEROMETER], "ug"),
    ),
    trap="the bias is a random walk of stability/sqrt(tau) and never settles: a bias instability there drifts without "
    "limit, and so does the default, by 12 deg/h in an hour",
)
CONSUMER = Consumer(
    name="AirSim",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "continuous: AirSim makes the numbers discrete itself; above 1000 samples per second its noise is too small",
        "it goes into Vehicles, <name>, Sensors of settings.json",
    ),
    simulator=True,
)
TERMS = CONSUMER.terms


def _template(imu: WalkImu) -> list[str]:
    """An element of Sensors."""
    members = ['  "SensorType": 2', '  "Enabled": true', *imu.lines(USAGE.slots, '  "{key}": {value}')]
    members += [f'  "{key}": {imu.text(tau)}' for sensor, (key, tau) in _TAUS.items() if sensor in imu.noise]
    return ["{", ' "Imu": {', ",\n".join(members) + ",", *json_comments(imu.comments, 2), " }", "}"]


write = writer(_template, white_and_walk, CONSUMER)
