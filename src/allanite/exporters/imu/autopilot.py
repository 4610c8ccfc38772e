# SPDX-License-Identifier: BSD-3-Clause
"""The filters of the two autopilots: standard deviations of one period, in parameters that are lower bounds here.

Both predict the covariance in periods dt, and both add (dt noise)^2 to each delta angle and (dt^2 b_noise)^2 to the
bias of a delta angle, which is dt times the bias: to the bias itself (dt b_noise)^2. So noise = N/sqrt(dt) and
b_noise = walk/sqrt(dt).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from allanite.errors import InputError
from allanite.exporters.imu.axes import ACCELEROMETER, GYROSCOPE
from allanite.exporters.imu.preamble import Consumer
from allanite.exporters.imu.white_and_walk import WalkImu, white_and_walk

__all__ = ["autopilot_lines"]

Json = Mapping[str, Any]


def autopilot_lines(
    document: Json,
    *,
    name: str,
    file: str,
    keys: Mapping[str, Sequence[str]],
    line: str,
    rate: float,
    read: Sequence[str],
    options: Mapping[str, Any],
) -> list[str]:
    """Comment, and the parameters as comments: a value of the sensor alone makes a filter overconfident in flight.

    Parameters
    ----------
    keys : mapping of str to sequence of str
        Of noise and walk, by sensor.
    line : str
        Of a parameter, with "{key}" and "{value}".
    rate : float [Hz]
        Of the filter's predictions.
    read : sequence of str
        Where the discretisation was read, and what the defaults stand for.

    Raises
    ------
    InputError
        A rate that is none, or what `white_and_walk` refuses.
    """
    if not (math.isfinite(rate) and rate > 0):
        raise InputError(f"filter_rate must be a positive number of predictions per second, not {rate!r}")
    consumer = Consumer(
        name=name,
        file=file,
        convention=(
            f"DISCRETE at the period of the filter, dt = {1000 / rate:.6g} ms",
            "noise = N/sqrt(dt), bias noise = walk/sqrt(dt)",
            *read,
            "LOWER BOUNDS: noise of the sensor at rest, without the vibration of an airframe. The lines are comments:",
            "take one in only where it raises the value that is set",
        ),
    )
    imu = white_and_walk(document, consumer, **options)
    return [*imu.comment(), "", *(_lines(imu, keys, line, rate))]


def _lines(imu: WalkImu, keys: Mapping[str, Sequence[str]], line: str, rate: float) -> list[str]:
    found = []
    for place, values in enumerate((imu.noise, imu.walk)):
        for sensor in (GYROSCOPE, ACCELEROMETER):
            if sensor in values:
                value = imu.text(values[sensor][0] * math.sqrt(rate))
                found.append("# " + line.format(key=keys[sensor][place], value=value))
    return found
