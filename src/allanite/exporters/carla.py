# SPDX-License-Identifier: BSD-3-Clause
"""Attributes of CARLA's sensor.other.imu, as a Python module (standard deviations of one sample in SI, per axis).

The sensor adds independent normal noise of noise_accel_stddev and noise_gyro_stddev to every sample, and the constant
noise_gyro_bias (InertialMeasurementUnit.cpp). A sample comes every sensor_tick.
"""

from __future__ import annotations

from allanite.exporters.imu import (
    ACCELEROMETER,
    GYROSCOPE,
    Consumer,
    N,
    Program,
    Slot,
    Usage,
    WhiteImu,
    white_writer,
)

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "carla"
FILE_NAME = "carla_imu.py"
SUMMARY = (
    "CARLA: noise_accel_stddev and noise_gyro_stddev of sensor.other.imu, of one sample, per axis; no walk"
)
TAKES = "study"
USAGE = Usage(
    programs=(
        Program(
            "CARLA",
            "carla-simulator/carla: Unreal/CarlaUE4/Plugins/Carla/Source/Carla/Sensor/InertialMeasurementUnit.cpp",
        ),
    ),
    slots=(
        Slot("noise_accel_stddev_", ACCELEROMETER, N.of_a_sample, "m/s^2", axes="xyz"),
        Slot("noise_gyro_stddev_", GYROSCOPE, N.of_a_sample, "rad/s", axes="xyz"),
    ),
    trap="without sensor_tick CARLA samples once per frame, at any rate; a density is far too small",
    lost="bias instability and random walk: noise_gyro_bias is a constant, and the accelerometers have none",
)
CONSUMER = Consumer(
    name="CARLA",
    file=FILE_NAME,
    usage=USAGE,
    convention=("stddev = N sqrt(f), f = 1/sensor_tick, which is set below",),
    per_axis=True,
    simulator=True,
    terms=("N",),
)
TERMS = CONSUMER.terms

_END = '''

def apply(blueprint):
    """Set what is above in world.get_blueprint_library().find("sensor.other.imu"), and return it."""
    for key, value in ATTRIBUTES.items():
        blueprint.set_attribute(key, value)
    return blueprint
'''


def _template(imu: WhiteImu, rate: float) -> list[str]:
    """A Python module: the attributes, which CARLA takes as text, and a function that sets them."""
    lines = imu.lines(
        USAGE.slots, '    "{key}": "{value}",  # {unit}', '    # "{key}": "",  # {unit}', rate=rate
    )
    tick = f'    "sensor_tick": "{imu.text(1 / rate)}",  # s'
    return [*imu.comment(), "", "ATTRIBUTES = {", tick, *lines, "}", *_END.splitlines()]


write = white_writer(_template, CONSUMER)
