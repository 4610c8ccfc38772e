# SPDX-License-Identifier: BSD-3-Clause
"""The IMU part of the settings of ORB-SLAM3 (continuous densities in SI; the file form is that of its EuRoC example).

It multiplies the noise by the root of IMU.Frequency and divides the walk by it. Files of version 1.0 read the frequency
as a real number; without "File.version" an integer is asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Unpack

from allanite.exporters.imu import ACCELEROMETER, GYROSCOPE, Consumer, NoiseOptions, rate_text, white_and_walk
from allanite.exporters.imu.axes import UNITS

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "orb_slam3"
FILE_NAME = "orb_slam3_imu.yaml"
SUMMARY = "ORB-SLAM3: IMU.NoiseGyro, IMU.NoiseAcc, IMU.GyroWalk, IMU.AccWalk, continuous, SI"
TAKES = "study"
CONSUMER = Consumer(
    name="ORB-SLAM3",
    file=FILE_NAME,
    convention=(
        "continuous-time root densities in SI units, two-sided; ORB-SLAM3 makes them discrete at IMU.Frequency itself",
        'for settings with File.version: "1.0"; older ones read IMU.Frequency as an integer',
    ),
)
TERMS = CONSUMER.terms

_KEYS = {GYROSCOPE: ("IMU.NoiseGyro", "IMU.GyroWalk"), ACCELEROMETER: ("IMU.NoiseAcc", "IMU.AccWalk")}


def write(document: Mapping[str, Any], **options: Unpack[NoiseOptions]) -> str:
    """The text of the IMU part of a settings file.

    Parameters
    ----------
    document : dict
        A study document.
    **options
        `NoiseOptions`.

    Raises
    ------
    InputError
        What `white_and_walk` refuses.
    """
    imu = white_and_walk(document, CONSUMER, **options)
    lines = ["%YAML:1.0", "", *imu.comment(), ""]
    for place, values in enumerate((imu.noise, imu.walk)):
        for sensor, keys in _KEYS.items():
            unit = UNITS[sensor][place]
            if sensor in values:
                lines.append(f"{keys[place]}: {imu.text(values[sensor][0])}  # {unit}")
            else:
                lines.append(f"# {keys[place]}:  # {unit}")
    lines.append(f"IMU.Frequency: {rate_text(imu.rate)}")
    lines.append("# IMU.T_b_c1:  # camera to IMU, from the calibration of the camera")
    return "\n".join(lines) + "\n"
