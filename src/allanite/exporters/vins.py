# SPDX-License-Identifier: BSD-3-Clause
"""The IMU part of the configuration of VINS-Mono and VINS-Fusion (discrete, at the rate of the IMU).

Its mid-point preintegration adds to the covariance in a step dt: 2 (dt/2)^2 gyr_n^2 of angle, the noise of the two
samples taken as independent, and dt^2 gyr_w^2 of bias (vins_estimator, integration_base.h). So a density N needs
gyr_n = N sqrt(2 f), and a walk needs gyr_w = walk sqrt(f): multiplied by the root of the rate, not divided.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Unpack

from allanite.errors import InputError
from allanite.exporters.imu import ACCELEROMETER, GYROSCOPE, Consumer, NoiseOptions, rate_text, white_and_walk

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "vins"
FILE_NAME = "vins_imu.yaml"
SUMMARY = "VINS-Mono and VINS-Fusion: acc_n, gyr_n, acc_w, gyr_w of one step at the rate of the IMU"
TAKES = "study"
TERMS = ("N", "K")

Json = Mapping[str, Any]

_KEYS = {ACCELEROMETER: ("acc_n", "acc_w"), GYROSCOPE: ("gyr_n", "gyr_w")}
_UNITS = {ACCELEROMETER: ("m/s^2", "m/s^3"), GYROSCOPE: ("rad/s", "rad/s^2")}


def write(document: Json, *, filter_rate: float | None = None, **options: Unpack[NoiseOptions]) -> str:
    """The text of the IMU part; it goes into the configuration file in place of the four lines there.

    Parameters
    ----------
    document : dict
        A study document.
    filter_rate : float, optional [Hz]
        Rate of the IMU messages that VINS gets; that of the study by default.
    **options
        `NoiseOptions`.

    Raises
    ------
    InputError
        A rate that is none, or what `white_and_walk` refuses.
    """
    rate = document["recording"]["rate"] if filter_rate is None else filter_rate
    if not (math.isfinite(rate) and rate > 0):
        raise InputError(f"filter_rate must be a positive number of samples per second, not {rate!r}")
    consumer = Consumer(
        name="VINS-Mono and VINS-Fusion",
        file=FILE_NAME,
        convention=(
            f"DISCRETE: standard deviations of one step at {rate_text(rate)} Hz; for another rate export again",
            "n = N sqrt(2 f): its step takes the noise of two samples for independent, each with half the weight",
            "(n = N sqrt(f), in common use, is half of the variance in its code); w = walk sqrt(f)",
        ),
    )
    imu = white_and_walk(document, consumer, **options)
    lines = ["%YAML:1.0", "", *imu.comment(), ""]
    for sensor, (noise, walk) in _KEYS.items():
        units = _UNITS[sensor]
        if sensor not in imu.noise:
            lines += [f"# {noise}:  # {units[0]}", f"# {walk}:  # {units[1]}"]
            continue
        lines += [
            f"{noise}: {imu.text(imu.noise[sensor][0] * math.sqrt(2 * rate))}  # {units[0]}",
            f"{walk}: {imu.text(imu.walk[sensor][0] * math.sqrt(rate))}  # {units[1]}",
        ]
    return "\n".join(lines) + "\n"
