# SPDX-License-Identifier: BSD-3-Clause
"""imunoise of KF-GINS (deg/sqrt(h), m/s/sqrt(h), deg/h, mGal; one correlation time in hours; names of its example).

Its biases are Gauss-Markov processes with the density 2 sigma^2/T, of one correlation time for both triads and their
scale factors. Their standard deviations are the initial ones as well, where initbgstd and initbastd are not given.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Unpack

from allanite.exporters.imu import (
    ACCELEROMETER,
    GYROSCOPE,
    SENSORS,
    Consumer,
    MarkovOptions,
    common_time,
    gauss_markov_imu,
)
from allanite.units import parse_unit

__all__ = ["FILE_NAME", "KEYS", "NAME", "SUMMARY", "TAKES", "TERMS", "write"]

NAME = "kf_gins"
FILE_NAME = "kf_gins_imu.yaml"
SUMMARY = "KF-GINS: imunoise with arw, vrw, gbstd, abstd per axis and corrtime in hours"
TAKES = "study"
CONSUMER = Consumer(
    name="KF-GINS",
    file=FILE_NAME,
    convention=(
        "continuous: KF-GINS makes the numbers discrete itself",
        "gbstd, abstd: stationary standard deviation of the Gauss-Markov bias; its density is 2 sigma^2/corrtime",
        "they are the initial standard deviations as well, unless initbgstd and initbastd say otherwise",
    ),
    per_axis=True,
)
TERMS = CONSUMER.terms

#: Key, quantity, and unit by sensor, in the order of the file.
KEYS = (
    ("arw", GYROSCOPE, "noise", "deg/√h"),
    ("vrw", ACCELEROMETER, "noise", "m/s/√h"),
    ("gbstd", GYROSCOPE, "sigma", "deg/h"),
    ("abstd", ACCELEROMETER, "sigma", "mGal"),
)
_OPEN = (
    "# gsstd: [ , , ]  # ppm, scale factors of the gyroscopes, from the data sheet or a calibration",
    "# asstd: [ , , ]  # ppm, of the accelerometers",
)


def write(document: Mapping[str, Any], **options: Unpack[MarkovOptions]) -> str:
    """The text of imunoise, a part of the configuration file.

    Parameters
    ----------
    document : dict
        A study document.
    **options
        `MarkovOptions`.

    Raises
    ------
    InputError
        Several correlation times, or what `gauss_markov_imu` refuses.
    """
    imu = gauss_markov_imu(document, CONSUMER, **options)
    time = common_time(imu, FILE_NAME, SENSORS)
    lines = [*imu.comment(), "", "imunoise:"]
    for key, sensor, what, of in KEYS:
        unit = of.replace("√h", "sqrt(h)")
        if sensor not in imu.noise:
            lines.append(f"  # {key}: [ , , ]  # {unit}, not in the study")
            continue
        values = imu.noise[sensor] if what == "noise" else imu.sigma[sensor]
        lines.append(f"  {key}: {imu.row([v / parse_unit(of).factor for v in values])}  # {unit}")
    lines += [*(f"  {line}" for line in _OPEN), f"  corrtime: {imu.text(time / 3600)}  # h"]
    return "\n".join(lines) + "\n"
