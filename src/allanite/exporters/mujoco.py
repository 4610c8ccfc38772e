# SPDX-License-Identifier: BSD-3-Clause
"""Sensors of an IMU in MJCF, with the noise of a sample in their attribute (SI).

Since 3.1.4 MuJoCo adds no noise: the attribute is kept in mjModel.sensor_noise for whoever adds it (changelog, 3.1.4).
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

NAME = "mujoco"
FILE_NAME = "mujoco_imu.xml"
SUMMARY = (
    "MuJoCo: noise of gyro and accelerometer in MJCF, the deviation of one sample, yours to add; no walk"
)
TAKES = "study"
USAGE = Usage(
    programs=(Program("MuJoCo", "google-deepmind/mujoco: doc/changelog.rst, version 3.1.4"),),
    slots=(
        Slot("gyro.noise", GYROSCOPE, N.of_a_sample, "rad/s"),
        Slot("accelerometer.noise", ACCELEROMETER, N.of_a_sample, "m/s^2"),
    ),
    trap="MuJoCo adds no noise since 3.1.4: add sensor_noise randn() to sensordata yourself, once per sample",
    lost="bias instability and random walk: the bias is zero",
)
CONSUMER = Consumer(
    name="MuJoCo",
    file=FILE_NAME,
    usage=USAGE,
    convention=("noise = N sqrt(f), f the rate at which you add it",),
    simulator=True,
    terms=("N",),
)
TERMS = CONSUMER.terms


def _template(imu: WhiteImu, rate: float) -> list[str]:
    """The sensors; they go into a model with a site of the IMU."""
    # two hyphens would end an XML comment
    lines = ["<!--", *(line.replace("--", "- -") for line in imu.comments), "-->", "<sensor>"]
    for slot in USAGE.slots:
        element, key = slot.key.split(".")
        if slot.sensor not in imu.noise:
            lines.append(f"  <!-- {element}: not in the study: fill in, or it has no noise -->")
            continue
        value = imu.text(imu.values(slot, rate)[0])
        lines.append(f'  <{element} name="{element}" site="imu" {key}="{value}"/>  <!-- {slot.unit} -->')
    return [*lines, "</sensor>"]


write = white_writer(_template, CONSUMER)
