# SPDX-License-Identifier: BSD-3-Clause
"""imu.yaml of Kalibr: https://github.com/ethz-asl/kalibr/wiki/IMU-Noise-Model (continuous densities in SI).

Kalibr's model of a sensor is white noise and a random walk of the bias; it discretises both itself (noise * sqrt(rate),
walk / sqrt(rate)). A third term, the bias instability, has no slot and must be folded into the walk
(`allanite.exporters.imu.walks`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Unpack

from allanite.errors import InputError
from allanite.exporters.imu import (
    ACCELEROMETER,
    GYROSCOPE,
    WALK,
    Consumer,
    N,
    NoiseOptions,
    Program,
    Slot,
    Usage,
    WalkImu,
    white_and_walk,
)

__all__ = [
    "FILE_NAME",
    "NAME",
    "SUMMARY",
    "TAKES",
    "TERMS",
    "USAGE",
    "noise_lines",
    "open_lines",
    "topic_line",
    "write",
]

NAME = "kalibr"
FILE_NAME = "imu.yaml"
SUMMARY = "Kalibr, and whoever reads its imu.yaml: white noise and bias random walk, continuous, SI"
TAKES = "study"
USAGE = Usage(
    programs=(
        Program(
            "Kalibr", "ethz-asl/kalibr: aslam_offline_calibration/kalibr/python/kalibr_common/ConfigReader.py"
        ),
    ),
    slots=(
        Slot("accelerometer_noise_density", ACCELEROMETER, N, "m/s^2/sqrt(Hz)"),
        Slot("accelerometer_random_walk", ACCELEROMETER, WALK, "m/s^3/sqrt(Hz)"),
        Slot("gyroscope_noise_density", GYROSCOPE, N, "rad/s/sqrt(Hz)"),
        Slot("gyroscope_random_walk", GYROSCOPE, WALK, "rad/s^2/sqrt(Hz)"),
    ),
    trap="random_walk is the random walk of the bias, neither an angle random walk nor a bias instability",
)
CONSUMER = Consumer(
    name="Kalibr",
    file=FILE_NAME,
    usage=USAGE,
    convention=("continuous-time root densities in SI units, two-sided; Kalibr makes them discrete itself",),
)
TERMS = CONSUMER.terms

Json = Mapping[str, Any]

_TOPIC = r"[/~A-Za-z][A-Za-z0-9_/]*"
_BLANK = "# {key}:  # {unit}"


def write(document: Json, *, rostopic: str | None = None, **options: Unpack[NoiseOptions]) -> str:
    """The text of imu.yaml.

    Parameters
    ----------
    document : dict
        A study document.
    rostopic : str, optional
        Topic of the IMU in the bag that Kalibr will read; that of the log by default. A log without one gets "/imu0",
        with a comment.
    **options
        `NoiseOptions`.

    Raises
    ------
    InputError
        A name that is no topic, or what `white_and_walk` refuses.
    """
    topic = topic_line(document, rostopic)
    imu = white_and_walk(document, CONSUMER, **options)
    return "\n".join([*imu.comment(), "", topic, *noise_lines(imu)]) + "\n"


def topic_line(document: Json, rostopic: str | None) -> str:
    """The topic that is asked for, or that the study was read from.

    Raises
    ------
    InputError
        What is asked for is no name of a ROS topic.
    """
    if rostopic is not None:
        if not re.fullmatch(_TOPIC, rostopic):
            raise InputError(f"{rostopic!r} is not the name of a ROS topic")
        return f"rostopic: {rostopic}"
    steps = document.get("recording", {}).get("history", ())
    topics = {step.get("topic") for step in steps if step.get("format") == "ROS" and step.get("topic")}
    if not topics:
        return "rostopic: /imu0  # PLACEHOLDER: the log names no topic; set that of your bag (--rostopic)"
    topic = str(topics.pop())
    if topics or not re.fullmatch(_TOPIC, topic):
        return (
            "rostopic: /imu0  # PLACEHOLDER: the log is of several topics, or of a message that is no Imu by itself "
            "(--rostopic)"
        )
    return f"rostopic: {topic}"


def noise_lines(imu: WalkImu) -> list[str]:
    """The rate and the four numbers, under the names of Kalibr."""
    return [f"update_rate: {imu.frequency}", *imu.lines(USAGE.slots, "{key}: {value}  # {unit}", _BLANK)]


def open_lines() -> list[str]:
    """The same lines to fill in."""
    return ["# update_rate:  # Hz", *(slot.left_open(_BLANK) for slot in USAGE.slots)]
