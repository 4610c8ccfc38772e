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
from allanite.exporters.imu import (
    ACCELEROMETER,
    GYROSCOPE,
    Consumer,
    NoiseOptions,
    Slot,
    rate_text,
    white_and_walk,
)

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "vins"
FILE_NAME = "vins_imu.yaml"
SUMMARY = "VINS-Mono and VINS-Fusion: acc_n, gyr_n, acc_w, gyr_w of one step at the rate of the IMU"
TAKES = "study"
TERMS = ("N", "K")

Json = Mapping[str, Any]

_SLOTS = (
    Slot("acc_n", ACCELEROMETER, "noise", "m/s^2"),
    Slot("acc_w", ACCELEROMETER, "walk", "m/s^3"),
    Slot("gyr_n", GYROSCOPE, "noise", "rad/s"),
    Slot("gyr_w", GYROSCOPE, "walk", "rad/s^2"),
)


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
    discrete = imu.scaled(noise=math.sqrt(2 * rate), walk=math.sqrt(rate))
    lines = discrete.lines(_SLOTS, "{key}: {value}  # {unit}", "# {key}:  # {unit}")
    return "\n".join(["%YAML:1.0", "", *imu.comment(), "", *lines]) + "\n"
