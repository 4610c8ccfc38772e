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
    Consumer,
    NoiseOptions,
    WalkImu,
    rate_text,
    white_and_walk,
)
from allanite.exporters.imu.axes import UNITS

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "noise_lines", "refuse_topic", "write"]

NAME = "kalibr"
FILE_NAME = "imu.yaml"
SUMMARY = "Kalibr, and whoever reads its imu.yaml: white noise and bias random walk, continuous, SI"
TAKES = "study"
CONSUMER = Consumer(
    name="Kalibr",
    file=FILE_NAME,
    convention=("continuous-time root densities in SI units, two-sided; Kalibr makes them discrete itself",),
)
TERMS = CONSUMER.terms

Json = Mapping[str, Any]


def write(document: Json, *, rostopic: str = "/imu0", **options: Unpack[NoiseOptions]) -> str:
    """The text of imu.yaml.

    Parameters
    ----------
    document : dict
        A study document.
    rostopic : str
    **options
        `NoiseOptions`.

    Raises
    ------
    InputError
        A name that is no topic, or what `white_and_walk` refuses.
    """
    refuse_topic(rostopic)
    imu = white_and_walk(document, CONSUMER, **options)
    return "\n".join([*imu.comment(), "", f"rostopic: {rostopic}", *noise_lines(imu)]) + "\n"


def refuse_topic(rostopic: str) -> None:
    """Raise if this is no name of a ROS topic."""
    if not re.fullmatch(r"[/~A-Za-z][A-Za-z0-9_/]*", rostopic):
        raise InputError(f"{rostopic!r} is not the name of a ROS topic")


def noise_lines(imu: WalkImu) -> list[str]:
    """The rate and the four numbers, under the names of Kalibr."""
    lines = [f"update_rate: {rate_text(imu.rate)}"]
    for sensor in (ACCELEROMETER, GYROSCOPE):
        noise, walk = UNITS[sensor]
        if sensor not in imu.noise:
            lines += [f"# {sensor}_noise_density:  # {noise}", f"# {sensor}_random_walk:  # {walk}"]
            continue
        lines += [
            f"{sensor}_noise_density: {imu.text(imu.noise[sensor][0])}  # {noise}",
            f"{sensor}_random_walk: {imu.text(imu.walk[sensor][0])}  # {walk}",
        ]
    return lines
